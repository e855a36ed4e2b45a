"""Load at the output."""

from __future__ import annotations

from pydantic import Field, model_validator

from flexgear.model.section import Refusal, Section
from flexgear.model.units import Torque


class Brake(Section):
    """T = T_rated sign(ω) |ω/ω_rated|^exponent; T_rated from statics unless given."""

    exponent: float = Field(default=1.0, ge=0.0, le=5.0)
    rated_torque: Torque | None = Field(default=None, gt=0.0, le=1e9)

    @model_validator(mode="after")
    def _finite_slope(self) -> Brake:
        if 0.0 < self.exponent < 1.0:
            raise Refusal(
                "exponent", "between 0 and 1 the torque rises infinitely fast at rest", "0 or ≥ 1"
            )
        return self
