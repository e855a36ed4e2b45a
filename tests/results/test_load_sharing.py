"""Load sharing factor, spread and coefficients against sums done by hand and closed forms."""

import numpy as np
import pytest
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from flexgear.model.errors import FlexgearError
from flexgear.results.load_sharing import (
    DEFINITIONS,
    MESH_LOAD_FACTOR,
    RunningSharing,
    cycle_maxima,
    load_sharing,
    planet_load_factors,
)
from flexgear.results.sinks import Ranges

AT_ONCE = "instantaneous"
FORCES = arrays(float, (24, 4), elements=st.floats(1.0, 100.0))


def test_load_sharing_factors_by_hand():
    """Even loads, uneven ones, and one planet that takes all."""
    k = load_sharing([[3.0, 3.0, 3.0], [1.0, 2.0, 3.0], [4.0, 4.0, 1.0], [9.0, 0.0, 0.0]], 2.0)
    np.testing.assert_allclose(k, [1.0, 3 * 3 / 6, 3 * 4 / 9, 3.0], rtol=1e-15)


def test_not_evaluated_below_three_percent_of_rated_sum():
    rated, planets = 100.0, 4
    total = np.array([0.0299, 0.0301]) * rated * planets
    k = load_sharing(total[:, None] * np.array([0.4, 0.3, 0.2, 0.1]), rated)
    assert np.isnan(k[0])
    np.testing.assert_allclose(k[1], 1.6)


def test_through_zero_is_not_a_number_and_warns_of_nothing():
    with np.errstate(all="raise"):
        assert np.isnan(load_sharing([[1.0, -1.0]], 5.0)).all()


@given(force=FORCES)
def test_planet_factors_average_to_one_and_peak_at_k(force):
    k = planet_load_factors(force, 10.0)
    np.testing.assert_allclose(k.mean(axis=-1), 1.0)
    np.testing.assert_allclose(k.max(axis=-1), load_sharing(force, 10.0))
    np.testing.assert_allclose(planet_load_factors(-force, 10.0), k)


def test_maxima_of_cycles_by_hand():
    f = np.array([[1, 5], [3, 2], [2, 2], [4, 1], [9, 9]], dtype=float)
    np.testing.assert_array_equal(cycle_maxima(f, 2), [[3, 5], [4, 2]])
    np.testing.assert_array_equal(cycle_maxima(f, 2.5), [[3, 5], [9, 9]])
    np.testing.assert_array_equal(cycle_maxima(f, 5), [[9, 9]])
    np.testing.assert_array_equal(cycle_maxima(f, 1), f)


@given(samples=st.integers(1, 40), cycles=st.integers(1, 30), extra=st.floats(0, 0.99))
def test_whole_cycles_are_counted_for_any_length(samples, cycles, extra):
    n = int(samples * (cycles + extra))
    assert len(cycle_maxima(np.ones((n, 2)), samples)) == cycles
    third = 1 / 3 + samples
    assert len(cycle_maxima(np.ones((round(third * 3 * cycles), 2)), third)) == 3 * cycles


def coefficients(definition, force, samples_per_cycle):
    running = RunningSharing(np.shape(force)[1], samples_per_cycle)
    running.append(force)
    return running.planets(definition)


def test_definitions_by_hand():
    """One planet overloaded by 10 % in the first cycle, lightened by 20 % in the second."""
    f = np.repeat([[110.0, 95, 95], [80, 110, 110]], 4, axis=0)
    np.testing.assert_allclose(coefficients("mean-based", f, 4), [1.1, 1.1, 1.1])
    np.testing.assert_allclose(coefficients("cycle-based", f, 4), [1.2, 1.1, 1.1])


def test_maxima_at_different_times_share_evenly_by_cycle_but_not_at_once():
    """Equal loads that swing out of phase: B = 1 over a cycle, K > 1 at any time."""
    t = 2 * np.pi * np.arange(12) / 12
    f = 100 + 10 * np.cos(t[:, None] + 2 * np.pi * np.arange(3) / 3)
    assert coefficients("mean-based", f, 12).max() == pytest.approx(1.0)
    assert coefficients("instantaneous", f, 12).max() == pytest.approx(1.1)


@given(force=FORCES)
def test_order_of_definitions(force):
    """Ren ≥ Hu ≤ instantaneous; sense of torque is free."""
    hu, ren, at_once = (coefficients(d, force, 6) for d in ("mean-based", "cycle-based", AT_ONCE))
    assert ren.max() >= hu.max() - 1e-12
    assert hu.max() >= 1 - 1e-12
    assert np.all(hu <= at_once + 1e-12)
    np.testing.assert_allclose(coefficients("mean-based", -force, 6), hu)
    instantaneous = load_sharing(force, force.mean()).max()
    np.testing.assert_allclose(at_once.max(), instantaneous, rtol=1e-12)


def test_mesh_load_factor_of_iec_61400_4():
    assert MESH_LOAD_FACTOR == {3: 1.10, 4: 1.25, 5: 1.35, 6: 1.44, 7: 1.47}


def test_cycle_maxima_of_too_few_samples_are_refused():
    with pytest.raises(FlexgearError, match="less than one gear-mesh cycle"):
        cycle_maxima(np.ones((4, 3)), 5)
    with pytest.raises(FlexgearError, match="save results more often"):
        cycle_maxima(np.ones((4, 3)), 0.5)
    lost = np.repeat([[1.0, 1], [1, 1], [-1, -1]], 4, axis=0)
    assert np.isnan(coefficients("mean-based", lost, 4)).all()


def test_forces_that_add_up_to_nothing_have_no_load_sharing():
    """Without rated torque the forces themselves say whether there is a load to share."""
    pressed = np.array([[100.0, -60.0, -40.0 + 1e-12], [0.0, 0.0, 0.0], [30.0, 20.0, 10.0]])
    np.testing.assert_allclose(load_sharing(pressed, 0.0), [np.nan, np.nan, 1.5])
    np.testing.assert_allclose(planet_load_factors(pressed, 0.0)[2], [1.5, 1.0, 0.5])
    assert np.isnan(planet_load_factors(pressed, 0.0)[:2]).all()


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


def test_coefficients_of_short_coarse_or_unloaded_runs_are_nan():
    force = np.full((10, 2), 3.0)
    short, coarse, idle = RunningSharing(2, 11.0), RunningSharing(2, 3.9), RunningSharing(2, 5.0)
    short.append(force)
    coarse.append(force)
    idle.append(force)
    idle.append(0 * force)
    for running, count in ((short, 1), (coarse, 1), (idle, 0), (RunningSharing(2, 5.0), 0)):
        finite = [np.isfinite(running.planets(d)).all() for d in DEFINITIONS]
        assert finite == [count, 0, 0]


@pytest.mark.parametrize("cuts", CUTS)
def test_ranges(cuts):
    rng = np.random.default_rng(1)
    values, gaps = rng.standard_normal((400, 2, 3)), rng.standard_normal(400)
    gaps[::3] = np.nan
    data = xr.Dataset({"a": (("time", "x", "y"), values), "b": ("time", gaps)})
    ranges = Ranges(lambda d: d)
    for at in pieces(np.arange(400), cuts):
        ranges.append(data.isel(time=at))
    for dataset, name in ((ranges.least, "min"), (ranges.largest, "max"), (ranges.mean, "mean")):
        xr.testing.assert_allclose(dataset, getattr(data, name)("time"), rtol=1e-12)
    xr.testing.assert_identical(ranges.first, data.isel(time=0))
