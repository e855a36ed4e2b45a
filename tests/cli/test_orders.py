"""``flexgear orders`` and ``data.fg``: a transient of a small stage, lines where they belong."""

import json
import re
import shutil
from dataclasses import replace

import h5py
import numpy as np
import pytest
import xarray as xr
from trains import STAGE, spur_pair, write

from flexgear.cli.entry import run
from flexgear.cli.orders_command import faults_first, strongest
from flexgear.face import accessor as accessor  # gives datasets their ``fg``
from flexgear.gears.expected_lines import expected_lines
from flexgear.gears.power_flow import power_flow
from flexgear.model.load import load_case
from flexgear.results import dataset_file
from flexgear.results.dataset_file import load
from flexgear.results.orders import amplitudes_at, order_spectrum
from flexgear.results.run_orders import expected_orders, history_over_turns
from flexgear.views import report
from flexgear.views.interactive import panels_of
from flexgear.views.order_charts import order_map_chart

SETTINGS = {  # 95 ring teeth leave 3 over of 4 planets: order 1 is heard one pass above
    "stage.gear_mesh.model": "fourier",
    "stage.sun.teeth": "25",
    "stage.planet.teeth": "35",
    "stage.ring.teeth": "95",
    "solver.time_step_s": "1e-4",
}
TEETH = 95


@pytest.fixture(scope="module")
def transient(tmp_path_factory):
    """Six turns of the carrier, in a file, and its case."""
    file = tmp_path_factory.mktemp("orders") / "run.nc"
    settings = [x for k, v in SETTINGS.items() for x in ("--set", f"{k}={v}")]
    end = ["--duration-s", "1.75", "--out", str(file), "-q"]
    assert run(["simulate", "lin-parker", *settings, *end]) == 0
    return file, load_case("lin-parker", SETTINGS)


def whole_turns(data):
    """Four turns of the carrier after the first."""
    turns = data["carrier_angle"].isel(turning_stage=0) / (2 * np.pi)
    return data.isel(time=((turns > 1.0) & (turns < 5.01)).to_numpy())


def test_lines_stand_where_the_table_says(transient):
    """What the ring pushes its support with sideways, in space: of the orders beside the gear mesh
    those that four planets leave, and no other."""
    file, case = transient
    data = whole_turns(load(file))
    angle = data["carrier_angle"].isel(turning_stage=0)
    force = data["bearing_force"].sel(support="stage.ring_support")
    in_space = force.sel(dof="ux") * np.cos(angle) - force.sel(dof="uy") * np.sin(angle)
    history = history_over_turns(data.assign(ring=in_space), "ring", "carrier", highest=300)
    amplitudes = amplitudes_at(history, np.arange(1, 300))
    turns = power_flow(case).speed["stage.carrier"] / (2 * np.pi)
    listed = {
        round(x.frequency / turns)
        for x in expected_lines(case)
        if x.kind in ("gear mesh", "sideband") and x.share > 0.5
    }
    for harmonic in (1, 3):
        beside = {TEETH * harmonic + n for n in (-1, 0, 1)}
        (heard,) = beside & listed
        largest = float(amplitudes.sel(order=heard))
        assert largest > 5.0  # N
        for other in beside - listed:
            assert float(amplitudes.sel(order=other)) < 1e-3 * largest
    assert not {int(o) for o in amplitudes["order"][amplitudes > 1e-2 * amplitudes.max()]} - listed


