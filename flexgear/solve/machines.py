"""Torques and speeds of a case's machines, and its loads, as functions of time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from flexgear.analysis.transient import Drive
from flexgear.coupling.machines import Brake
from flexgear.coupling.modal import ModalSystem
from flexgear.gears.power_flow import PowerFlow
from flexgear.model.case import Case
from flexgear.model.errors import InputError
from flexgear.model.machine import Machine, TorqueHistory, machine_of, machines_of
from flexgear.model.train import MemberLoad, load_histories
from flexgear.solve.model import Model

Array = NDArray[np.float64]
_STEADY = {
    "kind": "constant", "torque": None, "speed": None, "times": (), "torques": (), "speeds": (),
    "file": None,
}  # fmt: skip


@dataclass(frozen=True)
class Ends:
    """Histories at the ports (P,): each with its machine, its rated torque N m or speed rad/s, and
    by how much it is scaled. None: a torque in rated proportion to the first port's. loads: of the
    case, of which histories are prescribed, too."""

    machines: tuple[Machine | None, ...]
    rated: Array
    scale: Array
    loads: tuple[MemberLoad, ...] = ()

    @property
    def jumps(self) -> tuple[float, ...]:
        """Times at which a torque or a set speed jumps, or a given speed has a kink, s."""
        times: set[float] = set()
        for machine in self.machines:
            if machine is not None and machine.law != "brake":
                times.update(machine.kinks() if machine.law == "speed" else machine.change_times())
        return tuple(sorted(times))

    @property
    def steep(self) -> bool:
        """Whether one of them may change fast anywhere."""
        steep = any(machine is not None and machine.is_series for machine in self.machines)
        return steep or any(load.is_history for load in self.loads)

    def drive(self) -> Drive:
        """For the time stepping."""
        return Drive(self._prescribed, self._rates, lambda time: load_histories(self.loads, time))

    def _prescribed(self, time: Array) -> Array:
        return self._columns(time, lambda machine, rated: machine.at(time, rated))

    def _rates(self, time: Array) -> Array:
        return self._columns(time, lambda machine, rated: machine.rate_at(time))

    def _columns(self, time: Array, of: Callable[[Machine, float], Array]) -> Array:
        """(k, P) at times (k,)."""
        out = np.zeros((len(time), len(self.machines)))
        for p, machine in enumerate(self.machines):
            if machine is not None and machine.law != "brake":
                out[:, p] = self.scale[p] * of(machine, float(self.rated[p]))
        for p, machine in enumerate(self.machines):
            if machine is None:
                out[:, p] = out[:, 0] * self.rated[p] / self.rated[0]
        return out


def ends_of(
    case: Case, flow: PowerFlow, drive: TorqueHistory | None = None, share: float = 1.0
) -> Ends:
    """Histories of a case's ports, torques scaled by ``share``.

    drive: what the first input follows if it follows a torque; all other machines are then at their
    rated torque or speed for good.
    """
    machines = list(machines_of(case))
    if drive is not None:
        machines = [
            None if machine is None else machine.model_copy(update=_STEADY) for machine in machines
        ]
        if machines[0] is not None and machines[0].law == "torque":
            machines[0] = machine_of(drive)
    members = [port.member for port in case.ports]
    rated = np.array([flow.torque[member] for member in members])
    first = machines[0]
    if first is None or first.law != "torque" or rated[0] == 0.0:
        machines = [machine or Machine() for machine in machines]
    speeds = [machine is not None and machine.follows_speed for machine in machines]
    rated[speeds] = np.array([flow.speed[member] for member in members])[speeds]
    return Ends(tuple(machines), rated, np.where(speeds, 1.0, share), case.loads)


def require_brakes(model: Model) -> None:
    """InputError where a port that gives power at rated load is said to brake."""
    case = model.case
    for p, machine in enumerate(machines_of(case)):
        member = case.ports[p].member
        if machine is None or machine.law != "brake" or model.flow.power[member] <= 0:
            continue
        last = p == len(case.inputs)
        raise InputError(
            case.source,
            "output.member" if last else f"inputs[{p}].machine.law",
            f"{member} gives {model.flow.power[member]:.6g} W to the train, but in a transient "
            f"{'the output' if last else 'it'} brakes",
            "name the member that takes the power, and the others as inputs",
        )


def braked(modal: ModalSystem, share: float) -> ModalSystem:
    """The same train with the torque of its brakes scaled."""
    machines = tuple(
        replace(machine, rated_torque=abs(share) * machine.rated_torque)
        if isinstance(machine, Brake)
        else machine
        for machine in modal.system.machines
    )
    return replace(modal, system=modal.system.with_(machines=machines))
