"""Machines at both ends of trains, drive histories, torque drops: from the case to the dataset."""

import numpy as np
import pytest
from small_train import SMALL
from stage_samples import cheap_stage
from train_contexts import put_together
from trains import lumped_housing, stage_train, write

from flexgear.analysis.kernels.energy import LEFT_OVER
from flexgear.coupling.machines import require_free_speeds
from flexgear.model.errors import InputError
from flexgear.model.load import load_case
from flexgear.solve.model import assemble
from flexgear.solve.run import run
from flexgear.solve.transient import simulate

SHORT = {"solver.duration_s": "0.04", "solver.settle_s": "0"}
PI = {"law": "controller", "kp_nm_s_per_rad": "20", "ki_nm_per_rad": "2000"}
RPM = 30 / np.pi


def at(port, keys):
    return {f"{port}.machine.{key}": value for key, value in keys.items()}


def closes(data):
    """Energy from nowhere, over the elastic one."""
    total = sum(sign * data[f"energy_{name}"] for name, sign in LEFT_OVER.items())
    return float(abs(total - total[0]).max() / data["energy_elastic"].max())


def ramp(first, last):
    return {"law": "speed", "kind": "ramp", "times_s": "[0.01, 0.03]",
            "speeds_rpm": f"[{first}, {last}]"}  # fmt: skip


@pytest.mark.parametrize("tolerance", ["0", "1e-3"])
@pytest.mark.parametrize("port", ["inputs.0", "output"])
def test_a_given_speed_is_met_and_its_torque_found(tmp_path, port, tolerance):
    column = 0 if port == "inputs.0" else 1
    first = [100, 100 * 120 / 26][column]
    ends = at(port, ramp(first, 1.2 * first)) | (
        at("output", {"law": "torque"}) if not column else {}
    )
    case = stage_train(tmp_path, **SHORT, **ends, **{"solver.step_tolerance": tolerance})
    data = simulate(assemble(case), energy=True).data
    speed, time = data["port_speed"].to_numpy()[:, column] * RPM, data["time"].to_numpy()
    assert speed == pytest.approx(np.interp(time, [0.01, 0.03], [first, 1.2 * first]), rel=1e-9)
    assert closes(data) < 1e-8
    torque = data["port_torque"].to_numpy()
    during, before = (time > 0.02) & (time < 0.03), time < 0.0099
    rows = np.array([1.0, 120 / 26])
    assert torque[before] @ rows == pytest.approx(0, abs=1e-6)
    inertia = (torque[during] @ rows).mean() / (0.2 * 100 / RPM / 0.02)
    assert 2 + 0.2 * rows[1] ** 2 < inertia < 1.5 * (2 + 0.2 * rows[1] ** 2)  # ends, and gears


@pytest.mark.parametrize("port", ["inputs.0", "output"])
def test_a_controller_settles_at_its_speed(tmp_path, port):
    """The other end's torque steps; the controller takes it over and the speed comes back."""
    column = 0 if port == "inputs.0" else 1
    other = "output" if column == 0 else "inputs.0"
    history = {"law": "torque", "kind": "steps", "times_s": "[0, 0.005]"}
    history["torques_nm"] = "[3000, 3600]" if column else "[-650, -780]"
    gains = {**PI, "kp_nm_s_per_rad": "300" if column == 0 else "60",
             "ki_nm_per_rad": "10000" if column == 0 else "4000"}  # fmt: skip
    ends = at(port, gains) | at(other, history)
    case = stage_train(tmp_path, **{**SHORT, "solver.duration_s": "0.6"}, **ends)
    data = simulate(assemble(case), energy=True).data
    speed = data["port_speed"].to_numpy()[:, column]
    late = data["time"].to_numpy() > 0.5
    assert np.abs(speed - speed[0]).max() > 1e-3 * abs(speed[0])
    assert speed[late] == pytest.approx(speed[0], rel=2e-3)
    torque = data["port_torque"].to_numpy()[late]
    assert torque.mean(axis=0) == pytest.approx([3600, -780], rel=2e-2)
    assert closes(data) < 1e-6


@pytest.mark.parametrize(
    "ends",
    [
        at("inputs.0", {**ramp(11.27, 10), "law": "speed"}),
        at("output", {**PI, "kp_nm_s_per_rad": "3e6", "ki_nm_per_rad": "1e8", "kind": "ramp",
                      "times_s": "[0.01, 0.03]", "speeds_rpm": "[50.09, 48]"}),
    ],
)  # fmt: skip
def test_a_flexible_stage_has_machines_at_both_ends(ends):
    keys = {"solver.time_step_s": "1e-4", "solver.step_time_step_s": "1e-4",
            "drive.steps.torques_nm": "[]"}  # fmt: skip
    case = load_case("wind-5mw", keys | ends)
    model = put_together(case, bodies=cheap_stage(case.view()))
    data = simulate(model, duration=0.06, energy=True).data
    column = 0 if any(key.startswith("inputs") for key in ends) else 1
    speed, time = data["port_speed"].to_numpy()[:, column] * RPM, data["time"].to_numpy()
    points = [11.27, 10] if column == 0 else [50.09, 48]
    expected = np.interp(time, [0.01, 0.03], points)
    assert np.abs(speed - expected).max() < (1e-9, 0.02)[column] * points[0]
    assert speed[time > 0.05].mean() == pytest.approx(points[1], rel=(1e-9, 5e-3)[column])
    assert closes(data) < 0.01


