"""Rows of tooth pairs against their lines of action."""

from __future__ import annotations

import numpy as np
import pytest
from coupled import CLEAN, make_bodies, stage_system

from flexgear.analysis.modes import rows_at
from flexgear.coupling.pair_data import action_lines, covered
from flexgear.model.load import load_case

VARIANTS = ((), ("ring",), ("ring", "carrier", "shaft"))


@pytest.mark.parametrize("rigid", VARIANTS)
@pytest.mark.parametrize("hand", ["left", "right"])
def test_rows_are_their_line_and_blocks_beyond(rigid, hand):
    case = load_case("wind-5mw", {**CLEAN, "stage.planet_hand": hand}).view()
    system = stage_system(case, make_bodies(case), rigid)
    blocks = len(system.blocks) // 6
    lines = action_lines(system.pairs, blocks)
    for angle in (0.0, 0.3, 2.1):
        rows, n = rows_at(system, angle)
        assert (rows.row["line"][:n] >= 0).all()
        for i in range(n):
            whole, beyond = np.zeros(6 * blocks), np.zeros(6 * blocks)
            for a in range(rows.row["width"][i]):
                at = slice(6 * rows.blocks[i, a], 6 * rows.blocks[i, a] + 6)
                whole[at] += rows.coef[i, a]
                if a >= rows.row["beyond"][i]:
                    beyond[at] += rows.coef[i, a]
            m = rows.row["line"][i]
            line = lines[2 * m] + rows.row["along"][i] * lines[2 * m + 1]
            np.testing.assert_allclose(line + beyond, whole, atol=1e-12)


def test_approach_is_the_radial_part_of_rows():
    """A planet that comes nearer along the line of centres closes its gear mesh by n_x cosβ_b."""
    case = load_case("wind-5mw", CLEAN).view()
    system = stage_system(case, make_bodies(case), ())
    pairs, blocks = system.pairs, len(system.blocks) // 6
    count = len(pairs.s0)
    approach = action_lines(pairs, blocks)[2 * count :]
    rows, n = rows_at(system)
    for i in range(n):
        m = rows.row["line"][i]
        at = 6 * rows.blocks[i, 0]
        assert approach[m, at] == pytest.approx(rows.coef[i, 0, 0])
        assert np.count_nonzero(approach[m, at : at + 6]) == 1


def test_what_a_line_covers():
    case = load_case("wind-5mw", CLEAN).view()
    bodies = make_bodies(case)
    system = stage_system(case, bodies, ())
    kinds = system.pairs.kind % 2  # ring, sun
    np.testing.assert_array_equal(covered(system.pairs), np.where(kinds == 1, 2, 1))