def test_gear_mesh_force_and_transmission_error_have_the_gear_mesh_alone(transient):
    """Of one planet: harmonics of the gear mesh, from the accessor; both in proportion."""
    file, _ = transient
    data = whole_turns(load(file))
    for name in ("gear_mesh_force", "dynamic_transmission_error"):
        spectrum = data.fg.orders(name, "carrier", highest=300).sel(gear_mesh="stage sun 1")
        for harmonic in (1, 2, 3):
            near = spectrum.sel(order=slice(TEETH * harmonic - 2, TEETH * harmonic + 2))
            assert float(near.idxmax()) == pytest.approx(TEETH * harmonic, abs=0.05)
        outside = np.abs(spectrum["order"] / TEETH - np.round(spectrum["order"] / TEETH))
        assert float(spectrum.where(outside > 0.03).max()) < 1e-2 * float(spectrum.max())
    mean = data.fg.synchronous_average("gear_mesh_force", "sun", against="carrier", highest=150)
    assert mean["phase"].attrs["long_name"].startswith("share of a turn of sun ")
    pattern = mean.sel(gear_mesh="stage sun 1").to_numpy()
    assert np.argmax(np.abs(np.fft.rfft(pattern - pattern.mean()))) % 25 == 0  # sun teeth


def test_map_and_planets_from_the_accessor(transient):
    """A map at constant speed is constant; planets that are alike have like averages."""
    file, case = transient
    data = load(file)
    ridge = whole_turns(data).fg.order_map("gear_mesh_force", "carrier", block_turns=1.0)
    ridge = ridge.sel(gear_mesh="stage sun 1").sel(order=2.0 * TEETH, method="nearest")
    assert np.ptp(ridge.to_numpy()) < 0.05 * float(ridge.mean())
    rated = power_flow(case).speed["stage.carrier"]
    assert ridge["speed"].to_numpy() == pytest.approx(np.full(len(ridge), rated), rel=1e-2)
    angle = data["carrier_angle"].isel(turning_stage=0)
    force = data["bearing_force"].sel(support="stage.ring_support")
    in_space = force.sel(dof="ux") * np.cos(angle) - force.sel(dof="uy") * np.sin(angle)
    means = data.assign(ring=in_space).fg.planet_averages("ring", "stage", width=1.0)
    patterns = np.abs(np.fft.rfft(means.to_numpy(), axis=1))
    assert patterns[1:, 35] == pytest.approx(np.full(3, patterns[0, 35]), rel=0.05)


def test_lines_of_a_train_name_their_stages(flexgear, tmp_path):
    file = tmp_path / "run.nc"
    flexgear.out("simulate", "pitch-drive", "--duration-s", 0.15, "--out", file, "-q")
    text = flexgear.out("orders", file, "-q", "--only", "stage_3 sun 1")
    first, second = text.splitlines()[1:3]
    assert first.endswith("(stage 1 gear mesh 1)") and second.endswith("(stage 2 gear mesh 1)")


def test_command_names_the_lines(flexgear, transient, tmp_path):
    """Table, JSON, and a folder with dataset, picture and page; a map and an average, too."""
    file, _ = transient
    code, out, _ = flexgear("orders", file, "--member", "carrier", "--only", "sun")
    assert code == 0 and "gear mesh 2" in out and "gear mesh 3" in out
    options = ["--of", "port_speed", "--only", "carrier", "--json", "--highest", 300]
    code, out, _ = flexgear("orders", file, *options, "--member", "carrier")
    lines = json.loads(out)["lines"]
    assert code == 0 and lines == sorted(lines, key=lambda line: -line["amplitude"])
    for more in ([], ["--map", 2], ["--average"], ["--envelope-hz", 300, 400]):
        folder = tmp_path / "out"
        code, out, err = flexgear("orders", file, *more, "--member", "carrier", "--highest", 200,
                                  "--only", "ring", "--out", folder)  # fmt: skip
        assert code == 0, err
        assert {f.name for f in folder.iterdir()} == {"orders.nc", "orders.png", "report.html"}
        assert load(folder / "orders.nc")["gear_mesh_force"].size
        assert "plotly" in (folder / "report.html").read_text()


