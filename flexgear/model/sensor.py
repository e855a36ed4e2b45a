"""Sensors of a case, and the recorder that samples them."""

from __future__ import annotations

import math
from collections.abc import Collection
from typing import TYPE_CHECKING, Literal

from pydantic import Field

from flexgear.model.errors import InputError, echo
from flexgear.model.names import BodyName, MemberName
from flexgear.model.read import nearest
from flexgear.model.section import Missing, Refusal, Section
from flexgear.model.units import Angle, Frequency, Length

if TYPE_CHECKING:
    from flexgear.model.case import Case

Measured = Literal["acceleration", "velocity", "displacement", "strain", "speed", "torque"]
MOTIONS = ("displacement", "velocity", "acceleration")  # by the order of their time derivative
LEAST_RATE = 2.2  # times the band, for the transition of the anti-alias filter
USUAL_RATE = 2.56  # times the band, as in most measuring systems
ON_AXIS = 1e-6  # m; points nearer to the axis are on it
_MAX_DISTANCE = 50.0  # m from the middle of the face


class Sensor(Section):
    """A sensor at one point; its signal is in SI units.

    On an FE mesh a sensor is at the point where a ray from the axis leaves the body, or at the
    surface point nearest to a given point. Positions are in the axes of the body at the start of
    the run.

    name: name in results. on: body, such as "stage.ring", "stage.carrier", "stage.planet_2" or
    "housing"; for a torque the member of an input or output, or the name of a joint, bearing or
    spline in results. measures: acceleration, velocity or displacement of the point; strain of the
    surface; speed of rotation, of an FE ring the mean over its teeth; torque about z. angle: of the
    ray from the x axis. z: of the ray, from the middle of the face. place: x, y, z of a point; the
    centre of a lumped body if left out.
    node: interface node of a body without FE mesh. tooth: number, from 1, of the ring's tooth in
    whose root fillet a strain gauge is, where the tangent is at 60° to the middle line of the tooth
    (ISO 6336-3). side: of that tooth, towards lower or higher angles; a planet that a carrier moves
    to higher angles loads the -theta side. grid_angle: direction of a strain gauge, 0 along the
    circumference (in a root along the profile), 90° along the axis. direction: of the motion at the
    point. vector: any other direction, in the body's axes, of any length. frame: "body" rotates
    with the body; "fixed" is fixed in space, as a probe that measures the displacement of a passing
    body.
    """

    name: str = Field(pattern=r"^[A-Za-z][A-Za-z0-9_.-]*$")
    on: str
    measures: Measured
    angle: Angle | None = None
    z: Length = 0.0
    place: tuple[Length, Length, Length] | None = None
    node: str | None = None
    tooth: int | None = Field(default=None, ge=1)
    side: Literal["-theta", "+theta"] = "-theta"
    grid_angle: Angle = 0.0
    direction: Literal["radial", "tangential", "x", "y", "z"] | None = None
    vector: tuple[float, float, float] | None = None
    frame: Literal["body", "fixed"] = "body"

    @property
    def order(self) -> int:
        """Order of the time derivative of displacement: 0, 1 velocity, 2 acceleration."""
        return MOTIONS.index(self.measures) if self.measures in MOTIONS else 0

    def _check(self) -> None:
        places = [k for k in ("angle", "place", "node", "tooth") if getattr(self, k) is not None]
        if len(places) > 1:
            raise Refusal(places[1], f"is given beside {places[0]}", "keep one of both")
        if self.tooth is None:
            self._refuse_set(["side"], "needs a tooth", "take it out, or give tooth")
        if self.tooth is None and self.angle is None:
            self._refuse_set(["z"], "needs an angle", "give angle_deg, or all of place_mm")
        if self.measures != "strain":
            self._refuse_set(["grid_angle"], "is for strain gauges")
        if self.measures == "strain" and self.angle is None and self.tooth is None:
            raise Missing("angle", "is missing, and so is tooth", "give the position of the gauge")
        if self.measures in ("speed", "torque") and places:
            raise Refusal(places[0], f"has no meaning for a {self.measures}", "take it out")
        if self.tooth is not None and self.measures != "strain":
            raise Refusal("tooth", "is for strain gauges", "give angle, place or node")
        is_motion = self.measures in MOTIONS
        if not is_motion:
            motion_keys = ("direction", "vector", "frame")
            self._refuse_set(motion_keys, f"has no meaning for a {self.measures}")
        if is_motion and (self.direction is None) == (self.vector is None):
            problem = "is missing" if self.direction is None else "is given beside vector"
            raise Refusal("direction", problem, 'give "radial", "x", …, or a vector, not both')
        if self.vector is not None and not 1e-100 < math.hypot(*self.vector) < 1e100:
            problem = f"is {math.hypot(*self.vector):g} long and so has no direction"
            raise Refusal("vector", problem, "give one that is not zero, such as [1, 0, 1]")
        on_axis = self.angle is None and self.node is None
        x, y, _ = place = self.place or (0.0, 0.0, 0.0)
        if max(map(abs, place)) > _MAX_DISTANCE:
            problem = f"is {max(map(abs, place)):g} m from the middle of the face"
            raise Refusal("place", problem, f"at most {_MAX_DISTANCE:g} m; check the unit")
        if self.direction in ("radial", "tangential") and on_axis and math.hypot(x, y) < ON_AXIS:
            problem = f"{self.direction} is undefined on the axis"
            raise Refusal("direction", problem, 'use "x", "y" or "z", or another place')


