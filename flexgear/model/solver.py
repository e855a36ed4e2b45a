"""Numerical options."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from flexgear.model.section import Refusal, Section
from flexgear.model.units import Frequency, Time

MODES_TO = 3000.0  # Hz, where neither a limit nor an accuracy is given


MOST_RUNGS = 12  # step sizes of a ladder; each keeps a receptance of its own


def check_ladder(tolerance: float, shortest: float, longest: float) -> None:
    """Refusal where shortest and longest time step (s) make no ladder."""
    if tolerance > 0.0 and not shortest <= longest <= shortest * 2**MOST_RUNGS:
        raise Refusal(
            "shortest_time_step",
            f"{shortest:g} s is no ladder's start to steps of {longest:g} s",
            f"at most longest_time_step_s, and at least 1/{2**MOST_RUNGS} of it",
        )


class Solver(Section):
    """fidelity: of the FE meshes; time_step: steady running; step_time_step: near torque steps;
    step_tolerance: error of a tooth load that one step may make, as a share of the largest rated
    one; 0: steps of the sizes above. Given one, they are doubled and halved between
    shortest_time_step and longest_time_step; output_interval: of the stored samples; duration: of a
    simulation, one carrier revolution unless given; cyclic: whether a body whose FE mesh repeats by
    teeth or pins is reduced sector by sector ("auto") or never ("off"). Modes of the second
    reduction: modes_to, highest frequency kept (3000 Hz unless an accuracy is asked for);
    modes_accuracy, error of the contact's flexibility that is allowed up to modes_band, a fraction;
    given both, modes_to is an upper bound."""

    fidelity: Literal["quick", "standard", "fine"] = "standard"
    time_step: Time = Field(default=1e-4, ge=1e-8, le=1e-1)
    step_time_step: Time = Field(default=2e-5, ge=1e-8, le=1e-1)
    step_tolerance: float = Field(default=0.0, ge=0.0, le=0.1)
    shortest_time_step: Time = Field(default=2.5e-6, ge=1e-8, le=1e-1)
    longest_time_step: Time = Field(default=4e-4, ge=1e-8, le=1e-1)
    output_interval: Time = Field(default=1e-3, ge=1e-8, le=1e3)
    duration: Time | None = Field(default=None, ge=1e-6, le=1e6)
    cyclic: Literal["auto", "off"] = "auto"
    modes_to: Frequency | None = Field(default=None, ge=1.0, le=1e6)
    modes_accuracy: float | None = Field(default=None, ge=1e-9, le=0.5)
    modes_band: Frequency = Field(default=500.0, ge=1.0, le=1e6)

    @model_validator(mode="after")
    def _ladder(self) -> Solver:
        check_ladder(self.step_tolerance, self.shortest_time_step, self.longest_time_step)
        return self

    @property
    def modes_limit(self) -> float | None:
        """Highest frequency that may be kept, Hz; None where the accuracy alone decides."""
        if self.modes_to is None and self.modes_accuracy is None:
            return MODES_TO
        return self.modes_to
