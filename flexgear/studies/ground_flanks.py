"""Amounts of flank modifications, and the gaps of slices that more of them leaves.

Gaps of slices are linear in amounts of the lead, and nearly of second order in those of relief,
which turns the flank (``gears.profile_contact``). So each amount is a table of gaps or two, made
once:

    g = g_0 + Σ_i p_i g_i + p_i² q_i
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from flexgear.arrays import Array
from flexgear.coupling.pair_data import PairData, slice_gaps
from flexgear.model.modifications import Relief
from flexgear.solve.model import Model, assemble

LEAD = ("helix_slope", "lead_crowning", "end_relief")  # turn no flank across its profile
UNIT = 1e-6  # m: amounts are whole micrometres


@dataclass(frozen=True)
class Ground:
    """The amount of a modification. stage: its name; key: of the modification below the stage;
    base: the amount that the case has, m; relief: that it is the amount of, if any."""

    stage: str
    key: str
    base: float
    relief: Relief | None = None

    def with_more(self, added: float) -> float | Relief:
        """Value of the key with ``added`` more material removed, m."""
        amount = self.base + added
        return self.relief.model_copy(update={"amount": amount}) if self.relief else amount


def ground_pairs(model: Model, amounts: Iterable[tuple[Ground, float]]) -> PairData:
    """Pairs of the model with so much more of every amount, m."""
    keys = {f"stages.{g.stage}.{g.key}": g.with_more(added) for g, added in amounts}
    case = model.case.with_(**keys)
    return assemble(case, bodies=model.bodies, variant=model.system.rigid_bodies).system.pairs


def gap_factors(model: Model, ground: Ground, most: float) -> Array:
    """Factors (2, K, T, n) of what is added to an amount and of its square, m/m and 1/m, in what
    that adds to the gaps of slices; most: that is mostly added, m."""
    before = slice_gaps(model.system.pairs)

    def by(added: float) -> Array:
        return (slice_gaps(ground_pairs(model, [(ground, added)])) - before) / added

    far = by(most)
    if ground.key.rpartition(".")[2] in LEAD:
        return np.stack([far, np.zeros_like(far)])
    near = by(0.5 * most)
    square = (far - near) / (0.5 * most)
    return np.stack([near - 0.5 * most * square, square])
