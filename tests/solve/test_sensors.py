"""Sensors of a small stage: lumped members, FE bodies, held and turning, and what refuses them."""

import re

import numpy as np
import pytest
import xarray as xr
from scipy.interpolate import make_interp_spline
from small_train import SMALL_STAGE

from flexgear import InputError, load_case, sweep
from flexgear.coupling.build import require_workable
from flexgear.face.model import assembled
from flexgear.solve import long_run

QUICK = {"solver.fidelity": "quick"}
LUMPED = """
kinematics = "planar"

[material]
young_modulus_gpa = 206
poisson_ratio = 0.3
density_kg_per_m3 = 7850

[stage]
planets = 4
normal_module_mm = 1.5
pressure_angle_deg = 20
face_width_mm = 20
sun = { teeth = 28, support = { radial_n_per_m = 1e7 } }
planet = { teeth = 22 }
ring = { teeth = 72, support = { radial_n_per_m = 1e7, tangential_n_per_m = 1e9 } }
carrier = { support = { radial_n_per_m = 1e7 } }
planet_bearing = { radial_n_per_m = 2e8 }

[stage.errors]
planet_eccentricity_um = [20, 0, 0, 0]

[solver]
gear_mesh_orders = 1

[[inputs]]
member = "stage.carrier"
torque_nm = 300
speed_rpm = 1500
inertia_kg_m2 = 0.02

[output]
member = "stage.sun"
inertia_kg_m2 = 0.002
"""


def sensor(name, on, measures, *keys):
    lines = "\n".join(keys)
    return f'\n[[sensors]]\nname = "{name}"\non = "{on}"\nmeasures = "{measures}"\n{lines}\n'


def case_of(folder, text, settings=None):
    path = folder / "small.toml"
    path.write_text(text, encoding="utf-8")
    return load_case(path, settings)


RATES = ("displacement", "velocity", "acceleration")
ON_LUMPED = "".join(
    sensor(f"{part}_{frame}_{measures}", f"stage.{part}", measures, "place_mm = [30, 10, 0]",
           f'frame = "{frame}"', 'direction = "tangential"')
    for part in ("carrier", "sun", "ring", "planet_2")
    for frame in ("body", "fixed")
    for measures in RATES
    if (part, frame) != ("planet_2", "fixed")
)  # fmt: skip
PLACE = 0.03 + 0.01j  # of all of them, in the member's axes
ALONG = 1j * PLACE / abs(PLACE)


@pytest.fixture(scope="module")
def lumped(tmp_path_factory):
    """A transient of lumped members with runout and constant teeth, whose motion is smooth: its
    samples at every step tell what sensors have to say."""
    text = LUMPED + ON_LUMPED + sensor("speed", "stage.sun", "speed")
    text += sensor("torque", "stage.sun", "torque")
    model = case_of(tmp_path_factory.mktemp("lumped"), text).assemble()
    return model, model.transient(duration=0.05, output_interval=model.pace.time_step)


SETTLED = slice(600, None)  # without what rings beyond the band as the run begins


def at_sensor(run, history, derivative=0):
    """A derivative of a history at the sensors' times, by a spline of degree seven."""
    spline = make_interp_spline(run["time"].to_numpy(), history, 7)
    return spline(run["sensor_time"].to_numpy()[SETTLED], derivative)


def signal(run, name):
    return run["sensor_signal"].sel(sensor=name).to_numpy()[SETTLED]


def moved(run, body, place):
    """Displacement (t,) in space of a member's point at ``place`` (t,) from its centre, complex,
    from its motion in the carrier's axes; of planet 2 in its own, a quarter turn on."""
    motion = run["body_displacement"].sel(body=body).astype(float)
    turned = run["carrier_angle"].to_numpy()[:, 0] + (np.pi / 2 if "planet" in body else 0.0)
    centre = (motion.sel(dof="ux") + 1j * motion.sel(dof="uy")).to_numpy() * np.exp(1j * turned)
    return centre + 1j * motion.sel(dof="rz").to_numpy() * place


def rotation(model, run, body):
    """Of a member in space when the train rolls, from speeds worked out in closed form."""
    teeth = {"sun": 1 + 72 / 28, "planet_2": 1 - 72 / 22, "carrier": 1.0, "ring": 0.0}
    return teeth[body] * run["input_angle"].to_numpy()[:, 0]


