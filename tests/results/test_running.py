"""Figures of samples that come piece by piece are those of all samples together."""

import numpy as np
import pytest
import xarray as xr

from flexgear.results.load_sharing import DEFINITIONS, RunningSharing, cycle_maxima
from flexgear.results.sinks import Ranges

CUTS = ((), (1,), (3, 4, 50), (7, 7, 120, 399), tuple(range(1, 400)))


def pieces(values, cuts):
    return np.split(values, cuts)


@pytest.mark.parametrize("cuts", CUTS)
@pytest.mark.parametrize("per_cycle", [4.0, 10.0, 12.7, 133.3])
@pytest.mark.parametrize("sense", [1, -1])
def test_load_sharing_coefficients(cuts, per_cycle, sense):
    """By every definition, for cycles of a broken number of samples and either sense of load."""
    force = sense * (3 + np.random.default_rng(0).random((400, 3)))
    running = RunningSharing(3, per_cycle)
    for part in pieces(force, cuts):
        running.append(part)
    for definition in DEFINITIONS:
        largest = sense * force
        if definition != "instantaneous":
            largest = cycle_maxima(largest, per_cycle)
        share = 3 * largest / largest.sum(axis=1, keepdims=True)
        exact = 1 + np.abs(share - 1) if definition == "cycle-based" else share
        np.testing.assert_array_equal(running.planets(definition), exact.max(axis=0))


def test_coefficients_that_cannot_be_said():
    force = np.full((10, 2), 3.0)
    short, coarse, idle = RunningSharing(2, 11.0), RunningSharing(2, 3.9), RunningSharing(2, 5.0)
    short.append(force)
    coarse.append(force)
    idle.append(force)
    idle.append(0 * force)
    for running, known in ((short, 1), (coarse, 1), (idle, 0), (RunningSharing(2, 5.0), 0)):
        said = [np.isfinite(running.planets(d)).all() for d in DEFINITIONS]
        assert said == [known, 0, 0]


@pytest.mark.parametrize("cuts", CUTS)
def test_ranges(cuts):
    rng = np.random.default_rng(1)
    values, gaps = rng.standard_normal((400, 2, 3)), rng.standard_normal(400)
    gaps[::3] = np.nan
    data = xr.Dataset({"a": (("time", "x", "y"), values), "b": ("time", gaps)})
    ranges = Ranges(lambda d: d)
    for at in pieces(np.arange(400), cuts):
        ranges.append(data.isel(time=at))
    for found, name in ((ranges.least, "min"), (ranges.largest, "max"), (ranges.mean, "mean")):
        xr.testing.assert_allclose(found, getattr(data, name)("time"), rtol=1e-12)
    xr.testing.assert_identical(ranges.first, data.isel(time=0))
