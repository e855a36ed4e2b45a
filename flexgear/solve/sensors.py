"""Sensors of a case on its coupled system: rows for the motion at their positions, and signals."""

import math
import warnings
from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from flexgear.analysis.equilibrium import Equilibrium
from flexgear.analysis.recording import SAMPLES, Clock, Quantity, Recorder
from flexgear.analysis.recovery import Recovery
from flexgear.analysis.transient import Transient
from flexgear.arrays import Array, Ints
from flexgear.coupling.build import require_nodes
from flexgear.coupling.pace import Pace
from flexgear.coupling.system import System
from flexgear.gears.geometry import stage_geometry
from flexgear.gears.radii import stage_radii
from flexgear.model.case import Case
from flexgear.model.errors import FlexgearWarning, InputError
from flexgear.model.names import MemberName, NodeName
from flexgear.model.sensor import ON_AXIS, USUAL_RATE, Sensor
from flexgear.solve.bodies import Bodies
from flexgear.solve.sensor_quantities import (
    Axes,
    BodyPoint,
    Motion,
    passing,
    rotated,
    rotation,
    torque,
)
from flexgear.structures.bodies import Body
from flexgear.structures.reduced import ReducedBody
from flexgear.structures.surface_strain import Ray, Surface

MAX_DISTANCE = 0.25  # of a position from the surface, over the longest edge of the nearest triangle
MODE_SAMPLES = 8  # least number in a period of the highest mode, whose motion is above many bands
AROUND = 180  # points of a body that turns past a sensor
NODES = {"shaft": "sun"}  # node that represents a flexible body; "drive" of other parts


