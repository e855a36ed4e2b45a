"""The teeth of a ring that is made rigid give way as those of a lumped ring do."""

import numpy as np
import pytest
from coupled import make_case, make_system

from flexgear.gears.geometry import stage_geometry
from flexgear.gears.power_flow import power_flow
from flexgear.gears.stiffness import compliance, pair_law

WEBER = {"stage.gear_mesh.pair_stiffness": "weber-banaschek"}


@pytest.mark.parametrize("tie", ["root", "flank"])
def test_what_the_fe_ring_held_is_in_the_gear_mesh_again(tie):
    case = make_case(**WEBER, **{"stage.ring.fe.tie": tie})
    g, force = stage_geometry(case), power_flow(case.case).stages[0].gear_mesh_forces["ring"]
    split = compliance(case, g, "ring", force)
    held = split.share("gear", tie)
    bends, rigid = (pair_law(c, g, "ring", force) for c in (case, case.with_rigid(["ring"])))
    np.testing.assert_allclose(rigid(split.xi), bends(split.xi) * (1.0 - held))
    assert held.min() > 0.05


def test_the_rigid_variant_has_the_stiffness_of_a_ring_that_does_not_bend():
    rigid = make_system(["ring"], **WEBER).pairs
    bends, own = (
        make_system(**WEBER, **k).pairs for k in ({}, {"stage.ring.fe.flexible": "false"})
    )
    ring, sun = (rigid.table[rigid.kind == kind][0] for kind in (0, 1))
    np.testing.assert_array_equal(rigid.k_table[ring], own.k_table[ring])
    assert rigid.k_table[ring].max() < 0.95 * bends.k_table[ring].max()
    np.testing.assert_array_equal(rigid.k_table[sun], bends.k_table[sun])
