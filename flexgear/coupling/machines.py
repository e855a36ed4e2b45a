"""Laws of the machines at the ports of a train; torques are external torques on the member.

given torque   T(t)
given speed    ω(t): a constraint, whose torque follows
brake          T = −T_r sign(ω) |ω/ω_r|ⁿ
controller     T = k_p (ω_s − ω) + k_i ∫ (ω_s − ω) dt within limits, to a set speed ω_s(t)

The histories T, ω and ω_s are not part of the law (``analysis.transient.Drive``).
"""

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
    """Machine with a prescribed torque."""


@dataclass(frozen=True)
class GivenSpeed:
    """Machine with a prescribed speed."""


@dataclass(frozen=True)
class Brake:
    """Brake with the torque T = rated_torque · sign(ω) |ω/rated_speed|^exponent against the motion,
    N·m; T = rated_torque, of either sign, if the rated speed is zero. A constant torque is reduced
    near zero speed (``analysis.kernels.outer_forces.brake_torque``)."""

    rated_torque: float
    rated_speed: float
    exponent: float

    def speed(self, torque: float) -> float | None:
        """Speed at which the brake has a torque, rad/s; None if the torque does not define it."""
        if self.rated_torque == 0.0 or self.exponent == 0.0 or self.rated_speed == 0.0:
            return None
        ratio = abs(torque) / self.rated_torque
        return math.copysign(ratio ** (1 / self.exponent) * self.rated_speed, torque)


@dataclass(frozen=True)
class Controller:
    """PI speed controller: proportional k_p, N·m·s/rad, integral k_i, N·m/rad, limits of the torque
    ``least`` and ``most``, N·m. Integration stops while the torque is at a limit and the error
    would drive it beyond, which avoids wind-up (conditional integration: Åström, Hägglund 2006)."""

    proportional: float
    integral: float
    least: float = -math.inf
    most: float = math.inf


MachineLaw = GivenTorque | GivenSpeed | Brake | Controller


def port_machines(case: Case, flow: PowerFlow) -> tuple[MachineLaw, ...]:
    """Machine law of each port; brakes have rated torque, N m, and speed, rad/s, of the flow."""
    ports = [port.member for port in case.ports]
    pairs = zip(machines_of(case), ports, strict=True)
    return tuple(_law(machine, flow.torque[at], flow.speed[at]) for machine, at in pairs)


def machine_words(case: Case) -> dict[str, float | str]:
    """Attributes of results about machines: law at each port, exponents of brakes."""
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
    """Raises InputError if prescribed speeds of ports are redundant. turns (P, F): rotation of the
    ports per radian of each independent rotation of the train."""
    machines = machines_of(case)
    speed_ports = [
        p for p, machine in enumerate(machines) if machine is not None and machine.follows_speed
    ]
    for count in range(1, len(speed_ports) + 1):
        if np.linalg.matrix_rank(turns[speed_ports[:count]]) < count:
            last = speed_ports[count - 1]
            key = f"inputs[{last}]" if last < len(case.inputs) else "output"
            others = " and ".join(case.ports[p].member for p in speed_ports[: count - 1])
            problem = f"the speed of {case.ports[last].member} follows from that of {others}"
            remedy = 'choose law = "torque" or "brake"'
            raise InputError(case.source, f"{key}.machine.law", problem, remedy)
