"""Joints between stages, ports (inputs and output), and loads on members."""

from collections.abc import Iterable, Sequence
from typing import Annotated, Literal

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field

from flexgear.arrays import Array
from flexgear.model.bearings import Bearing, Springs
from flexgear.model.machine import Machine, refuse_infinite_slope
from flexgear.model.names import Member
from flexgear.model.section import Missing, Refusal, Section
from flexgear.model.units import (
    Force,
    Inertia,
    Length,
    Mass,
    Power,
    RotationalDamping,
    Speed,
    Stiffness,
    Time,
    Torque,
)


class Joint(Springs):
    """A connection of two members that rotate together: springs, or a hollow shaft as a beam.

    first, second: member names such as "stage_1.carrier". tangential: stiffness against u = r θ
    with the r of ``first`` (base radius, or centre distance of a carrier): torsion += tangential
    r². length, outer_diameter, inner_diameter: a shaft in place of the springs, from ``first``
    towards +z to ``second``. damping: of a damper between both members' rotations about the axis.
    """

    first: Member
    second: Member
    tangential: Stiffness = Field(default=0.0, ge=0.0, le=1e14)
    length: Length | None = Field(default=None, ge=1e-3, le=50.0)
    outer_diameter: Length | None = Field(default=None, ge=1e-3, le=5.0)
    inner_diameter: Length = Field(default=0.0, ge=0.0, le=5.0)
    damping: RotationalDamping = Field(default=0.0, ge=0.0, le=1e12)

    @property
    def is_shaft(self) -> bool:
        """Whether the joint is a shaft."""
        return self.length is not None

    @property
    def passes_bending(self) -> bool:
        """Whether it transmits forces along the axis and moments across it."""
        return self.is_shaft or (self.passes_thrust and max(self.stiffness[3:5]) > 0)

    @property
    def passes_thrust(self) -> bool:
        """Whether it transmits forces along the axis."""
        return self.is_shaft or self.stiffness[2] > 0

    def _check(self) -> None:
        if self.first == self.second:
            raise Refusal("second", f"joins {self.first} with itself", "name another member")
        springs = self.tangential > 0 or any(self.stiffness)
        if (self.length is None) != (self.outer_diameter is None):
            missing = "length" if self.length is None else "outer_diameter"
            raise Missing(missing, "is missing", "a shaft needs length and outer_diameter")
        if self.is_shaft and springs:
            raise Refusal("length", "is given beside springs", "keep the shaft or the springs")
        if self.outer_diameter is not None and self.inner_diameter >= self.outer_diameter:
            raise Refusal("inner_diameter", "is not below outer_diameter", "lower it")
        if not self.is_shaft and self.tangential <= 0 and self.stiffness[5] <= 0:
            remedy = "give torsion, tangential, or a shaft's length and outer_diameter"
            raise Refusal("torsion", "is zero, so the joint transmits no torque", remedy)


class Port(Section):
    """A port: torque enters or leaves the train at its member.

    member: name of the member, such as "stage_1.carrier". speed: rated speed. torque: rated torque
    on the member. inertia: polar inertia added to the member. mass, tilt_inertia (about a
    diameter), bearing: of the body behind the spline at the end of a sun's shaft. machine: machine
    in transients. damping: drag torque over speed of the member against the housing.
    """

    member: Member
    speed: Speed | None = Field(default=None, ge=-1e4, le=1e4)
    torque: Torque | None = Field(default=None, ge=-1e9, le=1e9)
    inertia: Inertia | None = Field(default=None, ge=0.0, le=1e12)
    mass: Mass | None = Field(default=None, ge=1e-3, le=1e7)
    tilt_inertia: Inertia | None = Field(default=None, ge=1e-9, le=1e12)
    bearing: Bearing | None = None
    machine: Machine | None = None
    damping: RotationalDamping = Field(default=0.0, ge=0.0, le=1e12)


class Input(Port):
    """A driven member. Speed and torque of the drive on the member are positive about +z. Of the P
    ports, inputs and output, of a train with mobility M (degrees of freedom), M have a speed and
    P - M a torque or power. [drive] is the machine of the first input.

    power: into the train, in place of the torque power / speed; needs the speed.
    """

    power: Power | None = Field(default=None, ge=-1e9, le=1e9)

    @property
    def given_torque(self) -> float | None:
        """Given torque on the member or that from power, N m; None if neither is given."""
        if self.power is not None and self.speed is not None:
            return self.power / self.speed
        return self.torque

    def _check(self) -> None:
        if self.power is None:
            return
        self._keep_one("power", "torque")
        if not self.speed:
            problem = "needs a speed" if self.speed is None else "has speed zero"
            raise Refusal("power", problem, "give speed, or torque in place of power")


