"""The ball bearing of the worked example, and what flexgear makes of its seven loads."""

import math
from dataclasses import replace

import numpy as np

from flexgear.gears.bearings.bearing import BearingRating, RollingBearing, rate_load
from flexgear.gears.bearings.reference_life import Ratings
from flexgear.gears.bearings.rows import BallRow

D_W, D_PW = 11.5e-3, 43.5e-3
ROW = BallRow(7, D_W, D_PW, inner_groove=0.52 * D_W, outer_groove=0.53 * D_W)
TILT = 2.6872e-3
Load = tuple[float, float, float]
LOADS: dict[str, tuple[float, Load]] = {  # gap on every side, m; F_x, F_z, N; M_x, N m
    "no clearance, F_r": (0.0, (1e3, 0.0, 0.0)),
    "no clearance, F_a": (0.0, (0.0, 1e3, 0.0)),
    "clearance, F_r": (5e-6, (1e3, 0.0, 0.0)),
    "clearance, F_a": (5e-6, (0.0, 1e3, 0.0)),
    "clearance, F_r and F_a tilted": (5e-6, (1e3, 1e3, 0.0)),
    "no clearance, M": (0.0, (0.0, 0.0, 1.0)),
    "clearance, F_r, F_a and M": (5e-6, (1e3, 1e3, 1.0)),
}


def bearing(gap: float, arm: float | None = None) -> RollingBearing:
    """With a gap, m, and an arm of tilt, m, in place of that of the groove's centres."""
    return RollingBearing((replace(ROW, gap=gap, tilt_arm=arm),), Ratings(23400.0))


def rated(name: str, arm: float | None = None) -> BearingRating:
    """Under a load of ``LOADS``."""
    gap, (radial, axial, moment) = LOADS[name]
    held = {} if moment else {"rx": 0.0, "ry": TILT if "tilted" in name else 0.0}
    load = np.array([radial, 0.0, axial, moment, 0.0])
    return rate_load(bearing(gap, arm), load, "outer", held=held)


def figure(rating: BearingRating, name: str) -> float:
    """In the unit of reference.csv: µm, mrad and 10⁶ revolutions."""
    x, y, z, rx, ry = rating.motion
    return {
        "L_10r": rating.basic_life / 1e6,
        "radial deflection": 1e6 * math.hypot(x, y),
        "axial deflection": 1e6 * float(z),
        "tilt": 1e3 * math.hypot(rx, ry),
    }[name]