class Recorder(Section):
    """Sampling of all sensors.

    band: highest frequency that passes the anti-alias filter; if left out the band of the modes, at
    most sampling_rate / 2.56. sampling_rate: 2.56 times the band if left out.
    """

    band: Frequency | None = Field(default=None, gt=0.0, le=1e8)
    sampling_rate: Frequency | None = Field(default=None, gt=0.0, le=1e9)

    def _check(self) -> None:
        band, rate = self.band, self.sampling_rate
        if band is not None and rate is not None and rate < LEAST_RATE * band:
            raise Refusal(
                "sampling_rate",
                f"{rate:.6g} Hz is {rate / band:.3g} times the band of {band:.6g} Hz: higher "
                "frequencies would alias into it",
                f"at least {LEAST_RATE} times, {LEAST_RATE * band:.6g} Hz, or lower "
                "recorder.band_hz, or leave it out",
            )


def check_sensors(case: Case) -> None:
    """Check names, bodies and positions of the sensors of a case; raises Refusal."""
    for k, sensor in enumerate(case.sensors):
        key = f"sensors.{k}"
        if sensor.name in [other.name for other in case.sensors[:k]]:
            raise Refusal(f"{key}.name", f"{sensor.name} occurs twice", "give each a unique name")
        bodies = _bodies(case)
        if sensor.measures != "torque" and sensor.on not in bodies:
            raise Refusal(f"{key}.on", f"{echo(sensor.on)} is no body", nearest(sensor.on, bodies))
        if sensor.measures == "strain":
            _check_gauge(case, sensor, key)
        elif sensor.measures in MOTIONS:
            _check_point(case, sensor, key)
        _check_height(case, sensor, key)


def _bodies(case: Case) -> list[str]:
    """Names of the bodies on which a sensor may be."""
    planetary = [s for s in case.stages if s.planet is not None]
    planets = [f"{s.name}.planet_{k}" for s in planetary for k in range(1, s.planets + 1)]
    housing = ["housing"] if case.housing.kind != "rigid" else []
    return [*map(str, case.member_names()), *planets, *housing]


