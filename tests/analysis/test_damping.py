"""Dampers by key and the damping laws of tooth pairs, against an integrator of their own."""

import numpy as np
import pytest
from dead_zone import ERROR, GEAR_MESH_HZ, MASS, STIFFNESS, case_text
from dead_zone import TORQUE as TORSIONAL
from scipy.integrate import solve_ivp
from stepped import energy_closes, energy_error, jump, stepped
from trains import stage_train, write
from two_gears import TORQUE, Exact, gears_text, reversal

from flexgear import load_case
from flexgear.analysis.recovery import Recovery
from flexgear.analysis.start import start_state
from flexgear.analysis.transient import Drive
from flexgear.coupling.build import build_system
from flexgear.coupling.modal import modal_system
from flexgear.model.errors import InputError

RATIO, SPEED = 60 / 30, 10 * np.pi / 30


def gears(folder, more=None, **keys):
    return load_case(write(folder, gears_text(**{"damping": 0, **keys})), overrides=more or {})


def always(folder, damping=0.1, law="always", **keys):
    """Two gears whose teeth are damped."""
    more = {"stages.0.gear_mesh.damping_law": f'"{law}"'}
    return modal_system(build_system(gears(folder, more, damping=damping, **keys)))


def integrated(modal, force, damping, torque, times):
    """Displacements (t, d) of M q̈ + C q̇ + K q = f − Vᵀ F(δ, δ̇) from equilibrium on."""
    s, exact = modal.system, Exact(modal, torque)
    d, solve, teeth = len(s.mass), np.linalg.inv(s.mass), len(s.gear_meshes)
    brake, output = s.machines[-1].rated_torque / s.machines[-1].rated_speed, s.ports[-1].row
    state = start_state(modal, TORQUE)
    start = np.r_[modal.modes @ state.eta, modal.modes @ state.velocity]

    def slope(_, y):
        q, v = y[:d], y[d:]
        f = s.ports[0].row * torque - output * brake * (output @ v)
        closing, rate = exact.approach(y)
        f = f - exact.rows[:teeth].T @ force(closing[:teeth], rate[:teeth])
        f = f - s.stiffness @ q - damping @ v
        return np.r_[v, solve @ f]

    options = {"t_eval": times, "rtol": 1e-9, "atol": 1e-14, "max_step": 2e-6}
    return solve_ivp(slope, (0, times[-1]), start, **options).y[:d].T


@pytest.mark.parametrize("law", ["always", "in-contact"])
def test_teeth_that_part_fly_free_or_are_damped(tmp_path, law):
    """Torque that reverses throws the flanks apart, on the coast flanks and back: an oscillator
    with clearance whose one constant damper 2 ζ √(m k) acts always, or those of flanks that touch.
    Beside an integrator that knows no steps and no modes."""
    modal = always(tmp_path, law=law, backlash=5)
    exact, carries = Exact(modal, -TORQUE), modal.system.pairs.carries == 1
    inertias = np.diag(modal.system.mass)[[2, 5]]
    teeth = modal.system.pairs.k_table.max()
    mass = 1 / (exact.rows[0][[2, 5]] ** 2 / inertias).sum()

    def force(delta, rate):
        elastic = teeth * np.maximum(delta, 0.0)
        if law == "always":
            return elastic + np.where(carries, 2 * 0.1 * np.sqrt(mass * teeth) * rate, 0.0)
        damped = np.clip(elastic + exact.c * rate, 0.0, 2 * elastic)
        return np.where(delta > 0, damped, 0.0)

    times = np.arange(1, 151) * 2e-5
    expected = integrated(modal, force, 0.0 * modal.system.mass, -TORQUE, times) @ exact.rows.T
    run = stepped(modal, reversal(-TORQUE, 0.0), times[-1], 1e-6, 2e-5, track_energy=True)
    closing = run.eta @ modal.modes.T @ exact.rows.T
    assert (closing[:, carries] - exact.gap[carries]).min() < -1e-6  # they part
    assert np.abs(closing - expected).max() < 3e-4 * np.abs(expected).max()
    assert energy_error(run) < 1e-4