@pytest.mark.parametrize(
    "options",
    [
        ["--only", "sun", "--from-s", 0.3, "--to-s", 1.2],
        ["--only", "ring 1", "--map", 2, "--member", "carrier"],
        ["--only", "ring", "--average", "--member", "planet", "--against", "carrier"],
        ["--only", "sun", "--envelope-hz", 300, 400],
        ["--only", "ring 2", "--planets", "stage", "--sensor-angle-deg", 30],
        ["--of", "body_displacement", "--only", "sun u"],
        ["--of", "output_speed", "--window", "flattop"],
    ],
)
def test_samples_that_stay_in_the_file_give_the_same(
    flexgear, transient, tmp_path, monkeypatch, options
):
    """Figures, dataset, and what matplotlib gets."""
    outcomes = []
    monkeypatch.setattr(report, "saved_picture", lambda figure, *_: panels_of(figure))
    monkeypatch.setattr(report, "write_study", lambda *study: outcomes[-1].append(study[-1]))
    for whole in (dataset_file.MAX_IN_MEMORY, 0):
        monkeypatch.setattr(dataset_file, "MAX_IN_MEMORY", whole)
        folder = tmp_path / str(whole)
        more = ["--highest", 100] if "--planets" not in options else []
        outcomes.append([])
        figures = flexgear.json("orders", transient[0], *options, *more, "--out", folder)
        outcomes[-1] += [figures, (folder / "orders.nc").read_bytes()]
    assert outcomes[0] == outcomes[1] and len(outcomes[0]) == 3


def test_columns_that_are_not_drawn_stay_in_the_file(flexgear, transient, monkeypatch):
    monkeypatch.setattr(dataset_file, "MAX_IN_MEMORY", 0)
    reads, read = [], h5py.Dataset.__getitem__

    def watched(variable, key):
        values = read(variable, key)
        if variable.name == "/body_displacement":
            reads.append(np.shape(values)[1:])
        return values

    monkeypatch.setattr(h5py.Dataset, "__getitem__", watched)
    flexgear.quiet("orders", transient[0], "--of", "body_displacement", "--only", "sun ux", "-q")
    assert {*reads} == {(1, 1)}
    reads.clear()
    flexgear.refused("orders", transient[0], "--of", "body_displacement", "-q")
    assert not reads


def test_a_train_that_nothing_excites_has_no_lines(flexgear, tmp_path):
    """Forces with a mean and without, motions and rates that a sensor sees: one sentence."""
    file = tmp_path / "quiet.nc"
    settings = {"stage.gear_mesh.model": "constant", "solver.time_step_s": "1e-4"}
    sensor = 'on = "stage.sun", direction = "x"'
    settings["sensors"] = "[" + ", ".join(
        f'{{ name = "{m}", {sensor}, measures = "{m}" }}' for m in ("velocity", "acceleration")
    ) + "]"  # fmt: skip
    options = [x for k, v in settings.items() for x in ("--set", f"{k}={v}")]
    command = ("simulate", "lin-parker", *options, "--duration-s", 0.15, "--out", file)
    levels = flexgear.out(*command, "-q").splitlines()
    assert "  velocity      constant, 0 m/s" in levels
    assert "  acceleration  constant, 0 m/s²" in levels
    for of, only in (
        ("gear_mesh_force", ""), ("inertia_torque", ""), ("bearing_force", "sun_support u"),
        ("body_displacement", "sun u"), ("port_speed", ""), ("sensor_signal", "velocity"),
        ("sensor_signal", "acceleration"),
    ):  # fmt: skip
        out = flexgear.quiet("orders", file, "--of", of, "--only", only, "-q")
        assert out.count("\n") == 1 and out.endswith("nothing but rounding varies\n")
    figures = flexgear.json("orders", file, "--out", tmp_path / "quiet")
    assert figures["lines"] == []


