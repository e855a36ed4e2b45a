"""Steady states of an oscillator with clearance against its equation of motion in time."""

import math

import numpy as np
import pytest
from dead_zone import GEAR_MESH_HZ, MASS, STIFFNESS, DeadZone, case_text
from scipy.optimize import fsolve

import flexgear
from flexgear.analysis import continuation, harmonic_balance, stability
from flexgear.analysis.continuation import curves
from flexgear.analysis.harmonic_balance import Balance, Factors, converge
from flexgear.analysis.orbit import orbit_elements
from flexgear.analysis.orbit_receptance import OperatingPoint, Range, condensed_train
from flexgear.analysis.stability import (
    VibrationMatrices,
    fewer_steps,
    monodromy,
    multipliers,
    vibration_matrices,
    without_following_modes,
)
from flexgear.solve.turning_points import turning_points

HARMONICS, DAMPING, LOW, HIGH = 20, 0.05, 0.4, 1.2


def trained(modal, harmonics, each=64):
    return condensed_train(orbit_elements(modal, 0, each * harmonics, True), harmonics)


@pytest.fixture(scope="module")
def modal(tmp_path_factory):
    path = tmp_path_factory.mktemp("dead-zone") / "dead-zone.toml"
    path.write_text(case_text(damping=DAMPING))
    return flexgear.load_case(path).assemble().modal


@pytest.fixture(scope="module")
def train(modal):
    return trained(modal, HARMONICS)


@pytest.fixture(scope="module")
def curve(train):
    (only,) = curves(train, Range("speed", LOW, HIGH))
    assert not only.cuts
    return only.states


@pytest.fixture(scope="module")
def radius(train, curve):
    """Largest modulus of the multipliers of every state."""
    return np.array([largest(train, orbit) for orbit in curve])


def largest(train, orbit):
    period = 1.0 / (GEAR_MESH_HZ * orbit.point.speed)
    tangents = train.elements.tangents_around(*orbit.waves, period)
    steps = fewer_steps(tangents, 16 * train.harmonics)
    return float(
        np.abs(multipliers(monodromy(vibration_matrices(train, orbit.point), period, steps))[0])
    )


def closing(train, orbit):
    """x and ẋ over the period (N,), m and m/s."""
    m = int(np.flatnonzero(train.modal.system.pairs.carries)[0])
    row = train.elements.mean_row(m)
    return orbit.waves.motion @ row, orbit.waves.rate @ row


def oscillator(train):
    """The same in time; where its wave of stiffness begins follows from the case's samples."""
    wave = train.elements.nominal[0].sum(axis=1)
    return DeadZone(DAMPING, first=float(np.angle(np.fft.fft(wave)[1])))


def in_time(train, orbit, periods=1):
    """x over a period by the equation of motion from a state of harmonic balance, both (N,)."""
    x, v = closing(train, orbit)
    omega = 2 * math.pi * GEAR_MESH_HZ * orbit.point.speed
    stepped, end = oscillator(train).settled(omega, np.array([x[0], v[0]]), periods, len(x))
    return x, stepped, end


def stable_at(curve, radius, speed, upper):
    """The stable state nearest to a speed, of larger or smaller motion."""
    size = np.array([np.abs(orbit.unknown).max() for orbit in curve])
    far = np.array([abs(orbit.point.speed - speed) for orbit in curve])
    near = [k for k in np.flatnonzero(radius < 1.0) if far[k] < 0.02]
    most = max if upper else min
    return curve[most(near, key=lambda k: size[k])]


@pytest.mark.parametrize(
    ("speed", "upper"), [(0.55, False), (0.7, False), (0.65, True), (1.0, True)]
)
def test_displacements_agree_with_the_motion_in_time(modal, train, curve, radius, speed, upper):
    """1e-4 of the range of x with as many harmonics as doubling shows to suffice."""
    coarse = stable_at(curve, radius, speed, upper)
    finer = trained(modal, 2 * HARMONICS)
    balance = Balance(finer.elements, finer.at(coarse.point))
    start = np.zeros(balance.size)
    start[: len(coarse.unknown) - 1], start[-1] = coarse.unknown[:-1], coarse.unknown[-1]
    fine = converge(balance, coarse.point, start)
    x, stepped, _ = in_time(finer, fine, 30)
    before, after = closing(train, coarse)[0], closing(finer, fine)[0]
    assert np.abs(after[::2] - before).max() < 4e-4 * np.ptp(x)
    np.testing.assert_allclose(x, stepped, rtol=0, atol=1e-4 * np.ptp(x))


