"""Transients in files are summed up piece by piece: same figures, no variable is read whole."""

import h5py
import numpy as np
import pytest
import xarray as xr

from flexgear.face.accessor import compare
from flexgear.model.names import GearMeshName
from flexgear.model.units import RPM
from flexgear.results import sinks as pieces_module
from flexgear.results.dataset_file import open_lazily, save
from flexgear.results.labelled_dataset import GEAR_MESH, fields_of
from flexgear.results.quantities import values
from flexgear.results.sinks import between, pieces
from flexgear.results.stage_part import pairs_of, ring_force_spread, ring_sharing, stage_part
from flexgear.results.time_figures import STAGE_DROP, STEADY, StageDrop, SteadyRun, drop_summary
from flexgear.solve.long_run import TimedRun
from flexgear.solve.run_summary import motion_summary, transient_summary
from flexgear.views.select import thinned
from flexgear.views.star import MAP_SAMPLES, tooth_displacement_map

SAMPLES = 5000
PIECE_BYTES = 2**16


@pytest.fixture(autouse=True)
def small_pieces(monkeypatch):
    monkeypatch.setattr(pieces_module, "PIECE_BYTES", PIECE_BYTES)


@pytest.fixture
def reads(monkeypatch):
    """Bytes of all that is read from files, read by read."""
    sizes, read = [], h5py.Dataset.__getitem__

    def watched(variable, key):
        values = read(variable, key)
        sizes.append(np.asarray(values).nbytes)
        return values

    monkeypatch.setattr(h5py.Dataset, "__getitem__", watched)
    return sizes


def in_file(data, place):
    save(data, place / "run.nc")
    return open_lazily(place / "run.nc")


def stage_run(make_run):
    rng = np.random.default_rng(5)
    return make_run(
        samples=SAMPLES,
        tooth_displacement=rng.normal(size=(SAMPLES, 5, 3)),
        bolt_force=np.zeros((SAMPLES, 1, 3)),
        carrier_speed=rng.normal(size=SAMPLES),
    )


def test_pieces_are_the_whole_in_order(make_run):
    data = stage_run(make_run)
    parts = list(pieces(data))
    assert len(parts) > 15
    assert max(p.nbytes for p in parts) < 1.1 * PIECE_BYTES
    assert xr.concat(parts, "time", data_vars="minimal").identical(data)


@pytest.mark.parametrize(("begin", "end"), [(0.2, 0.7), (-1, 2), (0.5, None), (2, 3), (0.7, 0.2)])
def test_samples_between_two_times_are_those_of_the_slice(make_run, tmp_path, begin, end):
    data = make_run()
    expected = data["time"].sel(time=slice(begin, end)).to_numpy()
    for source in (data, in_file(data, tmp_path)):
        np.testing.assert_array_equal(between(source, begin, end)["time"], expected)


def test_figures_of_a_stage_read_from_a_file_in_pieces_are_those_of_the_whole(
    make_run, tmp_path, reads
):
    file = in_file(stage_run(make_run), tmp_path)
    whole = stage_part(file.load(), "stage")
    star = make_run(samples=1, sample_dim="position")
    file = open_lazily(tmp_path / "run.nc")
    assert file.nbytes > 20 * PIECE_BYTES
    reads.clear()
    steady = values(STEADY, SteadyRun("stage", {"a": file}, star))
    drop = values(STAGE_DROP, StageDrop(file, "stage"))
    assert 0 < max(reads) < PIECE_BYTES

    node = np.abs(whole["tooth_displacement"].isel(tooth=0)).max("time").to_numpy().astype(float)
    shared = ring_sharing(whole).astype(float)
    sharing = {"mean": float(shared.mean()), "max": float(shared.max())}
    number = (pairs_of(whole, "ring", "drive")["tooth"] > 0).sum("slot")
    share = {str(n): float((number == n).mean()) for n in np.unique(number)}
    assert steady["ring_pairs_in_contact"] == pytest.approx(share, rel=1e-12)
    assert list(steady["tooth_displacement_peak_um"].values()) == pytest.approx(
        1e6 * node, rel=1e-12
    )
    assert steady["load_sharing"]["a"] == pytest.approx(sharing, rel=1e-12)
    speed = whole["stage_speed"].astype(float)
    sun = pairs_of(whole, "sun", "drive")
    assert steady["carrier_speed_rpm_mean"] == pytest.approx(float(speed.mean()) * RPM, rel=1e-11)
    assert drop == {
        "carrier_speed_rpm_min": float(speed.min()) * RPM,
        "tooth_load_n_min": float(sun["load"].where(sun["tooth"] > 0).min()),
        "planet_force_spread_max": float(ring_force_spread(whole).max()),
    }