@pytest.mark.usefixtures("no_pixels")
def test_labels_of_columns_and_levels_of_sensors_are_words_with_units(flexgear, tmp_path):
    """The only stage has no name; a torque and a speed have a mean and a range."""
    sensors = ", ".join(
        f'{{ name = "the_{m}", on = "stage.{on}", measures = "{m}" }}'
        for m, on in (("torque", "carrier"), ("speed", "sun"))
    )
    settings = SETTINGS | {"sensors": f"[{sensors}]"}
    options = [x for key, value in settings.items() for x in ("--set", f"{key}={value}")]
    file = tmp_path / "run.nc"
    text = flexgear.out("simulate", "lin-parker", *options, "--out", file, "-q")
    levels = r"  the torque  mean −480 N m, rms about it .*, from −48.* to −47.* N m\n"
    assert re.search(levels, text)
    assert re.search(r"the speed   mean [\d.\s]+ r/min, rms about it .* r/min\n", text)
    text = flexgear.out("orders", file, "--only", "ring", "--out", tmp_path / "orders", "-q")
    assert "  ring 1  (" in text and "stage ring" not in text
    slow = ("--set", "recorder.sampling_rate_hz=5", "--duration-s", 0.05, "-q")
    code, text, err = flexgear("simulate", "lin-parker", *options, *slow)
    assert code == 0 and "sensors have no samples in the settled part" in err
    assert "the torque" not in text
    command = ("orders", file, "--of", "body_displacement", "--only", "planet 2 u", "-q")
    assert "  planet 2 u" in flexgear.out(*command)
    command = ("orders", file, "--of", "sensor_signal", "--only", "torque", "--member", "sun")
    assert "over 1 turn of sun, hann window" in flexgear.out(*command, "--map", 1, "-q")


@pytest.mark.parametrize("window", ["hann", "boxcar", "blackman"])
def test_side_lobes_of_a_line_are_no_lines(window):
    """Two sines, whose lobes are higher than a third one only near to it; a mean that drifts."""
    turn = np.arange(0.0, 20.0, 1 / 100)
    waves = {10.0: 1.0, 20.03: 0.3, 32.0: 0.01}
    signal = sum(a * np.cos(2 * np.pi * o * turn) for o, a in waves.items())
    signal += 40.0 + 0.3 * turn + 0.02 * turn**2
    about = {"per_turn": 100, "highest_order": 37.5, "of": "sun", "units": "N"}
    spectrum = order_spectrum(xr.DataArray(signal, {"turn": turn}, "turn", "force", about), window)
    rows = list(strongest(spectrum, []))
    assert [row["order"] for row in rows[:3]] == pytest.approx([*waves], abs=0.02)
    assert max((row["amplitude"] for row in rows[3:]), default=0.0) < 1e-5


def test_sidebands_below_a_harmonic_beyond_the_highest_order_are_named(
    transient, tmp_path, flexgear
):
    """Four turns below the fourth harmonic, which is one order beyond the spectrum."""
    file, _ = transient
    data, order = load(file), 4 * TEETH - 4
    wave = np.cos(order * data["carrier_angle"].isel(turning_stage=0))
    wave = wave.broadcast_like(data["gear_mesh_force"]).transpose("time", ...)
    wave.attrs = data["gear_mesh_force"].attrs
    data.assign(gear_mesh_force=wave).to_netcdf(tmp_path / "wave.nc")
    options = ("--of", "gear_mesh_force", "--only", "ring 1", "--member", "carrier")
    command = ("orders", tmp_path / "wave.nc", *options, "--highest", order + 3)
    row = flexgear.json(*command)["lines"][0]
    assert row["order"] == pytest.approx(order, abs=0.05)
    assert row["expected"] == ["gear mesh 4 −4 carrier turns"]


def test_gear_mesh_orders_above_half_the_sampling_rate_are_named_where_they_appear(
    transient, tmp_path, flexgear
):
    """A harmonic between S/2 and S samples a turn is read at the order S less its order."""
    file, _ = transient
    data = load(file).isel(time=slice(None, None, 7))
    turns = data["carrier_angle"].isel(turning_stage=0) / (2 * np.pi)
    samples = (data.sizes["time"] - 1) / float(turns[-1] - turns[0])
    harmonic = round(0.9 * samples / TEETH)
    place = xr.ones_like(turns) * np.arange(data.sizes["time"])
    wave = np.cos(2 * np.pi * harmonic * TEETH / samples * place)
    wave = wave.broadcast_like(data["gear_mesh_force"]).transpose("time", ...)
    wave.attrs = data["gear_mesh_force"].attrs
    data.assign(gear_mesh_force=wave).to_netcdf(tmp_path / "wave.nc")
    command = ("orders", tmp_path / "wave.nc", "--only", "ring 1", "--member", "carrier")
    row = flexgear.json(*command)["lines"][0]
    assert row["order"] == pytest.approx(samples - harmonic * TEETH, abs=0.1)
    assert row["expected"] == [f"alias of gear mesh {harmonic}"]