def test_two_inputs_have_histories_of_their_own():
    """A differential: one input's torque steps, the other's speed is ramped."""
    over = {"solver.duration_s": "0.02", "solver.settle_s": "0"}
    case = load_case("double-rotor-5mw", over)
    members = [port.member for port in case.ports]
    model = assemble(case)
    flow = model.flow
    speed = flow.speed[members[1]] * RPM
    torque = flow.torque[members[0]]
    ends = at("inputs.0", {"kind": "steps", "times_s": "[0, 0.005]",
                           "torques_nm": f"[{torque}, {0.9 * torque}]"})  # fmt: skip
    ends |= at("inputs.1", {"law": "speed", "kind": "ramp", "times_s": "[0.005, 0.015]",
                            "speeds_rpm": f"[{speed}, {1.001 * speed}]"})  # fmt: skip
    data = simulate(assemble(load_case("double-rotor-5mw", over | ends)), energy=True).data
    time = data["time"].to_numpy()
    torques = data["port_torque"].to_numpy()[:, 0]
    assert torques == pytest.approx(
        np.where(time <= 0.005 * (1 + 1e-9), torque, 0.9 * torque), rel=1e-12
    )
    expected = np.interp(time, [0.005, 0.015], [speed, 1.001 * speed])
    assert data["port_speed"].to_numpy()[:, 1] * RPM == pytest.approx(expected, rel=1e-9)
    assert closes(data) < 1e-5


def test_two_speeds_of_one_rotation_are_refused(tmp_path):
    assemble(load_case("double-rotor-5mw", at("inputs.0", {"law": "speed"})
                       | at("inputs.1", {"law": "speed"})))  # it has two rotations  # fmt: skip
    second = '[[inputs]]\nmember = "stage_1.sun"\ntorque_nm = 1\n[inputs.machine]\nlaw = "speed"\n'
    text = SMALL.replace("[output]", f"{second}[output]", 1)
    case = load_case(write(tmp_path, text, head=""), at("inputs.0", {"law": "speed"}))
    words = (
        r"inputs\[1\].machine.law: the speed of stage_1.sun follows from that of stage_1.carrier"
    )
    with pytest.raises(InputError, match=words):
        require_free_speeds(case, np.array([[1.0], [3.0], [-6.0]]))


def test_a_brake_cannot_drive(tmp_path):
    case = stage_train(tmp_path, **SHORT, **at("inputs.0", {"law": "brake"}), **at("output", PI))
    with pytest.raises(InputError, match=r"inputs\[0\].machine.law: stage.carrier gives .* brakes"):
        simulate(assemble(case))


def test_the_output_may_drive_when_it_is_no_brake(tmp_path):
    """Power flows the other way: the output's torque drives, the input is controlled."""
    reverse = {"inputs.0.torque_nm": "-3000"}
    ends = at("output", {"law": "torque"}) | at("inputs.0", PI)
    data = simulate(assemble(stage_train(tmp_path, **SHORT, **reverse, **ends))).data
    assert data["port_torque"].to_numpy()[-1] == pytest.approx([-3000, 650], rel=1e-6)


def test_a_run_with_a_controlled_generator(tmp_path):
    """Steady running keeps the rated speed; torque drops are those of the drive."""
    drops = {"drive.steps.torques_nm": "[2500]", "drive.steps.start_s": "0.004",
             "drive.steps.duration_s": "0.004", "drive.steps.after_s": "0.004"}  # fmt: skip
    ends = at("output", {**PI, "kind": "ramp", "times_s": "[0, 1]", "speeds_rpm": "[100, 200]"})
    result = run(stage_train(tmp_path, **SHORT, **drops, **ends))
    data = result.datasets["transient"]
    rated = 100 * 120 / 26
    assert data["port_speed"].to_numpy()[:, 1] * RPM == pytest.approx(rated, rel=1e-6)
    assert result.datasets["torque_step_2500"]["port_torque"].to_numpy()[:, 0].min() == 2500
    assert result.summary["energy_residual"] < 1e-6
    (left_out,) = [w for w in result.summary["warnings"] if "flexgear simulate follows" in w]
    assert left_out.startswith("machine of sun: ")


HOUSING = lumped_housing("4000", "[900, 900, 1500]", "2e8", "2e8", "1e8", "1e8")


def test_a_housing_on_a_stiff_mount_is_ground(tmp_path):
    """What stands on the housing feels it: forces on the mount are those of the supports."""
    plain = stage_train(tmp_path, **{"stage.sun.support.radial_n_per_m": "1e8"})
    stiff = {k: "1e13" if k.startswith("housing.mount") else v for k, v in HOUSING.items()}
    soft = stage_train(tmp_path, **{"stage.sun.support.radial_n_per_m": "1e8"}, **HOUSING)
    held = stage_train(tmp_path, **{"stage.sun.support.radial_n_per_m": "1e8"}, **stiff)
    a, b, c = (case.assemble().static([0.0, 6.0]) for case in (plain, held, soft))
    force = a["gear_mesh_force"].to_numpy()
    assert b["gear_mesh_force"].to_numpy() == pytest.approx(force, rel=1e-4)
    assert c["gear_mesh_force"].to_numpy().sum() == pytest.approx(force.sum(), rel=1e-4)
