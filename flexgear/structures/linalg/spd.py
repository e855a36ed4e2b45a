"""Inverse of a small dense symmetric matrix whose rows have different units."""

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


def balanced_inverse(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Inverse of a symmetric regular matrix, its rows scaled to largest entries near one first."""
    scale = np.ones(len(matrix))
    for _ in range(3):
        scale /= np.sqrt(np.abs(scale[:, None] * matrix * scale).max(axis=1, initial=0.0))
    inverse = np.linalg.inv(scale[:, None] * matrix * scale)
    inverse = 0.5 * (inverse + inverse.T)
    return scale[:, None] * inverse * scale