@pytest.mark.parametrize("order", [0, 1, 2])
@pytest.mark.parametrize("body", ["carrier", "sun", "ring", "planet_2"])
def test_a_sensor_that_turns_with_a_lumped_member_has_the_derivatives_of_its_motion(
    lumped, body, order
):
    model, run = lumped
    spin = rotation(model, run, body) + (np.pi / 2 if body == "planet_2" else 0.0)
    arm = PLACE * np.exp(1j * spin)
    path = moved(run, f"stage.{body}", arm)
    if order:
        orbit = run["carrier_angle"].to_numpy()[:, 0] + np.pi / 2
        path = path + arm + (body == "planet_2") * 0.0375 * np.exp(1j * orbit)
    exact = at_sensor(run, path.real, order) + 1j * at_sensor(run, path.imag, order)
    along = ALONG * np.exp(1j * at_sensor(run, spin))
    exact = (exact * np.conj(along)).real
    values = signal(run, f"{body}_body_{RATES[order]}")
    np.testing.assert_allclose(values, exact, atol=1e-3 * np.ptp(exact) + 1e-6 * abs(exact).max())


@pytest.mark.parametrize("order", [0, 1, 2])
@pytest.mark.parametrize("body", ["carrier", "sun", "ring"])
def test_a_fixed_sensor_sees_what_passes_its_place_in_space(lumped, body, order):
    _, run = lumped
    exact = at_sensor(run, (moved(run, f"stage.{body}", PLACE) * np.conj(ALONG)).real, order)
    values = signal(run, f"{body}_fixed_{RATES[order]}")
    np.testing.assert_allclose(values, exact, atol=1e-3 * np.ptp(exact))


def test_speed_and_torque_are_those_of_the_port(lumped):
    _, run = lumped
    for name, port in (("speed", "port_speed"), ("torque", "port_torque")):
        exact = at_sensor(run, run[port].sel(port="stage.sun").to_numpy())
        values = signal(run, name)
        np.testing.assert_allclose(values, exact, atol=1e-3 * np.ptp(exact), rtol=1e-7)
        assert np.ptp(exact) > 0


JOINED = """
[[stages]]
kind = "parallel"
normal_module_mm = 2
pressure_angle_deg = 20
face_width_mm = 20
pinion = { teeth = 20, support = { radial_n_per_m = 1e8 } }
gear = { teeth = 40, support = { radial_n_per_m = 1e8 } }

[[joints]]
first = "stage.sun"
second = "stage_2.pinion"
torsion_nm_per_rad = 1e5
damping_nm_s_per_rad = 20
"""


def test_the_torque_of_a_joint_is_that_on_its_second_member(tmp_path):
    """The sun's in equilibrium, k Δφ + c Δω of both members' motions in a transient."""
    text = LUMPED.replace("[stage]", '[[stages]]\nname = "stage"').replace("[stage.e", "[stages.e")
    text = text.replace('"stage.sun"', '"stage_2.gear"') + JOINED
    case = case_of(tmp_path, text + sensor("joint", "stage.sun-stage_2.pinion", "torque"))
    model = case.assemble()
    torque = model.static(0.0)["sensor_static"].item()
    assert torque == pytest.approx(300 / (1 + 72 / 28), rel=1e-9)
    run = model.transient(duration=0.02, output_interval=model.pace.time_step)
    rotation = run["body_displacement"].sel(dof="rz").astype(float)
    twist = (rotation.sel(body="stage.sun") - rotation.sel(body="stage_2.pinion")).to_numpy()
    spline = make_interp_spline(run["time"].to_numpy(), twist, 7)
    settled = run.sel(sensor_time=slice(0.01, None))
    time = settled["sensor_time"].to_numpy()
    exact = 1e5 * spline(time) + 20 * spline(time, 1)
    values = settled["sensor_signal"].to_numpy()[:, 0]
    np.testing.assert_allclose(values, exact, atol=0.01 * np.ptp(exact))


def test_rotations_beside_the_signals_are_those_of_the_run(lumped):
    _, run = lumped
    angle = run["sensor_input_angle"].to_numpy()[SETTLED, 0]
    np.testing.assert_allclose(
        angle, at_sensor(run, run["input_angle"].to_numpy()[:, 0]), rtol=1e-9
    )


