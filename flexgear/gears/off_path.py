"""Contact off the path of contact: the tip edge of one gear on the flank of its mate.

Before and after the path of contact one flank has ended at its tip, and a gap is left between the
rolling gears. Loaded teeth deflect, so tips touch before the path begins and after it ends.

Frame at one end of the path: origin at the base tangent point of the gear with the tip (index t,
mate m), x along the line of action towards the contact, centre of that gear at (0, −r_t). r are
base radii, ρ = √(R² − r²) roll lengths, ρ_t and ρ_m those at the end of the path. At the distance d
beyond the end the gear has turned by ψ = d/r_t (a ring, whose roll length falls there, by −d/r_t),
and its tip edge is at

    P = (ρ_t cos ψ + r_t sin ψ,  −r_t + r_t cos ψ − ρ_t sin ψ) .

Relative to the mate's centre P has the radius R and the angle A from the radius to the mate's base
tangent point. The flank that would touch at d on the line of action, with roll length ρ_m', has the
angle ρ_m'/r_m − inv R at that radius, inv R = ρ(R)/r_m − arctan(ρ(R)/r_m). Rotated by gap/r_m it
meets the tip:

    gap = ± [r_m A − ρ_m' + r_m inv R]     (− where the mate is a ring), exactly.

With the centre distance a and the working angle α,

    gap = c d² + O(d³),   c = ρ_t a sin α / (2 r_t² ρ_m) :

the tip is d ρ_t/r_t below the line of action and lags by d² ρ_t/(2 r_t²) along it; the mate's flank
has its centre of curvature at ρ_m, and deviates by (d ρ_t/r_t)²/(2 ρ_m), away from the tip if it is
convex, towards the tip if it is a ring's. ρ_m + ρ_t = a sin α for external gears,
|ρ_m − ρ_t| = a sin α with a ring.

The force is normal to the mate's flank, along the tangent from P to the mate's base circle, at the
angle ε = A − arctan(ρ(R)/r_m) from the line of action, |ε| ≈ d ρ_t/(r_t ρ_m). Its lever about the
mate is r_m, and about the other gear (1 − gap'(d)) r_t, by the principle of virtual work.
``coupling.kernels.pairs`` uses the line of action, as coefficients of large rotations must be
constant; the relative error of that moment is gap' ≈ 2 c d = 2 gap/d, one or two percent where the
gap is as large as the deflection of a tooth. Gaps measured by rotation of one gear or of the other
differ as little.

Where the pitch point is on the path, tips move away from the mate's root beyond the ends of the
path. Otherwise a tip may meet a fillet, whose excess over the involute is subtracted from the gap.
A flank that ends before its tip (at its mate's base circle, or because a case gives the contact
ratio) has no tip edge there, and the gap is infinite.

Known as corner contact: Munro, Morrish and Palmer 1999, Proc. Inst. Mech. Eng. C 213, 389-400. The
formulas follow from the involute alone.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.optimize import brentq

from flexgear.arrays import Array
from flexgear.gears.tooth import ToothGeometry, involutes

LONGEST = 0.5  # base pitches beyond an end of the path that are searched for contact
POINTS = 201
SAME_LENGTH = 1e-9  # relative difference of roll lengths: the path ends at the tip


@dataclass(frozen=True)
class TipEdge:
    """Tip edge of one gear beyond one end of the path; symbols in the module docstring. tooth: with
    the tip; mate: with the flank that the tip meets; tip_roll, mate_roll: ρ_t and ρ_m at the end of
    the path, m; offset: a sin α, m. Distances d beyond the end, m, have any shape."""

    tooth: ToothGeometry
    mate: ToothGeometry
    tip_roll: float
    mate_roll: float
    offset: float

    def gap(self, distance: Array) -> Array:
        """Gap between tip edge and the mate's flank, m on the mate's base circle; ∞ where the tip
        is beyond the mate's tip, negative at interference of tips."""
        mate = self.mate
        radius, angle = self._polar(distance)
        gap = _involute_gap(
            mate, radius, angle, self.mate_roll - mate.outward * np.asarray(distance)
        )
        gap -= mate.root.protrusion(radius)
        return np.where(mate.outward * (radius - mate.tip_radius) > 0, np.inf, gap)

    def roll_on_mate(self, distance: Array) -> Array:
        """Roll length of the point of the mate's flank that the tip meets, m."""
        radius, _ = self._polar(distance)
        return np.sqrt(np.maximum(radius**2 - self.mate.base_radius**2, 0.0))

    @property
    def interior_angle(self) -> float:
        """Angle between flank and tip land inside the tooth, rad."""
        return math.pi / 2 + float(self.tooth.pressure_angle(np.array(self.tooth.tip_radius)))

    def rolls(self, distance: Array) -> tuple[Array, Array]:
        """Roll lengths of the contact on both flanks, that with the tip first, m; also before the
        end of the path (distance < 0)."""
        d = np.asarray(distance, dtype=float)
        tip_roll = self.tip_roll + self.tooth.outward * np.minimum(d, 0.0)
        return tip_roll, np.where(
            d > 0, self.roll_on_mate(d), self.mate_roll - self.mate.outward * d
        )

    def apex(self, distance: Array) -> Array:
        """Position e along the flank at which the involutes touch, from the tip edge towards the
        root, m. Before the end (distance < 0) the arc length to the tip. Beyond it −d ρ_t/r_t,
        where the flank continued past its tip would touch; the gap is e² over twice the relative
        radius of curvature."""
        d = np.asarray(distance, dtype=float)
        mean_roll = self.tip_roll + 0.5 * self.tooth.outward * np.minimum(d, 0.0)
        return np.asarray(-d * mean_roll / self.tooth.base_radius)

    def reach(self, approach: float) -> float:
        """Distance beyond the end, m, at which the gap first exceeds ``approach``, m; at most
        ``LONGEST`` base pitches."""
        places = np.linspace(0.0, LONGEST * self.tooth.base_pitch, POINTS)
        beyond = np.flatnonzero(self.gap(places[1:]) > approach)
        if approach <= 0.0 or not len(beyond):
            return 0.0 if approach <= 0.0 else float(places[-1])

        def excess(distance: float) -> float:
            return min(float(self.gap(np.array(distance))) - approach, approach)

        low, high = places[beyond[0]], places[beyond[0] + 1]
        return float(brentq(excess, low, high, xtol=1e-12 * high))

    def _polar(self, distance: Array) -> tuple[Array, Array]:
        """Polar coordinates R and A of the tip edge about the mate's centre."""
        return _polar_about_mate(self.tooth, self.mate, self.offset, self.tip_roll, distance)


