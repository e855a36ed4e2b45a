"""Factors by harmonics, the constrained solve and Lanczos on it, against dense algebra."""

import numpy as np
import pytest
import scipy.linalg as sla
from cyclic_samples import TEETH, plain_ring
from hypothesis import given, settings
from hypothesis import strategies as st

from flexgear.model.errors import FlexgearError
from flexgear.structures.cyclic.borders import Harmonics
from flexgear.structures.cyclic.condensation import condense_by_sectors
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
    found = Harmonics(one, z).solve(right)
    expected = np.linalg.solve(whole, right.transpose(1, 0, 2).reshape(z * b, 3))
    expected = expected.reshape(z, b, 3).transpose(1, 0, 2)
    assert np.abs(found - expected).max() < 1e-10 * np.abs(expected).max()


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


@pytest.fixture(scope="module")
def bordered(ring):
    """[K B^T; B 0] of the whole body."""
    model, interface, _ = ring
    b = interface.rows.toarray()
    return np.block([[model.stiffness.toarray(), b.T], [b, np.zeros((len(b), len(b)))]])


@settings(max_examples=8, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), moved=st.booleans(), loaded=st.booleans())
def test_any_load_and_any_interface_motion(ring, bordered, seed, moved, loaded):
    model, interface, parts = ring
    random = np.random.default_rng(seed)
    g = loaded * random.standard_normal((model.dofs, 2)) * 1e6
    q = moved * random.standard_normal((interface.size, 2))
    exact = np.linalg.solve(bordered, np.vstack([g, q]))
    load = parts.field_of(g).reshape(-1, TEETH, 2)
    x, reactions = parts.solver.solve(load, q)
    u, rho = exact[: model.dofs], -exact[model.dofs :]
    scale = np.abs(u).max() + 1e-300
    assert np.abs(parts.dofs_of(x.reshape(-1, 2), model.dofs) - u).max() <= 1e-9 * scale
    assert np.abs(reactions - rho).max() <= 1e-8 * np.abs(rho).max()


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
    beside = np.random.default_rng(2).standard_normal((5, 90))

    def solve(g):
        return flexibility @ g, beside @ g

    found = lowest_modes(solve, lambda x: mass @ x, start, 12, most, progress=heard.append)
    assert np.allclose(found.values, np.sort(values)[::-1][:12], rtol=1e-12)
    v = found.vectors
    assert np.abs(v.T @ mass @ v - np.eye(12)).max() < 1e-9
    residual = flexibility @ (mass @ v) - v * found.values
    assert np.abs(residual).max() < 1e-6 * found.values.max()
    assert np.allclose(found.beside, beside @ (mass @ v), atol=1e-9 * np.abs(found.beside).max())
    assert heard[-1] == 1.0


@pytest.mark.parametrize("most", [29, 70])
@pytest.mark.parametrize("sigma", [0.4, 1.6, 2.3])
def test_a_shift_changes_neither_modes_nor_what_is_beside_them(sigma, most):
    mass, flexibility, values = pencil()
    start = np.random.default_rng(1).standard_normal((90, 4))
    shifted = np.linalg.inv(np.linalg.inv(flexibility) - sigma * mass)
    beside = np.random.default_rng(2).standard_normal((5, 90))

    def solve(g):
        x = shifted @ g
        return x, beside @ (g + sigma * (mass @ x))

    found = lowest_modes(
        solve,
        lambda x: mass @ x,
        start,
        12,
        most,
        tolerance=1e-6,  # what is beside is exact even so
        shift=sigma,
        unshifted=lambda g: beside @ g,
    )
    assert np.allclose(found.values, np.sort(values)[::-1][:12], rtol=1e-11)
    v = found.vectors
    residual = flexibility @ (mass @ v) - v * found.values
    size = np.sqrt(np.sum(residual * (mass @ residual), axis=0))
    assert (size <= found.residuals * (1 + 1e-6) + 1e-10).all()
    assert np.allclose(found.beside, beside @ (mass @ v), atol=1e-10 * np.abs(found.beside).max())


def test_a_basis_too_small_is_refused():
    mass, flexibility, _ = pencil()
    with pytest.raises(NotConverged, match="fewer modes"):
        lowest_modes(lambda g: (flexibility @ g, g), lambda x: mass @ x, np.ones((90, 4)), 12, 20)
