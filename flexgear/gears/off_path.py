"""Contact off the path of contact: the tip edge of one gear on the flank of its mate.

Before and after the path of contact one flank has ended at its tip, and the gears, turned as they
roll, leave a gap. Loaded teeth give way, so tips touch before the path begins and after it ends.

Frame of one end: origin at the base tangent point of the gear whose tip it is (index t, its mate
m), x along the line of action towards the contact, that gear's centre at (0, −r_t). r are base
radii, ρ = √(R² − r²) roll lengths, ρ_t and ρ_m those at the end of the path. At the distance d
beyond the end the gear has turned by ψ = d/r_t (a ring, whose roll length falls there, by −d/r_t),
and its tip edge stands at

    P = (ρ_t cos ψ + r_t sin ψ,  −r_t + r_t cos ψ − ρ_t sin ψ) .

From the mate's centre P is seen at the radius R, at the angle A from the radius to the mate's base
tangent point. There the flank that touches at d on the line of action, with its roll length ρ_m',
has the angle ρ_m'/r_m − inv R, inv R = ρ(R)/r_m − arctan(ρ(R)/r_m). Turned by gap/r_m it meets the
tip:

    gap = ± [r_m A − ρ_m' + r_m inv R]     (− where the mate is a ring), exactly.

With the centre distance a and the working angle α,

    gap = c d² + O(d³),   c = ρ_t a sin α / (2 r_t² ρ_m) :

the tip comes to lie d ρ_t/r_t below the line of action and stays back by d² ρ_t/(2 r_t²) along it;
the mate's flank has its centre of curvature at ρ_m, so it bends away by (d ρ_t/r_t)²/(2 ρ_m) if it
is convex, and with the tip if it is a ring's. Both together have ρ_m + ρ_t = a sin α outside, |ρ_m
− ρ_t| = a sin α at a ring.

The force stands normal to the mate's flank: on the tangent from P to the mate's base circle,
turned from the line of action by ε = A − arctan(ρ(R)/r_m), |ε| ≈ d ρ_t/(r_t ρ_m). Its lever about
the mate is r_m, about the other gear (1 − gap'(d)) r_t, because the moments of a touch that rolls
on do no work. With the line of action kept, as ``coupling.kernels.pairs`` does since coefficients
of large rotations must not vary, that moment is wrong by gap' ≈ 2 c d = 2 gap/d of itself: one or
two hundredths where the gap is a tooth's deflection. As far apart are gaps with the one gear turned
and with the other.

Where the pitch point lies on the path, tips move away from their mate's root beyond its ends. If
it does not, one of them may come to a fillet, and what that is thicker than the flank is taken off
the gap. A flank that ends before its tip does (at its mate's base circle, or because a case gives
the contact ratio) has no tip edge there, and its gap is infinite.

Known as corner contact: Munro, Morrish and Palmer 1999, Proc. Inst. Mech. Eng. C 213, 389-400. The
formulas follow from the involute alone.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.optimize import brentq

from flexgear.arrays import Array
from flexgear.gears.tooth import ToothGeometry, involutes

FURTHEST = 0.5  # base pitches beyond an end within which a touch is looked for
PLACES = 201
SAME_LENGTH = 1e-9  # relative: a path that ends at a tip


@dataclass(frozen=True)
class TipEdge:
    """The tip edge of one gear beyond one end of the path; symbols in the module's head.

    tooth, mate: whose tip, and whose flank it meets; tip_roll, mate_roll: ρ_t and ρ_m at the end of
    the path, m; offset: a sin α, m. Distances d ≥ 0 beyond the end, m, have any shape.
    """

    tooth: ToothGeometry
    mate: ToothGeometry
    tip_roll: float
    mate_roll: float
    offset: float

    def gap(self, distance: Array) -> Array:
        """Distance, m on its base circle, by which the mate would have to roll to touch the tip; ∞
        where the tip has left the mate's tooth, negative at interference of tips."""
        mate = self.mate
        radius, angle = self._seen_from_mate(distance)
        gap = _parted(mate, radius, angle, self.mate_roll - mate.outward * np.asarray(distance))
        gap -= mate.root.proud(radius)
        return np.where(mate.outward * (radius - mate.tip_radius) > 0, np.inf, gap)

    def roll_on_mate(self, distance: Array) -> Array:
        """Roll length of the place on the mate's flank that the tip meets, m."""
        radius, _ = self._seen_from_mate(distance)
        return np.sqrt(np.maximum(radius**2 - self.mate.base_radius**2, 0.0))

    @property
    def interior_angle(self) -> float:
        """Between flank and tip land inside the tooth, rad."""
        return math.pi / 2 + float(self.tooth.pressure_angle(np.array(self.tooth.tip_radius)))

    def rolls(self, distance: Array) -> tuple[Array, Array]:
        """Roll lengths on the flank of the tip and on its mate's, also before the end of the path
        (distance < 0), m."""
        d = np.asarray(distance, dtype=float)
        tip_roll = self.tip_roll + self.tooth.outward * np.minimum(d, 0.0)
        return tip_roll, np.where(
            d > 0, self.roll_on_mate(d), self.mate_roll - self.mate.outward * d
        )

    def apex(self, distance: Array) -> Array:
        """Along the flank from the tip edge to where the involutes touch, m: the arc of the roll
        lengths before the end (distance < 0), above zero; beyond it −d ρ_t/r_t, where the flank,
        continued past its tip, would touch, so that the gap is that squared over twice the relative
        radius."""
        d = np.asarray(distance, dtype=float)
        bend = 0.5 * self.tooth.outward * np.minimum(d, 0.0)
        return np.asarray(-d * (self.tip_roll + bend) / self.tooth.base_radius)

    def reach(self, approach: float) -> float:
        """Distance beyond the end at which the gap first exceeds ``approach`` (m), at most
        ``FURTHEST`` base pitches."""
        places = np.linspace(0.0, FURTHEST * self.tooth.base_pitch, PLACES)
        beyond = np.flatnonzero(self.gap(places[1:]) > approach)
        if approach <= 0.0 or not len(beyond):
            return 0.0 if approach <= 0.0 else float(places[-1])

        def excess(distance: float) -> float:
            return min(float(self.gap(np.array(distance))) - approach, approach)

        low, high = places[beyond[0]], places[beyond[0] + 1]
        return float(brentq(excess, low, high, xtol=1e-12 * high))

    def _seen_from_mate(self, distance: Array) -> tuple[Array, Array]:
        """R and A of the tip edge."""
        return _seen(self.tooth, self.mate, self.offset, self.tip_roll, distance)


