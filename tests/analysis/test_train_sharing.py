"""Load sharing of a train's stage: the theorem of three planets, and independent compatibility."""

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
    loads = forces(train, [0.0, 0.61, 2.9])
    assert np.abs(loads / loads.mean(axis=-1, keepdims=True) - 1).max() < 1e-9


@pytest.mark.parametrize(("planets", "helix"), [(4, 0), (4, 12), (7, 0)])
@pytest.mark.parametrize("sun", [0.0, 3e8, np.inf])
def test_sharing_follows_compatibility(tmp_path, planets, helix, sun):
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
    sprung = str(0 if np.isinf(sun) else sun)
    train = stage_train(tmp_path, planets=planets, sun=sprung, helix=helix, **held)
    paths = theory.stage_paths(planets, math.radians(helix))
    e = theory.path_errors(paths, pin_tangential=1e-6 * pins[0], pin_radial=1e-6 * pins[1])
    torque = 3000 * 26 / 84
    expected = theory.sharing(paths, e, torque, sun=theory.FIXED if np.isinf(sun) else sun)
    loads = forces(train, [0.0])[0]
    assert np.allclose(loads[0], expected, rtol=1e-4, atol=1e-4 * np.abs(expected).max())
    assert np.allclose(loads[1], expected, rtol=1e-4, atol=1e-4 * np.abs(expected).max())
    assert theory.factor(loads[0]) > 1.02
