"""Speeds, torques and powers of any case, from one linear system and its transpose.

Branch powers are a flow between shafts (members joined to each other) and stages. Where a train
branches and closes again, the flow may hold a directed cycle: a shaft or stage passes power on
that comes back to it. *Circulating power* is what such cycles carry: each directed cycle is cut by
its smallest branch until none is left, and the cut is what circulates. Without a closed loop, or
where the parallel branches all lead from input to output (power split), it is zero. For one loop
the value is unique; for loops that share branches, cycles with fewest branches are cut first.

With the ties G of all members' speeds (members) and the rows S that pick the ports of given
speed, the speeds are

    [G; S] ω = [0; ω_given] .

Ties do no work, so their torques on the members are Gᵀ λ, and with the ports of unknown torque (U)

    [Gᵀ  Uᵀ] [λ; T_unknown] = −T_given − T_loads .

Both are square where M = members − ties speeds and ports − M torques are given. λ of a stage is the
torque in its teeth referred to the sun, λ of a joint what passes through it, λ of a held member
what holds it. Power then balances for every stage, shaft and the whole train.

Speeds and mean forces of one stage, from the speeds and torques of its members.

All forces follow from the torques T that the rest of the train puts on the members; N planets, S
sides (two if double-helical), base radii r_b, base helix angle β_b, working angles α, positive
where the flanks carry that carry when the carrier drives (docs/conventions.md):

    normal      F_s = −T_s/(N S r_b,s cos β_b),  F_r = −T_r/(N S r_b,r cos β_b)
    tangential  on a working circle F cos β_b cos α; on the sun's reference circle −T_s/(N S r_s)
    bearing     tangential S cos β_b (F_s cos α_s + F_r cos α_r) = T_c/(N R_c), radial
                S cos β_b (|F_s| sin α_s − |F_r| sin α_r); axial forces cancel on a planet
    planet      ω_p − ω_c = −(r_b,r/r_b,p)(ω_c − ω_r); gear-mesh frequency z_r |ω_c − ω_r| / 2π

Rolling power T_s (ω_s − ω_c) is what the teeth pass from sun to ring as seen from the carrier: the
part that makes losses; the rest of a member's power turns with the carrier as a coupling does.
Weight and centrifugal force of planets are left out. A parallel stage has its pinion in the place
of the sun, its gear in that of the planet, and a carrier at rest; its forces have the other sign,
F = T_pinion/(S r_b cos β_b), positive where the gear drives.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from flexgear.arrays import Array
from flexgear.gears.determinacy import (
    Members,
    members_of,
    rank,
    require_free_ties,
    require_speeds,
    require_torques,
)
from flexgear.gears.radii import stage_radii

if TYPE_CHECKING:
    from flexgear.model.case import Case
    from flexgear.model.stage import Stage
    from flexgear.model.stage_view import StageView


@dataclass(frozen=True)
class StageFlow:
    """Speeds rad/s, frequency Hz, torques N m, forces N, powers W of one stage.

    sun_speed, …_torque, by the rest of the train on the member: a pinion's is the sun's, a gear's
    the planet's; planet_speed:
    absolute; planet_relative_speed: to the carrier. tangential_force (on the sun's reference
    circle), sun_working_force, ring_working_force (tangential on the working circles), and
    sun_gear_mesh_force, ring_gear_mesh_force (normal, along the 3D line of action) are of one
    planet and side; planet_bearing_… of one planet: radial outward on the planet by its teeth,
    tangential against the sense of rotation. stage_power: rolling power, > 0 from sun to ring.
    circulating_power: part of the stage's power that runs round a closed loop of the train.
    """

    name: str
    kind: str
    sun_speed: float
    ring_speed: float
    carrier_speed: float
    sun_torque: float
    ring_torque: float
    carrier_torque: float
    planet_torque: float
    planet_speed: float
    planet_relative_speed: float
    gear_mesh_frequency: float
    tangential_force: float
    sun_working_force: float
    ring_working_force: float
    sun_gear_mesh_force: float
    ring_gear_mesh_force: float
    planet_bearing_radial: float
    planet_bearing_tangential: float
    stage_power: float
    circulating_power: float

    @property
    def gear_mesh_forces(self) -> dict[str, float]:
        """Normal force of one gear mesh of "sun" and "ring", N; no ring in a parallel stage: 0."""
        return {"sun": self.sun_gear_mesh_force, "ring": self.ring_gear_mesh_force}

    @property
    def planet_bearing_force(self) -> float:
        """Magnitude of the in-plane force on a planet's bearing, N."""
        return math.hypot(self.planet_bearing_radial, self.planet_bearing_tangential)


