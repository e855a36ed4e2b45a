"""Schur complements and flexibilities of FE models against dense algebra."""

import numpy as np
import pytest
import scipy.sparse as sp
from plain_meshes import annulus

from flexgear.structures.fem.assembly import FeModel
from flexgear.structures.linalg.schur import flexibility, schur_complement

RANDOM = np.random.default_rng(5)


@pytest.fixture(scope="module")
def matrix():
    """Two bodies that nothing connects, and single rows without coupling."""
    model = FeModel(annulus((12, 1, 2), teeth=12), 1.0, 0.3, 1.0)
    body = model.stiffness + 0.1 * model.mass
    return sp.block_diag([body, 3.0 * body, sp.eye_array(2)], format="csr")


@pytest.mark.parametrize("count", [1, 40, "all but one", "all"])
def test_schur_complement_is_that_of_dense_algebra(matrix, count):
    """Whatever rows are kept, in any order: some dofs of a node, of one body or of both."""
    n = matrix.shape[0]
    kept = RANDOM.permutation(n)[: {"all but one": n - 1, "all": n}.get(count, count)]
    dense = np.linalg.inv(np.linalg.inv(matrix.toarray())[np.ix_(kept, kept)])
    found = schur_complement(matrix, kept)
    assert np.abs(found - dense).max() < 1e-11 * np.abs(dense).max()
    assert np.array_equal(found, found.T)


def test_flexibility_is_the_displacement_of_loads_by_loads(matrix):
    loads = sp.random_array((matrix.shape[0], 9), density=0.01, random_state=RANDOM).tocsc()
    dense = loads.T @ np.linalg.solve(matrix.toarray(), loads.toarray())
    assert flexibility(matrix, loads) == pytest.approx(dense, rel=1e-10, abs=1e-13 * dense.max())


@pytest.mark.parametrize("kept", [[0], [0, 1, 2], list(range(50))])
def test_a_matrix_that_is_not_definite_is_refused(matrix, kept):
    lowered = matrix - 10 * matrix.max() * sp.eye_array(matrix.shape[0])
    with pytest.raises(np.linalg.LinAlgError):
        schur_complement(lowered.tocsr(), np.array(kept))
