"""Runs of any length: the same in a file as in memory, memory that does not grow, an end."""

import os
import sys
import time
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from stage_samples import cheap_stage
from train_contexts import bundled, put_together

from flexgear.analysis import step_plan
from flexgear.analysis.step_plan import Adaptive, FineWindow, Stepping
from flexgear.analysis.transient import Collector, Drive, transient
from flexgear.model.errors import FlexgearError, InputError
from flexgear.model.load import load_case
from flexgear.results import dataset_file as files
from flexgear.results.dataset_file import dataset_file, encoding_of, load, save
from flexgear.results.settling import WindowedRanges, window_edges
from flexgear.results.sinks import SinkGroup
from flexgear.solve import long_run
from flexgear.solve.transient import simulate

STEP = 2e-5
CHUNK = 512  # steps that are taken at once


@pytest.fixture(scope="module")
def train():
    """A small train that saves every step."""
    settings = {"time_step": STEP, "output_interval": STEP, "settle": 0.0}
    solver = {f"solver.{key}": value for key, value in settings.items()}
    return put_together(bundled("lin-parker").case.with_(**solver))


@pytest.fixture(autouse=True)
def small_chunks(monkeypatch):
    monkeypatch.setattr(long_run, "BUFFER", 2**16)
    monkeypatch.setattr(step_plan, "CHUNK", CHUNK)


def same_in_a_file(run, tmp_path, names=()):
    """A run into memory, and loaded again from the file it was written to as it came."""
    memory = run(None).data
    with dataset_file(tmp_path / "streamed.nc", names) as sink:
        empty = run(sink).data
    assert empty.sizes["time"] == 0
    save(memory, tmp_path / "saved.nc")
    streamed, saved = load(tmp_path / "streamed.nc"), load(tmp_path / "saved.nc")
    variables = [n for n in saved if not names or n in names or "time" not in saved[n].dims]
    xr.testing.assert_identical(streamed, saved[variables])
    assert {n: v.dtype for n, v in streamed.items()} == {n: saved[n].dtype for n in variables}
    assert memory.sizes["time"] == streamed.sizes["time"]
    return memory


def test_a_train_is_the_same_in_a_file_as_in_memory(train, tmp_path):
    def run(sink):
        return simulate(train, duration=4000 * STEP, energy=True, sink=sink)

    data = same_in_a_file(run, tmp_path)
    assert data.sizes["time"] == 4000
    assert np.isfinite(data["load_sharing_coefficient"]).all()
    assert "energy_kinetic" in data and data.attrs["steps"] == 4000
    same_in_a_file(run, tmp_path, ("gear_mesh_force", "input_speed"))


def test_a_stage_is_the_same_in_a_file_as_in_memory(tmp_path):
    """With a drop of the torque, so that steps of two sizes meet."""
    settings = {"drive.steps.start_s": "0.005", "drive.steps.duration_s": "0.01"}
    stage = load_case("wind-5mw", settings).view()
    model = put_together(stage.case, rigid=["all"], bodies=cheap_stage(stage))
    drop = stage.case.drive.drop(
        stage.case.drive.steps.torques[0], 0.005, 0.01, model.system.rated_torque
    )

    def run(sink):
        return simulate(model, drive=drop, duration=0.03, output_interval=1e-4, sink=sink)

    data = same_in_a_file(run, tmp_path)
    assert data.sizes["time"] > 200
    torque = data["port_torque"].isel(port=0)
    assert torque.min() < torque.max()


class ResidentMemory:
    """A sink that notes the resident memory of the process at every chunk, bytes."""

    def __init__(self):
        self.seen, self.written = [], 0

    def begin(self, run_size):
        self.written = run_size.size

    def append(self, data):
        pages = int(Path("/proc/self/statm").read_text().split()[1])
        self.seen.append(pages * os.sysconf("SC_PAGE_SIZE"))

    def finish(self, last):
        pass


@pytest.mark.skipif(sys.platform != "linux", reason="looks at memory in /proc")
def test_resident_memory_reaches_a_plateau(train, tmp_path):
    """What libraries in C hold counts, too: of samples that are written not a fifth stays."""
    memory = ResidentMemory()
    ranges = WindowedRanges(lambda data: data[["gear_mesh_force"]], window_edges(80 * CHUNK * STEP))
    with dataset_file(tmp_path / "run.nc") as file:
        simulate(train, duration=80 * CHUNK * STEP, sink=SinkGroup([file, ranges, memory]))
    assert len(memory.seen) >= 80
    first, last = np.array(memory.seen)[[25, -1]]
    between = memory.written * (1 - 25 / len(memory.seen))
    assert last - first < between / 5


