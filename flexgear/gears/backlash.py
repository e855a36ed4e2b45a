"""Normal backlash that teeth are made with: what the case gives, else by a rule.

    j = 2/3 (0.06 mm + 0.0005 a + 0.03 m_n)

for the centre distance a and the normal module m_n. It is an allowance: teeth of ring and sun
(pinion) are thinner by it, beside what profile shifts leave at the centre distance. Linear contact
has no coast flanks, and no allowance unless it is given.

Source: ISO/TR 10064-2:1996, recommended minimum for steel gears in steel housings, pitch-line
speeds below 15 m/s and usual tolerances of shafts, bearings and housing.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from flexgear.model.stage_view import StageView

RULE = "2/3 (0.06 mm + 0.0005 a + 0.03 m_n), ISO/TR 10064-2"


def least_backlash(center_distance: float, normal_module: float) -> float:
    """j of the module's head, m."""
    return 2.0 / 3.0 * (0.06e-3 + 0.0005 * abs(center_distance) + 0.03 * normal_module)


def backlash_allowance(view: StageView, role: str, center_distance: float) -> float:
    """Normal backlash of the planets with "ring" or "sun" that thinner teeth make, m."""
    stage = view.stage
    stated = stage.backlash_ring if role == "ring" else stage.backlash_sun
    if stated is not None:
        return stated
    if view.gear_mesh.contact_law == "linear":
        return 0.0
    return least_backlash(center_distance, stage.normal_module)


def backlash_source(view: StageView, role: str) -> str:
    """What sets the backlash: the case, linear contact (none), or the rule; a phrase to print."""
    stage = view.stage
    if (stage.backlash_ring if role == "ring" else stage.backlash_sun) is not None:
        return "as the case says"
    return RULE if view.gear_mesh.contact_law == "one-sided" else "linear contact needs none"
