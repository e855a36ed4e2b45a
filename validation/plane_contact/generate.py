"""Make reference.json again: `cd validation && python -m plane_contact.generate` (some minutes)."""

import json
import re
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from plane_contact.cases import (
    FINE,
    KINDS,
    LOADINGS,
    RELIEF_MM,
    RELIEF_UM,
    Loading,
    contact,
    line_load,
    material,
    over_a_pitch,
    pair,
    places,
)
from plane_contact.gear_contact import ContactResult, GearContact
from plane_contact.sector import Grid

FILE = Path(__file__).parent / "reference.json"
COUNT = 48
FEWER = 16  # places for the studies of the grid
PLAIN = Loading(1.0)
GRIDS = {
    "flank 80": replace(FINE, flank=80),
    "flank 160": replace(FINE, flank=160),
    "flank 320": replace(FINE, flank=320),
    "fillet 8": replace(FINE, flank=160, fillet=8),
    "fillet 16": replace(FINE, flank=160, fillet=16),
    "fillet 64": replace(FINE, flank=160, fillet=64),
    "growth 0.12": replace(FINE, flank=160, growth=0.12),
    "held 2": replace(FINE, flank=160, held=2.0),
    "held 4.5": replace(FINE, flank=160, held=4.5),
    "neighbours 2": replace(FINE, flank=160, neighbours=2),
}
UNITS = {
    "s": "m, of the middle pair, from the planet's base tangent point",
    "error": "m, lag of the planet on its base circle under the load",
    "loads": "N/m, pairs of the planet's teeth -1, 0, 1 at s - p, s, s + p (p: base pitch)",
    "planet_stress": "Pa, largest tension on the fillet below the touching flank, teeth -1, 0, 1",
    "gear_stress": "Pa, likewise on the gear's tooth of the same pair",
    "line_load": "N/m",
    "half_width": "m, of the touching zone of each pair, from the second moment of its load",
}


def series(results: list[ContactResult]) -> dict[str, Any]:
    """Values at all places."""
    return {
        "error": rounded([f.error for f in results]),
        "loads": rounded([f.loads for f in results]),
        "half_width": rounded([f.half_widths for f in results]),
        "planet_stress": rounded([f.root_stress[0] for f in results]),
        "gear_stress": rounded([f.root_stress[1] for f in results]),
    }


def rounded(values: Any) -> Any:
    """Six digits."""
    text = json.dumps(np.array(values).tolist())
    return json.loads(text, parse_float=lambda digits: float(f"{float(digits):.6g}"))


def summary(results: list[ContactResult]) -> dict[str, float]:
    """What a study of the grid looks at."""
    error = np.array([f.error for f in results])
    stress = np.array([f.root_stress for f in results]).max(axis=(0, 2))
    out = {
        "error_mean": error.mean(),
        "error_peak_to_peak": np.ptp(error),
        "largest_load": max(f.loads.max() for f in results),
        "largest_planet_stress": stress[0],
        "largest_gear_stress": stress[1],
    }
    return {name: float(f"{value:.6g}") for name, value in out.items()}


def of_kind(kind: str) -> dict[str, Any]:
    """Everything of one pair."""
    p = pair(kind)
    bodies = contact(kind, FINE)
    return {
        "gears": {"planet": asdict(p.planet), "gear": asdict(p.gear)},
        "centre_distance": p.distance,
        "working_angle": p.working,
        "path": p.path,
        "base_pitch": p.planet.base_pitch,
        "line_load": line_load(kind),
        "s": rounded(places(kind, COUNT)),
        "loadings": {one.name: series(computed(bodies, kind, one)) for one in LOADINGS},
        "grids": {name: study(kind, grid) for name, grid in GRIDS.items()},
    }


def computed(bodies: GearContact, kind: str, loading: Loading) -> list[ContactResult]:
    """One loading, with a line of news."""
    print(kind, loading.name, flush=True)
    return over_a_pitch(bodies, kind, loading, COUNT)


def study(kind: str, grid: Grid) -> dict[str, float]:
    """Summary with another grid."""
    print(kind, grid, flush=True)
    return summary(over_a_pitch(contact(kind, grid), kind, PLAIN, FEWER))


def main() -> None:
    """Write the file."""
    data = {
        "what": "plane-strain FE contact of whole spur gear pairs, case.toml",
        "made_by": "validation/plane_contact/generate.py",
        "units": UNITS,
        "material": asdict(material()),
        "relief": {"amount_um": RELIEF_UM, "length_mm": RELIEF_MM, "form": "linear, both gears"},
        "grid": asdict(FINE),
        "pairs": {kind: of_kind(kind) for kind in KINDS},
    }
    FILE.write_text(text_of(data), encoding="utf-8")


def text_of(data: Any) -> str:
    """JSON with a list of numbers, or a row of a table, to the line."""
    text = json.dumps(data, indent=1)
    return re.sub(r"\[[^][{}]*\]", lambda m: re.sub(r"\s+", " ", m.group()), text) + "\n"


if __name__ == "__main__":
    main()
