"""Modes kept for a wanted accuracy: against full matrices, over counts and limits, in a drop."""

import numpy as np
import pytest
from coupled import TORQUE, make_case, make_system
from reference_transient import damping_matrix
from scipy import linalg
from stepped import jump, stepped

from flexgear.analysis.modes import row_vectors, rows_at
from flexgear.analysis.recovery import Recovery
from flexgear.analysis.transient import Drive
from flexgear.coupling.build import build_system
from flexgear.coupling.modal import (
    choose_modes,
    chosen_modal,
    cuts,
    elastic_modes,
    modal_system,
    mode_estimates,
)
from flexgear.coupling.pace import case_pace
from flexgear.model.errors import FlexgearError, InputError
from flexgear.model.load import load_case

BAND = 500.0  # Hz
OTHER = 0.37  # rad, a position that the estimate does not look at
SHARES = (0.05, 0.55, 0.95, 1.0)  # of the band


@pytest.fixture(scope="module")
def system():
    return make_system(**{"stage.gear_mesh.contact_law": "linear"})


@pytest.fixture(scope="module")
def solved(system):
    return elastic_modes(system)


@pytest.fixture(scope="module")
def estimates(system, solved):
    return np.array(list(mode_estimates(system, *solved, BAND)))


def contact(system, angle=OTHER):
    rows, n = rows_at(system, angle)
    return row_vectors(system, rows, n), rows.row["stiffness"][:n].copy()


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
    p = c @ modal.channel_modes
    answer = 1 / (modal.omega**2 - w**2 + 1j * w * modal.damping)
    return np.diag(1 / rows.row["stiffness"][:n]) + (p * answer) @ p.T + c @ modal.residual @ c.T


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
    scale = measure(system, solved, 2 * np.pi * BAND)
    errors = []
    for w in 2 * np.pi * BAND * np.array(SHARES):
        difference = true_flexibility(system, w) - reduced_flexibility(modal, w)
        errors.append(np.linalg.norm(scale @ difference @ scale, 2))
    assert modal.choice.estimate == estimates[modal.choice.count] <= accuracy
    assert np.all(np.diff(errors) > 0)
    assert max(errors) < 1.02 * modal.choice.estimate  # rows elsewhere differ by a per cent or so
    assert modal.choice.estimate < 1.5 * max(errors)


def test_more_accuracy_keeps_more_modes_and_none_of_it_all(system, solved, estimates):
    omega, _ = solved
    counts = [
        choose_modes(omega, estimates, BAND, accuracy=a).count
        for a in (0.1, 0.05, 0.02, 0.005, 1e-3, 1e-5)
    ]
    assert np.all(np.diff(counts) >= 0) and counts[-1] > 2 * counts[0]
    finite = estimates[np.isfinite(estimates)]
    assert np.all(np.diff(finite) <= 1e-12 * finite[:-1])  # rounding differs between processors
    every = choose_modes(omega, estimates, BAND, accuracy=1e-14)
    assert every.count == len(omega) and every.estimate == 0.0


def test_a_wider_band_needs_more_modes_and_one_above_all_frequencies_all_of_them(system, solved):
    omega, phi = solved
    counts = []
    for band in (100.0, 300.0, 1000.0, 1e5):
        estimates = np.array(list(mode_estimates(system, omega, phi, band)))
        assert np.all(np.isinf(estimates[: np.sum(omega < 2 * np.pi * band)]))
        counts.append(choose_modes(omega, estimates, band, accuracy=0.05).count)
    assert np.all(np.diff(counts) > 0)
    assert counts[-1] == len(omega)


def test_no_cut_splits_equal_frequencies(solved, estimates):
    assert cuts(np.array([1.0, 2.0, 2.0 * (1 + 5e-7), 3.0])).tolist() == [0, 1, 3, 4]
    assert cuts(np.zeros(0)).tolist() == [0]
    omega, made_up = np.array([1.0, 2.0, 2.0, 2.0, 3.0]), np.array([0.5, 0.4, 0.3, 0.2, 0.1, 0.0])
    assert [choose_modes(omega, made_up, 0.1, accuracy=a).count for a in (0.4, 0.3, 0.15)] == [
        1, 4, 4,
    ]  # fmt: skip
    # the five planets of the stage give groups of equal frequencies
    hz = solved[0] / (2 * np.pi)
    groups = 0
    for accuracy in np.geomspace(0.3, 1e-6, 60):
        n = choose_modes(solved[0], estimates, BAND, accuracy=accuracy).count
        if 0 < n < len(hz):
            assert hz[n] / hz[n - 1] - 1 > 1e-6
            groups += hz[n - 1] / hz[n - 2] - 1 < 1e-6
    assert groups > 0


def test_a_limit_is_an_upper_bound_of_an_accuracy(system, solved, estimates):
    free = choose_modes(solved[0], estimates, BAND, accuracy=0.01)
    highest = solved[0][free.count - 1] / (2 * np.pi)
    same = choose_modes(solved[0], estimates, BAND, accuracy=0.01, limit_hz=3000.0)
    assert same.count == free.count and highest < 3000.0
    with pytest.raises(FlexgearError, match=f"needs modes to {highest:.0f} Hz, but") as fault:
        choose_modes(solved[0], estimates, BAND, accuracy=0.01, limit_hz=0.9 * highest)
    assert "raise modes_to_hz" in str(fault.value)
    with pytest.raises(FlexgearError, match="needs band_hz"):
        modal_system(system, accuracy=0.01)


def test_a_given_limit_is_judged_too(system, solved, estimates):
    judged, plain = modal_system(system, 1500.0, band_hz=BAND), modal_system(system, 1500.0)
    assert plain.choice is None and plain.dropped == judged.dropped
    assert judged.choice.estimate == estimates[judged.choice.count]
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
    others, shapes = elastic_modes(held)
    assert others[0] > 5 * omega[0]
    floating = choose_modes(omega, estimates, BAND, accuracy=0.01)
    choice = choose_modes(others, mode_estimates(held, others, shapes, BAND), BAND, accuracy=0.01)
    assert choice.count == floating.count
    assert choice.estimate == pytest.approx(floating.estimate, rel=0.05)


def test_torques_at_ports_count(system, solved, estimates):
    """A made-up mode that moves no contact, only the rotation where the brake acts."""
    omega, phi = solved
    last = int(np.sum(omega < 2 * np.pi * 2000.0))
    rows = np.vstack([system.blocks, system.port_rows])
    unit = np.eye(len(rows))[-1]
    changed = phi.copy()
    changed[:, last] = np.linalg.lstsq(rows, unit, rcond=None)[0]
    assert np.abs(rows @ changed[:, last] - unit).max() < 1e-6
    assert mode_estimates(system, omega, changed, BAND)[last] > 10 * estimates[last]


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
