"""Sparse factors and elimination against dense algebra."""

import sys
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
import scipy.sparse as sp
from plain_meshes import annulus
from threadpoolctl import threadpool_info

from flexgear.structures.fem.assembly import FeModel
from flexgear.structures.linalg.sparse import (
    Elimination,
    Factor,
    factor_in_order,
    nested_dissection_order,
)

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


def test_a_singular_matrix_is_refused(matrix):
    n = matrix.shape[0]
    with pytest.raises(np.linalg.LinAlgError, match="not positive definite"):
        Factor(sp.csr_matrix(matrix - 1e3 * sp.eye_array(n) * matrix.max()))


INNER, OUTER, TIES = 300, 42, 6


@pytest.fixture(scope="module")
def parts():
    """K (i + b, i + b) of a body, its inner rows in an order that fills little; C (c, i + b)."""
    model = FeModel(annulus((12, 1, 2), teeth=12), 1.0, 0.3, 1.0)
    stiffness = (model.stiffness + 0.1 * model.mass).tocsr()[: INNER + OUTER, : INNER + OUTER]
    graph = stiffness[:INNER, :INNER]
    order = np.concatenate([nested_dissection_order(graph), INNER + np.arange(OUTER)])
    constraints = sp.random_array((TIES, INNER + OUTER), density=0.1, random_state=RANDOM)
    return stiffness[order][:, order].tocsr(), constraints.tocsr()


def test_the_order_saves_fill(parts):
    inner, shuffled = parts[0][:INNER, :INNER], RANDOM.permutation(INNER)
    other = inner[shuffled][:, shuffled].tocsr()
    assert factor_in_order(inner).nnz < 0.8 * factor_in_order(other).nnz


def test_inner_rows_that_are_not_definite_are_refused(parts):
    stiffness, constraints = parts
    lowered = stiffness - 10 * stiffness.max() * sp.eye_array(INNER + OUTER)
    with pytest.raises(np.linalg.LinAlgError):
        Elimination(lowered.tocsr(), constraints, INNER, np.eye(OUTER))


def test_threads_do_not_change_the_order_of_one_another():
    """Ring and carrier are reduced in two threads; CHOLMOD's options are those of the process."""
    matrix = sp.csr_matrix(
        sp.diags([-np.ones(299), 2.5 * np.ones(300), -np.ones(299)], [-1, 0, 1])
        + sp.coo_matrix((np.full(2, 0.1), ([0, 299], [299, 0])), (300, 300))
    )
    dense = matrix.toarray()
    lower = np.linalg.cholesky(dense)

    def in_order(_):
        return abs(factor_in_order(matrix).toarray() - lower).max()

    def solved(_):
        right = np.ones((300, 1))
        return abs(dense @ Factor(matrix).solve(right) - right).max()

    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    try:
        with ThreadPoolExecutor(4) as pool:
            errors = [pool.submit(f, i) for i in range(200) for f in (in_order, solved)]
            assert max(e.result() for e in errors) < 1e-12
    finally:
        sys.setswitchinterval(interval)


def test_cholmod_computes_with_the_instructions_of_this_processor():
    """Its old OpenBLAS knows no later processor by itself."""
    kernels = {
        "cvxopt" in library["filepath"]: library["architecture"].lower()
        for library in threadpool_info()
        if library["internal_api"] == "openblas"
    }
    of_numpy = {"cooperlake": "skylakex", "sapphirerapids": "skylakex"}.get(
        kernels[False], kernels[False]
    )
    if of_numpy not in ("haswell", "zen", "skylakex"):
        pytest.skip(f"OpenBLAS 0.3.15 has no kernels of {of_numpy}")
    assert kernels[True] == of_numpy
