"""What CalculiX is run for: planet and ring of `plane_contact/case.toml`, one pair at mid-path."""

from dataclasses import dataclass, replace

import numpy as np
from plane_contact.cases import pair, stage
from plane_contact.sector import Grid

from solid_contact.deck import Motion, Solid

SLICES = 15
# sizes are halved: 36 edges of about 1 mm along the flank, coarse elements of half a module; five
# teeth of each gear, held three modules below the root circle as the case's bodies are
GRID = Grid(flank=18, fillet=6, growth=0.5, coarse=1.0, neighbours=2, held=3.0, unloaded=0.4)
APPROACH = 90e-6  # m: close to the rated line load on one pair
OVER_FACE = 100e-6  # m: difference of the approach from end to end of the face
PARTLY_OPEN = (50e-6, 250e-6)  # both, where a third of the face does not touch


@dataclass(frozen=True)
class Run:
    """One run of CalculiX."""

    solid: Solid
    motion: Motion


def _runs() -> dict[str, Run]:
    face = stage().stage.face_width
    place = float(np.mean(pair("ring").path))
    solid = Solid(place, face, SLICES, 1, GRID, 3e3)
    tilted = Motion(APPROACH, OVER_FACE / face)
    few = replace(solid, slices=5)
    coarser = replace(GRID, flank=14, growth=0.8, coarse=1.6)
    short = replace(solid, face_width=face * 7 / SLICES, slices=7, grid=coarser)
    finer = replace(GRID, flank=30, growth=0.4, coarse=0.8)
    return {
        "even": Run(solid, Motion(APPROACH, 0.0)),
        "tilted": Run(solid, tilted),
        "partly open": Run(solid, Motion(PARTLY_OPEN[0], PARTLY_OPEN[1] / face)),
        "five slices": Run(few, tilted),
        "five slices, finer section": Run(replace(few, grid=finer), tilted),
        "five slices, stiffer contact": Run(replace(few, penalty=3e4), tilted),
        "short face": Run(short, tilted),
        "short face, twice the layers": Run(replace(short, layers=2), tilted),
    }


RUNS = _runs()
