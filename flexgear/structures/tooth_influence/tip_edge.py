"""Line contact at the tip edge of a flank, near the ends of the path of contact and beyond them.

x along the flank of the gear whose tip it is, from the edge inwards. Flanks of relative radius ρ
part by

    g(x) = [(x − e)² − min(e, 0)²]/(2ρ),   x ≥ 0,

e being the place where the involutes touch (``TipEdge.apex``): inside the flank on the path, beyond
the edge off it, where flanks are inclined by |e|/ρ at the edge. Pressed together with a line load
w, without friction,

    g + c_t K_end p + c_m K_middle p = δ  where p > 0,   p ≥ 0,   Σp = w,

with the surfaces of ``edge_layer``. From some depths of the layer on that is Hertz's contact. At
the edge it yields more: half of the body is missing (a wedge), and half of the contact; off the
path, where the edge presses, it is narrow, too. The more is put into the same law, δ = w (α − β ln
w): exactly at the mean line load of the path and at ``LESS`` of it, where w grows by a
logarithm (all of it, if flanks are in line or inclined by far, for wedges have no length).

The load rests on average at x̄ > e, further in than the involutes touch. There the influence of the
tooth is taken, for it bends less than at its edge: a tenth less per module.

The layer under a flank near the tip edge, where half of the body is missing. The dip of line
contact that is taken off an influence is that of a layer bonded to a rigid base. Inside a flank
Hertz's line contact in a half plane with the layer's κ (``hertz``) stands for it:

    K_∞(r) = (2c/π) [ln(h/r) + κ − ½],   r = |x − y|,  c = (1 − ν²)/E

At the tip the layer ends, and so does the same layer of the FE segment: what is taken off
there has the end in it. Both layers are solved here in plane strain by finite elements on the same
nodes, a line of them from the edge inwards,

    middle = K_layer − S,    end = K_layer with an end − S,    S = K_layer − K_∞

with S(r) = (2c/π) ∫_0^∞ (L(t) − 1)/t [cos(t r/h) − 1] dt, smooth, what a layer yields less than a
half plane away from the load (in the FE influence of the tooth that is not taken off). At the edge
the layer with an end is a wedge: its surface sinks as −2c ln r [cos²φ/(2a + sin 2a) +
sin²φ/(2a − sin 2a)] under a load on the edge, 2a being the angle of the wedge and φ = π/2 − a that
of the load from its middle, half as much again as the 2c/π of a half plane where 2a is 115°.
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

LESS = 1 / 8  # of the mean line load: the second load at which the contact is solved
CLEAR = 3.0  # Hertz half widths from the edge, from where on a contact is left as it is
NARROWEST = 0.05  # depths: half width below which the mean line load is not followed
LEAST_SLOPE = 0.5  # of Hertz's β, where a contact is narrower than elements resolve
PLACES = 17  # at which it is solved, on the path and off it each
INSIDE = 2.0  # depths of the layer from the edge; there 0.1 % of Hertz's approach is left
MOST_STEPS = 100


@dataclass(frozen=True)
class AtTip:
    """At path coordinates s of any shape: additions to α and β of the line contact, m²/N, and
    distance from the point where the involutes touch to the centre of the load, inwards along the
    flank whose tip it is, m; member: 0 planet, 1 its mate."""

    member: int
    s: Array
    alpha: Array
    beta: Array
    inward: Array

    def at(self, s: Array) -> AtTip:
        """The same at other s, linearly interpolated; s of this one rising, (P,)."""
        values = (self.alpha, self.beta, self.inward)
        return AtTip(self.member, s, *(np.interp(s, self.s, value) for value in values))


class TipEnd(NamedTuple):
    """An end of the path: member whose tip it is (0: planet); its edge; s at the end of the path
    and where the tip ceases to touch, m."""

    member: int
    edge: TipEdge
    s: float
    last: float


def tip_ends(path: GearMeshPath, slices: Slices) -> list[TipEnd]:
    """Ends of the path of contact beyond which tips touch."""
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
    """Correction of line contact from well inside the path to where the tip ceases to touch.
    members: planet and gear; line_load: mean line load, N/m of contact line; profile: contact of
    modified flanks, which shifts the point where they touch."""
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
    columns[1:, 0] = 0.0  # Hertz's contact from here on inwards
    return AtTip(end.member, *columns[:, np.argsort(columns[0])])


def roll_along(tooth: ToothGeometry, roll: Array, inward: Array) -> Array:
    """Roll lengths at distances ``inward`` along the flank from ``roll`` towards the root, m."""
    return np.sqrt(np.maximum(roll**2 - 2 * tooth.outward * tooth.base_radius * inward, 0.0))


@dataclass(frozen=True)
class Edges:
    """Tip edge and mate's flank at positions (n,). body, mate: their bodies, depths (n,) m; radius,
    apex: ρ and e (n,), m."""

    layer: EdgeLayer
    body: ContactBody
    mate: ContactBody
    radius: Array
    apex: Array

    def pressed(self, hertz: LineContact, load: float) -> tuple[Array, Array]:
        """Approach in excess of Hertz's contact, per line load (n,), m²/N, and x̄ (n,), m. A
        contact that ends well before the edge is Hertz's; only its layer is that of a tip."""
        layer, h = self.layer, np.broadcast_to(self.body.depth, self.apex.shape)
        sinks = np.interp(self.apex / h, layer.place, np.diag(layer.end - layer.middle))
        more, rests = self.body.compliance * sinks, self.apex.copy()
        plain, half = hertz.secant(load), hertz.half_width(load)
        for i in np.flatnonzero(self.apex < CLEAR * half):
            approach, rests[i] = self._solved(int(i), load)
            more[i] = approach / load - plain[i]
        return more, rests

    def _solved(self, i: int, load: float) -> tuple[float, float]:
        """δ, approach of the flanks after first contact, and x̄ at position i, m."""
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
    """p (n,) ≥ 0 with Σp = load and δ with gap + C p ≥ δ, equal where p > 0, by a primal-dual
    active set (Hintermüller, Ito and Kunisch 2002) that starts from the smallest gaps."""
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


