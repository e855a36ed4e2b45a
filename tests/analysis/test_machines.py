"""Machines at the ports: closed forms, limits, energy, reversal of time."""

from copy import deepcopy
from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm
from stepped import Jumping, jump, stepped
from trains import write
from two_gears import TORQUE, Exact, gears_text, two_gears

from flexgear.analysis.kernels.energy import LEFT_OVER
from flexgear.analysis.start import start_state
from flexgear.analysis.step_space import consistent_acceleration, step_data, work_space
from flexgear.analysis.transient import prescribed_values
from flexgear.coupling.build import build_system
from flexgear.coupling.machines import Brake, Controller, GivenSpeed, GivenTorque
from flexgear.coupling.modal import modal_system
from flexgear.coupling.system import Damping
from flexgear.model.load import load_case

INPUT, OUTPUT = 0, 1


@pytest.fixture(scope="module")
def gears(tmp_path_factory):
    """Teeth of constant stiffness that also pull."""
    return two_gears(tmp_path_factory.mktemp("gears"), law="linear")


def with_ends(modal, first, last, **changes):
    return replace(modal, system=modal.system.with_(machines=(first, last), **changes))


def one_end(modal, port, machine, **changes):
    """That machine at one port, a torque at the other."""
    ends = [GivenTorque(), GivenTorque()]
    ends[port] = machine
    return with_ends(modal, *ends, **changes)


def port_drive(*columns, jumps=(), rates=None):
    """A drive of one number or function of time for each port."""

    def table(of):
        return lambda t: np.column_stack([f(t) if callable(f) else np.full(len(t), f) for f in of])

    return Jumping(table(columns), None if rates is None else table(rates), jumps=jumps)


def rated(modal, port):
    """Torques of the ports at rated load with the speed of one of them in its place, and that."""
    speed = float(modal.system.ports[port].row @ modal.system.rolling[:, 0])
    out = list(modal.system.rated_port_torques)
    out[port] = speed * modal.system.rated_input_speeds[0]
    return out


def inertia(modal, port):
    """Of the whole train, referred to a port."""
    rolling = modal.system.rolling[:, 0]
    return rolling @ modal.system.mass @ rolling / (modal.system.ports[port].row @ rolling) ** 2


def left_over(run):
    """Energy that appears from nowhere, over the largest elastic energy."""
    total = sum(LEFT_OVER[name] * values for name, values in run.energy.items())
    return np.abs(total - total[0]).max() / np.abs(run.energy["elastic"]).max()


