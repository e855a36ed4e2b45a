"""Speeds, torques and powers of any case, from one linear system and its transpose.

With the ties G of all members' speeds (members) and the rows S that pick the ports of given
speed, the speeds are

    [G; S] ω = [0; ω_given] .

Ties do no work, so their torques on the members are Gᵀ λ, and with the ports of unknown torque (U)

    [Gᵀ  Uᵀ] [λ; T_unknown] = −T_given − T_loads .

Both are square where M = members − ties speeds and ports − M torques are given. λ of a stage is the
torque in its teeth referred to the sun, λ of a joint what passes through it, λ of a held member
what holds it. Power then balances for every stage, shaft and the whole train.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from flexgear.gears.circulating_power import circulating_power, shafts
from flexgear.gears.determinacy import (
    port_matrix,
    rank,
    require_free_ties,
    require_speeds,
    require_torques,
    tie_matrix,
)
from flexgear.gears.members import Members, members_of
from flexgear.gears.stage_flow import StageFlow, stage_flow

if TYPE_CHECKING:
    from flexgear.model.case import Case

Array = NDArray[np.float64]
NOISE = 1e-13


@dataclass(frozen=True)
class PowerFlow:
    """Steady flow of a train; positive about +z, rad/s, N m, W.

    speed: of all members. torque, power: from outside on ports, held and loaded members; they sum
    to zero power. branch_torque, branch_power: by the rest of the train on each member, so what
    enters the member's stage there. joint_torque: by ``first`` on ``second``, in the order of the
    joints. input_power: sum of all power that enters. circulating_power: see
    flexgear.gears.circulating_power.
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
    """Speeds, torques, powers and mean forces of a case.

    In free vibration (no output) nothing is loaded, and without inputs all is at rest. Raises
    InputError where the train has no or more than one answer.
    """
    members = members_of(case)
    ties = tie_matrix(members, members.ties)
    if members.ports:
        mobility = require_free_ties(members)
        require_speeds(members, mobility)
        speeds = _speeds(members, ties)
    else:
        mobility, speeds = len(members.names) - rank(ties), np.zeros(len(members.names))
    if case.output is None:
        outside, ties_torque = {p.member: 0.0 for p in members.ports}, np.zeros(len(ties))
    else:
        require_torques(members, mobility)
        outside, ties_torque = _torques(members, ties)
    speed = dict(zip(members.names, speeds.tolist(), strict=True))
    branch_torque = _branch_torques(members, ties, ties_torque)
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


def _speeds(members: Members, ties: Array) -> Array:
    driven = [p for p in members.ports if p.speed is not None]
    matrix = np.vstack([ties, port_matrix(members, driven)])
    right = np.zeros(len(matrix))
    right[len(ties) :] = [p.speed for p in driven]
    speeds = np.linalg.solve(matrix, right)
    return np.where(abs(speeds) > NOISE * abs(speeds).max(), speeds, 0.0)


def _torques(members: Members, ties: Array) -> tuple[dict[str, float], Array]:
    """Torques from outside by member, and λ of every tie."""
    unknown = [p for p in members.ports if p.torque is None]
    stated = {p.member: p.torque for p in members.ports if p.torque is not None}
    right = np.zeros(len(members.names))
    for torques in (stated, members.loads):
        for member, value in torques.items():
            right[members.names.index(member)] -= value
    matrix = np.vstack([ties, port_matrix(members, unknown)]).T
    solution = np.asarray(np.linalg.solve(matrix, right), dtype=np.float64)
    ties_torque = solution[: len(ties)]
    outside = dict.fromkeys([p.member for p in members.ports], 0.0)
    outside |= stated
    outside |= {p.member: float(t) for p, t in zip(unknown, solution[len(ties) :], strict=True)}
    for tie, value in zip(members.ties, ties_torque, strict=True):
        if tie.kind == "held":
            outside[tie.name] = outside.get(tie.name, 0.0) + float(value)
    for member, value in members.loads.items():
        outside[member] = outside.get(member, 0.0) + value
    return outside, ties_torque


def _branch_torques(members: Members, ties: Array, ties_torque: Array) -> dict[str, float]:
    """Torque by the rest of the train on each member: against what its stage does, N m."""
    stage_rows = [k for k, tie in enumerate(members.ties) if tie.kind == "stage"]
    torques = -ties[stage_rows].T @ ties_torque[stage_rows] + 0.0
    return dict(zip(members.names, torques.tolist(), strict=True))
