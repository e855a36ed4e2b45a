"""Equilibria of grc-750kw over a carrier turn: rollers or tapered rollers, rotor moments."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

import flexgear as fg

ANGLES = np.radians(np.arange(0.0, 360.0, 15.0))
MOMENT = 300e3  # N m, chosen: the size that the dynamometer applied
QUICK = {
    "solver.fidelity": "quick",
    "stages.0.ring.fe.fixed_interface_modes": "20",
    "stages.0.carrier.fe.fixed_interface_modes": "20",
    "solver.reduction_limit_hz": "100",
}
CLEARANCES = (0.0, 0.1, 0.2, 0.3)  # mm on every side of the carrier bearings


@dataclass(frozen=True)
class Sharing:
    """Force on pins (angles, planets) and load of rows (angles, planets, rows), N."""

    pins: NDArray[np.float64]
    rows: NDArray[np.float64]

    @property
    def factor(self) -> float:
        """Largest force on a pin over the mean of all."""
        return float(self.pins.max() / self.pins.mean())

    @property
    def worst_row(self) -> float:
        """Largest load of a row over half the mean force on a pin."""
        return float(2 * np.nanmax(self.rows) / self.pins.mean())


@cache
def sharing(clearance: float = 0.1, axis: str = "", tapered: bool = False) -> Sharing:
    """clearance mm of the carrier bearings; axis: "x" or "y" of a rotor moment, "" for none;
    tapered: all bearings without clearance, as linear springs of the same stiffness."""
    case = fg.load_case("grc-750kw", {**QUICK, "loads.0.moment_nm": _moment(axis)})
    data = case.model_dump(mode="python")
    stage = data["stages"][0]
    for name in ("bearing_drive", "bearing_far"):
        rollers = stage["carrier"][name]["rollers"]
        stage["carrier"][name]["rollers"] = (
            None if tapered else {**rollers, "clearance": 1e-3 * clearance}
        )
    if tapered:
        stage["planet_bearing"]["rollers"] = None
    model = fg.assemble(type(case).model_validate(data))
    static = fg.static(model, ANGLES)
    pins = np.linalg.norm(static.planet_bearing_force.values[..., :2], axis=-1)
    rows = static.planet_bearing_row_load.values if not tapered else np.full((1, 3, 2), np.nan)
    return Sharing(pins, rows)


def _moment(axis: str) -> str:
    values = [MOMENT * (axis == name) for name in ("x", "y", "z")]
    return str(values)


def extreme(**options: object) -> Sharing:
    """The worse of the rotor's two moments."""
    found = [sharing(axis=axis, **options) for axis in ("x", "y")]  # type: ignore[arg-type]
    return max(found, key=lambda s: s.factor)
