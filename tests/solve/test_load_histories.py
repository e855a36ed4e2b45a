"""Loads on members over time: the oscillator's closed form, limits, energy, files."""

import numpy as np
import pytest
from coupled import make_bodies, make_case
from heavy_stage import SMALL
from stepped import stepped
from trains import STAGE, STEEL, write

from flexgear.analysis.kernels.energy import LEFT_OVER
from flexgear.analysis.transient import Drive
from flexgear.coupling.build import build_system
from flexgear.coupling.modal import modal_system
from flexgear.coupling.pace import case_pace
from flexgear.model.errors import InputError
from flexgear.model.load import load_case
from flexgear.model.train import load_histories
from flexgear.solve.model import model_of
from flexgear.solve.static import static
from flexgear.solve.transient import port_histories, simulate

MASS, SPRING, FORCE, RAMP = 2.0, 2e8, 3e4, 2.3e-3
PAIR = (
    STEEL
    + f"""
[stage]
kind = "parallel"
normal_module_mm = 2
pressure_angle_deg = 20
face_width_mm = 20
pinion = {{ teeth = 20, mass_kg = {MASS}, support = {{ radial_n_per_m = {SPRING} }} }}
gear = {{ teeth = 40, support = {{ radial_n_per_m = 1e9 }} }}
[[inputs]]
member = "stage.pinion"
speed_rpm = 10
torque_nm = 5
[output]
member = "stage.gear"
inertia_kg_m2 = 1
[damping]
ratio = 0
"""
)


def run_of(modal, loads, torque, duration, step, **options):
    drive = Drive(lambda t: np.full(len(t), torque), loads=lambda t: load_histories(loads, t))
    return stepped(modal, drive, duration, step, track_energy=True, **options)


def modelled(case):
    """The model of lumped stages."""
    return model_of(case, build_system(case))


def left_over(run):
    """What is stored less what entered, J."""
    left = sum(LEFT_OVER[name] * values for name, values in run.energy.items())
    return left - left[0]


def pair_with(folder, load):
    return load_case(write(folder, PAIR + f'\n[[loads]]\nmember = "stage.pinion"\n{load}\n'))


def test_a_ramped_force_moves_a_gear_on_springs_as_an_oscillator(tmp_path):
    """Across the line of action the teeth do not take part: m ẍ + k x = F t/T from rest has
    x = F/(k T) (t − sin ωt / ω), second order in the step."""
    pair = build_system(pair_with(tmp_path, "force_n = [0, 0, 0]")).pairs
    across = np.array([-pair.normal[0, 1], pair.normal[0, 0]])
    force = [[0.0, 0.0, 0.0], [*(FORCE * across).tolist(), 0.0]]
    case = pair_with(tmp_path, f"times_s = [0, {RAMP}]\nforces_n = {force}")
    model = modelled(case)
    modal = modal_system(model.system)
    omega, errors = np.sqrt(SPRING / MASS), []
    for parts in (100, 200):
        step = 2 * np.pi / omega / parts
        run = run_of(modal, case.loads, 5.0, 0.9 * RAMP, step)
        rows = model.system.node_rows(
            "stage.pinion", model.system.body("stage.pinion").node_names[0]
        )
        x = (run.eta @ (rows @ modal.modes).T)[:, :2] @ across
        expected = FORCE / (SPRING * RAMP) * (run.time - np.sin(omega * run.time) / omega)
        errors.append(np.abs(x - expected).max() / expected.max())
        work = run.energy["load_work"][-1] - run.energy["load_work"][0]
        assert np.abs(left_over(run)).max() < 1e-6 * work
    assert errors[1] < 1e-4
    assert errors[1] == pytest.approx(errors[0] / 4, rel=0.1)


def stage_with(folder, load):
    text = f'\n[[loads]]\nmember = "stage.carrier"\n{load}\n'
    return load_case(write(folder, STAGE.format(planets=3, sun="1e8", helix=0) + text))


CONSTANT = "force_n = [2e4, -1e4, 0]\nmoment_nm = [0, 0, 50]"
HISTORY = """times_s = [0, 1]
forces_n = [[2e4, -1e4, 0], [2e4, -1e4, 0]]
moments_nm = [[0, 0, 50], [0, 0, 50]]"""


def test_a_history_that_stays_is_the_constant_load(tmp_path):
    results = []
    for load in (CONSTANT, HISTORY):
        model = modelled(stage_with(tmp_path, load))
        at_rest = static(model, [0.0, 0.4])["gear_mesh_force"].to_numpy()
        ends = port_histories(model.case, model.flow)
        assert not (ends.varies or ends.steep or case_pace(model.case).series)
        run = stepped(model.modal, ends.drive(), 4e-3, 2e-5)
        results.append((at_rest, run.pair_load, run.eta))
    for constant, history, close in zip(*results, (1e-12, 1e-8, 1e-8), strict=True):
        assert np.abs(history - constant).max() <= close * np.abs(constant).max()
    for kind in ("soft", "ramp", "steps", "csv"):
        drive = {"kind": kind, "times": (0.0, 1.0), "torques": (3e3, 3e3)}
        ends = port_histories(model.case.with_(drive=drive), model.flow)
        assert not (ends.varies or ends.jumps)


