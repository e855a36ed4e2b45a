r"""Curves that leave another curve where a real multiplier passes 1 in modulus away from its turns.

At −1 the period doubles. At such a state of period T a small change ξ(t + T) = −ξ(t) neither grows
nor decays. Over the period 2 T it has odd harmonics only, while the tangents at the state have even
harmonics only. So the Jacobian of the equations over 2 T splits into odd and even harmonics, and

    J_odd v = 0

gives the direction v of the curve of period 2 T. At +1 without a turning point a change of period T
breaks a symmetry of the state, such as that of equal planets, and J v = 0 gives its direction. The
motion with the opposite change, for a doubled period the same motion begun T later, has the
direction −v. Where several multipliers pass at once, as of modes in pairs, v is one of many
directions.
"""

from dataclasses import replace

import numpy as np

from flexgear.analysis.continuation import SAME
from flexgear.analysis.curve_follower import state_between
from flexgear.analysis.harmonic_balance import Balance, Factors, Orbit
from flexgear.analysis.orbit_receptance import CondensedTrain, Range
from flexgear.arrays import Array

ITERATIONS = 3  # of inverse iteration


def leaving_branch(
    train: CondensedTrain, longer: CondensedTrain, span: Range, before: Orbit, after: Orbit,
    value: float,
) -> tuple[Orbit, Array] | None:  # fmt: skip
    """First state and direction of a curve that branches off another curve.

    before, after: neighbouring states of ``train`` between which, at λ = ``value``, a multiplier
    is −1 or 1; longer: the train over twice the period, or ``train``. Returns the state at
    ``value`` as a state of ``longer``, and v (m,) in the order of its unknowns; None where Newton's
    method fails."""
    orbit = state_between(train, span, before, after, value)
    if orbit is None:
        return None
    f, a = Balance(train.elements, train.at(orbit.point)).parts(orbit.unknown)
    balance = Balance(longer.elements, longer.at(orbit.point))
    periods = longer.harmonics // train.harmonics
    repeated = np.zeros((longer.harmonics + 1, f.shape[1]), dtype=complex)
    repeated[::periods] = f
    start = replace(balance.residual(balance.unknowns(repeated, a))[1], point=orbit.point)
    return start, _direction(balance, start, periods > 1)


def ends_at(longer: CondensedTrain, span: Range, end: Orbit, start: Orbit) -> bool:
    """Whether ``end``, the first or last state of a curve of ``longer``, agrees in λ and harmonics,
    for several gear-mesh periods in the even ones, with ``start``, where a curve branches off."""
    balance = Balance(longer.elements, longer.at(start.point))
    each = min(longer.elements.gear_meshes, 2)
    f, other = (balance.parts(orbit.unknown)[0][::each] for orbit in (start, end))
    value, size = span.value(start.point), np.linalg.norm(f)
    near = abs(span.value(end.point) - value) <= SAME * value
    return bool(near and np.linalg.norm(other - f) <= SAME * size)


def _direction(balance: Balance, start: Orbit, doubles: bool) -> Array:
    """v (m,) in the order of the unknowns: null vector of J, or of J_odd where the period doubles,
    on the loaded channels, by inverse iteration; zero elsewhere."""
    at = balance.loaded(start.tangents, np.zeros(balance.q))
    places, part = balance.restricted(at)
    harmonic = np.r_[np.zeros(part.q), np.repeat(1 + np.arange(part.harmonics), 2 * part.q)]
    changed = np.flatnonzero(harmonic % 2 == 1) if doubles else np.arange(len(places))
    jacobian = part.jacobian(start.tangents[:, :, at])
    factors = Factors(jacobian[np.ix_(changed, changed)])
    v = np.random.default_rng(0).normal(size=len(changed))  # a symmetric one might miss v
    for _ in range(ITERATIONS):
        v = factors.solve(v / np.linalg.norm(v))
    out = np.zeros(balance.size)
    out[places[changed]] = v
    return out
