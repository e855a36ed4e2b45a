"""Quantities of sensors from recovered motions: displacement, its rates, strain, speed, torque.

The position of a point of a body in fixed axes is, with the body's frame rotated by α and the body
by ψ,

    p = R(α) c + R(ψ) X + u + r × R(ψ) X,   u = R(α) u_f,   r = R(α) r_f.

c: centre of the body in its frame; X: position of the point in the body; u_f, r_f: elastic
displacement and rotation in the frame's axes. A sensor on the body measures the displacement
u + r × R(ψ) X, or dp/dt, d²p/dt² of the whole motion, along R(ψ) e. A sensor fixed in space
measures the displacement of the points of the body that are at its place, and the time derivatives
of this signal.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np

from flexgear.analysis.recording import AROUND, Quantity, local_weights
from flexgear.analysis.recovery import Recovery
from flexgear.arrays import Array
from flexgear.structures.bodies import rotation as rotation_matrix


def rotated(vectors: Array, angles: Array) -> Array:
    """Vectors (n, 3) or (3,) rotated by angles (n,) about z, rad: (n, 3)."""
    return np.asarray((rotation_matrix(angles) @ vectors[..., None])[..., 0])


def rotation(turns: Array) -> Quantity:
    """Sum of the independent rotations of the undeflected train with factors (F,), rad."""
    return Quantity(lambda recovery: np.asarray(recovery.rotations @ turns[:, None]))


def torque(name: str) -> Quantity:
    """Torque of a port, or in a spring about z, N·m."""

    def values(recovery: Recovery) -> Array:
        ports = [port.name for port in recovery.modal.system.ports]
        if name in ports:
            return recovery.result.torques[:, [ports.index(name)]]
        return recovery.link_force(name)[:, 5:]

    return Quantity(values)


@dataclass(frozen=True)
class Motion:
    """Recovered motion of rows (k, d). name: unique, for the cache; turns (F,): rigid rotation of
    the only row per radian of the independent rotations."""

    name: str
    rows: Array
    turns: Array | float = 0.0

    def elastic(self, recovery: Recovery) -> Array:
        """Elastic motion (t, k), without rigid rotation of the train."""
        return recovery.named(self.name, lambda: self.rows)

    def total(self, recovery: Recovery) -> Array:
        """Motion (t, 1) of one row, including rigid rotation of the train."""
        return self.elastic(recovery) + np.sum(recovery.rotations * self.turns, 1, keepdims=True)


@dataclass(frozen=True)
class Axes:
    """Rotations α of a frame and ψ of a body: factors (F,) on the independent rotations; start:
    value of both at the start of the run, rad."""

    frame: Array
    spin: Array
    start: float = 0.0

    @property
    def turn(self) -> bool:
        """Whether the body turns in space."""
        return bool(np.any(self.spin))

    def of_frame(self, recovery: Recovery) -> Array:
        """Rotation α (n,) of the frame, rad."""
        return np.asarray(recovery.rotations @ self.frame + self.start)

    def of_body(self, recovery: Recovery) -> Array:
        """Rotation ψ (n,) of the body, rad."""
        return np.asarray(recovery.rotations @ self.spin + self.start)


@dataclass(frozen=True)
class BodyPoint:
    """A point of a body with the direction of a sensor. motion: six rows u_f, r_f; center, place,
    direction (3,): c, X, e."""

    motion: Motion
    axes: Axes
    center: Array
    place: Array
    direction: Array

    def displacement(self, recovery: Recovery, lever: Array) -> Array:
        """u + r × lever (n, 3); lever (3,) or (n, 3) m in fixed axes."""
        alpha, motion = self.axes.of_frame(recovery), self.motion.elastic(recovery)
        u, r = rotated(motion[:, :3], alpha), rotated(motion[:, 3:], alpha)
        return np.asarray(u + np.cross(r, lever))

    def on_body(self, order: int) -> Quantity:
        """Signal of a sensor on the body; order: of the time derivative."""
        return Quantity(partial(self._path, order > 0), order, self._along)

    def _path(self, total: bool, recovery: Recovery) -> Array:
        """Displacement, or with ``total`` the position p, (n, 3), and ψ in the last column."""
        psi = self.axes.of_body(recovery)
        path = self.displacement(recovery, rotated(self.place, psi))
        if total:
            path += rotated(self.center, self.axes.of_frame(recovery)) + rotated(self.place, psi)
        return np.column_stack([path, psi])

    def _along(self, derivative: Array, path: Array) -> Array:
        """Component of a derivative along R(ψ) e, with ψ in the last column of ``path``."""
        direction = rotated(self.direction, path[:, 3])
        return np.asarray(np.einsum("ni,ni->n", derivative[:, :3], direction))

    def in_space(self, order: int) -> Quantity:
        """Signal of a sensor fixed in space at a rigid body, at its place and in its direction at
        the start of the run; order: of the time derivative."""
        start = np.full(1, self.axes.start)
        place, direction = rotated(self.place, start)[0], rotated(self.direction, start)[0]
        return Quantity(lambda r: (self.displacement(r, place) @ direction)[:, None], order)


def passing(motion: Motion, axes: Axes, angle: float, order: int) -> Quantity:
    """Signal of a sensor fixed in space at ``angle``, rad, for a flexible body that turns past it:
    interpolated between points evenly spaced round the body, whose displacements are the rows of
    ``motion``, the first at angle zero; order: of the time derivative."""

    def at_sensor(recovery: Recovery) -> Array:
        values = motion.elastic(recovery)
        count = values.shape[1]
        places = (angle - axes.of_body(recovery)) * count / (2 * np.pi)
        below = np.floor(places).astype(int)
        around = below[:, None] + np.arange(AROUND) - (AROUND // 2 - 1)
        weights = local_weights(around.astype(float), places)
        near = np.take_along_axis(values, around % count, axis=1)
        return np.einsum("nk,nk->n", weights, near)[:, None]

    return Quantity(at_sensor, order)
