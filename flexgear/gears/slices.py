"""Slices of a contact line: where they are, what stiffness and what gap each has.

The line of a pair at the path coordinate s (at z = 0) goes from z₁(s) to z₂(s), the part of the
face where s + t z lies on the path, or where tips touch before and after it (``off_path``). It is
cut into K slices of equal width that move with its ends, so that none enters or leaves within the
face and the transmission error has no ripple of K times a line. Slice j at its middle z_j holds
k_j = k'(ξ_j) (z₂ − z₁)/K, scaled so that together they hold what the line holds, which
``stiffness`` integrates exactly, and moved so that their centre of stiffness is that of the line:
what is left of the midpoint rule is of second order in 1/K. Off the path k' is that of its end.

Factors of the load along the face, from line loads of slices.

    K_Hβ = max_z W(z) / mean_z W(z),    W(z): line load at z over a cycle of the gear mesh

(ISO 6336-1: largest and mean load per width). Slices know the load at their middles; where it is
uneven that converges at first order in their number, so it is continued to the ends of the line.

Springs beside each other have a load at every place. The load of teeth that bend as FE influences
say has not: Hertz's line contact and nodes a module apart tell no change over less than a module,
yet thinner and thinner slices show one, at the ends of the face and at the corner where lines come
in. There the load holds over the last half ``section``, a length of about a module, and W in K_Hβ
is the mean over a section, as in Annex E of ISO 6336-1 (from AGMA 927-A01), which takes the load of
pieces of the face and not of places.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from flexgear.arrays import Array
from flexgear.gears.profile_contact import ProfileContact
from flexgear.gears.stiffness import Law, pair_stiffness

Gap = Callable[[Array, Array], Array]
GRID = 2001
STIFFEST = 0.5  # least compliance of ground flanks over that of involutes


@dataclass(frozen=True)
class Bending:
    """Flexibility between the slices of a contact line, over the path coordinate (S,). lower: (S, K
    (K + 1)/2) m/N, lower triangles, row by row, for both flanks together and without line contact;
    scale, limit: (S, K) a m/N and d N of the approach a f ln(d/f) of a slice under its force f.
    beside: (S, 2, 4) m/N, displacement of both rows of the line per force on those of the next two,
    one base pitch apart each (``rows_yield``)."""

    scale: Array
    limit: Array
    lower: Array
    beside: Array


@dataclass(frozen=True)
class Slices:
    """Slices of the pairs of a gear mesh over its path coordinate s (S,), m; K slices. z,
    stiffness, gap, width: (S, K) m, N/m, m, m; gap along the 3D normal, positive where material is
    missing. centre, radius: (S,) m, centre and radius of gyration of the stiffness along z.
    on_path: (S,) N/m, stiffness of the part of the line on the path of contact. span: path
    coordinates between which a point of a line may touch, m. bending: None for independent slices;
    else stiffness is the nominal share of each slice in that of the line. profile: contact of
    modified flanks across the profile, None for involutes. narrowing: (S, K) half widths of
    contacts over those of Hertz's at the mean line load."""

    s: Array
    z: Array
    stiffness: Array
    gap: Array
    width: Array
    centre: Array
    radius: Array
    on_path: Array
    span: tuple[float, float]
    bending: Bending | None = None
    profile: ProfileContact | None = None
    narrowing: Array | None = None

    @property
    def count(self) -> int:
        """Number of slices K."""
        return int(self.z.shape[1])

    @property
    def mean_gap(self) -> Array:
        """Gap (S,) m of a pair that is one spring, F = ∫ k' (δ − h) dz = k (δ − h̄): the mean
        weighted by stiffness, exact while the whole line touches; 0 where a line has no
        stiffness."""
        total = self.stiffness.sum(axis=1)
        weighted = (self.stiffness * self.gap).sum(axis=1)
        return np.divide(weighted, total, out=np.zeros_like(total), where=total > 0)

    def ground(self, profile: ProfileContact, law: Law, line: Line) -> Slices:
        """The same lines on modified flanks with the gaps of ``profile``; law, line: as of ``cut``.
        Slices have the stiffness of the point where they touch, reduced by the secant compliance c
        of ``profile``: k' → k'/(1 + k' c cos β_b)."""
        place = np.clip(self.s[:, None] + line.slope * self.z, *self.span)  # lines end there
        gap = profile.gap_at(place, self.z)
        if not profile.turns:
            return replace(self, gap=gap)

        def there(s: Array) -> Array:
            return law(np.clip((s - line.path[0]) / (line.path[1] - line.path[0]), 0.0, 1.0))

        shift = profile.path_shift(place, self.z)
        stiffness = self.stiffness * there(place + shift) / there(place)
        wide = self.width > 0.0
        per_width = np.divide(stiffness, self.width, out=np.zeros_like(self.z), where=wide)
        more = per_width * profile.at(profile.secant, place, self.z)
        stiffness /= np.maximum(1.0 + more * math.cos(math.atan(line.slope)), STIFFEST)
        narrowing = profile.at(profile.narrowing, place, self.z)
        softened = self.with_stiffness(stiffness)
        return replace(softened, gap=gap, profile=profile, narrowing=narrowing)

    def with_stiffness(self, stiffness: Array) -> Slices:
        """The same lines with other stiffnesses (S, K) of slices, N/m."""
        before, k = self.stiffness.sum(axis=1), stiffness.sum(axis=1)
        held = k > 0.0
        centre = np.divide((stiffness * self.z).sum(axis=1), k, out=self.centre.copy(), where=held)
        spread = (stiffness * (self.z - centre[:, None]) ** 2).sum(axis=1)
        radius = np.sqrt(np.divide(spread, k, out=np.zeros_like(k), where=held))
        share = np.divide(k, before, out=np.zeros_like(k), where=before > 0.0)
        return replace(
            self,
            stiffness=stiffness,
            centre=centre,
            radius=np.where(self.radius > 0.0, radius, 0.0),
            on_path=self.on_path * share,
        )