def fold_in_time(train, orbit):
    """The state at a turning point by shooting, from a state beside it: P(y) = y and
    det(∂P/∂y − 1) = 0 for the motion P over a period, unknown y = (x, ẋ/ω) and speed; the speed and
    the largest force over the mean one."""
    moving, (x, v) = oscillator(train), closing(train, orbit)
    size, hertz = np.ptp(x), 2 * math.pi * GEAR_MESH_HZ
    start = np.array([x[0], v[0] / (hertz * orbit.point.speed), size * orbit.point.speed]) / size

    def after(y, speed):
        state = size * np.array([y[0], hertz * speed * y[1]])
        x, v = moving.settled(hertz * speed, state, 1, 4)[1]
        return np.array([x, v / (hertz * speed)]) / size

    def unbalanced(z):
        end = after(z[:2], z[2])
        change = [after(z[:2] + 1e-5 * d, z[2]) - after(z[:2] - 1e-5 * d, z[2]) for d in np.eye(2)]
        return np.r_[end - z[:2], np.linalg.det(np.array(change).T / 2e-5 - np.eye(2))]

    at = fsolve(unbalanced, start, xtol=1e-7, epsfcn=1e-8)
    moving.omega = hertz * at[2]
    period, largest = 2 * math.pi / moving.omega, 0.0
    times = period * np.arange(2000) / 2000
    state = size * np.array([at[0], moving.omega * at[1]])
    for states, inside, motion, _ in moving.pieces(state, times, period):
        forces = [moving.loads(times[k], y, states)[0] for k, y in zip(inside, motion, strict=True)]
        largest = max([largest, *forces])
    return at[2], largest / moving.force


def test_sweeps_jump_where_curves_turn_back(train, curve, radius):
    """Slow sweeps in time leave their branch within 0.5 % of the turning points; speed and largest
    force there are those of shooting, though the force changes by 1 % within 1e-4 of speed."""
    speed = np.array([orbit.point.speed for orbit in curve])
    arrays = {
        "stable": (radius <= 1.0 + 1e-5).astype(int),
        "response_gear_mesh_force": np.array([[[o.force.sum(axis=1).max()]] for o in curve]),
        "multiplier_real": radius,
        "multiplier_imag": 0.0 * radius,
    }
    turning = turning_points(speed, np.ones(len(speed)), arrays)
    assert turning["turning_point_sense"].tolist() == [1, -1]
    forces = zip(turning["turning_point_parameter"], turning["turning_point_force"], strict=True)
    for at, force in forces:
        expected = fold_in_time(train, curve[int(np.argmin(np.abs(speed - at)))])
        assert at == pytest.approx(expected[0], rel=2e-4)
        assert force / oscillator(train).force == pytest.approx(expected[1], rel=2e-3)
    for at, upper in zip(turning["turning_point_parameter"], (False, True), strict=True):
        towards = -1.0 if upper else 1.0
        begin = stable_at(curve, radius, at * (1 - 0.03 * towards), upper)
        _, first, state = in_time(train, begin)
        sizes = []
        for share in np.r_[np.linspace(-0.02, -0.005, 7), 0.005]:
            omega = 2 * math.pi * GEAR_MESH_HZ * at * (1 + towards * share)
            x, state = oscillator(train).settled(omega, state, 25, 64)
            sizes.append(np.ptp(x))
        x, _ = oscillator(train).settled(omega, state, 60, 64)
        sizes.append(np.ptp(x))
        steady = np.array(sizes[:-2]) / np.ptp(first)
        assert steady.min() > 0.7 and steady.max() < 1.4
        factor = sizes[-1] / sizes[-3]
        assert factor < 0.5 if upper else factor > 1.8


