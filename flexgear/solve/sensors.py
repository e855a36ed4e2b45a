"""Sensors of a case on its coupled system: rows that recover their places, and their signals."""

from __future__ import annotations

import math
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
from flexgear.coupling.pace import Pace
from flexgear.coupling.system import System
from flexgear.gears.geometry import stage_geometry
from flexgear.gears.radii import stage_radii
from flexgear.model.case import Case
from flexgear.model.errors import InputError
from flexgear.model.names import BodyName, MemberName
from flexgear.model.read import nearest
from flexgear.model.section import Refusal
from flexgear.model.sensor import USUAL_RATE, Sensor, check_rate
from flexgear.solve.bodies import Bodies
from flexgear.solve.sensor_quantities import (
    Axes,
    BodyPoint,
    Motion,
    passing,
    rotation,
    torque,
    turned,
)
from flexgear.structures.bodies import Body
from flexgear.structures.reduced import ReducedBody
from flexgear.structures.surface_strain import Ray, Surface

BESIDE = 0.25  # of the longest edge of a triangle of the surface: how far a place may be off it
AROUND = 180  # points of a body that turns past a place
NODES = {"shaft": "sun"}  # that stand for a body; of others "drive", or the first


def torque_names(system: System) -> list[str]:
    """Ports and springs whose torque a sensor may measure."""
    links = [link.name for link in system.links if len(link.rows) == 6]
    turning = [support.name for support in system.rotating_frame_supports]
    return list(dict.fromkeys([*(port.name for port in system.ports), *links, *turning]))


