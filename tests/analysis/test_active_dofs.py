"""Rows on the active contact dofs against plain dense algebra in all channels."""

import numpy as np
import pytest
from coupled import make_bodies, make_system
from numba import njit

from flexgear.analysis.kernels import active_dofs as ad
from flexgear.analysis.kernels import row_receptances
from flexgear.analysis.kernels.static_contact import eliminate, solve_dense
from flexgear.analysis.step_space import begin, step_data, work_space
from flexgear.coupling.build import build_system
from flexgear.coupling.kernels.pairs import fill_rows
from flexgear.coupling.modal import modal_system
from flexgear.coupling.pair_data import action_lines, carrying_flanks
from flexgear.model.load import load_case

STEP, SHARE = 1e-4, 2e4


@njit
def gathered(active, channels, rows, n, last_rows, last):
    changed = ad.gather(active, channels, rows, n, last_rows, last)
    ad.gather_receptance(active, channels, 0)
    row_receptances.place_rows(active, channels, rows, n, 0)
    return changed


@njit
def products(active, rows, n, eta, force, springs, vectors, problem, out):
    row_receptances.row_receptances(active, 0, SHARE, rows, n, n, springs, vectors, problem)
    ad.motions(active, eta, eta, out[0], out[1])
    ad.modal_forces(active, force, out[2])
    ad.add_residual(active, 0, force, vectors.image, out[3])
    for i in range(n):
        out[4, i] = row_receptances.row_value(rows, i, out[0])
        row_receptances.add_row(rows, i, 1.0, out[5])


@njit
def solved(a, b, n):
    return solve_dense(a, b, n)


@njit
def eliminated(a, b, n, x):
    return eliminate(a, b, n, x)


def stage():
    return modal_system(make_system(**{"stage.gear_mesh.contact_law": "one-sided"}), 3000.0)


def train():
    """Three stages: bodies of one are not coupled to all lines of action of another."""
    case = load_case("grc-750kw", {"lss.ring.fe.bolts.number": "25"})
    return modal_system(build_system(case, make_bodies(case.view("lss"))), 3000.0)


def dense_rows(modal, rows, n):
    """(n, n_c) rows on blocks, ports, lines of action: those of lines, then blocks beyond."""
    ports, pairs = len(modal.system.ports), modal.system.pairs
    block_dofs = len(modal.channels) - ports
    out = np.zeros((n, block_dofs + ports + 3 * len(pairs.s0)))
    for i in range(n):
        if (m := rows.row["line"][i]) >= 0:
            at = block_dofs + ports + 2 * m
            out[i, at : at + 2] = 1.0, rows.row["along"][i]
        for a in range(rows.row["beyond"][i], rows.row["width"][i]):
            at = 6 * rows.blocks[i, a]
            out[i, at : at + 6] += rows.coef[i, a]
    return out


@pytest.mark.slow
@pytest.mark.parametrize("system", [stage, train])
def test_products_on_active_dofs_are_the_dense_ones(system):
    """As teeth come into contact and go, at positions of a turn and back."""
    modal = system()
    data, space = step_data(modal, STEP), work_space(modal)
    begin(space, data)
    rows, active = space.work.rows, space.work.active
    lines = action_lines(modal.system.pairs, len(modal.system.blocks) // 6)
    assert len(data.channels.modes) == len(modal.channels) + len(lines)
    rng, changes = np.random.default_rng(3), 0
    for turn in (0.0, 0.002, 0.05, 0.052, 0.3, 0.0):
        theta = np.full(len(modal.angles), turn)
        n, _, _ = fill_rows(data.elements, theta, carrying_flanks(modal.system.pairs), rows)
        changes += gathered(active, data.channels, rows, n, space.ledger.rows, 0)
        dofs, modes = int(active.counts[0]["dofs"]), active.modes.shape[1]
        at = active.channel[:dofs]
        assert len(np.unique(at)) == dofs
        v, g, r = dense_rows(modal, rows, n), data.channels.displacement[0], data.channels.residual
        eta, force = np.zeros(modes), np.zeros(len(active.channel))
        eta[: len(modal.omega)] = rng.standard_normal(len(modal.omega))
        force[:dofs] = rng.standard_normal(dofs)
        problem = space.work.problem
        out = np.zeros((6, max(len(active.channel), modes)))
        space.work.dofs.image[:] = 7.0  # nothing may be read before it is written
        products(active, rows, n, eta, force, data.springs, space.work.dofs, problem, out)
        phi = data.channels.modes[at]
        for product, expected in (
            (problem.displacement[:n, :n], v @ g @ v.T),
            (problem.rate[:n, :n], SHARE * v @ (g - r) @ v.T),
            (out[0, :dofs], phi @ eta),
            (out[2, :modes], phi.T @ force[:dofs]),
            (out[3, :dofs], r[np.ix_(at, at)] @ force[:dofs]),
            (out[4, :n], v @ (data.channels.modes @ eta)),
            (out[5, :dofs], v.sum(axis=0)[at]),
        ):
            np.testing.assert_allclose(
                product, expected, rtol=0, atol=1e-12 * np.abs(expected).max()
            )
        assert not gathered(active, data.channels, rows, n, space.ledger.rows, 0)
    assert changes > (2 if system is stage else 0)


@pytest.mark.parametrize("n", [1, 2, 3, 7, 15, 16, 17, 28, 44])
def test_elimination_solves_with_and_without_room_behind_the_rows(n):
    rng = np.random.default_rng(n)
    matrix, b = rng.standard_normal((n, n)), rng.standard_normal(n)
    matrix[0, 0] = 0.0 if n > 1 else 1.0  # has to exchange rows
    expected = np.linalg.solve(matrix, b)
    for room in (0, -n % 16 + 16):
        a, x = np.full((n, n + room), 7.0), b.copy()
        a[:, :n] = matrix
        assert solved(a, x, n)
        np.testing.assert_allclose(x, expected, rtol=0, atol=1e-9 * np.abs(expected).max())
    assert not solved(np.zeros((n, n)), b.copy(), n)


@pytest.mark.parametrize("n", [1, 2, 3, 4, 5, 15, 16, 17, 29, 44])
def test_contact_matrices_are_eliminated_without_exchange_of_rows(n):
    """I + K D: stiffnesses over ten decades, half of the rows open in one case, a damper's part
    that is not symmetric."""
    rng = np.random.default_rng(n)
    root, size = rng.standard_normal((n, n)), n + -n % 16
    for stiffness in (10.0 ** rng.uniform(-5, 5, n), 1e3 * rng.integers(0, 2, n)):
        matrix = np.eye(n) + stiffness[:, None] * (root @ root.T)
        matrix += np.sqrt(stiffness)[:, None] * np.diag(rng.random(n))
        a, b, x = np.full((size, size), 7.0), np.full(size, 7.0), np.full(size, 7.0)
        a[:n, :n], b[:n] = matrix, rng.standard_normal(n)
        expected = np.linalg.solve(matrix, b[:n])
        assert eliminated(a, b, n, x)
        np.testing.assert_allclose(x[:n], expected, rtol=0, atol=1e-9 * np.abs(expected).max())
    if n > 1:
        a[:n, :n] = np.eye(n)[::-1]
        assert not eliminated(a, b, n, x)  # left to the elimination that exchanges rows
