"""Wide helical gears: as many tooth pairs share the load as lie on the path of contact."""

import numpy as np
import pytest
from coupled import TORQUE, make_system
from stepped import Jumping, energy_error, stepped
from trains import stage_train

from flexgear.analysis.equilibrium import revolution
from flexgear.coupling.build import build_system
from flexgear.coupling.modal import modal_system


def lumped(folder):
    own = {"model": '"per_pair"', "contact_law": '"one-sided"'}
    keys = {f"stage.gear_mesh.{name}": value for name, value in own.items()}
    return build_system(
        stage_train(folder, **keys, **{"stage.helix_angle_deg": "25", "stage.face_width_mm": "150"})
    )


def flexible(_):
    wide = {"stage.helix_angle_deg": "30", "stage.face_width_mm": "470"}
    return make_system(**wide, **{"stage.gear_mesh.contact_law": "one-sided"})


@pytest.mark.parametrize("make", [lumped, flexible])
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
    modal = modal_system(flexible(None), 3000.0)
    drive = Jumping(lambda t: np.where(t > 0.01, 0.3 * TORQUE, TORQUE), jumps=(0.01,))
    found = stepped(modal, drive, 0.04, 5e-5, 1e-3, track_energy=True)
    assert (found.pair_load > 0.0).sum(axis=-1).max() > 4
    assert energy_error(found) < 1e-2
