"""Datasets: labels, units, parameters, round trip, and files that appear whole or not at all."""

import math
import subprocess
import sys

import numpy as np
import pytest

from flexgear.model.errors import FlexgearError
from flexgear.model.load import load_case
from flexgear.model.names import GearMeshName
from flexgear.results.dataset_file import load, save
from flexgear.results.labelled_dataset import groups_of, labelled_dataset
from flexgear.results.load_sharing import sharing_coefficients, sharing_histories
from flexgear.results.run_orders import case_of
from flexgear.results.summary import sharing_summary_of
from flexgear.results.version import version


def test_labels_count_from_one(make_part):
    run = make_part()
    assert run["tooth"].values[[0, -1]].tolist() == [1, 93]
    assert run["planet"].values.tolist() == [1, 2, 3, 4, 5] * 2
    assert run["axis"].values.tolist() == ["x", "y", "z"]
    assert run.sel(carrier_node="stage.pin_1", dof="rz")["carrier_displacement"].dims == ("time",)


def test_parameters_version_and_hash_travel_along(make_run, tmp_path):
    data, case = load(save(make_run(), tmp_path / "run.nc")), load_case("lin-parker")
    attrs = data.attrs
    assert case_of(data) == case
    assert attrs["content_hash"] == case.content_hash()
    assert attrs["version"] == version()
    assert attrs["variant"] == "flexible"


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


FULL = """
import resource, sys
import numpy as np
from flexgear.model.errors import FlexgearError
from flexgear.model.load import load_case
from flexgear.results.dataset_file import dataset_file
from flexgear.results.labelled_dataset import labelled_dataset
from flexgear.results.sinks import RunSize
noise = np.random.default_rng(0).normal(size=(500, 93, 3))
data = labelled_dataset("time", np.arange(500.0), {"tooth_displacement": noise}, {}, {})
resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000))
try:
    with dataset_file(sys.argv[1]) as sink:
        sink.begin(RunSize(data.isel(time=slice(0, 0)), 500))
        for k in range(5):
            sink.append(data.isel(time=slice(100 * k, 100 * k + 100)))
        sink.finish(data.isel(time=0, drop=True)[[]])
except FlexgearError as error:
    print(error)
"""


def test_write_that_the_system_cuts_short_leaves_nothing(tmp_path):
    """A file-size limit makes the system refuse the rest of a file, as a full disk does."""
    target = tmp_path / "run.nc"
    target.write_text("the older result")
    done = subprocess.run(
        [sys.executable, "-c", FULL, str(target)], capture_output=True, text=True, check=True
    )
    assert done.stdout == f"cannot write {target}: File too large\n"
    assert [p.name for p in tmp_path.iterdir()] == ["run.nc"]
    assert target.read_text() == "the older result"


NAMES = [
    *[GearMeshName.of("stage_1", kind, "", i) for kind in ("ring", "sun") for i in (1, 2, 3)],
    GearMeshName.of("stage_2", "sun", "", 1),
]
RATED = np.array([10.0] * 6 + [50.0])


def forces(samples=8):
    """Planet 1 carries 20 % too much now and then; the parallel stage a constant force."""
    force = np.tile(RATED, (samples, 1))
    force[1::2, [0, 3]] *= 1.2
    force[1::2, [1, 2, 4, 5]] *= 0.9
    return force


def dataset(**changes):
    force = forces()
    arrays = {
        "gear_mesh_force": force,
        "rated_gear_mesh_force": RATED,
        **sharing_histories(force, RATED, NAMES),
        **sharing_coefficients(force, NAMES, {"stage_1": 4.0, "stage_2": 4.0}),
        "port_torque": np.ones((8, 2)),
    } | changes
    labels = {
        "port": ["stage_1.carrier", "stage_2.pinion"],
        "definition": ["instantaneous", "mean-based", "cycle-based"],
    }
    return labelled_dataset("position", np.arange(8), arrays, {"case": "x"}, labels, NAMES)


def test_gear_meshes_are_found_by_label_and_by_part():
    data = dataset()
    assert data["gear_mesh"].values[[0, 3, -1]].tolist() == [
        "stage_1 ring 1",
        "stage_1 sun 1",
        "stage_2 sun 1",
    ]
    forces = data["gear_mesh_force"].where(
        (data.stage == "stage_1") & (data.planet == 2), drop=True
    )
    assert forces["kind"].values.tolist() == ["ring", "sun"]
    assert data["group"].values.tolist() == ["stage_1 ring", "stage_1 sun"]
    assert data["group_kind"].values.tolist() == ["ring", "sun"]


def test_sides_are_groups_of_their_own():
    names = [GearMeshName.of("stage", "sun", side, i) for side in ("left", "right") for i in (1, 2)]
    assert {g: at.tolist() for g, at in groups_of(names).items()} == {
        "stage sun left": [0, 1],
        "stage sun right": [2, 3],
    }


def test_factors_of_planets():
    data = dataset()
    factor = data["planet_load_factor"]
    np.testing.assert_allclose(factor[1, :3], [1.2, 0.9, 0.9])
    assert np.isnan(factor[:, -1]).all()  # the pinion shares with nobody
    np.testing.assert_allclose(data["load_sharing"][:2, 0], [1.0, 1.2])
    assert data["mesh_load_factor"].values.tolist() == [1.1, 1.1]
    k = data["load_sharing_coefficient"].sel(group="stage_1 sun")
    # maxima of every cycle: 12, 10, 10 -> N max / sum
    np.testing.assert_allclose(k, [1.2, 36 / 32, 36 / 32])
    np.testing.assert_allclose(
        data["planet_coefficient"].sel(definition="cycle-based")[1], 1 + abs(30 / 32 - 1)
    )


def test_coefficients_of_too_few_samples_or_no_load_are_nan():
    force = forces()
    few = sharing_coefficients(force, NAMES, {"stage_1": 3.0, "stage_2": 3.0})
    assert few["load_sharing_coefficient"][0, 0] == pytest.approx(1.2)
    assert np.isnan(few["load_sharing_coefficient"][1:]).all()  # too few samples a cycle
    nothing = sharing_coefficients(0 * force, NAMES, {"stage_1": 4.0, "stage_2": 4.0})
    assert np.isnan(nothing["load_sharing_coefficient"]).all()
    assert sharing_summary_of(dataset(**few))["stage_1 ring"] == {
        "instantaneous": pytest.approx(1.2),
        "mean-based": None,
        "cycle-based": None,
        "iec_61400_4": 1.1,
    }


def test_a_stage_of_two_planets_has_no_iec_factor():
    names = [GearMeshName.of("s", "ring", "", i) for i in (1, 2)]
    coefficients = sharing_coefficients(np.full((8, 2), 3.0), names, {"s": 4.0})
    assert math.isnan(coefficients["mesh_load_factor"][0])
    assert coefficients["load_sharing_coefficient"][:, 0].tolist() == [1.0, 1.0, 1.0]
