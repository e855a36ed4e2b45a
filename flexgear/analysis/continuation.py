r"""Curves of steady states over speed or torque, by pseudo-arclength continuation.

A curve is followed with the parameter λ as one unknown more. From a state with the tangent t, whose
part along the curve is measured as

    ds² = (dλ/span)² + ‖df/f_0‖²/w²,

f_0 being the mean forces at its first state, a step predicts x + t ds and corrects on the plane
across it, so that turning points are states like all others (Keller 1977). Steps get shorter where
Newton takes many tries or the tangent turns fast, as where teeth begin to part.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from flexgear.analysis.harmonic_balance import AGREES, Balance, Orbit, converge, solve_scaled
from flexgear.analysis.orbit_receptance import CondensedTrain, Point
from flexgear.arrays import Array

Over = Literal["speed", "load"]
FORCE_SPAN = 4.0  # w: times the mean forces that are as long as the whole range of λ
FIRST, LONGEST, SHORTEST = 0.004, 0.02, 1e-7  # steps, of the range
CORRECTIONS = 8  # Newton steps before a shorter step is tried
EXACT_SLOPES = 2  # of them after which ∂/∂λ is kept
QUICK = 4  # so many or fewer make the next step longer
STRAIGHT = 0.92  # cosine between tangents of neighbouring states
KINK = 1e-3  # step over which the curve may turn at once, as where a sample loses contact
MOST_STATES = 4000  # of a curve
DIFFERENCE = 1e-7  # of λ, for ∂/∂λ
SAME = 0.02  # of the mean forces: states of one curve interpolate each other so well
SEEDS = (0.0, 1.0, 0.5, 0.25, 0.75)  # of the range: where states are looked for without a curve


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
class Curve:
    """States in the order in which they follow each other; complete: it was followed up to both
    ends of the range, or from one to the same one."""

    states: list[Orbit]
    complete: bool


def curves(
    train: CondensedTrain, span: Range, seen: Callable[[Orbit], Orbit] = lambda orbit: orbit
) -> Iterator[Curve]:
    """All curves that states without a curve near them, at ``SEEDS``, lead to.

    seen: is called with every state as it is found, and gives what is kept of it.
    """
    followed: list[Curve] = []
    for share in SEEDS:
        value = span.low + share * (span.high - span.low)
        start = _state(train, span, value)
        if start is None or any(_on_curve(curve, span, start) for curve in followed):
            continue
        walk = _Walk(train, span, start, seen)
        first = seen(start)
        back, back_done = walk.along(-1.0) if value > span.low else ([], True)
        ahead, ahead_done = walk.along(1.0) if value < span.high else ([], True)
        curve = Curve([*back[::-1], first, *ahead], back_done and ahead_done)
        followed.append(curve)
        yield curve


def _state(train: CondensedTrain, span: Range, value: float) -> Orbit | None:
    point = span.point(value)
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


class _Walk:
    """Follows one curve from a state of it."""

    def __init__(
        self, train: CondensedTrain, span: Range, start: Orbit, seen: Callable[[Orbit], Orbit]
    ) -> None:
        self.train, self.span, self.start, self.seen = train, span, start, seen
        balance = self._balance(span.value(start.point))
        forces, q = balance.forces, balance.q
        scale = FORCE_SPAN * float(np.linalg.norm(start.unknown[:q])) or 1.0
        # rigid motions follow the forces, and have no length of their own
        self.weight = np.zeros(balance.size + 1)
        self.weight[:forces], self.weight[-1] = 1.0 / scale, 1.0 / (span.high - span.low)

    def _balance(self, value: float) -> Balance:
        return Balance(self.train.elements, self.train.at(self.span.point(value)))

    def along(self, sense: float) -> tuple[list[Orbit], bool]:
        """States from the start on, first with λ rising (1) or falling (−1), and whether the curve
        leaves the range."""
        orbit, states, step = self.start, list[Orbit](), FIRST
        tangent = self._tangent(orbit, None)
        tangent = tangent * np.sign(tangent[-1]) * sense
        while len(states) < MOST_STATES:
            ahead = self._ahead(orbit, tangent, step)
            turned = None if ahead is None else self._tangent(ahead[0], tangent)
            if ahead is None or turned is None:
                step *= 0.5
                if step < SHORTEST:
                    return states, False
                continue
            if step > KINK and self._angle(turned, tangent) < STRAIGHT:
                step *= 0.5
                continue
            (orbit, tries), tangent, before = ahead, turned, orbit
            value = self.span.value(orbit.point)
            if not self.span.low < value < self.span.high:
                end = self._end(before, orbit)
                return [*states, *([] if end is None else [self.seen(end)])], end is not None
            states.append(self.seen(orbit))
            step = min(step * (1.4 if tries <= QUICK else 0.8), LONGEST)
        return states, False

    def _angle(self, a: Array, b: Array) -> float:
        return float((self.weight * a) @ (self.weight * b))

    def _tangent(self, orbit: Orbit, before: Array | None) -> Array:
        """Direction (m + 1,) of the curve at a state, of length one, on from ``before``."""
        value, size = self.span.value(orbit.point), len(orbit.unknown)
        balance = self._balance(value)
        at, matrix = balance.linearised(orbit)
        slope = self._slope(orbit.unknown, value, balance.residual(orbit.unknown)[0])
        out = np.zeros(size + 1)
        border = np.zeros(len(at) + 1)
        border[-1] = 1.0
        if before is not None:
            border = (self.weight**2 * before)[np.r_[at, size]]
        right = np.zeros(len(at) + 1)
        right[-1] = 1.0
        solved = solve_scaled(_bordered(matrix, slope[at], border), right)
        out[np.r_[at, size]] = solved
        return out / np.linalg.norm(self.weight * out)

    def _slope(self, unknown: Array, value: float, left: Array) -> Array:
        """∂ residual / ∂ λ (m,) where ``left`` (m,) is left over."""
        ahead = self._balance(value * (1 + DIFFERENCE)).residual(unknown)[0]
        return np.asarray((ahead - left) / (DIFFERENCE * value))

    def _ahead(self, orbit: Orbit, tangent: Array, step: float) -> tuple[Orbit, int] | None:
        """The state a step further on, and Newton's tries; None where there is none."""
        size = len(orbit.unknown)
        predicted = np.r_[orbit.unknown, self.span.value(orbit.point)] + step * tangent
        x, across, slope = predicted.copy(), self.weight**2 * tangent, np.zeros(size)
        for tries in range(1, CORRECTIONS + 1):
            if x[-1] <= 0.0:
                return None
            balance = self._balance(float(x[-1]))
            left, state = balance.residual(x[:size])
            if state.residual <= AGREES and tries > 1:
                return replace(state, point=self.span.point(float(x[-1]))), tries
            if tries <= EXACT_SLOPES:
                slope = self._slope(x[:size], float(x[-1]), left)
            at, matrix = balance.linearised(state)
            every = np.r_[at, size]
            right = np.r_[left[at], across @ (x - predicted)]
            change = np.r_[left, 0.0]  # of channels that carry nothing
            try:
                change[every] = solve_scaled(_bordered(matrix, slope[at], across[every]), right)
            except np.linalg.LinAlgError:
                return None
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


def _bordered(matrix: Array, column: Array, row: Array) -> Array:
    n = len(matrix)
    out = np.empty((n + 1, n + 1))
    out[:n, :n], out[:n, n], out[n] = matrix, column, row
    return out
