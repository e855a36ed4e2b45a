"""Torque of the first input over time."""

from __future__ import annotations

from pydantic import Field

from flexgear.model.history import TimeHistory
from flexgear.model.section import Section
from flexgear.model.units import Time, Torque


class TorqueDrops(Section):
    """Torque drops that ``flexgear run`` studies, one by one: at ``start``, for ``duration``, then
    the torque is back and the run goes on for ``after``. What is left out follows from the case.

    torques: one a drop. start: of the drop. duration: of the drop. after: time that is followed
    when the torque is back.
    """

    torques: tuple[Torque, ...] = ()
    start: Time | None = Field(default=None, ge=0.0, le=1e5)
    duration: Time | None = Field(default=None, gt=0.0, le=1e5)
    after: Time | None = Field(default=None, gt=0.0, le=1e5)

    @property
    def times(self) -> tuple[float, float, float]:
        """start, duration, after, s, where they are known (``coupling.pace.timed_drops``)."""
        assert self.start is not None and self.duration is not None and self.after is not None
        return self.start, self.duration, self.after


class TorqueHistory(TimeHistory):
    """Machine of the first input, which follows a torque; inputs without a machine of their own
    follow in their rated proportion.

    steps (the section): torque drops that ``flexgear run`` studies beside steady running.
    """

    steps: TorqueDrops = TorqueDrops()

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