def stage_flow(
    view: StageView,
    speed: dict[str, float],
    torque: dict[str, float],
    circulating: float = 0.0,
) -> StageFlow:
    """Flow of a stage; speed and torque by part ("sun", "ring", "carrier" / "pinion", "gear").

    speed rad/s, torque N m by the rest of the train on the member; circulating W.
    """
    stage, radii = view.stage, stage_radii(view)
    first = view.part("sun")
    carrier_speed = speed.get("carrier", 0.0)
    if stage.kind == "parallel":
        relative = speed["gear"]
    else:
        relative = -(radii.base["ring"] / radii.base["planet"]) * (carrier_speed - speed["ring"])
    sides = 2 if stage.double_helical else 1
    paths = stage.planets * sides
    # pinion and gear of a parallel stage turn against each other, planet and sun's torques don't
    sign = 1.0 if stage.kind == "parallel" else -1.0
    in_plane = {"sun": sign * torque[first] / (paths * radii.base["sun"])}
    if "ring" in torque:
        in_plane["ring"] = -torque["ring"] / (paths * radii.base["ring"])
    cos_bb = math.cos(radii.base_helix_angle)
    working = {r: f * math.cos(radii.working_angles[r]) for r, f in in_plane.items()}
    # teeth push apart, whichever flanks carry
    radial = {r: abs(f) * math.sin(radii.working_angles[r]) for r, f in in_plane.items()}
    return StageFlow(
        name=stage.name,
        kind=stage.kind,
        sun_speed=speed[first],
        ring_speed=speed.get("ring", 0.0),
        carrier_speed=carrier_speed,
        sun_torque=torque[first],
        ring_torque=torque.get("ring", 0.0),
        carrier_torque=torque.get("carrier", 0.0),
        planet_torque=torque.get("gear", 0.0),
        planet_speed=carrier_speed + relative,
        planet_relative_speed=relative,
        gear_mesh_frequency=_gear_mesh_frequency(stage, speed),
        tangential_force=sign * torque[first] / (paths * radii.reference["sun"]),
        sun_working_force=working["sun"],
        ring_working_force=working.get("ring", 0.0),
        sun_gear_mesh_force=in_plane["sun"] / cos_bb,
        ring_gear_mesh_force=in_plane.get("ring", 0.0) / cos_bb,
        planet_bearing_radial=sides * (radial["sun"] - radial.get("ring", 0.0)),
        planet_bearing_tangential=sides * sum(working.values()),
        stage_power=torque[first] * (speed[first] - carrier_speed),
        circulating_power=circulating,
    )


def _gear_mesh_frequency(stage: Stage, speed: dict[str, float]) -> float:
    """Gear-mesh frequency, Hz."""
    if stage.pinion is not None:
        return abs(stage.pinion.teeth * speed["pinion"]) / (2 * math.pi)
    assert stage.ring is not None  # the model refuses a planetary stage without one
    return abs(stage.ring.teeth * (speed["carrier"] - speed["ring"])) / (2 * math.pi)


Node = tuple[Literal["shaft", "stage"], str]
SMALL = 1e-9  # of the largest branch power


@dataclass
class Branch:
    """A flow of power (W, > 0) from the node ``tail`` to the node ``head``."""

    tail: Node
    head: Node
    power: float


