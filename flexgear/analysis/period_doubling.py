r"""States of twice the period, which leave a curve of steady states where a multiplier passes −1.

There a small change ξ(t + T) = −ξ(t) of the state neither grows nor decays. Over 2 T it has the odd
harmonics alone, and the Jacobian of the balance over 2 T, of whose tangents a state of period T has
even harmonics alone, splits into odd and even ones,

    J_odd v = 0,

v being the direction in which the curve of period 2 T leaves. The state half a period later is the
same motion, so that v and −v begin the same curve.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from flexgear.analysis.continuation import SAME, Range, between
from flexgear.analysis.harmonic_balance import Balance, Factors, Orbit
from flexgear.analysis.orbit_receptance import CondensedTrain, condensed_train
from flexgear.arrays import Array

ITERATIONS = 3  # of inverse iteration


def doubled(train: CondensedTrain) -> CondensedTrain:
    """A train over twice its period, with twice as many harmonics."""
    return condensed_train(train.elements.repeated(2), 2 * train.harmonics)


def doubling(
    train: CondensedTrain, longer: CondensedTrain, span: Range, before: Orbit, after: Orbit,
    value: float,
) -> tuple[Orbit, Array] | None:  # fmt: skip
    """Where and in which direction a curve of twice the period leaves.

    before, after: neighbouring states of ``train`` between which, at λ = ``value``, a multiplier
    is −1; longer: the same train over twice the period. Returns that state as one of ``longer``
    and v (m,) in the order of its unknowns; None where the state is not found."""
    orbit = between(train, span, before, after, value)
    if orbit is None:
        return None
    f, a = Balance(train.elements, train.at(orbit.point)).parts(orbit.unknown)
    balance = Balance(longer.elements, longer.at(orbit.point))
    twice = np.zeros((longer.harmonics + 1, f.shape[1]), dtype=complex)
    twice[::2] = f
    start = replace(balance.residual(balance.together(twice, a))[1], point=orbit.point)
    return start, _direction(balance, start)


def meets(longer: CondensedTrain, span: Range, end: Orbit, start: Orbit) -> bool:
    """Whether a curve of twice the period that begins or ends with the state ``end`` does so at
    ``start``, a state of half of its period: whether its even harmonics and λ are those."""
    balance = Balance(longer.elements, longer.at(start.point))
    f, other = (balance.parts(orbit.unknown)[0][::2] for orbit in (start, end))
    value, size = span.value(start.point), np.linalg.norm(f)
    near = abs(span.value(end.point) - value) <= SAME * value
    return bool(near and np.linalg.norm(other - f) <= SAME * size)


def _direction(balance: Balance, start: Orbit) -> Array:
    """v (m,) in the order of the unknowns: null vector of J_odd over the channels that carry, by
    inverse iteration; zero elsewhere."""
    at = np.flatnonzero(start.tangents.any(axis=(0, 1, 2)))
    places, part = balance.between(at)
    harmonic = np.r_[np.zeros(len(at)), np.repeat(1 + np.arange(balance.harmonics), 2 * len(at))]
    odd = np.flatnonzero(harmonic % 2 == 1)
    jacobian = part.jacobian(start.tangents[:, :, at[:, None], at])
    factors, v = Factors(jacobian[np.ix_(odd, odd)]), np.ones(len(odd))
    for _ in range(ITERATIONS):
        v = factors.solve(v / np.linalg.norm(v))
    out = np.zeros(balance.size)
    out[places[odd]] = v
    return out