def test_both_laws_agree_until_teeth_part(tmp_path):
    """In contact with constant stiffness both have the same damper; apart they have not: where
    flanks meet again, the one that flew free is faster, and hits harder."""
    modal = {law: always(tmp_path, law=law, backlash=40) for law in ("always", "in-contact")}
    light = {law: stepped(m, reversal(0.8 * TORQUE, 0.0), 4e-3, 2e-6) for law, m in modal.items()}
    loads = [run.pair_load.sum(axis=(1, 2)) for run in light.values()]
    assert loads[0].min() > 0
    assert loads[0] == pytest.approx(loads[1], rel=1e-9)
    runs = {law: stepped(m, reversal(-TORQUE, 0.0), 4e-3, 2e-6) for law, m in modal.items()}
    hardest = {law: run.pair_load.max() for law, run in runs.items()}
    assert hardest["in-contact"] > 1.05 * hardest["always"]
    assert runs["always"].pair_load.min() < 0  # flanks that leave each other are held back
    assert runs["in-contact"].pair_load.min() >= 0


@pytest.mark.parametrize("model", ["per_pair", "lumped", "rectangular", "face_load"])
def test_energy_closes_where_pairs_are_always_damped(tmp_path, model):
    """Under every model of the gear mesh, with pairs that come, part, and come back."""
    modal, drive = always(tmp_path, model=model, speed=300), reversal(-TORQUE, 0.0)
    run = energy_closes(modal, drive, 4e-3, (8e-6, 2e-6), most=1e-5, share=0.25)
    assert run.energy["pair_damping_work"][-1] > 0


def test_dampers_take_the_rate_of_errors(tmp_path):
    """m δ̈ + c δ̇ + k δ = F₀ + m ë, as published oscillators are driven by an error e = A sin ωt:
    |δ₁| = m ω² A/|k − m ω² + iωc| of transients, steady states and linear solutions; dampers take
    ½ c ω² |δ₁|²."""
    ratio, omega = 0.2, 2 * np.pi * GEAR_MESH_HZ
    damper, text = (
        2 * ratio * np.sqrt(MASS * STIFFNESS),
        case_text(ratio, share=0.0, error=ERROR / 2),
    )
    closing = MASS * omega**2 * ERROR / 2 / abs(STIFFNESS - MASS * omega**2 + 1j * omega * damper)
    force = abs(STIFFNESS + 1j * omega * damper) * closing

    model = load_case(write(tmp_path, text)).assemble()
    steady = model.response((0.8, 1.0), harmonics=3).isel(point=-1)
    assert float(steady["response_gear_mesh_force_amplitude"][0, 0]) == pytest.approx(
        force, rel=1e-6
    )
    linear = model.linear_response((0.8, 1.0), count=2, orders=1)
    assert float(linear["linear_force_amplitude"][-1, 0, 0]) == pytest.approx(force, rel=1e-6)

    period, drive = 1 / GEAR_MESH_HZ, Drive(lambda t: np.full(len(t), TORSIONAL))
    run = stepped(model.modal, drive, 40 * period, period / 400, period / 40, track_energy=True)
    load = run.pair_load.sum(axis=(1, 2))[-40:]
    assert 2 * abs(np.fft.rfft(load)[1]) / 40 == pytest.approx(force, rel=1e-3)
    lost = run.energy["pair_damping_work"]
    power = (lost[-1] - lost[-401]) / (10 * period)
    assert power == pytest.approx(0.5 * damper * (omega * closing) ** 2, rel=1e-3)
    assert energy_error(run) < 1e-4


DAMPERS = {
    "stages.0.pinion.support.damping.radial_n_s_per_m": "4e4",
    "stages.0.gear.support.damping.radial_n_s_per_m": "1e4",
    "stages.0.gear.support.damping.torsion_nm_s_per_rad": "20",
    "output.damping_nm_s_per_rad": "3",
}


