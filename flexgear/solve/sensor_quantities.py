"""Quantities of sensors from recovered motions: displacement, its rates, strain, speed, torque.

A point of a body, in fixed axes, with the body's frame turned by α and the body itself by ψ:

    p = R(α) c + R(ψ) X + u + r × R(ψ) X,   u = R(α) u_f,   r = R(α) r_f

c: centre in the frame; X: place in the body; u_f, r_f: recovered displacement and rotation in the
frame's axes, rolling taken off. A sensor that turns with the body measures the displacement u + r ×
R(ψ) X, or dp/dt, d²p/dt² of the whole motion, along R(ψ) e. One that stands in space sees the
displacement of what passes there, and its rates at that place.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from flexgear.analysis.recording import AROUND, Quantity, local_weights
from flexgear.analysis.recovery import Recovery
from flexgear.arrays import Array
from flexgear.coupling.system import System


@dataclass
class Columns:
    """Columns of recovered motion: rows of elastic motion, multiples of the independent rotations,
    torques of ports and of springs."""

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
        """Column of a row's value (d,) under rigid-body rotation of the train."""
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
        """Values (t, columns) at all samples."""
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


def sum_of(columns: Sequence[int], order: int = 0) -> Quantity:
    """Sum of columns, or its rate: strain, torque, rotational speed."""
    return Quantity(partial(_sum, list(columns)), order)


def _sum(columns: list[int], values: Array) -> Array:
    return np.asarray(values[:, columns].sum(axis=1, keepdims=True))


@dataclass(frozen=True)
class Axes:
    """Columns of α and ψ; start: both at the start of the run, rad."""

    frame: int
    spin: int
    start: float = 0.0

    def of_frame(self, values: Array) -> Array:
        """α (n,) rad."""
        return np.asarray(values[:, self.frame] + self.start)

    def of_body(self, values: Array) -> Array:
        """ψ (n,) rad."""
        return np.asarray(values[:, self.spin] + self.start)

    def displacement(self, values: Array, motion: int, lever: Array) -> Array:
        """u + r × lever (n, 3) of the six columns u_f, r_f from ``motion`` on; lever (3,) or
        (n, 3) m in fixed axes."""
        alpha = self.of_frame(values)
        u, r = (turned(values[:, k : k + 3], alpha) for k in (motion, motion + 3))
        return np.asarray(u + np.cross(r, lever))


def of_body_point(
    motion: int, axes: Axes, center: Array, lever: Array, direction: Array, order: int
) -> Quantity:
    """Motion of a point of the body along a direction (3,) of the body, both turned by ψ, which is
    appended to the position as its last column. motion: first of six columns u_f, r_f; center,
    lever (3,): c and X, m."""
    rigid = np.array([center, lever]) if order > 0 else np.array([0.0 * center, 0.0 * lever])
    return Quantity(
        partial(_body_point, motion, axes, lever, rigid), order, partial(_along, direction)
    )


def _body_point(motion: int, axes: Axes, lever: Array, rigid: Array, values: Array) -> Array:
    psi = axes.of_body(values)
    place = axes.displacement(values, motion, turned(lever, psi))
    place += turned(rigid[0], axes.of_frame(values)) + turned(rigid[1], psi)
    return np.column_stack([place, psi])


def _along(direction: Array, derivative: Array, position: Array) -> Array:
    along = turned(direction, position[:, 3])
    return np.asarray(np.einsum("ni,ni->n", derivative[:, :3], along))


def at_place(motion: int, axes: Axes, place: Array, direction: Array, order: int) -> Quantity:
    """Motion of a turning rigid body at a point (3,), m, and along a direction (3,), both fixed in
    space."""
    return Quantity(partial(_at_place, motion, axes, place, direction), order)


def _at_place(motion: int, axes: Axes, place: Array, direction: Array, values: Array) -> Array:
    return np.asarray((axes.displacement(values, motion, place) @ direction)[:, None])


def passing(first: int, count: int, axes: Axes, angle: float, order: int) -> Quantity:
    """Displacement, m, seen by a sensor fixed in space at an angle, rad, of a body turning past it,
    interpolated between ``count`` points evenly spaced round the body, the first at angle zero,
    whose displacements are the recovered columns from ``first`` on."""
    return Quantity(partial(_passing, first, count, axes, angle), order)


def _passing(first: int, count: int, axes: Axes, angle: float, values: Array) -> Array:
    places = (angle - axes.of_body(values)) * count / (2 * np.pi)
    below = np.floor(places).astype(int)
    around = below[:, None] + np.arange(AROUND) - (AROUND // 2 - 1)
    weights = local_weights(around.astype(float), places)
    near = np.take_along_axis(values[:, first : first + count], around % count, axis=1)
    return np.einsum("nk,nk->n", weights, near)[:, None]
