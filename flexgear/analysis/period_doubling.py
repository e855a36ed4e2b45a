r"""Period doubling: states of twice the period, whose curve branches off where a multiplier is −1.

At such a state of period T a small change ξ(t + T) = −ξ(t) neither grows nor decays. Over the
period 2 T it has odd harmonics only, while the tangents at the state have even harmonics only. So
the Jacobian of the equations over 2 T splits into odd and even harmonics, and

    J_odd v = 0

gives the direction v of the curve of period 2 T. The same motion, begun T later, has the direction
−v, so that v and −v begin the same curve.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from flexgear.analysis.continuation import SAME, Range, state_between
from flexgear.analysis.harmonic_balance import Balance, Factors, Orbit
from flexgear.analysis.orbit_receptance import CondensedTrain, condensed_train
from flexgear.arrays import Array

ITERATIONS = 3  # of inverse iteration


def over_two_periods(train: CondensedTrain) -> CondensedTrain:
    """The train with twice the period and twice as many harmonics."""
    return condensed_train(train.elements.repeated(2), 2 * train.harmonics)


def doubled_branch(
    train: CondensedTrain, longer: CondensedTrain, span: Range, before: Orbit, after: Orbit,
    value: float,
) -> tuple[Orbit, Array] | None:  # fmt: skip
    """First state and direction of the curve of twice the period that branches off another curve.

    before, after: neighbouring states of ``train`` between which, at λ = ``value``, a multiplier
    is −1; longer: the train over twice the period. Returns the state at ``value`` as a state of
    ``longer``, and v (m,) in the order of its unknowns; None where Newton's method fails."""
    orbit = state_between(train, span, before, after, value)
    if orbit is None:
        return None
    f, a = Balance(train.elements, train.at(orbit.point)).parts(orbit.unknown)
    balance = Balance(longer.elements, longer.at(orbit.point))
    twice = np.zeros((longer.harmonics + 1, f.shape[1]), dtype=complex)
    twice[::2] = f
    start = replace(balance.residual(balance.unknowns(twice, a))[1], point=orbit.point)
    return start, _direction(balance, start)


def ends_at(longer: CondensedTrain, span: Range, end: Orbit, start: Orbit) -> bool:
    """Whether ``end``, the first or last state of a curve of twice the period, agrees in λ and even
    harmonics with ``start``, a state of the simple period."""
    balance = Balance(longer.elements, longer.at(start.point))
    f, other = (balance.parts(orbit.unknown)[0][::2] for orbit in (start, end))
    value, size = span.value(start.point), np.linalg.norm(f)
    near = abs(span.value(end.point) - value) <= SAME * value
    return bool(near and np.linalg.norm(other - f) <= SAME * size)


def _direction(balance: Balance, start: Orbit) -> Array:
    """v (m,) in the order of the unknowns: null vector of J_odd on the loaded channels, by inverse
    iteration; zero elsewhere."""
    at = np.flatnonzero(start.tangents.any(axis=(0, 1, 2)))
    places, part = balance.restricted(at)
    harmonic = np.r_[np.zeros(len(at)), np.repeat(1 + np.arange(balance.harmonics), 2 * len(at))]
    odd = np.flatnonzero(harmonic % 2 == 1)
    jacobian = part.jacobian(start.tangents[:, :, at[:, None], at])
    factors, v = Factors(jacobian[np.ix_(odd, odd)]), np.ones(len(odd))
    for _ in range(ITERATIONS):
        v = factors.solve(v / np.linalg.norm(v))
    out = np.zeros(balance.size)
    out[places[odd]] = v
    return out
