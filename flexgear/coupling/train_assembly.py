"""Parts of a train while it is assembled, and rows of its members' rotations."""

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
from flexgear.model.names import SIDES, BodyName, MemberName
from flexgear.structures.kinematics import turn

Array = NDArray[np.float64]


@dataclass
class TrainAssembly:
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


def ends_of(b: TrainAssembly, member: str) -> list[tuple[BodyName, str]]:
    """Bodies and nodes at which a member meets the rest of the train, with equal shares: the hub
    of an FE ring that turns, both halves of a double-helical ring; none of an FE ring that is held.
    """
    at = MemberName.parse(member)
    stage, body = b.case.stage(at.stage), BodyName.of(at.stage, at.part)
    form = stage.form(at.part)
    if form == "beam":
        output, shaft = (BodyName.of(at.stage, part) for part in ("output", "shaft"))
        return [(output, output) if b.a.has(output) else (shaft, "end")]
    if form == "fe" and at.part == "ring":
        hub = BodyName.of(at.stage, "hub")
        return [(hub, hub)] if b.a.has(hub) else []
    if form == "fe":
        return [(body, "drive")]
    if at.part == "ring" and stage.double_helical:
        halves = [BodyName.of(at.stage, at.part, side=side) for side in SIDES]
        return [(half, half) for half in halves]
    return [(body, body)]


def end_rows(b: TrainAssembly, member: str) -> Array:
    """Motion (6, d) of a member where it meets the rest of the train, in its stage's axes; zero of
    a held FE ring."""
    at = MemberName.parse(member)
    ends, stage = ends_of(b, member), b.case.stage(at.stage)
    rows = np.zeros((6, b.a.size))
    for end in ends:
        rows += b.a.rows(*end) / len(ends)
    return turn(gear_axes(stage)) @ rows if at.part == "gear" else rows


def rotation(b: TrainAssembly, member: str) -> Array:
    """Row (d,) of the rotation of a member; zero where it is held fast."""
    return np.asarray(end_rows(b, member)[5])


def speed_row(b: TrainAssembly, member: str) -> Array:
    """Row (d,) of the rotation that stands for a member's speed: pins of an FE carrier."""
    at = MemberName.parse(member)
    frame, fe = b.frames[b.case.stage_index(member)], b.case.stage(at.stage).form(at.part) == "fe"
    if at.part == "carrier" and fe and frame.carrier >= 0:
        return b.angles[frame.carrier]
    return rotation(b, member)