def _turned_by(tooth: ToothGeometry, roll: Array | float, distance: Array) -> tuple[Array, Array]:
    """P of a point at ``roll`` on a flank so far beyond where it touches on the path, m."""
    arm = tooth.base_radius
    psi = tooth.outward * np.asarray(distance, dtype=float) / arm
    x = roll * np.cos(psi) + arm * np.sin(psi)
    return x, arm * (np.cos(psi) - 1.0) - roll * np.sin(psi)


def _seen(
    tooth: ToothGeometry, mate: ToothGeometry, offset: float, roll: Array | float, distance: Array
) -> tuple[Array, Array]:
    """R and A of such a point from its mate's centre."""
    x, y = _turned_by(tooth, roll, distance)
    base = mate.base_radius
    if mate.internal:
        along, across = x + offset, y + base
    elif tooth.internal:
        along, across = x - offset, y + base
    else:
        along, across = offset - x, base - y
    return np.hypot(along, across), np.arctan2(along, across)


def _parted(mate: ToothGeometry, radius: Array, angle: Array, rolled: Array) -> Array:
    """Gap of the module's head between involutes; rolled: ρ_m', m."""
    alpha, base = mate.pressure_angle(radius), mate.base_radius
    return np.asarray(mate.outward * (base * angle - rolled + base * involutes(alpha)))


OfEdge = Callable[[TipEdge | None, Array], Array]