@dataclass(frozen=True)
class SensorPlace:
    """The ``number``-th sensor of a case on its body."""

    case: Case
    system: System
    bodies: Bodies
    sensor: Sensor
    number: int

    def quantity(self) -> Quantity:
        """The measured quantity. InputError for a position off the body."""
        sensor, system = self.sensor, self.system
        if sensor.measures == "speed":
            row = system.node_rows(self.body.name, self.node)[5:]
            return Quantity(self._motion(row, row[0] @ system.rolling).whole, order=1)
        if sensor.measures == "strain":
            return Quantity(self._motion(self._strain()).elastic)
        self._require_place()
        place, rows = self.point
        direction, axes = self._direction(place), self._axes
        point = BodyPoint(self._motion(rows), axes, self._center, place, direction)
        if sensor.frame == "body" or not axes.turn:
            return point.turning(sensor.order)
        if self.body.rigid or self._fe_mesh is None:
            return point.in_space(sensor.order)
        angle = math.atan2(place[1], place[0])
        around = self._motion(self._rows_around(self._fe_mesh, angle, float(place[2]), direction))
        return passing(around, axes, angle + axes.start, sensor.order)

    def _motion(self, rows: Array, turns: Array | float = 0.0) -> Motion:
        return Motion(f"sensor {self.number}", rows, turns)

    @cached_property
    def body(self) -> Body:
        """The body that carries the sensor: the shaft of a sun, the left half of a divided ring."""
        on = BodyName.parse(self.sensor.on)
        names = [on, BodyName.of(on.stage, on.part, side="left")]
        if on.part == "sun":
            names.append(BodyName.of(on.stage, "shaft"))
        name = next(n for n in names if any(b.name == n for b in self.system.bodies))
        return self.system.body(name)

    @cached_property
    def node(self) -> str:
        """Name of the node that the sensor is on, or that represents the body."""
        nodes = self.body.node_names
        if self.sensor.node is not None:
            return self.sensor.node
        usual = NODES.get(self.body.name.part, "drive")
        return usual if usual in nodes else nodes[0]

    @property
    def _fe_mesh(self) -> ReducedBody | None:
        """The body with its FE mesh, where it is flexible and has one."""
        reduced = self.bodies.get(self.body.name.alike)
        return reduced if reduced is not None and len(reduced.points) else None

    def _refuse(self, key: str, problem: str, remedy: str) -> InputError:
        return InputError(self.case.source, f"sensors[{self.number}].{key}", problem, remedy)

    def _require_place(self) -> None:
        """InputError for a sensor that its body cannot carry."""
        sensor, body = self.sensor, self.body
        planet, single = body.name.part == "planet", len(body.node_names) == 1
        if planet and not single:
            problem = f"{sensor.on} is an FE planet, on which no motion is recovered"
            raise self._refuse("on", problem, "name its carrier, or a lumped planet")
        if planet and sensor.frame == "fixed":
            remedy = 'take frame = "body", or name the carrier or the ring'
            raise self._refuse("frame", f"is fixed, and {sensor.on} passes once a turn", remedy)
        if sensor.node is not None and sensor.node not in body.node_names:
            remedy = nearest(sensor.node, list(body.node_names))
            raise self._refuse("node", f"{sensor.node} is no node of {sensor.on}", remedy)
        without = not body.rigid and self._fe_mesh is None and body.name.part != "shaft"
        if without and sensor.node is None:
            problem = f"is needed, as {sensor.on} has no FE mesh"
            raise self._refuse("node", problem, f"name one of {', '.join(body.node_names[:6])} …")
        if single and sensor.angle is not None:
            problem = f"has no sense on {sensor.on}, which is a point with inertia"
            raise self._refuse("angle_deg", problem, "give place_mm, or nothing for its centre")

    @cached_property
    def _axes(self) -> Axes:
        """Rotation of frame and body."""
        name, system = self.body.name, self.system
        at = -1
        if name in system.ring_frames:
            at = system.ring_frames[name]
        elif name.stage:
            frame = system.frames[name.stage]
            at = frame.ring if name.part == "hub" else frame.carrier
        turn = system.angles[at] if at >= 0 else np.zeros(system.size)
        spin = system.node_rows(name, self.node)[5]
        return Axes(turn @ system.rolling, spin @ system.rolling, self._start)

    @property
    def _start(self) -> float:
        """Angle of the body's axes at the start, rad: of a planet, or of a gear beside its pinion;
        else 0."""
        name = self.body.name
        if name.part == "planet" or name.part == "gear":
            return self.case.stage(name.stage).planet_angles[max(name.planet, 0)]
        return 0.0

    @property
    def _center(self) -> Array:
        """Centre (3,) of the body in its frame, m; only that of a planet is off the origin."""
        if self.body.name.part != "planet":
            return np.zeros(3)
        radii = stage_radii(self.case.view(self.body.name.stage))
        return np.array([radii.center_distance, 0.0, 0.0])

    def _direction(self, place: Array) -> Array:
        """Unit vector (3,) of the sensor in the body's axes, at a position in them."""
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
        """Position (3,) in the body's axes, m, and rows (6, d): displacement of the point, and
        rotation about the frame's origin of the rigid body that it belongs to, zero on an FE
        mesh."""
        sensor, body, fe_mesh = self.sensor, self.body, self._fe_mesh
        if fe_mesh is not None and sensor.node is None and not body.rigid:
            place, vertices, weights = self._on_surface(fe_mesh)
            rows = np.zeros((6, self.system.size))
            columns = self.system.slice_of(body.name)
            rows[:3, columns] = Surface(fe_mesh).motion(vertices, weights)
            return place, rows
        rows, at = self.system.node_rows(body.name, self.node), body.position(self.node)
        if not body.rigid and sensor.place is None:
            rows[3:] = 0.0
            return at, rows
        place = self._on_rigid(fe_mesh, at)
        rows[:3] -= np.cross(rows[3:], at, axisa=0, axisc=0)  # of the frame's origin
        return place, rows

    def _on_rigid(self, fe_mesh: ReducedBody | None, node: Array) -> Array:
        """Position (3,) on a rigid body, m."""
        sensor, body = self.sensor, self.body
        if sensor.place is not None:
            return np.asarray(sensor.place, dtype=float)
        if sensor.node is not None or len(body.node_names) == 1:
            return node
        if fe_mesh is not None:
            return self._on_surface(fe_mesh)[0]
        if body.name.part == "ring" and sensor.angle is not None:
            view = self.case.view(body.name.stage)
            radius = stage_geometry(view).ring.root_radius + view.ring.rim_thickness
            c, s = math.cos(sensor.angle), math.sin(sensor.angle)
            return np.array([radius * c, radius * s, sensor.z])
        raise self._refuse("place_mm", f"is needed, as {sensor.on} is rigid", "give x, y, z")

    def _on_surface(self, fe_mesh: ReducedBody) -> tuple[Array, Ints, Array]:
        """Position (3,), m, on the surface of an FE mesh, vertices (3,) around it and their
        weights."""
        sensor, surface = self.sensor, Surface(fe_mesh)
        points = np.asarray(fe_mesh.points, dtype=float)
        if sensor.place is None and sensor.angle is None:
            raise self._refuse("angle_deg", "is missing", "give angle and z, place_mm, or node")
        if sensor.place is not None:
            vertices, weights, away = surface.nearest(np.asarray(sensor.place, dtype=float))
            if away > BESIDE * surface.coarseness(vertices):
                raise self._beside("place_mm", away)
            return weights @ points[vertices], vertices, weights
        assert sensor.angle is not None
        meeting = surface.meeting(Ray(sensor.angle, sensor.z))
        if meeting is None:
            radius = float(np.hypot(points[:, 0], points[:, 1]).max())
            c, s = math.cos(sensor.angle), math.sin(sensor.angle)
            outside = np.array([radius * c, radius * s, sensor.z])
            raise self._beside("z_mm", surface.nearest(outside)[2])
        vertices, weights, _ = meeting
        return weights @ points[vertices], vertices, weights

    def _beside(self, key: str, away: float) -> InputError:
        problem = f"is {1e3 * away:.4g} mm from the nearest surface of {self.sensor.on}"
        return self._refuse(key, problem, "give a place on the body, in its axes")

    def _rows_around(
        self, fe_mesh: ReducedBody, angle: float, height: float, direction: Array
    ) -> Array:
        """Displacements of points around the body at a height, m: rows (AROUND, d), each along the
        direction (3,) at an angle, rad, as its point has it when it passes there."""
        angles = 2 * np.pi * np.arange(AROUND) / AROUND
        surface, of_body = Surface(fe_mesh), self.system.slice_of(self.body.name)
        rows = np.zeros((AROUND, self.system.size))
        for row, at, along in zip(rows, angles, turned(direction, angles - angle), strict=True):
            meeting = surface.meeting(Ray(float(at), height))
            if meeting is None:
                problem = f"is fixed, and {self.sensor.on} has gaps around its axis at this height"
                raise self._refuse("frame", problem, 'take frame = "body", or another z')
            row[of_body] = along @ surface.motion(*meeting[:2])
        return rows

    def _strain(self) -> Array:
        """Row (1, d) of a strain gauge; zero on a rigid body."""
        sensor, body = self.sensor, self.body
        rows = np.zeros((1, self.system.size))
        if body.rigid:
            return rows
        fe_mesh = self._fe_mesh
        if fe_mesh is None:
            raise self._refuse("on", f"{sensor.on} has no FE mesh", "name a body that has one")
        strain = Surface(fe_mesh).strain([self._ray()]).along([sensor.grid_angle])
        if np.isnan(strain).any():
            self._on_surface(fe_mesh)  # says how far away it is
            raise self._refuse("tooth", "is outside the FE mesh", "compare z with the face")
        rows[:, self.system.slice_of(body.name)] = strain
        return rows

    def _ray(self) -> Ray:
        """Ray that locates a strain gauge: on the outer surface, or in a root at the tooth's
        critical section, which the helix turns with z."""
        sensor = self.sensor
        if sensor.tooth is None:
            assert sensor.angle is not None  # the model wants one of both
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
STATIC = ("displacement", "strain", "torque")  # what an equilibrium has


