"""Figures of what sensors record: mean, root mean square about it, least and largest value."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from flexgear.arrays import Array
from flexgear.results.settling import WindowedRanges
from flexgear.results.sinks import SENSOR_TIME, TIME, Coming, DatasetSink


class SensorRanges(DatasetSink):
    """A sink: ranges of the signals of sensors, from any window of a run on."""

    def __init__(self, edges: Array) -> None:
        self._ranges = WindowedRanges(_powers, edges)
        self._units: dict[str, str] = {}

    def begin(self, coming: Coming) -> None:
        """Begin anew."""
        self._ranges.begin(coming)
        if "sensor" in coming.pattern:
            names, units = (coming.pattern[n].to_numpy() for n in ("sensor", "sensor_unit"))
            self._units = dict(zip(map(str, names), map(str, units), strict=True))

    def append(self, data: xr.Dataset) -> None:
        """Look at some samples more."""
        if data.sizes.get(SENSOR_TIME):
            of_sensors = data[["sensor_signal"]].drop_vars(TIME, errors="ignore")
            self._ranges.append(of_sensors.rename({SENSOR_TIME: TIME}))

    def figures(self, start: float) -> dict[str, dict[str, Any]]:
        """By sensor, of the windows from ``start`` s on; empty without any sample."""
        rest = self._ranges.since(start)
        if not rest.first.data_vars:
            return {}
        mean, square = (rest.mean[n].to_numpy() for n in ("sensor_signal", "square"))
        least, largest = (r["sensor_signal"].to_numpy() for r in (rest.least, rest.largest))
        rms = np.sqrt(np.maximum(square - mean**2, 0.0))
        return {
            name: {
                "unit": unit,
                "mean": float(mean[k]),
                "rms_about_mean": float(rms[k]),
                "min": float(least[k]),
                "max": float(largest[k]),
            }
            for k, (name, unit) in enumerate(self._units.items())
        }


def _powers(data: xr.Dataset) -> xr.Dataset:
    return data.assign(square=data["sensor_signal"] ** 2)
