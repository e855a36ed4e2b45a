"""Time stepping: order, agreement with the plain solution, energy, contact, speed."""

import math

import numpy as np
import pytest
from coupled import TORQUE, make_system
from reference_transient import reference_transient
from scipy.integrate import solve_ivp
from stepped import energy_closes, jump, stepped
from trains import spur_pair

import flexgear
from flexgear.analysis.start import start_state
from flexgear.analysis.step_plan import FineWindow, Stepping
from flexgear.analysis.transient import Drive
from flexgear.coupling.modal import modal_system

STEADY = Drive(lambda t: np.full_like(t, TORQUE))


def drop(low, start=0.05, stop=0.25):
    return jump(TORQUE, low, start, stop)


def run(modal, drive, duration, step, interval=1e-3, **options):
    return stepped(modal, drive, duration, step, interval, **options)


def smooth(system):
    """The same gear meshes with pair stiffness that rises and falls without a kink."""
    p = system.pairs
    x = np.linspace(0.0, 1.0, 40001)
    k = np.sin(np.pi * x)[None, :] ** 4 * p.k_table.max()
    length = p.table_step * (p.k_table.shape[1] - 1)
    z = np.zeros_like(k)
    return system.with_(
        pairs=p._replace(
            k_table=np.ascontiguousarray(np.repeat(k, len(p.s0), axis=0)),
            gap_table=np.zeros((len(p.s0), 40001)),
            z_table=np.ascontiguousarray(np.repeat(z, len(p.s0), axis=0)),
            table_step=length / 40000,
        )
    )


