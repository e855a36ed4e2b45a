"""Speeds, torques and powers of any case, from one linear system and its transpose.

With the matrix G of the ties (``determinacy``) and the rows S that select the ports of given speed,
the speeds are

    [G; S] ω = [0; ω_given] .

Ties do no work, so their torques on the members are Gᵀ λ, and with the rows U of the ports of
unknown torque

    [Gᵀ  Uᵀ] [λ; T_unknown] = −T_given − T_loads .

Both systems are square if M = members − ties speeds and ports − M torques are given. λ of a stage
is the torque in its teeth referred to the sun, λ of a joint the torque that it transmits, λ of a
held member the reaction torque. Power balances for every stage, every shaft and the train.

*Circulating power.* Branch powers are a flow between shafts (members joined to each other) and
stages. In a train that branches and closes again, the flow may contain directed cycles, in which
power returns to the shaft or stage that it left. Each cycle is reduced by its smallest branch power
until none is left; the sum of these reductions is the circulating power. It is zero without a
closed loop, or where all parallel branches lead from input to output (power split). For one loop
the value is unique; of loops that share branches, those with the fewest branches are reduced first.

Mean forces of one stage follow from the torques T of the rest of the train on its members; N
planets, S sides (two if double-helical), base radii r_b, base helix angle β_b, working angles α;
positive on the flanks that carry if the carrier drives (docs/conventions.md):

    normal      F_s = −T_s/(N S r_b,s cos β_b),  F_r = −T_r/(N S r_b,r cos β_b)
    tangential  on a working circle F cos β_b cos α; on the sun's reference circle −T_s/(N S r_s)
    bearing     tangential S cos β_b (F_s cos α_s + F_r cos α_r) = T_c/(N R_c), radial
                S cos β_b (|F_s| sin α_s − |F_r| sin α_r); axial forces cancel on a planet
    axial       ±T_s tan β_b/r_b,s on a sun of right (+) or left (−) hand, the opposite on the
                ring; both tilt a planet by |F_s| sin β_b r_b,p (1/cos α_s + 1/cos α_r); zero if
                double-helical
    planet      ω_p − ω_c = −(r_b,r/r_b,p)(ω_c − ω_r); gear-mesh frequency z_r |ω_c − ω_r| / 2π

Rolling power T_s (ω_s − ω_c) is the power that teeth transmit from sun to ring relative to the
carrier, which causes losses; the rest is transmitted as by a coupling. Weight and centrifugal force
of planets are neglected. In a parallel stage the pinion has the role of the sun and the gear that
of the planet, on a carrier at rest; forces have the opposite sign, F = T_pinion/(S r_b cos β_b),
positive if the gear drives.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csgraph

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
from flexgear.model.case import Case
from flexgear.model.stage import Stage
from flexgear.model.stage_view import StageView
from flexgear.model.train import shafts


@dataclass(frozen=True)
class StageFlow:
    """Speeds rad/s, frequency Hz, torques N m, forces N, powers W of one stage.

    A pinion counts as sun, its gear as planet. Torques are those of the rest of the train on the
    member. planet_speed: absolute; planet_relative_speed: relative to the carrier. tangential_force
    (on the sun's reference circle), sun_working_force, ring_working_force (tangential on the
    working circles), sun_gear_mesh_force, ring_gear_mesh_force (normal, along the 3D line of
    action): of one planet and side. planet_bearing_radial, planet_bearing_tangential: force of the
    teeth on one planet, outward and against the direction of rotation. sun_axial_force: of all
    planets on the sun, towards +z; planet_tilting_moment: size of the moment of the axial forces on
    one planet, N m; both 0 in a parallel stage. stage_power: rolling power,
    positive from sun to ring. circulating_power: part of the stage's power in closed loops of the
    train.
    """

    name: str
    kind: str
    sun_speed: float
    ring_speed: float
    carrier_speed: float
    sun_torque: float
    ring_torque: float
    carrier_torque: float
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
    sun_axial_force: float
    planet_tilting_moment: float
    stage_power: float
    circulating_power: float

    @property
    def gear_mesh_forces(self) -> dict[str, float]:
        """Normal force of one gear mesh by "sun" and "ring" (0 in a parallel stage), N."""
        return {"sun": self.sun_gear_mesh_force, "ring": self.ring_gear_mesh_force}

    @property
    def planet_bearing_force(self) -> float:
        """Magnitude of the in-plane force on a planet's bearing, N."""
        return math.hypot(self.planet_bearing_radial, self.planet_bearing_tangential)


