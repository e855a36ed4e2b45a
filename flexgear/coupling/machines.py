"""Laws of the machines at the ports of a train; torques are from outside on the member.

given torque   T(t)
given speed    ω(t): a row of constraint, whose torque is whatever it takes
brake          T = −T_r sign(ω) |ω/ω_r|ⁿ
controller     T = k_p (ω_s − ω) + k_i ∫ (ω_s − ω) dt within limits, to a set speed ω_s(t)

What is prescribed to a machine over time, T, ω or ω_s, is no part of its law
(``analysis.transient.Drive``).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from flexgear.arrays import Array
from flexgear.gears.power_flow import PowerFlow
from flexgear.model.case import Case
from flexgear.model.errors import InputError
from flexgear.model.machine import Machine, machines_of


@dataclass(frozen=True)
class GivenTorque:
    """A machine whose torque does not depend on its speed."""


@dataclass(frozen=True)
class GivenSpeed:
    """Prescribed speed, whatever the torque."""


@dataclass(frozen=True)
class Brake:
    """Torque T = rated_torque · sign(ω) |ω/rated_speed|^exponent against the motion, N·m
    (``analysis.kernels.outer_forces.brake_torque``, where a constant one fades near zero speed);
    T = rated_torque, of either sign, where the rated speed is zero."""

    rated_torque: float
    rated_speed: float
    exponent: float

    def speed(self, torque: float) -> float | None:
        """Speed at which it takes a torque, rad/s; None where any may be."""
        if self.rated_torque == 0.0 or self.exponent == 0.0 or self.rated_speed == 0.0:
            return None
        ratio = abs(torque) / self.rated_torque
        return math.copysign(ratio ** (1 / self.exponent) * self.rated_speed, torque)


@dataclass(frozen=True)
class Controller:
    """PI speed controller: proportional k_p N·m·s/rad, integral k_i N·m/rad, torques it may give
    from least to most, N·m. The integral stands while the torque is at a limit and the error would
    push it on, so that it does not wind up (conditional integration: Åström, Hägglund 2006)."""

    proportional: float
    integral: float
    least: float = -math.inf
    most: float = math.inf


MachineLaw = GivenTorque | GivenSpeed | Brake | Controller


def port_machines(case: Case, flow: PowerFlow) -> tuple[MachineLaw, ...]:
    """The law of each port, brakes at their rated torque N m and speed rad/s."""
    ports = [port.member for port in case.ports]
    pairs = zip(machines_of(case), ports, strict=True)
    return tuple(_law(machine, flow.torque[at], flow.speed[at]) for machine, at in pairs)


def machine_words(case: Case) -> dict[str, float | str]:
    """Machines in the attributes of results: the law at each port, exponents of brakes."""
    out: dict[str, float | str] = {}
    for port, machine in zip(case.ports, machines_of(case), strict=True):
        out[f"{port.member}_machine"] = "torque" if machine is None else machine.law
        if machine is not None and machine.law == "brake":
            out[f"{port.member}_brake_exponent"] = machine.brake_exponent
    return out


def _law(machine: Machine | None, torque: float, speed: float) -> MachineLaw:
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
    """InputError where speeds of ports are redundant.

    turns (P, F): rotation of the ports per radian of each independent rotation of the train.
    """
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
