"""Load sharing of a train's stage: the theorem of three planets, and independent compatibility."""

from __future__ import annotations

import load_sharing_theory as theory
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from trains import stage_train

from flexgear.analysis.equilibrium import revolution
from flexgear.coupling.build import build_system
from flexgear.coupling.modal import modal_system

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


@pytest.mark.parametrize("planets", [3, 4, 5, 7])
@pytest.mark.parametrize("sun", [0.0, 3e8, np.inf])
def test_sharing_follows_compatibility(tmp_path, planets, sun):
    """Pins off their place, sun floating, supported or held: forces as compatibility says."""
    rng = np.random.default_rng(planets)
    pins = rng.uniform(-20, 20, (2, planets)).round(3)
    held = {
        "stage.planet.teeth": "16",  # seven of them have room
        "stage.ring.teeth": "58",
        "stage.ring.addendum": "0.6",
        "stage.ring.kinematics": "fixed",
        "stage.ring.support.radial_n_per_m": "0",
        "stage.ring.support.tangential_n_per_m": "0",
        "stage.carrier.support.radial_n_per_m": "1e14",
        "stage.errors.pin_tangential_um": str(pins[0].tolist()),
        "stage.errors.pin_radial_um": str(pins[1].tolist()),
    }
    if np.isinf(sun):
        held["stage.sun.kinematics"] = "torsional"
        held["stage.sun.support.radial_n_per_m"] = "0"
    train = stage_train(tmp_path, planets=planets, sun=str(0 if np.isinf(sun) else sun), **held)
    angle = np.radians(20)
    paths = theory.equal_paths(
        planets, sun_stiffness=6e8, ring_stiffness=8e8, planet_bearing=5e8,
        sun_angle=angle, ring_angle=angle, sun_base_radius=0.004 * 26 / 2 * np.cos(angle),
    )  # fmt: skip
    e = theory.path_errors(paths, pin_tangential=1e-6 * pins[0], pin_radial=1e-6 * pins[1])
    torque = 3000 * 26 / 84
    expected = theory.sharing(paths, e, torque, sun=theory.FIXED if np.isinf(sun) else sun)
    found = forces(train, [0.0])[0]
    assert np.allclose(found[0], expected, rtol=1e-4, atol=1e-4 * np.abs(expected).max())
    assert np.allclose(found[1], expected, rtol=1e-4, atol=1e-4 * np.abs(expected).max())
    if planets > 3 or sun > 0:
        assert theory.factor(found[0]) > 1.02


def test_planets_renumbered(tmp_path):
    """Turning errors by one planet turns the forces by one planet."""
    pins = [12.0, -7.0, 3.0, 20.0]
    a = stage_train(tmp_path, **{"stage.errors.pin_tangential_um": str(pins)}, sun="2e8")
    b = stage_train(tmp_path, **{"stage.errors.pin_tangential_um": str(pins[1:] + pins[:1])},
                    sun="2e8")  # fmt: skip
    assert np.allclose(forces(a, [0.4])[0], np.roll(forces(b, [0.4])[0], 1, axis=-1), rtol=1e-9)


def test_reversed_torque_mirrors_forces(tmp_path):
    """The other flank carries with the same force; a perfect stage does not know which."""
    a = stage_train(tmp_path)
    b = stage_train(tmp_path, **{"inputs.0.torque_nm": "-3000"})
    assert np.allclose(forces(a, [0.2]), forces(b, [0.2]), rtol=1e-9)
    assert forces(b, [0.2]).min() > 0


def test_weight_changes_sharing_once_a_turn(tmp_path):
    """Gravity in the carrier's frame turns: forces repeat after a turn, not after half of one."""
    train = stage_train(tmp_path, sun="1e8", head="gravity_m_per_s2 = [0, -9.81, 0]\n")
    turns = forces(train, [0.3, 0.3 + 2 * np.pi, 0.3 + np.pi])
    # the constant gear-mesh model does not see which teeth are in mesh
    assert np.allclose(turns[0], turns[1], rtol=1e-9)
    assert np.abs(turns[0] - turns[2]).max() > 1e-3 * turns[0].mean()
