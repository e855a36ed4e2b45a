"""States that repeat after several gear-mesh periods, against the equation of motion in time."""

import math

import numpy as np
import pytest
from dead_zone import GEAR_MESH_HZ, MASS, SHARE, STIFFNESS, DeadZone, case_text
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import flexgear
from flexgear.cli.vibration_commands import show_response
from flexgear.solve.response_figures import response_figures

DAMPING, SETTLED = 0.05, 200  # periods until what is free has decayed


@pytest.fixture(scope="module")
def pair(tmp_path_factory):
    """A spur pair that vibrates at half of the gear-mesh frequency about twice its own one."""
    path = tmp_path_factory.mktemp("pair") / "pair.toml"
    path.write_text(case_text(damping=DAMPING))
    return flexgear.load_case(path).assemble()


@pytest.fixture(scope="module")
def data(pair):
    return pair.response((1.5, 2.5), harmonics=20, doublings=2)


def in_time(speed, periods):
    """x over some gear-mesh periods (periods, 256) once it is settled, from teeth 5 µm apart."""
    omega, oscillator = 2 * math.pi * GEAR_MESH_HZ * speed, DeadZone(DAMPING, first=0.0)
    _, state = oscillator.settled(omega, np.array([-5e-6, 0.0]), SETTLED, 4)
    out = []
    for _ in range(periods):
        x, state = oscillator.settled(omega, state, 1, 256)
        out.append(x)
    return np.array(out)


def test_the_period_doubles_where_a_multiplier_of_hills_equation_is_minus_one(data):
    """Teeth stay in contact there: m ẍ + c(t) ẋ + k(t) x = 0 over one period of the gear mesh."""

    def beyond(speed):
        w = 2 * math.pi * GEAR_MESH_HZ * speed

        def slope(t, y):
            k = STIFFNESS * (1 + SHARE * math.cos(w * t))
            return [y[1], -(k * y[0] + 2 * DAMPING * math.sqrt(MASS * k) * y[1]) / MASS]

        ends = [solve_ivp(slope, (0, 2 * math.pi / w), y, method="DOP853", rtol=1e-9, atol=1e-12)
                for y in ([1.0, 0.0], [0.0, 1.0])]  # fmt: skip
        return np.linalg.eigvals([end.y[:, -1] for end in ends]).real.min() + 1

    one = data["stability_change_curve"].to_numpy() == 1
    assert (data["stability_change_kind"].to_numpy()[one] == 1).all()
    exact = [brentq(beyond, *ends) for ends in ((2.02, 2.1), (2.1, 2.3))]
    computed = np.sort(data["stability_change_parameter"].to_numpy()[one])
    np.testing.assert_allclose(computed, exact, rtol=1e-4)


@pytest.mark.parametrize("speed", [2.15, 2.05, 1.97])
def test_amplitudes_of_half_orders_are_those_in_time(data, speed):
    near = np.abs(data["response_speed_share"].to_numpy() - speed)
    stable = (data["stable"] == 1).to_numpy() & (data["response_period"] == 2).to_numpy()
    at = data.isel(point=int(np.argmin(np.where(stable, near, np.inf))))
    speed = float(at["response_speed_share"])
    x = in_time(speed, 2)
    spectrum = 2 * np.abs(np.fft.rfft(x.ravel()))[1:5] / x.size
    orders = [0.5, 1.0, 1.5, 2.0]
    error = at["response_transmission_error_amplitude"].sel(gear_mesh_order=orders)
    assert spectrum[0] > 5e-6  # m
    np.testing.assert_allclose(error[0], spectrum, rtol=0, atol=1e-4 * spectrum[0])


