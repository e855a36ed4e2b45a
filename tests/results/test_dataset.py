"""Datasets: labels, units, parameters, round trip, and files that appear whole or not at all."""

import json
import subprocess
import sys

import numpy as np
import pytest

from flexgear.model.errors import FlexgearError
from flexgear.results.dataset_file import load, save
from flexgear.results.stage_part import of_kind, ring_sharing


def test_every_variable_has_a_unit_and_a_meaning(make_run):
    run = make_run()
    for name in run.variables:
        assert run[name].attrs["long_name"], name
        assert "units" in run[name].attrs, name
    assert run["tooth_displacement"].attrs["units"] == "m"


def test_labels_count_from_one(make_part):
    run = make_part()
    assert run["tooth"].values[[0, -1]].tolist() == [1, 93]
    assert run["planet"].values.tolist() == [1, 2, 3, 4, 5] * 2
    assert run["axis"].values.tolist() == ["x", "y", "z"]
    assert run.sel(carrier_node="stage.pin_1", dof="rz")["carrier_displacement"].dims == ("time",)


def test_parameters_version_and_hash_travel_along(make_run, tmp_path):
    kept = load(save(make_run(), tmp_path / "run.nc")).attrs
    assert json.loads(kept["parameters"]) == {"stage": {"planets": 5}}
    assert kept["content_hash"] == "abc"
    assert kept["version"]
    assert kept["variant"] == "flexible"


def test_load_sharing_comes_with_the_forces(make_part):
    run = make_part()
    force = of_kind(run, "ring")["gear_mesh_force"]
    shared = 5 * force.max("gear_mesh") / force.sum("gear_mesh")
    np.testing.assert_allclose(ring_sharing(run), shared)


def test_round_trip(make_run, tmp_path):
    run = make_run()
    back = load(save(run, tmp_path / "deep" / "run.nc"))
    assert set(back.variables) == set(run.variables)
    for name in run.variables:
        if run[name].dtype.kind == "f":
            np.testing.assert_allclose(back[name], run[name], rtol=1e-6)
        else:
            assert (back[name].values == run[name].values).all(), name
        assert back[name].attrs["long_name"] == run[name].attrs["long_name"]
    np.testing.assert_array_equal(back["time"], run["time"])  # double


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"tooth_load": np.zeros(20)}, "'tooth_load' is not a variable"),
        ({"output_speed": np.zeros((20, 2))}, "it needs 1: time"),
        ({"carrier_displacement": np.zeros((20, 1, 6))}, "1 entries but 6 labels"),
        ({"bearing_force": np.zeros((20, 3, 6))}, "labels of axis 'support' are missing"),
    ],
)
def test_wrong_arrays_are_named(make_run, change, words):
    with pytest.raises(FlexgearError, match=words):
        make_run(**change)


def test_missing_and_foreign_files(tmp_path):
    with pytest.raises(FlexgearError, match="no such file"):
        load(tmp_path / "none.nc")
    (tmp_path / "text.nc").write_text("hello")
    with pytest.raises(FlexgearError, match="not a netCDF file"):
        load(tmp_path / "text.nc")


def test_unwritable_place_is_one_line(make_run, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(FlexgearError, match="cannot make the folder"):
        save(make_run(), tmp_path / "file" / "run.nc")


FULL = """
import resource, sys
import numpy as np
from flexgear.model.errors import FlexgearError
from flexgear.results.stage_part import of_kind, ring_sharing
from flexgear.results.dataset_file import save
from flexgear.results.dataset_file import dataset_file
from flexgear.results.labelled_dataset import labelled_dataset
from flexgear.results.sinks import Coming
noise = np.random.default_rng(0).normal(size=(500, 93, 3))
data = labelled_dataset("time", np.arange(500.0), {"tooth_displacement": noise}, {}, {})
resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000))
try:
    if sys.argv[2] == "whole":
        save(data, sys.argv[1])
    with dataset_file(sys.argv[1]) as sink:
        sink.begin(Coming(data.isel(time=slice(0, 0)), 500))
        for k in range(5):
            sink.append(data.isel(time=slice(100 * k, 100 * k + 100)))
        sink.finish(data.isel(time=0, drop=True)[[]])
except FlexgearError as error:
    print(error)
"""


@pytest.mark.parametrize("how", ["whole", "piece by piece"])
def test_write_that_the_system_cuts_short_leaves_nothing(tmp_path, how):
    """A file-size limit makes the system refuse the rest of a file, as a full disk does."""
    target = tmp_path / "run.nc"
    target.write_text("the older result")
    done = subprocess.run(
        [sys.executable, "-c", FULL, str(target), how], capture_output=True, text=True, check=True
    )
    assert done.stdout == f"cannot write {target}: File too large\n"
    assert [p.name for p in tmp_path.iterdir()] == ["run.nc"]
    assert target.read_text() == "the older result"
