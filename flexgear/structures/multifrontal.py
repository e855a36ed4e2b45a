r"""Multifrontal Cholesky factorisation of a sparse symmetric positive definite matrix.

Each front gathers the rows it eliminates and what its children left for their borders,

    [F11 F21^T; F21 F22],  F11 = L11 L11^T,  L21 = F21 L11^{-T},  S = F22 - L21 L21^T,

and hands S to its parent. All work is dense (SciPy's LAPACK and BLAS), so that many right-hand
sides cost little more than reading the factor once. Nodes of three dofs are kept together.
Fronts are too small for a threaded BLAS (its threads would wait for each other most of the time):
it runs on one thread, and blocks of right-hand sides are shared out among threads instead.
Source: Duff, Reid 1983, ACM TOMS 9:302.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise

import numba
import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.linalg.blas import dsyrk, dtrsm
from scipy.linalg.lapack import dpotrf, dtrtri

from flexgear.model.errors import FlexgearError
from flexgear.structures.dissection import dissect
from flexgear.structures.tall import THREADS, single_threaded_blas

_LEAF = 96  # nodes of three dofs in a front that is not cut further
_NODE = 3
Way = Callable[[NDArray[np.float64]], None]
_LEAST_COLUMNS = 32  # right-hand sides worth a thread


class Multifrontal:
    """L L^T of a matrix (3n, 3n), nodes at coordinates (n, 3)."""

    name = "scipy"

    def __init__(
        self, matrix: sp.csr_matrix, coordinates: NDArray[np.float64], leaf: int = _LEAF
    ) -> None:
        blocks = matrix.tobsr(blocksize=(_NODE, _NODE))
        n = blocks.shape[0] // _NODE
        graph = sp.csr_matrix(
            (np.ones(len(blocks.indices), dtype=np.int8), blocks.indices, blocks.indptr), (n, n)
        )
        self._tree = dissect(graph, coordinates, leaf)
        order = self._tree.order
        self._order = (_NODE * order[:, None] + np.arange(_NODE)).ravel()
        self._borders = [
            (_NODE * b[:, None] + np.arange(_NODE)).ravel() for b in self._tree.borders
        ]
        self._starts = _NODE * self._tree.starts
        with single_threaded_blas():
            self._factors = self._factorise(matrix)

    @property
    def entries(self) -> int:
        """Numbers stored in the factor."""
        return sum(a.size + b.size for a, b in self._factors)

    def solve(self, right: NDArray[np.float64]) -> NDArray[np.float64]:
        """x (3n, k) with A x = right."""
        return self.backward(self.forward(right))

    def forward(self, right: NDArray[np.float64]) -> NDArray[np.float64]:
        """f = L^{-1} right (3n, k), rows in the order of elimination."""
        x = np.asarray(right, dtype=float)[self._order]
        return self._by_columns(x, self._up)

    def backward(self, f: NDArray[np.float64]) -> NDArray[np.float64]:
        """x = L^{-T} f (3n, k)."""
        out = np.empty(f.shape)
        out[self._order] = self._by_columns(f, self._down)
        return out

    def _by_columns(self, x: NDArray[np.float64], way: Way) -> NDArray[np.float64]:
        """way on x (3n, k), whose columns are shared out among threads; uses x up."""
        columns = x.reshape(len(x), -1)
        count = columns.shape[1]
        parts = max(1, min(THREADS, count // _LEAST_COLUMNS))
        if parts == 1:
            columns = np.ascontiguousarray(columns)
            with single_threaded_blas():
                way(columns)
            return columns.reshape(x.shape)
        borders = [count * p // parts for p in range(parts + 1)]

        def part(at: slice) -> None:
            mine = np.ascontiguousarray(columns[:, at])
            way(mine)
            columns[:, at] = mine

        with single_threaded_blas(), ThreadPoolExecutor(parts) as pool:
            list(pool.map(part, [slice(a, b) for a, b in pairwise(borders)]))
        return columns.reshape(x.shape)

    def _up(self, x: NDArray[np.float64]) -> None:
        """L y = x up the tree; diagonal blocks are held inverted."""
        starts, borders = self._starts, self._borders
        rest = self._room(x.shape[1])
        for k, (inverse, below) in enumerate(self._factors):
            own = x[starts[k] : starts[k + 1]]
            if not own.any():  # loads on a few patches reach few fronts
                continue
            own[:] = inverse @ own
            if len(borders[k]):
                lost = np.matmul(below, own, out=rest[: len(borders[k])])
                subtract_rows(x, borders[k], lost)

    def _down(self, x: NDArray[np.float64]) -> None:
        """L^T y = x down the tree."""
        starts, borders = self._starts, self._borders
        rest = self._room(x.shape[1])
        for k in range(len(self._factors) - 1, -1, -1):
            inverse, below = self._factors[k]
            own = x[starts[k] : starts[k + 1]]
            if len(borders[k]):
                # "clip" writes straight into the room, "raise" by way of a copy
                near = np.take(x, borders[k], 0, out=rest[: len(borders[k])], mode="clip")
                own -= below.T @ near
            own[:] = inverse.T @ own

    def _room(self, columns: int) -> NDArray[np.float64]:
        """For the rows of the largest border."""
        return np.empty((max(map(len, self._borders), default=0), columns))

    def _factorise(
        self, matrix: sp.csr_matrix
    ) -> list[tuple[NDArray[np.float64], NDArray[np.float64]]]:
        """Inverse of L11 and L21 of every front."""
        permuted = sp.triu(matrix[self._order][:, self._order], format="csr")
        local = np.zeros(len(self._order), dtype=np.int64)
        waiting: dict[int, list[tuple[NDArray[np.int64], NDArray[np.float64]]]] = {}
        factors = []
        for k, parent in enumerate(self._tree.parents):
            begin, end = self._starts[k], self._starts[k + 1]
            own, border = end - begin, self._borders[k]
            local[begin:end] = np.arange(own)
            local[border] = own + np.arange(len(border))
            front = np.zeros((own + len(border), own + len(border)), order="F")
            rows = permuted[begin:end]
            first = np.repeat(np.arange(own), np.diff(rows.indptr))
            front[local[rows.indices], first] = rows.data
            for index, update in waiting.pop(k, ()):
                _extend(front, local[index], update)
            diagonal, info = dpotrf(front[:own, :own], lower=1, clean=1)
            if info:
                raise FlexgearError(
                    "the stiffness matrix is singular: the mesh falls into pieces or has cells "
                    "that hang on an edge"
                )
            below = dtrsm(1.0, diagonal, front[own:, :own], side=1, lower=1, trans_a=1)
            factors.append((dtrtri(diagonal, lower=1)[0], below))
            if parent >= 0:
                rest = dsyrk(-1.0, below, beta=1.0, c=front[own:, own:], lower=1)
                waiting.setdefault(int(parent), []).append((border, rest))
        return factors


@numba.njit(cache=True)  # type: ignore[untyped-decorator]
def _extend(
    front: NDArray[np.float64], at: NDArray[np.int64], update: NDArray[np.float64]
) -> None:  # pragma: no cover - compiled
    """front[at, at] += update, lower triangles; at rises."""
    for j in range(len(at)):
        column = at[j]
        for i in range(j, len(at)):
            front[at[i], column] += update[i, j]


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def subtract_rows(
    x: NDArray[np.float64], at: NDArray[np.int64], lost: NDArray[np.float64]
) -> None:  # pragma: no cover - compiled
    """x[at] -= lost, without a copy of x[at]."""
    for i in range(len(at)):
        row = at[i]
        for c in range(x.shape[1]):
            x[row, c] -= lost[i, c]
