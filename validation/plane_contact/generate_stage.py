"""Make stage.json again: `cd validation && python -m plane_contact.generate_stage` (minutes)."""

from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexgear.model.load import load_case
from flexgear.model.stage_view import StageView
from plane_contact.body import Elastic
from plane_contact.generate import rounded, text_of
from plane_contact.sector import Grid
from plane_contact.stage import PlaneStage, Springs

FOLDER = Path(__file__).parent
FILE, CASE = FOLDER / "stage.json", FOLDER / "stage_case.toml"
GRID = Grid(flank=40, fillet=8)
COUNT = 8  # carrier angles over a tooth of the ring
WINDOW = 6e-4  # m, twice the wind-up of planets on their pins
UNITS = {
    "angles": "rad, of the carrier",
    "forces": "N/m, gear meshes with ring and sun, (2, planets)",
    "loads": "N/m, of their pairs at places, (2, planets, 3)",
    "places": "m, path coordinates of the pairs, (2, planets, 3)",
    "ring": "m, displacement of the tooth roots in fixed axes, (teeth, 2)",
    "line_load": "N/m, rated gear-mesh force over the face width",
}


def stage() -> StageView:
    """The stage of stage_case.toml."""
    return load_case(CASE).view()


def springs(view: StageView) -> Springs:
    """Those of the case, per metre of face."""
    band, face = view.ring.splines[0], view.stage.face_width
    return Springs(
        ring=band.stiffness_radial / face,
        torsion=band.stiffness_torsion / face,
        pin=view.stage.planet_bearing.radial / face,
        sun=view.stage.sun.support.radial / face,
    )


def as_plane_stress(material: Elastic) -> Elastic:
    """Constants with which equations of plane strain are those of plane stress."""
    e, nu = material.young, material.poisson
    return Elastic(e * (1 + 2 * nu) / (1 + nu) ** 2, nu / (1 + nu))


def angles(view: StageView) -> NDArray[np.float64]:
    """(COUNT,) carrier angles over one tooth of the ring, rad."""
    return np.arange(COUNT) / COUNT * 2 * np.pi / view.stage.ring.teeth


def computed(ring: Elastic, material: Elastic) -> dict[str, Any]:
    """All angles with a ring of that material."""
    view = stage()
    at = angles(view)
    model = PlaneStage(view, (material, ring), springs(view), GRID, at)
    results = [model.at(angle, WINDOW) for angle in at]
    return {
        name: rounded([getattr(one, name) for one in results])
        for name in ("forces", "loads", "places", "ring")
    } | {"line_load": model.load, "angles": at.tolist()}


def main() -> None:
    """Write the file."""
    m = stage().material
    steel = Elastic(m.young_modulus, m.poisson_ratio)
    data = {
        "what": "whole plane planetary stage with elastic contact, stage_case.toml",
        "made_by": "validation/plane_contact/generate_stage.py",
        "units": UNITS,
        "grid": asdict(GRID),
        "springs": asdict(springs(stage())),
        "ring in plane strain": computed(steel, steel),
        "ring in plane stress": computed(as_plane_stress(steel), steel),
    }
    FILE.write_text(text_of(data), encoding="utf-8")


if __name__ == "__main__":
    main()