@pytest.mark.slow
def test_the_period_doubles_once_more_where_motion_in_time_repeats_after_four(data):
    """On either side of the change of stability of the curve of two periods; the curve of four
    that leaves there comes back to it, and has its motion."""
    of_two = data["stability_change_kind"].to_numpy() == 1
    curves = data["stability_change_curve"].to_numpy()
    period, branch = data["response_period"].to_numpy(), data["response_branch"].to_numpy()
    of_two &= np.array([period[branch == curve][0] == 2 for curve in curves])
    change = data.isel(stability_change=of_two)
    first, last = sorted(change["stability_change_parameter"].to_numpy().tolist())
    (leaving,) = set(change["stability_change_leaving"].to_numpy().tolist())
    assert set(period[branch == leaving]) == {4}
    for speed, repeats in ((1.01 * last, 2), (0.985 * last, 4), (1.04 * first, 4)):
        x = in_time(speed, 8)
        away = [np.abs(x[:2] - x[n : n + 2]).max() / np.ptp(x) for n in (1, 2, 4)]
        assert away[0] > 0.1 and away[2] < 1e-4
        assert (away[1] < 1e-4) == (repeats == 2)
        if repeats == 4:
            share = data["response_speed_share"].to_numpy()
            largest = data["response_transmission_error_amplitude"][:, 0].sel(gear_mesh_order=0.25)
            at = np.flatnonzero((branch == leaving) & (data["stable"].to_numpy() == 1))
            at = at[np.argsort(share[at])]
            quarter = np.interp(speed, share[at], largest[at])
            assert quarter == pytest.approx(2 * abs(np.fft.rfft(x.ravel())[2]) / x.size, rel=2e-2)


def test_ranges_of_stable_states_end_where_stability_changes(data):
    """Not at the nearest computed state."""
    figures = response_figures(data)
    ranges = {row["curve"]: row["stable"] for row in figures["longer_periods"]}
    changes = [row for row in figures["stability_changes"] if row["period"] == 2]
    changes = [row for row in changes if row["kind"] == "doubled period"]
    assert len(changes) >= 2
    for row in changes:
        ends = [end for ends in ranges[row["curve"]] for end in ends]
        assert min(abs(end / row["speed_share"] - 1.0) for end in ends) < 1e-9


def test_where_a_curve_leaves_another_one_the_start_does_not_decide(tmp_path):
    """The curve of two periods begins at 2.235 on that of one, which is stable above it."""
    law = 'damping_law = "always"\ndamping_ratio'
    path = tmp_path / "pair.toml"
    path.write_text(case_text(damping=0.03).replace("damping_ratio", law, 1))
    data = flexgear.load_case(path).assemble().response((2.1, 2.4), harmonics=10)
    figures = response_figures(data)
    ((_, end),) = figures["longer_periods"][0]["stable"]
    (change,) = (row["speed_share"] for row in figures["stability_changes"])
    assert end == pytest.approx(change, rel=5e-4) and figures["several_stable"] == []


def test_a_sweep_jumps_to_the_state_of_one_period(data):
    """From the only turning point of rising speed, above the speeds at which the period doubles."""
    rising = data.isel(turning_point=(data["turning_point_sense"] > 0).to_numpy())
    (at,) = rising["turning_point_parameter"].to_numpy()
    target, *none = rising["turning_point_target_force"].to_numpy()[0]
    assert at > data["stability_change_parameter"].max() - 1e-3 and not np.isfinite(none).any()
    whole = (data["response_period"] == 1).to_numpy()
    force = data["response_gear_mesh_force"].sel(measure="maximum").to_numpy()[whole, 0]
    share = data["response_speed_share"].to_numpy()[whole]
    assert target == pytest.approx(np.interp(at, share, force), rel=1e-3)


def test_a_jump_that_two_curves_share_is_printed_once(pair, data, capsys):
    count = data.sizes["turning_point"]
    twice = data.isel(turning_point=np.repeat(np.arange(count), 2))
    show_response(pair, twice, response_figures(twice))
    jumps = [line for line in capsys.readouterr().out.splitlines() if "jump of a sweep" in line]
    assert 0 < len(jumps) == len(set(jumps)) <= count
