"""Contact of modified flanks across the profile: where a pair touches, what gap it has there, and
how much more its line contact yields than Hertz's.

y along the profile, towards the planet's tip, from where the involutes touch at the path coordinate
s; they part by S(y) ≈ y²/(2ρ), ρ being the radius of relative curvature, and what has been ground
off both adds g(y). In the normal section, along N,

    h = min_y G(y),   G = S + g,   y between the tips of both gears,

is the gap of rigid flanks: g − ½ ρ g_y² where g has the slope g_y, y²/(2ρ) at the kink where relief
begins, and at a tip edge the gap of ``off_path`` with what is missing there. S is exact.

Under a line load w flanks touch over a width in which g changes. Of all half ellipses of pressure,
with the middle c and the half width a, the elastic energy of the contact is least for the one with

    min_{c, a}  −W ln a + ⟨G⟩,     W = w (1 − ν₁²)/(πE₁) + w (1 − ν₂²)/(πE₂)

where ⟨G⟩ is the mean of G under it. With A_n = (2/π) ∫ g(c + a cos θ) cos nθ dθ over 0 … π that is

    c = −ρ A₁/a,   a² = 4ρ (W − A₂),   δ − δ_Hertz = 2W ln(a_H/a) + ⟨G⟩ − W/2,   a_H² = 4ρW .

It is exact where G is a parabola, with 1/ρ + g_yy in the place of 1/ρ, and within 3 % of what a
half plane yields over a kink. δ − δ_Hertz − h is put into the law of line contact, w (α − β ln w),
by what it is at the mean line load and at ``LESS`` of it, or into a secant.

A flank is continued beyond its tip as it comes there, turned by half a turn about it; what an edge
yields more is ``structures.tooth_influence.tip_edge``'s.

Sources: Hertz; the first variation of complementary energy, dδ = ∫ (∂p/∂w) dG dy (Johnson 1985,
Contact Mechanics, ch. 5).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexgear.arrays import Array
from flexgear.gears.hertz import relative_radius
from flexgear.gears.modifications import Gap
from flexgear.gears.off_path import OffPath

PLACES = 801  # along the path
ACROSS = 9  # along the face, where what is missing is no sum of a profile and a lead
NODES = 32  # of the half ellipse
LESS = 1 / 8  # of the mean line load: the second load at which contacts are solved
SAME = 1e-6  # of the largest gap: a sum of profile and lead
COARSE, ZOOMED, ZOOMS = 65, 17, 4  # places of the search for the least gap
MOST_STEPS, SETTLED = 40, 1e-5
THETA = math.pi * (np.arange(NODES) + 0.5) / NODES


@dataclass(frozen=True)
class FlankPair:
    """Flanks that meet: material missing on planet and gear at (ρ, z) in the transverse section, m,
    and their rolling geometry."""

    planet: Gap
    gear: Gap
    off_path: OffPath

    def missing(self, rolls: tuple[Array, Array], z: Array | float) -> Array:
        """g along N, m, at roll lengths of both flanks; beyond a tip as it comes there."""
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
    """What is found over path coordinates s (P,) and z along the face (Q,), (P, Q) each.

    gap: h m, less ``lead``, which is gap by z alone, m; place: y of the least gap, m, where flanks
    go on beyond their tips: further than a tip where its edge touches; alpha, beta: what line
    contact yields more, w (α − β ln w), m²/N; secant: the same over w at the mean line load, m²/N;
    narrowing: a/a_H there; centre: c there, m, from where involutes touch or, off the path, from
    the tip edge. base_radius: the planet's, m; turns: whether anything changes along the profile.
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
    turns: bool

    def path_shift(self, s: Array, z: Array) -> Array:
        """By how much the path coordinate of where the load rests is larger than s, m: an involute
        is by r_b/ρ shorter on its path."""
        return self.at(self.centre, s, z) * self.base_radius / np.maximum(s, self.base_radius / 20)

    def gap_at(self, s: Array, z: Array) -> Array:
        """Gap h, m, left between the flanks at path position s and face position z, m."""
        return self.at(self.gap, s, z) + self.lead(z)

    def at(self, values: Array, s: Array, z: Array) -> Array:
        """One of the tables at s and z of one shape, linear in between."""
        low, share = _between(self.s, s)
        if len(self.z) == 1:
            return (1.0 - share) * values[low, 0] + share * values[low + 1, 0]
        first, across = _between(self.z, z)
        lower, upper = (
            (1.0 - across) * values[k, first] + across * values[k, first + 1]
            for k in (low, low + 1)
        )
        return (1.0 - share) * lower + share * upper


