"""reference.json as arrays."""

import json
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from flexgear.arrays import Array

FILE = Path(__file__).parent / "reference.json"


@dataclass(frozen=True)
class Stored:
    """One run: place s m, face_width m; motion as in ``deck``; forces (K,) N; reaction N; nodes of
    the FE mesh."""

    s: float
    face_width: float
    approach: float
    tilt: float
    forces: Array
    reaction: float
    nodes: int

    @property
    def line_load(self) -> Array:
        """(K,) N/m."""
        return self.forces * len(self.forces) / self.face_width

    @property
    def k_h_beta(self) -> float:
        """Largest line load over mean."""
        return float(self.forces.max() / self.forces.mean())


@cache
def data() -> dict[str, Any]:
    """The file."""
    return json.loads(FILE.read_text("utf-8"))


@cache
def run(name: str) -> Stored:
    """A run by its name."""
    entry = data()["runs"][name]
    solid = entry["solid"]
    return Stored(
        s=solid["s"],
        face_width=solid["face_width"],
        approach=entry["approach"],
        tilt=entry["tilt"],
        forces=np.array(entry["forces"]),
        reaction=entry["reaction"],
        nodes=entry["nodes"],
    )
