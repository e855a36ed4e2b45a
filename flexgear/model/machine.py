"""Machines at inputs and output, and the torque of the first input over time."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Literal

from pydantic import Field, model_validator

from flexgear.model.section import Missing, Refusal, Section
from flexgear.model.time_series import Followed, TimeHistory
from flexgear.model.units import RotationalDamping, RotationalStiffness, Time, Torque

if TYPE_CHECKING:
    from flexgear.model.case import Case


_OWN = {
    "controller": ("kp", "ki", "least_torque", "most_torque"),
    "brake": ("brake_torque", "brake_exponent"),
}


class Machine(TimeHistory):
    """Machine at a port; torques act on the member, torques and speeds are positive about +z.

    torque      the torque of the history, whatever the speed
    speed       the speed of the history, whatever torque it takes; a result is the torque
    controller  T = kp (ω_s − ω) + ki ∫ (ω_s − ω) dt with the set speed ω_s of the history, from
                least_torque to most_torque, where the integral stands; it starts where it has to
    brake       T = −brake_torque sign(ω) |ω/ω_rated|^brake_exponent; brake_torque that of statics
                if left out

    law: what it follows. kp, ki: gains of a controller on speed and on angle. least_torque,
    most_torque: limits of a controller. brake_torque: at rated speed. brake_exponent: of the speed
    in a brake's torque.
    """

    law: Literal["torque", "speed", "controller", "brake"] = "torque"
    kp: RotationalDamping | None = Field(default=None, ge=0.0, le=1e15)
    ki: RotationalStiffness = Field(default=0.0, ge=0.0, le=1e15)
    least_torque: Torque | None = Field(default=None, ge=-1e9, le=1e9)
    most_torque: Torque | None = Field(default=None, ge=-1e9, le=1e9)
    brake_torque: Torque | None = Field(default=None, gt=0.0, le=1e9)
    brake_exponent: float = Field(default=1.0, ge=0.0, le=5.0)

    @property
    def followed(self) -> Followed:
        """What its history is one of."""
        return "speed" if self.follows_speed else "torque"

    @property
    def follows_speed(self) -> bool:
        """Whether a speed is held or controlled."""
        return self.law in ("speed", "controller")

    @classmethod
    def required(cls, data: Mapping[str, Any]) -> list[Missing]:
        """A controller has a gain."""
        lacks = data.get("law") == "controller" and data.get("kp") is None
        return [Missing("kp", "is missing for a controller")] if lacks else []

    @model_validator(mode="after")
    def _one_law(self) -> Machine:
        for law, keys in _OWN.items():
            for key in keys:
                if (
                    key in self.model_fields_set
                    and self.law != law
                    and _differs_from_default(self, key)
                ):
                    raise Refusal(key, f"is given, but law is {self.law!r}", f'set law = "{law}"')
        if self.law == "speed" and self.kind == "steps":
            raise Refusal(
                "kind", "a speed cannot jump: no torque is large enough", 'use kind = "soft"'
            )
        least, most = self.least_torque, self.most_torque
        if least is not None and most is not None and not least < most:
            raise Refusal("least_torque", "is not below most_torque", "lower it")
        refuse_infinite_slope(self.brake_exponent)
        return self


def refuse_infinite_slope(brake_exponent: float) -> None:
    """Refusal of a brake torque T ~ |ω|^exponent that no step of time can follow at rest."""
    if 0.0 < brake_exponent < 1.0:
        problem = "between 0 and 1 the torque rises infinitely fast at rest"
        raise Refusal("brake_exponent", problem, "0 or ≥ 1")


def _differs_from_default(section: Section, key: str) -> bool:
    """Whether a key has another value than when it is left out."""
    return bool(getattr(section, key) != type(section).model_fields[key].default)


def machine_of(drive: TimeHistory) -> Machine:
    """The machine that follows a torque history."""
    return Machine(**{name: getattr(drive, name) for name in TimeHistory.model_fields})


def machines_of(case: Case) -> tuple[Machine | None, ...]:
    """Machines at the ports of a case; None: one that follows the first input's torque in the rated
    proportion, or has its own rated torque where the first input follows no torque.

    ``drive`` is another name for the first input's; the output brakes unless it says otherwise.
    """
    machines = [port.machine for port in case.inputs]
    if machines and machines[0] is None:
        machines[0] = machine_of(case.drive)
    if case.output is None:
        return tuple(machines)
    brake = Machine(
        law="brake",
        brake_torque=case.output.brake_torque,
        brake_exponent=case.output.brake_exponent,
    )
    return (*machines, case.output.machine or brake)


def series_of(case: Case) -> tuple[str, ...]:
    """Members whose machine or load follows a series of a case that may be steep."""
    ports = zip(case.ports, machines_of(case), strict=True)
    members = [port.member for port, machine in ports if machine is not None and machine.is_steep]
    members += [load.member for load in case.loads if load.is_history]
    return tuple(dict.fromkeys(members))


def check_machines(case: Case) -> None:
    """Each end has one machine, and one end at least follows a torque or a law."""
    if not case.inputs:
        return
    first = case.inputs[0].machine
    drive = case.drive
    keys = [key for key, field in TimeHistory.model_fields.items()
            if getattr(drive, key) != field.default
            and not (key == "torque" and drive.torque == case.inputs[0].given_torque)]  # fmt: skip
    if first is not None and keys:
        raise Refusal(f"drive.{keys[0]}", "is given beside inputs.0.machine", "keep one of them")
    if first is not None and first.law != "torque" and case.drive.steps.torques:
        raise Refusal(
            "drive.steps.torques",
            f"are drops of a torque, but the first input follows the law {first.law!r}",
            'take them out, or set its law = "torque"',
        )
    output = case.output
    if output is None:
        return
    if output.machine is not None and output.machine.law == "brake":
        for key in _OWN["brake"]:
            if key in output.model_fields_set and _differs_from_default(output, key):
                raise Refusal(f"output.{key}", "is given beside output.machine", "give it there")
    machines = machines_of(case)
    if all(machine is not None and machine.follows_speed for machine in machines):
        raise Refusal(
            "output.machine.law",
            "all ports follow a speed, so nothing says how much torque goes through the train",
            'let one of them follow law = "torque" or "brake"',
        )


class TorqueDrops(Section):
    """Torque drops that ``flexgear run`` studies, one by one: at ``start``, for ``duration``, then
    the torque is back and the run goes on for ``after``. What is left out follows from the case.

    torques: one a drop. start: of the drop. duration: of the drop. after: time that is followed
    when the torque is back.
    """

    torques: tuple[Torque, ...] = ()
    start: Time | None = Field(default=None, ge=0.0, le=1e5)
    duration: Time | None = Field(default=None, gt=0.0, le=1e5)
    after: Time | None = Field(default=None, gt=0.0, le=1e5)

    @property
    def times(self) -> tuple[float, float, float]:
        """start, duration, after, s, where they are known (``coupling.pace.timed_drops``)."""
        assert self.start is not None and self.duration is not None and self.after is not None
        return self.start, self.duration, self.after


class TorqueHistory(TimeHistory):
    """Machine of the first input, which follows a torque; inputs without a machine of their own
    follow in their rated proportion.

    steps (the section): torque drops that ``flexgear run`` studies beside steady running.
    """

    steps: TorqueDrops = TorqueDrops()

    def drop(self, torque: float, start: float, duration: float, rated: float) -> TorqueHistory:
        """The drive of one torque drop: ``torque`` for ``duration`` s from ``start`` s on."""
        before = self.steady(rated)
        return self.model_copy(
            update={
                "kind": "steps",
                "times": (min(0.0, start - duration), start, start + duration),
                "torques": (before, torque, before),
            }
        )
