"""Frequency responses through the public face: planets, symmetry, transients, what is refused."""

import math
import re
import warnings

import numpy as np
import pytest
from dead_zone import GEAR_MESH_HZ, RADIUS, case_text

import flexgear
from flexgear.analysis import continuation, curve_follower
from flexgear.analysis.harmonic_balance import Balance, converge
from flexgear.analysis.orbit import orbit_elements
from flexgear.analysis.orbit_receptance import OperatingPoint, condensed_train
from flexgear.model.errors import FlexgearWarning, InputError
from flexgear.solve import state_figures
from flexgear.solve.dataset import body_rows
from flexgear.solve.turning_points import turning_points

PLANETS = 4
WAVES = {
    "stage.gear_mesh.model": "rectangular",
    "stage.gear_mesh.contact_law": "one-sided",
    "stage.gear_mesh.damping_ratio": "0.08",
    "damping.ratio": "0.02",
}


@pytest.fixture(scope="module")
def planetary():
    """Four equal planets, lumped, planar, with a rectangular wave of stiffness."""
    return flexgear.load_case("lin-parker", WAVES).assemble()


def test_harmonics_excite_only_modes_of_their_nodal_index(planetary):
    """k = l z_s mod N: harmonics of even multiples move central members, others must not."""
    modal = planetary.modal
    teeth = planetary.case.stages[0].sun.teeth
    harmonics = 6
    elements = orbit_elements(modal, 0, 32 * harmonics, True)
    train = condensed_train(elements, harmonics)
    point = OperatingPoint(1.0, 1.0)
    balance = Balance(elements, train.at(point))
    orbit = converge(balance, point, balance.start())
    names, rows = body_rows(modal.system)
    motion = state_figures.recovery_of(train, balance, orbit, {}).motion(rows)
    spectrum = np.fft.rfft(motion, axis=0)[1 : harmonics + 1].reshape(harmonics, len(names), 6)
    central = [k for k, name in enumerate(names) if "planet" not in str(name)]
    size = np.abs(spectrum[:, central]).max()
    for order in range(1, harmonics + 1):
        index = order * teeth % PLANETS
        translation = np.abs(spectrum[order - 1, central, :2]).max()
        rotation = np.abs(spectrum[order - 1, central, 5]).max() * 0.1
        if index not in (1, PLANETS - 1):
            assert translation < 1e-8 * size
        if index != 0:
            assert rotation < 1e-8 * size


@pytest.mark.slow
def test_planetary_states_agree_with_a_transient():
    """Amplitudes of gear-mesh forces after 16 periods, which damp all that is free, with dampers
    across the axis of members that turn."""
    frequency = 339.0 + 4.0 / 9.0
    step = 1 / (640 * frequency)
    waves = {**WAVES, "stage.gear_mesh.model": "fourier", "solver.time_step_s": repr(step)}
    waves["solver.output_interval_s"] = repr(10 * step)
    waves["stage.planet_bearing.damping.radial_n_s_per_m"] = "1e4"
    model = flexgear.load_case("lin-parker", waves).assemble()
    at = model.response((0.99, 1.0), harmonics=12, doublings=0).isel(point=-1)
    assert float(at["response_speed_share"]) == pytest.approx(1.0)
    assert float(at["gear_mesh_frequency"]) == pytest.approx(frequency)
    force = model.transient(16 / frequency)["gear_mesh_force"].to_numpy()[-64:]
    spectrum = 2 * np.abs(np.fft.rfft(force, axis=0))[1:7] / 64
    amplitude = at["response_gear_mesh_force_amplitude"].to_numpy().T[:6]
    np.testing.assert_allclose(amplitude, spectrum, rtol=0, atol=3e-3 * spectrum.max())


@pytest.fixture(scope="module")
def pair(tmp_path_factory):
    path = tmp_path_factory.mktemp("pair") / "pair.toml"
    path.write_text(case_text(share=0.0, error=0.0))
    return flexgear.load_case(path).assemble()


