"""The oil or grease of gears and bearings: viscosity, temperature, cleanliness."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from flexgear.model.section import Refusal, Section
from flexgear.model.units import Density, Temperature, Viscosity


class Lubricant(Section):
    """Lubricant of the whole gearbox, of which life and safety of gears and bearings are rated.

    viscosity_40: kinematic viscosity at 40 °C (the number of an ISO VG class); viscosity_100: that
    at 100 °C, from which that at any temperature follows; without it the viscosity index is taken
    as 95. temperature: of the oil in contacts; operating_viscosity: kinematic viscosity there,
    in place of what follows from temperature. density: there, for the dynamic viscosity that
    journal bearings ask for. cleanliness: solid particles of oil in a circuit with
    a filter, by ISO 4406 (filters of β_6 = 200, β_12 = 200, β_25 = 75, β_40 = 75 in this order); of
    it and the bearing's size the contamination factor e_C of ISO 281 follows. contamination: e_C
    itself, in place of cleanliness. With neither, bearings have their basic life only.
    """

    viscosity_40: Viscosity = Field(ge=1e-6, le=1e-2)
    viscosity_100: Viscosity | None = Field(default=None, ge=5e-7, le=1e-2)
    temperature: Temperature | None = Field(default=None, ge=223.15, le=473.15)
    operating_viscosity: Viscosity | None = Field(default=None, ge=5e-7, le=1e-1)
    density: Density | None = Field(default=None, ge=500.0, le=1500.0)
    cleanliness: Literal["-/13/10", "-/15/12", "-/17/14", "-/19/16"] | None = None
    contamination: float | None = Field(default=None, gt=0.0, le=1.0)

    @model_validator(mode="after")
    def _consistent(self) -> Lubricant:
        if self.viscosity_100 is not None and self.viscosity_100 >= self.viscosity_40:
            problem = "is not below viscosity_40, but oil thins as it warms"
            raise Refusal("viscosity_100", problem, "correct one of them")
        if self.temperature is not None and self.operating_viscosity is not None:
            problem = "is given beside temperature, of which it follows"
            raise Refusal("operating_viscosity", problem, "keep one of them")
        if self.cleanliness is not None and self.contamination is not None:
            problem = "is given beside cleanliness, of which it follows"
            raise Refusal("contamination", problem, "keep one of them")
        return self
