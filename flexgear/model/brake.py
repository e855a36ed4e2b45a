"""Load at the output."""

from __future__ import annotations

from pydantic import Field

from flexgear.model.section import Section
from flexgear.model.units import Torque


class Brake(Section):
    """T = T_rated sign(ω) |ω/ω_rated|^exponent; T_rated from statics unless given."""

    exponent: float = Field(default=1.0, ge=0.0, le=5.0)
    rated_torque: Torque | None = Field(default=None, ge=0.0, le=1e9)
