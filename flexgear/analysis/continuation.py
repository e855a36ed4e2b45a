"""Curves of steady states over speed or torque: where they start, and all of them in a range.

Each is followed in both directions by ``curve_follower``. Some curves enter the range only from
outside, such as the one of parted teeth in a range within the hysteresis. They are found by
following all curves up to the far ends of the resonances around it.

Where a real multiplier passes 1 in modulus away from a turning point, another curve leaves. It is
followed from there, with λ constant in the first prediction. At −1 the period doubles. At such a
state of period T a small change ξ(t + T) = −ξ(t) neither grows nor decays. Over the period 2 T it
has odd harmonics only, while the tangents at the state have even harmonics only. So the Jacobian of
the equations over 2 T splits into odd and even harmonics, and

    J_odd v = 0

gives the direction v of the curve of period 2 T. At +1 without a turning point a change of period T
breaks a symmetry of the state, such as that of equal planets, and J v = 0 gives its direction. The
motion with the opposite change, for a doubled period the same motion begun T later, has the
direction −v. Where several multipliers pass at once, as of modes in pairs, v is one of many
directions.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import groupby

import numpy as np

from flexgear.analysis.curve_follower import CurveFollower, Cut, interpolated, state_between
from flexgear.analysis.harmonic_balance import Balance, Factors, Orbit, converge
from flexgear.analysis.orbit_receptance import CondensedTrain, OperatingPoint, Range
from flexgear.arrays import Array

SAME = 0.02  # relative error in forces with which neighbouring states interpolate their curve
SEEDS = (0.0, 1.0, 0.5, 0.25, 0.75)  # places in the range at which states are sought
BESIDE = (0.9, 1.1, 0.8, 1.25, 0.65, 1.5)  # speeds over those of the range, where it has no state
# gear-mesh frequencies, over the natural frequency, between which order 1 or 2 parts teeth
RESONANT = ((0.4, 1.4), (0.2, 0.7))
ITERATIONS = 3  # of inverse iteration, for the direction of a curve that leaves another


@dataclass(frozen=True)
class Curve:
    """States in their order along the curve, and its ends within the range."""

    states: list[Orbit]
    cuts: tuple[Cut, ...]


def curves(
    train: CondensedTrain,
    span: Range,
    keep: Callable[[Orbit], Orbit] = lambda orbit: orbit,
    resonance: float = 0.0,
    beyond: Callable[[float], None] = lambda share: None,
) -> Iterator[Curve]:
    """All curves within a range through the states of ``_starts``, each once.

    keep: called with every computed state of the range; returns the state to be stored.
    resonance: speed over rated speed at which the gear-mesh frequency equals the natural frequency
    of gears on their gear mesh; 0: no curve is followed outside the range. beyond: called with the
    covered share of what is followed there. KeyboardInterrupt ends the search with the current
    curve if its last state is within the range.
    """
    wide, followed = _widened(span, resonance), list[list[Orbit]]()
    for start in _starts(train, span, wide, resonance):
        if start is None or any(_on_curve(states, wide, start) for states in followed):
            continue
        value = span.value(start.point)
        reach = replace(wide, low=min(wide.low, value), high=max(wide.high, value))
        states, cuts = _follow(train, span, reach, start, keep, beyond)
        followed.append(states)
        for within, piece in groupby(states, lambda state: span.holds(state.point)):
            if within:
                part = list(piece)
                ends = part[0] is states[0] and cuts[0], part[-1] is states[-1] and cuts[1]
                yield Curve(part, tuple(cut for cut in ends if cut))
        stopped = next((cut for cut in cuts if cut and cut.reason == "stopped"), None)
        if stopped and span.low <= stopped.value <= span.high:
            return
        if stopped:
            raise KeyboardInterrupt


def branch(
    train: CondensedTrain, span: Range, start: Orbit, direction: Array,
    keep: Callable[[Orbit], Orbit], left: Sequence[Orbit] = (),
) -> Curve:  # fmt: skip
    """The curve that branches off at the state ``start`` of another curve in ``direction`` (m,),
    without ``start``.

    It ends at the range, or where it meets the other curve again: ``left``, states of the same
    period, if there are any, else those of half the period. Without states if all of them are on
    ``left``: with few harmonics a multiplier may pass 1 where no curve leaves. keep: as for
    ``curves``. KeyboardInterrupt ends the curve, unless it has no states yet."""
    follower = CurveFollower(train, span, span, start, keep, left)
    states = list[Orbit]()
    try:
        cut = follower.follow(follower.start_in(direction), states)
    except KeyboardInterrupt:
        if not states:
            raise
        cut = Cut(span.value(states[-1].point), "stopped")
    if left and all(_on_curve(left, span, state) for state in states):
        return Curve([], ())
    return Curve(states, (cut,) if cut else ())


def _widened(span: Range, resonance: float) -> Range:
    """A range of speeds, extended to the ends of resonances in which one of its ends lies."""
    if span.over == "load":
        return span
    low, high = ([e for e in RESONANT if e[0] * resonance < x < e[1] * resonance]
                 for x in (span.low, span.high))  # fmt: skip
    return replace(
        span,
        low=low[0][0] * resonance if low else span.low,
        high=high[0][1] * resonance if high else span.high,
    )


def _starts(
    train: CondensedTrain, span: Range, wide: Range, resonance: float
) -> Iterator[Orbit | None]:
    """First states of curves: at ``SEEDS`` and at the ends of the widened range; without any of
    them the first one at a speed ``BESIDE`` the range; for a range of torques also those at the
    lowest torque on curves over speed."""
    shares = SEEDS if span.low < span.high else SEEDS[:1]
    values = [(1.0 - share) * span.low + share * span.high for share in shares]
    values += [v for v in (wide.low, wide.high) if not span.low <= v <= span.high]
    converged = False
    for value in values:
        yield (state := _state(train, span.point(value)))
        converged = converged or state is not None
    if span.over == "speed" and not converged:
        others = (span.low * factor if factor < 1.0 else span.high * factor for factor in BESIDE)
        states = (_state(train, span.point(value)) for value in others)
        yield next(filter(None, states), None)
    if span.over == "load":
        lowest = Range("speed", span.fixed, span.fixed, span.low)
        for curve in curves(train, lowest, resonance=resonance):
            yield from curve.states


def _state(train: CondensedTrain, point: OperatingPoint) -> Orbit | None:
    balance = Balance(train.elements, train.at(point))
    return converge(balance, point, balance.start())


def _on_curve(states: Sequence[Orbit], span: Range, orbit: Orbit) -> bool:
    """Whether a state agrees with one of a curve, or with the interpolation between two."""
    x = orbit.unknown
    near = SAME * float(np.linalg.norm(x))
    return any(
        np.linalg.norm(other - x) <= near
        for other in interpolated(states, span, span.value(orbit.point))
    )


def _follow(
    train: CondensedTrain,
    span: Range,
    wide: Range,
    start: Orbit,
    keep: Callable[[Orbit], Orbit],
    beyond: Callable[[float], None],
) -> tuple[list[Orbit], list[Cut | None]]:
    """States of the curve through a state, in both directions over the wide range, and the cut at
    either end; None at an end of the range."""
    follower = CurveFollower(train, span, wide, start, keep, beyond=beyond)
    value = wide.value(start.point)
    first = follower.stored(start)
    backward, forward, cuts = list[Orbit](), list[Orbit](), list[Cut | None]([None, None])
    try:
        if value > wide.low:
            cuts[0] = follower.follow(follower.start_towards(-1.0), backward)
        if value < wide.high:
            cuts[1] = follower.follow(follower.start_towards(1.0), forward)
    except KeyboardInterrupt:
        last = (forward or backward or [first])[-1]
        cuts[1 if forward or not backward else 0] = Cut(wide.value(last.point), "stopped")
    return [*backward[::-1], first, *forward], cuts


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