def circulating_power(
    branch_power: dict[str, float], shaft_of: dict[str, str], stage_of: dict[str, str]
) -> tuple[float, dict[str, float]]:
    """Circulating power, W: total over all closed loops, and by stage. branch_power: power into the
    stage at each member; shaft_of, stage_of: the member's shaft and stage."""
    largest = max((abs(p) for p in branch_power.values()), default=0.0)
    branches = []
    for member, power in branch_power.items():
        if abs(power) > SMALL * largest:
            shaft: Node = ("shaft", shaft_of[member])
            stage: Node = ("stage", stage_of[member])
            tail, head = (shaft, stage) if power > 0 else (stage, shaft)
            branches.append(Branch(tail, head, abs(power)))
    total, through = 0.0, dict.fromkeys(stage_of.values(), 0.0)
    while cycle := _shortest_cycle(branches):
        cut = min(b.power for b in cycle)
        total += cut
        for branch in cycle:
            branch.power -= cut
            kind, name = branch.head
            if kind == "stage":
                through[name] += cut
        branches = [b for b in branches if b.power > SMALL * largest]
    return total, through


def shafts(members: tuple[str, ...], joints: list[tuple[str, str]]) -> dict[str, str]:
    """Each member's shaft, named after its first member."""
    shaft = {member: member for member in members}
    for first, second in joints:
        low, high = sorted((shaft[first], shaft[second]), key=members.index)
        shaft = {m: low if s == high else s for m, s in shaft.items()}
    return shaft


def _shortest_cycle(branches: list[Branch]) -> list[Branch]:
    """Branches of a directed cycle with the fewest branches; empty where there is none."""
    cycles = (_cycle(branches, start) for start in branches)
    return min(filter(None, cycles), key=len, default=[])


def _cycle(branches: list[Branch], start: Branch) -> list[Branch]:
    """Shortest way along the flow that begins with a branch and comes back to its tail."""
    ways, reached = deque([[start]]), {start.head}
    while ways:
        way = ways.popleft()
        if way[-1].head == start.tail:
            return way
        for branch in branches:
            if branch.tail == way[-1].head and branch.head not in reached:
                reached.add(branch.head)
                ways.append([*way, branch])
    return []


NOISE = 1e-13


@dataclass(frozen=True)
class PowerFlow:
    """Steady flow of a train; positive about +z, rad/s, N m, W.

    speed: of all members. torque, power: from outside on ports, held and loaded members; they sum
    to zero power. branch_torque, branch_power: by the rest of the train on each member, so what
    enters the member's stage there. joint_torque: by ``first`` on ``second``, in the order of the
    joints. input_power: sum of all power that enters. circulating_power: see
    flexgear.gears.power_flow.
    """

    mobility: int
    speed: dict[str, float]
    torque: dict[str, float]
    power: dict[str, float]
    branch_torque: dict[str, float]
    branch_power: dict[str, float]
    joint_torque: tuple[float, ...]
    input_power: float
    circulating_power: float
    stages: tuple[StageFlow, ...]

    def stage(self, name: str) -> StageFlow:
        """The stage of that name."""
        return next(s for s in self.stages if s.name == name)