def _polar_about_mate(
    tooth: ToothGeometry, mate: ToothGeometry, offset: float, roll: Array | float, distance: Array
) -> tuple[Array, Array]:
    """Polar coordinates R, m, and A, rad, about the mate's centre of a point of a flank. roll: roll
    length of the point; distance: d by which the gear has rolled beyond contact there on the path;
    m."""
    arm, base = tooth.base_radius, mate.base_radius
    psi = tooth.outward * np.asarray(distance, dtype=float) / arm
    x = roll * np.cos(psi) + arm * np.sin(psi)
    y = arm * (np.cos(psi) - 1.0) - roll * np.sin(psi)
    if mate.internal:
        along, across = x + offset, y + base
    elif tooth.internal:
        along, across = x - offset, y + base
    else:
        along, across = offset - x, base - y
    return np.hypot(along, across), np.arctan2(along, across)


def _involute_gap(mate: ToothGeometry, radius: Array, angle: Array, roll: Array) -> Array:
    """Gap, m, from a point at R and A to the mate's involute, as above; roll: ρ_m', m."""
    alpha, base = mate.pressure_angle(radius), mate.base_radius
    return np.asarray(mate.outward * (base * angle - roll + base * involutes(alpha)))


EdgeFunction = Callable[[TipEdge | None, Array], Array]  # of the distance beyond the end, m