# in depths of the layer; half as long elements change the approach at an edge by 0.1 %
SMALLEST, COARSEST, GROWTH = 0.001, 0.08, 1.2  # elements along the surface, from the edge on
REACH = 4.0  # of the nodes from the edge, at twice of which the layer is cut and held
DOWN, DOWN_COARSEST, DOWN_GROWTH = 0.001, 0.25, 1.4  # elements below the surface


@dataclass(frozen=True, eq=False)
class EdgeLayer:
    """place: nodes (n,) along the surface from the edge, in depths h; middle, end: (n, n) normal
    displacement by line loads at nodes, in c = (1 − ν²)/E, of a layer that continues beyond the
    edge and of one that ends there."""

    place: Array
    middle: Array
    end: Array


def edge_layer(angle: float, poisson: float) -> EdgeLayer:
    """Layers at a tip edge with the angle (rad) between flank and tip land inside the tooth. Both
    are meshed alike, so discretisation errors cancel in end − middle."""
    along = _graded(SMALLEST, COARSEST, GROWTH, 2 * REACH)
    before = _graded(SMALLEST, 4 * COARSEST, 2 * GROWTH - 1, REACH)
    place, end = _solved(along, angle, poisson)
    _, middle = _solved(np.concatenate([-before[:0:-1], along]), angle, poisson)
    less = _less_than_half_plane(np.abs(place[:, None] - place), poisson)
    return EdgeLayer(place, middle - less, end - less)


def _solved(along: Array, angle: float, poisson: float) -> tuple[Array, Array]:
    """Nodes (n,) of the surface from x = 0 to ``REACH`` and their compliance (n, n) in c; a layer
    of depth 1 that begins at along[0], its end inclined by ``angle`` to the surface."""
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
    loads = sp.csc_matrix(
        (
            np.ones(len(loaded)),
            (np.searchsorted(free_dofs, 2 * loaded + 1), np.arange(len(loaded))),
        ),
        shape=(len(free_dofs), len(loaded)),
    )
    return nodes[loaded, 0], flexibility(stiffness[free_dofs][:, free_dofs].tocsr(), loads)


def _graded(first: float, coarsest: float, growth: float, stop: float) -> Array:
    """Coordinates from 0 to ``stop`` or just beyond; steps grow from the first one on."""
    places, step = [0.0], first
    while places[-1] < stop:
        places.append(places[-1] + step)
        step = min(growth * step, coarsest)
    return np.array(places)


def _less_than_half_plane(distance: Array, poisson: float) -> Array:
    """S in c at distances (any shape) in depths."""
    t, weight = np.polynomial.legendre.leggauss(200)
    t, weight = 10.0 * (t + 1), 10.0 * weight  # L is 1 from there on
    share = weight * (layer_share(t, poisson) - 1) / t
    places, number = np.unique(np.round(distance, 12), return_inverse=True)
    deficit = 2 / math.pi * (np.cos(np.outer(places, t)) - 1) @ share
    return np.asarray(deficit[number].reshape(distance.shape))