def power_flow(case: Case) -> PowerFlow:
    """Speeds, torques, powers and mean forces of a case. A case of free vibration (no output) has
    no loads, and without inputs no speeds. Raises InputError where the train has no or more than
    one solution."""
    members = members_of(case)
    ties = members.tie_rows
    if members.ports:
        mobility = require_free_ties(members)
        require_speeds(members, mobility)
        stated = [p.speed for p in members.ports if p.speed is not None]
        speeds = _speeds(members, np.array(stated))
    else:
        mobility, speeds = len(members.names) - rank(ties), np.zeros(len(members.names))
    if case.output is None:
        outside, ties_torque = {p.member: 0.0 for p in members.ports}, np.zeros(len(ties))
    else:
        require_torques(members, mobility)
        outside, ties_torque = _torques(members)
    speed = dict(zip(members.names, speeds.tolist(), strict=True))
    branch_torque = _branch_torques(members, ties_torque)
    branch_power = {m: t * speed[m] + 0.0 for m, t in branch_torque.items()}
    power = {m: t * speed[m] + 0.0 for m, t in outside.items()}  # no −0
    stage_of: dict[str, str] = {m: m.stage for m in members.names}
    shaft_of = shafts(members.names, [(j.first, j.second) for j in case.joints])
    circulating, through = circulating_power(branch_power, shaft_of, stage_of)
    return PowerFlow(
        mobility=mobility,
        speed=speed,
        torque=outside,
        power=power,
        branch_torque=branch_torque,
        branch_power=branch_power,
        joint_torque=tuple(
            float(-t)
            for tie, t in zip(members.ties, ties_torque, strict=True)
            if tie.kind == "joint"
        ),
        input_power=sum(p for p in power.values() if p > 0),
        circulating_power=circulating,
        stages=tuple(
            stage_flow(
                case.view(stage.name),
                {part: speed[f"{stage.name}.{part}"] for part in stage.members},
                {part: branch_torque[f"{stage.name}.{part}"] for part in stage.members},
                through[stage.name],
            )
            for stage in case.stages
        ),
    )


def _speeds(members: Members, stated: Array) -> Array:
    """Speeds (members, …) from those (F, …) of the ports of given speed."""
    driven = [p for p in members.ports if p.speed is not None]
    matrix = np.vstack([members.tie_rows, members.port_rows(driven)])
    right = np.concatenate([np.zeros((len(members.ties), *stated.shape[1:])), stated])
    speeds = np.linalg.solve(matrix, right)
    return np.where(abs(speeds) > NOISE * abs(speeds).max(), speeds, 0.0)


def speed_ratios(case: Case) -> dict[str, Array]:
    """Speed of every member, and of the planets as "<stage>.planet", per speed of each independent
    rotation, (F,) in the order of the ports of given speed. InputError where the train has no or
    more than one solution."""
    members = members_of(case)
    require_speeds(members, require_free_ties(members))
    count = sum(p.speed is not None for p in members.ports)
    ratios = _speeds(members, np.eye(count))
    of = dict(zip(map(str, members.names), ratios, strict=True))
    for stage in case.stages:
        if stage.ring is not None and stage.planet is not None:
            carrier, ring = of[f"{stage.name}.carrier"], of[f"{stage.name}.ring"]
            teeth = stage.ring.teeth / stage.planet.teeth
            of[f"{stage.name}.planet"] = carrier - teeth * (carrier - ring)
    return of


def _torques(members: Members) -> tuple[dict[str, float], Array]:
    """Torques from outside by member, and λ of every tie."""
    unknown = [p for p in members.ports if p.torque is None]
    stated = {p.member: p.torque for p in members.ports if p.torque is not None}
    right = np.zeros(len(members.names))
    for torques in (stated, members.loads):
        for member, value in torques.items():
            right[members.names.index(member)] -= value
    matrix = np.vstack([members.tie_rows, members.port_rows(unknown)]).T
    solution = np.asarray(np.linalg.solve(matrix, right), dtype=np.float64)
    ties_torque = solution[: len(members.ties)]
    outside = dict.fromkeys([p.member for p in members.ports], 0.0)
    outside |= stated
    outside |= {
        p.member: float(t) for p, t in zip(unknown, solution[len(members.ties) :], strict=True)
    }
    for tie, value in zip(members.ties, ties_torque, strict=True):
        if tie.kind == "held":
            outside[tie.name] = outside.get(tie.name, 0.0) + float(value)
    for member, value in members.loads.items():
        outside[member] = outside.get(member, 0.0) + value
    return outside, ties_torque


def _branch_torques(members: Members, ties_torque: Array) -> dict[str, float]:
    """Torque by the rest of the train on each member: opposite to that of its stage, N m."""
    stage_rows = [k for k, tie in enumerate(members.ties) if tie.kind == "stage"]
    torques = -members.tie_rows[stage_rows].T @ ties_torque[stage_rows] + 0.0
    return dict(zip(members.names, torques.tolist(), strict=True))