def test_multiples_of_a_fault_s_line_are_named(tmp_path):
    """A pulse once a turn of the sun against the carrier, beside the gear mesh: a comb."""
    case = load_case("lin-parker", SETTINGS)
    lines = expected_orders(case, "sun", "carrier")
    turn = np.arange(0.0, 40.0, 1 / 200)
    signal = np.cos(2 * np.pi * 25 * turn) + 0.1 * np.exp(20 * np.cos(2 * np.pi * turn) - 20)
    about = {"per_turn": 200, "highest_order": 75.0, "of": "sun", "units": "N"}
    spectrum = order_spectrum(xr.DataArray(signal, {"turn": turn}, "turn", "force", about))
    named = {round(row["order"]): row["expected"] for row in strongest(spectrum, list(lines))}
    assert named[25] == ["gear mesh 1"]
    assert named[1] == ["tooth of sun at one gear mesh"]
    assert all(f"{k} × tooth of sun at one gear mesh" in named[k] for k in (2, 3, 6))
    assert "tooth of sun" in named[4]  # which all four planets meet in turn
    # a line within the resolution, but not at the peak, is not what the comb is named by
    beside = replace(lines[0][0], label="beside")
    named = {
        round(row["order"]): row["expected"]
        for row in strongest(spectrum, [*lines, (beside, 6.015), (beside, 25.015)])
    }
    assert named[25] == ["gear mesh 1"]
    assert named[6] == ["6 × tooth of sun at one gear mesh"]
    # over one turn nobody sees which of two lines a third of an order apart a peak is
    wave = np.cos(2 * np.pi * 24.75 * turn[:200])
    short = xr.DataArray(wave, {"turn": turn[:200]}, "turn", "force")
    of_all = next(x for x, _ in lines if x.label == "gear mesh 1")
    sideband = (replace(of_all, kind="sideband", label="beside"), 24.75)
    row = next(
        strongest(
            order_spectrum(short.assign_attrs(about)),
            [(replace(of_all, share=1.0), 25.0), sideband],
        )
    )
    assert row["expected"] == ["gear mesh 1"]


@pytest.mark.usefixtures("no_pixels")
def test_speeds_of_a_map_are_those_of_its_turns(transient, tmp_path, flexgear):
    """A sun against the carrier turns z_r/(z_s + z_r) as fast as in space."""
    file, _ = transient
    options = ("--only", "sun 1", "--member", "sun", "--map", 1, "--highest", 40, "-q")
    stage, speeds = load_case("lin-parker", SETTINGS).stages[0], list[float]()
    for against in ((), ("--against", "carrier")):
        command = ("orders", file, *options, *against, "--out", tmp_path, "--force")
        assert (" r/min against carrier" in flexgear.out(*command)) == bool(against)
        mapped = load(tmp_path / "orders.nc")["gear_mesh_force"].squeeze("column")
        rising = mapped.assign_coords(speed=mapped["time"])
        label = order_map_chart(rising).axes[0].get_ylabel()
        assert (
            label == " ".join(["speed of sun", "against carrier"][: 1 + bool(against)]) + " (r/min)"
        )
        speeds.append(float(mapped["speed"].mean()))
    expected = stage.ring.teeth / (stage.ring.teeth + stage.sun.teeth)
    assert speeds[1] / speeds[0] == pytest.approx(expected, rel=1e-3)


