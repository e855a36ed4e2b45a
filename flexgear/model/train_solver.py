"""Numerical options of a train."""

from __future__ import annotations

from pydantic import Field, model_validator

from flexgear.model.section import Section
from flexgear.model.solver import check_ladder
from flexgear.model.units import Frequency, Time

MODES_ACCURACY = 0.01  # where bodies bend and neither a limit nor an accuracy is given


class TrainSolver(Section):
    """time_step, output_interval, duration: of transients (duration: one period of the slowest
    stage if left out). settle: start-up left out of load sharing. positions_per_gear_mesh:
    quasi-static positions a gear-mesh cycle. step_tolerance: error of a tooth load that one step
    may make, as a share of the largest rated one; 0: steps of time_step. Given one, they are
    doubled and halved between shortest_time_step and longest_time_step. modes_to: highest
    frequency kept. modes_accuracy: error of the contact's flexibility that is allowed up to
    modes_band, a fraction. Given both, modes_to is an upper bound; given neither, all modes are
    kept where every body is rigid, else those of MODES_ACCURACY."""

    time_step: Time = Field(default=1e-4, ge=1e-9, le=1e-1)
    output_interval: Time = Field(default=1e-3, ge=1e-9, le=1e3)
    duration: Time | None = Field(default=None, ge=1e-6, le=1e6)
    positions_per_gear_mesh: int = Field(default=16, ge=2, le=10000)
    settle: Time = Field(default=0.0, ge=0.0, le=1e6)
    step_tolerance: float = Field(default=0.0, ge=0.0, le=0.1)
    shortest_time_step: Time = Field(default=2.5e-6, ge=1e-9, le=1e-1)
    longest_time_step: Time = Field(default=4e-4, ge=1e-9, le=1e-1)
    modes_to: Frequency | None = Field(default=None, ge=1.0, le=1e9)
    modes_accuracy: float | None = Field(default=None, ge=1e-9, le=0.5)
    modes_band: Frequency = Field(default=500.0, ge=1.0, le=1e6)

    @model_validator(mode="after")
    def _ladder(self) -> TrainSolver:
        check_ladder(self.step_tolerance, self.shortest_time_step, self.longest_time_step)
        return self

    @property
    def modes_limit(self) -> float | None:
        """Highest frequency that may be kept, Hz; None where the accuracy, or nothing, decides."""
        return self.modes_to
