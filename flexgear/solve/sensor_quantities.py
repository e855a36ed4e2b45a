"""Quantities of sensors from recovered motions: displacement, its rates, strain, speed, torque.

A point of a body, in fixed axes, with the body's frame turned by α and the body itself by ψ:

    p = R(α) c + R(ψ) X + u + r × R(ψ) X,   u = R(α) u_f,   r = R(α) r_f

c: centre in the frame; X: place in the body; u_f, r_f: recovered displacement and rotation in the
frame's axes, rolling taken off. A sensor that turns with the body measures the displacement u + r ×
R(ψ) X, or dp/dt, d²p/dt² of the whole motion, along R(ψ) e. One that stands in space sees the
displacement of what passes there, and its rates at that place.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np

from flexgear.analysis.recording import AROUND, Quantity, local_weights
from flexgear.analysis.recovery import Recovery
from flexgear.arrays import Array


def turned(vectors: Array, angles: Array) -> Array:
    """Vectors (n, 3) or (3,) turned by angles (n,) about z."""
    c, s = np.cos(angles), np.sin(angles)
    x, y, z = np.moveaxis(np.asarray(vectors, dtype=float), -1, 0)
    return np.stack([c * x - s * y, s * x + c * y, np.broadcast_to(z, c.shape)], axis=1)


def _rotation(turns: Array, recovery: Recovery) -> Array:
    return np.asarray(recovery.rotations @ turns[:, None])


def rotation(turns: Array) -> Quantity:
    """Multiples (F,) of the independent rotations of the rolling train, rad."""
    return Quantity(partial(_rotation, turns))


def _torque(name: str, recovery: Recovery) -> Array:
    ports = [port.name for port in recovery.modal.system.ports]
    if name in ports:
        return recovery.result.torques[:, [ports.index(name)]]
    return recovery.link_force(name)[:, 5:]


def torque(name: str) -> Quantity:
    """Of a port or a spring about z, N·m."""
    return Quantity(partial(_torque, name))


@dataclass(frozen=True)
class Motion:
    """Recovered motion of rows (k, d), with a name that is theirs alone; turns (F,): what the last
    of them is in rolling, nothing if left out."""

    name: str
    rows: Array
    turns: Array | float = 0.0

    def elastic(self, recovery: Recovery) -> Array:
        """(t, k), rolling taken off."""
        return recovery.named(self.name, lambda: self.rows)

    def whole(self, recovery: Recovery) -> Array:
        """Of one row (t, 1), rolling included."""
        return self.elastic(recovery) + np.sum(recovery.rotations * self.turns, 1, keepdims=True)


@dataclass(frozen=True)
class Axes:
    """Multiples (F,) of the independent rotations by which a frame and a body turn, α and ψ; start:
    both at the begin of the run, rad."""

    frame: Array
    spin: Array
    start: float = 0.0

    @property
    def turn(self) -> bool:
        """Whether the body turns in space."""
        return bool(np.any(self.spin))

    def of_frame(self, recovery: Recovery) -> Array:
        """α (n,) rad."""
        return np.asarray(recovery.rotations @ self.frame + self.start)

    def of_body(self, recovery: Recovery) -> Array:
        """ψ (n,) rad."""
        return np.asarray(recovery.rotations @ self.spin + self.start)


@dataclass(frozen=True)
class BodyPoint:
    """A point of a body. motion: six rows u_f, r_f; center, place, direction (3,): c, X, e."""

    motion: Motion
    axes: Axes
    center: Array
    place: Array
    direction: Array

    def displacement(self, recovery: Recovery, lever: Array) -> Array:
        """u + r × lever (n, 3); lever (3,) or (n, 3) m in fixed axes."""
        alpha, motion = self.axes.of_frame(recovery), self.motion.elastic(recovery)
        u, r = turned(motion[:, :3], alpha), turned(motion[:, 3:], alpha)
        return np.asarray(u + np.cross(r, lever))

    def turning(self, order: int) -> Quantity:
        """What a sensor on the body measures."""
        return Quantity(partial(self._path, order > 0), order, self._along)

    def _path(self, whole: bool, recovery: Recovery) -> Array:
        """Displacement, or the whole p, and ψ in the last column."""
        psi = self.axes.of_body(recovery)
        path = self.displacement(recovery, turned(self.place, psi))
        if whole:
            path += turned(self.center, self.axes.of_frame(recovery)) + turned(self.place, psi)
        return np.column_stack([path, psi])

    def _along(self, derivative: Array, path: Array) -> Array:
        along = turned(self.direction, path[:, 3])
        return np.asarray(np.einsum("ni,ni->n", derivative[:, :3], along))

    def in_space(self, order: int) -> Quantity:
        """What a sensor sees of a rigid body at the place and direction as the run begins."""
        return Quantity(self._at_start, order)

    def _at_start(self, recovery: Recovery) -> Array:
        start = np.full(1, self.axes.start)
        place, direction = turned(self.place, start)[0], turned(self.direction, start)[0]
        return np.asarray((self.displacement(recovery, place) @ direction)[:, None])


def _passing(motion: Motion, axes: Axes, angle: float, recovery: Recovery) -> Array:
    values = motion.elastic(recovery)
    count = values.shape[1]
    places = (angle - axes.of_body(recovery)) * count / (2 * np.pi)
    below = np.floor(places).astype(int)
    around = below[:, None] + np.arange(AROUND) - (AROUND // 2 - 1)
    weights = local_weights(around.astype(float), places)
    near = np.take_along_axis(values, around % count, axis=1)
    return np.einsum("nk,nk->n", weights, near)[:, None]


def passing(motion: Motion, axes: Axes, angle: float, order: int) -> Quantity:
    """Displacement that a sensor fixed in space sees of a body turning past it, at an angle, rad:
    interpolated between points spread evenly round the body, whose displacements are the rows of
    ``motion``, the first at angle zero."""
    return Quantity(partial(_passing, motion, axes, angle), order)