def test_second_order_with_linear_contact_ramped_torque_and_smooth_stiffness(linear):
    modal = modal_system(smooth(linear), 600.0)
    ramp = Drive(lambda t: TORQUE * (1 - 0.5 * np.sin(np.pi * np.minimum(t, 0.02) / 0.04) ** 2))

    def end(step):
        r = run(modal, ramp, 0.02, step, interval=0.02)
        return r.eta[-1]

    fine = end(1.5625e-6)
    errors = [np.linalg.norm(end(h) - fine) for h in (1e-4, 5e-5, 2.5e-5, 1.25e-5)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(orders[1:] > 1.85), orders


@pytest.mark.parametrize("law", ["linear", "one-sided"])
def test_fast_step_equals_the_plain_solution_with_all_coordinates(law):
    system = make_system(**{"stage.gear_mesh.contact_law": law})
    modal = modal_system(system)  # every coordinate kept: no residual
    assert modal.dropped == 0
    h, steps = 1e-4, 60
    drive = Drive(lambda t: np.where(t < 0.00305, TORQUE, 0.05 * TORQUE))
    start = start_state(modal, TORQUE)
    q, v = modal.modes @ start.eta, modal.modes @ start.velocity
    slow = reference_transient(system, drive, q, v, time_step=h, steps=steps)
    fast = run(modal, drive, h * steps, h, interval=h, start=start)
    motion = fast.eta @ modal.modes.T
    scale = np.abs(slow.motion[1:] - np.outer(fast.input_angles[:, 0], system.rolling[:, 0])).max()
    assert np.abs(motion - slow.motion[1:]).max() < 1e-6 * scale


def test_energy_closes_over_a_torque_drop_and_improves_with_the_step(one_sided_modal):
    energy_closes(one_sided_modal, drop(4e5), 0.3, (1e-4, 2e-5), most=0.01, share=0.3)


def test_half_torque_follows_the_brake_law_and_settles_as_inertia_over_damping():
    system = make_system(**{"drive.torque_nm": "4e6"})
    modal = modal_system(system, 1000.0)
    inertia = system.rolling[:, 0] @ system.mass @ system.rolling[:, 0]
    ratio = system.ports[-1].row @ system.rolling[:, 0]
    damping = system.machines[-1].rated_torque / system.machines[-1].rated_speed * ratio**2
    tau = inertia / damping
    half = jump(TORQUE, 0.5 * TORQUE, 0.0)
    start = start_state(modal, TORQUE)
    r = run(modal, half, 9 * tau, 2e-4, start=start)
    rated = system.input_speeds[0]
    # speed of the whole train's angular momentum: elastic twist would ride on the pins' speed
    train = np.gradient(r.eta @ modal.rolling[:, 0] / inertia, r.time)
    assert train[-100:].mean() == pytest.approx(0.5 * rated, rel=1e-3)
    late = (r.time > 0.5 * tau) & (r.time < 2.5 * tau)
    slope = np.polyfit(r.time[late], np.log(train[late] / rated - 0.5), 1)[0]
    assert -1 / slope == pytest.approx(tau, rel=0.02)


def test_windows_and_jumps_cut_the_run_into_whole_steps():
    plans = Stepping(1.0, 1e-2, 1e-2, (0.333,), (FineWindow(0.3, 0.5, 1e-3),)).plans()
    assert [p.start + p.ticks * p.sizes[0] for p in plans] == pytest.approx([0.3, 0.333, 0.5, 1.0])
    assert all(p.sizes[0] <= 1e-3 + 1e-15 for p in plans[1:3])


def test_the_case_s_own_drop_is_seen_at_once_after_its_jump():
    from coupled import make_case

    from flexgear.analysis.transient import BESIDE

    drop = make_case().case.drive.drop(4e5, 1.0, 0.2, TORQUE)
    for h in (1e-4, 1e-8):
        start, stop = drop.change_times()
        beside = np.array([start - BESIDE * h, start + BESIDE * h, stop - BESIDE * h])
        assert drop.at(beside, TORQUE) == pytest.approx([TORQUE, 4e5, 4e5])
        assert drop.at(np.array([stop + BESIDE * h]), TORQUE) == pytest.approx([TORQUE])


@pytest.mark.parametrize("exponent", [0, 2])
def test_brake_laws_hold_the_rated_speed_at_rated_torque(exponent):
    modal = modal_system(make_system(**{"output.brake_exponent": str(exponent)}), 1000.0)
    r = run(modal, STEADY, 0.2, 1e-4)
    assert r.input_motion[:, 0, 1].mean() == pytest.approx(modal.system.input_speeds[0], rel=1e-3)
    assert -r.torques[:, -1].mean() == pytest.approx(TORQUE * 27 / 120, rel=2e-3)


def test_backs_touch_as_those_of_an_oscillator_whose_error_opens_them(tmp_path):
    """m ẍ + c δ̇ + k ⟨δ⟩ − k ⟨−δ − b⟩ = F, δ = x + A sin(ωt + ψ), by Runge–Kutta. Where
    the error is material in excess on both flanks, backs are not hit like this."""
    mass, stiffness, damping, amplitude, torque, teeth = 1.0, 4e8, 0.05, 2e-6, 20.0, 30
    omega, backlash = 2 * math.pi * teeth * 4500 / 60, 8e-6
    gear = f'teeth = {teeth}, equivalent_mass_kg = {2 * mass}, kinematics = "torsional"'
    force = torque / (0.5 * teeth * 4e-3 * math.cos(math.radians(20)))
    forces = {}
    for kind in ("opposite", "excess"):
        (tmp_path / "pair.toml").write_text(spur_pair(
            gear, gear, f"""model = "constant"
contact_law = "one-sided"
damping_law = "always"
damping_ratio = {damping}
sun_stiffness_n_per_m = {stiffness}""",
            backlash=1e6 * backlash, speed=4500, torque=torque,
            output='machine = { law = "torque" }', sections=f"""[stages.errors]
sun_gear_mesh_um = {1e6 * amplitude}
harmonic_on_coast = "{kind}"
[damping]
ratio = 0.0""",
        ))  # fmt: skip
        model = flexgear.load_case(tmp_path / "pair.toml").assemble()
        data = model.transient(duration=20 * 2 * math.pi / omega)
        time, forces[kind] = data.time.to_numpy(), data.gear_mesh_force.to_numpy()[:, 0]

    pairs = model.system.pairs
    start = 2 * math.pi * pairs.s0[0] / pairs.pitch[0]

    def closing(t, x):
        return x + amplitude * np.sin(omega * t + start)

    def contact(delta):
        return stiffness * (np.maximum(delta, 0.0) - np.maximum(-delta - backlash, 0.0))

    def damped(t, v):
        return damper * (v + amplitude * omega * np.cos(omega * t + start))

    def slope(t, y):
        return [y[1], (force - contact(closing(t, y[0])) - damped(t, y[1])) / mass]

    damper = 2 * damping * math.sqrt(stiffness * mass)
    steps = {"rtol": 1e-10, "atol": 1e-15, "max_step": 0.01 / omega}
    begin = [force / stiffness - closing(0.0, 0.0), 0.0]
    x, speed = solve_ivp(slope, (0, time[-1]), begin, t_eval=time, **steps).y
    expected = contact(closing(time, x)) + damped(time, speed)
    assert expected.min() < -0.5 * expected.max()
    np.testing.assert_allclose(forces["opposite"], expected, atol=5e-3 * expected.max())
    assert np.abs(forces["excess"] - expected).max() > 0.1 * expected.max()