@dataclass(frozen=True)
class Sensors:
    """The sensors of a case and their measured quantities."""

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
        """Coordinates along the axis of sensors that have a value in equilibrium."""
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
        """Signals (n, s) over n samples of a period of a steady state, the train as it stands at
        angle zero; omega: 2π over the period, rad/s."""
        return self._signals(recovery, UNITS, omega)

    def _signals(self, recovery: Recovery, measures: Collection[str], omega: float) -> Array:
        """(t, s) of the sensors of some measures."""
        columns = [np.zeros((len(recovery.rotations), 0))]
        for sensor, quantity in zip(self.sensors, self.quantities, strict=True):
            if sensor.measures in measures:
                columns.append(quantity.over_period(recovery, omega)[:, None])
        return np.hstack(columns)

    def recorder(self, step: float, rotations: int) -> Recorder:
        """The recorder of a run whose shortest step is ``step`` s; it gives signals and so many
        independent rotations."""
        turns = [rotation(unit) for unit in np.eye(rotations)]
        return Recorder(replace(self.clock, step=step), [*self.quantities, *turns])

    def record(self, recorder: Recorder, recovery: Recovery) -> tuple[Array, Array, Array]:
        """Times (m,), signals (m, s) and independent rotations (m, F) of the next samples."""
        assert isinstance(recovery.result, Transient)
        time, values = recorder.append(recovery.result.time, recovery)
        count = len(self.quantities)
        return time, values[:, :count], values[:, count:]


def sensors_of(case: Case, system: System, bodies: Bodies, pace: Pace) -> Sensors | None:
    """Sensors of a case; None without any. InputError for a position off the body, a body without
    FE mesh, and a band beyond that of the modes."""
    if not case.sensors:
        return None
    quantities = tuple(_quantities(case, system, bodies))
    return Sensors(case.sensors, clock_of(case, pace), quantities)


def clock_of(case: Case, pace: Pace) -> Clock:
    """Band and sampling rate of the recorder. InputError for a band beyond that of the modes."""
    top = min(pace.band, pace.modes_to or pace.band)
    band = top if case.recorder.band is None else case.recorder.band
    if band > top * (1 + 1e-9):
        raise InputError(
            case.source,
            "recorder.band_hz",
            f"{band:.6g} Hz is beyond {top:.6g} Hz, up to which modes are kept",
            "lower it, or raise solver.modes_band_hz or solver.gear_mesh_orders (and modes_to_hz)",
        )
    rate = case.recorder.sampling_rate
    try:
        check_rate(band, rate := USUAL_RATE * band if rate is None else rate)
    except Refusal as fault:
        key, problem, remedy = "recorder.sampling_rate_hz", fault.problem, fault.remedy
        raise InputError(case.source, key, problem, remedy) from None
    return Clock(band, rate, 1.0 / (SAMPLES * band))


def _quantities(case: Case, system: System, bodies: Bodies) -> Iterator[Quantity]:
    for k, sensor in enumerate(case.sensors):
        if sensor.measures == "torque":
            names = torque_names(system)
            if sensor.on not in names:
                problem = f"{sensor.on} is no port, joint or bearing that passes a torque"
                remedy = nearest(sensor.on, names)
                raise InputError(case.source, f"sensors[{k}].on", problem, remedy)
            yield torque(sensor.on)
        else:
            yield SensorPlace(case, system, bodies, sensor, k).quantity()
