"""The shift among the modes of equal sectors: where it goes, and that it changes nothing."""

import numpy as np
import pytest
import scipy.linalg as sla
from cyclic_samples import TEETH, plain_ring

from flexgear.structures.cyclic import modes
from flexgear.structures.cyclic.condensation import condense_by_sectors
from flexgear.structures.cyclic.modes import held_value, lowest_values
from flexgear.structures.linalg.dense import (
    balanced_inverse,
    hermitian_inverse,
    signed_hermitian_inverse,
)

COUNT = 20


@pytest.fixture(scope="module")
def ring():
    model, interface = plain_ring()
    return model, interface, condense_by_sectors(model, interface, (TEETH,))[0]


def held_frequencies(model, rows):
    """omega^2 of the body held at B x = 0, dense."""
    free = sla.null_space(rows)
    parts = (free.T @ (a @ free) for a in (model.stiffness, model.mass))
    return sla.eigh(*parts, eigvals_only=True)


@pytest.fixture(scope="module")
def exact(ring):
    return held_frequencies(ring[0], ring[1].rows.toarray())


def test_bounds_of_a_body_held_by_the_sectors_own_ties(ring):
    model, interface, parts = ring
    own = np.sort(parts.ties.periodic.ravel())
    rows = interface.rows.toarray()[(6 * own[:, None] + np.arange(6)).ravel()]
    held = held_frequencies(model, rows)[:COUNT]
    above = lowest_values(parts.solver, parts.motion.inertia, COUNT)
    inside = held_value(parts.solver, parts.fe_mass)
    assert (above >= held * (1 - 1e-9)).all()
    assert (1 / (1 / above + 1 / inside) <= held * (1 + 1e-9)).all()
    assert above[0] <= 1.3 * held[0]


@pytest.mark.parametrize("at", [1, 3])
def test_solutions_between_modes(ring, exact, at):
    model, interface, parts = ring
    sigma = 0.5 * (exact[at] + exact[at + 1])
    b = interface.rows.toarray()
    matrix = (model.stiffness - sigma * model.mass).toarray()
    bordered = np.block([[matrix, b.T], [b, np.zeros((len(b), len(b)))]])
    g = np.random.default_rng(at).standard_normal((model.dofs, 3))
    expected = np.linalg.solve(bordered, np.vstack([g, np.zeros((len(b), 3))]))
    x, reactions = parts.shifted(sigma).solve(parts.field_of(g).reshape(-1, TEETH, 3))
    u, rho = expected[: model.dofs], -expected[model.dofs :]
    found = parts.dofs_of(x.reshape(-1, 3), model.dofs)
    assert np.abs(found - u).max() <= 1e-8 * np.abs(u).max()
    assert np.abs(reactions - rho).max() <= 1e-8 * np.abs(rho).max()


@pytest.mark.parametrize("at", [0, 1, 4, 7])
def test_pivots_count_the_modes_below_a_shift(ring, exact, at):
    _, _, parts = ring
    for sigma in (0.999 * exact[at], 1.001 * exact[at]):
        assert modes.modes_below(parts.shifted(sigma)) == (exact < sigma).sum()


def test_a_mode_that_was_passed_over_is_found_from_zero(ring, exact, monkeypatch):
    """An iteration that never sees the lowest mode, as one with an unlucky start."""
    _, _, parts = ring
    whole, shifts = modes.lowest_modes, []

    def blind(solve, mass, start, count, most, *, shift, **options):
        shifts.append(shift)
        found = whole(solve, mass, start, count + 1, most, shift=shift, **options)
        hidden = slice(1, None) if shift else slice(0, count)
        kept = (found.values[hidden], found.vectors[:, hidden], found.residuals[hidden])
        return type(found)(*kept, found.beside[:, hidden])

    monkeypatch.setattr(modes, "lowest_modes", blind)
    found = modes.cyclic_modes(parts, COUNT, lambda _: None)
    assert shifts[0] > exact[0]
    assert shifts[1:] == [0.0]
    assert np.allclose(1 / found.values, exact[:COUNT], rtol=1e-9)


@pytest.mark.parametrize("highest", [None, 1e6, 1e14, 1e30])
def test_any_shift_gives_the_same_modes_and_reactions(ring, exact, monkeypatch, highest):
    _, _, parts = ring
    if highest is not None:
        monkeypatch.setattr(modes, "lowest_values", lambda *_: np.array([highest]))
        monkeypatch.setattr(modes, "held_value", lambda *_: 1e40)
    found = modes.cyclic_modes(parts, COUNT, lambda _: None)
    assert np.allclose(1 / found.values, exact[:COUNT], rtol=1e-9)
    loads = parts.mass_product(np.ascontiguousarray(found.vectors))
    _, reactions = parts.fixed_solve_with_reactions(loads)
    assert np.abs(found.beside - reactions).max() <= 1e-9 * np.abs(reactions).max()


def test_a_shift_upon_a_mode_is_moved(ring, exact, monkeypatch):
    _, _, parts = ring
    monkeypatch.setattr(modes, "lowest_values", lambda *_: exact[2:3] / modes._SHARE)
    monkeypatch.setattr(modes, "held_value", lambda *_: np.inf)
    shift, _ = modes._shifted(parts, COUNT)
    assert shift == pytest.approx(0.97 * exact[2])


@pytest.mark.parametrize("n", [1, 7, 130])
def test_hermitian_inverses(n):
    random = np.random.default_rng(n)
    a = random.standard_normal((n, n)) + 1j * random.standard_normal((n, n))
    definite = a @ a.conj().T + np.eye(n)
    regular = a + a.conj().T
    lower = np.tril_indices(n)
    for found, negative, matrix in (
        (hermitian_inverse(definite), 0, definite),
        (*signed_hermitian_inverse(definite), definite),
        (*signed_hermitian_inverse(-definite), -definite),
        (*signed_hermitian_inverse(regular), regular),
    ):
        expected = np.linalg.inv(matrix)
        assert np.abs(found - expected)[lower].max() <= 1e-9 * np.abs(expected).max()
        assert negative == (np.linalg.eigvalsh(matrix) < 0).sum()
    with pytest.raises(np.linalg.LinAlgError):
        hermitian_inverse(-definite)
    with pytest.raises(np.linalg.LinAlgError):
        signed_hermitian_inverse(np.zeros((n, n), dtype=complex))


def test_balanced_inverse_of_an_indefinite_matrix_in_unlike_units():
    random = np.random.default_rng(0)
    a = random.standard_normal((9, 9))
    units = 10.0 ** np.arange(-8, 10, 2)
    matrix = units[:, None] * (a + a.T) * units
    found = balanced_inverse(matrix) * units[:, None] * units
    assert np.allclose(found, np.linalg.inv(a + a.T), rtol=1e-9)


def test_inverses_that_were_forgotten_are_made_anew(ring, monkeypatch):
    _, _, parts = ring
    g = np.random.default_rng(3).standard_normal((parts.dofs, 2))
    before = parts.fixed_solve(g)
    monkeypatch.setattr("flexgear.structures.cyclic.borders._LARGE", 0)
    parts.solver.border_harmonics.forget()
    assert np.array_equal(parts.fixed_solve(g), before)
