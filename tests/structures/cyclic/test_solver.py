"""Equal sectors: harmonics, solves, Lanczos with a shift, rigid motion, against dense algebra."""

import numpy as np
import pytest
import scipy.linalg as sla
from cyclic_samples import TEETH, plain_ring
from hypothesis import given, settings
from hypothesis import strategies as st

from flexgear.model.errors import FlexgearError
from flexgear.structures.cyclic import modes
from flexgear.structures.cyclic.condensation import condense_by_sectors
from flexgear.structures.cyclic.sectors import Harmonics, without_rigid
from flexgear.structures.linalg.lanczos import NotConverged, lowest_modes


@settings(max_examples=25, deadline=None)
@given(z=st.integers(3, 14), b=st.integers(1, 5), seed=st.integers(0, 2**32 - 1))
def test_harmonics_solve_the_circulant_system_of_all_borders(z, b, seed):
    random = np.random.default_rng(seed)
    one = random.standard_normal((2 * b, 2 * b))
    one = one @ one.T + 0.1 * np.eye(2 * b)
    whole = np.zeros((z * b, z * b))
    for s in range(z):
        at = np.concatenate([s * b + np.arange(b), (s + 1) % z * b + np.arange(b)])
        whole[np.ix_(at, at)] += one
    right = random.standard_normal((b, z, 3))
    solution = Harmonics(one, z).solve(right)
    expected = np.linalg.solve(whole, right.transpose(1, 0, 2).reshape(z * b, 3))
    expected = expected.reshape(z, b, 3).transpose(1, 0, 2)
    assert np.abs(solution - expected).max() < 1e-10 * np.abs(expected).max()


def test_a_sector_that_nothing_holds_is_refused():
    free = np.array([[1.0, -1.0], [-1.0, 1.0]])
    with pytest.raises(FlexgearError, match="not held"):
        Harmonics(free, 5)


@pytest.fixture(scope="module")
def ring():
    model, interface = plain_ring()
    parts, path = condense_by_sectors(model, interface, (TEETH,))
    assert path == "cyclic: 12 sectors, 7 harmonics"
    return model, interface, parts


def test_interface_is_held_to_rounding(ring):
    model, _, parts = ring
    g = np.random.default_rng(0).standard_normal((model.dofs, 4))
    x = parts.fixed_solve(parts.field_of(g))
    assert np.abs(parts.interface_motion(x)).max() < 1e-13 * np.abs(x).max()


