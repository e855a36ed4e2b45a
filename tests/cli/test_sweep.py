"""``flexgear sweep``: what is printed, written and drawn, and what is refused."""

import numpy as np
import pytest
from PIL import Image

from flexgear.results.dataset_file import load

KEY = "stage.planet_bearing.radial_n_per_m"


pytestmark = pytest.mark.usefixtures("cache")


def test_one_key_table_dataset_and_pictures(flexgear, tmp_path):
    out = tmp_path / "new" / "study"
    text = flexgear.out("sweep", "lin-parker", f"{KEY}=1e7:1e9:3:log", "--out", out, "-q")
    assert "frequency (Hz)" in text
    assert "load sharing, mean-based (–)" in text
    assert "727.267" in text
    assert f"wrote {out}" in text
    assert sorted(p.name for p in out.iterdir()) == [
        "sweep.nc", "sweep_frequency.png", "sweep_load_sharing.png"
    ]  # fmt: skip
    assert list((tmp_path / "new").iterdir()) == [out]
    with Image.open(out / "sweep_frequency.png") as picture:
        assert picture.size[0] > 1000
    data = load(out / "sweep.nc")
    np.testing.assert_allclose(data["frequency"].sel({KEY: 1e8})[:2], 727.267, rtol=1e-5)
    assert data[KEY].attrs["units"] == "N/m"


@pytest.mark.parametrize("keys", [(f"{KEY}=1e7,1e8",), (f"{KEY}=1e7,1e8", "stage.planets=3,4")])
def test_a_measure_without_any_value_is_a_dash_and_a_picture_that_says_so(flexgear, tmp_path, keys):
    """Without torque planets share no load: the pictures ended the sweep in an internal error."""
    idle = ("--set", "inputs.0.torque_nm=0", "--measure", "load_sharing", "-q", "--out", tmp_path)
    text = flexgear.out("sweep", "lin-parker", *keys, *idle)
    for definition in ("instantaneous", "mean-based", "cycle-based"):
        assert f"load sharing, {definition} (–): the same at every point, ring –, sun –" in text
    assert (tmp_path / "sweep_load_sharing.png").stat().st_size > 1000


@pytest.mark.slow
def test_long_tables_are_thinned_and_what_does_not_change_is_one_line(flexgear, tmp_path):
    few, many = (
        ("sweep", "lin-parker", f"{KEY}=1e7:1e9:{n}:log", "--no-pictures", "-q") for n in (4, 30)
    )
    text = flexgear.out(*few, "--measure", "load_sharing", "--out", tmp_path / "even")
    sharing = [line for line in text.splitlines() if line.startswith("load sharing")]
    assert sharing and all(
        line.endswith("the same at every point, ring 1, sun 1") for line in sharing
    )
    code, text, _ = flexgear(*many, "--measure", "frequencies", "--out", tmp_path / "f")
    rows = [line.split() for line in text.splitlines() if line.startswith("   ")]
    ticks = [float(row[0]) for row in rows if row[0][0].isdigit()]
    assert code == 0 and 10 < len(ticks) < 30
    assert (ticks[0], ticks[-1]) == (1e7, 1e9) and ticks == sorted(ticks)
    assert f"{len(ticks)} of 30 points and 8 of 10 columns; the dataset has all" in text
    assert load(tmp_path / "f" / "sweep.nc").sizes[KEY] == 30


def test_two_keys_to_a_file(flexgear, tmp_path):
    out = tmp_path / "a.nc"
    code, text, err = flexgear(
        "sweep", "lin-parker", f"{KEY}=1e7,1e8", "stage.planets=3,4,99", "--out", out, "-q",
        "--measure", "frequencies,mean_forces", "--modes", "3",
    )  # fmt: skip
    assert code == 0
    assert "6 points" in text
    assert "2 of 6 points failed" in err
    assert "99" in err
    names = {p.name for p in tmp_path.iterdir()}
    assert {"a.nc", "a_frequency.png", "a_mean_sun_gear_mesh_force.png"} <= names
    assert load(out)["frequency"].shape == (2, 3, 3)


