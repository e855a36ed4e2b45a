r"""Elimination of a sector's interior, the same for all sectors.

With the interior i and what is beyond it, b: the borders at both ends of a sector and multipliers
of its ties, whose rows and columns stand in the matrix like stiffness,

    [K_ii K_ib; K_bi K_bb] = [L 0; V^T I] [I 0; 0 S] [L^T V; 0 I],
    K_ii = L L^T,  V = L^{-1} K_ib,  S = K_bb - V^T V.

It is a multifrontal factorisation stopped before the border, each front's diagonal block inverted
and taken into what is below it, so that a front is one product either way. One small factor serves
columns of all sectors and vectors together.
Source: Duff, Reid 1983, ACM TOMS 9:302.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.linalg.blas import dsyrk, dtrsm
from scipy.linalg.lapack import dpotrf, dtrtri

from flexgear.model.errors import FlexgearError
from flexgear.structures.linalg.dissection import Elimination
from flexgear.structures.linalg.sparse_rows import subtract_rows

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

LEAF = 32  # nodes of three dofs in a front that is not cut further
_NODE = 3


class Interior:
    """Factor of K_ii with the rows of the border.

    rest: S (b, b), symmetric.
    """

    def __init__(self, matrix: sp.csr_matrix, tree: Elimination) -> None:
        """matrix: (i + b, i + b), its interior already in the tree's order of nodes."""
        self._starts = _NODE * tree.starts
        self._parents = tree.parents
        self.size = int(self._starts[-1])
        self._borders = self._with_reach(matrix, tree)
        self._factors, self.rest = self._factorise(matrix)

    @property
    def entries(self) -> int:
        """Numbers stored in the factor."""
        return sum(p.size for p in self._factors)

    def forward(self, x: Array) -> None:
        """x = [g_i; g_b] (i + b, k) becomes [L^{-1} g_i; g_b - V^T L^{-1} g_i]."""
        starts, borders = self._starts, self._borders
        room = self._room(x.shape[1])
        for k, factor in enumerate(self._factors):
            own, size = x[starts[k] : starts[k + 1]], factor.shape[1]
            moved = np.matmul(factor, own, out=room[: len(factor)])
            own[:] = moved[:size]
            if len(borders[k]):
                subtract_rows(x, borders[k], moved[size:])

    def backward(self, x: Array) -> None:
        """x = [f; x_b] (i + b, k) becomes [L^{-T} (f - V x_b); x_b]."""
        starts, borders = self._starts, self._borders
        room = self._room(x.shape[1])
        for k in range(len(self._factors) - 1, -1, -1):
            factor, size = self._factors[k], self._factors[k].shape[1]
            own, front = x[starts[k] : starts[k + 1]], room[: len(factor)]
            np.negative(own, out=front[:size])
            # "clip" writes straight into the room, "raise" by way of a copy
            np.take(x, borders[k], 0, out=front[size:], mode="clip")
            np.matmul(factor.T, front, out=own)
            np.negative(own, out=own)

    def _room(self, columns: int) -> Array:
        """For the rows of the largest front."""
        return np.empty((max(map(len, self._factors), default=0), columns))

    def _with_reach(self, matrix: sp.csr_matrix, tree: Elimination) -> list[Ints]:
        """Later dofs that each front's elimination couples, those beyond the interior included."""
        beyond = matrix[: self.size, self.size :].tocsr()
        reach: list[Ints] = [np.zeros(0, dtype=np.int64)] * len(tree.parents)
        for k, parent in enumerate(tree.parents):
            begin, end = beyond.indptr[self._starts[k : k + 2]]
            reach[k] = np.union1d(reach[k], beyond.indices[begin:end])
            if parent >= 0:
                reach[parent] = np.union1d(reach[parent], reach[k])
        inside = ((_NODE * b[:, None] + np.arange(_NODE)).ravel() for b in tree.borders)
        return [
            np.concatenate([near, self.size + far]) for near, far in zip(inside, reach, strict=True)
        ]

    def _factorise(self, matrix: sp.csr_matrix) -> tuple[list[Array], Array]:
        """[I; L21] L11^{-1} of every front, and what is left for the border."""
        size = self.size
        lower = sp.tril(matrix).tocsc()
        rest = lower[size:, size:].toarray()
        local = np.zeros(matrix.shape[0], dtype=np.int64)
        waiting: dict[int, list[tuple[Ints, Array]]] = {}
        factors = []
        for k, parent in enumerate(self._parents):
            begin, end = self._starts[k], self._starts[k + 1]
            own, border = end - begin, self._borders[k]
            local[begin:end] = np.arange(own)
            local[border] = own + np.arange(len(border))
            front = np.zeros((own + len(border), own + len(border)), order="F")
            columns = lower[:, begin:end]
            front[local[columns.indices], np.repeat(np.arange(own), np.diff(columns.indptr))] = (
                columns.data
            )
            for index, update in waiting.pop(k, ()):
                at = local[index]
                front[np.ix_(at, at)] += update
            diagonal, info = dpotrf(front[:own, :own], lower=1, clean=1)
            if info:
                raise FlexgearError(
                    "the stiffness matrix of a sector is singular: its mesh falls into pieces or "
                    "has cells that hang on an edge"
                )
            below = dtrsm(1.0, diagonal, front[own:, :own], side=1, lower=1, trans_a=1)
            inverse = dtrtri(diagonal, lower=1)[0]
            factors.append(np.vstack([inverse, below @ inverse]))
            update = np.tril(dsyrk(-1.0, below, beta=1.0, c=front[own:, own:], lower=1))
            if parent >= 0:
                waiting.setdefault(int(parent), []).append((border, update))
            elif len(border):
                at = border - size
                rest[np.ix_(at, at)] += update
        return factors, np.tril(rest) + np.tril(rest, -1).T
