"""Transients that start from the end of others, and soft ramps of speed."""

import itertools
import warnings

import h5py
import numpy as np
import pytest
import xarray as xr
from trains import stage_train, write
from two_gears import gears_text

from flexgear import load_case
from flexgear.cli.entry import run as command
from flexgear.model.errors import FlexgearWarning, InputError
from flexgear.model.machine import Machine
from flexgear.results import dataset_file

STEP = {"solver.time_step_s": "1e-5", "solver.step_time_step_s": "1e-5"}
PAIRS = {"stage.gear_mesh.model": '"per_pair"', "stage.gear_mesh.contact_law": '"one-sided"'}
FILM = {"diameter_mm": "80", "length_mm": "40", "clearance_um": "60", "viscosity_mpa_s": "30"}
STEPS = {
    "drive.kind": '"steps"',
    "drive.times_s": "[-1, 0.003]",
    "drive.torques_nm": "[3000, 1000]",
}
CONTROLLED = {
    "law": '"controller"', "kp_nm_s_per_rad": "500", "ki_nm_per_rad": "2000", "kind": '"soft"',
    "times_s": "[0.001, 0.006]", "speeds_rpm": "[100, 110]",
}  # fmt: skip
COMPARED = ("gear_mesh_force", "body_displacement", "port_torque", "input_speed", "input_angle")


def soft(first, last, start=0.002, stop=0.022):
    """A held speed that rises softly, by TOML keys."""
    keys = {"law": '"speed"', "kind": '"soft"', "times_s": f"[{start}, {stop}]"}
    keys["speeds_rpm"] = f"[{first}, {last}]"
    return {f"inputs.0.machine.{k}": v for k, v in keys.items()}


def soft_section(first, last, start, stop):
    """The same as a section, speeds in rpm."""
    speeds = (first * np.pi / 30, last * np.pi / 30)
    return Machine(law="speed", kind="soft", times=(start, stop), speeds=speeds)


def train(folder, **keys):
    return stage_train(folder, planets=3, **{**STEP, **PAIRS, **keys})


@pytest.mark.parametrize(
    "keys",
    [
        {},
        STEPS,
        {f"inputs.0.machine.{k}": v for k, v in CONTROLLED.items()},
        {f"stage.planet_bearing.journal.{k}": v for k, v in FILM.items()},
        {"stage.sun.support.clearance_um": "10", "stage.sun.support.radial_n_per_m": "1e8"},
        {
            "gravity_m_per_s2": "[0, -9.81, 0]",
            "gyroscopic": "true",
            "stage.gear_mesh.damping_law": '"always"',
        },
    ],
    ids=["steady", "drop", "controller", "film", "clearance", "weight"],
)
def test_two_halves_are_one_whole(tmp_path, keys):
    """Cut where nothing happens, the second half is that of the run in one piece; its time goes on,
    and so does the account of energy."""
    model, interval = train(tmp_path, **keys).assemble(), 1e-4
    whole = model.transient(0.008, output_interval=interval, energy=True)
    first = model.transient(0.004, output_interval=interval, energy=True)
    second = model.transient(0.004, output_interval=interval, energy=True, start=first)
    rest = whole.isel(time=slice(len(first.time), None))
    assert second.time.values == pytest.approx(rest.time.values, rel=1e-12)
    for name in COMPARED:
        scale = np.abs(whole[name].values).max()
        assert np.abs(second[name].values - rest[name].values).max() < 1e-8 * scale, name
    for name in (n for n in whole.data_vars if str(n).startswith("energy_")):
        scale = np.abs(whole["energy_elastic"].values).max() + np.abs(whole[name].values).max()
        assert np.abs(second[name].values - rest[name].values).max() < 1e-6 * scale, name


def test_a_soft_ramp_takes_the_torque_of_its_inertia(tmp_path):
    """½ π J Δω/T at the steepest place, J about the carrier: what turns with it, by its speeds."""
    case = stage_train(tmp_path, planets=3, **soft(100, 130, stop=0.202))
    run = case.assemble().transient(0.21, output_interval=1e-3)
    turns = {"sun": 94 / 26 + 1, "planet": 1 - 94 / 34}
    inertia = 0.3 + 2.0 + (0.004 + 0.2) * turns["sun"] ** 2
    inertia += 3 * (4.0 * 0.12**2 + 0.01 * turns["planet"] ** 2)
    rise, length = 30 * np.pi / 30, 0.2
    share = np.clip((run.time.values - 0.002) / length, 0, 1)
    expected = 0.5 * np.pi * inertia * rise / length * np.sin(np.pi * share)
    held = 100 * np.pi / 30 + rise * 0.5 * (1 - np.cos(np.pi * share))
    assert run.input_speed.values[:, 0] == pytest.approx(held, rel=1e-9)
    assert run.inertia_torque.values[:, 0] == pytest.approx(expected, abs=0.02 * expected.max())


def test_a_soft_ramp_makes_less_of_a_shock_than_a_straight_one(tmp_path):
    loads = {}
    for kind in ("soft", "ramp"):
        keys = soft(100, 130, stop=0.202) | {"inputs.0.machine.kind": f'"{kind}"'}
        run = stage_train(tmp_path, planets=3, **keys).assemble().transient(0.22)
        loads[kind] = np.ptp(run.inertia_torque.sel(time=slice(0.203, None)).values)
    assert loads["soft"] < 0.2 * loads["ramp"]