@dataclass(frozen=True)
class OffPath:
    """Contact beyond both ends s_lo and s_hi, m, of the path of a planet with a ring or sun.

    Before the path the gear's tip meets the planet's flank, after it the planet's tip the gear's
    flank. offset: a sin α, m; cos_base_helix: component of the 3D normal N in the transverse plane.
    Path coordinates s have any shape.
    """

    planet: ToothGeometry
    gear: ToothGeometry
    offset: float
    s_lo: float
    s_hi: float
    cos_base_helix: float

    @cached_property
    def before(self) -> TipEdge | None:
        """The gear's tip edge before s_lo; None if the path does not begin at the gear's tip."""
        return self._edge(self.gear, self.planet, self.s_lo)

    @cached_property
    def after(self) -> TipEdge | None:
        """The planet's tip edge after s_hi; None if the path does not end at the planet's tip."""
        return self._edge(self.planet, self.gear, self.s_hi)

    def gap(self, s: Array | float) -> Array:
        """Gap along N, m: zero on the path, ∞ beyond an end without tip edge."""

        def along_normal(edge: TipEdge | None, distance: Array) -> Array:
            if edge is None:
                return np.full_like(distance, np.inf)
            return self.cos_base_helix * edge.gap(distance)

        return self._with_ends(s, np.zeros_like, along_normal, along_normal)

    def rolls(self, s: Array | float) -> tuple[Array, Array]:
        """Roll lengths, m, of the nearest points of the planet's and the gear's flank, at which
        modifications are evaluated; beyond the path that of the tip."""

        def tip(edge: TipEdge | None, distance: Array) -> Array:
            return np.full_like(distance, np.nan if edge is None else edge.tip_roll)

        def flank(edge: TipEdge | None, distance: Array) -> Array:
            return tip(None, distance) if edge is None else edge.roll_on_mate(distance)

        return (
            self._with_ends(s, lambda s: s, flank, tip),
            self._with_ends(s, self.gear_roll, tip, flank),
        )

    def separation(self, s: Array, planet: Array, gear: Array) -> Array:
        """Distance along N, m, from a point of one involute flank to the other. s: path
        coordinates; planet, gear: roll lengths of the point on either flank, of which that of the
        flank with the nearer tip counts. All of one shape."""
        out = np.empty_like(s)
        near_planet_tip = s > 0.5 * (self.s_lo + self.s_hi)
        for mask, tooth, mate, roll, sense in (
            (near_planet_tip, self.planet, self.gear, planet, 1.0),
            (~near_planet_tip, self.gear, self.planet, gear, -1.0),
        ):
            at, point = s[mask], roll[mask]
            on_path = point - self.offset if self.gear.internal else self.offset - point
            touch = point if sense > 0 else on_path
            polar = _polar_about_mate(tooth, mate, self.offset, point, sense * (at - touch))
            out[mask] = _involute_gap(mate, *polar, at if sense < 0 else self.gear_roll(at))
        return self.cos_base_helix * out

    def span(self, approach: float) -> tuple[float, float]:
        """First and last path coordinate, m, at which teeth touch if the gears approach by
        ``approach``, m, along N."""
        allowed = approach / self.cos_base_helix
        before, after = (0.0 if e is None else e.reach(allowed) for e in (self.before, self.after))
        return self.s_lo - before, self.s_hi + after

    def gear_roll(self, s: Array | float) -> Array:
        """Roll length on the gear's flank at path coordinates s, m."""
        return np.asarray(self.offset + s if self.gear.internal else self.offset - s)

    def _edge(self, tooth: ToothGeometry, mate: ToothGeometry, s: float) -> TipEdge | None:
        """Tip edge of ``tooth`` at the end s of the path; None if its flank ends before the tip."""
        gear_roll = float(self.gear_roll(s))
        roll, mate_roll = (gear_roll, s) if tooth is self.gear else (s, gear_roll)
        tip_roll = tooth.roll_length(tooth.tip_radius)
        if mate_roll <= 0.0 or abs(roll - tip_roll) > SAME_LENGTH * tip_roll:
            return None
        return TipEdge(tooth, mate, roll, mate_roll, self.offset)

    def _with_ends(
        self,
        s: Array | float,
        on_path: Callable[[Array], Array],
        before: EdgeFunction,
        after: EdgeFunction,
    ) -> Array:
        """Values ``on_path`` of s on the path, ``before`` and ``after`` beyond its ends."""
        s = np.asarray(s, dtype=float)
        out = np.array(on_path(s))
        for beyond, value, edge in ((self.s_lo - s, before, self.before),
                                    (s - self.s_hi, after, self.after)):  # fmt: skip
            out[beyond > 0] = value(edge, beyond[beyond > 0])
        return out