@dataclass(frozen=True)
class SensorPlace:
    """A sensor of a case on its body; number: index of the sensor, for messages."""

    case: Case
    system: System
    bodies: Bodies
    sensor: Sensor
    number: int

    def quantity(self) -> Quantity:
        """The measured quantity. InputError for a position off the body."""
        sensor, system = self.sensor, self.system
        if sensor.measures == "speed":
            row = self._rotation
            return Quantity(self._motion(row, row[0] @ system.rolling).total, order=1)
        if sensor.measures == "strain":
            return Quantity(self._motion(self._strain()).elastic)
        place, rows = self.point
        direction, axes = self._direction(place), self._axes
        point = BodyPoint(self._motion(rows), axes, self._center, place, direction)
        if sensor.frame == "body" or not axes.turn:
            return point.on_body(sensor.order)
        fe_mesh, node = self._fe_mesh, sensor.node is not None
        if node and not self.body.rigid and math.hypot(*place[:2]) > ON_AXIS:
            problem = f"is fixed, and the node turns with {sensor.on}"
            raise self._refuse("frame", problem, 'take frame = "body", or a node on the axis')
        if node or self.body.rigid or fe_mesh is None:
            return point.in_space(sensor.order)
        angle = math.atan2(place[1], place[0])
        around = self._motion(self._rows_around(fe_mesh, angle, float(place[2]), direction))
        return passing(around, axes, angle + axes.start, sensor.order)

    def _motion(self, rows: Array, turns: Array | float = 0.0) -> Motion:
        return Motion(f"sensor {self.number}", rows, turns)

    @cached_property
    def body(self) -> Body:
        """The body of the sensor."""
        return self.system.body_of(self.sensor.on)

    @cached_property
    def node(self) -> str:
        """Name of the sensor's node, or of the node that represents the body."""
        nodes = self.body.node_names
        if self.sensor.node is not None:
            return self.sensor.node
        usual = NODES.get(self.body.name.part, "drive")
        return usual if usual in nodes else nodes[0]

    @property
    def _rotation(self) -> Array:
        """Row (1, d) of the rotation about z, rad: of the representative node; of an FE ring the
        mean Σ (x u_y − y u_x)/Σ (x² + y²) over its teeth, each of which tilts as planets pass."""
        body, system = self.body, self.system
        teeth = [n for n in body.node_names if NodeName.parse(n).kind == "tooth"]
        if not teeth:
            return system.node_rows(body.name, self.node)[5:]
        places = np.array([body.position(tooth) for tooth in teeth])
        rows = np.array([system.node_rows(body.name, tooth)[:2] for tooth in teeth])
        turned = np.einsum("j,jd->d", places[:, 0], rows[:, 1])
        turned -= np.einsum("j,jd->d", places[:, 1], rows[:, 0])
        return np.asarray(turned[None] / np.square(places[:, :2]).sum())

    @property
    def _fe_mesh(self) -> ReducedBody | None:
        """The reduced body if it has an FE mesh, else None."""
        reduced = self.bodies.get(self.body.name.alike)
        return reduced if reduced is not None and len(reduced.points) else None

    def _refuse(self, key: str, problem: str, remedy: str) -> InputError:
        return InputError(self.case.source, f"sensors[{self.number}].{key}", problem, remedy)

    @cached_property
    def _axes(self) -> Axes:
        """Rotation of frame and body."""
        name, system = self.body.name, self.system
        angle = -1
        if name in system.ring_frames:
            angle = system.ring_frames[name]
        elif name.stage:
            frame = system.frames[name.stage]
            angle = frame.ring if name.part == "hub" else frame.carrier
        frame_row = system.angles[angle] if angle >= 0 else np.zeros(system.size)
        body_row = system.node_rows(name, self.node)[5]
        return Axes(frame_row @ system.rolling, body_row @ system.rolling, self._start)

    @property
    def _start(self) -> float:
        """Angle of axes at the start, rad: of a planet, or of a gear from its pinion; else 0."""
        name = self.body.name
        if name.part == "planet" or name.part == "gear":
            return self.case.stage(name.stage).planet_angles[max(name.planet, 0)]
        return 0.0

    @property
    def _center(self) -> Array:
        """Centre (3,) of the body in its frame, m; the origin except for planets."""
        if self.body.name.part != "planet":
            return np.zeros(3)
        radii = stage_radii(self.case.view(self.body.name.stage))
        return np.array([radii.center_distance, 0.0, 0.0])

    def _direction(self, place: Array) -> Array:
        """Direction (3,) of the sensor at a position (3,), as unit vector in the body's axes."""
        sensor = self.sensor
        if sensor.vector is not None:
            return np.asarray(sensor.vector, dtype=float) / np.linalg.norm(sensor.vector)
        angle = math.atan2(place[1], place[0])
        radial = np.array([math.cos(angle), math.sin(angle), 0.0])
        x, y, z = np.eye(3)
        tangential = np.cross(z, radial)
        named = {"x": x, "y": y, "z": z, "radial": radial, "tangential": tangential}
        return named[sensor.direction or "x"]

    @cached_property
    def point(self) -> tuple[Array, Array]:
        """Position (3,) in the body's axes, m, and rows (6, d): on rigid bodies displacement of the
        frame's origin and rotation; on an FE mesh displacement of the point, and zero rows."""
        sensor, body, fe_mesh = self.sensor, self.body, self._fe_mesh
        if fe_mesh is not None and sensor.node is None and not body.rigid:
            place, vertices, weights = self._on_surface(fe_mesh)
            rows = np.zeros((6, self.system.size))
            columns = self.system.slice_of(body.name)
            rows[:3, columns] = Surface(fe_mesh).motion(vertices, weights)
            return place, rows
        rows, node = self.system.node_rows(body.name, self.node), body.position(self.node)
        if not body.rigid and sensor.place is None:
            rows[3:] = 0.0
            return node, rows
        place = self._on_rigid(fe_mesh, node)
        rows[:3] -= np.cross(rows[3:], node, axisa=0, axisc=0)  # displacement of the frame's origin
        return place, rows

    def _on_rigid(self, fe_mesh: ReducedBody | None, node: Array) -> Array:
        """Position (3,) of the sensor on a rigid body, m; node (3,): position of its node."""
        sensor, body = self.sensor, self.body
        if sensor.place is not None:
            return np.asarray(sensor.place, dtype=float)
        if sensor.angle is None:
            return node
        if fe_mesh is not None:
            return self._on_surface(fe_mesh)[0]
        assert body.name.part == "ring"  # require_places refuses angles on rigid carriers
        view = self.case.view(body.name.stage)
        radius = stage_geometry(view).ring.root_radius + view.ring.rim_thickness
        c, s = math.cos(sensor.angle), math.sin(sensor.angle)
        return np.array([radius * c, radius * s, sensor.z])

    def _on_surface(self, fe_mesh: ReducedBody) -> tuple[Array, Ints, Array]:
        """Position (3,) of the sensor on the surface of an FE mesh, m, with the numbers (3,) and
        weights (3,) of the vertices around it. InputError for a position off the body."""
        sensor, surface = self.sensor, Surface(fe_mesh)
        points = np.asarray(fe_mesh.points, dtype=float)
        if sensor.place is not None:
            vertices, weights, distance = surface.nearest(np.asarray(sensor.place, dtype=float))
            if distance > MAX_DISTANCE * surface.coarseness(vertices):
                raise self._off_body("place_mm", distance)
            return weights @ points[vertices], vertices, weights
        assert sensor.angle is not None
        meeting = surface.meeting(Ray(sensor.angle, sensor.z))
        if meeting is None:
            radius = float(np.hypot(points[:, 0], points[:, 1]).max())
            c, s = math.cos(sensor.angle), math.sin(sensor.angle)
            outside = np.array([radius * c, radius * s, sensor.z])
            raise self._off_body("z_mm", surface.nearest(outside)[2])
        vertices, weights, _ = meeting
        return weights @ points[vertices], vertices, weights

    def _off_body(self, key: str, distance: float) -> InputError:
        problem = f"is {1e3 * distance:.4g} mm from the nearest surface of {self.sensor.on}"
        return self._refuse(key, problem, "give a place on the body, in its axes")

    def _rows_around(
        self, fe_mesh: ReducedBody, angle: float, height: float, direction: Array
    ) -> Array:
        """Rows (AROUND, d) of the displacements of points around the body at a height z, m, each in
        the direction of the sensor at its passage; direction (3,): at ``angle``, rad. InputError
        for a surface with gaps."""
        angles = 2 * np.pi * np.arange(AROUND) / AROUND
        surface, columns = Surface(fe_mesh), self.system.slice_of(self.body.name)
        rows, directions = np.zeros((AROUND, self.system.size)), rotated(direction, angles - angle)
        for row, point_angle, along in zip(rows, angles, directions, strict=True):
            meeting = surface.meeting(Ray(float(point_angle), height))
            if meeting is None:
                problem = f"is fixed, and {self.sensor.on} has gaps around its axis at this height"
                raise self._refuse("frame", problem, 'take frame = "body", or another z')
            row[columns] = along @ surface.motion(*meeting[:2])
        return rows

    def _strain(self) -> Array:
        """Row (1, d) of a strain gauge, zero on a rigid body. InputError off the FE mesh."""
        sensor, body = self.sensor, self.body
        rows = np.zeros((1, self.system.size))
        if body.rigid:
            return rows
        if sensor.tooth is not None and self.case.solver.fidelity == "quick":
            warnings.warn(
                f"sensor {sensor.name}: the strain in a tooth root may be several times too small "
                'on the coarse elements of solver.fidelity = "quick"; take "standard" or "fine"',
                FlexgearWarning,
                stacklevel=2,
            )
        fe_mesh = self._fe_mesh
        if fe_mesh is None:
            raise self._refuse("on", f"{sensor.on} has no FE mesh", "name a body that has one")
        strain = Surface(fe_mesh).strain([self._ray()]).along([sensor.grid_angle])
        if np.isnan(strain).any():
            self._on_surface(fe_mesh)  # raises an error that states the distance
            raise self._refuse("tooth", "is outside the FE mesh", "compare z with the face")
        rows[:, self.system.slice_of(body.name)] = strain
        return rows

    def _ray(self) -> Ray:
        """Ray that meets a strain gauge: on the outer surface, or in a root at the critical section
        of a tooth, whose angle depends on z by the helix."""
        sensor = self.sensor
        if sensor.tooth is None:
            assert sensor.angle is not None  # the input has either tooth or angle
            return Ray(sensor.angle, sensor.z)
        view = self.case.view(MemberName.parse(sensor.on).stage)
        geometry, stage = stage_geometry(view), view.stage
        hand = 1.0 if stage.planet_hand == "right" else -1.0
        twist = hand * math.tan(stage.helix_angle) / geometry.ring.reference_radius
        section = geometry.ring.root.section
        angle = math.atan2(section.thickness / 2, section.distance)
        side = -1.0 if sensor.side == "-theta" else 1.0
        middle = geometry.ring.pitch_angle * (sensor.tooth - 1) + twist * sensor.z
        return Ray(middle + side * angle, sensor.z, first=True)