@pytest.mark.parametrize("port", [INPUT, OUTPUT])
def test_second_order_under_a_controller(gears, port):
    """Against the exponential of the whole elastic train with its controller."""
    j, omega = inertia(gears, port), 2000.0
    controller = Controller(omega * j, omega**2 * j)
    modal, other = one_end(gears, port, controller), 1 - port
    ends = rated(modal, port)
    start = start_state(modal, np.array(ends))
    low = ends[other] * 0.5
    end = 2e-3
    s, d, exact = modal.system, modal.system.size, Exact(modal, 0.0)
    rows, at = s.port_rows, s.port_rows[port]
    inverse = np.linalg.inv(s.mass)
    state = np.zeros((2 * d + 2, 2 * d + 2))  # q, v, I, 1
    state[:d, d : 2 * d] = np.eye(d)
    state[d : 2 * d, :d] = -inverse @ (s.stiffness + (exact.rows.T * exact.k) @ exact.rows)
    damping = (exact.rows.T * exact.c) @ exact.rows + controller.proportional * np.outer(at, at)
    state[d : 2 * d, d : 2 * d] = -inverse @ damping
    state[d : 2 * d, 2 * d] = inverse @ at
    force = at * controller.proportional * ends[port] + rows[other] * low
    state[d : 2 * d, -1] = inverse @ (force + (exact.rows.T * exact.k) @ exact.gap)
    state[2 * d, d : 2 * d] = -controller.integral * at
    state[2 * d, -1] = controller.integral * ends[port]
    first = [modal.modes @ start.eta, modal.modes @ start.velocity]
    y = np.concatenate([*first, [start.ports["integral"][port], 1.0]])
    expected = (expm(state * end) @ y)[d : 2 * d]
    ends[other] = lambda t: np.where(t > 0, low, 2 * low)

    def error(step):
        run = deepcopy(start)
        stepped(modal, port_drive(*ends, jumps=(0.0,)), end, step, interval=end, start=run)
        return np.linalg.norm(modal.modes @ run.velocity - expected)

    errors = [error(h) for h in (4e-6, 2e-6, 1e-6)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(np.abs(orders - 2) < 0.1), (errors, orders)


@pytest.mark.parametrize("port", [INPUT, OUTPUT])
def test_a_ramp_of_speed_takes_the_torque_that_turns_all_inertia(gears, port):
    modal = one_end(gears, port, GivenSpeed(), damping=Damping(ratio=0.5))
    modal = replace(modal, damping=modal.system.damping.rate(modal.omega))
    ends, steep = rated(modal, port), 40.0 if port == INPUT else -80.0
    first, load = ends[port], modal.system.rated_port_torques[port]
    ends[port] = lambda t: first + steep * np.clip(t - 0.01, 0, 0.02)
    rate = [0.0, 0.0]
    rate[port] = lambda t: np.where((t > 0.01) & (t < 0.03), steep, 0.0)
    drive = port_drive(*ends, jumps=(0.01, 0.03), rates=rate)
    run = stepped(modal, drive, 0.05, 1e-5, track_energy=True)
    assert np.abs(run.speeds[:, port] - ends[port](run.time)).max() < 1e-12 * abs(first)
    expected = inertia(modal, port) * steep
    late = (run.time > 0.029) & (run.time < 0.02999)
    assert np.abs(run.torques[late, port] - load - expected).max() < 1e-8 * abs(expected)
    assert np.abs(run.torques[run.time > 0.049, port] - load).max() < 1e-8 * abs(load)
    assert left_over(run) < 1e-9


def free_run(folder, **options):
    """A run under a torque against the brake, through teeth that come and go; every step of it."""
    modal = two_gears(folder, model="per_pair", speed=200, **options)
    drive = port_drive(lambda t: TORQUE * (1 + 0.3 * np.sin(300 * t)), 0.0,
                 rates=(lambda t: 90 * TORQUE * np.cos(300 * t), 0.0))  # fmt: skip
    return modal, stepped(modal, drive, 0.02, 2e-5)


def test_a_speed_as_found_in_a_free_run_takes_the_torque_of_that_run(tmp_path):
    modal, free = free_run(tmp_path)
    start = start_state(modal, np.array([TORQUE, 0.0]))
    data, space = step_data(modal, 2e-5), work_space(modal)
    assert consistent_acceleration(modal, data, start, np.array([TORQUE, 0.0]), space) == 0
    port = modal.channel_modes[-2]
    times = np.concatenate([[0.0], free.time])
    speeds = np.concatenate([[port @ start.velocity], free.speeds[:, 0]])
    held = with_ends(modal, GivenSpeed(), modal.system.machines[-1])
    first, slope = float(port @ start.acceleration), np.diff(speeds) / np.diff(times)

    def rate(t):
        return np.where(t < times[1], first, slope[np.searchsorted(times, t) - 1])

    drive = port_drive(lambda t: np.interp(t, times, speeds), 0.0, rates=(rate, 0.0))
    run = stepped(held, drive, 0.02, 2e-5)
    assert np.abs(run.torques - free.torques).max() < 1e-6 * TORQUE
    assert np.abs(run.pair_load - free.pair_load).max() < 1e-6 * free.pair_load.max()


def test_a_run_goes_on_from_its_state(gears):
    """What a controller carries on is in the state: two halves are the whole."""
    j, omega = inertia(gears, INPUT), 300.0
    modal = one_end(gears, INPUT, Controller(omega * j, omega**2 * j))
    speed, load = rated(gears, INPUT)
    drive = port_drive(1.2 * speed, load)
    states = [start_state(modal, np.array([speed, load])) for _ in range(2)]
    stepped(modal, drive, 0.01, 2e-5, start=states[0])
    for _ in range(2):
        stepped(modal, drive, 0.005, 2e-5, start=states[1])
    whole, halves = states
    assert whole.ports["integral"][INPUT] != pytest.approx(TORQUE, rel=1e-3)
    assert halves.ports["integral"] == pytest.approx(whole.ports["integral"], rel=1e-9)
    assert np.abs(halves.velocity - whole.velocity).max() < 1e-9 * np.abs(whole.velocity).max()


def test_energy_closes_under_controllers_and_given_speeds(gears):
    j, omega = inertia(gears, INPUT), 300.0
    brake = gears.system.machines[-1]
    speed = float(gears.system.rated_input_speeds[0])
    controlled = with_ends(gears, Controller(omega * j, omega**2 * j), brake)
    drive = port_drive(lambda t: np.where(t > 0.005, 1.2, 1.0) * speed, 0.0, jumps=(0.005,))
    assert left_over(stepped(controlled, drive, 0.05, 2e-5, track_energy=True)) < 1e-9
    held = with_ends(gears, GivenSpeed(), brake)
    drive = port_drive(lambda t: speed * (1 + np.sin(100 * t)), 0.0,
                 rates=(lambda t: 100 * speed * np.cos(100 * t), 0.0))  # fmt: skip
    run = stepped(held, drive, 0.05, 2e-5, track_energy=True)
    assert left_over(run) < 1e-9
    work = np.trapezoid(run.torques * run.speeds, run.time, axis=0)
    done = run.energy["input_work"], -run.energy["brake_work"]
    for a, b in zip(work, done, strict=True):
        assert a == pytest.approx(b[-1] - b[0], rel=1e-3)


def test_a_controller_at_its_limit_does_not_wind_up(gears):
    """The integral stands while torque is at its limit; the speed then comes without overshoot."""
    j, omega = inertia(gears, INPUT), 20.0
    speed, _ = rated(gears, INPUT)
    most = 1.2 * TORQUE
    drive = port_drive(lambda t: np.where(t > 0, 200.0, 1.0) * speed,
                 gears.system.rated_port_torques[1], jumps=(0.0,))  # fmt: skip
    runs = {}
    for name, limits in (("limited", (-most, most)), ("free", ())):
        modal = one_end(gears, INPUT, Controller(2 * omega * j, omega**2 * j, *limits))
        state = start_state(modal, prescribed_values(modal, drive, np.zeros(1))[0])
        first = state.ports["integral"][INPUT]
        runs[name] = stepped(modal, drive, 1.0, 5e-5, interval=1e-3, start=state)
    limited, over = runs["limited"], runs["free"]
    assert first == pytest.approx(TORQUE, rel=1e-9)
    assert limited.torques[:, INPUT].max() == most
    assert over.torques[:, INPUT].max() > most
    assert limited.speeds[-1, INPUT] == pytest.approx(200 * speed, rel=1e-3)
    late = limited.torques[:, INPUT] < most
    assert late.any()
    assert limited.speeds[:, INPUT].max() < over.speeds[:, INPUT].max()


@pytest.mark.parametrize(
    "ends",
    [
        lambda b, t, w: ((GivenTorque(), b), (t[0], 0.0)),
        lambda b, t, w: ((GivenSpeed(), b), (w[0], 0.0)),
        lambda b, t, w: ((Controller(5.0, 20.0), b), (w[0], 0.0)),
        lambda b, t, w: ((GivenTorque(), GivenSpeed()), (t[0], w[1])),
        lambda b, t, w: ((GivenSpeed(), GivenTorque()), (w[0], t[1])),
        lambda b, t, w: ((GivenTorque(), Controller(5.0, 20.0)), (t[0], w[1])),
        lambda b, t, w: ((GivenSpeed(), Brake(b.rated_torque, b.rated_speed, 2.0)), (w[0], 0.0)),
    ],
)
@pytest.mark.parametrize("share", [1.0, 0.6])
def test_runs_begin_stationary(gears, ends, share):
    """Torques balance at the speed that machines want, so nothing changes."""
    system = gears.system
    rows = system.port_rows @ system.rolling[:, 0]
    speeds = share * rows * system.rated_input_speeds[0]
    machines, values = ends(system.machines[-1], share * system.rated_port_torques, speeds)
    modal = with_ends(gears, *machines)
    run = stepped(modal, port_drive(*values), 0.01, 1e-4)
    assert np.abs(np.ptp(run.speeds, axis=0) / speeds).max() < 1e-9
    assert np.abs(np.ptp(run.torques, axis=0) / system.rated_port_torques).max() < 1e-9
    assert np.abs(run.torques @ rows).max() < 1e-9 * TORQUE


@pytest.mark.parametrize("drag", [0.5, 1.0, 4.0])
def test_a_run_with_drag_begins_at_the_speed_at_which_torques_balance(tmp_path, drag):
    """By hand T = (c ω_r + T) ω/ω_r: 1/(1 + drag) of rated speed; drag: c ω_r/T."""
    damping = drag * TORQUE / (10 * np.pi / 30)
    text = gears_text().replace("[output]", f"damping_nm_s_per_rad = {damping}\n[output]")
    modal = modal_system(build_system(load_case(write(tmp_path, text))))
    system, row = modal.system, modal.system.ports[INPUT].row
    speed = row @ modal.modes @ start_state(modal, TORQUE).velocity
    rated_speed = row @ system.rolling[:, 0] * system.rated_input_speeds[0]
    assert speed / rated_speed == pytest.approx(1 / (1 + drag), rel=1e-9)


def test_a_constant_brake_takes_nothing_at_rest(gears):
    """A run from zero speed begins without load: the torque fades there, so that it drives none."""
    brake = replace(gears.system.machines[-1], exponent=0.0)
    run = stepped(with_ends(gears, GivenSpeed(), brake), port_drive(0.0, 0.0), 0.01, 1e-4)
    assert np.abs(run.torques).max() < 1e-9 * TORQUE
    assert not run.speeds.any()


def test_a_constant_brake_holds_the_gear_that_it_has_stopped(tmp_path):
    """Between impacts of the pinion, which then turns freely in its clearance, the torque fades: a
    step that passes zero speed does not reverse it."""
    modal = two_gears(tmp_path, model="per_pair", speed=200, backlash=1000)
    brake = replace(modal.system.machines[-1], exponent=0.0)
    run = stepped(with_ends(modal, GivenTorque(), brake), jump(TORQUE, 0.0, 0.002), 0.06, 1e-5)
    untouched = ~run.pair_load.any(axis=(1, 2)) & (run.time > 0.03)
    assert untouched.mean() > 0.3
    assert np.median(np.abs(run.torques[untouched, OUTPUT])) < 1e-9 * TORQUE
    assert np.abs(run.speeds[untouched, OUTPUT]).min() < 1e-308
    assert not run.speeds[:, OUTPUT].max() > 1.0
