"""reference.json as arrays, and what of it is compared."""

import json
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from flexgear.arrays import Array

FILE = Path(__file__).parent / "reference.json"


@dataclass(frozen=True)
class Series:
    """One loading over a base pitch: error (places,) m; loads, half_width, planet_stress and
    gear_stress (places, 3)."""

    error: Array
    loads: Array
    half_width: Array
    planet_stress: Array
    gear_stress: Array


@cache
def pairs() -> dict[str, Any]:
    """By kind of gear mesh."""
    return json.loads(FILE.read_text("utf-8"))["pairs"]


def places(kind: str) -> Array:
    """s of the middle pair, m."""
    return np.array(pairs()[kind]["s"])


def series(kind: str, name: str) -> Series:
    """A loading by its name."""
    return Series(**{k: np.array(v) for k, v in pairs()[kind]["loadings"][name].items()})


def along_path(kind: str, values: Array) -> tuple[Array, Array]:
    """Place of a pair on its path and its values, both (3 places,) in order of the place."""
    pitch = pairs()[kind]["base_pitch"]
    s = (places(kind)[:, None] + pitch * np.array([-1, 0, 1])).T.ravel()
    return s, values.T.ravel()
