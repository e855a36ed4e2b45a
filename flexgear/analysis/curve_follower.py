"""One curve of steady states over speed or torque, by pseudo-arclength continuation.

A curve is followed with the parameter λ (speed or torque) as a further unknown. Its arc length is

    ds² = (dλ/L)² + ‖df/f_s‖²/w²,   f_s = max(‖f_0‖, ‖f‖),

f the forces at a state, f_0 those at the first state, L the range of λ, or half of its upper end if
that is more (with a smaller L the tangent would turn by almost half a circle at sharp turning
points). A step from the state x with the tangent t predicts x + t ds + ½ ds² dt/ds, with dt/ds from
the previous step, and corrects in the plane normal to t, so that turning points need no special
treatment (Keller 1977). Steps get shorter where Newton's method needs many iterations or the
tangent turns fast, as where teeth begin to part.
"""

import math
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from flexgear.analysis.harmonic_balance import TOLERANCE, Balance, Orbit, Solver, Waves, converge
from flexgear.analysis.orbit_receptance import CondensedTrain, Range
from flexgear.arrays import Array

FORCE_WEIGHT = 4.0  # w
FIRST, LONGEST, SHORTEST = 0.004, 0.02, 1e-7  # steps over L; the longest also over the range
MAX_CORRECTIONS = 8  # Newton steps before a shorter step is tried
FEW_CORRECTIONS = 4  # Newton steps with which the next step is longer
LARGEST_TURN, TURN = 0.55, 0.35  # of the tangent in a step, rad: accepted, and aimed at
KINK = 1e-3  # step below which the tangent may turn at once, as where a sample loses contact
FLAT, FOLD_STEPS = 1e-3, 6  # part of the unit tangent along λ at a turning point; steps to it
GROWTH = 1.4  # of a step after few corrections
MAX_STATES = 4000  # of a curve
# twice the steps from the shortest to the longest: a curve that has not come as far as by its
# first step in so many of them does not recover, as it does behind a kink
CREEP = 2 * math.ceil(math.log(LONGEST / SHORTEST) / math.log(GROWTH))
MAX_RISE = 10.0  # of forces over the largest at the first state, added to the force over backlash
DIFFERENCE = 1e-7  # of λ, for ∂/∂λ
REJOINED = 1e-3  # product of the odd harmonics of two states over their square: below, they vanish


@dataclass(frozen=True)
class Cut:
    """Reason why a curve ends within the range, and λ at that end.

    reason: forces above the limit, no state but at short steps, too many states, or the user."""

    value: float
    reason: Literal["forces", "steps", "states", "stopped"]


def state_between(
    train: CondensedTrain, span: Range, before: Orbit, after: Orbit, value: float
) -> Orbit | None:
    """The state at λ = ``value`` between two states of a curve; None without convergence."""
    low, high = span.value(before.point), span.value(after.point)
    w, point = (value - low) / ((high - low) or 1.0), span.point(value)
    balance = Balance(train.elements, train.at(point))
    return converge(balance, point, (1 - w) * before.unknown + w * after.unknown)


def interpolated(states: Sequence[Orbit], span: Range, value: float) -> Iterator[Array]:
    """Unknowns (m,) of all states of a curve at λ = ``value``, interpolated between neighbours."""
    for a, b in zip(states, states[1:] or states, strict=False):
        low, high = span.value(a.point), span.value(b.point)
        if (low - value) * (high - value) > 0.0 or low == high != value:
            continue
        w = (value - low) / (high - low) if high != low else 0.0
        yield (1 - w) * a.unknown + w * b.unknown


@dataclass(frozen=True)
class _CurvePoint:
    """A state, its equations, the weights (m + 1,) of the unknowns and λ in the arc length, and the
    unit tangent (m + 1,) of the curve."""

    orbit: Orbit
    balance: Balance
    weight: Array
    tangent: Array

    @property
    def along(self) -> float:
        """Part of the unit tangent along λ."""
        return float(self.weight[-1] * self.tangent[-1])