UNITS = {
    "acceleration": "m/s2", "velocity": "m/s", "displacement": "m", "strain": "1",
    "speed": "rad/s", "torque": "N m",
}  # fmt: skip
STATIC = ("displacement", "strain", "torque")  # quantities with values in equilibria


@dataclass(frozen=True)
class Sensors:
    """The sensors of a case, their sampling and their measured quantities."""

    sensors: tuple[Sensor, ...]
    clock: Clock
    quantities: tuple[Quantity, ...]

    @property
    def labels(self) -> dict[str, Any]:
        """Coordinates along the axis ``sensor``."""
        return {
            "sensor": [s.name for s in self.sensors],
            "sensor_quantity": [s.measures for s in self.sensors],
            "sensor_unit": [UNITS[s.measures] for s in self.sensors],
        }

    @property
    def static_labels(self) -> dict[str, Any]:
        """Coordinates along the axis of sensors with values in equilibria."""
        static = [s for s in self.sensors if s.measures in STATIC]
        return {
            "static_sensor": [s.name for s in static],
            "static_sensor_unit": [UNITS[s.measures] for s in static],
        }

    def static(self, recovery: Recovery) -> Array:
        """Values (p, s) of sensors in equilibria."""
        assert isinstance(recovery.result, Equilibrium)
        return self._signals(recovery, STATIC, 0.0)

    def periodic(self, recovery: Recovery, omega: float) -> Array:
        """Signals (n, s) at the n samples of a period of a steady state, with the train at angle
        zero; omega: 2π over the period, rad/s."""
        return self._signals(recovery, UNITS, omega)

    def _signals(self, recovery: Recovery, measures: Collection[str], omega: float) -> Array:
        """Signals (t, s) of the sensors of some measures over samples of a period 2π/omega."""
        columns = [np.zeros((len(recovery.rotations), 0))]
        for sensor, quantity in zip(self.sensors, self.quantities, strict=True):
            if sensor.measures in measures:
                columns.append(quantity.over_period(recovery, omega)[:, None])
        return np.hstack(columns)

    def recorder(self, step: float, rotations: int) -> Recorder:
        """The recorder of a run with a shortest sample interval ``step``, s, for the signals of all
        sensors and then a number of independent rotations."""
        turns = [rotation(unit) for unit in np.eye(rotations)]
        return Recorder(replace(self.clock, step=step), [*self.quantities, *turns])

    def record(self, recorder: Recorder, recovery: Recovery) -> tuple[Array, Array, Array]:
        """Times (m,), s, signals (m, s) and independent rotations (m, F), rad, after adding the
        samples of ``recovery``."""
        assert isinstance(recovery.result, Transient)
        time, values = recorder.append(recovery.result.time, recovery)
        count = len(self.quantities)
        return time, values[:, :count], values[:, count:]


