"""A measure of a parameter study: a named function that returns labelled arrays at a point."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from flexgear.analysis.mode_types import classify, members
from flexgear.solve.model import Model

MeasuredValues = dict[str, xr.DataArray]


@dataclass(frozen=True)
class Measure:
    """name: as on the command line; about: in words; of: point -> arrays by variable name."""

    name: str
    about: str
    of: Callable[[Any], MeasuredValues]


LABELS = {
    "mode": "number of the mode above the rigid motions, by rising frequency",
    "type": "type of mode",
    "number": "number among the different frequencies of this type",
    "gear_mesh": "gear meshes of the stage",
    "group": "gear meshes of all planets of a stage, kind and side",
    "body": "member, or node that stands for it",
    "statistic": "over all positions or times",
    "definition": "definition of load sharing",
    "member": "member of the train",
    "stage": "stage of the train",
    "bearing": "kind of bearing: ball or roller",
    "axis": "direction",
}


def array(
    values: ArrayLike, units: str, meaning: str, **labels: Sequence[int] | Sequence[str]
) -> xr.DataArray:
    """Values with their unit; labels: dimension -> labels, in the order of the axes."""
    coords = {
        dim: (dim, list(ticks), {"units": "1" if dim in ("mode", "number") else "",
                                 "long_name": LABELS[dim]})
        for dim, ticks in labels.items()
    }  # fmt: skip
    about = {"units": units, "long_name": meaning}
    return xr.DataArray(np.asarray(values), coords, tuple(labels), attrs=about)


def frequencies(model: Model, count: int) -> MeasuredValues:
    """The ``count`` lowest elastic frequencies and their types, as ``solve.modes`` has them."""
    natural, system = model.natural_modes(), model.system
    rigid = int(np.sum(natural.frequencies == 0))
    types = classify(
        natural.frequencies, natural.shapes, system.mass, members(system.bodies), rigid=rigid
    )
    f, kinds = natural.frequencies[rigid:][:count], types.kinds[rigid:][:count]
    ticks = range(1, len(f) + 1)
    return {
        "frequency": array(f, "Hz", "natural frequency", mode=ticks),
        "mode_type": array(np.array(kinds, dtype=str), "", "type of mode", mode=ticks),
    }


def frequencies_by_type(model: Model, count: int) -> MeasuredValues:
    """The ``count`` lowest different elastic frequencies of every type of mode."""
    natural, system = model.natural_modes(), model.system
    rigid = int(np.sum(natural.frequencies == 0))
    types = classify(
        natural.frequencies, natural.shapes, system.mass, members(system.bodies), rigid=rigid
    )
    columns: dict[str, list[float]] = {}
    for group in types.groups:
        if group[0] < rigid:
            continue
        for kind in dict.fromkeys(types.kinds[i] for i in group):
            columns.setdefault(kind, []).append(float(natural.frequencies[group[0]]))
    longest = min(count, max(map(len, columns.values()), default=0))
    values = np.full((len(columns), longest), np.nan)
    for k, column in enumerate(columns.values()):
        values[k, : len(column[:count])] = column[:count]
    return {
        "frequency_by_type": array(
            values, "Hz", "natural frequency, repeated ones once",
            type=list(columns), number=range(1, longest + 1),
        )
    }  # fmt: skip


def largest(values: Mapping[str, ArrayLike], units: str, meaning: str, dim: str) -> xr.DataArray:
    """The largest of each array, by label."""
    data = [float(np.max(np.asarray(v))) for v in values.values()]
    return array(data, units, meaning, **{dim: list(values)})