def test_a_gear_mesh_that_excites_nothing_carries_its_mean_force(pair):
    data = pair.response((0.35, 1.7), harmonics=3)  # 0.35 + (1.7 - 0.35) > 1.7
    assert set(data["response_branch"].to_numpy()) == {1}
    force = data["response_gear_mesh_force"]
    np.testing.assert_allclose(force.sel(measure="maximum"), pair.rated[0], rtol=1e-9)
    assert data["stable"].all()
    assert not data["lost_contact_share"].any()
    assert not data.sizes["turning_point"]


def test_harmonics_of_an_error_force_an_oscillator_at_their_orders_and_phases(tmp_path):
    """Teeth that stay in contact on constant stiffness: m δ̈ + c δ̇ + k δ = F₀ + m ë in closed form,
    by harmonic balance, and each order by the linear response."""
    path, errors = tmp_path / "pair.toml", "stages.0.errors."
    path.write_text(case_text(share=0.0))
    stated = {
        f"{errors}sun_gear_mesh_um": "[0.6, 0.3, 0.2]",
        f"{errors}harmonic_on_coast": "opposite",
    }
    stated[f"{errors}sun_gear_mesh_phase_deg"] = "[10, 80, 200]"
    model = flexgear.load_case(path, stated).assemble()
    w = 2 * np.pi * 1.6 * GEAR_MESH_HZ * np.array([1, 2, 3])
    error = -1e-6j * np.array([0.6, 0.3, 0.2]) * np.exp(1j * np.radians([10, 80, 200]))
    spring = 4e8 + 2j * w * 0.1 * 2e4
    force = -(w**2) * error * spring / (spring - w**2)
    wave = np.real(np.exp(1j * np.outer(2 * np.pi * np.arange(64) / 64, [1, 2, 3])) @ force)
    data = model.response((1.59, 1.6), harmonics=4, doublings=0).isel(point=-1)
    largest = data["response_gear_mesh_force"].sel(measure=["maximum", "minimum"])
    np.testing.assert_allclose(largest[0], 100 / RADIUS + np.r_[wave.max(), wave.min()], rtol=1e-3)
    linear = model.linear_response((1.59, 1.6), count=2, orders=3).isel(speed_factor=-1)
    amplitude = linear["linear_force_amplitude"].to_numpy()[0]
    np.testing.assert_allclose(amplitude, np.abs(force), rtol=1e-6)


def test_dampers_of_bearings_at_the_natural_frequency_of_the_gears_on_them(tmp_path):
    """Gears that turn and sway on linear bearings, which order 1 meets exactly, along the line of
    action: F = K e/(1 + K α), α = −1/(mω²) + 2/(k_b − Mω² + iωc_b), K = k + iωc."""
    path, w, mass, c = tmp_path / "pair.toml", 2 * np.pi * GEAR_MESH_HZ * 1.6, 4.0, 2e4
    bearing = f"radial_n_per_m = {mass * w**2!r}, damping = {{ radial_n_s_per_m = {c} }}"
    sways = f'kinematics = "planar", mass_kg = {mass}, support = {{ {bearing} }}'
    path.write_text(case_text(share=0.0).replace('kinematics = "torsional"', sways))
    data = flexgear.load_case(path).assemble().response((1.55, 1.6), harmonics=2, doublings=0)
    at = data.isel(point=int(data["response_speed_share"].to_numpy().argmax()))
    alpha, spring = 2 / (1j * w * c) - 1 / w**2, 4e8 + 2j * w * 0.1 * 2e4
    force = abs(spring * 2e-6 / (1 + spring * alpha))
    amplitude = at["response_gear_mesh_force_amplitude"].to_numpy()[0]
    np.testing.assert_allclose(amplitude, [force, 0.0], rtol=1e-6, atol=1e-6 * force)
    bearing = 100 / RADIUS + force * abs(mass * w**2 + 1j * w * c) / (w * c)
    largest = at["response_bearing_force"].sel(measure="maximum")
    np.testing.assert_allclose(largest, [bearing, bearing], rtol=1e-3)


