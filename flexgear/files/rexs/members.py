"""Members of the stages, where they sit along the axis, and which bearings carry them."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field

from flexgear.files.rexs.assembly import BEARINGS, COUPLINGS, Assembly
from flexgear.files.rexs.document import Component, Document
from flexgear.files.rexs.stages import RexsStage

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
        """As cases call it."""
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


def assign_bearings(document: Document, assembly: Assembly, members: list[Member]) -> list[str]:
    """Give each bearing and coupling to the casing to the nearest member of what it carries.

    Returns in words those that carry nothing of the case.
    """
    by_body = defaultdict(list)
    for member in members:
        by_body[member.body].append(member)
    casing = {assembly.body(c) for c in document.kind("gear_casing")}
    planets = {
        assembly.body(p) for m in members if m.stage.kind == "planetary"
        for p in m.stage.gears("planet")
    }  # fmt: skip
    lost = []
    for relation in document.related("side"):
        joint = document.at(relation, "assembly")
        ends = [document.at(relation, role) for role in ("inner_part", "outer_part")]
        if joint is None or joint.kind not in BEARINGS + COUPLINGS or None in ends:
            continue
        bodies = [assembly.body(end) for end in ends if end is not None]
        if joint.kind in COUPLINGS:
            held = _nearest(assembly, joint, [m for m in members if m.body == bodies[0]])
            if bodies[0] in casing and held is not None and _touches_casing(ends):
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


def planet_bearings(
    document: Document, assembly: Assembly, stage: RexsStage
) -> list[list[Component]]:
    """Bearings of each planet."""
    bearings = []
    for planet in stage.halves["planet"][0]:
        mine = assembly.body(planet)
        of_planet = []
        for relation in document.related("side"):
            joint = document.at(relation, "assembly")
            ends = [document.at(relation, role) for role in ("inner_part", "outer_part")]
            if joint is None or joint.kind not in BEARINGS or None in ends:
                continue
            if mine in [assembly.body(end) for end in ends if end is not None]:
                relation.used, joint.role = True, "a planet bearing"
                of_planet.append(joint)
        bearings.append(of_planet)
    return bearings


def _touches_casing(ends: list[Component | None]) -> bool:
    return any(end is not None and end.kind == "gear_casing" for end in ends)


def _nearest(assembly: Assembly, joint: Component, members: list[Member]) -> Member | None:
    if not members:
        return None
    place = axial_place(assembly, joint)
    if place is None:
        return members[0]
    return min(members, key=lambda m: abs(place - (place if m.z is None else m.z)))
