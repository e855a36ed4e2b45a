"""Forces on a train beside its ports: weight, given loads, and those of frames that turn."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexgear.coupling.gear_meshes import GivenLoad
from flexgear.coupling.lumped_stage import frame_matrices, orbit_force, planet_axes
from flexgear.coupling.under_way import UnderWay, end_of
from flexgear.gears.radii import stage_radii
from flexgear.model.errors import FlexgearError, InputError
from flexgear.structures.kinematics import turn

Array = NDArray[np.float64]


def given_loads(b: UnderWay) -> list[GivenLoad]:
    """Forces given from outside."""
    out: list[GivenLoad] = []
    gravity = np.array(b.train.gravity)
    place: dict[str, tuple[int, int]] = {}
    for number, stage in enumerate(b.train.stages):
        frame = b.frames[number]
        if stage.is_flexible:
            place |= {
                f"{stage.name}.{part}": (_node(b, *end_of(b, stage.name, part)), frame.carrier)
                for part in ("carrier", "sun")
                if any(f"{stage.name}.{part}" == load.member for load in b.train.loads)
            }
            if gravity.any():
                out += _weights(b, number, gravity)
        speed = b.flow.speed.get(f"{stage.name}.carrier", 0.0)
        radius = stage_radii(b.train.view(stage.name)).center_distance
        for m in b.members[number]:
            block = _block(b, m.body.name)
            place[m.body.name] = (block, frame.carrier)
            if gravity.any():
                weight = turn(-planet_axes(stage, m)) @ np.r_[m.mass * gravity, 0, 0, 0]
                out.append(GivenLoad(block, weight, frame.carrier))
            if b.train.gyroscopic and m.part == "planet":
                force = orbit_force(stage, m, radius, speed)
                out.append(GivenLoad(block, force, grows=1))
    if gravity.any() and b.a.has("housing"):
        node = len(b.blocks) + b.a.contact_node(b.a.weight_rows("housing"), -1)
        out.append(GivenLoad(node, np.r_[gravity, 0, 0, 0]))
    for k, load in enumerate(b.train.loads):
        vector = np.r_[load.force, load.moment]
        if load.member not in place:
            raise InputError(
                b.train.source, f"loads[{k}].member", f"{load.member} cannot be loaded",
                f"name one of {', '.join(sorted(place))}",
            )  # fmt: skip
        block, angle = place[load.member]
        out.append(GivenLoad(block, vector, angle if load.frame == "fixed" else -1))
    return out


def _weights(b: UnderWay, number: int, gravity: Array) -> list[GivenLoad]:
    """Weight of all bodies of a flexible stage, through all their mass: of a reduced body Rᵀ M g on
    every coordinate. In bodies whose frame follows the carrier gravity turns backwards."""
    stage, out = b.train.stages[number], list[GivenLoad]()
    case = b.train.flexible_stages[stage.name]
    for body in b.a.bodies:
        owner, _, part = body.name.partition(".")
        if owner != stage.name:
            continue
        axes = 0.0
        if part.startswith("planet_"):
            axes = case.stage.planet_angles[int(part.removeprefix("planet_")) - 1]
        block = len(b.blocks) + b.a.contact_node(b.a.weight_rows(body.name), -1)
        angle = -1 if part == "ring" else b.frames[number].carrier
        out.append(GivenLoad(block, turn(-axes) @ np.r_[gravity, 0, 0, 0], angle))
    return out


def _node(b: UnderWay, body: str, node: str) -> int:
    """Block of a node of a flexible stage, made for a load there."""
    return len(b.blocks) + b.a.contact_node(b.a.rows(body, node), -1)


def _block(b: UnderWay, body: str) -> int:
    """Number of the block of a lumped body, which has one."""
    at = 0
    for stage, members in zip(b.train.stages, b.members, strict=True):
        names = [m.body.name for m in members]
        if body in names:
            return at + names.index(body)
        at += len(members) if not stage.is_flexible else _nodes(b, stage.name)
    raise FlexgearError(f"there is no body {body!r} in the train")


def _nodes(b: UnderWay, stage: str) -> int:
    case = b.train.stage(stage)
    assert case.ring is not None
    return case.ring.teeth + case.planets + 1


def frame_forces(b: UnderWay, rolling: Array, masters: Array) -> tuple[Array | None, Array | None]:
    """Gyroscopic and centripetal matrices (d, d) of the lumped bodies at rated speed.

    Coordinates hold the rolling motion, which the frame follows: only what is left of a motion,
    (I − rolling masters) q, makes forces of the frame, and these leave the rolling alone.
    """
    if not b.train.gyroscopic:
        return None, None
    turning, centripetal = np.zeros_like(b.a.mass), np.zeros_like(b.a.mass)
    for number, stage in enumerate(b.train.stages):
        flow = b.flow.stage(stage.name)
        frame = b.flow.speed.get(f"{stage.name}.carrier", 0.0)
        for m in b.members[number]:
            spin = (
                flow.planet_speed if m.part == "planet" else b.flow.speed[f"{stage.name}.{m.part}"]
            )
            at = b.a.slice_of(m.body.name)
            turning[at, at], centripetal[at, at] = frame_matrices(m, frame, spin)
    rest = np.eye(b.a.size) - rolling @ masters
    return rest.T @ turning @ rest, rest.T @ centripetal @ rest
