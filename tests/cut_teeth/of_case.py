"""Gears of a case for the brute-force cutter: what the case states, and the rules for what it does
not, written again."""

from typing import Any

from cut_teeth.gear import Gear
from flexgear.gears.radii import gears_by_role
from flexgear.model.stage_view import StageView


def gear_of(view: StageView, role: str) -> Gear:
    """Of "sun", "planet" or "ring"."""
    return cut_gear(gears_by_role(view.stage)[role], view.stage, internal=role == "ring")


def cut_gear(blank: Any, stage: Any, *, internal: bool) -> Gear:
    """Of a gear and what has its normal section. A ring's cutter has half of its teeth."""
    tool = blank.tool
    return Gear(
        teeth=blank.teeth,
        module=stage.normal_module,
        internal=internal,
        shift=blank.profile_shift,
        alpha=stage.pressure_angle,
        helix=stage.helix_angle,
        addendum=blank.addendum,
        dedendum=blank.dedendum,
        rounding=blank.root_fillet,
        cutter_teeth=tool.teeth or (blank.teeth // 2 if internal else 0),
        cutter_shift=tool.profile_shift,
        protuberance=tool.protuberance,
        allowance=tool.grinding_allowance,
        ramp=tool.protuberance_angle,
    )