@dataclass(frozen=True)
class Line:
    """Contact lines of a gear mesh: ends of the path of contact and of the range in which tips
    touch, too, m; slope ds/dz; half of the face width, m."""

    path: tuple[float, float]
    span: tuple[float, float]
    slope: float
    half_face: float


def cut(law: Law, line: Line, count: int, gap: Gap | None = None) -> Slices:
    """Slices of contact lines; law: k'(ξ) N/m² over the path; gap: of involutes at (path
    coordinate, z), any shape, m."""
    (low, high), reach = line.span, abs(line.slope) * line.half_face
    s = np.linspace(low - reach, high + reach, GRID)

    def beyond(share: Array) -> Array:
        place = low + share * (high - low)
        return law(np.clip((place - line.path[0]) / (line.path[1] - line.path[0]), 0.0, 1.0))

    k, centre = pair_stiffness(beyond, s, low, high, line.slope, line.half_face)
    on_path, _ = pair_stiffness(law, s, *line.path, line.slope, line.half_face)
    start, stop = line_ends(s, line)
    width = (stop - start) / count
    z = start[:, None] + width[:, None] * (np.arange(count) + 0.5)
    raw = beyond((s[:, None] + line.slope * z - low) / (high - low)) * width[:, None]
    total = raw.sum(axis=1)
    held = (k > 0) & (total > 0)
    stiffness = raw * np.divide(k, total, out=np.zeros_like(k), where=held)[:, None]
    middle = np.divide((stiffness * z).sum(axis=1), k, out=np.zeros_like(k), where=held)
    z = np.where(held[:, None], z + (centre - middle)[:, None], centre[:, None])
    spread = (stiffness * (z - centre[:, None]) ** 2).sum(axis=1)
    radius = np.sqrt(np.divide(spread, k, out=np.zeros_like(k), where=held))
    return Slices(
        s=s,
        z=z,
        stiffness=stiffness,
        gap=np.zeros_like(z) if gap is None else gap(s[:, None] + line.slope * z, z),
        width=np.repeat(width[:, None], count, axis=1),
        centre=centre,
        radius=np.where(radius > 1e-9 * line.half_face, radius, 0.0),  # of one slice it is rounding
        on_path=on_path,
        span=line.span,
    )


def line_ends(s: Array, line: Line) -> tuple[Array, Array]:
    """z₁ and z₂ (S,) of contact lines, m; equal where a line has left the range of contact."""
    (low, high), half = line.span, line.half_face
    if abs(line.slope) * half < 1e-9 * (high - low):  # spur: whole face at one place
        on = (s >= low) & (s <= high)
        return np.where(on, -half, 0.0), np.where(on, half, 0.0)
    ends = np.sort((np.array([[low], [high]]) - s) / line.slope, axis=0)
    start, stop = np.clip(ends, -half, half)
    return start, stop


@dataclass(frozen=True)
class Nominal:
    """Loads at which nominal stiffness is taken: line_load N/m along z, uniform along the line;
    base_pitch m between contact lines."""

    line_load: float
    base_pitch: float


def bent(
    slices: Slices, flexibility: Array, beside: Array, contact: tuple[Array, Array], at: Nominal
) -> Slices:
    """The same lines with flexibility between slices. flexibility: (S, K, K) m/N of both flanks
    without line contact; beside: (S, 2, K, K) m/N, displacement of slices per force on those of the
    next two lines; contact: scale a m/N and limit d N of the line contact of every slice, (S, K)
    each. With G = (C + diag h'(f))⁻¹: k = 1ᵀG1, z_c = 1ᵀGz/k, ρ² = zᵀGz/k − z_c²."""
    scale, limit = contact
    even = np.maximum(at.line_load * slices.width, 1e-9 * limit)
    slope = scale * (np.log(limit / np.minimum(even, limit / 8.0)) - 1.0)
    whole = flexibility + slope[:, :, None] * np.eye(slices.count)
    columns = np.stack([np.ones_like(slices.z), slices.z], axis=-1)
    solved = np.linalg.solve(whole, columns)
    share, moment = np.asarray(solved[:, :, 0]), np.asarray(solved[:, :, 1])
    held = (slices.stiffness.sum(axis=1) > 0)[:, None]
    stiffness = np.where(held, np.maximum(share, 0.0), 0.0)
    k = np.maximum(share.sum(axis=1), 1e-300)
    centre = (share * slices.z).sum(axis=1) / k
    spread = (moment * slices.z).sum(axis=1) / k - centre**2
    on = np.divide(
        slices.on_path, slices.stiffness.sum(axis=1), out=np.zeros_like(k), where=held[:, 0]
    )
    bent_slices = replace(
        slices,
        stiffness=stiffness,
        centre=np.where(held[:, 0], centre, slices.centre),
        radius=np.where(held[:, 0], np.sqrt(np.maximum(spread, 0.0)), 0.0),
        on_path=on * stiffness.sum(axis=1),
    )
    yields = rows_yield(bent_slices, (share, moment), beside, at.base_pitch)
    lower = flexibility[:, *np.tril_indices(slices.count)]
    return replace(bent_slices, bending=Bending(scale, limit, lower, yields))


