"""Line contact at the tip edge of a flank, near the ends of the path of contact and beyond them.

x is the distance from the tip edge along the flank, inwards. The gap between flanks of relative
radius ρ is

    g(x) = [(x − e)² − min(e, 0)²]/(2ρ),   x ≥ 0,

where the involutes touch at x = e (``TipEdge.apex``): e > 0 on the path; e < 0 off it, where the
flanks are inclined by |e|/ρ at the edge. Under a line load w, without friction,

    g + c_t K_end p + c_m K_middle p = δ  where p > 0,   p ≥ 0,   Σp = w,

with the compliances of ``edge_layer``. At some depths of the layer from the edge this is Hertz's
contact. At the edge the approach is larger: half of the body is missing (a wedge), half of the
contact too, and off the path the contact at the edge is narrow. The difference from Hertz's contact
is added to the law δ = w (α − β ln w), which is then exact at the mean line load of the path and at
``LESS`` of it, and logarithmic in between.

The centre of the load is at x̄ > e, further inwards than the point where the involutes touch. The
influence of the tooth is taken at x̄, for the tooth is stiffer there than at its edge: a tenth per
module.

The layer under a flank. The indentation that is subtracted from an influence is that of a layer
bonded to a rigid base. Far from the tip Hertz's line contact on a half plane with the layer's κ
(``hertz``) replaces it:

    K_∞(r) = (2c/π) [ln(h/r) + κ − ½],   r = |x − y|,  c = (1 − ν²)/E

At the tip the layer ends, in the FE segment too, so that the indentation subtracted there includes
the effect of the end. Layers with and without an end are solved here in plane strain by finite
elements, with the same nodes along the surface from the edge inwards,

    middle = K_layer − S,    end = K_layer with an end − S,    S = K_layer − K_∞

with S(r) = (2c/π) ∫_0^∞ (L(t) − 1)/t [cos(t r/h) − 1] dt, smooth, the difference of a layer from a
half plane away from the load (which the FE influence of the tooth retains). At the edge the layer
with an end is a wedge: under a load on the edge its surface moves by −2c ln r [cos²φ/(2a + sin 2a)
+ sin²φ/(2a − sin 2a)], 2a the angle of the wedge and φ = π/2 − a that of the load from its middle;
for 2a = 115° one and a half times the 2c/π of a half plane.
Source: Timoshenko and Goodier 1951, Theory of Elasticity, articles 35 and 36.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp

from flexgear.arrays import Array
from flexgear.gears.contact import GearMeshPath
from flexgear.gears.hertz import (
    ContactBody,
    LineContact,
    layer_share,
    line_contact,
    relative_radius,
)
from flexgear.gears.off_path import TipEdge
from flexgear.gears.profile_contact import ProfileContact
from flexgear.gears.slices import Slices
from flexgear.gears.tooth import ToothGeometry
from flexgear.structures.cache import cached_arrays
from flexgear.structures.fem.assembly import plane_strain
from flexgear.structures.linalg.sparse import flexibility
from flexgear.structures.tooth_influence.influence import ToothInfluence

LESS = 1 / 8  # second load at which the contact is solved, over the mean line load
CLEAR = 3.0  # Hertz half widths from the edge, beyond which a contact is Hertz's
NARROWEST = 0.05  # depths, least half width of a contact that is solved; elements resolve no less
LEAST_SLOPE = 0.5  # least β over Hertz's, where a contact is narrower than elements resolve
PLACES = 17  # where the contact is solved, on the path and off it each
INSIDE = 2.0  # depths from the edge to the first place: 0.1 % of Hertz's approach is neglected
MOST_STEPS = 100


@dataclass(frozen=True)
class AtTip:
    """Corrections of line contact by a tip edge, at path coordinates s of any shape, m.

    member: the gear with the tip, 0 planet, 1 its mate; alpha, beta: additions to α and β, m²/N;
    inward: distance from the point where the involutes touch to the centre of the load, inwards
    along the flank of that gear, m.
    """

    member: int
    s: Array
    alpha: Array
    beta: Array
    inward: Array

    def at(self, s: Array) -> AtTip:
        """Corrections interpolated linearly at other s; those of this object rise, (P,)."""
        values = (self.alpha, self.beta, self.inward)
        return AtTip(self.member, s, *(np.interp(s, self.s, value) for value in values))


class TipEnd(NamedTuple):
    """An end of the path of contact, at path coordinate s, m, beyond which a tip edge touches up to
    ``last``, m; member: the gear with the tip, 0 planet, 1 its mate."""

    member: int
    edge: TipEdge
    s: float
    last: float


def tip_ends(path: GearMeshPath, slices: Slices) -> list[TipEnd]:
    """Ends of the path of contact beyond which tip edges touch."""
    off, (low, high) = path.off_path, slices.span
    ends = ((1, off.before, off.s_lo, low), (0, off.after, off.s_hi, high))
    return [TipEnd(k, edge, s, last) for k, edge, s, last in ends if edge and last != s]


def at_tip(
    end: TipEnd,
    members: tuple[ToothInfluence, ToothInfluence],
    cos_base_helix: float,
    line_load: float,
    profile: ProfileContact | None = None,
) -> AtTip:
    """Corrections of line contact by the tip edge at an end of the path, from ``INSIDE`` the path
    to where the tip ceases to touch.

    members: influences of planet and mate; line_load: mean line load, N/m of contact line; profile:
    contact of modified flanks, which touch elsewhere than the involutes.
    """
    edge, influences = end.edge, (members[end.member], members[1 - end.member])
    depth = float(np.ravel(influences[0].contact_body(np.array([edge.tip_roll])).depth)[0])
    inside = INSIDE * depth * edge.tooth.base_radius / edge.tip_roll
    share = np.linspace(0.0, 1.0, PLACES) ** 2
    d = np.concatenate([-inside * share[:0:-1], abs(end.last - end.s) * share])
    rolls = edge.rolls(d)
    body, mate = (
        influence.contact_body(roll) for influence, roll in zip(influences, rolls, strict=True)
    )
    gears = rolls if end.member == 0 else rolls[::-1]
    internal = edge.tooth.internal or edge.mate.internal
    radius = relative_radius(*gears, internal=internal) / cos_base_helix
    apex = edge.apex(d)
    if profile is not None:
        s = end.s + math.copysign(1.0, end.last - end.s) * d
        place = profile.at(profile.place, s, np.zeros_like(s))
        apex -= place if end.member == 0 else -place
    apex = cos_base_helix * apex
    hertz = line_contact(body, mate, radius)
    least = (NARROWEST * depth) ** 2 / float(np.min(hertz.spread))
    loads = max(line_load, least) * np.array([1.0, LESS])
    edges = Edges(_cached_layer(edge.interior_angle, body.poisson), body, mate, radius, apex)
    (more, rests), (more_of_less, _) = (edges.pressed(hertz, w) for w in loads)
    beta = np.maximum((more_of_less - more) / math.log(1 / LESS), -LEAST_SLOPE * hertz.beta)
    alpha = more + beta * math.log(loads[0])
    inward = np.maximum(rests - np.maximum(apex, 0.0), 0.0) / cos_base_helix
    columns = np.stack([end.s + math.copysign(1.0, end.last - end.s) * d, alpha, beta, inward])
    columns[1:, 0] = 0.0  # Hertz's contact here and further inwards
    return AtTip(end.member, *columns[:, np.argsort(columns[0])])


def roll_along(tooth: ToothGeometry, roll: Array, inward: Array) -> Array:
    """Roll lengths, m, at distances ``inward`` along the flank from ``roll`` towards the root,
    m."""
    return np.sqrt(np.maximum(roll**2 - 2 * tooth.outward * tooth.base_radius * inward, 0.0))


@dataclass(frozen=True)
class Edges:
    """Contacts (n,) between a tip edge and the mate's flank. body, mate: layers of both, with
    depths (n,) m; radius: ρ (n,) m; apex: e (n,) m."""

    layer: EdgeLayer
    body: ContactBody
    mate: ContactBody
    radius: Array
    apex: Array

    def pressed(self, hertz: LineContact, load: float) -> tuple[Array, Array]:
        """Approach minus that of Hertz's contact, per line load, (n,) m²/N, and x̄ (n,) m.

        hertz: contact without an edge; load: line load, N/m. A contact that ends well before the
        edge is Hertz's on the layer with an end.
        """
        layer, h = self.layer, np.broadcast_to(self.body.depth, self.apex.shape)
        sinks = np.interp(self.apex / h, layer.place, np.diag(layer.end - layer.middle))
        more, rests = self.body.compliance * sinks, self.apex.copy()
        plain, half = hertz.secant(load), hertz.half_width(load)
        for i in np.flatnonzero(self.apex < CLEAR * half):
            approach, rests[i] = self._solved(int(i), load)
            more[i] = approach / load - plain[i]
        return more, rests

    def _solved(self, i: int, load: float) -> tuple[float, float]:
        """Approach δ and x̄ of contact i, m, under a line load, N/m."""
        h, h_mate = (
            float(np.broadcast_to(b.depth, self.apex.shape)[i]) for b in (self.body, self.mate)
        )
        x, e = h * self.layer.place, float(self.apex[i])
        gap = ((x - e) ** 2 - min(e, 0.0) ** 2) / (2 * float(self.radius[i]))
        of_mate = self.layer.middle + 2 / math.pi * math.log(h_mate / h)
        compliance = self.body.compliance * self.layer.end + self.mate.compliance * of_mate
        force, approach = contact(compliance, gap, load)
        return approach, float(force @ x / load)


def contact(compliance: Array, gap: Array, load: float) -> tuple[Array, float]:
    """Forces p (n,) ≥ 0 with Σp = load, and approach δ with gap + C p ≥ δ, equal where p > 0.

    Primal-dual active set (Hintermüller, Ito and Kunisch 2002), started from the smallest gaps.
    """
    active = gap <= np.partition(gap, 4)[4]
    scale = 1.0 / np.median(np.diag(compliance))
    for _ in range(MOST_STEPS):
        n = np.flatnonzero(active)
        solved = np.linalg.solve(
            compliance[np.ix_(n, n)], np.column_stack([np.ones(len(n)), gap[n]])
        )
        approach = (load + solved[:, 1].sum()) / solved[:, 0].sum()
        force = np.zeros(len(gap))
        force[n] = approach * solved[:, 0] - solved[:, 1]
        pressed = force - scale * (gap + compliance @ force - approach) > 0
        if (pressed == active).all() or not pressed.any():
            break
        active = pressed
    return force, float(approach)


@lru_cache(maxsize=16)
def _cached_layer(angle: float, poisson: float) -> EdgeLayer:
    content = {"tip": angle, "poisson": poisson}
    return cached_arrays(EdgeLayer, 1, content, lambda: edge_layer(angle, poisson))


# lengths in depths of the layer; elements half as long change the approach at an edge by 0.1 %
SMALLEST, COARSEST, GROWTH = 0.001, 0.08, 1.2  # elements along the surface, from the edge on
REACH = 4.0  # of the loaded nodes from the edge; the layer is cut and held at twice this distance
DOWN, DOWN_COARSEST, DOWN_GROWTH = 0.001, 0.25, 1.4  # elements below the surface


@dataclass(frozen=True, eq=False)
class EdgeLayer:
    """Compliance of the surface near a tip edge, minus S. place: nodes (n,) along the surface from
    the edge, in depths h; middle, end: normal displacements (n, n) by line loads at nodes, in
    c = (1 − ν²)/E, of a layer that continues beyond the edge and of one that ends there."""

    place: Array
    middle: Array
    end: Array


def edge_layer(angle: float, poisson: float) -> EdgeLayer:
    """Compliances at a tip edge; angle: between flank and tip land inside the tooth, rad. Both FE
    meshes are alike from the edge inwards, so that their errors cancel in end − middle."""
    along = _graded(SMALLEST, COARSEST, GROWTH, 2 * REACH)
    before = _graded(SMALLEST, 4 * COARSEST, 2 * GROWTH - 1, REACH)
    place, end = _solved(along, angle, poisson)
    _, middle = _solved(np.concatenate([-before[:0:-1], along]), angle, poisson)
    less = _less_than_half_plane(np.abs(place[:, None] - place), poisson)
    return EdgeLayer(place, middle - less, end - less)


def _solved(along: Array, angle: float, poisson: float) -> tuple[Array, Array]:
    """Nodes (n,) of the surface from x = 0 to ``REACH`` and compliance (n, n) in c between them, of
    a layer of depth 1 that begins at along[0] with an end inclined by ``angle`` to the surface;
    along: coordinates of the vertices at the surface."""
    down = _graded(DOWN, DOWN_COARSEST, DOWN_GROWTH, 1.0)
    x, y = np.meshgrid(along, down / down[-1], indexing="ij")
    points = np.column_stack([(x + y / math.tan(angle)).ravel(), y.ravel()])
    number = np.arange(x.size).reshape(x.shape)
    corners = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    cells = np.stack([c.ravel() for c in corners], axis=1)
    nodes, stiffness = plane_strain(points, cells, 1.0 - poisson**2, poisson)
    from_end = nodes[:, 0] - nodes[:, 1] / math.tan(angle)
    free = (nodes[:, 1] < 1.0 - 1e-9) & (from_end < along[-1] - 1e-9)
    loaded = np.flatnonzero((nodes[:, 1] < 1e-9) & (nodes[:, 0] > -1e-9) & (from_end <= REACH))
    loaded = loaded[np.argsort(nodes[loaded, 0])]
    free_dofs = np.flatnonzero(np.repeat(free, 2))
    loads = sp.identity(2 * len(nodes), format="csc")[free_dofs][:, 2 * loaded + 1]
    return nodes[loaded, 0], flexibility(stiffness[free_dofs][:, free_dofs].tocsr(), loads)


def _graded(first: float, coarsest: float, growth: float, stop: float) -> Array:
    """Coordinates from 0 to ``stop`` or just beyond, with steps that grow from ``first`` by a ratio
    up to ``coarsest``."""
    places, step = [0.0], first
    while places[-1] < stop:
        places.append(places[-1] + step)
        step = min(growth * step, coarsest)
    return np.array(places)


def _less_than_half_plane(distance: Array, poisson: float) -> Array:
    """S in c at distances (any shape) in depths of the layer."""
    t, weight = np.polynomial.legendre.leggauss(200)
    t, weight = 10.0 * (t + 1), 10.0 * weight  # L is 1 beyond t = 20
    share = weight * (layer_share(t, poisson) - 1) / t
    places, number = np.unique(np.round(distance, 12), return_inverse=True)
    deficit = 2 / math.pi * (np.cos(np.outer(places, t)) - 1) @ share
    return np.asarray(deficit[number].reshape(distance.shape))
