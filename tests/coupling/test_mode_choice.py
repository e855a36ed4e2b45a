"""Modes kept for a wanted accuracy: against full matrices, over counts and limits, in a drop."""

import numpy as np
import pytest
from coupled import TORQUE, make_bodies, make_case, make_system
from reference_transient import damping_matrix
from scipy import linalg
from stepped import jump, stepped

from flexgear.analysis.modes import rows_at
from flexgear.analysis.recovery import Recovery
from flexgear.analysis.transient import Drive
from flexgear.coupling.build import build_system
from flexgear.coupling.kernels.elements import row_motions
from flexgear.coupling.modal import chosen_modal, elastic_modes, modal_system
from flexgear.coupling.mode_choice import ModeErrors, choose_modes, mode_estimates
from flexgear.coupling.pace import case_pace
from flexgear.model.errors import FlexgearError, InputError
from flexgear.model.load import load_case

BAND = 500.0  # Hz
W = 2 * np.pi * BAND  # rad/s
OTHER = 0.37  # rad, a position that the estimate does not look at
SHARES = (0.05, 0.55, 0.95, 1.0)  # of the band


@pytest.fixture(scope="module")
def system():
    return make_system(**{"stage.gear_mesh.contact_law": "linear"})


@pytest.fixture(scope="module")
def solved(system):
    return shapes_of(system)


@pytest.fixture(scope="module")
def estimates(system, solved):
    return errors_of(system, *solved)


def shapes_of(system):
    modes = elastic_modes(system)
    return modes.omega, modes.shapes


def errors_of(system, omega, phi, w=W):
    return mode_estimates(system, omega, np.full(len(omega), w), phi)


def contact(system, angle=OTHER):
    """Rows and stiffnesses of all but springs of no stiffness."""
    rows, n = rows_at(system, angle)
    stiff = np.flatnonzero(rows.row["stiffness"][:n])
    return row_motions(rows, n, system.blocks)[stiff], rows.row["stiffness"][stiff]


def closed(system, angle=OTHER):
    """M, C and K with the gear meshes closed."""
    v, k = contact(system, angle)
    return system.mass, damping_matrix(system), system.stiffness + (v.T * k) @ v


def true_flexibility(system, w, angle=OTHER):
    """Row errors per row force, from the answer of the closed train in full matrices: imposed
    errors e make forces F = (k − k G k) e, G = V (K_t − w² M + iwC)⁻¹ Vᵀ."""
    v, k = contact(system, angle)
    mass, damping, stiffness = closed(system, angle)
    g = v @ np.linalg.solve(stiffness - w**2 * mass + 1j * w * damping, v.T)
    return np.linalg.inv(np.diag(k) - k[:, None] * g * k)


def reduced_flexibility(modal, w, angle=OTHER):
    """The same of the reduced system, from its own arrays."""
    rows, n = rows_at(modal.system, angle)
    c = np.zeros((n, len(modal.channels)))
    for i in range(n):
        for a in range(rows.row["width"][i]):
            at = 6 * rows.blocks[i, a]
            c[i, at : at + 6] += rows.coef[i, a]
    stiff = np.flatnonzero(rows.row["stiffness"][:n])
    c, k = c[stiff], rows.row["stiffness"][stiff]
    p = c @ modal.channel_modes
    answer = 1 / (modal.omega**2 - w**2 + 1j * w * modal.damping)
    return np.diag(1 / k) + (p * answer) @ p.T + c @ modal.residual @ c.T


def measure(system, solved, w, angle=OTHER):
    """C^{−1/2} of the norm in which flexibilities are compared."""
    omega, phi = solved
    v, k = contact(system, angle)
    p = (v @ phi)[:, 2 * omega**2 >= w**2] / omega[2 * omega**2 >= w**2]
    return linalg.inv(linalg.sqrtm(np.diag(1 / k) + p @ p.T).real)