def test_a_low_band_has_no_aliases_when_few_samples_are_kept(tmp_path):
    """Tooth pairs excite vibration far above the band; every step, and a sample a millisecond."""
    text = LUMPED.replace("[stage.errors]", '[stage.gear_mesh]\nmodel = "per_pair"\n[stage.errors]')
    text += sensor("speed", "stage.sun", "speed") + "[recorder]\nband_hz = 850"
    model = case_of(tmp_path, text).assemble()
    runs = (
        model.transient(duration=0.06, output_interval=interval)["sensor_signal"]
        for interval in (model.pace.time_step, 1e-3)
    )
    every, few = xr.align(*runs)
    assert len(every) > 60
    np.testing.assert_allclose(few, every, rtol=0.0, atol=1e-4 * np.ptp(every.to_numpy()))


# bodies with an FE mesh


def vertex(body, radius, z, angle_deg):
    """The vertex of an FE mesh's outside nearest to a place, and where it is."""
    x, y, height = body.points.T
    away = np.hypot(np.hypot(x, y) - radius, height - z)
    turned = np.angle(np.exp(1j * (np.arctan2(y, x) - np.radians(angle_deg))))
    number = int(np.argmin(away + 0.5 * radius * np.abs(turned)))
    return number, body.points[number]


@pytest.fixture(scope="module")
def stage(tmp_path_factory):
    """Folder, and the small stage with FE ring and carrier."""
    folder = tmp_path_factory.mktemp("stage")
    return folder, case_of(folder, SMALL_STAGE.read_text(encoding="utf-8"), QUICK).assemble()


def with_sensors(stage, text):
    """The same with sensors; its FE bodies are reduced once."""
    folder, model = stage
    case = case_of(folder, SMALL_STAGE.read_text(encoding="utf-8") + text, QUICK)
    return assembled(case, (), bodies=model.bodies)


def at_vertex(name, on, place, *keys):
    millimetres = ", ".join(f"{1e3 * x!r}" for x in map(float, place))
    return sensor(name, on, "displacement", f"place_mm = [{millimetres}]", *keys)


def test_the_displacement_of_loaded_bodies_is_that_of_their_field(stage):
    """At vertices of ring and carrier, in directions of their axes, in two positions."""
    places, text = {}, ""
    for part, radius, z in (("ring", 1.0, 0.004), ("carrier", 0.049, -0.02)):
        body = stage[1].bodies[f"stage.{part}"]
        radius = min(radius, np.hypot(*body.points[:, :2].T).max())
        places[part] = vertex(body, radius, z, 40.0)
        for axis in ("[1, 0, 0]", "[0, 2, 0]", "[0, 0, -1]"):
            name = f"{part}{axis[1]}{axis[4]}"
            text += at_vertex(name, f"stage.{part}", places[part][1], f"vector = {axis}")
    model = with_sensors(stage, text)
    for angle in (0.0, 33.0):
        values = model.static(angle)["sensor_static"].isel(position=0).to_numpy().reshape(2, 3)
        for part, signals in zip(places, values, strict=True):
            field = model.deformed(f"stage.{part}", angle)["displacement"].to_numpy()
            exact = field[places[part][0]] * [1, 1, -1]
            np.testing.assert_allclose(signals, exact, atol=1e-5 * np.abs(field).max())


def test_a_fixed_probe_at_a_turning_carrier_sees_the_field_that_passes(stage):
    """The radial displacement of a vertex of the plate when it is at the probe."""
    body = stage[1].bodies["stage.carrier"]
    number, place = vertex(body, 0.049, -0.02, 40.0)
    angle = np.degrees(np.arctan2(place[1], place[0]))
    keys = 'direction = "radial"', 'frame = "fixed"', f"angle_deg = {float(angle + 25)!r}"
    text = sensor(
        "probe", "stage.carrier", "displacement", *keys, f"z_mm = {1e3 * float(place[2])!r}"
    )
    model = with_sensors(stage, text)
    value = model.static(25.0)["sensor_static"].item()
    field = model.deformed("stage.carrier", 25.0)["displacement"].to_numpy()
    radial = place[:2] / np.linalg.norm(place[:2])
    assert value == pytest.approx(field[number, :2] @ radial, abs=0.01 * np.abs(field).max())


