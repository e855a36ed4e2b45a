"""The tool that generates the teeth of a gear."""

from __future__ import annotations

import math

from pydantic import Field, model_validator

from flexgear.model.section import Refusal, Section
from flexgear.model.units import Angle, Length


class Tool(Section):
    """A rack (hob, planing tool) or a shaper cutter; its height over the reference line is the
    gear's dedendum, its tip radius the gear's root_fillet.

    teeth: of a shaper cutter, z_0; left out, sun, planet, pinion and gear are cut by a rack, and a
    ring by a cutter of half of its teeth. profile_shift: x_0 of the cutter, which falls as it is
    ground again. tip_diameter: d_a0 of the cutter; the root circle then follows from it, not from
    dedendum.
    protuberance: pr_P0, by which the tip rounding stands beyond the tool's flank, along the flank's
    normal; protuberance_angle: of the flank between both to the middle line of the tool's tooth.
    grinding_allowance: q, which is ground off each flank after the tool, along its normal, and not
    off the root: at most the protuberance.
    """

    teeth: int | None = Field(default=None, ge=5, le=1000)
    profile_shift: float = Field(default=0.0, ge=-2.0, le=2.0)
    tip_diameter: Length | None = Field(default=None, ge=1e-3, le=10.0)
    protuberance: Length = Field(default=0.0, ge=0.0, le=0.02)
    protuberance_angle: Angle = Field(default=math.radians(8.0), ge=0.0, le=math.radians(30.0))
    grinding_allowance: Length = Field(default=0.0, ge=0.0, le=0.02)

    @model_validator(mode="after")
    def _no_step(self) -> Tool:
        if self.grinding_allowance > self.protuberance:
            raise Refusal(
                "grinding_allowance",
                f"{1e3 * self.grinding_allowance:g} mm are ground off flanks that the protuberance "
                f"frees by {1e3 * self.protuberance:g} mm, which leaves a step above the root",
                "raise protuberance_mm, or leave both out where the root is ground with the flank",
            )
        return self
