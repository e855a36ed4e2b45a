r"""Curves of steady states over speed or torque, by pseudo-arclength continuation.

A curve is followed with the parameter λ as one unknown more. From a state with forces f and the
tangent t, whose part along the curve is measured as

    ds² = (dλ/L)² + ‖df/f_s‖²/w²,   f_s = max(‖f_0‖, ‖f‖),

f_0 being the forces at its first state and L the range, or half of its upper end if that is more
(sharp turns would turn by half a circle where λ counted more), a step predicts
x + t ds + ½ ds² dt/ds, dt/ds from the state before, and corrects on the plane across t, so that
turning points are states like all others (Keller 1977). Steps get shorter where Newton takes many
tries or the tangent turns fast, as where teeth begin to part.

States of twice the period leave a curve where a multiplier passes −1 (``period_doubling``). They
are followed from there, first across the curve, with λ constant.

Curves that reach into a range from beyond it, such as the one of parted teeth over a range within
the hysteresis, are found by following all curves up to the far ends of the resonances around it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import groupby
from typing import Literal

import numpy as np

from flexgear.analysis.harmonic_balance import AGREES, Balance, Orbit, Solver, Waves, converge
from flexgear.analysis.orbit_receptance import CondensedTrain, Point
from flexgear.arrays import Array

Over = Literal["speed", "load"]
FORCE_SPAN = 4.0  # w: times the forces that are as long as L
FIRST, LONGEST, SHORTEST = 0.004, 0.02, 1e-7  # steps, of L; the longest also of the range
CORRECTIONS = 8  # Newton steps before a shorter step is tried
EXACT_SLOPES = 2  # of them after which ∂/∂λ is kept
QUICK = 4  # so many or fewer make the next step longer
STRAIGHT = 0.92  # cosine between tangents of neighbouring states
KINK = 1e-3  # step over which the curve may turn at once, as where a sample loses contact
MOST_STATES = 4000  # of a curve
RISE = (
    10.0  # times the largest force at its first state, beyond the backlash: a curve is left there
)
DIFFERENCE = 1e-7  # of λ, for ∂/∂λ
SAME = 0.02  # of the forces: states of one curve interpolate each other so well
SEEDS = (0.0, 1.0, 0.5, 0.25, 0.75)  # of the range: where states are looked for without a curve
# of the gear meshes' own frequency: gear-mesh frequencies between which order 1 or 2 parts teeth
RESONANT = ((0.4, 1.4), (0.2, 0.7))
REJOINED = 1e-3  # of the square of what a longer period adds: less from one state to the next


@dataclass(frozen=True)
class Range:
    """λ from low to high; the other of speed and load is fixed."""

    over: Over
    low: float
    high: float
    fixed: float = 1.0

    def point(self, value: float) -> Point:
        """Where λ has a value."""
        if self.over == "speed":
            return Point(value, self.fixed)
        return Point(self.fixed, value)

    def value(self, point: Point) -> float:
        """λ there."""
        return point.speed if self.over == "speed" else point.load

    def holds(self, point: Point) -> bool:
        """Whether λ is in the range, ends included."""
        return self.low <= self.value(point) <= self.high


@dataclass(frozen=True)
class Cut:
    """Reason why a curve ends within the range, and at which λ: unbounded forces, no state at the
    shortest step, too many states, or a user who stopped it."""

    value: float
    reason: Literal["forces", "steps", "states", "stopped"]


@dataclass(frozen=True)
class Curve:
    """States in the order in which they follow each other, and where it was cut, if anywhere."""

    states: list[Orbit]
    cuts: tuple[Cut, ...]


def curves(
    train: CondensedTrain,
    span: Range,
    seen: Callable[[Orbit], Orbit] = lambda orbit: orbit,
    resonance: float = 0.0,
) -> Iterator[Curve]:
    """All curves within a range through states that no other curve passes (``_starts``).

    seen: is called with every computed state of the range and returns what is kept of it.
    resonance: speed over rated at which gears vibrate on their gear mesh; 0 where no curve is
    followed outside the range. KeyboardInterrupt ends the search with the curve that is being
    followed, where that is within the range.
    """
    wide, followed = _widened(span, resonance), list[list[Orbit]]()
    for start in _starts(train, span, wide, resonance):
        if start is None or any(_on_curve(states, wide, start) for states in followed):
            continue
        states, cuts = _follow(train, span, wide, start, seen)
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


def leaving(
    train: CondensedTrain, span: Range, start: Orbit, direction: Array,
    seen: Callable[[Orbit], Orbit],
) -> Curve:  # fmt: skip
    """The curve of twice the period that leaves another one at its state ``start``, by the odd
    harmonics of ``direction`` (m,), without that state: up to the ends of the range, or to where it
    meets a curve of half its period again. KeyboardInterrupt ends it, if it has states."""
    walk, states = _Walk(train, span, span, start, seen), list[Orbit]()
    try:
        cut = walk.along(walk.off(direction), states)
    except KeyboardInterrupt:
        if not states:
            raise
        cut = Cut(span.value(states[-1].point), "stopped")
    return Curve(states, (cut,) if cut else ())


def between(
    train: CondensedTrain, span: Range, before: Orbit, after: Orbit, value: float
) -> Orbit | None:
    """The state at λ = ``value`` between two of a curve; None where none is found."""
    low, high = span.value(before.point), span.value(after.point)
    w, point = (value - low) / ((high - low) or 1.0), span.point(value)
    balance = Balance(train.elements, train.at(point))
    return converge(balance, point, (1 - w) * before.unknown + w * after.unknown)


def _widened(span: Range, resonance: float) -> Range:
    """A range of speeds, up to the ends of the resonances around its own ends."""
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
    """States that are found without a curve, at ``SEEDS`` and at the ends of the resonances around
    a range; of a range of torques those at the lowest one that lie on curves over speed."""
    for share in SEEDS if span.low < span.high else SEEDS[:1]:
        yield _state(train, span.point(span.low + share * (span.high - span.low)))
    for value in (wide.low, wide.high):
        if not span.low <= value <= span.high:
            yield _state(train, wide.point(value))
    if span.over == "load":
        lowest = Range("speed", span.fixed, span.fixed, span.low)
        for curve in curves(train, lowest, resonance=resonance):
            yield from curve.states


def _state(train: CondensedTrain, point: Point) -> Orbit | None:
    balance = Balance(train.elements, train.at(point))
    return converge(balance, point, balance.start())


def _on_curve(states: list[Orbit], span: Range, orbit: Orbit) -> bool:
    """Whether a state lies on a curve, on one of its states or between two."""
    value, x = span.value(orbit.point), orbit.unknown
    size = float(np.linalg.norm(x))
    for a, b in zip(states, states[1:] or states, strict=False):
        low, high = span.value(a.point), span.value(b.point)
        if (low - value) * (high - value) > 0.0 or low == high != value:
            continue
        w = (value - low) / (high - low) if high != low else 0.0
        if np.linalg.norm((1 - w) * a.unknown + w * b.unknown - x) <= SAME * size:
            return True
    return False


def _follow(
    train: CondensedTrain, span: Range, wide: Range, start: Orbit, seen: Callable[[Orbit], Orbit]
) -> tuple[list[Orbit], list[Cut | None]]:
    """States of the curve through a state, both ways over the wide range, and why it was cut before
    either of its ends; ``stopped`` stands at the last one."""
    walk, value = _Walk(train, span, wide, start, seen), wide.value(start.point)
    first = walk.stored(start)
    backward, forward, cuts = list[Orbit](), list[Orbit](), list[Cut | None]([None, None])
    try:
        if value > wide.low:
            cuts[0] = walk.along(walk.towards(-1.0), backward)
        if value < wide.high:
            cuts[1] = walk.along(walk.towards(1.0), forward)
    except KeyboardInterrupt:
        last = (forward or backward or [first])[-1]
        cuts[1 if forward or not backward else 0] = Cut(wide.value(last.point), "stopped")
    return [*backward[::-1], first, *forward], cuts


@dataclass(frozen=True)
class _Place:
    """A state, its equations, and how the curve is measured there: weights of the unknowns and λ,
    and its direction (m + 1,), of length one."""

    orbit: Orbit
    balance: Balance
    weight: Array
    tangent: Array


class _Walk:
    """Follows one curve over a wide range from a state of it, with finer steps within a narrow one,
    at whose edges it has states."""

    def __init__(
        self, train: CondensedTrain, span: Range, wide: Range, start: Orbit,
        seen: Callable[[Orbit], Orbit],
    ) -> None:  # fmt: skip
        self.train, self.narrow, self.span, self.seen = train, span, wide, seen
        self.width = wide.high - wide.low
        self.solver = Solver()
        self.balance = self._balance(wide.value(start.point))
        state = self.balance.residual(start.unknown)[1]
        self.start = replace(state, point=start.point)
        self.size = self._forces(start.unknown)
        self.most = RISE * float(np.abs(state.force).max()) + _closing_force(train)

    def stored(self, orbit: Orbit) -> Orbit:
        """What is kept of a state: beyond the narrow range nothing over time."""
        if self.narrow.holds(orbit.point):
            return self.seen(orbit)
        return replace(orbit.light, waves=Waves(*np.zeros((2, 0, 0))))

    def _balance(self, value: float) -> Balance:
        return Balance(self.train.elements, self.train.at(self.span.point(value)))

    def _forces(self, unknown: Array) -> float:
        return float(np.linalg.norm(unknown[: self.balance.forces])) or 1.0

    def towards(self, sense: float) -> _Place:
        """The start, with λ rising (1) or falling (−1) from there."""
        place = self._place(self.start, self.balance, None)
        return replace(place, tangent=place.tangent * np.sign(place.tangent[-1]) * sense)

    def off(self, direction: Array) -> _Place:
        """The start, with λ constant and the unknowns changing in a direction (m,)."""
        weight, tangent = self._weight(self.start), np.r_[direction, 0.0]
        tangent /= np.linalg.norm(weight * tangent)
        return _Place(self.start, self.balance, weight, tangent)

    def along(self, current: _Place, states: list[Orbit]) -> Cut | None:
        """Append states from the start on, up to an end of the wide range or to where a curve of a
        longer period meets that of half its period; where the curve is cut before."""
        step, bend = FIRST, np.zeros_like(current.tangent)
        for _ in range(MOST_STATES):
            step, before = min(step, self._longest(current)), self.span.value(current.orbit.point)
            while (following := self._next(current, bend, step)) is None or (
                step > FIRST and self._rejoins(current.orbit, following[0].orbit)
            ):
                step *= 0.5
                if step < SHORTEST:
                    return Cut(before, "steps")
            successor, tries = following
            if self._rejoins(current.orbit, successor.orbit):
                return None
            edge = self._edge(before, self.span.value(successor.orbit.point))
            if edge is not None:
                orbit = between(self.train, self.span, current.orbit, successor.orbit, edge)
                if orbit is None:
                    return Cut(before, "steps")
                states.append(self.stored(orbit))
                if edge in (self.span.low, self.span.high):
                    return None
                bend, current = 0.0 * bend, self._place(orbit, self._balance(edge), current.tangent)
                continue
            states.append(self.stored(successor.orbit))
            if np.abs(successor.orbit.force).max() > self.most:
                return Cut(self.span.value(successor.orbit.point), "forces")
            bend, current = (successor.tangent - current.tangent) / step, successor
            step *= 1.4 if tries <= QUICK else 0.8
        return Cut(self.span.value(current.orbit.point), "states")

    def _rejoins(self, before: Orbit, after: Orbit) -> bool:
        """Whether the odd harmonics, which states of half the period lack, vanish on the way from
        one state to another."""
        if self.train.elements.gear_meshes == 1:
            return False
        a, b = (self.balance.parts(orbit.unknown)[0][1::2] for orbit in (before, after))
        size = np.vdot(a, a).real
        return bool(size > 0.0 and np.vdot(a, b).real < REJOINED * size)

    def _longest(self, current: _Place) -> float:
        """Longest step from a place on."""
        inside = self.narrow.holds(current.orbit.point)
        width = (self.narrow.high - self.narrow.low if inside else 0.0) or self.width
        return LONGEST * min(1.0, width / (abs(current.tangent[-1]) or width))

    def _edge(self, before: float, after: float) -> float | None:
        """The first edge of both ranges on the way from one λ to another."""
        edges = (self.span.low, self.narrow.low, self.narrow.high, self.span.high)
        crossed = [e for e in edges if (e - before) * (e - after) < 0.0 or e == after]
        return min(crossed, key=lambda e: abs(e - before), default=None)

    def _next(self, current: _Place, bend: Array, step: float) -> tuple[_Place, int] | None:
        """The place a step further on, and Newton's tries; None where there is none, or where the
        curve turns too fast on the way."""
        corrected = self._corrected(current, bend, step)
        if corrected is None:
            return None
        orbit, balance, tries = corrected
        successor = self._place(orbit, balance, current.tangent)
        turned = float(
            (successor.weight * successor.tangent) @ (successor.weight * current.tangent)
        )
        turned /= float(np.linalg.norm(successor.weight * current.tangent))
        return None if step > KINK and turned < STRAIGHT else (successor, tries)

    def _weight(self, orbit: Orbit) -> Array:
        """Of the unknowns and λ (m + 1,) in the length of a curve. Rigid motions follow the forces,
        and have no length of their own."""
        weight = np.zeros(len(orbit.unknown) + 1)
        forces = max(self.size, self._forces(orbit.unknown))
        weight[: self.balance.forces] = 1.0 / (FORCE_SPAN * forces)
        weight[-1] = 1.0 / max(self.width, 0.5 * self.span.high)
        return weight

    def _place(self, orbit: Orbit, balance: Balance, before: Array | None) -> _Place:
        """With the direction on from ``before``."""
        size, weight = len(orbit.unknown), self._weight(orbit)
        right = np.zeros(size + 1)
        right[-1] = 1.0
        border = right if before is None else weight**2 * before
        slope = self._slope(balance, orbit, self.span.value(orbit.point))
        tangent = self.solver.solve(balance, orbit, right, slope, border)
        return _Place(orbit, balance, weight, tangent / np.linalg.norm(weight * tangent))

    def _slope(self, balance: Balance, orbit: Orbit, value: float) -> Array:
        """∂ residual / ∂ λ (m,) at a state of the equations ``balance``."""
        shifted = self._balance(value * (1 + DIFFERENCE))
        return np.asarray(balance.change(shifted, orbit) / (DIFFERENCE * value))

    def _corrected(
        self, current: _Place, bend: Array, step: float
    ) -> tuple[Orbit, Balance, int] | None:
        """The state a step further on, its equations and Newton's tries; None where there is
        none."""
        size = len(current.orbit.unknown)
        predicted = np.r_[current.orbit.unknown, self.span.value(current.orbit.point)]
        predicted += step * current.tangent + 0.5 * step**2 * bend
        x, across, slope = predicted.copy(), current.weight**2 * current.tangent, np.zeros(size)
        for tries in range(1, CORRECTIONS + 1):
            value = float(x[-1])
            if value <= 0.0:
                return None
            balance = self._balance(value)
            left, state = balance.residual(x[:size])
            if state.residual <= AGREES and tries > 1:
                return replace(state, point=self.span.point(value)), balance, tries
            if tries <= EXACT_SLOPES:
                slope = self._slope(balance, state, value)
            right = np.r_[left, across @ (x - predicted)]
            change = self.solver.solve(balance, state, right, slope, across)
            if not np.isfinite(change).all():
                return None
            x = x - change
        return None


def _closing_force(train: CondensedTrain) -> float:
    """Force, N, under which teeth yield by half of their largest gap or backlash."""
    e = train.elements
    teeth = e.owner >= 0
    stiffness = np.where(teeth, e.nominal[0], 0.0).sum(axis=1).max(initial=0.0)
    return float(0.5 * stiffness * np.abs(np.where(teeth, e.offset, 0.0)).max(initial=0.0))