def test_a_fixed_sensor_at_a_node_on_the_axis_has_the_motion_of_that_node(stage):
    """Not of the outside at its height, which winds up. At angle zero both frames are one."""
    keys = 'node = "bearing_far"', 'direction = "y"'
    text = sensor("body", "stage.carrier", "displacement", *keys)
    text += sensor("fixed", "stage.carrier", "displacement", *keys, 'frame = "fixed"')
    on_body, fixed = with_sensors(stage, text).static(0.0)["sensor_static"].to_numpy()[0]
    assert fixed == pytest.approx(on_body, abs=1e-15)


def test_sensors_on_a_shaft_need_no_place_and_take_any_whether_it_is_rigid_or_not(stage):
    """At angle zero the displacement of a place along its radius is that of the centre."""
    text = sensor("centre", "stage.sun", "displacement", 'direction = "x"')
    keys = "place_mm = [12, 0, 0]", 'frame = "fixed"', 'direction = "radial"'
    model = with_sensors(stage, text + sensor("probe", "stage.sun", "displacement", *keys))
    for one in (model, model.rigid("shaft")):
        centre, probe = one.static(0.0)["sensor_static"].to_numpy()[0]
        assert probe == pytest.approx(centre, rel=1e-9) and centre != 0.0


@pytest.fixture(scope="module")
def recorded(stage):
    """The stage with sensors of all kinds."""
    text = sensor("ring", "stage.ring", "acceleration", "angle_deg = 90", 'direction = "radial"')
    text += sensor("gauge", "stage.ring", "strain", "angle_deg = 5")
    keys = "angle_deg = 10", "z_mm = -18", 'direction = "radial"', 'frame = "fixed"'
    text += sensor("probe", "stage.carrier", "velocity", *keys)
    text += sensor("pin", "stage.carrier", "acceleration", 'node = "pin_1"', 'direction = "x"')
    return with_sensors(stage, text + sensor("turn", "stage.ring", "speed"))


def test_a_run_in_pieces_records_what_the_whole_does(recorded, monkeypatch, tmp_path):
    whole = recorded.transient(duration=4e-3)
    monkeypatch.setattr(long_run, "BUFFER", 2**18)
    parts = recorded.transient(duration=4e-3, out=tmp_path / "run.nc")
    values = whole["sensor_signal"].to_numpy()
    assert len(values) > 50
    limit = 1e-12 * np.abs(values).max(axis=0)
    assert (np.abs(parts["sensor_signal"].to_numpy() - values) <= limit).all()
    np.testing.assert_array_equal(parts["sensor_time"], whole["sensor_time"])
    assert list(parts["sensor_unit"].to_numpy()) == ["m/s2", "1", "m/s", "m/s2", "rad/s"]


def test_turning_bodies_have_centripetal_acceleration_and_rings_the_speed_of_all_teeth(recorded):
    """r Ω² of the pins' circle at 1500 r/min towards the axis, within what teeth shake it by. The
    speed of a ring is that of its teeth together; one of them tilts as planets pass."""
    run = recorded.transient(duration=8e-3, output_interval=recorded.pace.time_step)
    values = run["sensor_signal"].sel(sensor="pin").to_numpy()
    assert values.mean() == pytest.approx(-0.0375 * (50 * np.pi) ** 2, rel=0.02)
    u = run["tooth_displacement"].to_numpy()
    angles = 2 * np.pi * np.arange(u.shape[1]) / u.shape[1]
    radius = np.linalg.norm(recorded.bodies["stage.ring"].positions[0, :2])
    along = u[..., 1] * np.cos(angles) - u[..., 0] * np.sin(angles)
    spline = make_interp_spline(run["time"].to_numpy(), along.mean(axis=1) / radius, 7)
    settled = run.sel(sensor_time=slice(4e-3, None))
    speed = spline(settled["sensor_time"].to_numpy(), 1)
    values = settled["sensor_signal"].sel(sensor="turn").to_numpy()
    above_the_band = 0.15 * np.ptp(speed)
    np.testing.assert_allclose(values, speed, atol=above_the_band)