def stage_flow(
    view: StageView, speed: dict[str, float], torque: dict[str, float], circulating: float = 0.0
) -> StageFlow:
    """Speeds and mean forces of a stage. speed: rad/s, torque: of the rest of the train on the
    member, N m, both by part ("sun", "ring", "carrier" or "pinion", "gear"); circulating: power in
    closed loops, W."""
    stage, radii = view.stage, stage_radii(view)
    first = view.part("sun")
    carrier_speed = speed.get("carrier", 0.0)
    if stage.kind == "parallel":
        relative = speed["gear"]
    else:
        relative = -(radii.base["ring"] / radii.base["planet"]) * (carrier_speed - speed["ring"])
    sides = 2 if stage.double_helical else 1
    paths = stage.planets * sides
    # docs/conventions.md: forces of parallel stages have the opposite sign
    sign = 1.0 if stage.kind == "parallel" else -1.0
    in_plane = {"sun": sign * torque[first] / (paths * radii.base["sun"])}
    if "ring" in torque:
        in_plane["ring"] = -torque["ring"] / (paths * radii.base["ring"])
    cos_bb = math.cos(radii.base_helix_angle)
    working = {r: f * math.cos(radii.working_angles[r]) for r, f in in_plane.items()}
    # the radial component separates the gears on either flank
    radial = {r: abs(f) * math.sin(radii.working_angles[r]) for r, f in in_plane.items()}
    is_skew = stage.kind == "planetary" and not stage.double_helical
    axial = in_plane["sun"] * math.tan(radii.base_helix_angle) if is_skew else 0.0
    arm = sum(radii.base["planet"] / math.cos(angle) for angle in radii.working_angles.values())
    return StageFlow(
        name=stage.name,
        kind=stage.kind,
        sun_speed=speed[first],
        ring_speed=speed.get("ring", 0.0),
        carrier_speed=carrier_speed,
        sun_torque=torque[first],
        ring_torque=torque.get("ring", 0.0),
        carrier_torque=torque.get("carrier", 0.0),
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
        sun_axial_force=paths * axial * (-1.0 if stage.planet_hand == "left" else 1.0),
        planet_tilting_moment=abs(axial) * arm,
        stage_power=torque[first] * (speed[first] - carrier_speed),
        circulating_power=circulating,
    )


def _gear_mesh_frequency(stage: Stage, speed: dict[str, float]) -> float:
    """Gear-mesh frequency, Hz."""
    if stage.pinion is not None:
        return abs(stage.pinion.teeth * speed["pinion"]) / (2 * math.pi)
    assert stage.ring is not None  # the model refuses a planetary stage without one
    return abs(stage.ring.teeth * (speed["carrier"] - speed["ring"])) / (2 * math.pi)


NEGLIGIBLE = 1e-9  # of the largest branch power


def circulating_power(
    branch_power: dict[str, float], shaft_of: dict[str, str], stage_of: dict[str, str]
) -> tuple[float, dict[str, float]]:
    """Circulating power, W, of all closed loops together, and by stage. branch_power: power into
    the stage by member, W; shaft_of, stage_of: shaft and stage by member."""
    stages = list(dict.fromkeys(stage_of.values()))
    nodes = stages + list(dict.fromkeys(shaft_of.values()))
    total, by_stage = 0.0, dict.fromkeys(stages, 0.0)
    flow = np.zeros((len(nodes), len(nodes)))  # W, from row to column
    for member, power in branch_power.items():
        ends = nodes.index(shaft_of[member]), nodes.index(stage_of[member])
        flow[ends if power > 0 else ends[::-1]] += abs(power)
    least = NEGLIGIBLE * flow.max()
    while cycle := _shortest_cycle(np.where(flow > least, flow, 0.0)):
        power = float(min(flow[branch] for branch in cycle))
        total += power
        for tail, head in cycle:
            flow[tail, head] -= power
            if head < len(stages):
                by_stage[stages[head]] += power
    return total, by_stage


def _shortest_cycle(flow: Array) -> list[tuple[int, int]]:
    """Branches, from node to node, of the directed cycle with the fewest of them; empty if there is
    none. flow: power from the node of a row to that of a column, W."""
    distance, before = csgraph.shortest_path(flow, unweighted=True, return_predecessors=True)
    way_back = np.where(flow > 0.0, distance.T, np.inf)
    tail, head = divmod(int(way_back.argmin()), len(flow))
    if not np.isfinite(way_back[tail, head]):
        return []
    nodes = [head, tail]
    while nodes[-1] != head:
        nodes.append(int(before[head, nodes[-1]]))
    return list(zip(nodes[1:], nodes, strict=False))


NOISE = 1e-13  # speed over the largest that is rounding


