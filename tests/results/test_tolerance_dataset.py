"""Dataset and summary of a tolerance study: labels, units, gaps."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
import xarray as xr
from tolerance_results import study_data

from flexgear.results.dataset_file import load, write_netcdf
from flexgear.results.tolerance_dataset import failed, tolerance_summary


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


def test_numbers_that_are_none_are_null():
    summary = tolerance_summary(study_data(count=8))
    found = summary["load_sharing"]["stage_2 ring"]["quantiles"]["99"]
    assert found["high"] is None
    assert math.isfinite(found["value"])
    json.dumps(summary, allow_nan=False)


def test_saved_and_read_again(tmp_path, data):
    path = write_netcdf(data, tmp_path / "a.nc")
    xr.testing.assert_identical(load(path), data)


def test_nothing_drawn_but_pitch_deviations():
    data = study_data(drawn=False)
    assert "error_size" not in data and "size" not in data.dims
    assert tolerance_summary(data)["drawn"] == []
    assert np.isfinite(data["load_sharing_max"]).all()
