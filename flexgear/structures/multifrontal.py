r"""Multifrontal Cholesky factorisation of a sparse symmetric positive definite matrix.

Each front gathers the rows it eliminates and what its children left for their borders,

    [F11 F21^T; F21 F22],  F11 = L11 L11^T,  L21 = F21 L11^{-T},  S = F22 - L21 L21^T,

and hands S to its parent. All work is dense (`fronts.py`), so that many right-hand sides cost
little more than reading the factor once. Nodes of three dofs are kept together.
Fronts are too small for a threaded BLAS (its threads would wait for each other most of the time):
it runs on one thread, and the tree's branches are shared out among threads instead
(`tree_tasks.py`). Solving up the tree, too, each front hands what it leaves to its parent, so that
branches touch nothing in common, and sums are the same on any number of threads.
Source: Duff, Reid 1983, ACM TOMS 9:302; Liu 1992, SIAM Review 34:82.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from flexgear.structures.dissection import dissect
from flexgear.structures.fronts import (
    Panel,
    add_rows,
    eliminated,
    extend,
    gather,
    put_rows,
    take_rows,
)
from flexgear.structures.tall import THREADS, single_threaded_blas
from flexgear.structures.tree_tasks import tree_tasks

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

_LEAF = 64  # nodes of three dofs in a front that is not cut further
_NODE = 3


class Multifrontal:
    """L L^T of a matrix (3n, 3n), nodes at coordinates (n, 3)."""

    name = "scipy"

    def __init__(
        self, matrix: sp.csr_matrix, coordinates: Array, leaf: int = _LEAF, threads: int = THREADS
    ) -> None:
        blocks = matrix.tobsr(blocksize=(_NODE, _NODE))
        n = blocks.shape[0] // _NODE
        graph = sp.csr_matrix(
            (np.ones(len(blocks.indices), dtype=np.int8), blocks.indices, blocks.indptr), (n, n)
        )
        tree = dissect(graph, coordinates, leaf)
        self._order = _dofs(tree.order)
        borders = [_dofs(b) for b in tree.borders]
        self._starts = _NODE * tree.starts
        self._borders = [self._order[b] for b in borders]  # dofs
        self._children = _children(tree.parents)
        self._places = self._in_parents(borders, tree.parents)
        own, beyond = np.diff(self._starts), np.array([len(b) for b in borders])
        self._threads = threads
        self._tasks = tree_tasks(tree.parents, own * (own + beyond) ** 2.0, threads)
        with single_threaded_blas():
            self._panels = self._factorise(matrix)

    @property
    def entries(self) -> int:
        """Numbers stored in the factor."""
        return sum(panel.entries for panels in self._panels for panel in panels)

    def solve(self, right: Array) -> Array:
        """x (3n, k) with A x = right."""
        return self.backward(self.forward(right))

    def solve_sparse(self, right: sp.csr_matrix) -> Array:
        """The same of a sparse right."""
        return self.backward(self.forward_sparse(right).toarray())

    def forward(self, right: Array) -> Array:
        """f = L^{-1} right (3n, k), rows in the order of elimination."""
        given = np.ascontiguousarray(right, dtype=float).reshape(len(right), -1)
        f = np.empty_like(given)
        left: dict[int, Array] = {}  # by fronts, for their parents

        def run(fronts: range) -> None:
            for k in fronts:
                begin, end = self._starts[k], self._starts[k + 1]
                take_rows(given, self._order[begin:end], f[begin:end])
                self._climb(k, f[begin:end], left)

        with single_threaded_blas():
            self._tasks.climb(run, self._threads)
        return f.reshape(right.shape)

    def forward_sparse(self, right: sp.csr_matrix) -> sp.csr_matrix:
        """The same of a sparse matrix (3n, k): fronts that it does not reach are not visited."""
        right = sp.csr_matrix(right)[self._order]  # rows as they are eliminated
        reached = np.zeros(len(self._panels), dtype=bool)
        for k, children in enumerate(self._children):
            entries = right.indptr[self._starts[k + 1]] - right.indptr[self._starts[k]]
            reached[k] = entries > 0 or reached[children].any()
        if not reached.any():
            return right
        found: dict[int, sp.coo_matrix] = {}
        left: dict[int, Array] = {}

        def run(fronts: range) -> None:
            for k in fronts:
                if reached[k]:
                    given = right[self._starts[k] : self._starts[k + 1]].toarray()
                    self._climb(k, given, left)
                    found[k] = sp.coo_matrix(given)

        with single_threaded_blas():
            self._tasks.climb(run, self._threads)
        parts = [found[k] for k in sorted(found)]
        rows = [found[k].row + self._starts[k] for k in sorted(found)]
        data, columns = (np.concatenate([getattr(p, n) for p in parts]) for n in ("data", "col"))
        return sp.csr_matrix((data, (np.concatenate(rows), columns)), right.shape)

    def backward(self, f: Array) -> Array:
        """x = L^{-T} f (3n, k)."""
        given = np.ascontiguousarray(f, dtype=float).reshape(len(f), -1)
        x = np.empty_like(given)

        def run(fronts: range) -> None:
            for k in fronts:
                self._down(k, given, x)

        with single_threaded_blas():
            self._tasks.descend(run, self._threads)
        return x.reshape(f.shape)

    def _climb(self, k: int, own: Array, left: dict[int, Array]) -> None:
        """L y = own (w, k) in front k, in place; children's remains are added first."""
        remains = [(c, left.pop(c)) for c in self._children[k] if c in left]
        if not remains and not own.any():  # loads on a few patches reach few fronts
            return
        x = np.zeros((len(own) + len(self._borders[k]), own.shape[1]))
        x[: len(own)] = own
        for child, rest in remains:
            add_rows(x, self._places[child], rest)
        for panel in self._panels[k]:
            panel.forward(x)
        own[:] = x[: len(own)]
        if len(x) > len(own):
            left[k] = x[len(own) :]

    def _down(self, k: int, f: Array, x: Array) -> None:
        """L^T y = x in front k; what lies above is done."""
        begin, end = self._starts[k], self._starts[k + 1]
        own = end - begin
        y = np.empty((own + len(self._borders[k]), f.shape[1]))
        y[:own] = f[begin:end]
        take_rows(x, self._borders[k], y[own:])
        for panel in reversed(self._panels[k]):
            panel.backward(y)
        put_rows(x, self._order[begin:end], y[:own])

    def _in_parents(self, borders: list[Ints], parents: Ints) -> list[Ints]:
        """Places of every front's border in its parent's front."""
        places = []
        for border, parent in zip(borders, parents, strict=True):
            begin, end = self._starts[parent], self._starts[parent + 1]
            inside = border < end
            further = np.searchsorted(borders[parent], border[~inside]) + (end - begin)
            places.append(np.concatenate([border[inside] - begin, further]).astype(np.int64))
        return places

    def _factorise(self, matrix: sp.csr_matrix) -> list[tuple[Panel, ...]]:
        """Panels of every front."""
        panels: list[tuple[Panel, ...]] = [()] * len(self._borders)
        left: dict[int, Array] = {}

        def run(fronts: range) -> None:
            local = np.full(len(self._order), -1)
            for k in fronts:
                rows, border = self._order[self._starts[k] : self._starts[k + 1]], self._borders[k]
                own, size = len(rows), len(rows) + len(border)
                local[rows] = np.arange(own)
                local[border] = np.arange(own, size)
                front = np.zeros((size, size))
                gather(front, matrix.indptr, matrix.indices, matrix.data, rows, local)
                local[rows] = local[border] = -1
                for child in self._children[k]:
                    extend(front, self._places[child], left.pop(child))
                panels[k], rest = eliminated(front, own)
                if rest is not None:
                    left[k] = rest

        self._tasks.climb(run, self._threads)
        return panels


def _dofs(nodes: Ints) -> Ints:
    """Dofs (3n,) of nodes (n,)."""
    return np.asarray((_NODE * nodes[:, None] + np.arange(_NODE)).ravel())


def _children(parents: Ints) -> list[list[int]]:
    """Of every front, in rising order."""
    children: list[list[int]] = [[] for _ in parents]
    for k, parent in enumerate(parents):
        if parent >= 0:
            children[parent].append(k)
    return children