# start of a step along a curve, change of the tangent per length before, length over L, and end
_Step = tuple[_CurvePoint, Array, float, _CurvePoint]


class CurveFollower:
    """Computes the states of one curve, step by step from one of them, over a wide range of λ. In
    the narrow range inside it steps are shorter, and its two ends are states."""

    def __init__(
        self, train: CondensedTrain, span: Range, wide: Range, start: Orbit,
        keep: Callable[[Orbit], Orbit], left: Sequence[Orbit] = (),
        beyond: Callable[[float], None] = lambda share: None,
    ) -> None:  # fmt: skip
        self.beyond = beyond
        self.train, self.narrow, self.span, self.keep, self.left = train, span, wide, keep, left
        self.width = wide.high - wide.low
        self.solver = Solver()
        self.balance = self._balance(wide.value(start.point))
        state = self.balance.residual(start.unknown)[1]
        self.start = replace(state, point=start.point)
        self.start_forces = self._norm(start.unknown)
        self.max_force = MAX_RISE * float(np.abs(state.force).max()) + _backlash_force(train)

    def stored(self, orbit: Orbit) -> Orbit:
        """The state to be stored; outside the narrow range without histories over time."""
        if self.narrow.holds(orbit.point):
            return self.keep(orbit)
        value, inner, outer = self.span.value(orbit.point), self.narrow, self.span
        begin, end = (inner.high, outer.high) if value > inner.high else (inner.low, outer.low)
        if end != begin:
            self.beyond((value - begin) / (end - begin))
        return replace(orbit.without_histories, waves=Waves(*np.zeros((2, 0, 0))))

    def _balance(self, value: float) -> Balance:
        return Balance(self.train.elements, self.train.at(self.span.point(value)))

    def _norm(self, unknown: Array) -> float:
        """‖f‖ of unknowns, 1 where all forces are zero."""
        return float(np.linalg.norm(unknown[: self.balance.forces])) or 1.0

    def start_towards(self, sense: float) -> _CurvePoint:
        """The start, with a tangent along which λ rises (1) or falls (−1)."""
        start = self._curve_point(self.start, self.balance, None)
        return replace(start, tangent=start.tangent * np.sign(start.tangent[-1]) * sense)

    def start_in(self, direction: Array) -> _CurvePoint:
        """The start, with a tangent in a direction (m,) of the unknowns at constant λ."""
        weight, tangent = self._weight(self.start), np.r_[direction, 0.0]
        tangent /= np.linalg.norm(weight * tangent)
        return _CurvePoint(self.start, self.balance, weight, tangent)

    def follow(self, current: _CurvePoint, states: list[Orbit]) -> Cut | None:
        """Append the states after ``current`` up to an end of the wide range, or to where a curve
        of a longer period meets that of half its period. Returns the cut, if any, before."""
        edges = (self.span.low, self.narrow.low, self.narrow.high, self.span.high)
        leaving: _Step | None = None
        step, bend, steps = FIRST, np.zeros_like(current.tangent), deque[float](maxlen=CREEP)
        for _ in range(MAX_STATES):
            longest, before = self._longest(current), self.span.value(current.orbit.point)
            step = min(step, longest)
            while (following := self._next(current, bend, step)) is None or (
                step > FIRST and self._rejoins(current.orbit, following[0].orbit)
            ):
                step *= 0.5
                if step < SHORTEST:
                    return Cut(before, "steps")
            successor, corrections, turn = following
            if self._rejoins(current.orbit, successor.orbit):
                return None
            after = self.span.value(successor.orbit.point)
            crossed = [e for e in edges if (e - before) * (e - after) < 0.0 or e == after]
            if crossed:
                edge = min(crossed, key=lambda e: abs(e - before))
                orbit = state_between(self.train, self.span, current.orbit, successor.orbit, edge)
                if orbit is None:
                    return Cut(before, "steps")
                states.append(self.stored(orbit))
                if edge in (self.span.low, self.span.high):
                    return None
                current = self._curve_point(orbit, self._balance(edge), current.tangent)
                bend, leaving = 0.0 * bend, None
                continue
            arrived, leaving = leaving, (current, bend, step, successor)
            if arrived and (fold := self._fold(arrived, leaving)):
                states.insert(len(states) - fold[1], self.stored(fold[0]))
            states.append(self.stored(successor.orbit))
            if np.abs(successor.orbit.force).max() > self.max_force:
                return Cut(after, "forces")
            steps.append(step / longest)
            if len(steps) == CREEP and sum(steps) < FIRST / LONGEST:
                return Cut(after, "steps")
            bend, current = (successor.tangent - current.tangent) / step, successor
            step *= GROWTH if corrections <= FEW_CORRECTIONS else 0.8
            step *= max(TURN / max(turn, TURN), 0.5)
        return Cut(self.span.value(current.orbit.point), "states")

    def _rejoins(self, before: Orbit, after: Orbit) -> bool:
        """Whether the curve meets the one that it has left between two states: the deviation from
        it, for a doubled period the odd harmonics, vanishes or reverses there."""
        a, b = self._deviation(before), self._deviation(after)
        size = np.vdot(a, a).real
        return bool(size > 0.0 and np.vdot(a, b).real < REJOINED * size)

    def _deviation(self, orbit: Orbit) -> Array:
        """Difference of forces to the curve that was left; zero where that is not known."""
        if not self.left and self.train.elements.gear_meshes > 1:
            return np.asarray(self.balance.parts(orbit.unknown)[0][1::2])
        forces, value = orbit.unknown[: self.balance.forces], self.span.value(orbit.point)
        differences = [forces - x[: len(forces)] for x in interpolated(self.left, self.span, value)]
        return min(differences, key=lambda x: float(np.linalg.norm(x)), default=0.0 * forces)

    def _longest(self, current: _CurvePoint) -> float:
        """Longest step from a point of the curve."""
        inside = self.narrow.holds(current.orbit.point)
        width = (self.narrow.high - self.narrow.low if inside else 0.0) or self.width
        return LONGEST * min(1.0, width / (abs(current.tangent[-1]) or width))

    def _next(
        self, current: _CurvePoint, bend: Array, step: float
    ) -> tuple[_CurvePoint, int, float] | None:
        """The point one step ahead, the number of Newton steps and the angle, rad, by which the
        tangent turns; None without convergence, or where it turns too far."""
        corrected = self._corrected(current, bend, step)
        if corrected is None:
            return None
        orbit, balance, corrections = corrected
        successor = self._curve_point(orbit, balance, current.tangent)
        before = successor.weight * current.tangent
        cosine = float((successor.weight * successor.tangent) @ before / np.linalg.norm(before))
        turn = float(np.arccos(np.clip(cosine, -1.0, 1.0)))
        return None if step > KINK and turn > LARGEST_TURN else (successor, corrections, turn)

    def _fold(self, arrived: _Step, leaving: _Step) -> tuple[Orbit, int] | None:
        """The state at which λ turns back, if it does so at the point between two steps in the
        narrow range; and the number of states behind it, 1 in the first step, else 0."""
        start, middle, end = arrived[0], leaving[0], leaving[-1]
        before, value, after = (self.span.value(x.orbit.point) for x in (start, middle, end))
        if (value - before) * (after - value) >= 0.0 or not self.narrow.holds(middle.orbit.point):
            return None
        behind = int(start.along * middle.along < 0.0)
        fold = self._level(arrived if behind else leaving)
        further = fold and (self.span.value(fold.point) - value) * (value - before) > 0.0
        return (fold, behind) if fold and further else None

    def _level(self, within: _Step) -> Orbit | None:
        """The state in a step where the tangent has no part along λ; None unless it has parts of
        opposite sense at both ends. By regula falsi (Illinois)."""
        start, bend, step, end = within
        near, far, orbit = (0.0, start.along), (step, end.along), None
        if step < KINK or near[1] * far[1] >= 0.0 or min(abs(near[1]), abs(far[1])) < FLAT:
            return None
        for _ in range(FOLD_STEPS):
            length = (near[0] * far[1] - far[0] * near[1]) / (far[1] - near[1])
            corrected = self._corrected(start, bend, length)
            if corrected is None:
                break
            point = self._curve_point(*corrected[:2], start.tangent)
            orbit = point.orbit
            if abs(point.along) < FLAT:
                break
            near = far if point.along * far[1] < 0.0 else (near[0], 0.5 * near[1])
            far = length, point.along
        return orbit

    def _weight(self, orbit: Orbit) -> Array:
        """Weights (m + 1,) of the unknowns and λ in the arc length; zero for the amplitudes of
        rigid motions, which depend on the forces."""
        weight = np.zeros(len(orbit.unknown) + 1)
        forces = max(self.start_forces, self._norm(orbit.unknown))
        weight[: self.balance.forces] = 1.0 / (FORCE_WEIGHT * forces)
        weight[-1] = 1.0 / max(self.width, 0.5 * self.span.high)
        return weight

    def _curve_point(self, orbit: Orbit, balance: Balance, before: Array | None) -> _CurvePoint:
        """The state with the unit tangent of the curve there; its sense is that of ``before``, the
        tangent at the previous state."""
        size, weight = len(orbit.unknown), self._weight(orbit)
        right = np.zeros(size + 1)
        right[-1] = 1.0
        border = right if before is None else weight**2 * before
        slope = self._slope(balance, orbit, self.span.value(orbit.point))
        tangent = self.solver.solve(balance, orbit, right, slope, border)
        return _CurvePoint(orbit, balance, weight, tangent / np.linalg.norm(weight * tangent))

    def _slope(self, balance: Balance, orbit: Orbit, value: float) -> Array:
        """∂ residual / ∂ λ (m,) at a state of the equations ``balance``."""
        shifted = self._balance(value * (1 + DIFFERENCE))
        return np.asarray(balance.change(shifted, orbit) / (DIFFERENCE * value))

    def _corrected(
        self, current: _CurvePoint, bend: Array, step: float
    ) -> tuple[Orbit, Balance, int] | None:
        """The state one step ahead, its equations and the number of Newton steps; None where
        Newton's method does not converge."""
        size = len(current.orbit.unknown)
        predicted = np.r_[current.orbit.unknown, self.span.value(current.orbit.point)]
        predicted += step * current.tangent + 0.5 * step**2 * bend
        x, normal = predicted.copy(), current.weight**2 * current.tangent
        for iteration in range(1, MAX_CORRECTIONS + 1):
            value = float(x[-1])
            if value <= 0.0:
                return None
            balance = self._balance(value)
            imbalance, state = balance.residual(x[:size])
            if state.residual <= TOLERANCE and iteration > 1:
                return replace(state, point=self.span.point(value)), balance, iteration
            slope = self._slope(balance, state, value)
            right = np.r_[imbalance, normal @ (x - predicted)]
            change = self.solver.solve(balance, state, right, slope, normal)
            if not np.isfinite(change).all():
                return None
            x = x - change
        return None


def _backlash_force(train: CondensedTrain) -> float:
    """Force, N, that deflects the teeth by half of their largest gap or backlash."""
    e = train.elements
    teeth = e.owner >= 0
    stiffness = np.where(teeth, e.nominal[0], 0.0).sum(axis=1).max(initial=0.0)
    return float(0.5 * stiffness * np.abs(np.where(teeth, e.offset, 0.0)).max(initial=0.0))