def sensors_of(case: Case, system: System, bodies: Bodies, pace: Pace) -> Sensors | None:
    """Sensors of a case; None without any. InputError for a position off the body, a body without
    FE mesh, or a band above that of the modes."""
    if not case.sensors:
        return None
    quantities = tuple(_quantities(case, system, bodies))
    return Sensors(case.sensors, clock_of(case, pace), quantities)


def clock_of(case: Case, pace: Pace) -> Clock:
    """Band and sampling rate of the recorder. Its samples of a run resolve the highest modes, too,
    whose vibration is aliased into a lower band otherwise. InputError for a band above that of the
    modes."""
    top = min(pace.band, pace.modes_to or pace.band)
    band, rate = case.recorder.band, case.recorder.sampling_rate
    if band is None:
        band = top if rate is None else min(top, rate / USUAL_RATE)
    if band > top * (1 + 1e-9):
        problem = f"{band:.6g} Hz is beyond {top:.6g} Hz, up to which modes are kept"
        remedy = (
            "lower it, or raise solver.modes_band_hz or solver.gear_mesh_orders (and modes_to_hz)"
        )
        raise InputError(case.source, "recorder.band_hz", problem, remedy)
    rate = USUAL_RATE * band if rate is None else rate
    return Clock(band, rate, 1.0 / max(SAMPLES * band, MODE_SAMPLES * top))


def _quantities(case: Case, system: System, bodies: Bodies) -> Iterator[Quantity]:
    require_nodes(case, system)
    for k, sensor in enumerate(case.sensors):
        if sensor.measures == "torque":
            yield torque(sensor.on)
        else:
            yield SensorPlace(case, system, bodies, sensor, k).quantity()
