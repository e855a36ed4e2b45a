"""Statistics of a tolerance study, and their intervals against what they promise."""

import json
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats
from tolerance_results import study_data

from flexgear.results.tolerance_dataset import (
    distribution_band,
    failed,
    mean_of,
    quantile_of,
    quantile_ranks,
    share_above_limit,
    share_interval,
    tolerance_summary,
)


@pytest.fixture
def data():
    return study_data()


def test_labels_and_units(data):
    assert data["load_sharing_max"].dims == ("sample", "group")
    assert list(data["group"].to_numpy()) == ["stage_1 ring", "stage_1 sun", "stage_2 ring"]
    assert list(data["group_kind"].to_numpy()) == ["ring", "sun", "ring"]
    assert list(data["planet"].to_numpy()) == [1, 2, 3, 1, 2, 3, 1, 2, 3, 4]
    assert data["error_size"].attrs["units"] == "m"
    assert data["error_phase"].attrs["units"] == "rad"
    assert all(v.attrs["long_name"] for v in data.data_vars.values())


def test_statistics_are_those_of_the_samples(data):
    column = data["load_sharing_max"].sel(group="stage_1 ring")
    assert float(data["load_sharing_average"][0]) == pytest.approx(float(column.mean()))
    assert float(data["load_sharing_deviation"][0]) == pytest.approx(float(column.std(ddof=1)))
    median = data["load_sharing_quantile"].sel(group="stage_1 ring", quantile=0.5)
    assert float(median) == pytest.approx(float(column.median()))
    low, high = (data[f"load_sharing_quantile_{end}"] for end in ("low", "high"))
    assert (low <= data["load_sharing_quantile"]).all()
    assert not (high < data["load_sharing_quantile"]).any()
    assert data["mesh_load_factor"].to_numpy().tolist() == [1.10, 1.10, 1.25]


def test_samples_without_equilibrium_are_left_out():
    data = study_data(gaps=[3, 7])
    assert failed(data) == 2
    summary = tolerance_summary(data)
    assert summary["failed"] == 2
    whole = study_data()["load_sharing_max"].drop_sel(sample=[3, 7]).sel(group="stage_1 ring")
    mean = summary["load_sharing"]["stage_1 ring"]["mean"]["value"]
    assert mean == pytest.approx(float(whole.mean()))


def test_a_study_without_any_equilibrium_has_no_figures():
    summary = tolerance_summary(study_data(gaps=list(range(50))))
    figures = summary["load_sharing"]["stage_1 ring"]
    assert figures["mean"] is None
    assert figures["quantiles"]["95"] is None
    json.dumps(summary, allow_nan=False)


def test_nothing_drawn_but_pitch_deviations():
    data = study_data(drawn=False)
    assert "error_size" not in data and "size" not in data.dims
    assert tolerance_summary(data)["drawn"] == []
    assert np.isfinite(data["load_sharing_max"]).all()


@given(st.integers(2, 3000), st.floats(0.01, 0.99), st.floats(0.5, 0.999))
def test_ranks_hold_what_they_promise_and_no_narrower_ones_do(count, share, confidence):
    """P(X_(l) > Q) and P(X_(u) < Q) are each at most half the risk; one rank further in is not."""
    low, high = quantile_ranks(count, share, confidence)
    below, risk = stats.binom(count, share), 0.5 * (1 - confidence)
    assert 0 <= low <= high <= count + 1
    assert below.cdf(low - 1) <= risk * (1 + 1e-9)
    assert below.sf(high - 1) <= risk * (1 + 1e-9)
    assert below.cdf(low) > risk * (1 - 1e-9)
    assert below.sf(high - 2) > risk * (1 - 1e-9)


def test_coverage_of_means():
    samples = np.random.default_rng(2).normal(1.0, 3.0, (2000, 12))
    estimates = [mean_of(x, 0.95) for x in samples]
    held = np.mean([e.low <= 1.0 <= e.high for e in estimates])
    assert held == pytest.approx(0.95, abs=3 * math.sqrt(0.95 * 0.05 / 2000))


def test_equal_samples_have_no_width():
    estimates = quantile_of(np.ones(500), 0.95), mean_of(np.ones(500))
    assert all((e.value, e.low, e.high) == (1.0, 1.0, 1.0) for e in estimates)


def test_no_samples_are_no_numbers():
    for estimate in (quantile_of([], 0.5), mean_of([]), share_above_limit([], 1.0)):
        assert math.isnan(estimate.value)


def test_the_interval_of_a_share_above_a_limit():
    """Of 300 samples none above: at most 3 / n with 95 %, one-sided."""
    estimate = share_above_limit(np.zeros(300), 1.0, confidence=0.9)
    assert (estimate.value, estimate.low) == (0.0, 0.0)
    assert estimate.high == pytest.approx(1 - 0.05 ** (1 / 300), rel=1e-12)
    every = share_above_limit(np.ones(300), 0.5, confidence=0.9)
    assert (every.value, every.high) == (1.0, 1.0)
    assert every.low == pytest.approx(0.05 ** (1 / 300), rel=1e-12)


@pytest.mark.parametrize("count", [1, 7, 50, 99])
def test_share_interval_is_clopper_pearsons(count):
    low, high = share_interval(np.array([count]), 100, 0.95)
    exact = stats.binomtest(count, 100).proportion_ci(0.95, "exact")
    assert (low[0], high[0]) == pytest.approx((exact.low, exact.high), rel=1e-9)


def test_band_holds_the_true_distribution_at_every_point_as_often_as_promised():
    rng, at = np.random.default_rng(3), 0.3
    low, high = distribution_band(80, 0.9)
    assert (np.diff(low) >= 0).all() and (np.diff(high) >= 0).all()
    held = []
    for _ in range(1500):
        x = np.sort(rng.random(80))
        k = np.searchsorted(x, at) - 1
        held.append(k < 0 or low[k] <= at <= high[k])
    assert np.mean(held) > 0.9 - 3 * math.sqrt(0.09 / 1500)


def test_wilks_59_samples():
    """Wilks 1941: 59 samples are the first whose largest bounds 95 % with 95 % confidence."""
    one_sided = 0.9  # half the risk on this side
    assert quantile_ranks(59, 0.95, one_sided)[1] == 59
    assert quantile_ranks(58, 0.95, one_sided)[1] == 59  # there is no such sample
    estimate = quantile_of(np.arange(58.0), 0.95, one_sided)
    assert math.isnan(estimate.high)
    assert estimate.low < estimate.value


@pytest.mark.parametrize("share", [0.5, 0.9, 0.95])
def test_coverage_of_quantiles(share):
    """In 2000 studies the interval holds the true quantile as often as promised."""
    rng, studies, confidence = np.random.default_rng(1), 2000, 0.9
    samples = rng.gumbel(size=(studies, 120))
    true = stats.gumbel_r.ppf(share)
    estimates = [quantile_of(x, share, confidence) for x in samples]
    held = np.mean([not e.low > true and not e.high < true for e in estimates])
    slack = 3 * math.sqrt(confidence * (1 - confidence) / studies)
    assert confidence - slack < held < 0.97
    assert np.mean([e.value for e in estimates]) == pytest.approx(true, abs=0.06)
