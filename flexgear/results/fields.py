"""Full fields of displacement and stress of a body on its FE mesh, as a dataset."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from flexgear.results.quantities import AXES
from flexgear.structures.strain import COMPONENTS, von_mises

_HOW = "of the gradient fitted to displacements around a vertex, one value for all cells there"


def field_dataset(
    body: str,
    points: ArrayLike,
    cells: ArrayLike,
    displacement: ArrayLike,
    stress: NDArray[np.float64],
    **attrs: Any,
) -> xr.Dataset:
    """points (p, 3) m, cells (c, 8 or 4) vertex numbers, displacement (p, 3) m, stress (p, 6) Pa.

    attrs: beside the body's name, ``provenance`` of the result among them.
    """
    return xr.Dataset(
        {
            "point": (
                ("vertex", "axis"),
                np.asarray(points, dtype=float),
                {"units": "m", "long_name": "vertex of the FE mesh"},
            ),
            "cell": (
                ("element", "corner"),
                np.asarray(cells, dtype=np.int32),
                {"units": "1", "long_name": "vertices of a cell, in scikit-fem's order, from 0"},
            ),
            "displacement": (
                ("vertex", "axis"),
                np.asarray(displacement, dtype=float),
                {"units": "m", "long_name": "displacement, rolling taken off"},
            ),
            "stress": (
                ("vertex", "component"),
                stress,
                {"units": "Pa", "long_name": f"stress, {_HOW}"},
            ),
            "von_mises_stress": (
                "vertex",
                von_mises(stress),
                {"units": "Pa", "long_name": f"equivalent stress (von Mises), {_HOW}"},
            ),
        },
        coords={"axis": list(AXES), "component": list(COMPONENTS)},
        attrs={"body": body, **attrs},
    )