@pytest.mark.parametrize("accuracy", [0.05, 0.001])
def test_the_estimate_bounds_the_true_error_and_is_near_it(system, solved, estimates, accuracy):
    """All rows and loads of one row seen at another, at a position of its own."""
    modal = modal_system(system, accuracy=accuracy, band_hz=BAND)
    scale = measure(system, solved, W)
    errors = []
    for w in W * np.array(SHARES):
        difference = true_flexibility(system, w) - reduced_flexibility(modal, w)
        errors.append(np.linalg.norm(scale @ difference @ scale, 2))
    assert modal.choice.estimate == estimates.of(estimates.fewest(accuracy)) <= accuracy
    assert np.all(np.diff(errors) > 0)
    assert max(errors) < 1.02 * modal.choice.estimate  # rows elsewhere differ by a per cent or so
    assert modal.choice.estimate < 1.5 * max(errors)


def test_more_accuracy_keeps_more_modes_and_none_of_it_all(estimates):
    chosen = [choose_modes(estimates, accuracy=a) for a in (0.1, 0.05, 0.02, 0.005, 1e-3, 1e-5)]
    counts = np.sum(chosen, axis=1)
    assert np.all(np.diff(counts) >= 0) and counts[-1] > 2 * counts[0]
    errors = [estimates.of(modes) for modes in chosen]
    assert np.all(np.diff(errors) <= 0) and errors[0] > 10 * errors[-2]
    every = choose_modes(estimates, accuracy=0.0)
    assert estimates.of(every) == 0.0 and every.sum() > counts[-1]


def test_a_wider_band_needs_more_modes_and_one_above_all_frequencies_all_of_them(system, solved):
    omega, phi = solved
    counts = []
    for w in 2 * np.pi * np.array([100.0, 300.0, 1000.0, 1e5]):
        errors = errors_of(system, omega, phi, w)
        assert np.isinf(errors.of(omega < 0.99 * w)) or not np.any(
            (omega >= 0.99 * w) & (omega < w)
        )
        counts.append(choose_modes(errors, accuracy=0.05).sum())
    assert np.all(np.diff(counts) > 0)
    assert counts[-1] == len(omega)


def test_all_modes_near_the_band_stay_and_others_by_their_share(solved, estimates):
    """Of the modes above √2 times the band none that is dropped has a larger share in the error
    than one that is kept, and no fewer modes in the order of frequency are as accurate."""
    omega, _ = solved
    chosen = choose_modes(estimates, accuracy=0.01)
    far = omega > np.sqrt(2) * W
    assert chosen[~far].all()
    share = np.max([np.sum(motion**2, axis=0) for motion in estimates.motions], axis=0)
    weakest, strongest = share[chosen & far].min(), share[~chosen].max()
    assert strongest < 1.5 * weakest  # groups of equal modes count by their mean
    by_frequency = np.arange(len(omega)) < chosen.sum()
    assert estimates.of(by_frequency) > 0.01


def test_no_cut_splits_equal_frequencies(solved, estimates):
    omega = np.array([1.0, 2.0, 2.0, 2.0 * (1 + 5e-7), 3.0])
    made_up = ModeErrors(omega, np.full(5, 0.1), (np.sqrt(np.diag([0.1, 0.2, 0.3, 0.25, 0.4])),))
    assert made_up.of(np.array([True, True, False, True, True])) == pytest.approx(0.3)
    for accuracy, modes in ((0.35, [4]), (0.25, [1, 2, 3, 4]), (0.05, [0, 1, 2, 3, 4])):
        assert np.flatnonzero(choose_modes(made_up, accuracy=accuracy)).tolist() == modes
    none = ModeErrors(np.zeros(0), np.zeros(0), ())
    assert choose_modes(none, accuracy=0.01).tolist() == []
    # the five planets of the stage give groups of equal frequencies
    equal, groups = np.diff(solved[0]) < 1e-6 * solved[0][1:], 0
    for accuracy in np.geomspace(0.3, 1e-6, 60):
        chosen = choose_modes(estimates, accuracy=accuracy)
        assert np.all(chosen[1:][equal] == chosen[:-1][equal])
        groups += np.any(chosen[1:][equal]) and not np.all(chosen[1:][equal])
    assert groups > 0