def test_growth_in_time_is_that_of_the_largest_multiplier(train, curve, radius):
    """On ten states along the curve, unstable ones and next to turning points among them."""
    speed = np.array([orbit.point.speed for orbit in curve])
    turns = np.flatnonzero(np.diff(np.sign(np.diff(speed)))) + 1
    at = {*np.linspace(3, len(curve) - 4, 6).astype(int), *(turns - 3), *(turns + 3)}
    assert len(at) >= 9
    assert min(radius[list(at)]) < 0.95 and max(radius[list(at)]) > 1.5
    away = []
    for k in sorted(at):
        orbit = curve[k]
        x, v = closing(train, orbit)
        omega = 2 * math.pi * GEAR_MESH_HZ * orbit.point.speed
        periods = 1 if radius[k] > 1.0 else 6
        start, size = np.array([x[0], v[0]]), np.array([1.0, omega])
        ends = []
        for j in range(2):  # columns of the monodromy matrix by differences in time
            moved = start + 1e-6 * np.ptp(x) * size * np.eye(2)[j]
            pair = [oscillator(train).settled(omega, y, periods, 4)[1] for y in (start, moved)]
            ends.append((pair[1] - pair[0]) / size / (1e-6 * np.ptp(x)))
        growth = np.abs(np.linalg.eigvals(np.array(ends).T)).max() ** (1 / periods)
        away.append(abs(growth / radius[k] - 1.0))
        assert (growth > 1.0) == (radius[k] > 1.0)
    # next to the lower turning point the share of contact is known by whole samples only
    assert np.median(away) < 5e-3
    assert max(away) < 0.1


def test_a_range_within_a_hysteresis_is_entered_from_the_far_ends_of_the_resonance(
    train, curve, monkeypatch
):
    """From there alone all three states of a narrow range are met: the one above joins the others
    beyond the resonance only."""
    monkeypatch.setattr(continuation, "SEEDS", ())
    speed = np.array([orbit.point.speed for orbit in curve])
    turns = np.flatnonzero(np.diff(np.sign(np.diff(speed)))) + 1
    middle = float(speed[turns].mean())
    resonance = math.sqrt(STIFFNESS / MASS) / (2 * math.pi * GEAR_MESH_HZ)
    span = Range("speed", middle - 2e-3, middle + 2e-3)
    sizes = [norm(c.states[0]) for c in curves(train, span, resonance=resonance)]
    crossed = np.flatnonzero(np.diff(np.sign(speed - span.low)))
    assert sorted(sizes) == pytest.approx(sorted(norm(curve[k]) for k in crossed), rel=0.02)


def norm(orbit):
    return float(np.linalg.norm(orbit.unknown))


def test_multipliers_do_not_depend_on_where_samples_lie(modal, train, curve):
    """Contact begins and ends between samples: a quarter as many give the same multiplier."""
    coarse = trained(modal, HARMONICS, 16)
    unstable = [o for o in curve[::4] if (o.force.sum(axis=1) == 0.0).any()]
    unstable = [o for o in unstable if o.point.speed < 0.76 and largest(train, o) > 1.5]
    compared = 0
    for orbit in unstable:
        balance = Balance(coarse.elements, coarse.at(orbit.point))
        same = converge(balance, orbit.point, orbit.unknown)
        sizes = [float(np.ptp(o.force.sum(axis=1))) for o in (same, orbit)]
        if sizes[0] == pytest.approx(sizes[1], rel=0.02):  # not another state at this speed
            assert largest(coarse, same) == pytest.approx(largest(train, orbit), rel=0.02)
            compared += 1
    assert compared >= 5


