"""Torque of the first input over time."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field, model_validator

from flexgear.model.section import Missing, Refusal, Section
from flexgear.model.units import Speed, Time, Torque

_SAME_TIME = 1e-12  # of a time; a step at 1 s counts from the first instant after 1 s


class TorqueDrops(Section):
    """Torque drops that ``flexgear run`` studies, one by one: at ``start``, for ``duration``, then
    the torque is back and the run goes on for ``after``. None: follows from the case."""

    torques: tuple[Torque, ...] = ()
    start: Time | None = Field(default=None, ge=0.0, le=1e5)
    duration: Time | None = Field(default=None, gt=0.0, le=1e5)
    after: Time | None = Field(default=None, gt=0.0, le=1e5)

    @property
    def times(self) -> tuple[float, float, float]:
        """start, duration, after, s, where they are known (``coupling.pace.timed_drops``)."""
        assert self.start is not None and self.duration is not None and self.after is not None
        return self.start, self.duration, self.after


class TorqueHistory(Section):
    """Torque of the first input over time; other given torques follow in their rated proportion.

    constant  ``torque`` at all times, the rated one if left out
    steps     ``torques[k]`` for times[k] < t <= times[k+1]; the first holds before, too
    ramp      straight lines between the points (times, torques), constant outside
    csv       as ramp, the points read from ``file`` with the columns time_s and torque_nm
    steps (the section): torque drops that ``flexgear run`` studies beside steady running.
    """

    kind: Literal["constant", "steps", "ramp", "csv"] = "constant"
    torque: Torque | None = Field(default=None, ge=-1e9, le=1e9)
    times: tuple[Time, ...] = ()
    torques: tuple[Torque, ...] = ()
    file: str | None = None
    steps: TorqueDrops = TorqueDrops()

    @model_validator(mode="after")
    def _complete(self) -> TorqueHistory:
        if self.kind == "constant":
            return self
        if self.kind == "csv" and self.file is None and not self.times:
            raise Missing("file", "is missing", "name a CSV file with time_s and torque_nm")
        if len(self.times) != len(self.torques) or not self.times:
            raise Refusal(
                "times",
                f"{len(self.times)} times and {len(self.torques)} torques",
                f"a drive of kind {self.kind!r} needs as many times as torques",
            )
        if np.any(np.diff(self.times) <= 0):
            raise Refusal("times", "do not rise", "put them in order, each once")
        if max(abs(x) for x in self.torques) > 1e9:
            raise Refusal("torques", "are beyond 1e9 N m", "check the unit")
        return self

    def steady(self, rated: float) -> float:
        """Torque of a constant drive, N m: ``torque``, or the rated one."""
        return rated if self.torque is None else self.torque

    def torque_at(self, time: ArrayLike, rated: float) -> NDArray[np.float64]:
        """Torque, N m, at the times given, s; same shape. rated: of the first input, N m."""
        t = np.asarray(time, dtype=float)
        if self.kind == "constant":
            return np.full(t.shape, self.steady(rated))
        times, torques = np.asarray(self.times), np.asarray(self.torques)
        if self.kind == "steps":
            at = np.searchsorted(times + _SAME_TIME * np.abs(times), t, side="left") - 1
            return torques[np.clip(at, 0, len(torques) - 1)]
        return np.interp(t, times, torques)

    def change_times(self) -> tuple[float, ...]:
        """Times at which the torque jumps, s; near them the smaller time step is used."""
        return self.times[1:] if self.kind == "steps" else ()

    def drop(self, torque: float, start: float, duration: float, rated: float) -> TorqueHistory:
        """The drive of one torque drop: ``torque`` for ``duration`` s from ``start`` s on."""
        before = self.steady(rated)
        return self.model_copy(
            update={
                "kind": "steps",
                "times": (min(0.0, start - duration), start, start + duration),
                "torques": (before, torque, before),
            }
        )


class Drive(TorqueHistory):
    """Drive at the carrier of a file with one flexible stage; rated_speed is that of the carrier at
    rated_torque."""

    rated_torque: Torque = Field(ge=1e-3, le=1e9)
    rated_speed: Speed = Field(ge=1e-3, le=1e4)

    @property
    def history(self) -> TorqueHistory:
        """Torque over time without the rated state."""
        return TorqueHistory(**{n: getattr(self, n) for n in TorqueHistory.model_fields})
