"""Stages of a REXS model, their gears and members, and the bearings of these.

A gear mesh is a cylindrical_stage with two gears. A planetary stage contains the gear meshes of its
planets with sun and ring: the ring is the internal gear, planets mesh with the ring, suns with the
planets. Double-helical stages have two gears of opposite hand on each shaft.
"""

from collections import defaultdict
from dataclasses import dataclass, field

from flexgear.files.rexs.assembly import BEARINGS, COUPLINGS, Assembly, carrier_parts
from flexgear.files.rexs.document import Component, Document, mark, number, value

GEARS = ("cylindrical_gear", "ring_gear")


@dataclass(frozen=True)
class RexsGearMesh:
    """A gear mesh: its cylindrical_stage and the gears gear_1 and gear_2."""

    stage: Component
    gears: tuple[Component, Component]

    def mate(self, gear: Component) -> Component:
        """The other gear."""
        return self.gears[1] if self.gears[0] is gear else self.gears[0]


@dataclass
class RexsStage:
    """A stage with its gears by role: "sun", "planet", "ring", or "pinion", "gear".

    halves: by role, the gears (of planets several) of each half, left (−u) half first; one half
    unless double-helical. gear_meshes: by "sun" and "ring", of a parallel stage by "sun" only.
    planet_bearings: those of each planet.
    """

    component: Component
    kind: str
    halves: dict[str, list[list[Component]]]
    gear_meshes: dict[str, list[RexsGearMesh]]
    carrier: list[Component] = field(default_factory=list)
    planet_bearings: list[list[Component]] = field(default_factory=list)

    def gears(self, role: str) -> list[Component]:
        """All gears of a role, first those of the left half."""
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
        return [m.stage for gear_meshes in self.gear_meshes.values() for m in gear_meshes]


class UnsupportedError(Exception):
    """A stage that a case cannot represent; its text is the reason."""


def is_internal(gear: Component) -> bool:
    """Whether a gear is internal, by its type or by a negative number of teeth."""
    teeth = number([gear], "number_of_teeth", "none")
    return gear.kind == "ring_gear" or (teeth is not None and teeth.value < 0)


def is_helical(stage: RexsStage) -> bool:
    """Whether the gears of a stage have a helix angle."""
    datum = number(stage.all_gears, "helix_angle_reference_diameter", "deg")
    return datum is not None and datum.value != 0


def stages_of(assembly: Assembly) -> tuple[list[RexsStage], list[str]]:
    """All stages in the order of their ids; descriptions of those that cannot be carried over."""
    gear_meshes, refused = _gear_meshes(assembly.document), []
    stages, inside = [], set()
    for planetary in assembly.document.kind("planetary_stage"):
        inner = {s.id for s in assembly.document.parts(planetary, "cylindrical_stage")}
        of_stage = [gear_mesh for gear_mesh in gear_meshes if gear_mesh.stage.id in inner]
        inside |= inner
        try:
            stages.append(_planetary(assembly, planetary, of_stage))
        except UnsupportedError as why:
            refused.append(f"{planetary.label}: not carried over, {why}")
    groups = defaultdict(list)
    for gear_mesh in gear_meshes:
        if gear_mesh.stage.id not in inside:
            bodies = tuple(assembly.body(g) for g in gear_mesh.gears)
            groups[frozenset(bodies)].append(gear_mesh)
    for group in groups.values():
        for pair in _by_stage(group):
            try:
                stages.append(_parallel(pair, assembly))
            except UnsupportedError as why:
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
        mark(stage.gears(role), role)
    mark(stage.pairs, "a gear mesh")
    mark(stage.carrier, "the carrier")


def _planetary(
    assembly: Assembly, planetary: Component, gear_meshes: list[RexsGearMesh]
) -> RexsStage:
    mates: dict[Component, list[Component]] = defaultdict(list)
    for gear_mesh in gear_meshes:
        for gear in gear_mesh.gears:
            mates[gear].append(gear_mesh.mate(gear))
    rings = [gear for gear in mates if is_internal(gear)]
    planets = list(dict.fromkeys(mate for ring in rings for mate in mates[ring]))
    suns = list(dict.fromkeys(m for planet in planets for m in mates[planet] if m not in rings))
    if not rings or not planets or not suns:
        lacks = "ring" if not rings else "sun"
        raise UnsupportedError(f"it has no gear mesh of planets with a {lacks}")
    if {*planets} & {*suns}:
        raise UnsupportedError("its planets mesh with one another")
    if mates.keys() - {*rings, *planets, *suns}:
        raise UnsupportedError("some of its gears mesh with neither sun nor ring")
    if not all({*mates[planet]} & {*suns} for planet in planets):
        raise UnsupportedError("its planets have one gear for the sun and another for the ring")
    by_shaft = defaultdict(list)
    for planet in planets:
        by_shaft[assembly.body(planet)].append(planet)
    counts = {len(gears) for gears in by_shaft.values()}
    if counts not in ({1}, {2}) or {len(rings), len(suns)} - counts:
        raise UnsupportedError(
            f"it has {len(suns)} suns, {len(rings)} rings and planets of {counts} gears"
        )
    planet_gears = [_sorted_along_axis(gears, assembly) for gears in by_shaft.values()]
    halves = {
        "sun": [[gear] for gear in _sorted_along_axis(suns, assembly)],
        "planet": [[gears[k] for gears in planet_gears] for k in range(max(counts))],
        "ring": [[gear] for gear in _sorted_along_axis(rings, assembly)],
    }
    if max(counts) == 2 and not _opposite(halves["planet"][0][0], halves["planet"][1][0]):
        raise UnsupportedError("its planets have two gears that are not halves of a double helix")
    for relation in assembly.document.related("planet_shaft", "central_shaft"):
        relation.used |= relation.refs.get("planetary_stage") == planetary.id
    of_role = {
        role: [m for m in gear_meshes if {*m.gears} & {*gears}]
        for role, gears in (("sun", suns), ("ring", rings))
    }
    carrier = carrier_parts(assembly.document, planetary)
    return RexsStage(planetary, "planetary", halves, of_role, carrier)


