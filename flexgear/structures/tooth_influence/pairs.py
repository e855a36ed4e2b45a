"""How the slices of a pair's contact lines bend each other, from the influence of both teeth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple, Protocol, Self, TypeVar

import numpy as np
from scipy.interpolate import interp1d

from flexgear.arrays import Array, Ints
from flexgear.gears.contact import GearMeshPath
from flexgear.gears.geometry import stage_geometry
from flexgear.gears.hertz import ContactBody, line_contact, relative_radius
from flexgear.gears.slices import Slices
from flexgear.gears.stiffness import line_load
from flexgear.gears.tooth import ToothGeometry
from flexgear.gears.weber_banaschek import middle_depth
from flexgear.model.stage_view import StageView
from flexgear.structures.tooth_influence.influence import ToothInfluence
from flexgear.structures.tooth_influence.of_case import tooth_influence
from flexgear.structures.tooth_influence.tip_edge import (
    LEAST_SLOPE,
    AtTip,
    at_tip,
    roll_along,
    tip_ends,
)

Lines = tuple[Array, Array, Array]

_PLACES = 251  # contact lines for which the flexibility is computed; linear between
_LEAST_WIDTH = 1e-6  # of the face, where a line has left it


@dataclass(frozen=True)
class PairBending:
    """Over the path coordinate (S,), for contact lines of K slices each.

    flexibility (S, K, K) m/N of both teeth between the slices of a line; beside (S, 2, K, K) m/N:
    displacement of its slices per force on those of the next line, a base pitch further on, and of
    the one after that, through the bodies below them; scale m/N and limit N (S, K) of the approach
    a f ln(d/f) of line contact.
    """

    flexibility: Array
    beside: Array
    scale: Array
    limit: Array

    def with_rim(self, flexibility: Array, beside: Array) -> PairBending:
        """And what the rim of an FE ring adds: ``rim``."""
        more = self.flexibility + flexibility, self.beside + beside
        return replace(self, flexibility=more[0], beside=more[1])


def pair_bending(view: StageView, path: GearMeshPath, slices: Slices, force: float) -> PairBending:
    """How slices of contact lines bend each other, for ``gears.slices.bent``.

    force: of the gear mesh, N, for whose mean line load contacts at tip edges are solved
    (``tip_edge``; where both teeth have influences). Displacement and force of slices are along the
    normal N. Teeth of an FE body move their neighbours by its own model and its rim (``rim``);
    nothing of it is in ``beside``.
    """
    width, some = widths(path, slices), some_places(slices, _PLACES)
    count = slices.count
    flexibility, bodies = np.zeros((len(some), count, count)), []
    beside = np.zeros((len(some), 2, count, count))
    flanks = mating_flanks(path, slices)
    influences = [tooth_influence(view, mating.name) for mating in flanks]
    load = line_load(view, stage_geometry(view), path.kind.gear, force)
    at_tips = _at_tips(path, slices, influences, load)
    for member, (mating, influence) in enumerate(zip(flanks, influences, strict=True)):
        if influence is None:
            bodies.append(_to_middle(view, mating.tooth, mating.roll))
            continue
        flank, roll = mating.of(influence), mating.roll
        if (profile := slices.profile) is not None:
            centre = profile.at(profile.centre, _touches(path, slices), slices.z)
            roll = roll_along(mating.tooth, roll, centre if member else -centre)
        for tip in at_tips:
            inward = tip.inward if tip.member == member else -tip.inward
            roll = roll_along(mating.tooth, roll, inward)
        flexibility += flank.matrix(roll[some], slices.z[some], width[some])
        bodies.append(flank.contact_body(mating.roll))
        if flank.neighbour is not None:
            lines = (roll, slices.z, width)
            for apart in (1, 2):
                places = (slices.s, some, apart * path.base_pitch)
                beside[:, apart - 1] += _further_line(flank, apart * mating.step, lines, places)
    cos, internal = path.cos_base_helix, path.off_path.gear.internal
    radius = relative_radius(flanks[0].roll, flanks[1].roll, internal=internal) / cos
    contact = line_contact(bodies[0], bodies[1], radius)
    for tip in at_tips:
        contact = contact.softer(tip.alpha, tip.beta)
    if profile is not None:
        on, z = _touches(path, slices), slices.z
        more = profile.at(profile.alpha, on, z), profile.at(profile.beta, on, z)
        contact = contact.softer(more[0], np.maximum(more[1], -LEAST_SLOPE * contact.beta))
    scale, limit = contact.of_slice(width / cos)
    return PairBending(
        flexibility=rows_at(slices.s[some], flexibility, slices.s),
        beside=rows_at(slices.s[some], beside, slices.s),
        scale=scale,
        limit=limit,
    )


def _at_tips(
    path: GearMeshPath,
    slices: Slices,
    influences: Sequence[ToothInfluence | None],
    line_load: float,
) -> list[AtTip]:
    """At the slices, of every tip edge that touches; none where a tooth has no influence."""
    planet, gear = influences
    if planet is None or gear is None:
        return []
    on, members = _touches(path, slices), (planet, gear)
    return [
        at_tip(end, members, path.cos_base_helix, line_load, slices.profile).at(on)
        for end in tip_ends(path, slices)
    ]


class _Flank(Protocol):
    def mirrored(self) -> Self: ...
    def turned(self) -> Self: ...


Flank = TypeVar("Flank", bound=_Flank)


class MatingFlank(NamedTuple):
    """Flanks of one gear over the contact lines of a gear mesh.

    name: "planet", "sun" or "ring"; sense: 1 where the force pushes the gear's teeth on in +θ, on
    their −θ flank, else −1; step: teeth in +θ from one pair to the next; other_hand: whether the
    helix has the other hand than the gear's, as right halves have; roll (S, K) m of slices, held on
    the flank.
    """

    name: str
    tooth: ToothGeometry
    sense: int
    step: int
    other_hand: bool
    roll: Array

    def of(self, flank: Flank) -> Flank:
        """What was made of the −θ flank of the gear's own hand, as this flank has it."""
        flank = flank.mirrored() if self.other_hand else flank
        return flank if self.sense > 0 else flank.turned()


