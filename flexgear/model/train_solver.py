"""Numerical options of a train."""

from __future__ import annotations

from pydantic import Field

from flexgear.model.section import Section
from flexgear.model.units import Frequency, Time


class TrainSolver(Section):
    """time_step, output_interval, duration: of transients (duration: one period of the slowest
    stage if left out). settle: start-up left out of load sharing. positions_per_gear_mesh:
    quasi-static positions a gear-mesh cycle. modes_to: highest frequency kept; all if left out."""

    time_step: Time = Field(default=1e-4, ge=1e-9, le=1e-1)
    output_interval: Time = Field(default=1e-3, ge=1e-9, le=1e3)
    duration: Time | None = Field(default=None, ge=1e-6, le=1e6)
    positions_per_gear_mesh: int = Field(default=16, ge=2, le=10000)
    settle: Time = Field(default=0.0, ge=0.0, le=1e6)
    modes_to: Frequency | None = Field(default=None, ge=1.0, le=1e9)
