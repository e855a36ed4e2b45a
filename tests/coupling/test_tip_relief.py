"""Tip relief is a gap of every pair at its place; in wide gears many pairs share the load."""

from dataclasses import replace

import numpy as np
import pytest
from coupled import TORQUE, make_system
from stepped import energy_error, jump, stepped
from trains import stage_train

from flexgear.analysis.equilibrium import revolution
from flexgear.coupling.build import build_system
from flexgear.coupling.kernels.elements import pair_rows
from flexgear.coupling.kernels.pairs import build_rows
from flexgear.coupling.modal import modal_system
from flexgear.coupling.pair_data import carrying_flanks

KEYS = {"amount_um": "60", "length_mm": "12", "form": '"parabolic"'}


def keys(prefix, length="12"):
    given = {**KEYS, "length_mm": length}
    return {f"{prefix}.modifications.tip_relief.{name}": value for name, value in given.items()}


def lumped(folder, **changes):
    options = {"stage.gear_mesh.model": '"per_pair"', "stage.gear_mesh.contact_law": '"one-sided"'}
    return build_system(stage_train(folder, **options, **changes))


def flexible(_, **changes):
    return make_system(**{"stage.gear_mesh.contact_law": "one-sided"}, **changes)


def unmodified(system):
    pairs = system.pairs
    return system.with_(pairs=pairs._replace(gap_table=np.zeros_like(pairs.gap_table)))


@pytest.mark.parametrize("make", [lumped, flexible])
def test_relief_is_the_gap_of_each_pair_at_its_place(tmp_path, make):
    """The same loads as without it, but with teeth that lack as much as their pair's gap there."""
    system = make(tmp_path, **keys("stage.planet", "12" if make is flexible else "5"))
    pairs, angle = system.pairs, 0.037
    rows = pair_rows(pairs)
    theta = system.theta(np.array([angle]))
    clean = unmodified(system).pairs
    _, count = build_rows(pairs, rows, theta, carrying_flanks(pairs))
    bare = pair_rows(pairs)
    build_rows(clean, bare, theta, carrying_flanks(pairs))
    gap = bare.pair["error"][:count] - rows.pair["error"][:count]
    assert gap.max() > 20e-6 and gap.min() == 0.0
    short = clean.error_gear.copy()
    for q in range(count):
        short[rows.pair["mesh"][q], rows.pair["tooth"][q]] -= gap[q]
    shifted = system.with_(pairs=clean._replace(error_gear=short))
    torque = system.rated_torque
    found, expected, plain = (
        revolution(modal_system(s), np.array([angle]), torque).pair_load
        for s in (system, shifted, unmodified(system))
    )
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-8 * expected.max())
    assert np.abs(found - plain).max() > 1e-2 * plain.max()


def test_relief_takes_load_off_pairs_that_come_and_go():
    """Entering and leaving pairs carry less, whole gear meshes the same."""
    relieved = modal_system(flexible(None, **keys("stage.planet"), **keys("stage.ring")), 3000.0)
    plain = replace(relieved, system=unmodified(relieved.system))
    angles = np.linspace(0.0, 0.1, 15)
    a, b = (revolution(m, angles, TORQUE) for m in (relieved, plain))
    ring = slice(0, 5)
    np.testing.assert_allclose(
        a.pair_load[:, ring].sum(axis=(1, 2)), b.pair_load[:, ring].sum(axis=(1, 2)), rtol=5e-3
    )
    pairs = relieved.system.pairs
    share = (a.pair_position - pairs.s_lo[:, None]) / (pairs.s_hi - pairs.s_lo)[:, None]
    outer = (a.pair_tooth >= 0) & ((share < 0.1) | (share > 0.9))
    outer[:, 5:] = False
    assert a.pair_load[outer].sum() < 0.95 * b.pair_load[outer].sum()


def wide_lumped(folder):
    return lumped(folder, **{"stage.helix_angle_deg": "25", "stage.face_width_mm": "150"})


def wide_flexible(folder):
    return flexible(folder, **{"stage.helix_angle_deg": "30", "stage.face_width_mm": "470"})


@pytest.mark.parametrize("make", [wide_lumped, wide_flexible])
def test_pairs_of_a_wide_stage_share_the_force_of_their_gear_mesh(tmp_path, make):
    system = make(tmp_path)
    pairs = system.pairs
    angles = np.linspace(0.0, 2 * np.pi / pairs.gear_teeth.max(), 5)
    found = revolution(modal_system(system), angles, system.rated_torque)
    front = pairs.carries == 1
    load, tooth = found.pair_load[:, front], found.pair_tooth[:, front]
    reach = pairs.s_hi - pairs.s_lo + 2 * np.abs(pairs.slope) * pairs.half_face
    ratio = np.floor(reach / pairs.pitch)[front]
    at_work = (tooth >= 0).sum(axis=-1)
    assert at_work.max() > 4
    assert np.all((at_work == ratio) | (at_work == ratio + 1))
    for sample in tooth.reshape(-1, pairs.slots):
        own = sample[sample >= 0]
        assert len(set(own)) == len(own)  # none is written over by another
    # sun and ring turn no planet: all pairs are in the balance of its moments
    moment = load.sum(axis=-1) * pairs.planet_arm[front]
    planets = pairs.planet_block[front]
    for block in set(planets):
        own = moment[:, planets == block]
        assert np.abs(own.sum(axis=1)).max() < 1e-8 * np.abs(own).max()


def test_energy_closes_while_many_pairs_come_and_go():
    modal = modal_system(wide_flexible(None), 3000.0)
    found = stepped(modal, jump(TORQUE, 0.3 * TORQUE, 0.01), 0.04, 5e-5, 1e-3, track_energy=True)
    assert (found.pair_load > 0.0).sum(axis=-1).max() > 4
    assert energy_error(found) < 1e-2