def _by_stage(group: list[RexsGearMesh]) -> list[list[RexsGearMesh]]:
    """The gear meshes of two bodies, grouped by stage: two of opposite hand form one stage."""
    rest, stages = list(group), []
    while rest:
        gear_mesh = rest.pop(0)
        other = next((m for m in rest if _opposite(gear_mesh.gears[0], m.gears[0])), None)
        if other is not None:
            rest.remove(other)
        stages.append([gear_mesh] if other is None else [gear_mesh, other])
    return stages


def _parallel(gear_meshes: list[RexsGearMesh], assembly: Assembly) -> RexsStage:
    if any(is_internal(gear) for gear_mesh in gear_meshes for gear in gear_mesh.gears):
        raise UnsupportedError("an internal gear pair with fixed axes")
    first, second = ([gear_mesh.gears[k] for gear_mesh in gear_meshes] for k in (0, 1))
    if value(first[0], "number_of_teeth", "none") > value(second[0], "number_of_teeth", "none"):
        first, second = second, first
    halves = {
        role: [[gear] for gear in _sorted_along_axis(gears, assembly)]
        for role, gears in (("pinion", first), ("gear", second))
    }
    return RexsStage(gear_meshes[0].stage, "parallel", halves, {"sun": gear_meshes})


def _opposite(first: Component, second: Component) -> bool:
    """Whether two gears are halves of a double helix: equal but for the sign of the helix angle."""
    same = all(
        value(first, key, unit) == value(second, key, unit)
        for key, unit in (("number_of_teeth", "none"), ("normal_module", "mm"))
    )
    helix = [value(gear, "helix_angle_reference_diameter", "deg") for gear in (first, second)]
    return same and helix[0] != 0 and helix[0] == -helix[1]


def _sorted_along_axis(gears: list[Component], assembly: Assembly) -> list[Component]:
    """Gears of a shaft sorted from −u to +u of the gear unit."""
    return sorted(
        gears,
        key=lambda g: assembly.frames.sense(g) * value(g, "u_coordinate_on_shaft", "mm"),
    )


ROLES = {"planetary": ("sun", "ring", "carrier"), "parallel": ("pinion", "gear")}


@dataclass(eq=False)
class Member:
    """A member of a stage.

    anchor: one of its components, None if the file has none. body: number of its body. z: axial
    position, mm, None if unknown. bearings, couplings: those between member and casing.
    """

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
    """Position of a component along the gear unit's u axis, mm, None if unknown."""
    if component is None:
        return None
    frame = assembly.frames.of(component)
    return None if frame is None else float(frame.origin[0])


def members_of(stages: dict[str, RexsStage], assembly: Assembly) -> list[Member]:
    """The members of all stages, by name of the stage."""
    members = []
    for name, stage in stages.items():
        for role in ROLES[stage.kind]:
            parts = stage.carrier if role == "carrier" else stage.gears(role)
            anchor = parts[0] if parts else None
            gears = stage.gears("planet") if role == "carrier" else parts
            positions = [z for gear in gears if (z := axial_place(assembly, gear)) is not None]
            body = None if anchor is None else assembly.body(anchor)
            z = sum(positions) / len(positions) if positions else None
            members.append(Member(stage, name, role, anchor, body, z))
    return members


def assign_bearings(assembly: Assembly, members: list[Member]) -> list[str]:
    """Assign bearings and couplings to the casing to the nearest member of the body they support,
    and bearings of planets to their stage. Returns descriptions of the bearings that are not
    carried over."""
    by_body = defaultdict(list)
    for member in members:
        by_body[member.body].append(member)
    casing = assembly.casings
    of_planet: dict[int, list[Component]] = {}
    for stage in (m.stage for m in members if m.role == "carrier"):
        bodies_of_planets = map(assembly.body, stage.halves["planet"][0])
        stage.planet_bearings = [of_planet.setdefault(body, []) for body in bodies_of_planets]
    lost = []
    for relation, joint, ends in assembly.document.joints(*BEARINGS, *COUPLINGS):
        bodies = [assembly.body(end) for end in ends]
        if joint.kind in COUPLINGS:
            held = _nearest(assembly, joint, [m for m in members if m.body == bodies[0]])
            to_casing = bodies[0] in casing and any(end.kind == "gear_casing" for end in ends)
            if held is not None and to_casing:
                held.couplings.append(joint)
            continue
        planet = next((body for body in bodies if body in of_planet), None)
        if planet is not None:
            of_planet[planet].append(joint)
            relation.used, joint.role = True, "a planet bearing"
            continue
        supported = [m for body in bodies if body not in casing for m in by_body[body]]
        nearest = _nearest(assembly, joint, supported) if casing & {*bodies} else None
        if nearest is None:
            rotating = not casing & {*bodies}
            why = "between two rotating bodies" if rotating else "supports no member"
            lost.append(f"{joint.label}: not carried over, {why}")
            continue
        nearest.bearings.append(joint)
        relation.used, joint.role = True, f"the support of {nearest.name}"
    return lost


def _nearest(assembly: Assembly, joint: Component, members: list[Member]) -> Member | None:
    """The member nearest to a joint along the axis, the first if the joint has no position."""
    if not members:
        return None
    place = axial_place(assembly, joint)
    if place is None:
        return members[0]
    return min(members, key=lambda m: abs(place - (place if m.z is None else m.z)))