def mating_flanks(path: GearMeshPath, slices: Slices) -> list[MatingFlank]:
    """Of the planet, then of its mate."""
    on = _touches(path, slices)
    members = (
        ("planet", path.off_path.planet, -path.planet_step, path.planet_step),
        (path.kind.gear, path.off_path.gear, path.gear_step, path.gear_step),
    )
    flanks = []
    for (name, tooth, sense, step), roll in zip(members, path.off_path.rolls(on), strict=True):
        low, high = sorted(map(tooth.roll_length, (tooth.form_radius, tooth.tip_radius)))
        held = np.clip(np.nan_to_num(roll, nan=high), max(low, 1e-3 * tooth.base_pitch), high)
        flanks.append(MatingFlank(name, tooth, sense, step, path.side == "right", held))
    return flanks


def _touches(path: GearMeshPath, slices: Slices) -> Array:
    """Path coordinates (S, K) of slices, m."""
    return np.clip(slices.s[:, None] + path.slope * slices.z, *slices.span)


def widths(path: GearMeshPath, slices: Slices) -> Array:
    """Axial widths (S, K) m of slices, not quite zero where a line has left the face."""
    return np.maximum(slices.width, _LEAST_WIDTH * 2 * path.half_face)


def some_places(slices: Slices, most: int) -> Ints:
    """Numbers of at most so many of the contact lines, evenly spread."""
    return np.unique(np.linspace(0, len(slices.s) - 1, most).astype(np.int64))


def _further_line(
    flank: ToothInfluence, step: int, lines: Lines, places: tuple[Array, Ints, float]
) -> Array:
    """C (S', K, K) m/N of one gear: displacement of slices of some lines (roll, z, width) per force
    on those further on, whose tooth is ``step`` teeth on in +θ.

    places: path coordinates of the lines, numbers of those wanted, m to those further on.
    """
    (roll, z, width), (s, some, way) = lines, places
    further = np.clip(s[some] + way, None, s[-1])
    here = roll[some], z[some], width[some]
    there = rows_at(s, roll, further), rows_at(s, z, further), rows_at(s, width, further)
    if step > 0:
        return flank.coupling(here, there, step)
    return np.swapaxes(flank.coupling(there, here, -step), 1, 2)


def rows_at(s: Array, table: Array, places: Array) -> Array:
    """Rows of a table over s at other places."""
    return np.asarray(interp1d(s, table, axis=0, copy=False, assume_sorted=True)(places))


def _to_middle(view: StageView, tooth: ToothGeometry, roll: Array) -> ContactBody:
    """The flank of a tooth that an FE body has whole: line contact down to its middle line."""
    depth = middle_depth(tooth, np.hypot(tooth.base_radius, roll))
    return ContactBody(view.material.young_modulus, view.material.poisson_ratio, depth)
