"""Where power enters and leaves a train."""

from __future__ import annotations

from pydantic import Field, model_validator

from flexgear.model.machine import Machine
from flexgear.model.names import Member
from flexgear.model.section import Refusal, Section
from flexgear.model.springs import Bearing
from flexgear.model.units import Inertia, Mass, Power, Speed, Torque


class Port(Section):
    """Where torque enters or leaves, and what hangs there.

    member: its name, such as "stage_1.carrier". speed: rated. torque: rated, on the member.
    inertia: polar, of what hangs on the member. mass, tilt_inertia (about a diameter), bearing: of
    the body behind the spline at the end of a sun's shaft, and what supports it there. machine: in
    transients.
    """

    member: Member
    speed: Speed | None = Field(default=None, ge=-1e4, le=1e4)
    torque: Torque | None = Field(default=None, ge=-1e9, le=1e9)
    inertia: Inertia | None = Field(default=None, ge=0.0, le=1e12)
    mass: Mass | None = Field(default=None, ge=1e-3, le=1e7)
    tilt_inertia: Inertia | None = Field(default=None, ge=1e-9, le=1e12)
    bearing: Bearing | None = None
    machine: Machine | None = None


class Input(Port):
    """A driven member. speed and torque (that of the drive on the member) are positive about +z.

    power: into the train, stands for the torque power / speed, so it needs the speed. Of all speeds
    and torques over inputs and output exactly as many are given as the train leaves free.
    [drive] is another name for the machine of the first input.
    """

    power: Power | None = Field(default=None, ge=-1e9, le=1e9)

    @property
    def given_torque(self) -> float | None:
        """Torque on the member, N m, from torque or power; None if neither is given."""
        if self.power is not None and self.speed is not None:
            return self.power / self.speed
        return self.torque

    @model_validator(mode="after")
    def _power_has_a_speed(self) -> Input:
        if self.power is None:
            return self
        if self.torque is not None:
            raise Refusal("power", "is given beside torque", "keep one of them")
        if not self.speed:
            problem = "has no speed to go with it" if self.speed is None else "has speed zero"
            raise Refusal("power", problem, "give speed, or torque in place of power")
        return self


class Output(Port):
    """The loaded member: torque of the load on the member, positive about +z.

    brake_exponent: T ~ |ω|^exponent in transients. brake_torque: T at rated speed in transients,
    that of statics if left out. A machine stands in the place of the brake.
    """

    brake_torque: Torque | None = Field(default=None, gt=0.0, le=1e9)
    brake_exponent: float = Field(default=1.0, ge=0.0, le=5.0)

    @property
    def given_torque(self) -> float | None:
        """Torque on the member, N m; None if it follows from the others."""
        return self.torque

    @model_validator(mode="after")
    def _finite_slope(self) -> Output:
        if 0.0 < self.brake_exponent < 1.0:
            raise Refusal(
                "brake_exponent",
                "between 0 and 1 the torque rises infinitely fast at rest",
                "0 or ≥ 1",
            )
        return self