@pytest.mark.usefixtures("no_pixels")
def test_multiples_of_a_fault_of_the_case_are_named_before_others(flexgear, tmp_path):
    """A spall of a planet with as many teeth as the sun, whose teeth have the same lines."""
    text = STAGE.format(planets=3, sun=1e9, helix=0).replace(" = 34", " = 26").replace("94", "78")
    text = text.replace('model = "constant"', 'model = "lumped"\ncontact_law = "one-sided"')
    text = "".join(line for line in text.splitlines(True) if "_stiffness_n" not in line)
    fault = '[[faults]]\nkind = "spall"\ngear = "planet"\nplanet = 2\ntooth = 5\nflank = "sun"\n'
    path, file = write(tmp_path, text + fault + "depth_um = 4\n"), tmp_path / "run.nc"
    flexgear.out("simulate", path, "--duration-s", 2.7, "--out", file, "-q")
    options = ("--only", "sun 2", "--member", "planet", "--against", "carrier", "--highest", 25)
    named = {
        round(row["order"]): row["expected"]
        for row in flexgear.json("orders", file, *options)["lines"]
    }
    for times in range(4, 9):
        assert named[times][0] == f"{times} × flank of a planet"
        assert f"{times} × tooth of sun at one gear mesh" in named[times]


def test_multiples_of_a_bearing_s_line_and_their_sidebands_are_named():
    """A defect of a planet's outer ring, loaded once a turn of the planet against the carrier, and
    heard once a turn of the carrier: 9 balls of 0.2034 of the pitch diameter strike it 3.5848 times
    a turn. Gear-mesh forces are not heard in passing. Where it is loaded twice a turn, lines two
    turns away have names, in a short run none, as peaks are near them by chance."""
    balls = {"rolling": "ball", "elements.count": "9", "elements.diameter_mm": "7.94004",
             "elements.pitch_diameter_mm": "39.0398", "elements.clearance_mm": "0"}  # fmt: skip
    settings = SETTINGS | {f"stage.planet_bearing.{k}": v for k, v in balls.items()}
    case = load_case("lin-parker", settings)
    lines = list(expected_orders(case, "carrier"))
    planet, turn = TEETH / 35, np.arange(0.0, 60.0, 1 / 200)  # of the carrier
    strikes = 3.5848 * planet
    loaded, heard = 1 + 0.6 * np.cos(2 * np.pi * planet * turn), 1 + 0.5 * np.cos(2 * np.pi * turn)
    signal = loaded * heard * sum(np.cos(2 * np.pi * k * strikes * turn) for k in (1, 2, 3))
    about = {"per_turn": 200, "highest_order": 75.0, "of": "carrier", "units": "N"}
    history = xr.DataArray(signal, {"turn": turn}, "turn", "sensor_signal", about)
    rows = list(strongest(order_spectrum(history), lines))
    race, ring, passing = "planet bearing, outer race", "1 outer ring turn", "1 carrier turn"
    for order, label in (
        (2 * strikes, f"2 × {race}"),
        (3 * strikes - planet, f"3 × {race} −{ring}"),
        (2 * strikes + planet, f"2 × {race} +{ring}"),
        (2 * strikes - 1, f"2 × {race} −{passing}"),
    ):
        near = [row for row in rows if row["order"] == pytest.approx(order, abs=0.02)]
        assert [row["expected"] for row in near] == [[label]]
    twice = np.cos(4 * np.pi * planet * turn) * np.cos(4 * np.pi * strikes * turn)
    for turns, label in ((60, f"2 × {race} −2 outer ring turns"), (4, "")):
        spectrum = order_spectrum(history.copy(data=twice)[: 200 * turns])
        named = [row["expected"] for row in strongest(spectrum, lines)]
        assert [label] in named if label else not any("ring turns" in str(x) for x in named)
    history.name = "gear_mesh_force"
    names = [x for row in strongest(order_spectrum(history), lines) for x in row["expected"]]
    assert any(ring in name for name in names) and not any(passing in name for name in names)