def _check_point(case: Case, sensor: Sensor, key: str) -> None:
    """Raise Refusal for a place on a lumped body other than ``place``, for no place on an FE body,
    for motion of a point of an FE planet, and for a sensor fixed in space at a planet."""
    at = BodyName.parse(sensor.on)
    planet = at.planet >= 0
    if sensor.on == "housing":
        fe, matrices = None, case.housing.kind == "reduced"
        form = "fe" if matrices else "lumped"
    else:
        stage = case.stage(at.stage)
        fe, form = getattr(stage.member(at.part), "fe", None), stage.form(at.part)
        matrices = fe is not None and fe.flexible and fe.fe_mesh == "reduced"
    for name in {"lumped": ("angle", "node"), "beam": ("angle",)}.get(form, ()):
        if getattr(sensor, name) is not None:
            problem = (
                f"has no meaning on {sensor.on}, a {'shaft' if form == 'beam' else 'lumped body'}"
            )
            raise Refusal(f"{key}.{name}", problem, "give place_mm, or nothing for its centre")
    if planet and form == "fe":
        problem = f"{sensor.on} is an FE planet, on which no motion is recovered"
        raise Refusal(f"{key}.on", problem, "name its carrier, or a lumped planet")
    if planet and sensor.frame == "fixed":
        problem, remedy = f"is fixed, and {sensor.on} passes once a turn", 'take frame = "body"'
        raise Refusal(f"{key}.frame", problem, f"{remedy}, or name the carrier or the ring")
    if sensor.node is not None or (sensor.place is not None and not matrices):
        return
    if matrices:
        problem = f"is missing, and {sensor.on} is given by matrices, without a surface"
        raise Missing(f"{key}.node", problem, "name a node of its fe_mesh_nodes")
    if form == "fe" and sensor.angle is None:
        problem = "is missing, and so are place_mm and node"
        raise Missing(f"{key}.angle", problem, "give angle_deg and z_mm, place_mm, or node")


def _check_height(case: Case, sensor: Sensor, key: str) -> None:
    """Raise Refusal for a place beside the teeth of a ring. The outside of one from a file may be
    wider than they are."""
    at = BodyName.parse(sensor.on)
    if at.part != "ring" or case.stage(at.stage).double_helical:
        return
    stage, fe = case.stage(at.stage), getattr(case.member(sensor.on), "fe", None)
    of_teeth = sensor.tooth is not None or getattr(fe, "fe_mesh", "") == "generate"
    if of_teeth and abs(sensor.z) > stage.face_width / 2:
        remedy = f"at most {5e2 * stage.face_width:g} mm from mid-face"
        raise Refusal(f"{key}.z", "is beside the ring", remedy)


def require_places(case: Case, rigid: Collection[BodyName]) -> None:
    """Raise InputError for a sensor at an angle on a rigid FE carrier, whose outside is that of its
    FE mesh."""
    for k, sensor in enumerate(case.sensors):
        at, moves = BodyName.parse(sensor.on), sensor.measures in MOTIONS
        if moves and at in rigid and at.part == "carrier" and sensor.angle is not None:
            problem = f"is on the FE mesh of {sensor.on}, which is rigid and has none"
            raise InputError(case.source, f"sensors[{k}].angle_deg", problem, "give place_mm")


def _check_gauge(case: Case, sensor: Sensor, key: str) -> None:
    """Raise Refusal for a strain gauge on a body without FE mesh or without its tooth."""
    at = MemberName.parse(sensor.on)
    body = getattr(case.member(sensor.on), "fe", None) if at.part in ("ring", "carrier") else None
    if body is None or getattr(body, "fe_mesh", "") == "reduced":
        problem = f"strain is measured on FE rings and carriers with an FE mesh, not on {sensor.on}"
        raise Refusal(f"{key}.on", problem, "name one of these")
    stage = case.stage(at.stage)
    if at.part == "ring" and stage.double_helical:
        raise Refusal(f"{key}.on", "is an FE ring in two halves, without gauges", "take it out")
    if sensor.tooth is not None and (at.part != "ring" or stage.ring is None):
        raise Refusal(f"{key}.tooth", "is for rings", "give angle")
    if sensor.tooth is not None and stage.ring is not None and sensor.tooth > stage.ring.teeth:
        problem = f"is {sensor.tooth}"
        raise Refusal(f"{key}.tooth", problem, f"the ring has {stage.ring.teeth} teeth")
