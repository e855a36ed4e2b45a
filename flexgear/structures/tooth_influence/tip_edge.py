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
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexgear.gears.contact import GearMeshPath
from flexgear.gears.hertz import ContactBody, LineContact, line_contact, relative_radius
from flexgear.gears.off_path import TipEdge
from flexgear.gears.profile_contact import ProfileContact
from flexgear.gears.slices import Slices
from flexgear.gears.tooth import ToothGeometry
from flexgear.structures.tooth_influence.edge_layer import EdgeLayer, edge_layer
from flexgear.structures.tooth_influence.influence import ToothInfluence
from flexgear.structures.tooth_influence.influence_cache import EDGE, cached

Array = NDArray[np.float64]
LESS = 1 / 8  # of the mean line load: the second load at which the contact is solved
CLEAR = 3.0  # Hertz half widths from the edge, from where on a contact is left as it is
NARROWEST = 0.05  # depths: half width below which the mean line load is not followed
LEAST_SLOPE = 0.5  # of Hertz's β, where a contact is narrower than elements resolve
PLACES = 17  # at which it is solved, on the path and off it each
INSIDE = 2.0  # depths of the layer from the edge; there 0.1 % of Hertz's approach is left
MOST_STEPS = 100


@dataclass(frozen=True)
class AtTip:
    """At path coordinates s of any shape: what is added to α and β of the line contact, m²/N, and
    how much further in than the involutes touch the load rests, m along the flank of the planet
    (member 0) or its mate (1), whose tip it is."""

    member: int
    s: Array
    alpha: Array
    beta: Array
    inward: Array

    def at(self, s: Array) -> AtTip:
        """The same elsewhere, linear in between; s of this one rising, (P,)."""
        values = (self.alpha, self.beta, self.inward)
        return AtTip(self.member, s, *(np.interp(s, self.s, value) for value in values))


class TipEnd(NamedTuple):
    """An end of the path: whose tip it is (0: planet); its edge; s at the end and where it ceases
    to touch, m."""

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
    """From well inside the path to where the tip ceases to touch; members: planet and gear;
    line_load: the mean one, N/m of contact line; profile: of modified flanks, which touch further
    in, or as if further out."""
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
    edges = Edges(_kept_layer(edge.interior_angle, body.poisson), body, mate, radius, apex)
    (more, rests), (more_of_less, _) = (edges.pressed(hertz, w) for w in loads)
    beta = np.maximum((more_of_less - more) / math.log(1 / LESS), -LEAST_SLOPE * hertz.beta)
    alpha = more + beta * math.log(loads[0])
    inward = np.maximum(rests - np.maximum(apex, 0.0), 0.0) / cos_base_helix
    columns = np.stack([end.s + math.copysign(1.0, end.last - end.s) * d, alpha, beta, inward])
    columns[1:, 0] = 0.0  # Hertz's contact from here on inwards
    return AtTip(end.member, *columns[:, np.argsort(columns[0])])


def roll_along(tooth: ToothGeometry, roll: Array, inward: Array) -> Array:
    """Roll lengths so much further along the flank from the tip towards the root, m."""
    return np.sqrt(np.maximum(roll**2 - 2 * tooth.outward * tooth.base_radius * inward, 0.0))


@dataclass(frozen=True)
class Edges:
    """Tip edge and mate's flank at places (n,). own, mate: their bodies, depths (n,) m; radius,
    apex: ρ and e (n,), m."""

    layer: EdgeLayer
    own: ContactBody
    mate: ContactBody
    radius: Array
    apex: Array

    def pressed(self, hertz: LineContact, load: float) -> tuple[Array, Array]:
        """What the contact yields more than Hertz's, per line load (n,), m²/N, and x̄ (n,), m.

        A contact that ends well before the edge stays as it is; what its load sinks more is that of
        a line load.
        """
        layer, h = self.layer, np.broadcast_to(self.own.depth, self.apex.shape)
        sinks = np.interp(self.apex / h, layer.place, np.diag(layer.end - layer.middle))
        more, rests = self.own.compliance * sinks, self.apex.copy()
        plain, half = hertz.secant(load), hertz.half_width(load)
        for i in np.flatnonzero(self.apex < CLEAR * half):
            approach, rests[i] = self._solved(int(i), load)
            more[i] = approach / load - plain[i]
        return more, rests

    def _solved(self, i: int, load: float) -> tuple[float, float]:
        """δ, by which flanks close once they touch, and x̄ at place i, m."""
        h, h_mate = (
            float(np.broadcast_to(b.depth, self.apex.shape)[i]) for b in (self.own, self.mate)
        )
        x, e = h * self.layer.place, float(self.apex[i])
        gap = ((x - e) ** 2 - min(e, 0.0) ** 2) / (2 * float(self.radius[i]))
        of_mate = self.layer.middle + 2 / math.pi * math.log(h_mate / h)
        compliance = self.own.compliance * self.layer.end + self.mate.compliance * of_mate
        force, approach = contact(compliance, gap, load)
        return approach, float(force @ x / load)


def contact(compliance: Array, gap: Array, load: float) -> tuple[Array, float]:
    """p (n,) ≥ 0 with Σp = load and δ with gap + C p ≥ δ, equal where p > 0, by a primal-dual
    active set (Hintermüller, Ito and Kunisch 2002) from the places that are nearest."""
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
def _kept_layer(angle: float, poisson: float) -> EdgeLayer:
    return cached({"tip": angle, "poisson": poisson}, lambda: edge_layer(angle, poisson), EDGE)
