"""Sets of errors: load sharing by compatibility, and sets without an equilibrium."""

import load_sharing_theory as theory
import numpy as np
import pytest
from coupled import TORQUE
from error_samples import random_sets
from trains import RING_HELD, stage_train

from flexgear.analysis.error_sets import ErrorSets, gear_mesh_forces, no_errors
from flexgear.coupling.build import build_system
from flexgear.coupling.modal import modal_system

ANGLES = np.linspace(0.0, 2.0, 11)[:, None]

HELD = {  # members of compatibility: ring fixed, carrier on its axis, sun sprung; five have room
    **RING_HELD,
    "stage.sun.support.radial_n_per_m": "2e8",
    "stage.carrier.support.radial_n_per_m": "1e14",
    "stage.backlash_ring_mm": "4",
    "stage.backlash_sun_mm": "4",
}


@pytest.mark.parametrize("size", [40e-6, 200e-6])
def test_planets_that_carry_nothing(tmp_path, size):
    """Compatibility with one-sided planets: some part, the others share their load."""
    rng = np.random.default_rng(1)
    pins = rng.normal(0.0, size, (2, 5))
    train = stage_train(tmp_path, planets=5, **HELD, **{"stage.gear_mesh.contact_law": "one-sided"})
    modal = modal_system(build_system(train))
    pairs = modal.system.pairs
    sets = no_errors(pairs)
    for m, label in enumerate(modal.system.gear_meshes):
        normal = pairs.cos_b[m] * pairs.normal[m]
        sets.offset[0, m] = -normal @ pins[:, label.planet]
    force = gear_mesh_forces(modal, np.zeros((1, 1)), modal.system.rated_torque, sets)[0, :, 0]
    paths = theory.stage_paths(5)
    e = theory.path_errors(paths, pin_radial=pins[0], pin_tangential=pins[1])
    expected = theory.sharing(paths, e, 3000 * 26 / 84, sun=2e8, one_sided=True)
    assert (expected == 0).any()
    for kind in ("sun", "ring"):
        at = [m for m, g in enumerate(modal.system.gear_meshes) if g.kind == kind]
        assert np.allclose(force[at], expected, rtol=1e-4, atol=1e-4 * expected.max())
    assert np.abs(force.sum() - 2 * expected.sum()) < 1e-4 * expected.sum()


def test_a_set_that_is_no_number_is_a_gap_of_its_own(one_sided_modal):
    sets = random_sets(one_sided_modal.system.pairs, 3, 2e-5)
    broken = ErrorSets(**{**sets.__dict__, "offset": sets.offset.copy()})
    broken.offset[1] = np.nan
    forces, whole = (
        gear_mesh_forces(one_sided_modal, ANGLES[:2], TORQUE, each) for each in (broken, sets)
    )
    assert np.isnan(forces[..., 1]).any(axis=1).all()
    assert np.array_equal(forces[..., [0, 2]], whole[..., [0, 2]])
