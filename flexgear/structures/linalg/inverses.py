"""Inverses of dense symmetric and Hermitian matrices, by LAPACK."""

from __future__ import annotations

import numpy as np
import scipy.linalg as sla
from numpy.typing import NDArray
from scipy.linalg import lapack


def scaled_inverse(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Inverse of a symmetric positive definite matrix whose rows have different units.

    It is scaled to unit diagonal first. Raises numpy.linalg.LinAlgError where it is not definite.
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


def hermitian_inverse(matrix: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """Inverse of a positive definite Hermitian matrix, its lower triangle.

    Raises numpy.linalg.LinAlgError where it is not definite.
    """
    factor = _checked(*lapack.zpotrf(matrix, lower=1))
    return _checked(*lapack.zpotri(factor, lower=1, overwrite_c=1))


def signed_hermitian_inverse(
    matrix: NDArray[np.complex128],
) -> tuple[NDArray[np.complex128], int]:
    """Inverse of a regular Hermitian matrix, its lower triangle, and how many negative eigenvalues.

    A = L D L^H has as many as D (Sylvester); of Bunch and Kaufman's 2 x 2 blocks, one each.
    Raises numpy.linalg.LinAlgError where the matrix is not regular.
    """
    room = int(lapack.zhetrf_lwork(len(matrix), lower=1)[0].real)
    factor, pivots, info = lapack.zhetrf(matrix, lower=1, lwork=room)
    _checked(factor, info)
    single = pivots > 0
    negative = int((factor.diagonal().real[single] < 0).sum() + (~single).sum() // 2)
    return _checked(*lapack.zhetri(factor, pivots, lower=1, overwrite_a=1)), negative


def _checked(result: NDArray[np.complex128], info: int) -> NDArray[np.complex128]:
    if info:
        raise np.linalg.LinAlgError(f"LAPACK stopped at row {info}")
    return result
