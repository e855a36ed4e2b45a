"""Tolerance study of grc-750kw: sets of parts with random errors, bearings without clearance.

Bearings with clearance would be solved sample by sample (hours); as linear springs all samples of
a position follow from one product. `python -m grc.monte_carlo` in validation/ writes samples.csv.
"""

import csv
from pathlib import Path
from typing import Any

import numpy as np

import flexgear as fg
from flexgear.files.atomic import atomic_file
from flexgear.model.case import Case
from flexgear.studies.tolerance import tolerance
from grc.by_cause import QUICK
from grc.causes import Cause, every_cause

STORED = Path(__file__).with_name("samples.csv")
SAMPLES = 100
STUDIED = (
    "tapered planet and carrier bearings",
    "all tapered, all errors, sun held",
)
DISTANCE = "rayleigh"  # of a point whose two coordinates are normal
DEVIATIONS: dict[str, dict[str, Any]] = {  # m; cut off where grc.causes has its worst case
    "pin_tangential": {"standard_deviation": 10e-6, "low": -30e-6, "high": 30e-6},
    "planet_eccentricity": {
        "distribution": DISTANCE, "standard_deviation": 8e-6, "high": 20e-6,
    },
    "sun_eccentricity": {"distribution": DISTANCE, "standard_deviation": 8e-6, "high": 20e-6},
    "ring_eccentricity": {"distribution": DISTANCE, "standard_deviation": 16e-6, "high": 40e-6},
    "carrier_eccentricity": {
        "distribution": DISTANCE, "standard_deviation": 12e-6, "high": 30e-6,
    },
}  # fmt: skip
PHASES = ("planet", "sun", "ring", "carrier")  # whose eccentricities lie in any direction


def studied(cause: Cause) -> Case:
    """The case of a cause, its errors drawn."""
    keys = {key: text for key, text in cause.keys.items() if ".errors." not in key}
    none: dict[str, Any] = {f"stages.0.{name}.rollers": None for name in cause.linear}
    drawn = DEVIATIONS | {f"{part}_eccentricity_phase": {} for part in PHASES}
    study = {"tolerance.samples": SAMPLES,
             "tolerance.by_stage": ({"stage": "lss", "errors": drawn},)}  # fmt: skip
    return fg.load_case("grc-750kw", {**QUICK, **keys}).with_(**none, **study)


def main() -> None:
    """Largest K_gamma over a turn of every sample: median, 95 % and largest."""
    with atomic_file(STORED) as path, path.open("w", encoding="utf-8", newline="") as stream:
        out = csv.writer(stream, lineterminator="\n")
        out.writerow(["cause", "samples", "median", "95 %", "largest"])
        for cause in every_cause():
            if cause.name not in STUDIED:
                continue
            data = tolerance(studied(cause), workers=1)
            largest = data["load_sharing_max"].sel(group="lss sun").to_numpy()
            figures = np.quantile(largest, [0.5, 0.95, 1.0])
            out.writerow([cause.name, len(largest), *(f"{x:.4f}" for x in figures)])


if __name__ == "__main__":
    main()