def test_a_stepped_sweep_goes_up_and_back_down(tmp_path, capsys, monkeypatch):
    """Each step starts from the end of the last, under a machine of its own, in Python and by
    command: the train has turned on, and its speed is that of the history."""
    case = train(tmp_path, **soft(100, 104, 0.001, 0.004))
    up = case.assemble().transient(0.005)
    keys = {"inputs.0.machine": soft_section(104, 100, 0.006, 0.009)}
    down = case.with_(**keys).assemble().transient(0.005, start=up)
    joined = xr.concat(
        [up[["input_angle", "input_speed"]], down[["input_angle", "input_speed"]]], "time"
    )
    assert (np.diff(joined.time.values) > 0).all()
    assert (np.diff(joined.input_angle.values[:, 0]) > 0).all()
    assert float(joined.input_speed[-1, 0]) == pytest.approx(100 * np.pi / 30, rel=1e-9)
    path = tmp_path / "train.toml"
    text = path.read_text(encoding="utf-8")
    machine = (
        "machine = {{ law = 'speed', kind = 'soft', times_s = [{}, {}], speeds_rpm = [{}, {}] }}"
    )
    monkeypatch.setattr(dataset_file, "MAX_IN_MEMORY", 0)
    reads, read = set(), h5py.Dataset.__getitem__
    monkeypatch.setattr(
        h5py.Dataset, "__getitem__", lambda self, key: reads.add(self.name) or read(self, key)
    )
    for name, values in (("up", (0.001, 0.004, 100, 104)), ("down", (0.006, 0.009, 104, 100))):
        lines = text.replace("speed_rpm = 100", f"speed_rpm = 100\n{machine.format(*values)}")
        path.write_text(lines, encoding="utf-8")
        sets = [f"--set={key}={value}" for key, value in {**STEP, **PAIRS}.items()]
        more = ["--from", str(tmp_path / "up.nc")] if name == "down" else []
        out = ["--out", str(tmp_path / f"{name}.nc")]
        settings = [*sets, "--set=stage.planets=3", "--duration-s=0.005", "--quiet", *more, *out]
        assert command(["simulate", str(path), *settings]) == 0
    assert "/end_state" in reads and "/gear_mesh_force" not in reads  # its samples are left alone
    with xr.open_dataset(tmp_path / "down.nc") as by_command:
        force = by_command.gear_mesh_force.values
    capsys.readouterr()
    assert np.abs(force - down.gear_mesh_force.values).max() < 1e-6 * np.abs(force).max()


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"stage.sun.mass_kg": "5"}, "start: is the end of a run of another train"),
        (soft(110, 120), "machine of stage.carrier: holds 110 rpm at 0.001 s, where .* at 100"),
    ],
)
def test_a_start_state_that_does_not_fit_is_refused_in_one_line(tmp_path, keys, message):
    earlier = train(tmp_path).assemble().transient(0.001)
    with pytest.raises(InputError, match=message):
        train(tmp_path, **keys).assemble().transient(0.001, start=earlier)
    nothing = earlier.drop_vars("end_state")
    with pytest.raises(InputError, match="start: is not the end of a transient"):
        train(tmp_path).assemble().transient(0.001, start=nothing)


@pytest.mark.parametrize(("rated", "warned"), [("100.5", 0), ("104", 1)])
def test_a_free_train_goes_on_at_its_speed_and_says_so(tmp_path, rated, warned):
    """Torques and inertia alone decide when it has the rated speed of its case."""
    earlier = train(tmp_path).assemble().transient(0.001)
    with warnings.catch_warnings(record=True) as issued:
        warnings.simplefilter("always", FlexgearWarning)
        model = train(tmp_path, **{"inputs.0.speed_rpm": rated}).assemble()
        run = model.transient(0.001, start=earlier)
    assert run.input_speed[:, 0].values == pytest.approx(100 * np.pi / 30, rel=2e-3)
    texts = [str(w.message) for w in issued]
    assert ["rpm of stage.carrier, where the earlier one ended" in t for t in texts] == [
        True
    ] * warned


def test_a_sweep_finds_both_branches_of_a_spur_pair(tmp_path):
    """Up to its resonance a pair stays in contact; from above, at the same speed, its teeth part at
    every gear mesh: which of both a transient finds is what it started from."""
    path = write(tmp_path, gears_text("rectangular", damping=0.03, speed=3000, backlash=100))
    case = load_case(path, overrides={"stages.0.gear_mesh.damping_law": '"always"'})
    run, largest, least = None, [], []
    speeds = np.array([3500, 3500, 3750, 4000, 3750, 3500])
    for first, last in itertools.pairwise(speeds):
        start = 0.0 if run is None else run.attrs["end_time_s"]
        machine = soft_section(first, last, start, start + 0.01)
        model = case.with_(**{"inputs.0.machine": machine}).assemble()
        run = model.transient(0.05, start=run)
        force = run.gear_mesh_force.sel(time=slice(start + 0.03, None)).values
        largest.append(force.max() / force.mean())
        least.append(force.min() / force.mean())
    assert largest[0] < 2.0 < 4.0 < largest[-1]
    assert least[0] > 0.0 > least[-1]
