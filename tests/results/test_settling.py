"""When a run has settled: decaying, steady and growing vibration of known size."""

import numpy as np
import pytest
import xarray as xr

from flexgear.results.load_sharing import DEFINITIONS, RunningSharing
from flexgear.results.settling import SHARE, WINDOWS, Settling, WindowedRanges, cut, window_edges
from flexgear.results.sinks import Ranges

PERIOD, SPAN, FREE = 0.05, 4.0, 33.0  # s, s, Hz of the free vibration
TIME = np.linspace(0.0, SPAN, 16_001)


def run(free):
    """One gear mesh with a mean, its period, runout once in the run, and free vibration (t,)."""
    force = 100 + 4 * np.sin(2 * np.pi * TIME / PERIOD) + 6 * np.cos(2 * np.pi * TIME / SPAN)
    force += free * np.cos(2 * np.pi * FREE * TIME)
    motion = np.zeros((len(TIME), 1, 2))
    return xr.Dataset(
        {"gear_mesh_force": (("time", "gear_mesh"), force[:, None]),
         "body_displacement": (("time", "body", "dof"), motion)},
        {"time": TIME, "body": ["stage.sun"], "dof": ["ux", "uy"]},
    )  # fmt: skip


def window(free, pieces=9, period=PERIOD):
    settling = Settling(period, SPAN)
    for at in np.array_split(np.arange(len(TIME)), pieces):
        settling.append(run(free).isel(time=at))
    return settling.window()


@pytest.mark.parametrize("pieces", [1, 9, 150])
@pytest.mark.parametrize("tau", [0.1, 0.3])
def test_start_up_ends_where_what_is_left_of_it_is_a_share_of_the_peak_to_peak(tau, pieces):
    """|x(t) − x(t − P)| of B e^(−t/τ) cos ωt has the amplitude B e^(−t/τ) |1 − e^(P/τ − iωP)|."""
    size = 30.0
    steady = window(size * np.exp(-TIME / tau), pieces)
    left = size * abs(1 - np.exp(PERIOD / tau - 2j * np.pi * FREE * PERIOD))
    peak_to_peak = 2 * (4 + 6)
    expected = tau * np.log(left / (SHARE * peak_to_peak))
    assert steady.settled
    assert steady.start == pytest.approx(expected, abs=1.6 * SPAN / WINDOWS)
    assert steady.end == SPAN
    rest = size * np.exp(-steady.start / tau)
    assert rest < SHARE * peak_to_peak


def test_runout_is_no_start_up():
    steady = window(np.zeros_like(TIME))
    assert (steady.start, steady.settled) == (0.0, True)


@pytest.mark.parametrize(
    ("free", "sentence"),
    [
        (3 * TIME / SPAN, "grows until the end"),
        (60 * np.exp(-TIME / 2), "still decays at the end"),
    ],
)
def test_a_run_that_does_not_settle_says_so(free, sentence):
    steady = window(free)
    assert (steady.start, steady.end, steady.settled) == (0.0, SPAN, False)
    assert sentence in steady.sentence


@pytest.mark.parametrize("samples", [4001, 6960, 8000])
def test_load_that_jumps_between_samples_is_no_growth(samples):
    """A square wave, as of spur gears: |x(t) − x(t − P)| of samples is any part of its jump. With
    6960 samples, 86.99 in a period, it rises through the run."""
    time = np.linspace(0.0, SPAN, samples)
    force = 100 + 10.0 * (np.mod(time / PERIOD + 0.37, 1.0) < 0.4)
    motion = np.zeros((len(time), 1, 2))
    settling = Settling(PERIOD, SPAN)
    settling.append(
        xr.Dataset(
            {"gear_mesh_force": (("time", "gear_mesh"), force[:, None]),
             "body_displacement": (("time", "body", "dof"), motion)},
            {"time": time, "body": ["stage.sun"], "dof": ["ux", "uy"]},
        )
    )  # fmt: skip
    assert settling.window().settled


@pytest.mark.parametrize("seed", range(5))
def test_impacts_of_another_gear_mesh_are_no_start_up(seed):
    """Short impacts at any time of the period, as of a stage with another gear-mesh frequency: the
    largest difference of a quarter falls by chance."""
    rng = np.random.default_rng(seed)
    free = np.zeros_like(TIME)
    for quarter, largest in zip(
        np.split(np.arange(1, len(TIME)), 4), (9.0, 9.0, 8.5, 4.0), strict=True
    ):
        at = rng.choice(quarter, 12, replace=False)
        free[at] = largest * np.concatenate([[1.0], rng.uniform(0.1, 0.4, 11)])
    data = run(0.0 * TIME)
    data["gear_mesh_force"] = data["gear_mesh_force"] + free[:, None]
    settling = Settling(PERIOD, SPAN)
    settling.append(data)
    assert settling.window().settled


def test_a_few_periods_cannot_tell():
    steady = window(np.exp(-TIME), period=0.6)
    assert (steady.start, steady.settled) == (0.0, None)
    assert "too few" in steady.sentence


def test_ranges_and_load_sharing_of_the_later_windows_are_those_of_their_samples():
    rng = np.random.default_rng(2)
    force = 3 + rng.random((len(TIME), 3))
    data = xr.Dataset({"force": (("time", "planet"), force)}, {"time": TIME})
    edges = window_edges(SPAN)
    start = edges[7]
    ranges = WindowedRanges(lambda x: x, edges)
    sharing = RunningSharing(3, 50.0)
    for at in np.array_split(np.arange(len(TIME)), 5):
        chunk = data.isel(time=at)
        ranges.append(chunk)
        for k, piece in cut(chunk["time"].to_numpy(), edges):
            sharing.append(chunk["force"].to_numpy()[piece], k)
    later = data.sel(time=slice(start, None))
    exact = Ranges(lambda x: x)
    exact.append(later)
    for name in ("least", "largest", "mean", "first"):
        xr.testing.assert_allclose(getattr(ranges.since(start), name), getattr(exact, name))
    alone = RunningSharing(3, 50.0)
    alone.append(later["force"].to_numpy())
    for definition in DEFINITIONS[:1]:
        factors = sharing.planets(definition, 7)
        np.testing.assert_allclose(factors, alone.planets(definition))
