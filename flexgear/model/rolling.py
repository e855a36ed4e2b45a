"""Ratings and rolling elements of bearings, of which their life is rated."""

from __future__ import annotations

import math
from typing import Literal

from pydantic import Field, model_validator

from flexgear.model.section import Missing, Refusal, Section
from flexgear.model.springs import Bearing
from flexgear.model.units import Angle, Force, Length, Life


class RollingElements(Section):
    """Rolling elements of one bearing, of which the load in every row follows (ISO/TS 16281).

    What stands in ``rollers`` beside, where it says how the bearing springs, is left out here.

    count: of a row; rows: of one bearing; spacing: between the middles of neighbouring rows, of
    neighbouring bearings, too. diameter: D_w of balls, D_we of rollers. pitch_diameter: D_pw of the
    circle of their centres. length: L_we, effective length of rollers. clearance: radial gap on
    every side (half of the radial internal clearance), in operation. contact_angle: nominal; of
    several rows half face one way, half the other, and a single row is loaded by thrust along +z.
    arrangement: contact lines meet the axis outside of the rows ("O") or between them ("X").
    profile: of rollers, see below. drops: of a profile by a table, at equal steps from the middle
    of the roller to its end. edge_stress: whether lives count the concentration of stress at the
    ends of rollers, which the standard puts on top of the loads of laminae. inner_groove,
    outer_groove: radius of the grooves over the diameter of balls.

    logarithmic  that of ISO/TS 16281
    straight     none
    table        ``drops``
    """

    count: int | None = Field(default=None, ge=3, le=300)
    rows: int | None = Field(default=None, ge=1, le=4)
    spacing: Length | None = Field(default=None, ge=0.0, le=3.0)
    diameter: Length = Field(gt=0.0, le=1.0)
    pitch_diameter: Length = Field(gt=0.0, le=10.0)
    length: Length | None = Field(default=None, gt=0.0, le=1.0)
    clearance: Length | None = Field(default=None, ge=-1e-3, le=5e-3)
    contact_angle: Angle = Field(default=0.0, ge=0.0, le=0.78539816339745)
    arrangement: Literal["O", "X"] = "O"
    profile: Literal["logarithmic", "straight", "table"] = "logarithmic"
    drops: tuple[Length, ...] = ()
    edge_stress: bool = True
    inner_groove: float = Field(default=0.52, gt=0.5, le=1.0)
    outer_groove: float = Field(default=0.53, gt=0.5, le=1.0)

    @model_validator(mode="after")
    def _fits(self) -> RollingElements:
        if self.diameter >= self.pitch_diameter:
            raise Refusal("diameter", "is not below pitch_diameter", "correct one of them")
        if self.count is not None:
            chord = self.pitch_diameter * math.sin(math.pi / self.count)
            if self.diameter > chord:
                problem = f"is too much: only {1e3 * chord:.4g} mm are there for each of them"
                raise Refusal("diameter", problem, "correct it, count or pitch_diameter")
        if (self.profile == "table") != bool(self.drops):
            remedy = 'give both profile = "table" and drops, or neither'
            raise Refusal("drops", "belongs to a profile by a table", remedy)
        if len(self.drops) == 1 or any(drop < 0 for drop in self.drops):
            raise Refusal("drops", "is no profile", "give two values or more, none negative")
        return self


class Rolling(Section):
    """What the rating of a rolling bearing needs.

    dynamic_rating: C of one bearing, for the basic rating life; static_rating: C_0; rolling: kind
    of its elements, which says the exponent; fatigue_load_limit: C_u, for the modified life.
    count: equal bearings side by side, which share the load evenly; their rows share it by what
    elements says. required_life: which the rating life is held to. elements: for the load in rows.
    """

    dynamic_rating: Force | None = Field(default=None, gt=0.0, le=1e9)
    static_rating: Force | None = Field(default=None, gt=0.0, le=1e9)
    fatigue_load_limit: Force | None = Field(default=None, gt=0.0, le=1e9)
    rolling: Literal["roller", "ball"] | None = None
    count: int = Field(default=1, ge=1, le=8)
    required_life: Life | None = Field(default=None, gt=0.0, le=1e10)
    elements: RollingElements | None = None

    @model_validator(mode="after")
    def _rating_of_a_kind(self) -> Rolling:
        for key in ("dynamic_rating", "elements"):
            if getattr(self, key) is not None and self.rolling is None:
                remedy = 'add rolling = "roller" or "ball"'
                raise Missing("rolling", f"is missing beside {key}", remedy)
        if self.required_life is not None and self.dynamic_rating is None:
            remedy = "add dynamic_rating and rolling"
            raise Missing("dynamic_rating", "is missing beside required_life", remedy)
        return self


def check_elements(bearing: Bearing, rolling: Rolling) -> None:
    """Refusal for elements that lack a size, or contradict the rollers that spring."""
    elements, rollers = rolling.elements, bearing.rollers
    if elements is None:
        return
    if rollers is None:
        several = (elements.rows or 1) * rolling.count > 1
        needed = {"count": True, "length": rolling.rolling == "roller", "spacing": several}
        for key, is_needed in needed.items():
            if is_needed and getattr(elements, key) is None:
                unit = "" if key == "count" else "_mm"
                raise Missing(f"elements.{key}", "is missing", f"add elements.{key}{unit}")
        return
    if rolling.rolling == "ball":
        raise Refusal("rolling", "is ball, beside rollers", "take one of the two out")
    if rollers.rows % rolling.count:
        problem = f"of {rollers.rows} rows are not {rolling.count} equal bearings"
        raise Refusal("rollers.rows", problem, "correct rows or count")
    for key in ("count", "rows", "spacing", "length", "clearance"):
        if getattr(elements, key) is not None:
            raise Refusal(f"elements.{key}", "stands in rollers, too", "keep that in rollers")
