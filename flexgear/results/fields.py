"""Full displacement fields of a body on its FE mesh, as a dataset."""

from __future__ import annotations

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from flexgear.results.quantities import AXES
from flexgear.results.version import version


def field_dataset(
    body: str, points: ArrayLike, cells: ArrayLike, displacement: ArrayLike, **attrs: float
) -> xr.Dataset:
    """points (p, 3) m, cells (c, 8 or 4) vertex numbers, displacement (p, 3) m."""
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
        },
        coords={"axis": list(AXES)},
        attrs={"title": f"deformed {body}", "body": body, "version": version(), **attrs},
    )
