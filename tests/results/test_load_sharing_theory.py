"""The compatibility calculation of load sharing against theorems and sums done by hand."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from load_sharing_theory import FIXED, equal_paths, factor, fixed_sun, path_errors, sharing
from lumped_stage import ALPHA, BEARING, GEAR_MESH, RADIUS, lin_parker

from flexgear.analysis.harmonic import GearMeshRows, steady_state

TORQUE = 5e4
TOTAL = TORQUE / 0.1


def paths(planets, **more):
    return equal_paths(
        planets, sun_stiffness=2e9, ring_stiffness=3e9, planet_bearing=1e9, **more
    )  # fmt: skip


def errors(planets):
    return arrays(float, planets, elements=st.floats(-1e-5, 1e-5))


@given(e=errors(3), radial=errors(3))
def test_free_sun_on_three_planets_shares_evenly(e, radial):
    p = paths(3, ring_angle=np.radians(18.0))
    force = sharing(p, path_errors(p, pin_tangential=e, pin_radial=radial), TORQUE)
    np.testing.assert_allclose(force, TOTAL / 3, rtol=1e-9)


@given(e=errors(3))
def test_floating_ring_or_carrier_does_the_same(e):
    for freedom in ({"ring": 0.0}, {"carrier": 0.0}):
        force = sharing(paths(3), e, TORQUE, sun=FIXED, **freedom)
        np.testing.assert_allclose(force, TOTAL / 3, rtol=1e-9)


@given(e=errors(5))
def test_fixed_sun_by_hand(e):
    p = paths(5)
    np.testing.assert_allclose(sharing(p, e, TORQUE, sun=FIXED), fixed_sun(p, e, TORQUE), rtol=1e-9)


@given(e=errors(4))
def test_four_planets_and_a_free_sun_feel_only_the_difference_of_diagonals(e):
    """F_i = F̄ ± k (e₁ − e₂ + e₃ − e₄)/4: the one pattern that neither turn nor shift takes up."""
    p = paths(4)
    pattern = np.array([1.0, -1.0, 1.0, -1.0])
    wanted = TOTAL / 4 + p.stiffness * pattern * (pattern @ e) / 4
    np.testing.assert_allclose(sharing(p, e, TORQUE), wanted, rtol=1e-9)


@given(e=errors(7))
def test_free_sun_takes_harmonics_0_and_1_of_the_errors_away(e):
    p = paths(7)
    harmonics = np.fft.fft(e)
    harmonics[[0, 1, -1]] = 0
    wanted = TOTAL / 7 + p.stiffness * np.fft.ifft(harmonics).real
    np.testing.assert_allclose(sharing(p, e, TORQUE), wanted, rtol=1e-9)


def test_path_of_springs_in_series_by_hand():
    p = paths(3, sun_angle=0.3, ring_angle=0.5)
    both = np.array([np.sin(0.3) - np.sin(0.5), -np.cos(0.3) - np.cos(0.5)])
    np.testing.assert_allclose(p.stiffness, 1 / (1 / 2e9 + 1 / 3e9 + both @ both / 1e9))
    # a pin that leads by t closes both gear meshes by t cos α
    np.testing.assert_allclose(
        path_errors(p, pin_tangential=1e-5), (np.cos(0.3) + np.cos(0.5)) * 1e-5
    )
    np.testing.assert_allclose(path_errors(paths(3), pin_radial=1e-5), 0.0, atol=1e-20)


def test_single_leading_pin_and_a_fixed_sun():
    """K = 1 + (N − 1) k e / (N F̄)."""
    p = paths(4)
    e = np.array([1e-5, 0, 0, 0])
    wanted = 1 + 3 * p.stiffness[0] * 1e-5 / TOTAL
    assert factor(sharing(p, e, TORQUE, sun=FIXED)) == pytest.approx(wanted, rel=1e-12)


@given(e=errors(5))
def test_support_leads_from_floating_to_fixed(e):
    p = paths(5)
    k = [factor(sharing(p, e, TORQUE, sun=s)) for s in (0.0, 1e3, 1e15, FIXED)]
    assert k[0] == pytest.approx(k[1], rel=1e-4) and k[2] == pytest.approx(k[3], rel=1e-4)


@given(e=errors(5))
def test_torque_evens_out_and_helix_only_scales(e):
    p, h = paths(5), paths(5, base_helix_angle=0.3)
    one, two = (factor(sharing(p, e, t, sun=FIXED)) - 1 for t in (TORQUE, 2 * TORQUE))
    assert two == pytest.approx(one / 2, rel=1e-9, abs=1e-12)
    c = np.cos(0.3)
    assert sharing(h, e, TORQUE).sum() * c == pytest.approx(TOTAL, rel=1e-12)


@given(e=arrays(float, 6, elements=st.floats(-2e-3, 2e-3)))
def test_planets_that_cannot_pull_carry_or_stand_clear(e):
    p = paths(6)
    force = sharing(p, e, TORQUE, sun=FIXED, one_sided=True)
    assert force.min() >= 0 and force.sum() == pytest.approx(TOTAL, rel=1e-9)
    shift = np.unique(np.round((force / p.stiffness - e)[force > 0], 12))
    assert np.ptp(shift) < 1e-9  # planets at work agree on the sun's turn
    assert np.all(e[force == 0] + shift[0] <= 1e-9)


@pytest.mark.parametrize("sun", [0.0, 3e7, 1e15])
@pytest.mark.parametrize("ring", [2e7, 1e15])
def test_paths_are_what_a_lumped_stage_does(sun, ring):
    """Every planet with its own coordinates, ring and carrier held: the same forces."""
    torque, e = 400.0, np.array([[8e-6, -3e-6, 0, 5e-6, 1e-6], [2e-6, 0, 4e-6, -7e-6, 0]])
    stage = lin_parker(
        5, ring_torsion=1e16, central={"sun": sun, "ring": ring, "carrier": 1e15}
    )  # fmt: skip
    hold = np.zeros_like(stage.mass)
    hold[8, 8] = 1e15  # the carrier does not turn
    loads = np.zeros((len(stage.mass), 1))
    loads[2] = -torque
    rows = GearMeshRows(stage.rows, stage.gear_mesh_stiffness, np.zeros(10))
    s = steady_state(stage.mass, hold * 0, stage.support + hold, rows, [0.0], e.ravel(), loads)
    ring_force, sun_force = s.forces.real.reshape(2, 5)
    np.testing.assert_allclose(ring_force, sun_force, rtol=1e-6)
    p = equal_paths(
        5, sun_stiffness=GEAR_MESH, ring_stiffness=GEAR_MESH, planet_bearing=BEARING,
        sun_angle=ALPHA, ring_angle=ALPHA, sun_base_radius=RADIUS["sun"],
    )  # fmt: skip
    fixed = {"sun": sun if sun < 1e15 else FIXED, "ring": ring if ring < 1e15 else FIXED}
    np.testing.assert_allclose(sharing(p, e.sum(axis=0), torque, **fixed), sun_force, rtol=2e-5)
