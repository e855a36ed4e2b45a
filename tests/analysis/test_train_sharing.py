"""Load sharing of a train's stage: the theorem of three planets, and independent compatibility.

One pin off its place: what the planets' loads change by, in closed form.

Rigid bodies, ring and carrier held, the sun free in its plane. a_s, a_r are how far motions of
bodies and errors close a planet's gear meshes along their lines of action, w what the planet's
rotation adds at the sun and takes at the ring. A planet that turns freely has equal forces on both
flanks,

    F = k_s (a_s + w) = k_r (a_r − w)   ⇒   F = 2 ā / (1/k_s + 1/k_r),   ā = (a_s + a_r)/2:

sun and ring mesh act in series. Both push the planet backwards, by 2 F cos α_t cos β_b together
(α_t at both gear meshes), so that its bearing of stiffness k_b gives way and takes
2 F cos² α_t cos² β_b / k_b off a_s and a_r each. With an error e in both gear meshes F = k e, where

    1/k = (1/k_s + 1/k_r)/2 + 2 cos² α_t cos² β_b / k_b,

which is the stiffness of one gear mesh where both have the same and bearings are stiff. The sun's
motion closes its gear meshes only, by v_i, a vector over the planets that is any sum of 1, cos φ_i
and sin φ_i (rotation and both shifts), so that F_i = F_0 + k (e_i + v_i/2); and the sun's three
equations say that the changes of F hold none of these three. So ΔF = k P e with P the projection
off them; N equal spacings make it δ_i1 − [1 + 2 cos(2π(i−1)/N)]/N for an error at planet 1: zero
for three planets; for four 1/4, −1/4, 1/4, −1/4.
"""

from __future__ import annotations

import math

import load_sharing_theory as theory
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from trains import RING_HELD, stage_train

from flexgear.analysis.equilibrium import revolution
from flexgear.coupling.build import build_system
from flexgear.coupling.modal import modal_system
from flexgear.gears.tooth import base_helix_angle, transverse_angle

microns = st.floats(-60, 60).map(lambda x: round(x, 3))
sizes = st.floats(0, 60).map(lambda x: round(x, 3))
phases = st.floats(0, 360).map(lambda x: round(x, 2))
SETTINGS = settings(
    max_examples=12, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)


def forces(train, angles):
    """(p, sun or ring, N) gear-mesh forces."""
    system = build_system(train)
    result = revolution(modal_system(system), np.asarray(angles), system.rated_torque)
    total = result.pair_load.sum(axis=-1)
    kinds = np.array([g.kind.gear for g in system.gear_meshes])
    return np.stack([total[:, kinds == "sun"], total[:, kinds == "ring"]], axis=1)


@SETTINGS
@given(
    pins=st.lists(microns, min_size=6, max_size=6), sun=sizes, ring=sizes, planet=sizes,
    phase=st.lists(phases, min_size=5, max_size=5), wave=st.sampled_from(["constant", "fourier"]),
)  # fmt: skip
def test_a_free_sun_on_three_planets_shares_evenly(tmp_path, pins, sun, ring, planet, phase, wave):
    """Statics alone give the three forces: K = 1 at both gear meshes for any errors."""
    train = stage_train(
        tmp_path,
        planets=3,
        **{
            "stage.errors.pin_tangential_um": str(pins[:3]),
            "stage.errors.pin_radial_um": str(pins[3:]),
            "stage.errors.sun_eccentricity_um": str(sun),
            "stage.errors.ring_eccentricity_um": str(ring),
            "stage.errors.carrier_eccentricity_um": str(sun),
            "stage.errors.planet_eccentricity_um": f"[{planet}]",
            "stage.errors.planet_eccentricity_phase_deg": str(phase[:3]),
            "stage.errors.sun_eccentricity_phase_deg": str(phase[3]),
            "stage.errors.ring_eccentricity_phase_deg": str(phase[4]),
            "stage.errors.sun_gear_mesh_um": str(planet),
            "stage.gear_mesh.model": wave,
        },
    )
    found = forces(train, [0.0, 0.61, 2.9])
    assert np.abs(found / found.mean(axis=-1, keepdims=True) - 1).max() < 1e-9


@pytest.mark.parametrize("planets", [4, 7])
@pytest.mark.parametrize("sun", [0.0, 3e8, np.inf])
def test_sharing_follows_compatibility(tmp_path, planets, sun):
    """Pins off their place, sun floating, supported or held: forces as compatibility says."""
    rng = np.random.default_rng(planets)
    pins = rng.uniform(-20, 20, (2, planets)).round(3)
    held = {
        **RING_HELD,
        "stage.carrier.support.radial_n_per_m": "1e14",
        "stage.errors.pin_tangential_um": str(pins[0].tolist()),
        "stage.errors.pin_radial_um": str(pins[1].tolist()),
    }
    if np.isinf(sun):
        held["stage.sun.kinematics"] = "torsional"
        held["stage.sun.support.radial_n_per_m"] = "0"
    train = stage_train(tmp_path, planets=planets, sun=str(0 if np.isinf(sun) else sun), **held)
    paths = theory.stage_paths(planets)
    e = theory.path_errors(paths, pin_tangential=1e-6 * pins[0], pin_radial=1e-6 * pins[1])
    torque = 3000 * 26 / 84
    expected = theory.sharing(paths, e, torque, sun=theory.FIXED if np.isinf(sun) else sun)
    found = forces(train, [0.0])[0]
    assert np.allclose(found[0], expected, rtol=1e-4, atol=1e-4 * np.abs(expected).max())
    assert np.allclose(found[1], expected, rtol=1e-4, atol=1e-4 * np.abs(expected).max())
    assert theory.factor(found[0]) > 1.02


SHIFT = 20e-6  # of pin 1, in the sense of rotation
HELD = {
    **RING_HELD,
    "stage.carrier.kinematics": "torsional",
    "stage.carrier.support.radial_n_per_m": "0",
}


@pytest.mark.parametrize("planets", [3, 4, 7])
@pytest.mark.parametrize(
    ("sun", "ring", "bearing", "helix"),
    [(7e8, 7e8, 1e14, 0), (7e8, 7e8, 5e8, 0), (4e8, 9e8, 5e8, 12)],
)
def test_a_pin_off_its_place_loads_the_planets_by_the_closed_form(
    tmp_path, planets, sun, ring, bearing, helix
):
    given = {
        **HELD,
        "stage.gear_mesh.sun_stiffness_n_per_m": str(sun),
        "stage.gear_mesh.ring_stiffness_n_per_m": str(ring),
        "stage.planet_bearing.radial_n_per_m": str(bearing),
    }
    true, off = (
        stage_train(tmp_path, planets=planets, helix=helix, **given, **more)
        for more in (
            {},
            {"stage.errors.pin_tangential_um": str([1e6 * SHIFT] + [0] * (planets - 1))},
        )
    )
    stage = true.stages[0]
    cosine = math.cos(transverse_angle(stage)) * math.cos(base_helix_angle(stage))
    k = 1 / ((1 / sun + 1 / ring) / 2 + 2 * cosine**2 / bearing)
    turn = 2 * np.pi * np.arange(planets) / planets
    change = (np.arange(planets) == 0) - (1 + 2 * np.cos(turn)) / planets
    if planets == 4:
        assert change == pytest.approx([0.25, -0.25, 0.25, -0.25])
    found = (forces(off, [0.3]) - forces(true, [0.3]))[0] / (k * SHIFT * cosine)
    assert found == pytest.approx(np.array([change, change]), abs=1e-6)
