"""Elimination of inner rows: Schur complement and both halves, against dense algebra."""

import numpy as np
import pytest
import scipy.sparse as sp
from plain_meshes import annulus

from flexgear.structures.fem import FeModel
from flexgear.structures.linalg.sparse import Elimination, minimum_degree_order

INNER, OUTER, TIES = 300, 42, 6
RANDOM = np.random.default_rng(5)


@pytest.fixture(scope="module")
def parts():
    """K (i + b, i + b) of a body, its inner rows in an order that fills little; C (c, i + b)."""
    model = FeModel(annulus((12, 1, 2), teeth=12), 1.0, 0.3, 1.0)
    stiffness = (model.stiffness + 0.1 * model.mass).tocsr()[: INNER + OUTER, : INNER + OUTER]
    graph = stiffness[:INNER, :INNER]
    order = np.concatenate([minimum_degree_order(graph), INNER + np.arange(OUTER)])
    constraints = sp.random_array((TIES, INNER + OUTER), density=0.1, random_state=RANDOM)
    return stiffness[order][:, order].tocsr(), constraints.tocsr()


@pytest.fixture(scope="module")
def dense(parts):
    stiffness, constraints = parts
    return sp.bmat([[stiffness, constraints.T], [constraints, None]]).toarray()


@pytest.fixture(scope="module")
def eliminated(parts):
    stiffness, constraints = parts
    shift = np.diag(stiffness.diagonal()[INNER:])
    return Elimination(stiffness, constraints, INNER, shift)


def test_what_is_left_is_the_schur_complement(eliminated, dense):
    i = INNER
    schur = dense[i:, i:] - dense[i:, :i] @ np.linalg.solve(dense[:i, :i], dense[:i, i:])
    assert np.abs(eliminated.rest - schur).max() < 1e-12 * np.abs(schur).max()


@pytest.mark.parametrize("columns", [1, 3, 40])
def test_both_halves(eliminated, dense, columns):
    i, right = INNER, RANDOM.standard_normal((len(dense), columns))
    x = right.copy()
    eliminated.forward(x)
    lower = np.linalg.cholesky(dense[:i, :i])
    half = np.linalg.solve(lower, right[:i])
    assert np.allclose(x[:i], half, atol=1e-11 * np.abs(half).max())
    gathered = right[i:] - dense[i:, :i] @ np.linalg.solve(dense[:i, :i], right[:i])
    assert np.abs(x[i:] - gathered).max() < 1e-11 * np.abs(gathered).max()
    x[i:] = right[i:]
    eliminated.backward(x)
    expected = np.linalg.solve(dense[:i, :i], right[:i] - dense[:i, i:] @ right[i:])
    assert np.abs(x[:i] - expected).max() < 1e-11 * np.abs(expected).max()
    assert np.array_equal(x[i:], right[i:])


def test_the_order_saves_fill(parts):
    stiffness, constraints = parts
    shuffled = np.concatenate([RANDOM.permutation(INNER), INNER + np.arange(OUTER)])
    shift = np.diag(stiffness.diagonal()[INNER:])
    ordered = Elimination(stiffness, constraints, INNER, shift).entries
    other = stiffness[shuffled][:, shuffled].tocsr()
    assert ordered < 0.8 * Elimination(other, constraints[:, shuffled], INNER, shift).entries


def test_inner_rows_that_are_not_definite_are_refused(parts):
    stiffness, constraints = parts
    lowered = stiffness - 10 * stiffness.max() * sp.eye_array(INNER + OUTER)
    with pytest.raises(np.linalg.LinAlgError):
        Elimination(lowered.tocsr(), constraints, INNER, np.eye(OUTER))