def rows_yield(
    slices: Slices, solved: tuple[Array, Array], beside: Array, base_pitch: float
) -> Array:
    """B (S, 2, 4) m/N: displacement of both rows of a line, at z_c ∓ ρ, per force on those of the
    next two lines. Loaded teeth deflect their neighbours rigidly and smoothly along the face, so
    resultants are enough: forces of rows are distributed over slices as under rigid approach, P = G
    T (TᵀGT)⁻¹ with T = (1 − t, t), and B = Pᵀ C P' between two lines. solved: G 1 and G z (S, K);
    beside: C (S, 2, K, K) m/N."""
    extended = slices.radius > 0
    reach = np.where(extended, slices.radius, 1.0)
    even, lever = solved[0], solved[1] - slices.centre[:, None] * solved[0]
    k = np.maximum(even.sum(axis=1), 1e-300)[:, None]
    lever = np.where(extended[:, None], lever / (k * reach[:, None]), 0.0)
    rows = np.stack([even / k - lever, even / k + lever], axis=-1)  # of 2 t - 1 = (z − z_c)/ρ
    yields = []
    for pitches in (1, 2):
        after = np.clip(slices.s + pitches * base_pitch, None, slices.s[-1])
        place = (after - slices.s[0]) / (slices.s[1] - slices.s[0])
        low = np.minimum(place.astype(np.int64), len(slices.s) - 2)
        share = (place - low)[:, None, None]
        further = (1.0 - share) * rows[low] + share * rows[low + 1]
        yields.append(rows.swapaxes(1, 2) @ beside[:, pitches - 1] @ further)
    return np.concatenate(yields, axis=2)


def with_ends(line_load: Array, held: Array | float = 0.0) -> Array:
    """Line load (…, K + 2), extrapolated to both ends of the line, not below zero. line_load: (…,
    K) at the middles of equal slices; held (…): length next to the end over which the load is
    constant, in slices. The extrapolation is the parabola through the three slices at the end, or
    the line through two where the third does not touch or ``held`` is not 0."""
    w, held = np.asarray(line_load, dtype=float), np.asarray(held, dtype=float)
    reach = np.maximum(0.5 - held, 0.0)
    ends = []
    for side in (w, w[..., ::-1]):
        end = side[..., 0].copy()
        if w.shape[-1] > 1:
            touches = (side[..., 0] > 0) & (side[..., 1] > 0)
            end += np.where(touches, reach * (side[..., 0] - side[..., 1]), 0.0)
        if w.shape[-1] > 2:
            bend = side[..., 0] - 2 * side[..., 1] + side[..., 2]
            end += np.where(touches & (side[..., 2] > 0) & (held == 0.0), 0.375 * bend, 0.0)
        ends.append(np.maximum(end, 0.0)[..., None])
    return np.concatenate([ends[0], w, ends[1]], axis=-1)


def factor_along(load: Array, section: float = 0.0) -> float:
    """Largest over mean of a line load (F,) at evenly spaced points, ends of the face included,
    linear between them. section: share of the face over which the largest is averaged, 0 for the
    largest at a point."""
    return float(means_over(load, section).max() / mean_along(load))


def means_over(load: Array, section: float) -> Array:
    """Means of a line load (F,) as in ``factor_along`` over all sections that begin or end at one
    of its points; the load itself for a section of no length."""
    if section <= 0.0:
        return load
    places, steps = np.arange(len(load)), min(section, 1.0) * (len(load) - 1)
    total = np.concatenate([[0.0], np.cumsum(0.5 * (load[1:] + load[:-1]))])

    def up_to(x: Array) -> Array:
        """Integral from the first place to x, in steps."""
        low = np.minimum(x.astype(np.int64), len(load) - 2)
        part = x - low
        return total[low] + part * load[low] + 0.5 * part**2 * (load[low + 1] - load[low])

    last = len(load) - 1.0
    start = np.concatenate([places[places <= last - steps], (places - steps)[places >= steps]])
    return np.asarray((up_to(np.minimum(start + steps, last)) - up_to(start)) / steps)


def mean_along(load: Array) -> float:
    """Mean of a line load (F,) at evenly spaced points, ends of the face included."""
    return float((load[1:] + load[:-1]).sum() / (2 * (len(load) - 1)))