@pytest.mark.parametrize("kind", ["outer_race", "inner_race", "roller"])
def test_the_faulty_one_of_bearings_alike_is_named_before_the_others(tmp_path, kind):
    """Four equal bearings under two gears of the same speed have the same lines. A peak at 27 turns
    is a sideband of an inner race, 16 (1 + 1/6)/2 passes a turn, before it is one of the gears."""
    seat = """{ radial_n_per_m = 3e8, rolling = "roller", rollers = { count = 16, length_mm = 20 },
    elements = { diameter_mm = 10, pitch_diameter_mm = 60 }, z_mm = Z }""".replace("\n", "")
    seats = f"[{seat.replace('Z', '-30')}, {seat.replace('Z', '30')}]"
    gear = f"""teeth = 30, mass_kg = 2, inertia_kg_m2 = 0.01, tilt_inertia_kg_m2 = 0.006,
    kinematics = "spatial", support = {seats}""".replace("\n", "")
    text = spur_pair(gear, gear, 'model = "constant"', torque=2e3, output="brake_exponent = 0")
    text += f'[[faults]]\nkind = "{kind}"\nbearing = "gear.support.1"\nwidth_mm = 3\ndepth_um = 6'
    case = load_case(write(tmp_path, text))
    lines = faults_first(expected_orders(case, "pinion"))
    part = {"roller": "spin of elements"}.get(kind, kind.replace("_", " "))
    assert lines[0][0].label == f"gear support 2, {part}"
    assert sum(order == pytest.approx(lines[0][1]) for _, order in lines) == 4
    turn = np.arange(0.0, 60.0, 1 / 200)
    about = {"per_turn": 200, "highest_order": 75.0, "of": "pinion", "units": "N"}
    peak = xr.DataArray(np.cos(54 * np.pi * turn), {"turn": turn}, "turn", "port_torque", about)
    named = next(strongest(order_spectrum(peak), lines))["expected"][0]
    sideband = "3 × stage 1 gear support 2, inner race −1 inner ring turn"
    assert named == (sideband if kind == "inner_race" else "27 × stage 1 tooth of pinion")


@pytest.mark.parametrize(
    ("options", "text"),
    [
        (["--member", "wheel"], "wheel: is no member"),
        (["--member", "ring"], "ring: does not rotate"),
        (["--of", "sound"], "sound: is no history"),
        (["--of", "body_displacement", "--only", ""], "42 columns"),
        (
            ["--of", "bearing_force", "--only", "sun_support"],
            "is in N and N m -- name columns of one unit with --only",
        ),
        (["--only", "moon"], "is no label"),
        (["--highest", 1e5], "samples a period"),
        (["--highest", -3], "is not positive"),
        (["--window", "door"], "--window: 'door': is unknown"),
        (["--window", "nan"], "--window: 'nan': is unknown"),
        (["--map", 900], "do not fit"),
        (["--map", "nan"], "do not fit"),
        (["--envelope-hz", 5, 1e9], "band"),
        (["--from-s", 7], "holds no samples"),
        (["--planets", "moon"], "is no planetary stage"),
        (["--planets", "stage", "--average"], "--average: has no effect beside --planets"),
        (["--planets", "stage", "--highest", 9], "--highest: has no effect beside --planets"),
        (["--average", "--map", 2], "--map: has no effect beside --average"),
        (["--sensor-angle-deg", 30], "--sensor-angle-deg: has no effect without --planets"),
    ],
)
def test_bad_input_is_one_line(flexgear, transient, options, text):
    code, out, err = flexgear("orders", transient[0], "-q", "--only", "ring", *options)
    assert (code, out, err.count("\n")) == (2, "", 1) and text in err


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("parameters", "dataset: is not a result of flexgear"),
        ("settle_s", "cannot be read, its datasets: 'settle_s' is missing"),
        ("input_angle", "orders: input_angle: is not in the file beside gear_mesh_force"),
        ("time", "is not a netCDF file of flexgear (an axis of "),
    ],
)
def test_a_damaged_transient_is_one_line(flexgear, transient, tmp_path, name, text):
    shutil.copy(transient[0], tmp_path / "a.nc")
    with h5py.File(tmp_path / "a.nc", "a") as file:
        del (file.attrs if name in file.attrs else file)[name]
    assert text in flexgear.refused("orders", tmp_path / "a.nc", "-q", "--only", "ring")


