"""What sensors make of recovered motions: displacement, its rates, strain, speed, torque.

A point of a body, in fixed axes, with the body's frame turned by α and the body itself by ψ:

    p = R(α) c + R(ψ) X + u + r × R(ψ) X,   u = R(α) u_f,   r = R(α) r_f

c: centre in the frame; X: place in the body; u_f, r_f: recovered displacement and rotation in the
frame's axes, rolling taken off. A sensor that turns with the body measures the displacement u + r ×
R(ψ) X, or dp/dt, d²p/dt² of the whole motion, along R(ψ) e. One that stands in space sees the
displacement of what passes there, and its rates at that place.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from flexgear.analysis.recording import AROUND, local_weights
from flexgear.analysis.recovery import Recovery
from flexgear.arrays import Array
from flexgear.coupling.system import System


@dataclass
class Columns:
    """What gives them: rows of elastic motion, multiples of the independent rotations, torques of
    ports and of springs."""

    system: System
    count: int = 0
    rows: list[Array] = field(default_factory=list)
    row_columns: list[int] = field(default_factory=list)
    angles: list[Array] = field(default_factory=list)
    angle_columns: list[int] = field(default_factory=list)
    torques: dict[int, str] = field(default_factory=dict)

    def motion(self, rows: Array) -> int:
        """First of the columns of rows (k, d)."""
        first, self.count = self.count, self.count + len(rows)
        self.rows += list(rows)
        self.row_columns += range(first, self.count)
        return first

    def rolling(self, row: Array) -> int:
        """Column of what a row (d,) is when the train rolls without deflection."""
        self.angles.append(row @ self.system.rolling)
        self.angle_columns.append(self.count)
        self.count += 1
        return self.count - 1

    def torque(self, name: str) -> int:
        """Column of a port's or a spring's torque about z."""
        self.torques[self.count] = name
        self.count += 1
        return self.count - 1

    def values(self, recovery: Recovery) -> Array:
        """(t, columns) of all samples."""
        result = recovery.result
        out = np.empty((len(result.theta), self.count))
        if self.rows:
            out[:, self.row_columns] = recovery.named("sensors", lambda: np.vstack(self.rows))
        if self.angles:
            out[:, self.angle_columns] = recovery.rotations @ np.array(self.angles).T
        ports = [port.name for port in self.system.ports]
        for column, name in self.torques.items():
            if name in ports:
                out[:, column] = result.torques[:, ports.index(name)]
            else:
                out[:, column] = recovery.link_force(name)[:, 5]
        return out


def turned(vectors: Array, angles: Array) -> Array:
    """Vectors (n, 3) or (3,) turned by angles (n,) about z."""
    c, s = np.cos(angles), np.sin(angles)
    x, y, z = np.moveaxis(np.asarray(vectors, dtype=float), -1, 0)
    return np.stack([c * x - s * y, s * x + c * y, np.broadcast_to(z, c.shape)], axis=1)


class _Single:
    """A quantity whose position is one number."""

    def part(self, derivative: Array, position: Array) -> Array:
        return derivative[:, 0]


@dataclass(frozen=True)
class ScalarQuantity(_Single):
    """A sum of columns, or its rate: strain, torque, speed of rotation."""

    columns: tuple[int, ...]
    order: int = 0

    def position(self, values: Array) -> Array:
        return np.asarray(values[:, self.columns].sum(axis=1, keepdims=True))


@dataclass(frozen=True)
class Axes:
    """Columns that hold α and ψ; start: both at the begin of the run, rad."""

    frame: int
    spin: int
    start: float = 0.0

    def of_frame(self, values: Array) -> Array:
        """α (n,) rad."""
        return np.asarray(values[:, self.frame] + self.start)

    def of_body(self, values: Array) -> Array:
        """ψ (n,) rad."""
        return np.asarray(values[:, self.spin] + self.start)


@dataclass(frozen=True)
class PointQuantity:
    """Of a point along a direction (3,) that turn with the body, by ψ in the last column of its
    position. motion: first of six columns u_f, r_f; center, lever (3,): c and X, m."""

    motion: int
    axes: Axes
    center: Array
    lever: Array
    direction: Array
    order: int

    def position(self, values: Array) -> Array:
        alpha, psi, at = self.axes.of_frame(values), self.axes.of_body(values), self.motion
        lever = turned(self.lever, psi)
        place = turned(values[:, at : at + 3], alpha)
        place += np.cross(turned(values[:, at + 3 : at + 6], alpha), lever)
        if self.order > 0:
            place += lever + turned(self.center, alpha)
        return np.column_stack([place, psi])

    def part(self, derivative: Array, position: Array) -> Array:
        along = turned(self.direction, position[:, 3])
        return np.asarray(np.einsum("ni,ni->n", derivative[:, :3], along))


@dataclass(frozen=True)
class FixedQuantity(_Single):
    """Of a rigid body that turns, at a place (3,) and along a direction (3,) in space."""

    motion: int
    axes: Axes
    place: Array
    direction: Array
    order: int

    def position(self, values: Array) -> Array:
        alpha, at = self.axes.of_frame(values), self.motion
        moved = turned(values[:, at : at + 3], alpha)
        moved += np.cross(turned(values[:, at + 3 : at + 6], alpha), self.place)
        return np.asarray(moved @ self.direction)[:, None]


@dataclass(frozen=True)
class PassingQuantity(_Single):
    """Displacement that a sensor fixed in space sees of a body turning past it, at an angle, rad.

    It is interpolated between ``count`` points spread evenly round the body, the first at angle
    zero, whose displacements are the recovered columns from ``first`` on.
    """

    first: int
    count: int
    axes: Axes
    angle: float
    order: int

    def position(self, values: Array) -> Array:
        places = (self.angle - self.axes.of_body(values)) * self.count / (2 * np.pi)
        below = np.floor(places).astype(int)
        around = below[:, None] + np.arange(AROUND) - (AROUND // 2 - 1)
        weights = local_weights(around.astype(float), places)
        field = values[:, self.first : self.first + self.count]
        near = np.take_along_axis(field, around % self.count, axis=1)
        return np.einsum("nk,nk->n", weights, near)[:, None]