def test_the_slowest_speed_of_a_drop_is_that_of_its_mirror_image(make_run):
    """Members that turn backwards are slowest where the size of their speed is least."""
    forwards = make_run().assign(input_speed=lambda d: abs(d["input_speed"]) + 1.0 + d["time"])
    backwards = forwards.assign(input_speed=-forwards["input_speed"])
    expected, image = (drop_summary(d)["speed_rpm_min"] for d in (forwards, backwards))
    assert image == {name: -speed for name, speed in expected.items()}
    assert min(expected.values()) >= RPM


def test_pictures_of_a_stage(make_run, tmp_path, reads):
    """A map of so many samples as it shows takes no others into memory."""
    file = in_file(stage_run(make_run), tmp_path)
    part = stage_part(file, "stage")
    whole = file["tooth_displacement"].isel(axis=0).nbytes
    reads.clear()
    figure = tooth_displacement_map(part)
    assert max(reads) < whole / 2
    shown = thinned(part, MAP_SAMPLES)["tooth_displacement"].isel(axis=0).to_numpy().T
    (image,) = figure.axes[0].collections
    np.testing.assert_array_equal(image.get_array(), 1e6 * shown.astype(float))


def test_runs_side_by_side(make_run, tmp_path, reads):
    """The largest of every run is that of its pieces."""
    runs = {name: make_run(name, SAMPLES * factor) for name, factor in (("a", 1), ("b", 2))}
    files = {name: in_file(data, tmp_path / name) for name, data in runs.items()}
    reads.clear()
    figures = compare(**files).figures
    assert 0 < max(reads) < PIECE_BYTES
    for name, data in runs.items():
        largest = data[["gear_mesh_force", "planet_load_factor"]].max("time")
        xr.testing.assert_allclose(figures.sel(run=name, drop=True), largest, rtol=1e-6)
        assert figures["gear_mesh_force"].attrs["units"] == "N"


def test_figures_of_a_train_read_from_a_file_in_pieces_are_those_of_the_whole(tmp_path, reads):
    rng = np.random.default_rng(3)
    gear_meshes = [GearMeshName.of("s", kind, "", i) for kind in ("ring", "sun") for i in (1, 2)]
    beside = fields_of(gear_meshes, GEAR_MESH)
    labels = {
        "gear_mesh": gear_meshes,
        **{name: ("gear_mesh", values) for name, values in beside.items()},
        "body": ["s.sun", "s.carrier", "s.planet_1"],
        "dof": ["ux", "uy", "uz", "rx", "ry", "rz"],
    }
    far = rng.normal(size=(SAMPLES, 3, 6))
    far[:, 1] *= 1e-12  # rounding
    data = xr.Dataset(
        {
            "gear_mesh_force": (("time", "gear_mesh"), rng.normal(size=(SAMPLES, 4))),
            "body_displacement": (("time", "body", "dof"), far),
            "input_speed": ("time", rng.normal(size=SAMPLES)),
            "port_torque": ("time", rng.normal(size=SAMPLES)),
            "inertia_torque": ("time", rng.normal(size=SAMPLES)),
        },
        {"time": np.arange(SAMPLES) / SAMPLES, **labels},
        {"settle_s": 0.25, "steps": 7},
    )
    file = in_file(data, tmp_path)
    assert file.nbytes > 8 * PIECE_BYTES
    reads.clear()
    summary = transient_summary(TimedRun(file, 1.0, 1.0, 1.0))
    assert 0 < max(reads) < PIECE_BYTES / 2
    rest = file.isel(time=slice(SAMPLES // 4, None)).load()
    for name, at in (("s ring", [0, 1]), ("s sun", [2, 3])):
        force = rest["gear_mesh_force"].isel(gear_mesh=at).astype(float)
        ranges = {"min_n": force.min(), "mean_n": force.mean(), "max_n": force.max()}
        expected = {n: float(v) for n, v in ranges.items()}
        assert summary["gear_mesh_force"][name] == pytest.approx(expected, rel=1e-12, abs=1e-16)
    reads.clear()
    still = data.isel(time=slice(1)).rename(time="position")
    motions = motion_summary(still, file)
    assert 0 < max(reads) < PIECE_BYTES
    at_any_time = np.hypot(*file["body_displacement"].sel(body="s.sun").to_numpy()[:, :2].T)
    assert motions["s.sun"] == pytest.approx(1e6 * float(at_any_time.max()), rel=1e-6)
    sun = rest["body_displacement"].sel(body="s.sun").to_numpy()
    largest = 1e6 * float(np.hypot(sun[:, 0], sun[:, 1]).max())
    assert summary["displacement_um_max"] == {"s.sun": largest, "s.carrier": 0.0}
