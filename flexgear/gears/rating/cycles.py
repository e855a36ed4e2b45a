"""Load cycles of flanks and roots: turns seen from what loads them.

    sun N |ω_s − ω_c|/2π,  ring N |ω_c − ω_r|/2π,  each flank of a planet |ω_p − ω_c|/2π

for N planets. A planet's root is loaded once a turn in either sense: one full alternation, not two
cycles. In a parallel stage pinion and gear are loaded once a turn.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from flexgear.gears.stage_flow import StageFlow
    from flexgear.model.stage_view import StageView


def load_cycles(view: StageView, flow: StageFlow) -> dict[tuple[str, str], float]:
    """Cycles per second of flank and root by gear mesh ("sun", "ring") and part."""
    turn = 2.0 * math.pi
    rates = {("sun", "sun"): abs(flow.sun_speed - flow.carrier_speed) * view.stage.planets / turn}
    rates["sun", "planet"] = abs(flow.planet_relative_speed) / turn
    if view.stage.kind == "planetary":
        rates["ring", "planet"] = rates["sun", "planet"]
        rates["ring", "ring"] = (
            abs(flow.ring_speed - flow.carrier_speed) * view.stage.planets / turn
        )
    return rates
