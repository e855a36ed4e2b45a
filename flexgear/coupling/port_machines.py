"""The machines at the ports of a case at its rated state."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from flexgear.coupling.machines import Brake, Controller, GivenSpeed, GivenTorque
from flexgear.coupling.machines import Machine as Law
from flexgear.gears.power_flow import PowerFlow
from flexgear.model.case import Case
from flexgear.model.errors import InputError
from flexgear.model.machine import Machine, machines_of

Array = NDArray[np.float64]


def port_machines(case: Case, flow: PowerFlow) -> tuple[Law, ...]:
    """The law of each port, brakes at their rated torque N m and speed rad/s."""
    ports = [port.member for port in case.ports]
    pairs = zip(machines_of(case), ports, strict=True)
    return tuple(_law(machine, flow.torque[at], flow.speed[at]) for machine, at in pairs)


def machine_words(case: Case) -> dict[str, float | str]:
    """What the header of results says of them: the law at each port, exponents of brakes."""
    out: dict[str, float | str] = {}
    for port, machine in zip(case.ports, machines_of(case), strict=True):
        out[f"{port.member}_machine"] = "torque" if machine is None else machine.law
        if machine is not None and machine.law == "brake":
            out[f"{port.member}_brake_exponent"] = machine.brake_exponent
    return out


def _law(machine: Machine | None, torque: float, speed: float) -> Law:
    if machine is None or machine.law == "torque":
        return GivenTorque()
    if machine.law == "speed":
        return GivenSpeed()
    if machine.law == "brake":
        size = machine.brake_torque or abs(torque)
        return Brake(size if speed else -torque, abs(speed), machine.brake_exponent)
    least = -math.inf if machine.least_torque is None else machine.least_torque
    most = math.inf if machine.most_torque is None else machine.most_torque
    return Controller(machine.kp or 0.0, machine.ki, least, most)


def require_free_speeds(case: Case, turns: Array) -> None:
    """InputError where ports that follow a speed say the same motion twice. turns (P, F): rotation
    of the ports per radian of each independent rotation of the train."""
    machines = machines_of(case)
    speed_ports = [
        p for p, machine in enumerate(machines) if machine is not None and machine.follows_speed
    ]
    for count in range(1, len(speed_ports) + 1):
        if np.linalg.matrix_rank(turns[speed_ports[:count]]) < count:
            last = speed_ports[count - 1]
            key = f"inputs[{last}]" if last < len(case.inputs) else "output"
            others = " and ".join(case.ports[p].member for p in speed_ports[: count - 1])
            raise InputError(
                case.source,
                f"{key}.machine.law",
                f"the speed of {case.ports[last].member} follows from that of {others} already",
                'let it follow law = "torque" or "brake"',
            )
