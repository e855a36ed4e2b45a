"""Contact of modified flanks across the profile: point of contact, gap, additional compliance.

y is the coordinate along the profile towards the planet's tip, from the point where the involutes
touch at the path coordinate s. The distance of the flanks is that of the involutes,
S(y) ≈ y²/(2ρ) with the radius of relative curvature ρ, plus the modification g(y) of both flanks.
In the normal section, along N,

    h = min_y G(y),   G = S + g,   y between the tips of both gears,

is the gap of rigid flanks: g − ½ ρ g_y² where g has the slope g_y, y²/(2ρ) at the kink where relief
begins, and at a tip edge the gap of ``off_path`` plus the modification there. S is exact.

Under a line load w flanks touch over a width in which g changes. Of all half ellipses of pressure
with centre c and half width a, the elastic energy is least for the solution of

    min_{c, a}  −W ln a + ⟨G⟩,     W = w (1 − ν₁²)/(πE₁) + w (1 − ν₂²)/(πE₂)

where ⟨G⟩ is the mean of G under it. With A_n = (2/π) ∫ g(c + a cos θ) cos nθ dθ over 0 … π that is

    c = −ρ A₁/a,   a² = 4ρ (W − A₂),   δ − δ_Hertz = 2W ln(a_H/a) + ⟨G⟩ − W/2,   a_H² = 4ρW .

This is exact where G is a parabola, with 1/ρ + g_yy in place of 1/ρ, and within 3 % of a half plane
in contact over a kink. δ − δ_Hertz − h, the additional compliance, is added to the law of line
contact as w (α − β ln w), fitted at the mean line load and at ``LOWER_LOAD`` of it, or as a secant.

A flank is continued beyond its tip by point reflection; the additional compliance of an edge is in
``structures.tooth_influence.tip_edge``.

Sources: Hertz; the first variation of complementary energy, dδ = ∫ (∂p/∂w) dG dy (Johnson 1985,
Contact Mechanics, ch. 5).
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np
import scipy  # loads a subpackage at its first use
from numpy.typing import NDArray

from flexgear.arrays import Array
from flexgear.gears.hertz import relative_radius
from flexgear.gears.modifications import Gap
from flexgear.gears.off_path import OffPath

POINTS = 801  # along the path
FACE_POINTS = 9  # along the face, unless modifications are a sum over profile and lead
NODES = 32  # of the half ellipse
LOWER_LOAD = 1 / 8  # of the mean line load: the second load at which contacts are solved
SAME_GAP = 1e-6  # of the largest modification: difference of gaps that count as equal
COARSE, FINE, REFINEMENTS = 65, 17, 4  # points of the search for the least gap
MAX_STEPS, STEP_TOLERANCE = 40, 1e-5
THETA = math.pi * (np.arange(NODES) + 0.5) / NODES


@dataclass(frozen=True)
class FlankPair:
    """Pair of flanks in contact. planet, gear: missing material at (ρ, z) in transverse section, m;
    off_path: geometry of the involutes on and off the path."""

    planet: Gap
    gear: Gap
    off_path: OffPath

    def missing(self, rolls: tuple[Array, Array], z: Array | float) -> Array:
        """Modification g along N, m, of both flanks at their roll lengths and at z; continued
        beyond a tip by point reflection."""
        off = self.off_path
        tips = off.s_hi, float(off.rolls(off.s_lo)[1])
        flanks = (self.planet, 1.0, tips[0]), (self.gear, off.gear.outward, tips[1])
        total: Array = np.zeros(())
        for (gap, outward, tip), roll in zip(flanks, rolls, strict=True):
            beyond = outward * (roll - tip) > 0.0
            value = gap(np.where(beyond, 2.0 * tip - roll, roll), np.asarray(z))
            total = total + np.where(
                beyond, 2.0 * gap(np.asarray(tip), np.asarray(z)) - value, value
            )
        return off.cos_base_helix * total


@dataclass(frozen=True)
class ProfileContact:
    """Contact of modified flanks over path coordinates s (P,) and z along the face (Q,), m.

    lead: part of the gap that depends on z only, m. Tables (P, Q): gap: h less ``lead``, m; place:
    y of the least gap, m, beyond a tip whose edge touches; alpha, beta: additional compliance,
    w (α − β ln w), m²/N; secant: the same over w at the mean line load, m²/N; narrowing: a/a_H
    there; centre: c there, m, from the contact of the involutes or, off the path, from the tip
    edge. base_radius: of the planet, m; varies: whether modifications vary along the profile.
    """

    s: Array
    z: Array
    gap: Array
    place: Array
    alpha: Array
    beta: Array
    secant: Array
    narrowing: Array
    centre: Array
    lead: Callable[[Array], Array]
    base_radius: float
    varies: bool

    def path_shift(self, s: Array, z: Array) -> Array:
        """Shift of the path coordinate from s to the centre of the contact, m: a length along an
        involute is r_b/ρ times as long on the path."""
        return self.at(self.centre, s, z) * self.base_radius / np.maximum(s, self.base_radius / 20)

    def gap_at(self, s: Array, z: Array) -> Array:
        """Gap h of rigid flanks at path coordinates s and z, m."""
        return self.at(self.gap, s, z) + self.lead(z)

    def at(self, values: Array, s: Array, z: Array) -> Array:
        """Table ``values`` interpolated linearly at s and z of one shape, constant beyond it."""
        places = [
            (at - nodes[0]) / (nodes[1] - nodes[0]) if len(nodes) > 1 else np.zeros_like(at)
            for nodes, at in ((self.s, s), (self.z, z))
        ]
        return np.asarray(scipy.ndimage.map_coordinates(values, places, order=1, mode="nearest"))


def profile_contact(
    pair: FlankPair, span: tuple[float, float], half_face: float, compliance: float, load: float
) -> ProfileContact:
    """Contact across the profile over path coordinates from ``span[0]`` to ``span[1]``, m.
    compliance: W/w, m²/N; load: mean line load w, N/m of contact line, 0 for rigid flanks."""
    off, s = pair.off_path, np.linspace(*span, POINTS)
    middle = 0.5 * (off.s_lo + off.s_hi), 0.0

    def lead(z: Array) -> Array:
        rolls = off.rolls(middle[0])
        return np.asarray(pair.missing(rolls, z) - pair.missing(rolls, 0.0))

    z = half_face * np.linspace(-1.0, 1.0, FACE_POINTS)
    planet, gear = off.rolls(s)
    missing = pair.missing((planet[:, None], gear[:, None]), z)
    remainder = missing - lead(z) - missing[:, FACE_POINTS // 2, None]
    if np.abs(remainder).max() <= SAME_GAP * np.abs(missing).max():
        z = np.zeros(1)
    shape = POINTS, len(z)
    search = _Search.of(pair, np.repeat(s, shape[1]), np.tile(z, shape[0]))
    y, gap, slope = search.least()
    difference = search.rigid(y) - lead(search.z)
    place = y - search.radius * np.where(y >= search.high, np.minimum(slope, 0.0), 0.0)
    place -= search.radius * np.where(y <= search.low, np.maximum(slope, 0.0), 0.0)
    alpha = beta = secant = np.zeros_like(y)
    narrowing, centre = np.ones_like(y), y
    varies = bool(np.ptp(missing, axis=0).max() > SAME_GAP * np.abs(missing).max())
    if load > 0.0 and varies:
        secant, narrowing, centre = search.loaded(y, gap, compliance, load)
        lower = search.loaded(y, gap, compliance, LOWER_LOAD * load)[0]
        beta = (lower - secant) / math.log(1.0 / LOWER_LOAD)
        alpha = secant + beta * math.log(load)
    return ProfileContact(
        s=s,
        z=z,
        gap=difference.reshape(shape),
        place=place.reshape(shape),
        alpha=alpha.reshape(shape),
        beta=beta.reshape(shape),
        secant=secant.reshape(shape),
        narrowing=narrowing.reshape(shape),
        centre=(centre - search.base).reshape(shape),
        lead=lead,
        base_radius=off.planet.base_radius,
        varies=varies,
    )


class _Search(NamedTuple):
    """Search for the contact of profiles at n points (s, z), m. base: y of the contact of the
    involutes (0), or of the tip edge beyond the path; rolls: roll lengths of both flanks at y =
    base; radius: ρ in normal section; low, high: y of both tips; m."""

    pair: FlankPair
    s: Array
    z: Array
    rolls: tuple[Array, Array]
    base: Array
    radius: Array
    low: Array
    high: Array

    @classmethod
    def of(cls, pair: FlankPair, s: Array, z: Array) -> Self:
        off = pair.off_path
        rolls, planet, gear = off.rolls(s), off.planet, off.gear
        ends = [off.rolls(end) for end in (off.s_lo, off.s_hi)]
        high = (ends[1][0] ** 2 - s**2) / (2.0 * planet.base_radius)
        of_gear = off.gear_roll(s)
        low = gear.outward * (of_gear**2 - ends[0][1] ** 2) / (2.0 * gear.base_radius)
        base = np.where(s > off.s_hi, high, np.where(s < off.s_lo, low, 0.0))
        least = 1e-3 * planet.base_pitch
        radius = relative_radius(
            np.maximum(s, least), np.maximum(of_gear, least), internal=gear.internal
        )
        return cls(pair, s, z, rolls, base, radius / off.cos_base_helix, low, high)

    def _points(self, at: NDArray[np.intp]) -> Self:
        """The search at the points numbered ``at`` (k,) alone."""
        planet, gear = self.rolls
        arrays = (self.s, self.z, self.base, self.radius, self.low, self.high)
        s, z, base, radius, low, high = (values[at] for values in arrays)
        return type(self)(self.pair, s, z, (planet[at], gear[at]), base, radius, low, high)

    def rolls_at(self, y: Array) -> tuple[Array, Array]:
        """Roll lengths of both flanks at y (n, …), m."""
        off, broadcast = self.pair.off_path, (slice(None), *[None] * (y.ndim - 1))
        planet, gear = (rolls[broadcast] ** 2 for rolls in self.rolls)
        growth = 2.0 * (y - self.base[broadcast])
        planet = planet + off.planet.base_radius * growth
        gear = gear - off.gear.outward * off.gear.base_radius * growth
        return np.sqrt(np.maximum(planet, 0.0)), np.sqrt(np.maximum(gear, 0.0))

    def missing(self, y: Array) -> Array:
        """Modification g at y (n, …), m."""
        return self.pair.missing(self.rolls_at(y), self.z.reshape(-1, *[1] * (y.ndim - 1)))

    def distance(self, y: Array) -> Array:
        """Distance G of the flanks at y (n, …), m, with S = y²/(2ρ)."""
        radius = self.radius.reshape(-1, *[1] * (y.ndim - 1))
        return np.asarray(self.missing(y) + y**2 / (2.0 * radius))

    def least(self) -> tuple[Array, Array, Array]:
        """y of the least distance G, m, G there, m, and its slope dG/dy; (n,) each."""
        profile = self.missing(np.linspace(self.low, self.high, FACE_POINTS, axis=1))
        # beyond this range S alone exceeds the distance at the contact of the involutes
        room = np.sqrt(2.0 * self.radius * (np.ptp(profile, axis=1).max() + 1e-12))
        middle = np.clip(0.0, self.low, self.high)
        first, last = np.maximum(middle - room, self.low), np.minimum(middle + room, self.high)
        count, rows = COARSE, np.arange(len(self.s))
        for _ in range(1 + REFINEMENTS):
            y = np.linspace(first, last, count, axis=1)
            best = np.argmin(self.distance(y), axis=1)
            first, last = (y[rows, np.clip(best + k, 0, count - 1)] for k in (-1, 1))
            count = FINE
        place, step = y[rows, best], 1e-6 * self.radius
        sides = [np.clip(place + k * step, self.low, self.high) for k in (-1, 1)]
        values = [self.distance(side) for side in sides]
        return place, self.distance(place), (values[1] - values[0]) / (sides[1] - sides[0])

    def rigid(self, y: Array) -> Array:
        """Distance S + g (n,) of rigid flanks at y (n,), m, with the exact S."""
        off = self.pair.off_path
        start = off.gap(self.s)  # 0 on the path; off it with the protrusion of a root
        rise = off.separation(self.s, *self.rolls_at(y)) - off.separation(self.s, *self.rolls)
        return start + np.where(y == self.base, 0.0, rise) + self.missing(y)

    def loaded(
        self, y: Array, gap: Array, compliance: float, load: float
    ) -> tuple[Array, Array, Array]:
        """Additional compliance (δ − δ_Hertz − h)/w, m²/N, a/a_H and c, m, under a line load. y,
        gap: point of least distance and G there, m; compliance: W/w, m²/N; load: w, N/m."""
        w, radius = compliance * load, self.radius
        hertz = np.sqrt(4.0 * radius * w)
        c, log_a, at = y.copy(), np.zeros_like(y), np.arange(len(y))  # at: not yet converged
        for _ in range(MAX_STEPS):
            points = self._points(at)
            step = points._newton(c[at], log_a[at], w, hertz[at])
            c[at] = np.clip(c[at] + step[0], points.low, points.high)
            log_a[at] += step[1]
            change = np.maximum(np.abs(step[0] / hertz[at]), np.abs(step[1]))
            at = at[change >= STEP_TOLERANCE]
            if not len(at):
                break
        a = hertz * np.exp(log_a)
        mean, _, _ = self._moments(c, a)
        parabola = (c**2 + 0.25 * a**2) / (2.0 * radius)
        approach = -2.0 * w * log_a + mean + parabola - 0.5 * w - gap
        return approach / load, np.exp(log_a), c

    def _moments(self, c: Array, a: Array) -> tuple[Array, Array, Array]:
        """Mean ⟨g⟩ under the half ellipse, A₁ and A₂, m."""
        g = self.missing(c[:, None] + a[:, None] * np.cos(THETA))
        first, second = (2.0 * (g * np.cos(k * THETA)).mean(axis=1) for k in (1, 2))
        return g.mean(axis=1) - 0.5 * second, first, second

    def _slopes(self, c: Array, log_a: Array, w: float, hertz: Array) -> tuple[Array, Array]:
        """Derivatives of −W ln a + ⟨G⟩ with respect to c and ln a; w: W, m."""
        a = hertz * np.exp(log_a)
        _, first, second = self._moments(c, a)
        return first / a + c / self.radius, second - w + a**2 / (4.0 * self.radius)

    def _newton(self, c: Array, log_a: Array, w: float, hertz: Array) -> tuple[Array, Array]:
        """Newton step of c, m, and ln a towards the least energy, limited to a and 0.5. Second
        derivatives are differences over a/20, and bounded so that the matrix is positive definite;
        c does not change where the step would pass a tip."""
        a = hertz * np.exp(log_a)
        by_c, by_a = self._slopes(c, log_a, w, hertz)
        shifted = self._slopes(c + 0.05 * a, log_a, w, hertz)
        widened = self._slopes(c, log_a + 0.05, w, hertz)
        cc = np.maximum((shifted[0] - by_c) / (0.05 * a), 0.2 / self.radius)
        aa = np.maximum((widened[1] - by_a) / 0.05, 0.2 * w)
        ca = 0.5 * ((widened[0] - by_c) / 0.05 + (shifted[1] - by_a) / (0.05 * a))
        bound = np.sqrt(0.9 * cc * aa)
        ca = np.clip(ca, -bound, bound)
        at_tip = ((c >= self.high) & (by_c < 0.0)) | ((c <= self.low) & (by_c > 0.0))
        determinant = cc * aa - ca**2
        step_c = np.where(at_tip, 0.0, (ca * by_a - aa * by_c) / determinant)
        step_a = np.where(at_tip, -by_a / aa, (ca * by_c - cc * by_a) / determinant)
        return np.clip(step_c, -a, a), np.clip(step_a, -0.5, 0.5)
