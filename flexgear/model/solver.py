"""Numerical options."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from flexgear.model.section import Section
from flexgear.model.units import Frequency, Time

MODES_TO = 3000.0  # Hz, where neither a limit nor an accuracy is given


class Solver(Section):
    """fidelity: of the FE meshes; time_step: steady running; step_time_step: near torque steps;
    output_interval: of the stored samples; duration: of a simulation, one carrier revolution unless
    given; cyclic: whether a body whose FE mesh repeats by teeth or pins is reduced sector by sector
    ("auto") or never ("off"). Modes of the second reduction: modes_to, highest frequency kept (3000
    Hz unless an accuracy is asked for); modes_accuracy, error of the contact's flexibility that is
    allowed up to modes_band, a fraction; given both, modes_to is an upper bound."""

    fidelity: Literal["quick", "standard", "fine"] = "standard"
    time_step: Time = Field(default=1e-4, ge=1e-8, le=1e-1)
    step_time_step: Time = Field(default=2e-5, ge=1e-8, le=1e-1)
    output_interval: Time = Field(default=1e-3, ge=1e-8, le=1e3)
    duration: Time | None = Field(default=None, ge=1e-6, le=1e6)
    cyclic: Literal["auto", "off"] = "auto"
    modes_to: Frequency | None = Field(default=None, ge=1.0, le=1e6)
    modes_accuracy: float | None = Field(default=None, ge=1e-9, le=0.5)
    modes_band: Frequency = Field(default=500.0, ge=1.0, le=1e6)

    @property
    def modes_limit(self) -> float | None:
        """Highest frequency that may be kept, Hz; None where the accuracy alone decides."""
        if self.modes_to is None and self.modes_accuracy is None:
            return MODES_TO
        return self.modes_to