def test_a_long_response_first_says_how_long_it_takes(pair, monkeypatch):
    """Its first line, before a curve is begun, by a warning that the command line prints; what is
    followed outside the range is shown."""
    shown = list[str]()

    def show(line, *_):
        shown.append(str(line))

    monkeypatch.setattr(state_figures, "LONG", 0.0)
    monkeypatch.setattr(warnings, "showwarning", show)
    warnings.simplefilter("ignore")
    warnings.filterwarnings("always", "a steady state takes", FlexgearWarning)
    pair.response((0.5, 0.6), harmonics=3, doublings=0, progress=show)
    stages = list(dict.fromkeys(shown))
    assert stages[:2] == ["response, start", "response, first states"]
    assert re.search(
        "states 0 to [01] min, .* fewer --harmonics than 3, .*--doublings 0", stages[2]
    )
    assert sorted(stages[3:5]) == ["response, curve 1", "response, curve 1 beyond the range"]
    assert not any(re.search("a steady state takes", line) for line in stages[3:])


@pytest.mark.slow
def test_a_curve_that_creeps_ends_with_its_reason(pair, monkeypatch):
    """As where the tangent turns in every step, which keeps steps short: it stops after as many as
    would have led from the shortest step to the longest and back."""
    monkeypatch.setattr(curve_follower, "LARGEST_TURN", -1.0)
    monkeypatch.setattr(curve_follower, "KINK", 1e-6)
    monkeypatch.setattr(continuation, "SEEDS", (0.0,))
    data = pair.response((1.6, 2.0), harmonics=1, doublings=0)
    assert data.sizes["point"] == 1 + curve_follower.CREEP
    assert "no steady state was found further on" in data.attrs["cut"]


SENSORS = """
[[sensors]]
name = "speed"
on = "stage_1.gear"
measures = "speed"
[[sensors]]
name = "pickup"
on = "stage_1.gear"
measures = "acceleration"
place_mm = [20, 0, 0]
direction = "tangential"
"""


@pytest.mark.slow
def test_sensors_measure_the_motion_of_steady_states(tmp_path):
    """Of two gears alike each has half of the transmission error, as rotation over r_b: order by
    order its rate, and 20 mm from the axis its acceleration."""
    path = tmp_path / "pair.toml"
    path.write_text(case_text() + SENSORS)
    data = flexgear.load_case(path).assemble().response((0.5, 0.6), harmonics=4)
    error = data["response_transmission_error_amplitude"].to_numpy()[:, 0]
    omega = 2 * np.pi * GEAR_MESH_HZ * data["response_speed_share"].to_numpy()[:, None]
    rate = omega * data["gear_mesh_order"].to_numpy()
    speed = data["response_sensor_amplitude"].sel(sensor="speed").to_numpy()
    np.testing.assert_allclose(speed, rate * error / (2 * RADIUS), rtol=1e-6)
    pickup = data["response_sensor_amplitude"].sel(sensor="pickup").to_numpy()
    np.testing.assert_allclose(pickup, 0.02 * rate * speed, rtol=1e-6)
    assert str(data["sensor_unit"].sel(sensor="pickup").item()) == "m/s2"


@pytest.mark.parametrize(
    ("asked", "problem"),
    [
        ({"speeds": (-0.5, 1.0)}, "goes through zero speed"),
        ({"torques": (0.0, 1.0)}, "goes through zero torque"),
        ({"speeds": (1.0, 1.0)}, "is no range"),
        ({"speeds": (1.5, 0.5)}, "falls in speed -- write 0.5 to 1.5"),
        ({"torques": (1.5, 0.5)}, "falls in torque -- write 0.5 to 1.5"),
        ({"speeds": (0.5, 1.0), "torques": (0.5, 1.0)}, "beside a range of speeds"),
        ({"torques": (0.5, 1.0), "speed": 0.0}, "is not positive"),
        ({"torques": (-1.0, -0.5)}, "is below zero -- .*: turn round torques"),
        ({"speeds": (0.5, 1.0), "torque": -1.0}, "is not positive -- .*: turn round torques"),
        ({"speeds": (0.5, 1.0), "stage": "stage_9"}, "is not a stage"),
        ({"speeds": (0.5, 1.0), "harmonics": 0}, "is not from 1 to 200"),
        ({"speeds": (0.5, 1.0), "doublings": 9}, "doublings: 9: is out of range"),
    ],
)
def test_a_bad_range_of_a_response_is_one_line(pair, asked, problem):
    with pytest.raises(InputError, match=problem):
        pair.response(**asked)


