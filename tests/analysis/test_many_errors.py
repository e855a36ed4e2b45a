"""Many sets of errors at once against one revolution for each."""

from dataclasses import replace

import load_sharing_theory as theory
import numpy as np
import pytest
from coupled import TORQUE
from error_samples import picked, random_sets, revolutions
from trains import RING_HELD, stage_train

from flexgear.analysis.error_sets import ErrorSets, error_study, gear_mesh_forces, no_errors
from flexgear.coupling.build import build_system
from flexgear.coupling.modal import modal_system
from flexgear.model.errors import FlexgearError

ANGLES = np.linspace(0.0, 2.0, 11)[:, None]

HELD = {  # members of compatibility: ring fixed, carrier on its axis, sun sprung; five have room
    **RING_HELD,
    "stage.sun.support.radial_n_per_m": "2e8",
    "stage.carrier.support.radial_n_per_m": "1e14",
    "stage.backlash_ring_mm": "4",
    "stage.backlash_sun_mm": "4",
}


def close(forces, expected):
    return np.abs(forces - expected).max() < 1e-10 * np.abs(expected).max()


@pytest.mark.slow
def test_linear_contact(linear_modal):
    sets = random_sets(linear_modal.system.pairs, 4, 3e-4)
    forces = gear_mesh_forces(error_study(linear_modal, ANGLES, TORQUE), sets)
    assert close(forces, revolutions(linear_modal, ANGLES, TORQUE, sets))


@pytest.mark.parametrize(
    ("size", "torque", "parted", "coasts"),
    [
        (2e-5, TORQUE, False, False),
        (2.5e-4, 0.5 * TORQUE, False, True),
        (2e-5, -TORQUE, True, True),
    ],
)
def test_one_sided_contact(one_sided_modal, size, torque, parted, coasts):
    """All teeth loaded; planets jammed between both flanks; reversed."""
    sets = random_sets(one_sided_modal.system.pairs, 6, size)
    forces = gear_mesh_forces(error_study(one_sided_modal, ANGLES, torque), sets)
    assert close(forces, revolutions(one_sided_modal, ANGLES, torque, sets))
    drive = one_sided_modal.system.pairs.carries == 1
    assert forces.min() >= 0
    assert bool((forces[:, drive] == 0).any()) == parted
    assert bool((forces[:, ~drive] > 0).any()) == coasts


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
    study = error_study(modal, np.zeros((1, 1)), modal.system.rated_torque)
    force = gear_mesh_forces(study, sets)[0, :, 0]
    paths = theory.stage_paths(5)
    e = theory.path_errors(paths, pin_radial=pins[0], pin_tangential=pins[1])
    expected = theory.sharing(paths, e, 3000 * 26 / 84, sun=2e8, one_sided=True)
    assert (expected == 0).any()
    for kind in ("sun", "ring"):
        at = [m for m, g in enumerate(modal.system.gear_meshes) if g.kind == kind]
        assert np.allclose(force[at], expected, rtol=1e-4, atol=1e-4 * expected.max())
    assert np.abs(force.sum() - 2 * expected.sum()) < 1e-4 * expected.sum()


def test_a_set_does_not_depend_on_its_company(one_sided_modal):
    """To the last bit, so that batches of any size give the same numbers."""
    study = error_study(one_sided_modal, ANGLES, 0.2 * TORQUE)
    sets = random_sets(one_sided_modal.system.pairs, 37, 2e-4)
    together = gear_mesh_forces(study, sets)
    for at in (slice(0, 1), slice(5, 6), slice(3, 20), slice(20, 37)):
        assert np.array_equal(
            gear_mesh_forces(study, picked(sets, at)), together[:, :, at], equal_nan=True
        )


@pytest.mark.parametrize("law", ["linear", "one-sided"])
@pytest.mark.parametrize("model", ["constant", "per_pair", "lumped"])
def test_lumped_stage_with_runouts(tmp_path, law, model):
    train = stage_train(
        tmp_path, sun="2e8",
        **{
            "stage.gear_mesh.model": model,
            "stage.gear_mesh.contact_law": law,
            "stage.errors.sun_eccentricity_um": "20",
            "stage.errors.planet_eccentricity_um": "[10]",
            "stage.errors.ring_offset_um": "5",
            "stage.backlash_ring_mm": "0.1",
            "stage.backlash_sun_mm": "0.1",
        },
    )  # fmt: skip
    modal = modal_system(build_system(train))
    torque = modal.system.rated_torque
    sets = random_sets(modal.system.pairs, 5, 1e-5)
    forces = gear_mesh_forces(error_study(modal, ANGLES, torque), sets)
    assert close(forces, revolutions(modal, ANGLES, torque, sets))


def test_bearings_with_clearance_are_solved_one_set_after_the_other(tmp_path):
    train = stage_train(
        tmp_path, sun="2e8", **{"stage.planet_bearing.clearance_um": "15"}
    )  # fmt: skip
    modal = modal_system(build_system(train))
    torque = modal.system.rated_torque
    sets = random_sets(modal.system.pairs, 2, 2e-5)
    study = error_study(modal, ANGLES[:3], torque)
    assert study.one_by_one is not None
    assert close(gear_mesh_forces(study, sets), revolutions(modal, ANGLES[:3], torque, sets))


def test_a_set_that_is_no_number_is_a_gap_of_its_own(one_sided_modal):
    sets = random_sets(one_sided_modal.system.pairs, 3, 2e-5)
    broken = ErrorSets(**{**sets.__dict__, "offset": sets.offset.copy()})
    broken.offset[1] = np.nan
    study = error_study(one_sided_modal, ANGLES[:2], TORQUE)
    forces, whole = gear_mesh_forces(study, broken), gear_mesh_forces(study, sets)
    assert np.isnan(forces[..., 1]).any(axis=1).all()
    assert np.array_equal(forces[..., [0, 2]], whole[..., [0, 2]])


def test_stiffnesses_too_far_apart_are_an_error(one_sided_modal):
    study = error_study(one_sided_modal, ANGLES[:2], TORQUE)
    held = study.held._replace(flexibility=1e12 * study.held.flexibility)
    soft = replace(study, held=held)
    with pytest.raises(FlexgearError, match="perfect gears have no equilibrium"):
        gear_mesh_forces(soft, no_errors(study.pairs))