def test_a_limit_is_an_upper_bound_of_an_accuracy(system, solved, estimates):
    free = choose_modes(estimates, accuracy=0.01)
    highest = solved[0][free].max() / (2 * np.pi)
    same = choose_modes(estimates, accuracy=0.01, limit_hz=1.001 * highest)
    assert np.array_equal(same, free)
    with pytest.raises(FlexgearError, match=f"needs modes to {highest:.0f} Hz, but") as fault:
        choose_modes(estimates, accuracy=0.01, limit_hz=0.9 * highest)
    assert "raise modes_to_hz" in str(fault.value)
    with pytest.raises(FlexgearError, match="needs band_hz"):
        modal_system(system, accuracy=0.01)


def test_a_given_limit_is_judged_too(system, solved, estimates):
    judged, plain = modal_system(system, 1500.0, band_hz=BAND), modal_system(system, 1500.0)
    assert plain.choice is None and plain.dropped == judged.dropped
    below = solved[0] <= 2 * np.pi * 1500.0
    assert judged.choice.count == below.sum()
    assert judged.choice.estimate == estimates.of(below)
    assert judged.figures["modes_estimate"] == judged.choice.estimate
    assert judged.figures["kept_modes"] == judged.rigid_count + judged.choice.count
    highest = solved[0][judged.choice.count - 1] / (2 * np.pi)
    assert judged.figures["modes_limit_hz"] == pytest.approx(highest)
    assert "modes_estimate" not in plain.figures
    assert modal_system(system, 0.5 * BAND, band_hz=BAND).choice.estimate == np.inf


def test_a_floating_sun_hides_no_error(system, solved, estimates):
    """Static flexibility of a mode far below the band says nothing about forces in it: a sun that
    floats on its soft shaft needs the modes of one that a bearing holds."""
    omega, phi = solved
    v, k = contact(system)
    assert ((v @ phi[:, :2]) ** 2 / omega[:2] ** 2).sum(axis=1).max() > 1e3 / k.min()
    held = make_system(
        **{"stage.sun.support.radial_n_per_m": "1e8", "stage.gear_mesh.contact_law": "linear"}
    )
    others, shapes = shapes_of(held)
    assert others[0] > 5 * omega[0]
    floating, errors = choose_modes(estimates, accuracy=0.01), errors_of(held, others, shapes)
    chosen = choose_modes(errors, accuracy=0.01)
    assert chosen.sum() == floating.sum()
    assert errors.of(chosen) == pytest.approx(estimates.of(floating), rel=0.05)


def test_torques_at_ports_count(system, solved, estimates):
    """A made-up mode that moves no contact, only the rotation where the brake acts."""
    omega, phi = solved
    last = int(np.sum(omega < 2 * np.pi * 2000.0))
    rows = np.vstack([system.blocks, system.port_rows])
    unit = np.eye(len(rows))[-1]
    changed = phi.copy()
    changed[:, last] = np.linalg.lstsq(rows, unit, rcond=None)[0]
    assert np.abs(rows @ changed[:, last] - unit).max() < 1e-6
    below = np.arange(len(omega)) < last
    assert errors_of(system, omega, changed).of(below) > 10 * estimates.of(below)


def test_rigid_bodies_and_trains_without_support_rows():
    for system in (
        make_system(("ring", "carrier", "shaft")),
        build_system(load_case("lin-parker")),
        build_system(load_case("double-rotor-5mw")),
    ):
        modal = modal_system(system, accuracy=0.02, band_hz=300.0)
        assert 0 <= modal.choice.estimate <= 0.02