def test_json_holds_everything(flexgear, tmp_path):
    sweep = flexgear.json(
        "sweep", "lin-parker", "stage.planets=3,4,99", "--no-pictures",
        "--out", tmp_path / "d", "--measure", "frequencies", "--modes", "2",
        "--set", f"{KEY}=2e8", "--workers", "1",
    )  # fmt: skip
    assert sweep["case"] == "lin-parker"
    assert sweep["keys"] == [{"key": "stage.planets", "units": "", "values": [3, 4, 99]}]
    frequency = sweep["measures"]["frequency"]
    assert frequency["units"] == "Hz"
    assert frequency["dims"] == ["stage.planets", "mode"]
    assert frequency["values"][2] == [None, None]
    assert frequency["values"][0][0] > 700
    assert sweep["measures"]["mode_type"]["values"][0] == ["translational"] * 2
    assert [f["point"] for f in sweep["failed"]] == ["stage.planets = 99"]
    assert [p.name for p in (tmp_path / "d").iterdir()] == ["sweep.nc"]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["lin-parker"], ["KEY"]),
        (["lin-parkr", "stage.planets=3,4"], ["lin-parker"]),
        (["lin-parker", "stage.planets=98,99"], ["98", "1 … 20"]),
        (["lin-parker", "stage.planets=3,4", "stage.planets=5"], ["given twice"]),
        (
            ["lin-parker", "stage.planets=3", f"{KEY}=1e8", "stage.face_width_mm=30"],
            ["third key", "--set"],
        ),
        (["lin-parker", "stage.planets=3,4", "--measure", "frequency"], ["frequencies"]),
        (
            ["lin-parker", "stage.planets=3,4", "--measure", "safety"],
            ["use life; see flexgear sweep -h"],
        ),
        (
            ["lin-parker", "stage.planets=3,4", "--measure", "tooth_load"],
            ["needs a flexible ring"],
        ),
        (["lin-parker", "stage.planets=3,4", "--workers", "0"], ["--workers"]),
        (["lin-parker", "stage.planets=3,4", "--out", "a.png"], ["a.png", ".nc"]),
        (["lin-parker", "stage.planets=3,4", "--set", "stage.planets=3"], ["--set"]),
    ],
)
def test_bad_arguments_of_a_sweep_are_one_line_and_no_files(
    flexgear, tmp_path, monkeypatch, arguments, words
):
    monkeypatch.chdir(tmp_path)
    flexgear.refused("sweep", *arguments, "-q", says=words)
    assert [p for p in tmp_path.rglob("*") if p.is_file()] == []


def test_a_sweep_whose_points_all_fail(flexgear, tmp_path):
    code, _, err = flexgear(
        "sweep", "lin-parker", "stage.planets=3,4", "-q", "--out", tmp_path / "d",
        "--set", "stage.carrier.support.radial_n_per_m=0",
        "--set", "stage.ring.support.radial_n_per_m=0",
        "--set", "stage.sun.support.radial_n_per_m=0", "--measure", "load_sharing",
    )  # fmt: skip
    assert code == 1
    assert "all 2 points failed" in err
    assert err.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_histories_of_sensors_are_in_the_dataset_alone(flexgear, tmp_path):
    """Thousands of samples are no tables and no picture; levels have the unit of their sensor, and
    zero where planets alike leave nothing but rounding."""
    sensors = ", ".join(
        f'{{ name = "{name}", on = "stage.{on}", measures = "{measures}"{more} }}'
        for name, on, measures, more in (
            ("torque_out", "carrier", "torque", ""),
            ("sun_x", "sun", "acceleration", ', direction = "x"'),
        )
    )
    settings = {
        "sensors": f"[{sensors}]", "stage.gear_mesh.model": "fourier", "solver.duration_s": 0.02,
    }  # fmt: skip
    options = [x for key, value in settings.items() for x in ("--set", f"{key}={value}")]
    measures = ("--measure", "sensors", "--measure", "sensor_signals")
    command = ("sweep", "lin-parker", "inputs.0.torque_nm=80,100", *options, *measures)
    text = flexgear.out(*command, "--out", tmp_path / "study", "-q")
    assert len(text.splitlines()) < 20
    data = load(tmp_path / "study" / "sweep.nc")
    count = f"{data.sizes['sample']:,}".replace(",", "\u202f")
    assert f"sensor signal: {count} samples a point, in the dataset" in text
    assert "torque out (N m)  sun x (m/s²)\n" in text
    assert data["sensor_unit"].to_numpy().tolist() == ["N m", "m/s2"]
    torque, sun = data["sensor_rms"].to_numpy().T
    assert (torque > 1e-3).all() and (sun == 0.0).all()
    assert not list((tmp_path / "study").glob("*sensor_signal*"))