def profile_contact(
    pair: FlankPair, span: tuple[float, float], half_face: float, pressed: float, load: float
) -> ProfileContact:
    """Contact across the profile over the path coordinates ``span``, m, and the face. pressed: W/w,
    m²/N; load: the mean line load w, N/m of contact line; rigid flanks without one."""
    off, s = pair.off_path, np.linspace(*span, PLACES)
    middle = 0.5 * (off.s_lo + off.s_hi), 0.0

    def lead(z: Array) -> Array:
        rolls = off.rolls(middle[0])
        return np.asarray(pair.missing(rolls, z) - pair.missing(rolls, 0.0))

    across = half_face * np.linspace(-1.0, 1.0, ACROSS)
    planet, gear = off.rolls(s)
    whole = pair.missing((planet[:, None], gear[:, None]), across)
    separation = whole - lead(across) - whole[:, ACROSS // 2, None]
    if np.abs(separation).max() <= SAME * np.abs(whole).max():
        across = np.zeros(1)
    shape = PLACES, len(across)
    at = (np.repeat(s, shape[1]), np.tile(across, shape[0]))
    search = _Search.of(pair, *at)
    y, gap, slope = search.least()
    difference = search.rigid(y) - lead(at[1])
    place = y - search.radius * np.where(y >= search.high, np.minimum(slope, 0.0), 0.0)
    place -= search.radius * np.where(y <= search.low, np.maximum(slope, 0.0), 0.0)
    alpha = beta = secant = np.zeros_like(y)
    narrowing, centre = np.ones_like(y), y
    turns = bool(np.ptp(whole, axis=0).max() > SAME * np.abs(whole).max())
    if load > 0.0 and turns:
        secant, narrowing, centre = search.yields(y, gap, pressed, load)
        less = search.yields(y, gap, pressed, LESS * load)[0]
        beta = (less - secant) / math.log(1.0 / LESS)
        alpha = secant + beta * math.log(load)
    return ProfileContact(
        s=s,
        z=across,
        gap=difference.reshape(shape),
        place=place.reshape(shape),
        alpha=alpha.reshape(shape),
        beta=beta.reshape(shape),
        secant=secant.reshape(shape),
        narrowing=narrowing.reshape(shape),
        centre=(centre - search.base).reshape(shape),
        lead=lead,
        base_radius=off.planet.base_radius,
        turns=turns,
    )


class _Search(NamedTuple):
    """Profiles at places (n,). s, z: of the places, m; rolls: of both flanks at y = base, where the
    involutes touch, or at the tip edge beyond the path; radius: ρ in the normal section; low, high:
    y of both tips, m."""

    pair: FlankPair
    s: Array
    z: Array
    rolls: tuple[Array, Array]
    base: Array
    radius: Array
    low: Array
    high: Array

    @classmethod
    def of(cls, pair: FlankPair, s: Array, z: Array) -> _Search:
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

    def missing(self, y: Array) -> Array:
        """g (n, …) m at y (n, …), m."""
        off, more = self.pair.off_path, (slice(None), *[None] * (y.ndim - 1))
        planet, gear = self.rolls
        growth = 2.0 * (y - self.base[more])
        rolls = (
            np.sqrt(np.maximum(planet[more] ** 2 + off.planet.base_radius * growth, 0.0)),
            np.sqrt(
                np.maximum(gear[more] ** 2 - off.gear.outward * off.gear.base_radius * growth, 0.0)
            ),
        )
        return self.pair.missing(rolls, self.z[more])

    def parted(self, y: Array) -> Array:
        """G (n, …) m, with S = y²/(2ρ)."""
        radius = self.radius.reshape(-1, *[1] * (y.ndim - 1))
        return np.asarray(self.missing(y) + y**2 / (2.0 * radius))

    def least(self) -> tuple[Array, Array, Array]:
        """y of the least G, G there, m, and its slope."""
        profile = self.missing(np.linspace(self.low, self.high, ACROSS, axis=1))
        # nothing further off is nearer than where the involutes touch
        room = np.sqrt(2.0 * self.radius * (np.ptp(profile, axis=1).max() + 1e-12))
        middle = np.clip(0.0, self.low, self.high)
        first, last = np.maximum(middle - room, self.low), np.minimum(middle + room, self.high)
        count, rows = COARSE, np.arange(len(self.s))
        for _ in range(1 + ZOOMS):
            y = np.linspace(first, last, count, axis=1)
            best = np.argmin(self.parted(y), axis=1)
            first, last = (y[rows, np.clip(best + k, 0, count - 1)] for k in (-1, 1))
            count = ZOOMED
        place, step = y[rows, best], 1e-6 * self.radius
        sides = [np.clip(place + k * step, self.low, self.high) for k in (-1, 1)]
        values = [self.parted(side) for side in sides]
        return place, self.parted(place), (values[1] - values[0]) / (sides[1] - sides[0])

    def rigid(self, y: Array) -> Array:
        """S + g (n,) m at y (n,) with the exact S."""
        off, rolls = self.pair.off_path, self.rolls
        growth = 2.0 * (y - self.base)
        planet = np.sqrt(rolls[0] ** 2 + off.planet.base_radius * growth)
        gear = np.sqrt(rolls[1] ** 2 - off.gear.outward * off.gear.base_radius * growth)
        touch = off.gap(self.s)  # on the path 0, and what a fillet is thicker counts off it
        further = off.parted(self.s, planet, gear) - off.parted(self.s, *rolls)
        return touch + np.where(y == self.base, 0.0, further) + self.missing(y)

    def yields(
        self, y: Array, gap: Array, pressed: float, load: float
    ) -> tuple[Array, Array, Array]:
        """(δ − δ_Hertz − h)/w (n,) m²/N, a/a_H and c, m, under a line load, from y of the least
        gap."""
        w, radius = pressed * load, self.radius
        hertz = np.sqrt(4.0 * radius * w)
        c, log_a = y.copy(), np.zeros_like(y)
        for _ in range(MOST_STEPS):
            step = self._newton(c, log_a, w, hertz)
            c = np.clip(c + step[0], self.low, self.high)
            log_a = log_a + step[1]
            if max(np.abs(step[0] / hertz).max(), np.abs(step[1]).max()) < SETTLED:
                break
        a = hertz * np.exp(log_a)
        mean, _, _ = self._moments(c, a)
        parabola = (c**2 + 0.25 * a**2) / (2.0 * radius)
        more = -2.0 * w * log_a + mean + parabola - 0.5 * w - gap
        return more / load, np.exp(log_a), c

    def _moments(self, c: Array, a: Array) -> tuple[Array, Array, Array]:
        """⟨g⟩, A₁ and A₂, m."""
        g = self.missing(c[:, None] + a[:, None] * np.cos(THETA))
        first, second = (2.0 * (g * np.cos(k * THETA)).mean(axis=1) for k in (1, 2))
        return g.mean(axis=1) - 0.5 * second, first, second

    def _slopes(self, c: Array, log_a: Array, w: float, hertz: Array) -> tuple[Array, Array]:
        """Derivatives of the energy over w, by c and by ln a."""
        a = hertz * np.exp(log_a)
        _, first, second = self._moments(c, a)
        return first / a + c / self.radius, second - w + a**2 / (4.0 * self.radius)

    def _newton(self, c: Array, log_a: Array, w: float, hertz: Array) -> tuple[Array, Array]:
        """Newton step of c and log a towards the least energy, limited to a; second derivatives are
        central differences over a/20; c stays where the step would pass a tip."""
        a = hertz * np.exp(log_a)
        by_c, by_a = self._slopes(c, log_a, w, hertz)
        further = self._slopes(c + 0.05 * a, log_a, w, hertz)
        wider = self._slopes(c, log_a + 0.05, w, hertz)
        cc = np.maximum((further[0] - by_c) / (0.05 * a), 0.2 / self.radius)
        aa = np.maximum((wider[1] - by_a) / 0.05, 0.2 * w)
        ca = 0.5 * ((wider[0] - by_c) / 0.05 + (further[1] - by_a) / (0.05 * a))
        most = np.sqrt(0.9 * cc * aa)
        ca = np.clip(ca, -most, most)
        held = ((c >= self.high) & (by_c < 0.0)) | ((c <= self.low) & (by_c > 0.0))
        whole = cc * aa - ca**2
        step = np.where(held, 0.0, (ca * by_a - aa * by_c) / whole)
        alone = -by_a / aa
        other = np.where(held, alone, (ca * by_c - cc * by_a) / whole)
        return np.clip(step, -a, a), np.clip(other, -0.5, 0.5)


def _between(nodes: Array, places: Array) -> tuple[NDArray[np.int64], Array]:
    """Number of the even node before each place, and the share of the way to the next."""
    at = np.clip((places - nodes[0]) / (nodes[1] - nodes[0]), 0.0, len(nodes) - 1.0)
    low = np.minimum(at.astype(np.int64), len(nodes) - 2)
    return low, at - low