@pytest.mark.slow
def test_a_torque_that_is_turned_round_loads_the_other_flanks_alike(tmp_path):
    """Teeth are symmetric, and this wave has every flank at once."""
    forces = []
    for torque in (100.0, -100.0):
        path = tmp_path / "pair.toml"
        path.write_text(case_text(damping=0.05, torque=torque, backlash=10.0, error=0.0))
        data = flexgear.load_case(path).assemble().response((0.45, 0.6), harmonics=6, doublings=0)
        forces.append(forces_at(data, "speed", 0.5))
    np.testing.assert_allclose(forces[1], forces[0], rtol=1e-4)


@pytest.mark.slow
def test_a_gear_of_given_speed_vibrates_as_one_of_enormous_inertia(tmp_path):
    """Its equivalent mass is twice that of two gears alike: a smaller ratio is the same damper."""
    forces = []
    for gear, damping, machine in ((2e8, 0.05 / math.sqrt(2), "torque"), (2, 0.05, "speed")):
        text = case_text(damping=damping).replace("mass_kg = 2", f"mass_kg = {gear:g}")
        text = text.replace(f"mass_kg = {gear:g}", "mass_kg = 2", 1)
        text = text.replace("[output]", f'machine = {{ law = "{machine}" }}\n[output]')
        (tmp_path / "pair.toml").write_text(text)
        data = (
            flexgear.load_case(tmp_path / "pair.toml")
            .assemble()
            .response((0.5, 0.75), harmonics=8, doublings=0)
        )
        forces.append([forces_at(data, "speed", speed) for speed in (0.53, 0.74)])
    for inertia, held in zip(*forces, strict=True):
        np.testing.assert_allclose(held, inertia, rtol=2e-3)


def test_a_sweep_may_jump_to_each_stable_state_that_waits():
    """A curve that folds at 1.2 and 0.9, its last stretch stable as the first, and another one."""
    speed = np.r_[np.linspace(0.5, 1.2, 8), np.linspace(1.1, 0.9, 3), np.linspace(1, 2, 11), 0.5, 2]
    force = np.r_[np.linspace(1, 8, 8), [9, 10, 11], np.linspace(12, 22, 11), 30, 30]
    stable = np.repeat([1, 0, 1], [8, 3, 13])
    arrays = {"response_gear_mesh_force": force[:, None, None], "stable": stable,
              "multiplier_real": 2.0 - stable, "multiplier_imag": 0.0 * stable}  # fmt: skip
    points = turning_points(speed, np.repeat([1, 2], [22, 2]), arrays)
    assert points["turning_point_sense"].tolist() == [1, -1]
    expected = [[14.0, 30.0], [5.0, 30.0]]
    np.testing.assert_allclose(points["turning_point_target_force"], expected, rtol=1e-9)


def test_a_jump_between_kinks_is_at_the_extreme_speed():
    """Samples that lose contact one by one make a curve turn five times near one turning point."""
    speed = np.array([1.2, 1.1, 1.0, 1.0005, 0.999, 1.001, 1.0008, 1.1, 1.2])
    force, stable = np.arange(1.0, 10.0), (np.arange(9) > 4).astype(int)
    arrays = {"response_gear_mesh_force": force[:, None, None], "stable": stable,
              "multiplier_real": 2.0 - stable, "multiplier_imag": 0.0 * stable}  # fmt: skip
    points = turning_points(speed, np.ones(9), arrays)
    assert points["turning_point_sense"].tolist() == [-1]
    assert points["turning_point_parameter"].tolist() == [0.999]
    assert points["turning_point_force"].tolist() == [5.0]


