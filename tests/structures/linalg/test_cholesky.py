"""The Cholesky factor of a body: whole solves, both halves, sparse right-hand sides."""

import numpy as np
import pytest
import scipy.sparse as sp
from plain_meshes import annulus

from flexgear.structures.fem import FeModel
from flexgear.structures.linalg.sparse import Factor, flexibility

RANDOM = np.random.default_rng(11)


@pytest.fixture(scope="module")
def matrix():
    """A regular matrix (3n, 3n)."""
    model = FeModel(annulus((24, 2, 3), teeth=8), 210e9, 0.3, 7850.0)
    return (model.stiffness + 1e6 * model.mass).tocsr()


@pytest.fixture(scope="module")
def factor(matrix):
    return Factor(matrix)


@pytest.mark.parametrize("columns", [1, 7, 70])
def test_solution_is_that_of_the_matrix(matrix, factor, columns):
    right = RANDOM.standard_normal((matrix.shape[0], columns))
    x = factor.solve(right)
    assert np.abs(matrix @ x - right).max() < 1e-13 * np.abs(matrix).max() * np.abs(x).max()
    assert np.array_equal(factor.solve(np.asfortranarray(right)), x)
    assert np.array_equal(factor.solve(right[:, 0]), factor.solve(right[:, :1])[:, 0])
    half = factor.forward(right)
    assert np.allclose(factor.backward(half), x, rtol=1e-12, atol=1e-12 * np.abs(x).max())
    energy = np.sum(half * half, axis=0)  # |L^{-1} P g|^2 = g . A^{-1} g
    assert np.allclose(energy, np.sum(right * x, axis=0), rtol=1e-9)


def test_what_is_given_stays_as_it_is(matrix, factor):
    right = RANDOM.standard_normal((matrix.shape[0], 3))
    before = right.copy()
    for way in (factor.solve, factor.forward, factor.backward):
        way(right)
        assert np.array_equal(right, before)


def test_sparse_right_sides_give_the_same(matrix, factor):
    n = matrix.shape[0]
    right = sp.random_array((n, 9), density=3e-3, random_state=RANDOM, format="csr")
    expected = factor.forward(right.toarray())
    found = factor.forward_sparse(right)
    assert np.allclose(found.toarray(), expected, rtol=1e-12, atol=1e-12 * np.abs(expected).max())
    assert found.nnz < 0.7 * expected.size
    assert factor.forward_sparse(sp.csr_matrix((n, 2))).nnz == 0


def test_a_singular_matrix_is_refused(matrix):
    n = matrix.shape[0]
    with pytest.raises(np.linalg.LinAlgError, match="not positive definite"):
        Factor(sp.csr_matrix(matrix - 1e3 * sp.eye_array(n) * matrix.max()))


def test_flexibility_of_few_rows_is_that_of_whole_solves(matrix, factor):
    rows = RANDOM.choice(matrix.shape[0], 12, replace=False)
    loads = sp.csc_matrix(
        (RANDOM.standard_normal(12), (rows, np.arange(12) % 5)), shape=(matrix.shape[0], 5)
    )
    expected = loads.T @ factor.solve(loads.toarray())
    found = flexibility(matrix, loads)
    assert np.abs(found - expected).max() < 1e-12 * np.abs(expected).max()
    assert np.array_equal(found, found.T)