def test_statics_and_power_flow_take_a_history_at_its_start(tmp_path):
    constant = modelled(stage_with(tmp_path, CONSTANT))
    history = modelled(
        stage_with(
            tmp_path,
            "times_s = [-1, 1]\nforces_n = [[0, 0, 0], [4e4, -2e4, 0]]\n"
            "moments_nm = [[0, 0, 20], [0, 0, 80]]",
        )
    )
    a, b = (static(m, [0.3])["gear_mesh_force"].to_numpy() for m in (constant, history))
    assert np.abs(a - b).max() <= 1e-12 * np.abs(a).max()
    assert history.flow.torque == pytest.approx(constant.flow.torque, rel=1e-14)


def flexible(**load):
    """A stage with elastic ring and carrier, loaded at the carrier."""
    case = make_case(**SMALL).with_(loads=({"member": "stage.carrier", **load},))
    return model_of(case.case, build_system(case.case, make_bodies(case)))


def flexible_run(model, step):
    drive = port_histories(model.case, model.flow).drive()
    modal = modal_system(model.system, 2000.0)
    return stepped(modal, drive, 4e-3, step, 2e-4, track_energy=True)


def test_the_work_of_a_moment_on_a_flexible_carrier_is_in_the_account():
    """It rises from nothing, does work, and the account leaves nothing over but rounding."""
    model = flexible(times=(0.0, 3e-3), moments=((0.0,) * 3, (2e6, -1e6, 0.0)))
    for step in (4e-5, 2e-5):
        run = flexible_run(model, step)
        elastic = (run.energy["elastic"] + run.energy["pair_elastic"]).max()
        assert np.abs(left_over(run)).max() < 1e-10 * elastic
        assert run.energy["load_work"][-1] > 1e-6 * elastic


def test_results_say_what_was_applied(tmp_path):
    load = "times_s = [0, 0.002]\nforces_n = [[0, 0, 0], [100, 0, -50]]"
    case = stage_with(tmp_path, load)
    data = simulate(modelled(case), duration=0.004, energy=True).data
    applied = data["applied_load"].sel(load="0 stage.carrier fixed")
    for dof, most in (("ux", 100.0), ("uz", -50.0), ("rz", 0.0)):
        expected = np.interp(data["time"].to_numpy(), [0, 0.002], [0, most])
        assert applied.sel(dof=dof).to_numpy() == pytest.approx(expected, rel=1e-12)


def test_csv_and_lists_are_one_history(tmp_path):
    (tmp_path / "rotor.csv").write_text("time_s;Force_Z_kN;moment_y_knm\n0;1,5;0\n2;2,5;-4\n")
    load = stage_with(tmp_path, 'file = "rotor.csv"').loads[0]
    assert load.at(1.0) == pytest.approx([0, 0, 2000, 0, -2000, 0])
    assert load.at([-1.0, 9.0])[:, 2] == pytest.approx([1500, 2500])


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("time_s,wind\n0,1\n1,2\n", "load series: has no column of a force.*moment_z_nm"),
        ("time_s,force_x_n,moment_q_nm\n0,1,1\n1,2,1\n", "column 'moment_q_nm'.*force_x_n"),
        ("time_s,force_x_n,force_x_kn\n0,1,1\n1,2,1\n", "column 'force_x_kn'.*twice"),
    ],
)
def test_broken_files_are_one_clear_line(tmp_path, text, words):
    (tmp_path / "rotor.csv").write_text(text)
    with pytest.raises(InputError, match=words) as caught:
        stage_with(tmp_path, 'file = "rotor.csv"')
    assert "\n" not in str(caught.value)
    assert "rotor.csv" in str(caught.value)


@pytest.mark.parametrize(
    ("load", "words"),
    [
        ("times_s = [0, 1]", "forces_n: is missing"),
        ("forces_n = [[1, 2, 3]]", "times_s: is missing"),
        ("times_s = [0, 1]\nforces_n = [[1, 2, 3]]", "1 points for 2 times"),
        ("times_s = [1, 0]\nforces_n = [[1, 2, 3], [1, 2, 3]]", "times_s: do not increase"),
        (f"{CONSTANT}\ntimes_s = [0]", "force_n: is given beside a history"),
    ],
)
def test_incomplete_histories_are_refused(tmp_path, load, words):
    with pytest.raises(InputError, match=words):
        stage_with(tmp_path, load)
