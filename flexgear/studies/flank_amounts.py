"""Amounts of flank modifications, and the gaps of slices as functions of them.

A gap is linear in an amount of lead modification, and nearly quadratic in one of relief, which
turns the flank (``gears.profile_contact``). The coefficients are tabulated once for each amount:

    g = g_0 + Σ_i p_i g_i + p_i² q_i

with the increase p_i of amount i and its coefficients g_i and q_i.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from flexgear.arrays import Array
from flexgear.coupling.pair_data import PairData, slice_gaps
from flexgear.model.modifications import Relief
from flexgear.solve.model import Model, assemble

LEAD = ("helix_slope", "lead_crowning", "end_relief")  # leave the slope of the profile as it is
UNIT = 1e-6  # m: amounts are whole micrometres


@dataclass(frozen=True)
class FlankAmount:
    """The amount of a flank modification.

    stage: name of the stage; key: key of the modification below the stage; base: amount in the
    case, m; relief: the modification itself where it is a relief with further parameters.
    """

    stage: str
    key: str
    base: float
    relief: Relief | None = None

    def amount(self, added: float) -> float:
        """Amount of the modification, m, once ``added`` (m) more material is removed; rounded to
        0.1 nm, so that none is not a little below zero."""
        return round(self.base + added, 10) + 0.0

    def with_more(self, added: float) -> float | Relief:
        """Value of the key after the removal of ``added`` (m) more material."""
        amount = self.amount(added)
        return self.relief.model_copy(update={"amount": amount}) if self.relief else amount


def modified_pairs(model: Model, increases: Iterable[tuple[FlankAmount, float]]) -> PairData:
    """Pair data of the model with every amount increased, m."""
    keys = {f"stages.{amount.stage}.{amount.key}": amount.with_more(p) for amount, p in increases}
    case = model.case.with_(**keys)
    return assemble(case, bodies=model.bodies, variant=model.system.rigid_bodies).system.pairs


def gap_coefficients(model: Model, amount: FlankAmount, largest: float) -> Array:
    """Coefficients (2, K, T, n) of the increase p of an amount, m/m, and of p², 1/m, in the gaps of
    slices: from the gaps at p = ``largest`` and half of it, m."""
    before = slice_gaps(model.system.pairs)

    def slope(p: float) -> Array:
        return (slice_gaps(modified_pairs(model, [(amount, p)])) - before) / p

    secant = slope(largest)
    if amount.key.rpartition(".")[2] in LEAD:
        return np.stack([secant, np.zeros_like(secant)])
    half_secant = slope(0.5 * largest)
    square = (secant - half_secant) / (0.5 * largest)
    return np.stack([half_secant - 0.5 * largest * square, square])