def test_sensors_leave_the_run_as_it_is(recorded, stage):
    with_them, without = (model.transient(duration=2e-3) for model in (recorded, stage[1]))
    np.testing.assert_array_equal(with_them["time"], without["time"])
    np.testing.assert_array_equal(with_them["gear_mesh_force"], without["gear_mesh_force"])


RING = ("a", "stage.ring", "acceleration")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (sensor(*RING, "place_mm = [0, 80, 0]", 'direction = "x"'),
         "place_mm: is [0-9.]+ mm from the nearest surface of stage.ring -- "),
        (sensor(*RING, "angle_deg = 3", "z_mm = 11", 'direction = "x"'),
         "z_mm: is beside the ring -- at most 10 mm from mid-face"),
        (sensor("a", "stage.carrier", "velocity", "angle_deg = 3", "z_mm = 60", 'direction = "x"'),
         "z_mm: is [0-9.]+ mm from the nearest surface of stage.carrier"),
        (sensor(*RING, 'node = "bolt_99"', 'direction = "x"'), "node: 'bolt_99' is no node"),
        (sensor("a", "stage.hub", "speed"), "on: 'stage.hub' is no body"),
        (sensor(*RING, "angle_deg = 3"), "direction: is missing -- "),
        (sensor("a", "stage.carrier", "displacement", 'direction = "radial"', "angle_deg = 0",
                'frame = "fixed"'), "frame: is fixed, and stage.carrier has gaps around its axis"),
        (sensor("a", "stage.ring", "speed", "angle_deg = 3"), "angle_deg: has no meaning"),
        (2 * sensor("a", "stage.ring", "speed"), "name: a occurs twice"),
        (sensor(*RING, "angle_deg = 3", 'direction = "x"') + "\n[recorder]\nband_hz = 1e5\n",
         "recorder.band_hz: 100000 Hz is beyond 18000 Hz"),
        ("\n[recorder]\nband_hz = 1000\nsampling_rate_hz = 1900\n",
         "recorder.sampling_rate_hz: 1900 Hz is 1.9 times the band of 1000 Hz"),
        (sensor("a", "stage.carrier", "velocity", 'node = "pin_1"', 'direction = "x"',
                'frame = "fixed"'), "frame: is fixed, and the node turns with stage.carrier"),
    ],
)  # fmt: skip
def test_sensors_that_measure_nothing_are_one_clear_line(stage, text, words):
    with pytest.raises(InputError, match=words) as fault:
        assert with_sensors(stage, text).sensors
    line = str(fault.value)
    assert re.search(words, line)
    assert "\n" not in line
    assert " -- " in line


def test_a_sampling_rate_alone_limits_the_band(stage):
    """The filter passes what the rate resolves; a higher rate than the modes need keeps theirs."""
    for rate, band in ((20000, 20000 / 2.56), (1e6, 18000)):
        text = sensor("a", "stage.sun", "speed") + f"\n[recorder]\nsampling_rate_hz = {rate}\n"
        clock = with_sensors(stage, text).sensors.clock
        assert (clock.rate, clock.band) == (rate, pytest.approx(band, rel=1e-12))


def test_a_torque_is_of_a_port_or_spring_of_the_train_which_check_knows(stage, tmp_path):
    text, names = SMALL_STAGE.read_text(encoding="utf-8"), stage[1].system.torque_names
    sensors = "".join(sensor(name, name, "torque") for name in names)
    require_workable(case_of(tmp_path, text + sensors, QUICK))
    wrong = case_of(tmp_path, text + sensor("a", "stage.planet_1", "torque"), QUICK)
    with pytest.raises(InputError, match=r"on: 'stage\.planet_1' is no port, joint or bearing"):
        require_workable(wrong)


@pytest.mark.parametrize("part", ["sun", "carrier", "planet_2"])
@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ("angle_deg = 20", "angle_deg: has no meaning on stage.{}, a lumped body -- give place_mm"),
        ('node = "drive"', "node: has no meaning on stage.{}, a lumped body -- give place_mm"),
        ("z_mm = 5", "z_mm: needs an angle -- "),
        ("place_mm = [30, 0, 0]\nz_mm = 5", "z_mm: needs an angle -- "),
        ("grid_angle_deg = 45", "grid_angle_deg: is for strain gauges"),
    ],
)
def test_a_place_that_means_nothing_is_refused_as_the_case_is_read(tmp_path, part, keys, words):
    text = sensor("a", f"stage.{part}", "acceleration", keys, 'direction = "x"')
    with pytest.raises(InputError, match=re.escape(words.format(part))):
        case_of(tmp_path, LUMPED + text)