def test_both_ways_through_a_period_give_the_same_monodromy(train, curve, monkeypatch):
    """Matrices of all steps at once, and changes taken from step to step."""
    orbit = curve[len(curve) // 2]
    at = vibration_matrices(train, orbit.point), 1e-3, fewer_steps(orbit.tangents, 320)
    at_once = monodromy(*at)
    monkeypatch.setattr(stability, "MAX_PRODUCT_SIZE", 0)
    np.testing.assert_allclose(monodromy(*at), at_once, rtol=1e-9, atol=1e-12)


def test_modes_that_only_follow_the_contact_do_not_change_the_multiplier():
    """Three stages of 60 modes: half of them hardly move the gear mesh and are flexibility."""
    model = flexgear.load_case("nrel-5mw").assemble()
    at, point = trained(model.modal, 8), OperatingPoint(1.0, 1.0)
    balance = Balance(at.elements, at.at(point))
    orbit = converge(balance, point, balance.start())
    period = 1.0 / at.elements.frequency
    tangents = at.elements.tangents_around(*orbit.waves, period)
    whole = vibration_matrices(at, point)
    fewer = without_following_modes(whole, period, tangents)
    assert len(fewer.stiffness) < 0.6 * len(whole.stiffness)
    first, second = (
        abs(multipliers(monodromy(part, period, tangents))[0]) for part in (whole, fewer)
    )
    assert second == pytest.approx(first, abs=1e-5)
    assert first < 0.99  # some mode of the gear mesh is damped, so the figure is no rigid motion's


@pytest.mark.parametrize(("ratio", "remaining"), [(0.0, 2), (0.01, 1)])
def test_modes_that_may_grow_by_themselves_do_not_only_follow(ratio, remaining):
    """Two levels of stiffness change the frequency of the upper mode by 0.75 % at most. Undamped it
    grows where order 3 of them is twice its frequency."""
    omega, samples = np.array([1.0, 4.0]), 400
    share = 0.015 * 4.0**2
    period = 3 * math.pi / math.sqrt(4.0**2 + 0.5 * share)
    tangents = np.zeros((2, samples, 1, 1, 1))
    tangents[0, : samples // 2] = share
    shapes = np.array([[0.2, 1.0]])
    part = VibrationMatrices(
        np.diag(omega**2), np.diag(2 * ratio * omega), shapes, np.zeros((1, 1)), np.array([[0]])
    )
    fewer = without_following_modes(part, period, tangents)
    assert len(fewer.stiffness) == remaining
    first, second = (abs(multipliers(monodromy(p, period, tangents))[0]) for p in (part, fewer))
    assert (second > 1.0 + 1e-3) == (first > 1.0 + 1e-3) == (ratio == 0.0)


def test_factors_of_earlier_states_give_the_same_curve(train, monkeypatch):
    """GMRES with them, and each Jacobian factored."""
    span = Range("speed", 0.95, 1.0)
    (factored,) = curves(train, span)
    monkeypatch.setattr(harmonic_balance, "MAX_FACTORED", 0)
    (again,) = curves(train, span)
    for a, b in zip(factored.states, again.states, strict=True):
        size = np.abs(a.unknown).max()
        np.testing.assert_allclose(b.unknown, a.unknown, rtol=0, atol=1e-6 * size)


def test_tangents_between_rows_act_on_the_channels_of_their_rows(train, curve):
    elements = train.elements
    _, tangent, _ = elements.row_forces(*curve[-1].waves, omega=1.0)
    dense = np.einsum("jgna,jgnm,jgmb->jgab", elements.rows, tangent[0], elements.rows)
    np.testing.assert_allclose(elements.on_channels(tangent[0]), dense, rtol=1e-12)
    assert dense.any()


def test_losses_over_a_period_stay_as_harmonics_double(modal):
    """By 1e-3; that they are what force and errors put in holds of any Galerkin solution."""
    losses = []
    for harmonics in (HARMONICS, 2 * HARMONICS):
        of = trained(modal, harmonics)
        balance = Balance(of.elements, of.at(OperatingPoint(0.7, 1.0)))
        orbit = converge(balance, OperatingPoint(0.7, 1.0), balance.start())
        rate = of.elements.row_motions(orbit.waves.rate)
        rate += 2 * math.pi * GEAR_MESH_HZ * 0.7 * of.elements.error_slope
        elastic = of.elements.nominal[0] * np.maximum(orbit.displacement, 0.0)
        losses.append(np.sum((orbit.force - elastic) * rate) / len(rate))
    assert losses[0] > 0.0
    assert losses[1] == pytest.approx(losses[0], rel=1e-3)


@pytest.mark.filterwarnings("error")
def test_a_state_whose_teeth_are_all_apart_is_no_warning():
    """Its matrix is singular; a shorter step is tried then."""
    assert not np.isfinite(Factors(np.zeros((2, 2))).solve(np.ones(2))).all()


@pytest.mark.parametrize("beside", [0.9, 1.1])
def test_a_range_without_a_first_state_is_entered_from_beside(train, curve, monkeypatch, beside):
    """Newton's method fails within it, and at the first speed on one of its sides."""
    low, high, plain = 1.15, 1.18, continuation._state
    edge = (low if beside < 1.0 else high) * beside

    def state(train, point):
        return plain(train, point) if point.speed == pytest.approx(edge) else None

    monkeypatch.setattr(continuation, "_state", state)
    (only,) = curves(train, Range("speed", low, high))
    speeds = [orbit.point.speed for orbit in only.states]
    assert min(speeds) == pytest.approx(low) and max(speeds) == pytest.approx(high)
    force = [np.abs(orbit.unknown).max() for orbit in only.states]
    whole = sorted((orbit.point.speed, np.abs(orbit.unknown).max()) for orbit in curve)
    expected = np.interp(speeds, *np.transpose(whole))
    np.testing.assert_allclose(force, expected, rtol=5e-3)
