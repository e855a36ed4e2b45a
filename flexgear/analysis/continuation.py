r"""Curves of steady states over speed or torque, by pseudo-arclength continuation.

A curve is followed with the parameter λ as one unknown more. From a state with forces f and the
tangent t, whose part along the curve is measured as

    ds² = (dλ/L)² + ‖df/f_s‖²/w²,   f_s = max(‖f_0‖, ‖f‖),

f_0 being the forces at its first state and L the range, or half of its upper end if that is more
(sharp turns would turn by half a circle where λ counted more), a step predicts
x + t ds + ½ ds² dt/ds, dt/ds from the state before, and corrects on the plane across t, so that
turning points are states like all others (Keller 1977). Steps get shorter where Newton takes many
tries or the tangent turns fast, as where teeth begin to part.

Curves that reach into a range from beyond it, such as the one of parted teeth over a range within
the hysteresis, are entered by following those at its ends round the resonance and back, and those
at the far ends of the resonance to the range.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from flexgear.analysis.harmonic_balance import AGREES, Balance, Orbit, Solver, converge
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

    @property
    def complete(self) -> bool:
        """Whether it was followed to both ends of the range, or from one to the same one."""
        return not self.cuts


def curves(
    train: CondensedTrain,
    span: Range,
    seen: Callable[[Orbit], Orbit] = lambda orbit: orbit,
    resonance: float = 0.0,
) -> Iterator[Curve]:
    """All curves through states that no other curve passes (``_starts``).

    seen: is called with every computed state and returns what is kept of it. resonance: speed over
    rated at which gears vibrate on their gear mesh; 0 where no curve is followed outside the range.
    Ends with a curve that a user stopped.
    """
    followed, returning = list[Curve](), deque[tuple[Orbit | None, int]]()
    starts = _starts(train, span, resonance)
    while entry := returning.popleft() if returning else next(starts, None):
        start, origin = entry
        if start is None or any(_on_curve(curve, span, start) for curve in followed):
            continue
        curve = _follow(train, span, start, seen)
        followed.append(curve)
        yield curve
        if any(cut.reason == "stopped" for cut in curve.cuts):
            return
        for end, sense in _outward(curve, span):
            beyond = _beyond(end.point, sense, resonance)
            if beyond and not (end.unknown is start.unknown and sense == origin):
                returning.append((_entering(train, beyond, end, sense, end.point), sense))


def _starts(
    train: CondensedTrain, span: Range, resonance: float
) -> Iterator[tuple[Orbit | None, int]]:
    """States that are found without a curve, at ``SEEDS`` and at the far ends of the resonance,
    from where curves are followed to the range; 1 or −1: the speeds that they come from are higher
    or lower."""
    for share in SEEDS:
        yield _state(train, span.point(span.low + share * (span.high - span.low))), 0
    last = span.high if span.over == "speed" else span.low
    for value, sense in ((last, 1), (span.low, -1)):
        point = span.point(value)
        beyond = _beyond(point, sense, resonance)
        if beyond:
            start = _state(train, beyond.point(beyond.high if sense > 0 else beyond.low))
            yield start and _entering(train, beyond, start, -sense, point), sense


def _state(train: CondensedTrain, point: Point) -> Orbit | None:
    balance = Balance(train.elements, train.at(point))
    return converge(balance, point, balance.start())


def _on_curve(curve: Curve, span: Range, orbit: Orbit) -> bool:
    """Whether a state lies on a curve, between two of its states."""
    value, x = span.value(orbit.point), orbit.unknown
    size = float(np.linalg.norm(x))
    for a, b in zip(curve.states, curve.states[1:], strict=False):
        low, high = span.value(a.point), span.value(b.point)
        if (low - value) * (high - value) > 0.0 or low == high:
            continue
        w = (value - low) / (high - low)
        if np.linalg.norm((1 - w) * a.unknown + w * b.unknown - x) <= SAME * size:
            return True
    return False


def _follow(
    train: CondensedTrain, span: Range, start: Orbit, seen: Callable[[Orbit], Orbit]
) -> Curve:
    """The curve through a state, both ways."""
    walk, value = _Walk(train, span, start), span.value(start.point)
    first, cuts = seen(start), list[Cut | None]()
    backward, forward = list[Orbit](), list[Orbit]()
    try:
        if value > span.low:
            cuts.append(walk.along(-1.0, backward, seen))
        if value < span.high:
            cuts.append(walk.along(1.0, forward, seen))
    except KeyboardInterrupt:
        last = (forward or backward or [first])[-1]
        cuts.append(Cut(span.value(last.point), "stopped"))
    return Curve([*backward[::-1], first, *forward], tuple(cut for cut in cuts if cut))


def _outward(curve: Curve, span: Range) -> Iterator[tuple[Orbit, int]]:
    """Ends of a curve that lead out of the range with rising (1) or falling speed."""
    for end in (curve.states[0], curve.states[-1]):
        value = span.value(end.point)
        if value == span.high and span.over == "speed":
            yield end, 1
        elif value == span.low:
            yield end, -1
            if span.over == "load":
                yield end, 1


def _beyond(point: Point, sense: int, resonance: float) -> Range | None:
    """Speeds from a point's on, rising or falling, up to the end of the resonance around it; None
    where it is outside all of them."""
    speed = point.speed
    for low, high in RESONANT:
        if low * resonance < speed < high * resonance:
            edge = (high if sense > 0 else low) * resonance
            return Range("speed", min(speed, edge), max(speed, edge), point.load)
    return None


def _entering(
    train: CondensedTrain, beyond: Range, start: Orbit, sense: int, point: Point
) -> Orbit | None:
    """The state at ``point`` if the curve through ``start`` comes to it over speed."""
    states = list[Orbit]()
    cut = _Walk(train, beyond, start).along(sense, states, lambda orbit: orbit)
    return states[-1] if cut is None and states[-1].point == point else None


@dataclass(frozen=True)
class _Place:
    """A state, its equations, and how the curve is measured there: weights of the unknowns and λ,
    and its direction (m + 1,), of length one."""

    orbit: Orbit
    balance: Balance
    weight: Array
    tangent: Array


class _Walk:
    """Follows one curve from a state of it."""

    def __init__(self, train: CondensedTrain, span: Range, start: Orbit) -> None:
        self.train, self.span, self.width = train, span, span.high - span.low
        self.solver = Solver()
        self.balance = self._balance(span.value(start.point))
        state = self.balance.residual(start.unknown)[1]
        self.start = replace(state, point=start.point)
        self.size = self._forces(start.unknown)
        self.most = RISE * float(np.abs(state.force).max()) + _closing_force(train)

    def _balance(self, value: float) -> Balance:
        return Balance(self.train.elements, self.train.at(self.span.point(value)))

    def _forces(self, unknown: Array) -> float:
        return float(np.linalg.norm(unknown[: self.balance.forces])) or 1.0

    def along(
        self, sense: float, states: list[Orbit], seen: Callable[[Orbit], Orbit]
    ) -> Cut | None:
        """Append states from the start on, first with λ rising (1) or falling (−1), up to the end
        of the range; where the curve is cut before."""
        current = self._place(self.start, self.balance, None)
        current = replace(current, tangent=current.tangent * np.sign(current.tangent[-1]) * sense)
        step, bend = FIRST, np.zeros_like(current.tangent)
        for _ in range(MOST_STATES):
            while (following := self._next(current, bend, step)) is None:
                step *= 0.5
                if step < SHORTEST:
                    return Cut(self.span.value(current.orbit.point), "steps")
            successor, tries = following
            value = self.span.value(successor.orbit.point)
            if not self.span.low < value < self.span.high:
                end = self._end(current.orbit, successor.orbit)
                states += [] if end is None else [seen(end)]
                return None if end else Cut(self.span.value(current.orbit.point), "steps")
            states.append(seen(successor.orbit))
            if np.abs(successor.orbit.force).max() > self.most:
                return Cut(value, "forces")
            bend, current = (successor.tangent - current.tangent) / step, successor
            longest = LONGEST * min(1.0, self.width / (abs(current.tangent[-1]) or self.width))
            step = min(step * (1.4 if tries <= QUICK else 0.8), longest)
        return Cut(self.span.value(current.orbit.point), "states")

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

    def _place(self, orbit: Orbit, balance: Balance, before: Array | None) -> _Place:
        """With the direction on from ``before``."""
        size = len(orbit.unknown)
        # rigid motions follow the forces, and have no length of their own
        weight = np.zeros(size + 1)
        forces = max(self.size, self._forces(orbit.unknown))
        weight[: balance.forces] = 1.0 / (FORCE_SPAN * forces)
        weight[-1] = 1.0 / max(self.width, 0.5 * self.span.high)
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

    def _end(self, before: Orbit, after: Orbit) -> Orbit | None:
        """The state at the end of the range between two."""
        low, high = self.span.value(before.point), self.span.value(after.point)
        value = self.span.low if high <= self.span.low else self.span.high
        w = (value - low) / (high - low)
        point = self.span.point(value)
        balance = Balance(self.train.elements, self.train.at(point))
        return converge(balance, point, (1 - w) * before.unknown + w * after.unknown)


def _closing_force(train: CondensedTrain) -> float:
    """Force, N, under which teeth yield by half of their largest gap or backlash."""
    e = train.elements
    teeth = e.owner >= 0
    stiffness = np.where(teeth, e.nominal[0], 0.0).sum(axis=1).max(initial=0.0)
    return float(0.5 * stiffness * np.abs(np.where(teeth, e.offset, 0.0)).max(initial=0.0))
