"""What grows while a train is put together, and the rows of its members' rotations."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from flexgear.coupling.assembly import Assembly
from flexgear.coupling.gear_meshes import GearMeshSet
from flexgear.coupling.members import Member
from flexgear.coupling.rotor_terms import gear_axes
from flexgear.coupling.system import StageFrame
from flexgear.gears.power_flow import PowerFlow
from flexgear.model.case import Case
from flexgear.structures.kinematics import turn

Array = NDArray[np.float64]


@dataclass
class UnderWay:
    """What grows while a train is put together.

    members: stage by stage; bending: see ``stage_sets``; blocks: nodes (6, d) of gear meshes;
    block_of: by body the block of its gear, of the first tooth of an FE ring.
    """

    case: Case
    flow: PowerFlow
    a: Assembly
    members: list[list[Member]]
    bending: bool = True
    frames: list[StageFrame] = field(default_factory=list)
    angles: list[Array] = field(default_factory=list)
    blocks: list[Array] = field(default_factory=list)
    block_of: dict[str, int] = field(default_factory=dict)
    sets: list[GearMeshSet] = field(default_factory=list)

    def angle(self, row: Array) -> int:
        """Number of an angle, entered if it is new."""
        for k, known in enumerate(self.angles):
            if np.array_equal(known, row):
                return k
        self.angles.append(row)
        return len(self.angles) - 1

    def body_angle(self, stage: int, m: Member) -> int:
        """By which angle a body's frame has turned, −1 where it stands: an FE ring and its hub are
        in the ring's frame, all else in the carrier's."""
        frame = self.frames[stage]
        return frame.ring if m.part == "hub" or m.teeth else frame.carrier


def ends_of(b: UnderWay, member: str) -> list[tuple[str, str]]:
    """Bodies and nodes at which a member meets the rest of the train, with equal shares: the hub
    of an FE ring that turns, both halves of a double-helical ring; none of an FE ring that is held.
    """
    name, _, part = member.partition(".")
    stage = b.case.stage(name)
    form = stage.form(part)
    if form == "beam":
        behind = b.a.has(f"{name}.output")
        end = ("output", f"{name}.output") if behind else ("shaft", "end")
        return [(f"{name}.{end[0]}", end[1])]
    if form == "fe" and part == "ring":
        return [(f"{name}.hub", f"{name}.hub")] if b.a.has(f"{name}.hub") else []
    if form == "fe":
        return [(member, "drive")]
    if part == "ring" and stage.double_helical:
        return [(f"{member}_{side}", f"{member}_{side}") for side in ("left", "right")]
    return [(member, member)]


def end_rows(b: UnderWay, member: str) -> Array:
    """Motion (6, d) of a member where it meets the rest of the train, in its stage's axes; zero of
    a held FE ring."""
    name, _, part = member.partition(".")
    ends, stage = ends_of(b, member), b.case.stage(name)
    rows = np.zeros((6, b.a.size))
    for end in ends:
        rows += b.a.rows(*end) / len(ends)
    return turn(gear_axes(stage)) @ rows if part == "gear" else rows


def rotation(b: UnderWay, member: str) -> Array:
    """Row (d,) of the rotation of a member; zero where it is held fast."""
    return np.asarray(end_rows(b, member)[5])


def speed_row(b: UnderWay, member: str) -> Array:
    """Row (d,) of the rotation that stands for a member's speed: pins of an FE carrier."""
    name, _, part = member.partition(".")
    frame = b.frames[b.case.stage_index(name)]
    if part == "carrier" and b.case.stage(name).form("carrier") == "fe" and frame.carrier >= 0:
        return b.angles[frame.carrier]
    return rotation(b, member)
