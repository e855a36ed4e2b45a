"""Slices of a contact line: position, stiffness and gap of each, and load factors along the face.

The line of a pair at the path coordinate s (at z = 0) goes from z₁(s) to z₂(s), the part of the
face where s + t z is on the path, or where tips touch before and after it (``off_path``). It is cut
into K slices of equal width that move with its ends, so that no slice enters or leaves within the
face and causes a ripple of the transmission error. Slice j at its middle z_j has the stiffness
k_j = k'(ξ_j) (z₂ − z₁)/K. All are scaled so that their sum is the stiffness of the line, which
``stiffness`` integrates exactly, and shifted so that their centre of stiffness is that of the line;
the remaining error of the midpoint rule is of second order in 1/K. Off the path k' is that at its
end.

Load factor along the face (ISO 6336-1: largest over mean load per width)

    K_Hβ = max_z W(z) / mean_z W(z),    W(z): line load at z over a cycle of the gear mesh

Loads at the middles of slices converge to the largest at first order in 1/K, so the line load is
extrapolated to the ends of the line.

The load of independent slices has a value at every point. That of slices coupled by FE influences
has not: Hertz's line contact and nodes a module apart do not resolve changes over less than a
module, which thin slices still show at the ends of the face and at the corner where lines come in.
There the load is constant over the last half ``section``, a length of about a module, and W in K_Hβ
is the mean over a section, as in Annex E of ISO 6336-1 (from AGMA 927-A01), which uses loads of
pieces of the face.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import scipy  # loads a subpackage at its first use

from flexgear.arrays import Array
from flexgear.gears.profile_contact import ProfileContact
from flexgear.gears.stiffness import Law, pair_stiffness

Gap = Callable[[Array, Array], Array]
POINTS = 2001  # path coordinates of the tables
LEAST_COMPLIANCE = 0.5  # of modified flanks over that of involutes


@dataclass(frozen=True)
class Bending:
    """Flexibility between the K slices of a contact line, over S path coordinates.

    scale, limit: (S, K) a, m/N, and d, N, of the approach a f ln(d/f) of a slice under its force f;
    lower: (S, K (K + 1)/2) m/N, lower triangles, row by row, of both flanks together without line
    contact; neighbours: (S, 2, 4) m/N, displacement of both rows of the line per force on the rows
    of the lines one and two base pitches ahead (``neighbour_flexibility``).
    """

    scale: Array
    limit: Array
    lower: Array
    neighbours: Array


@dataclass(frozen=True)
class Slices:
    """K slices of the contact lines of a gear mesh at path coordinates s (S,), m.

    z, stiffness, gap, width: (S, K) m, N/m, m, m; gap along the 3D normal, positive where material
    is missing. centre, radius: (S,) m, centre and radius of gyration of the stiffness along z.
    on_path: (S,) N/m, stiffness of the part of the line on the path of contact. span: path
    coordinates between which a point of a line may touch, m. bending: None for independent slices;
    otherwise stiffness is the nominal share of each slice in that of the line. profile: contact of
    modified flanks across the profile, None for involutes. narrowing: (S, K) half widths of
    contacts over those of Hertz at the mean line load.
    """

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
        """Gap h̄ (S,) of a pair as one spring, m, F = ∫ k' (δ − h) dz = k (δ − h̄): mean weighted by
        stiffness, exact while the whole line touches; 0 without stiffness."""
        total = self.stiffness.sum(axis=1)
        weighted = (self.stiffness * self.gap).sum(axis=1)
        return np.divide(weighted, total, out=np.zeros_like(total), where=total > 0)

    def modified(self, profile: ProfileContact, law: Law, line: Line) -> Slices:
        """Slices of the same lines on modified flanks; law, line: as in ``cut``. They have the gap
        of ``profile``, and the stiffness of the point where they touch, reduced by the secant
        compliance c of ``profile``: k' → k'/(1 + k' c cos β_b)."""
        place = np.clip(self.s[:, None] + line.slope * self.z, *self.span)  # up to rounding
        gap = profile.gap_at(place, self.z)
        if not profile.varies:
            return replace(self, gap=gap)

        shift = profile.path_shift(place, self.z)
        stiffness = self.stiffness * line.law(law, place + shift) / line.law(law, place)
        wide = self.width > 0.0
        per_width = np.divide(stiffness, self.width, out=np.zeros_like(self.z), where=wide)
        increase = per_width * profile.at(profile.secant, place, self.z)
        increase *= math.cos(math.atan(line.slope))
        stiffness /= np.maximum(1.0 + increase, LEAST_COMPLIANCE)
        narrowing = profile.at(profile.narrowing, place, self.z)
        slices = self.with_stiffness(stiffness)
        return replace(slices, gap=gap, profile=profile, narrowing=narrowing)

    def with_stiffness(self, stiffness: Array) -> Slices:
        """Slices of the same lines with other stiffnesses (S, K), N/m."""
        before, k = self.stiffness.sum(axis=1), stiffness.sum(axis=1)
        touching = k > 0.0
        moment = (stiffness * self.z).sum(axis=1)
        centre = np.divide(moment, k, out=self.centre.copy(), where=touching)
        spread = (stiffness * (self.z - centre[:, None]) ** 2).sum(axis=1)
        radius = np.sqrt(np.divide(spread, k, out=np.zeros_like(k), where=touching))
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
    """Geometry of the contact lines of a gear mesh. path: ends of the path of contact, m; span:
    ends including the range where tips touch, m; slope: ds/dz; half_face: half the face width,
    m."""

    path: tuple[float, float]
    span: tuple[float, float]
    slope: float
    half_face: float

    def law(self, law: Law, s: Array) -> Array:
        """k' at path coordinates s of any shape, N/m²; beyond the path that at its end."""
        return law(np.clip((s - self.path[0]) / (self.path[1] - self.path[0]), 0.0, 1.0))


def cut(law: Law, line: Line, count: int, gap: Gap | None = None) -> Slices:
    """Slices of contact lines. law: k'(ξ), N/m², over the path; count: K; gap: of involutes at
    (path coordinate, z) of any shape, m."""
    (low, high), reach = line.span, abs(line.slope) * line.half_face
    s = np.linspace(low - reach, high + reach, POINTS)

    def span_law(share: Array) -> Array:
        return line.law(law, low + share * (high - low))

    k, centre = pair_stiffness(span_law, s, low, high, line.slope, line.half_face)
    on_path, _ = pair_stiffness(law, s, *line.path, line.slope, line.half_face)
    start, stop = line_ends(s, line)
    width = (stop - start) / count
    z = start[:, None] + width[:, None] * (np.arange(count) + 0.5)
    unscaled = span_law((s[:, None] + line.slope * z - low) / (high - low)) * width[:, None]
    total = unscaled.sum(axis=1)
    touching = (k > 0) & (total > 0)
    stiffness = unscaled * np.divide(k, total, out=np.zeros_like(k), where=touching)[:, None]
    middle = np.divide((stiffness * z).sum(axis=1), k, out=np.zeros_like(k), where=touching)
    z = np.where(touching[:, None], z + (centre - middle)[:, None], centre[:, None])
    spread = (stiffness * (z - centre[:, None]) ** 2).sum(axis=1)
    radius = np.sqrt(np.divide(spread, k, out=np.zeros_like(k), where=touching))
    return Slices(
        s=s,
        z=z,
        stiffness=stiffness,
        gap=np.zeros_like(z) if gap is None else gap(s[:, None] + line.slope * z, z),
        width=np.repeat(width[:, None], count, axis=1),
        centre=centre,
        radius=np.where(radius > 1e-9 * line.half_face, radius, 0.0),  # rounding for one slice
        on_path=on_path,
        span=line.span,
    )


def line_ends(s: Array, line: Line) -> tuple[Array, Array]:
    """Ends z₁ and z₂ (S,) of contact lines, m; equal outside the range of contact."""
    (low, high), half = line.span, line.half_face
    if abs(line.slope) * half < 1e-9 * (high - low):  # spur: whole face at one place
        inside = (s >= low) & (s <= high)
        return np.where(inside, -half, 0.0), np.where(inside, half, 0.0)
    ends = np.sort((np.array([[low], [high]]) - s) / line.slope, axis=0)
    start, stop = np.clip(ends, -half, half)
    return start, stop


@dataclass(frozen=True)
class NominalLoad:
    """Load at which nominal stiffness is evaluated. line_load: uniform, per length along z, N/m;
    base_pitch: distance between contact lines, m."""

    line_load: float
    base_pitch: float


def with_flexibility(
    slices: Slices,
    flexibility: Array,
    neighbours: Array,
    contact: tuple[Array, Array],
    load: NominalLoad,
) -> Slices:
    """Slices of the same lines with flexibility C between slices.

    flexibility: C (S, K, K), m/N, of both flanks without line contact; neighbours: (S, 2, K, K),
    m/N, displacement of slices per force on those of the lines one and two base pitches ahead;
    contact: scale a, m/N, and limit d, N, of the line contact of every slice, (S, K) each. With
    G = (C + diag h'(f))⁻¹: k = 1ᵀG1, z_c = 1ᵀGz/k, ρ² = zᵀGz/k − z_c².
    """
    scale, limit = contact
    force = np.maximum(load.line_load * slices.width, 1e-9 * limit)
    slope = scale * (np.log(limit / np.minimum(force, limit / 8.0)) - 1.0)
    tangent = flexibility + slope[:, :, None] * np.eye(slices.count)
    columns = np.stack([np.ones_like(slices.z), slices.z], axis=-1)
    solved = np.linalg.solve(tangent, columns)
    g_one, g_z = np.asarray(solved[:, :, 0]), np.asarray(solved[:, :, 1])
    before = slices.stiffness.sum(axis=1)
    touching = before > 0
    stiffness = np.where(touching[:, None], np.maximum(g_one, 0.0), 0.0)
    k = np.maximum(g_one.sum(axis=1), 1e-300)
    centre = (g_one * slices.z).sum(axis=1) / k
    spread = (g_z * slices.z).sum(axis=1) / k - centre**2
    on_path = np.divide(slices.on_path, before, out=np.zeros_like(k), where=touching)
    slices = replace(
        slices,
        stiffness=stiffness,
        centre=np.where(touching, centre, slices.centre),
        radius=np.where(touching, np.sqrt(np.maximum(spread, 0.0)), 0.0),
        on_path=on_path * stiffness.sum(axis=1),
    )
    between_rows = neighbour_flexibility(slices, (g_one, g_z), neighbours, load.base_pitch)
    lower = flexibility[:, *np.tril_indices(slices.count)]
    return replace(slices, bending=Bending(scale, limit, lower, between_rows))


def neighbour_flexibility(
    slices: Slices, solved: tuple[Array, Array], neighbours: Array, base_pitch: float
) -> Array:
    """B (S, 2, 4), m/N: displacement of both rows of a line, at z_c ∓ ρ, per force on the rows of
    the lines one and two base pitches ahead.

    A loaded tooth deflects its neighbours almost rigidly along the face, so resultants suffice:
    forces of rows are distributed over slices as under rigid approach, P = G T (TᵀGT)⁻¹ with
    T = (1 − t, t), 2 t − 1 = (z − z_c)/ρ, and B = Pᵀ C P' between two lines. solved: G 1 and G z
    (S, K); neighbours: C (S, 2, K, K), m/N.
    """
    extended = slices.radius > 0
    radius = np.where(extended, slices.radius, 1.0)
    even, lever = solved[0], solved[1] - slices.centre[:, None] * solved[0]
    k = np.maximum(even.sum(axis=1), 1e-300)[:, None]
    lever = np.where(extended[:, None], lever / (k * radius[:, None]), 0.0)
    rows = np.stack([even / k - lever, even / k + lever], axis=-1)
    blocks = []
    table = scipy.interpolate.make_interp_spline(slices.s, rows, k=1)
    for pitches in (1, 2):
        rows_ahead = table(np.clip(slices.s + pitches * base_pitch, None, slices.s[-1]))
        blocks.append(rows.swapaxes(1, 2) @ neighbours[:, pitches - 1] @ rows_ahead)
    return np.concatenate(blocks, axis=2)


def with_ends(line_load: Array, flat: Array | float = 0.0) -> Array:
    """Line load (…, K + 2), extrapolated to both ends of the line, not below zero.

    line_load: (…, K) at the middles of equal slices; flat (…): length next to the end over which
    the load is constant, in slices. The extrapolation is the parabola through the three slices at
    the end, or the straight line through two where the third does not touch or ``flat`` is not 0.
    """
    w, flat = np.asarray(line_load, dtype=float), np.asarray(flat, dtype=float)
    reach = np.maximum(0.5 - flat, 0.0)
    ends = []
    for side in (w, w[..., ::-1]):
        end = side[..., 0].copy()
        if w.shape[-1] > 1:
            touches = (side[..., 0] > 0) & (side[..., 1] > 0)
            end += np.where(touches, reach * (side[..., 0] - side[..., 1]), 0.0)
        if w.shape[-1] > 2:
            curvature = side[..., 0] - 2 * side[..., 1] + side[..., 2]
            end += np.where(touches & (side[..., 2] > 0) & (flat == 0.0), 0.375 * curvature, 0.0)
        ends.append(np.maximum(end, 0.0)[..., None])
    return np.concatenate([ends[0], w, ends[1]], axis=-1)


def factor_along(load: Array, section: float = 0.0) -> float:
    """Largest over mean of a line load (F,) at evenly spaced points from end to end of the face,
    linear in between; section: fraction of the face over which the largest is averaged."""
    return float(means_over(load, section).max() / mean_along(load))


def means_over(load: Array, section: float) -> Array:
    """Means of a line load (F,) as in ``factor_along`` over all sections that begin or end at a
    point; the load itself for a section of zero length."""
    if section <= 0.0:
        return load
    places, last = np.arange(len(load)), len(load) - 1.0
    steps = min(section, 1.0) * last
    integral = scipy.interpolate.make_interp_spline(places, load, k=1).antiderivative()
    start = np.concatenate([places[places <= last - steps], (places - steps)[places >= steps]])
    return np.asarray((integral(np.minimum(start + steps, last)) - integral(start)) / steps)


def mean_along(load: Array) -> float:
    """Mean of a line load (F,) at evenly spaced points from end to end of the face."""
    return float((load[1:] + load[:-1]).sum() / (2 * (len(load) - 1)))
