"""Parts of a train while it is assembled, and rows of its members' rotations."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from flexgear.coupling.assembly import Assembly
from flexgear.coupling.bearings import own_law
from flexgear.coupling.connections import Connection
from flexgear.coupling.gear_meshes import GearMeshSet
from flexgear.coupling.members import Member
from flexgear.coupling.system import StageFrame
from flexgear.gears.power_flow import PowerFlow
from flexgear.model.case import Case
from flexgear.model.names import BodyName, MemberName
from flexgear.structures.kinematics import rigid_rows, turn

Array = NDArray[np.float64]


@dataclass
class TrainAssembly:
    """What grows while a train is put together.

    members: stage by stage; bending: see ``stage_sets``; blocks: nodes (6, d) of gear meshes;
    block_of: by body the block of its gear, or of its first tooth.
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
        for k, angle_row in enumerate(self.angles):
            if np.array_equal(angle_row, row):
                return k
        self.angles.append(row)
        return len(self.angles) - 1

    def body_angle(self, stage: int, m: Member) -> int:
        """By which angle a body's frame has turned, −1 where it stands."""
        return int(getattr(self.frames[stage], m.frame))

    @cached_property
    def member_of(self) -> dict[str, Member]:
        """Members of the train by the names of their bodies."""
        return {m.body.name: m for members in self.members for m in members}

    def bodies_of(self, member: str) -> list[Member]:
        """All bodies of a member, in the order of the stage."""
        at = MemberName.parse(member)
        members = self.members[self.case.stage_index(member)]
        return [m for m in members if m.part == at.part]

    def rows(self, body: str, port: str) -> Array:
        """Motion (6, d) of a port in its axes."""
        p = self.member_of[body].port(port)
        rows = self.a.rows(body, p.node)
        rows = turn(p.axes) @ rows if p.axes else rows
        return rigid_rows(np.array([p.arm, 0.0, 0.0])) @ rows if p.arm else rows

    def place(self, body: str, port: str) -> Array:
        """Position (3,) of a port's node in its body's frame, m."""
        return self.a.body(body).position(self.member_of[body].port(port).node)


def connect(b: TrainAssembly, stage: int, c: Connection) -> None:
    """Enter a spring between two bodies, or of one on the housing."""
    first, angle = b.rows(*c.first), int(getattr(b.frames[stage], c.frame)) if c.frame else -1
    if c.second is not None:
        second = b.rows(*c.second)
        if b.member_of[c.second[0]].port(c.second[1]).floats:
            apart, planets = first - b.rows(c.second[0], "gear"), b.frames[stage].planets
            b.a.turning_link(c.name, apart, second, c.matrix, planets)
            if c.bearing is not None:
                b.a.law_bearing(c.name, second, apart, c.bearing, planets)
            return
        if c.reaches:
            second = rigid_rows(b.place(*c.first), b.place(*c.second)) @ second
        b.a.link(c.name, turn(c.axes).T @ (first - second), c.matrix, c.kind)
        if c.bearing is not None:
            b.a.law_bearing(c.name, second, first, c.bearing)
        return
    if np.any(c.matrix):
        housing = b.a.housing_rows(c.name, b.place(*c.first))
        if angle >= 0:
            b.a.rotating_frame_support(c.name, c.key, (first, housing), c.matrix, angle)
        else:
            b.a.link(c.name, turn(c.axes).T @ (first - housing), c.matrix, c.kind)
    if c.bearing is not None and own_law(c.bearing) is not None:
        housing = b.a.housing_rows(c.name, b.place(*c.first))
        b.a.law_bearing(c.name, first, housing, c.bearing, angle)


def ends_of(b: TrainAssembly, member: str) -> list[BodyName]:
    """Bodies with which a member meets the rest of the train, with equal shares: the hub of an FE
    ring that turns, both halves of a double-helical ring; none of an FE ring that is held."""
    return [m.body.name for m in b.bodies_of(member) if "end" in m.ports]


def end_rows(b: TrainAssembly, member: str) -> Array:
    """Motion (6, d) of a member where it meets the rest of the train, in its stage's axes; zero of
    a held FE ring."""
    ends, rows = ends_of(b, member), np.zeros((6, b.a.size))
    for end in ends:
        rows += b.rows(end, "end") / len(ends)
    return rows


def rotation(b: TrainAssembly, member: str) -> Array:
    """Row (d,) of the rotation of a member; zero where it is held fast."""
    return np.asarray(end_rows(b, member)[5])


def speed_row(b: TrainAssembly, member: str) -> Array:
    """Row (d,) of the rotation that stands for a member's speed: pins of an FE carrier."""
    frame = b.frames[b.case.stage_index(member)]
    if MemberName.parse(member).part == "carrier" and frame.carrier >= 0:
        return b.angles[frame.carrier]
    return rotation(b, member)
