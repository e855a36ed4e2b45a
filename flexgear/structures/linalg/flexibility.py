r"""Flexibility R^T K^{-1} R of a sparse matrix for many loads on few rows.

Loaded rows are eliminated last. With P K P^T = L L^T in that order W = L^{-1} P R has entries in
loaded rows only, and R^T K^{-1} R = W^T W, symmetric and never indefinite by construction.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from flexgear.structures.linalg.cholesky import Factor
from flexgear.structures.linalg.elimination import minimum_degree_order


def flexibility(matrix: sp.csr_matrix, loads: sp.csc_matrix) -> NDArray[np.float64]:
    """R^T K^{-1} R (k, k) of K (n, n), symmetric positive definite, and R (n, k).

    Raises numpy.linalg.LinAlgError where K is not positive definite.
    """
    loaded = np.zeros(matrix.shape[0], dtype=bool)
    loaded[loads.tocsc().indices] = True
    rest = np.flatnonzero(~loaded)
    first = rest[minimum_degree_order(matrix[rest][:, rest])] if len(rest) else rest
    factor = Factor(matrix, np.concatenate([first, np.flatnonzero(loaded)]))
    w = factor.forward_sparse(loads)
    return (w.T @ w).toarray()
