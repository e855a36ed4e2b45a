"""Numerical options."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from flexgear.model.section import Section
from flexgear.model.units import Frequency, Time


class Solver(Section):
    """fidelity: of the FE meshes; time_step: steady running; step_time_step: near torque steps;
    modes_to: highest frequency kept in the second reduction; output_interval: of the stored
    samples; duration: of a simulation, one carrier revolution unless given; cyclic: whether a body
    whose FE mesh repeats by teeth or pins is reduced sector by sector ("auto") or never ("off")."""

    fidelity: Literal["quick", "standard", "fine"] = "standard"
    time_step: Time = Field(default=1e-4, ge=1e-8, le=1e-1)
    step_time_step: Time = Field(default=2e-5, ge=1e-8, le=1e-1)
    output_interval: Time = Field(default=1e-3, ge=1e-8, le=1e3)
    duration: Time | None = Field(default=None, ge=1e-6, le=1e6)
    cyclic: Literal["auto", "off"] = "auto"
    modes_to: Frequency = Field(default=3000.0, ge=1.0, le=1e6)
