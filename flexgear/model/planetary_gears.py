"""A gear, the tool that generates its teeth, and what both must fulfil."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from pydantic import Field, model_validator

from flexgear.model.section import Missing, Refusal, Section
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


class Gear(Section):
    """One gear; coefficients are multiples of the normal module.

    teeth: their number, positive for the ring, too. profile_shift: coefficient of ISO 21771 with
    the ring's tooth number negative: x > 0 makes the tooth of any gear thicker, moves the tip
    circle of sun and planet outward and that of the ring towards its centre. addendum, dedendum:
    coefficients of the tooth's height from the reference circle to tip and root. root_fillet:
    radius of the tool's tip as a coefficient; a tip too narrow for it is fully round. tool: what
    generates the teeth. bore_diameter: of the gear's hole, 0 for none.
    """

    teeth: int = Field(ge=5, le=2000)
    profile_shift: float = Field(default=0.0, ge=-2.0, le=2.0)
    addendum: float = Field(default=1.0, ge=0.3, le=2.0)
    dedendum: float = Field(default=1.25, ge=0.5, le=2.5)
    root_fillet: float = Field(default=0.38, ge=0.02, le=0.6)
    tool: Tool = Tool()
    bore_diameter: Length = Field(default=0.0, ge=0.0, le=5.0)


def required_hand(data: Mapping[str, Any]) -> list[Missing]:
    """``planet_hand`` where gears are helical: with the other hand it is another stage."""
    helix = data.get("helix_angle")
    if isinstance(helix, float) and helix > 0.0 and "planet_hand" not in data:
        remedy = 'add planet_hand = "right" or "left"'
        return [Missing("planet_hand", "is missing with a helix angle", remedy)]
    return []


def check_bore(name: str, gear: Gear, module: float) -> None:
    """Refusal if the bore of an external gear reaches its root circle."""
    if gear.bore_diameter >= module * (gear.teeth - 2 * gear.dedendum):
        raise Refusal(
            f"{name}.bore_diameter", "the bore is as large as the root circle", "lower it"
        )