def test_a_torque_drop_with_chosen_modes_agrees_with_all_modes():
    system = make_system(**{"stage.gear_mesh.contact_law": "one-sided"})
    chosen = modal_system(system, accuracy=0.01, band_hz=BAND)
    assert len(chosen.omega) < 0.2 * system.size
    drop = jump(TORQUE, 4e5, 0.01, 0.03)

    def loads(modal):
        return stepped(modal, drop, 0.05, 5e-5, 1e-4).pair_load

    full, few = loads(modal_system(system)), loads(chosen)
    peak = full.max(axis=(0, 2))
    loaded = peak > 0.1 * peak.max()
    assert np.abs(few.max(axis=(0, 2)) / np.where(loaded, peak, np.inf) - loaded).max() < 0.01
    assert np.abs(few - full).max() < 0.01 * peak.max()


def test_displacements_are_counted_from_the_mean_pin_however_few_modes_there_are(system):
    """Dropped modes turn the pins too; without them rolling would be taken off by too little."""
    rated = Drive(lambda t: np.full_like(t, TORQUE))
    moved = []
    for modal in (modal_system(system), modal_system(system, 300.0)):
        recovery = Recovery(stepped(modal, rated, 0.02, 1e-4, 1e-3))
        planet = recovery.node("stage.planet_1", "stage.planet_1")[:, :3]
        assert np.abs(recovery.motion(system.input_rows)).max() < 1e-6 * np.abs(planet).max()
        moved.append(planet)
    assert np.abs(moved[1] - moved[0]).max() < 0.01 * np.abs(moved[0]).max()


def test_the_solver_section_decides(system):
    def reduced(**keys):
        case = make_case(**{f"solver.{k}": v for k, v in keys.items()})
        return chosen_modal(system, case_pace(case.case))

    loose, tight = reduced(modes_accuracy="0.05"), reduced(modes_accuracy="0.001")
    wide = reduced(modes_accuracy="0.05", modes_band_hz="1000")
    assert loose.choice.estimate <= 0.05 and loose.choice.band_hz == 500.0
    assert len(loose.omega) < min(len(tight.omega), len(wide.omega))
    with pytest.raises(FlexgearError, match="modes_to is 900 Hz"):
        reduced(modes_accuracy="0.001", modes_to_hz="900")
    with pytest.raises(InputError, match=r"solver\.modes_accuracy"):
        make_case(**{"solver.modes_accuracy": "1.5"})


def test_parts_of_a_train_answer_for_the_gear_meshes_that_excite_them():
    """A planetary stage before a generator: its ring and carrier keep the modes of their own band,
    below which the train is as accurate as estimated."""
    keys = {"solver.gear_mesh_orders": "10", "lss.gear_mesh.contact_law": "linear"}
    keys["lss.ring.fe.bolts.number"] = "25"
    case = load_case("grc-750kw", keys)
    pace, train = case_pace(case), build_system(case, make_bodies(case.view("lss")))
    several, one = chosen_modal(train, pace), modal_system(train, accuracy=0.01, band_hz=pace.band)
    assert several.choice.band_hz == pace.band and several.choice.estimate <= 0.01
    lowest = several.choice.lowest_band_hz
    assert lowest == min(pace.member_bands.values()) < 0.25 * pace.band
    assert several.choice.count < 0.8 * one.choice.count
    v, k = contact(train)
    omega, phi = shapes_of(train)
    stiff, root, damping = (
        omega >= np.sqrt(2) * np.pi * lowest,
        np.sqrt(np.abs(k)),
        damping_matrix(train),
    )
    p = root[:, None] * (v @ phi)[:, stiff] / omega[stiff]
    lower = np.linalg.cholesky(np.eye(len(k)) + p @ p.T)
    for w in 2 * np.pi * lowest * np.array(SHARES):
        dynamic = train.stiffness - w**2 * train.mass + 1j * w * damping
        flexibility = np.diag(1 / k) + v @ np.linalg.solve(dynamic, v.T)
        change = root[:, None] * (flexibility - reduced_flexibility(several, w)) * root
        change = linalg.solve_triangular(lower, change, lower=True)
        change = linalg.solve_triangular(lower, change.T, lower=True)
        assert np.linalg.norm(change, 2) < 1.02 * several.choice.estimate
