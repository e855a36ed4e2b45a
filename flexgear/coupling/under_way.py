"""What grows while a train is put together, and the rows of its members' rotations."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from flexgear.coupling.assembly import Assembly
from flexgear.coupling.gear_meshes import GearMeshSet
from flexgear.coupling.lumped_bodies import LumpedMember
from flexgear.coupling.lumped_stage import StageFrame
from flexgear.gears.power_flow import PowerFlow
from flexgear.model.case import Case

Array = NDArray[np.float64]


@dataclass
class UnderWay:
    """What grows while a train is put together."""

    train: Case
    flow: PowerFlow
    a: Assembly
    members: list[list[LumpedMember]]
    frames: list[StageFrame] = field(default_factory=list)
    angles: list[Array] = field(default_factory=list)
    blocks: list[Array] = field(default_factory=list)
    sets: list[GearMeshSet] = field(default_factory=list)

    def angle(self, row: Array) -> int:
        """Number of an angle, entered if it is new."""
        for k, known in enumerate(self.angles):
            if np.array_equal(known, row):
                return k
        self.angles.append(row)
        return len(self.angles) - 1


def rotation(b: UnderWay, member: str) -> Array:
    """Row (d,) of the rotation of a member; zero where it is held fast."""
    name, _, part = member.partition(".")
    stage = b.train.stage(name)
    if not stage.is_flexible:
        if part == "ring" and stage.double_helical:
            halves = [f"{member}_{side}" for side in ("left", "right")]
            return 0.5 * np.sum([b.a.rows(h, h)[5] for h in halves], axis=0)
        return b.a.rows(member, member)[5]
    if part == "ring":
        return np.zeros(b.a.size)
    return b.a.rows(*end_of(b, name, part))[5]


def speed_row(b: UnderWay, member: str) -> Array:
    """Row (d,) of the rotation that stands for a member's speed: pins of a flexible carrier."""
    name, _, part = member.partition(".")
    frame = b.frames[b.train.stage_index(name)]
    if part == "carrier" and b.train.stage(name).is_flexible:
        return b.angles[frame.theta]
    return rotation(b, member)


def end_of(b: UnderWay, name: str, part: str) -> tuple[str, str]:
    """Body and node at which carrier or sun of a flexible stage meets the rest of the train."""
    if part == "carrier":
        return f"{name}.carrier", "drive"
    if b.a.has(f"{name}.output"):
        return f"{name}.output", "output"
    return f"{name}.shaft", "end"