@dataclass(frozen=True)
class OffPath:
    """Contact beyond both ends of the path s_lo … s_hi (m) of a planet with a ring, or of two
    external gears: before it the gear's tip meets the planet's flank, after it the planet's tip the
    gear's. offset: a sin α, m; cos_base_helix: share of the three-dimensional normal N in the
    transverse plane. Path coordinates s have any shape."""

    planet: ToothGeometry
    gear: ToothGeometry
    offset: float
    s_lo: float
    s_hi: float
    cos_base_helix: float

    @cached_property
    def before(self) -> TipEdge | None:
        """The gear's tip edge before s_lo; None where the path does not begin with it."""
        return self._edge(self.gear, self.planet, self.s_lo)

    @cached_property
    def after(self) -> TipEdge | None:
        """The planet's tip edge after s_hi; None where the path does not end with it."""
        return self._edge(self.planet, self.gear, self.s_hi)

    def gap(self, s: Array | float) -> Array:
        """Gap along N, m: zero on the path, ∞ beyond an end without a tip edge."""

        def along_normal(edge: TipEdge | None, distance: Array) -> Array:
            if edge is None:
                return np.full_like(distance, np.inf)
            return self.cos_base_helix * edge.gap(distance)

        return self._with_ends(s, np.zeros_like, along_normal, along_normal)

    def rolls(self, s: Array | float) -> tuple[Array, Array]:
        """Roll lengths, m, of the nearest points of the planet's and the gear's flank, where
        modifications are read off; that of a tip edge is its gear's tip."""

        def tip(edge: TipEdge | None, distance: Array) -> Array:
            return np.full_like(distance, np.nan if edge is None else edge.tip_roll)

        def flank(edge: TipEdge | None, distance: Array) -> Array:
            return tip(None, distance) if edge is None else edge.roll_on_mate(distance)

        return (
            self._with_ends(s, lambda s: s, flank, tip),
            self._with_ends(s, self.gear_roll, tip, flank),
        )

    def parted(self, s: Array, planet: Array, gear: Array) -> Array:
        """Distance along N, m, from a point of one flank to the other, both involutes, at path
        coordinates s; planet, gear: roll lengths of the point and where it would touch, for the
        flank with the nearer tip. Any one shape."""
        out = np.empty_like(s)
        of_planet = s > 0.5 * (self.s_lo + self.s_hi)
        for mine, tooth, mate, roll, sense in (
            (of_planet, self.planet, self.gear, planet, 1.0),
            (~of_planet, self.gear, self.planet, gear, -1.0),
        ):
            at, point = s[mine], roll[mine]
            on_path = point - self.offset if self.gear.internal else self.offset - point
            touch = point if sense > 0 else on_path
            seen = _seen(tooth, mate, self.offset, point, sense * (at - touch))
            out[mine] = _parted(mate, *seen, at if sense < 0 else self.gear_roll(at))
        return self.cos_base_helix * out

    def span(self, approach: float) -> tuple[float, float]:
        """First and last path coordinate, m, at which teeth touch when the gears are ``approach`` m
        closer along the normal N."""
        allowed = approach / self.cos_base_helix
        before, after = (0.0 if e is None else e.reach(allowed) for e in (self.before, self.after))
        return self.s_lo - before, self.s_hi + after

    def gear_roll(self, s: Array | float) -> Array:
        """Roll length on the gear's flank at path coordinates, m."""
        return np.asarray(self.offset + s if self.gear.internal else self.offset - s)

    def _edge(self, tooth: ToothGeometry, mate: ToothGeometry, s: float) -> TipEdge | None:
        """The tip edge of ``tooth`` at the end s of the path."""
        of_gear = float(self.gear_roll(s))
        roll, on_mate = (of_gear, s) if tooth is self.gear else (s, of_gear)
        true = tooth.roll_length(tooth.tip_radius)
        if on_mate <= 0.0 or abs(roll - true) > SAME_LENGTH * true:
            return None
        return TipEdge(tooth, mate, roll, on_mate, self.offset)

    def _with_ends(
        self, s: Array | float, on_path: Callable[[Array], Array], before: OfEdge, after: OfEdge
    ) -> Array:
        """Values on the path, and of both edges at the distances beyond its ends."""
        s = np.asarray(s, dtype=float)
        out = np.array(on_path(s))
        for beyond, value, edge in ((self.s_lo - s, before, self.before),
                                    (s - self.s_hi, after, self.after)):  # fmt: skip
            out[beyond > 0] = value(edge, beyond[beyond > 0])
        return out
