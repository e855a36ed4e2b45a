"""The machines at the ports of a case at its rated state."""

from __future__ import annotations

from flexgear.coupling.machines import Brake, GivenTorque, Machine
from flexgear.gears.power_flow import PowerFlow
from flexgear.model.case import Case


def port_machines(case: Case, flow: PowerFlow) -> tuple[Machine, ...]:
    """One for each port: inputs give torque, the output brakes."""
    inputs = [GivenTorque()] * len(case.inputs)
    return (*inputs, *([_brake(case, flow)] if case.output is not None else []))


def _brake(case: Case, flow: PowerFlow) -> Brake:
    """Of the output: its rated torque as given, else that of statics, N m; rated speed, rad/s."""
    torque, speed = flow.torque[case.brake_member], flow.speed[case.brake_member]
    given = None if case.output is None else case.output.brake_torque
    size = given or abs(torque)
    return Brake(size if speed else -torque, abs(speed), case.brake_exponent)
