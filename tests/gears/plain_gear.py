"""A gear and its rack as numbers, without a case."""

import math
from dataclasses import dataclass, replace

from flexgear.gears.tool import PLAIN_TOOL, PlainTool
from flexgear.gears.tooth import ToothGeometry, tooth_geometry


@dataclass(frozen=True)
class Gear:
    """A rack and what is cut with it; lengths m, angles rad."""

    teeth: int = 31
    profile_shift: float = 0.2
    addendum: float = 1.0
    dedendum: float = 1.25
    root_fillet: float = 0.3
    normal_module: float = 5e-3
    pressure_angle: float = math.radians(20)
    helix_angle: float = 0.0
    tool: PlainTool = PLAIN_TOOL

    def tooth(self, internal: bool = False, **changes: object) -> ToothGeometry:
        """Of this gear, or of one with some numbers changed."""
        gear = replace(self, **changes)  # type: ignore[arg-type]
        return tooth_geometry(gear, gear, internal=internal)