@pytest.mark.parametrize(("spacing", "kind"), [(1e-4, 0), (2e-3, 3)])
def test_a_multiplier_that_passes_one_beside_a_turning_point_is_that_of_the_turning_point(
    spacing, kind
):
    """Three states from it, 1.5e-4 of speed; 3e-3 away a symmetry breaks."""
    speed = 0.935 + spacing * np.r_[9.0, 4, 1, 0, 0.5, 1, 2, 5, 9]
    stable = (np.arange(9) > 5).astype(int)
    arrays = {"response_gear_mesh_force": np.arange(1.0, 10.0)[:, None, None], "stable": stable,
              "multiplier_real": 1.1 - 0.2 * stable, "multiplier_imag": 0.0 * stable}  # fmt: skip
    changes = turning_points(speed, np.ones(9), arrays)
    assert changes["stability_change_kind"].tolist() == [kind]


def test_where_a_doubled_curve_comes_back_no_third_one_is_missing():
    """Its multiplier passes 1 by its error 1e-3 beside the place where its period halves again;
    passing it elsewhere remains."""
    speed = np.r_[0.8, 1.0, 1.2, 1.0995, 1.099, 0.9, 0.8]
    real = np.r_[-1.2, -1.1, -1 / 1.1, 1.01, 0.99, 0.9, 1.1]
    arrays = {"response_gear_mesh_force": np.arange(1.0, 8.0)[:, None, None],
              "stable": (np.abs(real) < 1).astype(int),
              "multiplier_real": real, "multiplier_imag": 0.0 * real}  # fmt: skip
    points = turning_points(speed, np.repeat([1, 2], [3, 4]), arrays, {1: 2})
    assert points["stability_change_kind"].tolist() == [1, 3]
    assert points["stability_change_parameter"][1] < 0.9


@pytest.fixture(scope="module", params=[2e-6, 0.0])
def parting(request, tmp_path_factory):
    """A pair whose teeth part, with an error of the gear mesh or without, and its whole curve."""
    path = tmp_path_factory.mktemp("parting") / "pair.toml"
    path.write_text(case_text(damping=0.05, error=request.param))
    model = flexgear.load_case(path).assemble()
    return model, model.response((0.4, 1.2), harmonics=8, doublings=0)


def forces_at(data, over, value):
    """Largest gear-mesh forces of all states at a speed or torque, rising."""
    x = data[f"response_{over}_share"].to_numpy()
    force = data["response_gear_mesh_force"].sel(measure="maximum").to_numpy()[:, 0]
    same = np.diff(data["response_branch"].to_numpy()) == 0
    at = np.flatnonzero(((x[:-1] - value) * (x[1:] - value) <= 0.0) & same)
    w = (value - x[at]) / (x[at + 1] - x[at])
    return np.sort((1 - w) * force[at] + w * force[at + 1])


@pytest.mark.slow
def test_a_range_within_the_hysteresis_has_all_branches(parting):
    """Curves that join only beyond the range are in it: over speed; over torque at one speed, where
    states without errors and back contact are as large as the torque."""
    model, whole = parting
    up, down = (float(x) for x in whole["turning_point_parameter"])
    middle, width = 0.5 * (up + down), 0.2 * (up - down)
    expected = forces_at(whole, "speed", middle)
    assert len(expected) == 3
    if model.case.stages[0].errors.sun_gear_mesh:
        data = model.response((middle - width, middle + width), harmonics=8, doublings=0)
        forces = forces_at(data, "speed", middle)
    else:
        data = model.response(torques=(1.5, 2.5), speed=middle, harmonics=8, doublings=0)
        forces = 0.5 * forces_at(data, "torque", 2.0)
    assert not data.sizes["turning_point"]
    np.testing.assert_allclose(forces, expected, rtol=5e-3)


@pytest.mark.parametrize("parting", [0.0], indirect=True)
def test_a_stopped_response_keeps_its_states_and_says_where_it_is_cut(parting):
    model, whole = parting

    stops = [KeyboardInterrupt]

    def stop(stage, share):
        if share > 0.5 and stops and stage == "response, curve 1":
            raise stops.pop()

    data = model.response((0.4, 1.2), harmonics=8, progress=stop)
    count = data.sizes["point"]
    assert 3 < count < whole.sizes["point"]
    speed = data["response_speed_share"].to_numpy()
    np.testing.assert_allclose(speed, whole["response_speed_share"][:count], rtol=1e-9)
    assert data.attrs["complete"] == 0
    assert data.attrs["cut"].startswith(f"at {speed[-1]:.4g}: stopped by the user")
