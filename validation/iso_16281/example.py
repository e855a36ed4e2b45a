"""The ball bearing of the worked example, and what flexgear makes of its five loads."""

from dataclasses import replace

import numpy as np

from flexgear.gears.bearings.bearing import BearingRating, RollingBearing, rate_load
from flexgear.gears.bearings.reference_life import Ratings
from flexgear.gears.bearings.rows import BallRow

D_W, D_PW = 11.5e-3, 43.5e-3
ROW = BallRow(7, D_W, D_PW, inner_groove=0.52 * D_W, outer_groove=0.53 * D_W)
TILT = 2.6872e-3
LOADS: dict[str, tuple[float, tuple[float, float]]] = {  # gap on every side, m; F_r, F_a, N
    "no clearance, F_r": (0.0, (1e3, 0.0)),
    "no clearance, F_a": (0.0, (0.0, 1e3)),
    "clearance, F_r": (5e-6, (1e3, 0.0)),
    "clearance, F_a": (5e-6, (0.0, 1e3)),
    "clearance, F_r and F_a tilted": (5e-6, (1e3, 1e3)),
}


def bearing(gap: float, arm: float | None = None) -> RollingBearing:
    """With a gap, m, and an arm of tilt, m, in place of that of the groove's centres."""
    return RollingBearing((replace(ROW, gap=gap, tilt_arm=arm),), Ratings(23400.0))


def rated(name: str, arm: float | None = None) -> BearingRating:
    """Under a load of ``LOADS``."""
    gap, (radial, axial) = LOADS[name]
    held = {"rx": 0.0, "ry": TILT if "tilted" in name else 0.0}
    load = np.array([radial, 0.0, axial, 0.0, 0.0])
    return rate_load(bearing(gap, arm), load, "outer", held=held)


def figure(rating: BearingRating, name: str) -> float:
    """In the unit of reference.csv: µm and 10⁶ revolutions."""
    if name == "L_10r":
        return rating.basic_life / 1e6
    return 1e6 * float(rating.motion[0 if name == "radial deflection" else 2])
