"""Rollers of a bearing whose stiffness follows from them."""

from __future__ import annotations

from pydantic import Field

from flexgear.model.section import Section
from flexgear.model.units import Length


class Rollers(Section):
    """Rows of cylindrical rollers of steel.

    count: rollers of a row; rows: side by side; length: effective length of a roller; spacing:
    between the middles of neighbouring rows; clearance: radial gap on every side (half of the
    radial internal clearance that catalogues state).
    """

    count: int = Field(ge=4, le=200)
    rows: int = Field(default=1, ge=1, le=4)
    length: Length = Field(gt=0.0, le=1.0)
    spacing: Length = Field(default=0.0, ge=0.0, le=1.0)
    clearance: Length = Field(default=0.0, ge=0.0, le=5e-3)

    @property
    def places(self) -> tuple[float, ...]:
        """Middles of the rows along the axis, from the bearing's middle, m."""
        middle = 0.5 * (self.rows - 1)
        return tuple(self.spacing * (j - middle) for j in range(self.rows))
