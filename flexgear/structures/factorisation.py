"""Sparse symmetric factorisation, used many times: on SciPy alone always, MUMPS where installed."""

from __future__ import annotations

from typing import Literal, Protocol

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.linalg import splu

from flexgear.model.errors import FlexgearError
from flexgear.structures.multifrontal import Multifrontal
from flexgear.structures.threads import shared

_SPARSE, _BLOCKING = 20, 27  # MUMPS's ICNTL: form of right-hand sides; how many go together
_TOGETHER = 64
_ROWS = 4096  # rows copied at a time

Solver = Literal["auto", "scipy", "superlu", "mumps"]


class Factor(Protocol):
    """A factorised symmetric matrix."""

    name: str

    def solve(self, right: NDArray[np.float64]) -> NDArray[np.float64]:
        """x (n, k) with A x = right (n, k)."""

    def solve_sparse(self, right: sp.csc_matrix) -> NDArray[np.float64]:
        """The same of a sparse right."""


def factorise(
    matrix: sp.csr_matrix, coordinates: NDArray[np.float64], solver: Solver = "auto"
) -> Factor:
    """Factor of a symmetric positive definite matrix (3n, 3n) with nodes at coordinates (n, 3).

    "scipy": multifrontal on SciPy's BLAS (`multifrontal.py`); "superlu": SciPy's own sparse LU;
    "mumps": the optional extra; "auto": "scipy", which at 314 k dofs is as fast as MUMPS with less
    memory and three quarters of its processor time.
    """
    if solver == "mumps":
        if not mumps_available():
            raise FlexgearError("solver 'mumps' wants python-mumps: pip install 'flexgear[mumps]'")
        return _Mumps(matrix)
    if solver == "superlu":
        return _SuperLu(matrix)
    return Multifrontal(matrix, coordinates)


def mumps_available() -> bool:
    """Whether python-mumps imports."""
    try:
        import mumps  # noqa: F401
    except Exception:  # a wheel built for another numpy fails in several ways
        return False
    return True


class _SuperLu:
    """SuperLU in symmetric mode: minimum degree on A + A^T, no pivoting (A is definite)."""

    name = "superlu"

    def __init__(self, matrix: sp.csr_matrix) -> None:
        self._factor = splu(
            matrix.tocsc(),
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )

    def solve(self, right: NDArray[np.float64]) -> NDArray[np.float64]:
        return self._factor.solve(np.asarray(right, dtype=float))

    def solve_sparse(self, right: sp.csc_matrix) -> NDArray[np.float64]:
        return self.solve(right.toarray())


class _Mumps:
    """MUMPS, L D L^T."""

    name = "mumps"

    def __init__(self, matrix: sp.csr_matrix) -> None:
        import mumps

        self._context = mumps.Context()
        self._context.set_matrix(sp.triu(matrix).tocoo(), symmetric=True)
        self._context.factor(ordering="metis")
        self._settings = self._context.mumps_instance.icntl
        self._settings[_BLOCKING] = -_TOGETHER

    def solve(self, right: NDArray[np.float64]) -> NDArray[np.float64]:
        self._settings[_SPARSE] = 0
        return _arranged(self._context.solve(_arranged(right, "F"), overwrite_b=True), "C")

    def solve_sparse(self, right: sp.csc_matrix) -> NDArray[np.float64]:
        """The same of a sparse right (n, k): on the way up MUMPS visits few fronts."""
        return _arranged(self._context.solve(sp.csc_matrix(right)), "C")


def _arranged(x: NDArray[np.float64], order: Literal["C", "F"]) -> NDArray[np.float64]:
    """A copy of x (n, k) with contiguous rows ("C") or columns ("F"), made in pieces that fit."""
    out = np.empty(x.shape, order=order)

    def part(rows: slice) -> None:
        out[rows] = x[rows]

    shared(len(x), part, _ROWS)
    return out