@pytest.mark.parametrize("error", [KeyboardInterrupt, OSError(28, "No space left on device")])
def test_a_stop_half_way_leaves_what_was_there(train, tmp_path, error):
    target = tmp_path / "run.nc"
    target.write_text("older")
    seen = []

    def stop(stage, share):
        seen.append(share)
        if share > 0.5:
            raise error

    def run():
        with dataset_file(target) as sink:
            simulate(train, duration=5 * CHUNK * STEP, sink=sink, progress=stop)

    with pytest.raises((KeyboardInterrupt, FlexgearError), match=r"No space|^$"):
        run()
    assert len(seen) > 1
    assert [p.name for p in tmp_path.iterdir()] == ["run.nc"]
    assert target.read_text() == "older"


def test_a_sink_gets_the_run_size_that_was_announced(train):
    events = []

    class Listener:
        def begin(self, run_size):
            events.append(run_size)

        def append(self, data):
            events.append(data.sizes["time"])

        def finish(self, last):
            events.append(last)

    simulate(train, duration=4500 * STEP, sink=Listener())
    run_size, *sizes, last = events
    assert sum(sizes) == run_size.samples == 4500
    assert last.attrs["steps"] == 4500
    data = simulate(train, duration=4500 * STEP).data
    single = [n for n, how in encoding_of(data).items() if how.get("dtype") == "f4"]
    size = {str(n): v.nbytes for n, v in data.variables.items() if "time" in v.dims}
    assert run_size.size == sum(b // 2 if n in single else b for n, b in size.items())


def test_a_disk_that_is_too_small_is_said_before(train, tmp_path, monkeypatch):
    usage = type("usage", (), {"free": 1000})
    monkeypatch.setattr(files.shutil, "disk_usage", lambda path: usage)
    with (
        pytest.raises(InputError, match=r"take \d[\d.]* kB, and 1 kB are free.*--save"),
        dataset_file(tmp_path / "run.nc") as sink,
    ):
        simulate(train, duration=100 * STEP, sink=sink)
    assert list(tmp_path.iterdir()) == []


def test_no_endless_run(train, tmp_path, monkeypatch):
    with pytest.raises(InputError, match=r"1e\+15 steps, more than a month"):
        long_run.refuse_endless(Stepping(1e6, 1e-9, 1e-3), "a case")
    with pytest.raises(InputError, match="steps"):
        long_run.refuse_endless(Stepping(1e300, 1e-300, 1.0), "a case")
    long_run.refuse_endless(Stepping(1e5, 1e-6, 1e-3), "a case")


def test_a_run_that_turns_out_to_be_endless_is_ended(train, tmp_path, monkeypatch):
    """A run of a second is one of a month where a month is a thousandth of that."""
    monkeypatch.setattr(long_run, "ENOUGH", 0.0)
    monkeypatch.setattr(long_run, "LONGEST", 1e-3)
    monkeypatch.setattr(long_run, "refuse_endless", lambda *_: None)
    with (
        pytest.raises(InputError, match=r"steps, about .* days"),
        dataset_file(tmp_path / "run.nc") as sink,
    ):
        simulate(train, duration=5 * CHUNK * STEP, sink=sink)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "stepping",
    [
        Stepping(0.0123, 1e-4, 7e-4),
        Stepping(0.0123, 1e-4, 7e-4, (0.004,), (FineWindow(0.004, 0.006, 3e-5),)),
        Stepping(0.0123, 1e-4, 1.0, (0.004, 0.005)),
        Stepping(0.01, 1e-4, 7e-4, (0.004,), (), Adaptive(1e9, 1e-5, 1e-4)),
    ],
)
def test_steps_and_samples_are_counted_before(train, stepping):
    """Of steps by a tolerance, the fewest."""
    sink, modal = Collector(), train.modal
    torque = modal.system.rated_torque
    taken = transient(modal, Drive(lambda t: np.full(len(t), torque)), stepping, sink=sink)
    time = sink.arrays()["time"]
    assert len(time) == stepping.samples
    np.testing.assert_allclose(time[0], stepping.interval)
    plans = stepping.plans()
    fewest = sum(plan.ticks >> len(plan.sizes) - 1 for plan in plans)
    most = sum(plan.ticks for plan in plans)
    assert fewest <= taken.taken <= most


def test_compilation_on_a_busy_processor_leaves_a_time_for_the_steps(train, monkeypatch):
    """It then takes longer than the processor works, which is subtracted from that work."""

    @contextmanager
    def slow():
        times = []
        yield times
        time.sleep(0.5)
        times.append(0.5)

    monkeypatch.setattr(long_run, "compilation_times", slow)
    run = simulate(train, duration=400 * STEP)
    assert 1e-4 < run.simulated / run.core < 1e4 and 0.0 < run.core <= 1.1 * run.wall