def pencil(n=90, seed=0):
    """A mass, a flexibility that is symmetric, pairs and a triple among its eigenvalues."""
    random = np.random.default_rng(seed)
    mass = random.standard_normal((n, n))
    mass = mass @ mass.T / n + np.eye(n)
    values = np.repeat(np.linspace(1.0, 6.0, n // 2), 2) ** 2
    values[4] = values[3]
    vectors = np.linalg.qr(random.standard_normal((n, n)))[0]
    root = sla.sqrtm(mass).real
    basis = np.linalg.solve(root, vectors)
    return mass, (basis / values) @ basis.T, 1 / values


@pytest.mark.parametrize("most", [29, 40, 70])
def test_lowest_modes_with_multiplicities_and_restarts(most):
    mass, flexibility, values = pencil()
    start = np.random.default_rng(1).standard_normal((90, 4))
    heard = []
    solve, product = (lambda x, a=a: a @ x for a in (flexibility, mass))
    lowest = lowest_modes(solve, product, start, 12, most, progress=heard.append)
    assert np.allclose(lowest.values, np.sort(values)[::-1][:12], rtol=1e-12)
    v = lowest.vectors
    assert np.abs(v.T @ mass @ v - np.eye(12)).max() < 1e-9
    residual = flexibility @ (mass @ v) - v * lowest.values
    assert np.abs(residual).max() < 1e-6 * lowest.values.max()
    assert heard[-1] == 1.0


def test_a_basis_too_small_is_refused():
    mass, flexibility, _ = pencil()
    with pytest.raises(NotConverged, match="fewer modes"):
        lowest_modes(lambda g: flexibility @ g, lambda x: mass @ x, np.ones((90, 4)), 12, 20)


COUNT = 20


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
    nodes = np.sort(parts.ties.periodic.ravel())
    rows = interface.rows.toarray()[(6 * nodes[:, None] + np.arange(6)).ravel()]
    held = held_frequencies(model, rows)[:COUNT]
    above = modes.lowest_values(parts.solver, parts.motion.inertia, COUNT)
    inside = modes.held_value(parts.solver, parts.fe_mass)
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
    load, solver = parts.field_of(g).reshape(-1, TEETH, 3), parts.shifted(sigma)
    x, reactions = solver.solve(load), solver.reactions(load)
    u, rho = expected[: model.dofs], -expected[model.dofs :]
    motion = parts.dofs_of(x.reshape(-1, 3), model.dofs)
    assert np.abs(motion - u).max() <= 1e-8 * np.abs(u).max()
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
        lowest = whole(solve, mass, start, count + 1, most, shift=shift, **options)
        hidden = slice(1, None) if shift else slice(0, count)
        return type(lowest)(
            lowest.values[hidden], lowest.vectors[:, hidden], lowest.residuals[hidden]
        )

    monkeypatch.setattr(modes, "lowest_modes", blind)
    lowest = modes.cyclic_modes(parts, COUNT, lambda _: None)
    assert shifts[0] > exact[0]
    assert shifts[1:] == [0.0]
    assert np.allclose(1 / lowest.values, exact[:COUNT], rtol=1e-9)


@pytest.mark.parametrize("highest", [None, 1e6, 1e14, 1e30])
def test_any_shift_gives_the_same_modes(ring, exact, monkeypatch, highest):
    _, _, parts = ring
    if highest is not None:
        monkeypatch.setattr(modes, "lowest_values", lambda *_: np.array([highest]))
        monkeypatch.setattr(modes, "held_value", lambda *_: 1e40)
    lowest = modes.cyclic_modes(parts, COUNT, lambda _: None)
    assert np.allclose(1 / lowest.values, exact[:COUNT], rtol=1e-9)


def test_a_shift_upon_a_mode_is_moved(ring, exact, monkeypatch):
    _, _, parts = ring
    monkeypatch.setattr(modes, "lowest_values", lambda *_: exact[2:3] / modes._SHARE)
    monkeypatch.setattr(modes, "held_value", lambda *_: np.inf)
    shift, _ = modes._shifted(parts, COUNT)
    assert shift == pytest.approx(0.97 * exact[2])


def test_inverses_that_were_forgotten_are_made_anew(ring, monkeypatch):
    _, _, parts = ring
    g = np.random.default_rng(3).standard_normal((parts.dofs, 2))
    before = parts.fixed_solve(g)
    monkeypatch.setattr("flexgear.structures.cyclic.sectors._LARGE", 0)
    parts.solver.border_harmonics.forget()
    assert np.array_equal(parts.fixed_solve(g), before)


def sector(b=12, seed=0):
    """Stiffness (2b, 2b) of a free sector and its rigid motion, alike at both borders."""
    random = np.random.default_rng(seed)
    shape = random.standard_normal((b, 6))
    rigid = np.linalg.qr(np.vstack([shape, shape @ random.standard_normal((6, 6))]))[0]
    stiffness = random.standard_normal((2 * b, 2 * b))
    stiffness = stiffness @ stiffness.T
    free = np.eye(2 * b) - rigid @ rigid.T
    return free @ stiffness @ free, rigid


def test_stiffness_that_has_rigid_motion_is_kept_and_rounding_leaves_it():
    exact, rigid = sector()
    noise = np.random.default_rng(1).standard_normal(exact.shape)
    stiffness = without_rigid(exact + 1e-9 * (noise + noise.T), rigid)
    assert np.abs(stiffness @ rigid).max() < 1e-13 * np.abs(exact).max()
    assert np.abs(stiffness - exact).max() < 1e-7 * np.abs(exact).max()
