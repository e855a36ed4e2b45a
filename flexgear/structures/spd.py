"""Inverse of a small dense matrix whose rows have different units."""

from __future__ import annotations

import numpy as np
import scipy.linalg as sla
from numpy.typing import NDArray


def scaled_inverse(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Inverse of a symmetric positive definite matrix, scaled to unit diagonal first.

    Raises numpy.linalg.LinAlgError where it is not definite.
    """
    if not len(matrix):
        return matrix
    scale = 1 / np.sqrt(np.diag(matrix))
    factor = sla.cho_factor(scale[:, None] * matrix * scale, lower=True)
    inverse = sla.cho_solve(factor, np.eye(len(matrix)))
    inverse = 0.5 * (inverse + inverse.T)
    return scale[:, None] * inverse * scale
