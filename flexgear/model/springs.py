"""Springs between two 6-dof nodes, by directions or as a full matrix; bearings, rollers."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from flexgear.model.section import Refusal, Section
from flexgear.model.units import (
    Length,
    MatrixEntry,
    RotationalDamping,
    RotationalStiffness,
    Stiffness,
    TranslationalDamping,
)


class Rollers(Section):
    """Rows of cylindrical rollers of steel.

    count: rollers of a row; rows: side by side; length: effective length of a roller; spacing:
    between the middles of neighbouring rows; clearance: radial gap on every side (half of the
    radial internal clearance that catalogues state).
    """

    count: int = Field(ge=4, le=200)
    rows: int = Field(default=1, ge=1, le=4)
    length: Length = Field(gt=0.0, le=1.0)
    spacing: Length = Field(default=0.0, ge=0.0, le=1.0)
    clearance: Length = Field(default=0.0, ge=0.0, le=5e-3)

    @property
    def places(self) -> tuple[float, ...]:
        """Middles of the rows along the axis, from the bearing's middle, m."""
        middle = 0.5 * (self.rows - 1)
        return tuple(self.spacing * (j - middle) for j in range(self.rows))


class Springs(Section):
    """Stiffness of a link between two nodes.

    radial: across the axis, x and y. radial_x, radial_y: in place of radial in one direction.
    axial: along the axis. tilt: about x and y. tilt_x, tilt_y: in place of tilt about one axis.
    torsion: about the axis. full: symmetric 6 x 6 matrix that replaces all of them.

    Rows and columns of ``matrix``: ux, uy, uz (m), rx, ry, rz (rad). ``radial`` stands for both
    radial directions and ``tilt`` for both tilts unless one of them is given by itself. A full
    symmetric 6 x 6 list ``full_si`` replaces all of them.
    """

    radial: Stiffness = Field(default=0.0, ge=0.0, le=1e14)
    radial_x: Stiffness | None = Field(default=None, ge=0.0, le=1e14)
    radial_y: Stiffness | None = Field(default=None, ge=0.0, le=1e14)
    axial: Stiffness = Field(default=0.0, ge=0.0, le=1e14)
    tilt: RotationalStiffness = Field(default=0.0, ge=0.0, le=1e14)
    tilt_x: RotationalStiffness | None = Field(default=None, ge=0.0, le=1e14)
    tilt_y: RotationalStiffness | None = Field(default=None, ge=0.0, le=1e14)
    torsion: RotationalStiffness = Field(default=0.0, ge=0.0, le=1e14)
    full: tuple[tuple[MatrixEntry, ...], ...] | None = None

    @property
    def stiffness(self) -> tuple[float, float, float, float, float, float]:
        """The diagonal of ``matrix``: N/m three times, N m/rad three times."""
        if self.full is not None:
            d = np.diag(np.array(self.full))
            return (d[0], d[1], d[2], d[3], d[4], d[5])
        x = self.radial if self.radial_x is None else self.radial_x
        y = self.radial if self.radial_y is None else self.radial_y
        a = self.tilt if self.tilt_x is None else self.tilt_x
        b = self.tilt if self.tilt_y is None else self.tilt_y
        return (x, y, self.axial, a, b, self.torsion)

    @property
    def matrix(self) -> NDArray[np.float64]:
        """Stiffness (6, 6), SI."""
        return np.diag(self.stiffness) if self.full is None else np.array(self.full)

    @model_validator(mode="after")
    def _valid_matrix(self) -> Springs:
        if self.full is None:
            return self
        if len(self.full) != 6 or any(len(row) != 6 for row in self.full):
            raise Refusal("full", "is not 6 x 6", "give six rows of six numbers")
        k = np.array(self.full)
        scale = np.sqrt(np.abs(np.diag(k)))
        if np.abs(k - k.T).max() > 1e-9 * np.abs(k).max():
            raise Refusal("full", "is not symmetric", "forces would not balance; correct it")
        unit = k / np.where(scale > 0, scale, 1.0) / np.where(scale > 0, scale, 1.0)[:, None]
        if np.linalg.eigvalsh(unit).min() < -1e-9:
            raise Refusal("full", "is not positive semidefinite", "correct its signs")
        return self


def at_height(z: float) -> NDArray[np.float64]:
    """Motion (6, 6) of a point at z on the axis of a body from that of its node."""
    out = np.eye(6)
    out[0, 4], out[1, 3] = z, -z
    return out


class Dampers(Section):
    """Viscous dampers beside the springs of a bearing, F = c δ̇.

    radial: across the axis, x and y. axial: along the axis. tilt: about x and y. torsion: about the
    axis, against all that turns there: a drag torque.
    """

    radial: TranslationalDamping = Field(default=0.0, ge=0.0, le=1e12)
    axial: TranslationalDamping = Field(default=0.0, ge=0.0, le=1e12)
    tilt: RotationalDamping = Field(default=0.0, ge=0.0, le=1e12)
    torsion: RotationalDamping = Field(default=0.0, ge=0.0, le=1e12)

    @property
    def coefficients(self) -> tuple[float, ...]:
        """Along and about x, y, z: N s/m three times, N m s/rad three times."""
        return (self.radial, self.radial, self.axial, self.tilt, self.tilt, self.torsion)


class Bearing(Springs):
    """A bearing; ``torsion``, stiffness against turning about its axis, is usually 0.

    z: where its springs act along the axis, m, from the middle of the gear or the seat; towards the
    stiffer of two rows. There u_x + z r_y, u_y - z r_x and the tilts themselves are resisted.
    clearance: radial gap there before the radial springs carry. rollers: carry radially and against
    tilt, by a stiffness that grows with load; radial and tilt are then those of modes and whatever
    is linear. damping: dampers at z beside the springs.
    """

    z: Length = Field(default=0.0, ge=-1.0, le=1.0)
    clearance: Length = Field(default=0.0, ge=0.0, le=5e-3)
    rollers: Rollers | None = None
    damping: Dampers | None = None

    @property
    def matrix(self) -> NDArray[np.float64]:
        """Stiffness (6, 6) at the node, Tᵀ K T with T the motion at z; SI."""
        to_z = at_height(self.z)
        return to_z.T @ super().matrix @ to_z

    @model_validator(mode="after")
    def _rollers_of_something(self) -> Bearing:
        if self.rollers is not None and (min(self.stiffness[:2]) <= 0 or self.full is not None):
            raise Refusal(
                "radial",
                "is needed beside rollers: the stiffness of modes and of whatever is linear",
                "give radial, and no full matrix",
            )
        return self

    @model_validator(mode="after")
    def _clearance_of_something(self) -> Bearing:
        if self.clearance == 0:
            return self
        if min(self.stiffness[:2]) <= 0:
            problem = "is the gap of a support without radial stiffness"
            raise Refusal("clearance", problem, "give radial")
        if self.rollers is not None:
            raise Refusal("clearance", "stands beside rollers", "give it as rollers.clearance")
        if self.full is not None and np.array(self.full)[:2, 2:].any():
            problem = "is a radial gap, but full couples radial motion with other directions"
            raise Refusal("clearance", problem, "take one of the two out")
        return self