@pytest.mark.parametrize(
    ("part", "keys", "words"),
    [
        ("carrier", "", "angle_deg: is missing, and so are place_mm and node"),
        ("ring", "", "angle_deg: is missing, and so are place_mm and node"),
        ("sun", "angle_deg = 20", "angle_deg: has no meaning on stage.sun, a shaft"),
        ("carrier", 'node = "pin_9"', "node: 'pin_9' is no node of stage.carrier -- did you mean"),
        ("ring", 'node = "tooth_1"', "node: 'tooth_1' is no node of stage.ring -- did you mean"),
        ("carrier", "angle_deg = 20", "angle_deg: is on the FE mesh of stage.carrier, which is ri"),
        (
            "carrier",
            'node = "drive"\ndirection = "radial"',
            "direction: radial is undefined on the axis, where drive is",
        ),
    ],
)
def test_a_sensor_without_a_place_is_refused_before_bodies_are_reduced(tmp_path, part, keys, words):
    text = SMALL_STAGE.read_text(encoding="utf-8")
    keys += '\ndirection = "x"' * ("direction" not in keys)
    text += sensor("a", f"stage.{part}", "acceleration", keys)
    with pytest.raises(InputError, match=re.escape(words)):
        require_workable(case_of(tmp_path, text, {"stage.carrier.fe.flexible": "false"}))


def test_a_ring_from_a_file_may_be_wider_than_its_teeth(tmp_path):
    text = SMALL_STAGE.read_text(encoding="utf-8")
    text += sensor("outside", "stage.ring", "strain", "angle_deg = 5", "z_mm = 14")
    of_file = {"stage.ring.fe.fe_mesh": '"file"', "stage.ring.fe.fe_mesh_file": '"ring.vtu"'}
    assert case_of(tmp_path, text, of_file).sensors[0].z == pytest.approx(0.014)
    text = text.replace("angle_deg = 5\nz_mm", "tooth = 5\nz_mm")
    with pytest.raises(InputError, match="is beside the ring"):
        case_of(tmp_path, text, of_file)


def test_a_missing_word_is_named_with_those_that_the_key_takes(tmp_path):
    text = '[[sensors]]\nname = "a"\non = "stage.sun"\n'
    with pytest.raises(InputError, match=r"measures: is missing -- .* one of acceleration, velo"):
        case_of(tmp_path, LUMPED + text)


def test_a_planet_passes_a_sensor_in_space_only_once_a_turn(tmp_path):
    text = sensor("a", "stage.planet_1", "velocity", 'direction = "x"', 'frame = "fixed"')
    with pytest.raises(InputError, match=r"frame: is fixed, and stage\.planet_1 passes once"):
        case_of(tmp_path, LUMPED + text)


def test_a_sweep_keeps_signals_and_their_levels(tmp_path):
    """The mean of r Ω² goes with the square of the speed."""
    keys = "place_mm = [30, 0, 0]", 'direction = "x"'
    text = LUMPED.replace("[solver]", "[solver]\nduration_s = 0.02")
    case_of(tmp_path, text + sensor("pickup", "stage.carrier", "acceleration", *keys))
    speeds = {"inputs.0.speed_rpm": [1000.0, 1500.0]}
    data = sweep(tmp_path / "small.toml", speeds, measures=["sensors", "sensor_signals"], workers=1)
    signal = data["sensor_signal"].sel(sensor="pickup").to_numpy()
    mean = np.nanmean(signal, axis=1)
    assert mean == pytest.approx([-0.03 * (w * np.pi / 30) ** 2 for w in (1000, 1500)], rel=0.02)
    assert (data["sensor_rms"].to_numpy() > 0).all()
    assert data["sensor_unit"].sel(sensor="pickup").item() == "m/s2"
    assert data["sensor_interval"].to_numpy() == pytest.approx(1 / (2.56 * signal_band(tmp_path)))


def signal_band(folder):
    return load_case(folder / "small.toml").assemble().pace.band
