"""Forces and moments on members beside those of the ports: constant, or over time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field, model_validator

from flexgear.model.names import Member
from flexgear.model.section import Missing, Refusal, Section
from flexgear.model.units import Force, Time, Torque

Array = NDArray[np.float64]
_NONE = (0.0, 0.0, 0.0)


class MemberLoad(Section):
    """A force and a moment on a member, in fixed axes or the carrier's: constant, or a history.

    A history follows straight lines between its points and is constant outside. Statics, modes and
    the power flow of the rated state take what it says at t = 0.

    member: its name. force, moment: constant ones along x, y, z. frame: whose axes these are.
    times: of the points of a history, rising. forces, moments: x, y, z at each of these times; what
    is left out is zero. file: CSV of the points, a column time_s and some or all of the columns
    force_x_n, force_y_n, force_z_n, moment_x_nm, moment_y_nm, moment_z_nm.
    """

    member: Member
    force: tuple[Force, Force, Force] = _NONE
    moment: tuple[Torque, Torque, Torque] = _NONE
    frame: Literal["fixed", "carrier"] = "fixed"
    times: tuple[Time, ...] = ()
    forces: tuple[tuple[Force, Force, Force], ...] = Field(default=())
    moments: tuple[tuple[Torque, Torque, Torque], ...] = Field(default=())
    file: str | None = None

    @property
    def is_history(self) -> bool:
        """Whether the load is given as points over time, not constant."""
        return bool(self.times)

    @property
    def points(self) -> Array:
        """Force N and moment N m (T, 6) at ``times``; one row of a constant load."""
        if not self.times:
            return np.array([[*self.force, *self.moment]])
        none = (_NONE,) * len(self.times)
        return np.hstack([self.forces or none, self.moments or none])

    @property
    def first(self) -> Array:
        """Force and moment (6,) at t = 0, which statics take."""
        return self.at(0.0)

    def at(self, time: ArrayLike) -> Array:
        """Force N and moment N m (…, 6) at times (…), s."""
        t, points = np.asarray(time, dtype=float), self.points
        if not self.times:
            return np.broadcast_to(points[0], (*t.shape, 6))
        return np.stack([np.interp(t, self.times, column) for column in points.T], axis=-1)

    @model_validator(mode="after")
    def _one_kind(self) -> MemberLoad:
        if not (self.times or self.forces or self.moments or self.file):
            return self
        for key in ("force", "moment"):
            if getattr(self, key) != _NONE:
                raise Refusal(key, "is given beside a history", "keep one of them")
        if not self.times:
            raise Missing("times", "is missing", "give the times of the points, or a CSV file")
        if not self.forces and not self.moments:
            raise Missing("forces", "is missing", "give forces or moments at these times")
        for key in ("forces", "moments"):
            if (many := len(getattr(self, key))) not in (0, len(self.times)):
                raise Refusal(
                    key, f"has {many} points for {len(self.times)} times", "give one at each time"
                )
        if np.any(np.diff(self.times) <= 0):
            raise Refusal("times", "do not rise", "put them in order, each once")
        return self


def varying(loads: Sequence[MemberLoad]) -> tuple[tuple[int, int, float], ...]:
    """Load histories, in this order: load, component and its largest size, of
    the components of histories that are ever more than zero."""
    return tuple(
        (k, int(c), float(np.abs(load.points[:, c]).max()))
        for k, load in enumerate(loads)
        if load.is_history
        for c in np.flatnonzero(load.points.any(axis=0))
    )


def load_histories(loads: Sequence[MemberLoad], time: Array) -> Array:
    """Load histories (k, L) at times (k,), s: components over their largest size."""
    columns = [loads[k].at(time)[:, c] / size for k, c, size in varying(loads)]
    return np.column_stack(columns) if columns else np.zeros((len(time), 0))