class Output(Port):
    """The loaded member: torque of the load on the member, positive about +z.

    brake_exponent: T ~ |ω|^exponent in transients. brake_torque: T at rated speed in transients,
    that of statics if left out; machine replaces the brake.
    """

    brake_torque: Torque | None = Field(default=None, gt=0.0, le=1e9)
    brake_exponent: float = Field(default=1.0, ge=0.0, le=5.0)

    @property
    def given_torque(self) -> float | None:
        """Given torque on the member, N m; None if it follows from those of the inputs."""
        return self.torque

    def _check(self) -> None:
        refuse_infinite_slope(self.brake_exponent)
        if self.machine is not None and self.machine.law == "brake":
            brake = ("brake_torque", "brake_exponent")
            self._refuse_set(brake, "is given beside output.machine", "give it there")


_ZERO = (0.0, 0.0, 0.0)
_LIMITS = Field(ge=-1e9, le=1e9)
Forces = tuple[Annotated[Force, _LIMITS], Annotated[Force, _LIMITS], Annotated[Force, _LIMITS]]
Moments = tuple[Annotated[Torque, _LIMITS], Annotated[Torque, _LIMITS], Annotated[Torque, _LIMITS]]


def shafts(members: Sequence[str], ties: Iterable[tuple[str, str]]) -> dict[str, str]:
    """Shaft by member: the first of the members that ties, such as joints, connect to it."""
    shaft = {member: member for member in members}
    for first, second in ties:
        low, high = sorted((shaft[first], shaft[second]), key=members.index)
        shaft = {m: low if s == high else s for m, s in shaft.items()}
    return shaft


class MemberLoad(Section):
    """A force and a moment on a member, constant or a history, in fixed axes or the carrier's.

    A history is linear between its points and constant outside. Statics, modes and the power flow
    of the rated state use its value at t = 0.

    member: name of the member. force, moment: constant components along x, y, z. frame: axes of
    force and moment. times: times of the points of a history, increasing. forces, moments: x, y, z
    at each of these times; zero if left out. file: CSV of the points, a column time_s and some or
    all of the columns force_x_n, force_y_n, force_z_n, moment_x_nm, moment_y_nm, moment_z_nm.
    """

    member: Member
    force: Forces = _ZERO
    moment: Moments = _ZERO
    frame: Literal["fixed", "carrier"] = "fixed"
    times: tuple[Time, ...] = ()
    forces: tuple[Forces, ...] = Field(default=())
    moments: tuple[Moments, ...] = Field(default=())
    file: str | None = None

    @property
    def is_history(self) -> bool:
        """Whether the load is given over time."""
        return bool(self.times)

    @property
    def changes(self) -> bool:
        """Whether the load varies with time."""
        return bool(np.ptp(self.points, axis=0).any())

    @property
    def points(self) -> Array:
        """Force, N, and moment, N m, (T, 6) at ``times``; (1, 6) for a constant load."""
        if not self.times:
            return np.array([[*self.force, *self.moment]])
        zeros = (_ZERO,) * len(self.times)
        return np.hstack([self.forces or zeros, self.moments or zeros])

    @property
    def first(self) -> Array:
        """Force, N, and moment, N m, (6,) at t = 0, for statics."""
        return self.at(0.0)

    def at(self, time: ArrayLike) -> Array:
        """Force, N, and moment, N m, (…, 6) at times (…), s."""
        t, points = np.asarray(time, dtype=float), self.points
        if not self.times:
            return np.broadcast_to(points[0], (*t.shape, 6))
        return np.stack([np.interp(t, self.times, column) for column in points.T], axis=-1)

    def _check(self) -> None:
        if not (self.times or self.forces or self.moments or self.file):
            return
        for key in ("force", "moment"):
            if getattr(self, key) != _ZERO:
                raise Refusal(key, "is given beside a history", "keep one of them")
        if not self.times:
            raise Missing("times", "is missing", "give the times of the points, or a CSV file")
        if not self.forces and not self.moments:
            raise Missing("forces", "is missing", "give forces or moments at these times")
        for key in ("forces", "moments"):
            if (count := len(getattr(self, key))) not in (0, len(self.times)):
                problem = f"has {count} points for {len(self.times)} times"
                raise Refusal(key, problem, "give one at each time")
        if np.any(np.diff(self.times) <= 0):
            raise Refusal("times", "do not increase", "put them in order, each once")


def varying(loads: Sequence[MemberLoad]) -> tuple[tuple[int, int, float], ...]:
    """Components of load histories that are not zero: index of the load, index of the component,
    largest absolute value."""
    return tuple(
        (k, int(c), float(np.abs(load.points[:, c]).max()))
        for k, load in enumerate(loads)
        if load.is_history
        for c in np.flatnonzero(load.points.any(axis=0))
    )


def load_histories(loads: Sequence[MemberLoad], time: Array) -> Array:
    """Load histories (k, L) at times (k,), s: the L components of ``varying`` over their largest
    absolute values."""
    columns = [loads[k].at(time)[:, c] / size for k, c, size in varying(loads)]
    return np.column_stack(columns) if columns else np.zeros((len(time), 0))