def test_dampers_of_supports_and_ports_are_c_times_rate(tmp_path):
    case = gears(tmp_path, DAMPERS, law="linear")
    modal = modal_system(build_system(case))
    exact, size = Exact(modal, 0.5 * TORQUE), len(modal.system.mass)
    order = [body.name.part for body in modal.system.bodies]
    damping = np.zeros((size, size))
    of = {"pinion": (4e4, 4e4, 3.0), "gear": (1e4, 1e4, 20.0)}
    damping[np.diag_indices(size)] = [c for part in order for c in of[part]]
    teeth = modal.system.pairs.k_table.max()
    times = np.arange(1, 101) * 2e-5
    expected = integrated(modal, lambda x, v: teeth * x, damping, 0.5 * TORQUE, times)
    run = stepped(modal, reversal(0.5 * TORQUE, 0.0), times[-1], 1e-6, 2e-5, track_energy=True)
    moved = run.eta @ modal.modes.T
    for rows in (exact.rows[:1], np.eye(size)[[0, 3]]):
        off, largest = np.abs((moved - expected) @ rows.T).max(), np.abs(expected @ rows.T).max()
        assert off < 1e-4 * largest
    assert energy_error(run) < 1e-6


def test_a_joint_that_winds_up_and_down_is_damped(tmp_path):
    """Nothing else takes energy: that of its damper is what the account books, and it closes."""
    text = gears_text(law="linear", damping=0)
    first = text[text.index("[[stages]]") : text.index("[damping]")]
    joint = """[[joints]]
first = "stage_1.pinion"
second = "stage_2.gear"
torsion_nm_per_rad = 1e5
damping_nm_s_per_rad = 20
"""
    text = text.replace("[damping]", f"{first}{joint}[damping]")
    head, _, end = text.rpartition('"stage_1.pinion"')
    train = load_case(write(tmp_path, f'{head}"stage_2.pinion"{end}'))
    modal = modal_system(build_system(train))
    torque = modal.system.rated_torque
    drive = jump(torque, 0.5 * torque, 0.0)
    run = stepped(modal, drive, 5e-3, 2e-6, 1e-5, track_energy=True)
    rows = [modal.system.node_rows(name, name)[5] for name in ("stage_1.pinion", "stage_2.gear")]
    ends = Recovery(run).motion(np.array(rows))
    rate = np.gradient(ends[:, 0] - ends[:, 1], run.time)
    taken = np.trapezoid(20 * rate**2, run.time)
    assert run.energy["pair_damping_work"][-1] == pytest.approx(taken, rel=0.01)
    assert energy_error(run) < 1e-6


def test_drag_is_in_the_balance_of_torques(tmp_path):
    """An equilibrium is one of steady running: what dampers take at rated speed the load lacks."""
    drag = 20 * SPEED + RATIO * 3 * RATIO * SPEED
    equilibrium = gears(tmp_path, DAMPERS).assemble().static(angle_deg=[0.0])
    carried = RATIO * abs(float(equilibrium.port_torque.sel(port="stage_1.pinion")[0]))
    assert carried == pytest.approx(TORQUE - drag, rel=1e-9)


def test_first_modes_have_ratios_of_their_own(tmp_path):
    """Those of the train without gear meshes, by rising frequency; all others the common one."""
    train = stage_train(
        tmp_path, **{"damping.ratios": "[0.05, 0.05, 0.1, 0.1]", "damping.ratio": "0.01"}
    )
    modal = modal_system(build_system(train))
    rising = np.argsort(modal.omega, kind="stable")[np.sum(modal.omega == 0) :]
    ratio = modal.damping[rising] / (2 * modal.omega[rising])
    assert ratio == pytest.approx([0.05, 0.05, 0.1, 0.1, *[0.01] * (len(rising) - 4)])


def test_modes_of_one_frequency_have_one_ratio(tmp_path):
    """Motions of one gear along x and y are alike, and so is any direction between them."""
    message = "damping.ratios: damps two modes of .* Hz, numbers 1 and 2"
    with pytest.raises(InputError, match=message):
        gears(tmp_path, {"damping.ratios": "[0.05, 0.1]"}).assemble().transient(duration=1e-3)


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"damping.ratios": "[0.05, 2]"}, "damping.ratios: are outside 0"),
        ({"damping.ratios": "[0.05]", "damping.kind": '"rayleigh"'}, "damping.ratios"),
        ({"stages.0.gear_mesh.damping_law": '"sometimes"'}, "damping_law"),
        ({"output.damping_nm_s_per_rad": "-1"}, "output.damping_nm_s_per_rad"),
    ],
)
def test_impossible_damping_is_one_line(tmp_path, keys, message):
    with pytest.raises(InputError, match=message):
        gears(tmp_path, keys)
