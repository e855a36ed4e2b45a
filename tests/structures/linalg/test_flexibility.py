"""Flexibilities of FE models under loads on few rows against dense algebra."""

import numpy as np
import pytest
import scipy.sparse as sp
from plain_meshes import annulus

from flexgear.structures.fem.assembly import FeModel
from flexgear.structures.linalg.sparse import flexibility

RANDOM = np.random.default_rng(5)


@pytest.fixture(scope="module")
def matrix():
    """Two bodies that nothing connects, and single rows without coupling."""
    model = FeModel(annulus((12, 1, 2), teeth=12), 1.0, 0.3, 1.0)
    body = model.stiffness + 0.1 * model.mass
    return sp.block_diag([body, 3.0 * body, sp.eye_array(2)], format="csr")


@pytest.mark.parametrize("count", [1, 40, "all but one", "all"])
def test_flexibility_is_the_displacement_of_loads_by_loads(matrix, count):
    """Whatever rows are loaded, in any order: some dofs of a node, of one body or of both."""
    n = matrix.shape[0]
    rows = RANDOM.permutation(n)[: {"all but one": n - 1, "all": n}.get(count, count)]
    loads = sp.random_array((len(rows), 9), density=0.3, random_state=RANDOM).tocoo()
    loads = sp.csc_matrix((loads.data, (rows[loads.row], loads.col)), (n, 9))
    dense = loads.T @ np.linalg.solve(matrix.toarray(), loads.toarray())
    computed = flexibility(matrix, loads)
    assert computed == pytest.approx(dense, rel=1e-10, abs=1e-13 * dense.max())
    assert np.array_equal(computed, computed.T)


@pytest.mark.parametrize("loaded", [1, 3, 50])
def test_a_matrix_that_is_not_definite_is_refused(matrix, loaded):
    n = matrix.shape[0]
    lowered = matrix - 10 * matrix.max() * sp.eye_array(n)
    with pytest.raises(np.linalg.LinAlgError):
        flexibility(lowered.tocsr(), sp.eye_array(n, loaded).tocsc())