@dataclass(frozen=True)
class PowerFlow:
    """Steady power flow of a train; positive about +z, rad/s, N m, W.

    speed: of all members. torque, power: external, on ports, held and loaded members; the powers
    sum to zero. branch_torque, branch_power: of the rest of the train on each member, which enter
    its stage there. input_power: sum of all power that enters the train. circulating_power: in
    closed loops.
    """

    mobility: int
    speed: dict[str, float]
    torque: dict[str, float]
    power: dict[str, float]
    branch_torque: dict[str, float]
    branch_power: dict[str, float]
    input_power: float
    circulating_power: float
    stages: tuple[StageFlow, ...]

    def __repr__(self) -> str:
        stages = ", ".join(s.name for s in self.stages)
        return f"<power flow of {stages}: {self.input_power / 1e3:g} kW in>"

    def stage(self, name: str) -> StageFlow:
        """Flow of the stage of a name."""
        return next(s for s in self.stages if s.name == name)


def power_flow(case: Case) -> PowerFlow:
    """Speeds, torques, powers and mean forces of a case. A case without output (free vibration) has
    no loads, and without inputs no speeds. Raises InputError where the train has no solution or
    more than one."""
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
        external, ties_torque = {p.member: 0.0 for p in members.ports}, np.zeros(len(ties))
    else:
        require_torques(members, mobility)
        external, ties_torque = _torques(members)
    speed = dict(zip(members.names, speeds.tolist(), strict=True))
    # opposite to the torque of the stage on the member
    stage_rows = [k for k, tie in enumerate(members.ties) if tie.kind == "stage"]
    torques = -ties[stage_rows].T @ ties_torque[stage_rows] + 0.0
    branch_torque = dict(zip(members.names, torques.tolist(), strict=True))
    branch_power = {m: t * speed[m] + 0.0 for m, t in branch_torque.items()}
    power = {m: t * speed[m] + 0.0 for m, t in external.items()}  # no −0
    stage_of: dict[str, str] = {m: m.stage for m in members.names}
    shaft_of = shafts(members.names, [(j.first, j.second) for j in case.joints])
    circulating, by_stage = circulating_power(branch_power, shaft_of, stage_of)
    return PowerFlow(
        mobility=mobility,
        speed=speed,
        torque=external,
        power=power,
        branch_torque=branch_torque,
        branch_power=branch_power,
        input_power=sum(p for p in power.values() if p > 0),
        circulating_power=circulating,
        stages=tuple(
            stage_flow(
                case.view(stage.name),
                {part: speed[f"{stage.name}.{part}"] for part in stage.members},
                {part: branch_torque[f"{stage.name}.{part}"] for part in stage.members},
                by_stage[stage.name],
            )
            for stage in case.stages
        ),
    )


def _speeds(members: Members, stated: Array) -> Array:
    """Speeds of all members (members, …) from those of the ports of given speed (F, …), rad/s."""
    driven = [p for p in members.ports if p.speed is not None]
    matrix = np.vstack([members.tie_rows, members.port_rows(driven)])
    right = np.concatenate([np.zeros((len(members.ties), *stated.shape[1:])), stated])
    speeds = np.linalg.solve(matrix, right)
    return np.where(abs(speeds) > NOISE * abs(speeds).max(), speeds, 0.0)


def speed_ratios(case: Case) -> dict[str, Array]:
    """Ratios (F,) of the speed of a member to the speeds of the F ports of given speed, by member,
    and of planets as "<stage>.planet". Raises InputError where the train has no solution or more
    than one."""
    members = members_of(case)
    require_speeds(members, require_free_ties(members))
    count = sum(p.speed is not None for p in members.ports)
    ratios = dict(zip(map(str, members.names), _speeds(members, np.eye(count)), strict=True))
    for stage in case.stages:
        if stage.ring is not None and stage.planet is not None:
            carrier, ring = ratios[f"{stage.name}.carrier"], ratios[f"{stage.name}.ring"]
            teeth = stage.ring.teeth / stage.planet.teeth
            ratios[f"{stage.name}.planet"] = carrier - teeth * (carrier - ring)
    return ratios


def _torques(members: Members) -> tuple[dict[str, float], Array]:
    """External torques by member, and λ of every tie, N m."""
    unknown = [p for p in members.ports if p.given_torque is None]
    external = {p.member: p.given_torque or 0.0 for p in members.ports}
    right = np.zeros(len(members.names))
    for torques in (external, members.loads):
        for member, value in torques.items():
            right[members.names.index(member)] -= value
    matrix = np.vstack([members.tie_rows, members.port_rows(unknown)]).T
    solution = np.asarray(np.linalg.solve(matrix, right), dtype=np.float64)
    ties_torque, port_torques = np.split(solution, [len(members.ties)])
    external.update(zip((p.member for p in unknown), port_torques.tolist(), strict=True))
    by_tie = zip(members.ties, ties_torque.tolist(), strict=True)
    reactions = [(tie.name, torque) for tie, torque in by_tie if tie.kind == "held"]
    for member, torque in (*reactions, *members.loads.items()):
        external[member] = external.get(member, 0.0) + torque
    return external, ties_torque
