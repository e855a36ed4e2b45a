"""Joint of two members of different stages (or of one): a spline, a coupling or a shaft."""

from __future__ import annotations

from pydantic import Field, model_validator

from flexgear.model.names import Member
from flexgear.model.section import Missing, Refusal
from flexgear.model.springs import Springs
from flexgear.model.units import Length, Stiffness


class Joint(Springs):
    """Two members that turn together: springs, or a hollow shaft as a beam.

    first, second: member names such as "stage_1.carrier". tangential: acts against u = r θ with
    the r of ``first`` (base radius, or centre distance of a carrier): torsion += tangential r².
    length, outer_diameter, inner_diameter: a shaft in place of the springs.
    """

    first: Member
    second: Member
    tangential: Stiffness = Field(default=0.0, ge=0.0, le=1e14)
    length: Length | None = Field(default=None, ge=1e-3, le=50.0)
    outer_diameter: Length | None = Field(default=None, ge=1e-3, le=5.0)
    inner_diameter: Length = Field(default=0.0, ge=0.0, le=5.0)

    @property
    def is_shaft(self) -> bool:
        """Whether it is a beam."""
        return self.length is not None

    @model_validator(mode="after")
    def _turns_together(self) -> Joint:
        if self.first == self.second:
            raise Refusal("second", f"joins {self.first} with itself", "name another member")
        springs = self.tangential > 0 or any(self.stiffness)
        if (self.length is None) != (self.outer_diameter is None):
            missing = "length" if self.length is None else "outer_diameter"
            raise Missing(missing, "is missing", "a shaft needs length and outer_diameter")
        if self.is_shaft and springs:
            raise Refusal("length", "is given beside springs", "keep the shaft or the springs")
        if self.outer_diameter is not None and self.inner_diameter >= self.outer_diameter:
            raise Refusal("inner_diameter", "is not below outer_diameter", "lower it")
        if not self.is_shaft and self.tangential <= 0 and self.stiffness[5] <= 0:
            raise Refusal(
                "torsion",
                "is zero, so the joint passes no torque",
                "give torsion, tangential, or a shaft's length and outer_diameter",
            )
        return self
