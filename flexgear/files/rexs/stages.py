"""Stages of a REXS model, their gears and members, and the bearings that carry them.

A REXS gear mesh is a cylindrical_stage with two gears. A planetary stage collects those of every
planet with sun and ring: the ring is the internal gear, planets mesh with it, suns with planets.
Double-helical stages are pairs of gears of opposite hand on the same shafts.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field

from flexgear.files.rexs.assembly import BEARINGS, COUPLINGS, Assembly, carrier_parts
from flexgear.files.rexs.document import Component, Document, number, value

GEARS = ("cylindrical_gear", "ring_gear")


@dataclass(frozen=True)
class RexsGearMesh:
    """A gear mesh: its cylindrical_stage and its two gears, gear_1 first."""

    stage: Component
    gears: tuple[Component, Component]

    def mate(self, gear: Component) -> Component:
        """The other gear."""
        return self.gears[1] if self.gears[0] is gear else self.gears[0]


@dataclass
class RexsStage:
    """A stage: gears by "sun", "planet", "ring" (or "pinion", "gear").

    halves: of each role a list of twins (the planets) for each half, left (−u) half first; one half
    unless double-helical. meshes: by "sun" and "ring", or "sun" alone if parallel.
    """

    component: Component
    kind: str
    halves: dict[str, list[list[Component]]]
    gear_meshes: dict[str, list[RexsGearMesh]]
    carrier: list[Component] = field(default_factory=list)

    def gears(self, role: str) -> list[Component]:
        """All gears of a role, those of the left half first."""
        return [gear for half in self.halves[role] for gear in half]

    @property
    def roles(self) -> tuple[str, ...]:
        """Names of the gears."""
        return tuple(self.halves)

    @property
    def all_gears(self) -> list[Component]:
        """Gears of all roles."""
        return [gear for role in self.roles for gear in self.gears(role)]

    @property
    def pairs(self) -> list[Component]:
        """The cylindrical_stage of every gear mesh."""
        return [
            gear_mesh.stage
            for gear_meshes in self.gear_meshes.values()
            for gear_mesh in gear_meshes
        ]


class Unfit(Exception):
    """A stage that a case cannot represent; its text is the reason."""


def is_internal(gear: Component) -> bool:
    """A ring: by its type, or by a negative number of teeth."""
    teeth = number([gear], "number_of_teeth", "none")
    return gear.kind == "ring_gear" or (teeth is not None and teeth.value < 0)


def is_helical(stage: RexsStage) -> bool:
    """Whether its gears have a helix angle."""
    datum = number(stage.all_gears, "helix_angle_reference_diameter", "deg")
    return datum is not None and datum.value != 0


def stages_of(assembly: Assembly) -> tuple[list[RexsStage], list[str]]:
    """All stages in the order of their ids, and in words those that cannot be carried over."""
    gear_meshes, refused = _gear_meshes(assembly.document), []
    stages, inside = [], set()
    for planetary in assembly.document.kind("planetary_stage"):
        inner = {s.id for s in assembly.document.parts(planetary, "cylindrical_stage")}
        mine = [gear_mesh for gear_mesh in gear_meshes if gear_mesh.stage.id in inner]
        inside |= inner
        try:
            stages.append(_planetary(assembly, planetary, mine))
        except Unfit as why:
            refused.append(f"{planetary.label}: not carried over, {why}")
    groups = defaultdict(list)
    for gear_mesh in gear_meshes:
        if gear_mesh.stage.id not in inside:
            bodies = tuple(assembly.body(g) for g in gear_mesh.gears)
            groups[frozenset(bodies)].append(gear_mesh)
    for group in groups.values():
        for pair in _halves_of_pairs(group):
            try:
                stages.append(_parallel(pair, assembly))
            except Unfit as why:
                refused.append(f"{pair[0].stage.label}: not carried over, {why}")
    for other in assembly.document.kind("bevel_stage", "worm_stage", "general_stage"):
        refused.append(f"{other.label}: not carried over, only cylindrical gears are")
    stages.sort(key=lambda stage: stage.component.id)
    for stage in stages:
        _mark(stage)
    return stages, refused


def _gear_meshes(document: Document) -> list[RexsGearMesh]:
    gear_meshes = []
    for relation, (stage, *gears) in document.each("stage", "stage", "gear_1", "gear_2"):
        if stage.kind == "cylindrical_stage" and {gear.kind for gear in gears} <= {*GEARS}:
            relation.used = True
            gear_meshes.append(RexsGearMesh(stage, (gears[0], gears[1])))
    return gear_meshes


def _mark(stage: RexsStage) -> None:
    stage.component.role = "a stage"
    for role in stage.roles:
        for gear in stage.gears(role):
            gear.role = role
    for pair in stage.pairs:
        pair.role = "a gear mesh"
    for part in stage.carrier:
        part.role = "the carrier"


def _planetary(
    assembly: Assembly, planetary: Component, gear_meshes: list[RexsGearMesh]
) -> RexsStage:
    rings = list(
        dict.fromkeys(g for gear_mesh in gear_meshes for g in gear_mesh.gears if is_internal(g))
    )
    pairs = [(g, gear_mesh.mate(g)) for gear_mesh in gear_meshes for g in gear_mesh.gears]
    planets = list(dict.fromkeys(mate for g, mate in pairs if g in rings))
    suns = list(dict.fromkeys(mate for g, mate in pairs if g in planets and mate not in rings))
    if not rings or not planets or not suns:
        lacks = "ring" if not rings else "sun"
        raise Unfit(f"it has no gear mesh of planets with a {lacks}")
    if any(gear in planets for gear in suns):
        raise Unfit("its planets mesh with one another")
    if any(
        g not in rings and g not in planets and g not in suns for m in gear_meshes for g in m.gears
    ):
        raise Unfit("some of its gears mesh with neither sun nor ring")
    if any(not any(m.mate(p) in suns for m in gear_meshes if p in m.gears) for p in planets):
        raise Unfit("its planets have one gear for the sun and another for the ring")
    by_shaft = defaultdict(list)
    for planet in planets:
        by_shaft[assembly.body(planet)].append(planet)
    counts = {len(gears) for gears in by_shaft.values()}
    if counts not in ({1}, {2}) or {len(rings), len(suns)} - counts:
        raise Unfit(f"it has {len(suns)} suns, {len(rings)} rings and planets of {counts} gears")
    twins = [_along(gears, assembly) for gears in by_shaft.values()]
    halves = {
        "sun": [[gear] for gear in _along(suns, assembly)],
        "planet": [[gears[k] for gears in twins] for k in range(max(counts))],
        "ring": [[gear] for gear in _along(rings, assembly)],
    }
    if max(counts) == 2 and not _opposite(halves["planet"][0][0], halves["planet"][1][0]):
        raise Unfit("its planets have two gears that are no halves of a double helix")
    for relation in assembly.document.related("planet_shaft", "central_shaft"):
        relation.used |= relation.refs.get("planetary_stage") == planetary.id
    return RexsStage(
        planetary,
        "planetary",
        halves,
        {
            "sun": [m for m in gear_meshes if any(g in suns for g in m.gears)],
            "ring": [m for m in gear_meshes if any(g in rings for g in m.gears)],
        },
        carrier_parts(assembly.document, planetary),
    )


def _halves_of_pairs(group: list[RexsGearMesh]) -> list[list[RexsGearMesh]]:
    """Gear meshes of the same two bodies: those of opposite hand belong together."""
    rest, halves = list(group), []
    while rest:
        gear_mesh = rest.pop(0)
        mate = next((m for m in rest if _opposite(gear_mesh.gears[0], m.gears[0])), None)
        if mate is not None:
            rest.remove(mate)
        halves.append([gear_mesh] if mate is None else [gear_mesh, mate])
    return halves


def _parallel(gear_meshes: list[RexsGearMesh], assembly: Assembly) -> RexsStage:
    if any(is_internal(gear) for gear_mesh in gear_meshes for gear in gear_mesh.gears):
        raise Unfit("an internal gear pair with fixed axes")
    first, second = ([gear_mesh.gears[k] for gear_mesh in gear_meshes] for k in (0, 1))
    teeth = [number(gears, "number_of_teeth", "none") for gears in (first, second)]
    if None not in teeth and teeth[0].value > teeth[1].value:  # type: ignore[union-attr]
        first, second = second, first
    return RexsStage(
        gear_meshes[0].stage,
        "parallel",
        {
            "pinion": [[gear] for gear in _along(first, assembly)],
            "gear": [[gear] for gear in _along(second, assembly)],
        },
        {"sun": gear_meshes},
    )


def _opposite(first: Component, second: Component) -> bool:
    """Whether two gears are halves of a double helix."""
    same = all(
        value(first, key, unit) == value(second, key, unit)
        for key, unit in (("number_of_teeth", "none"), ("normal_module", "mm"))
    )
    helix = [value(gear, "helix_angle_reference_diameter", "deg") for gear in (first, second)]
    return same and helix[0] != 0 and helix[0] == -helix[1]


def _along(gears: list[Component], assembly: Assembly) -> list[Component]:
    """Gears of a shaft from −u to +u of the gear unit, as they stand where that is not said."""
    return sorted(
        gears,
        key=lambda g: assembly.frames.sense(g) * value(g, "u_coordinate_on_shaft", "mm"),
    )


ROLES = {"planetary": ("sun", "ring", "carrier"), "parallel": ("pinion", "gear")}


@dataclass(eq=False)
class Member:
    """A member of a stage. anchor: a component of it; z: its place along the axis, mm."""

    stage: RexsStage
    stage_name: str
    role: str
    anchor: Component | None
    body: int | None
    z: float | None
    bearings: list[Component] = field(default_factory=list)
    couplings: list[Component] = field(default_factory=list)

    @property
    def name(self) -> str:
        """Name of the member in cases."""
        return f"{self.stage_name}.{self.role}"


def axial_place(assembly: Assembly, component: Component | None) -> float | None:
    """Place along the gear unit's u axis, mm."""
    if component is None:
        return None
    frame = assembly.frames.of(component)
    return None if frame is None else float(frame.origin[0])


