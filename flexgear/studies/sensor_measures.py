"""Measures of a parameter study: what the sensors of a case record in its transient."""

from __future__ import annotations

import numpy as np
import xarray as xr

from flexgear.model.errors import FlexgearError
from flexgear.results.labelled_dataset import coordinate
from flexgear.results.sinks import SENSOR_TIME


def sensor_levels(data: xr.Dataset) -> dict[str, xr.DataArray]:
    """Root mean square about the mean of every signal from the settled window on."""
    signal = data["sensor_signal"]
    rest = signal.to_numpy()[data[SENSOR_TIME].to_numpy() >= data.attrs["settle_s"]]
    if not len(rest):
        raise FlexgearError("the settled part is too short for the filter of its sensors")
    about = {"units": "", "long_name": "root mean square about its mean of a signal, SI"}
    names = coordinate("sensor", "sensor", signal["sensor"].to_numpy())
    return {"sensor_rms": xr.DataArray(rest.std(axis=0), {"sensor": names}, "sensor", attrs=about)}


def sensor_signals(data: xr.Dataset) -> dict[str, xr.DataArray]:
    """Whole signals and rotations by the number of the sample, with its time of the first one and
    the time between two."""
    time = data[SENSOR_TIME].to_numpy()
    if len(time) < 2:
        raise FlexgearError("the transient is too short for the filter of its sensors")
    about = {"units": "1", "long_name": "number of a sample, from 0"}
    samples = xr.Variable("sample", np.arange(len(time)), about)
    values = {
        name: data[name]
        .drop_vars(SENSOR_TIME)
        .reset_coords(drop=True)
        .rename({SENSOR_TIME: "sample"})
        .assign_coords(sample=samples)
        for name in ("sensor_signal", "sensor_input_angle")
    }
    for name, value, meaning in (
        ("sensor_start", time[0], "time of the first sample"),
        ("sensor_interval", time[1] - time[0], "time between two samples"),
    ):
        values[name] = xr.DataArray(value, attrs={"units": "s", "long_name": meaning})
    return values