def test_orders_of_a_missing_file_are_refused(flexgear, tmp_path):
    code, _, err = flexgear("orders", tmp_path / "none.nc", "-q")
    assert code == 2 and err.count("\n") == 1 and "there is no such file" in err


@pytest.fixture(scope="module")
def sensors_run(tmp_path_factory):
    """Fourteen turns of the carrier with accelerometers on sun and ring."""
    of_all = 'measures = "acceleration", direction = "x"'
    sensors = ", ".join(
        f'{{ name = "on_{x}", on = "stage.{x}", {of_all} }}' for x in ("sun", "ring")
    )
    settings = SETTINGS | {"sensors": f"[{sensors}]"}
    options = [x for key, value in settings.items() for x in ("--set", f"{key}={value}")]
    file = tmp_path_factory.mktemp("sensors") / "run.nc"
    end = ["--duration-s", "4", "--out", str(file), "-q"]
    assert run(["simulate", "lin-parker", *options, *end]) == 0
    return file


def test_lines_of_a_sensor_on_the_sun_are_those_that_planets_pass_it_with(flexgear, sensors_run):
    """Planets pass the sun at the speed of the carrier less its own. In turns of the carrier: H of
    95 teeth, n of 1 − (1 + 95/25) = −3.8, where (95 H + n) mod 4 = 0; no tooth is at fault."""
    expected = {"on_sun": {95 - 3.8: "gear mesh 1", 3 * 95 + 3.8: "gear mesh 3"},
                "on_ring": {95 + 1.0: "gear mesh 1", 3 * 95 - 1.0: "gear mesh 3"}}  # fmt: skip
    for name, orders in expected.items():
        options = ["--of", "sensor_signal", "--only", name, "--member", "carrier"]
        lines = flexgear.json("orders", sensors_run, *options, "--highest", 300)["lines"][:2]
        for order, label in orders.items():
            (row,) = [row for row in lines if row["order"] == pytest.approx(order, abs=0.05)]
            assert len(row["expected"]) == 1 and row["expected"][0].startswith(label)


def test_lines_of_faulty_teeth_that_pass_a_sensor_are_named(flexgear, sensors_run, tmp_path):
    """Pulses of a tooth that meets all planets, or of one planet, summed up over the planets while
    these pass a sensor on the housing, 95/25 and 95/35 times in a turn of the carrier. One planet
    that differs leaves multiples of a carrier's turn, which need not be a tooth of the ring."""
    data = load(sensors_run).load()
    carrier = data["sensor_input_angle"].to_numpy()[:, 0] / (1 + 95 / 25)  # of the sun
    places = [carrier + 0.5 * np.pi * i for i in range(4)]

    def pulse(angle):
        return np.exp(30.0 * (np.cos(angle) - 1.0))

    heard = [1.0 + 0.9 * np.cos(place - 0.3) for place in places]
    of_sun = sum(h * pulse(95 / 25 * carrier - 0.5 * np.pi * i) for i, h in enumerate(heard))
    of_planet = heard[1] * pulse(95 / 35 * carrier)
    uneven = sum((i == 2) * np.exp(40.0 * (np.cos(place) - 1.0)) for i, place in enumerate(places))
    for k, (signal, word) in enumerate(
        ((of_sun, "sun"), (of_planet, "planet"), (uneven, "carrier"))
    ):
        data["sensor_signal"].loc[{"sensor": "on_ring"}] = signal
        file = tmp_path / f"{k}.nc"
        data.to_netcdf(file)
        options = ["--of", "sensor_signal", "--only", "on_ring", "--member", "carrier"]
        lines = flexgear.json("orders", file, *options, "--highest", 55)["lines"][:8]
        whole = [abs(line["order"] - round(line["order"])) < 0.05 for line in lines]
        assert all(whole) if word == "carrier" else sum(whole) < 0.3 * len(lines)
        for line, of_carrier in zip(lines, whole, strict=True):
            words = (word, "carrier", "planets pass") if of_carrier else (word,)
            assert any(text in label for text in words for label in line["expected"])