def members_of(stages: dict[str, RexsStage], assembly: Assembly) -> list[Member]:
    """All members, stage by stage."""
    members = []
    for name, stage in stages.items():
        for role in ROLES[stage.kind]:
            parts = stage.carrier if role == "carrier" else stage.gears(role)
            anchor = parts[0] if parts else None
            at = [
                z for part in (stage.gears("planet") if role == "carrier" else parts)
                if (z := axial_place(assembly, part)) is not None
            ]  # fmt: skip
            body = None if anchor is None else assembly.body(anchor)
            members.append(
                Member(stage, name, role, anchor, body, sum(at) / len(at) if at else None)
            )
    return members


def assign_bearings(assembly: Assembly, members: list[Member]) -> list[str]:
    """Give each bearing and coupling to the casing to the nearest member that it carries. Returns
    in words those that carry no member."""
    by_body = defaultdict(list)
    for member in members:
        by_body[member.body].append(member)
    casing = {assembly.body(c) for c in assembly.document.kind("gear_casing")}
    planets = {
        assembly.body(p) for m in members if m.stage.kind == "planetary"
        for p in m.stage.gears("planet")
    }  # fmt: skip
    lost = []
    for relation, joint, ends in assembly.document.joints(*BEARINGS, *COUPLINGS):
        bodies = [assembly.body(end) for end in ends]
        if joint.kind in COUPLINGS:
            held = _nearest(assembly, joint, [m for m in members if m.body == bodies[0]])
            if (
                bodies[0] in casing
                and held is not None
                and any(end.kind == "gear_casing" for end in ends)
            ):
                held.couplings.append(joint)
            continue
        if planets & {*bodies}:
            continue  # a planet bearing, read with its stage
        carried = [m for body in bodies if body not in casing for m in by_body[body]]
        nearest = _nearest(assembly, joint, carried) if casing & {*bodies} else None
        if nearest is None:
            why = "between two bodies that turn" if not casing & {*bodies} else "carries no member"
            lost.append(f"{joint.label}: not carried over, {why}")
            continue
        nearest.bearings.append(joint)
        relation.used, joint.role = True, f"the support of {nearest.name}"
    return lost


def planet_bearings(assembly: Assembly, stage: RexsStage) -> list[list[Component]]:
    """Bearings of each planet."""
    bearings = []
    for planet in stage.halves["planet"][0]:
        mine, of_planet = assembly.body(planet), []
        for relation, joint, ends in assembly.document.joints(*BEARINGS):
            if mine in map(assembly.body, ends):
                relation.used, joint.role = True, "a planet bearing"
                of_planet.append(joint)
        bearings.append(of_planet)
    return bearings


def _nearest(assembly: Assembly, joint: Component, members: list[Member]) -> Member | None:
    if not members:
        return None
    place = axial_place(assembly, joint)
    if place is None:
        return members[0]
    return min(members, key=lambda m: abs(place - (place if m.z is None else m.z)))
