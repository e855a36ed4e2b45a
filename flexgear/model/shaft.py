"""Sun shaft as beam sections, and the spline at its end."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from flexgear.model.section import Refusal, Section
from flexgear.model.springs import Springs
from flexgear.model.units import Length


class ShaftSection(Section):
    """One hollow circular piece of the shaft.

    length: along the axis; outer_diameter: of the piece; inner_diameter: of its bore, 0 if solid.
    """

    length: Length = Field(ge=1e-4, le=10.0)
    outer_diameter: Length = Field(ge=1e-3, le=3.0)
    inner_diameter: Length = Field(default=0.0, ge=0.0, le=3.0)

    @model_validator(mode="after")
    def _hollow(self) -> ShaftSection:
        if self.inner_diameter >= self.outer_diameter:
            raise Refusal("inner_diameter", "is not below outer_diameter", "lower it")
        return self


class Shaft(Section):
    """Sun shaft from the sun gear (first section) to the output end, where the spline is.

    flexible: false makes it rigid with the same mass; direction: side to which it leaves the sun;
    elements_per_section: beam elements of each piece; sections: pieces from the sun gear on;
    spline: springs between its end and the output.
    """

    flexible: bool = True
    direction: Literal["-z", "+z"]
    elements_per_section: int = Field(default=2, ge=1, le=50)
    sections: tuple[ShaftSection, ...] = Field(min_length=1)
    spline: Springs

    @model_validator(mode="after")
    def _drives(self) -> Shaft:
        if self.spline.stiffness[5] <= 0:
            raise Refusal(
                "spline.torsion", "is zero, so no torque reaches the output", "give a stiffness"
            )
        return self
