r"""Nested dissection by coordinates: an elimination order and tree for a sparse factorisation.

A set of nodes is cut across that of its principal axes whose plane at the median has the fewest
nodes beside it (not always the longest axis: teeth are meshed finer than a ring's section), by the
smallest separator that leaves either side a fair share of the nodes (`separators.py`). Where the
sides touch across those between, by the smallest set that meets all edges between the halves: by
Koenig's theorem a minimum vertex cover of that bipartite graph, read off a maximum matching.
Source: George 1973, SIAM J. Numer. Anal. 10:345; Koenig 1931.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import maximum_bipartite_matching

from flexgear.structures.linalg.separators import HIGH, LOW, separator

Ints = NDArray[np.int64]

_SHARE = 0.3  # of the nodes, at least, that lie on either side


@dataclass(frozen=True, eq=False)
class Elimination:
    """Fronts in elimination order, children before parents.

    order: (n,) nodes in elimination order; starts: (f + 1,) front k eliminates
    order[starts[k]:starts[k+1]]; borders: for each front the later nodes, as positions in the
    order, rising, that its elimination couples; parents: (f,) front that receives it, -1 for none.
    """

    order: Ints
    starts: Ints
    borders: tuple[Ints, ...]
    parents: Ints


def dissect(graph: sp.csr_matrix, coordinates: NDArray[np.float64], leaf: int) -> Elimination:
    """Elimination of a symmetric graph (n, n) with nodes at coordinates (n, 3)."""
    n = graph.shape[0]
    number = np.full(n, -1)
    fronts: list[Ints] = []

    def split(nodes: Ints) -> None:
        if len(nodes) <= leaf:
            if len(nodes):
                fronts.append(nodes)
            return
        low, high, between = _best_cut(graph, coordinates, nodes, number)
        split(low)
        split(high)
        if len(between):
            fronts.append(between)

    split(np.arange(n))
    order = np.concatenate(fronts)
    starts = np.concatenate([[0], np.cumsum([len(f) for f in fronts])])
    return _symbolic(graph, order, starts)


def _best_cut(
    graph: sp.csr_matrix, coordinates: NDArray[np.float64], nodes: Ints, number: Ints
) -> tuple[Ints, Ints, Ints]:
    """Two sides and a small separator; `number` is -1 on entry and on exit."""
    count = len(nodes)
    number[nodes] = np.arange(count)
    rows, columns = (number[ends] for ends in _edges(graph, nodes))
    number[nodes] = -1
    inside = columns >= 0
    rows, columns = rows[inside], columns[inside]
    x = coordinates[nodes]
    ranks, beside = [], []
    for axis in np.linalg.eigh(np.cov(x.T))[1].T[::-1]:
        rank = np.empty(count, dtype=np.int64)
        rank[np.argsort(x @ axis, kind="stable")] = np.arange(count)
        low = rank < count // 2
        near = np.zeros(count, dtype=bool)
        near[rows[low[rows] & ~low[columns]]] = True
        ranks.append(rank)
        beside.append(int(near.sum()))
    rank = ranks[int(np.argmin(beside))]
    least = int(_SHARE * count)
    part = separator(
        np.where(rank < least, LOW, np.where(rank >= count - least, HIGH, 0)), rows, columns
    )
    if part is None:
        part = np.where(rank < count // 2, 1, 2).astype(np.int8)
        crossing = (part[rows] == 1) & (part[columns] == 2)
        part[_vertex_cover(rows[crossing], columns[crossing])] = 3
    low_side, high_side, between = (nodes[part == p] for p in (1, 2, 3))
    return low_side, high_side, between


def _edges(graph: sp.csr_matrix, nodes: Ints) -> tuple[Ints, Ints]:
    """All entries (row, column) of the graph in the rows of some nodes."""
    begin, end = graph.indptr[nodes], graph.indptr[nodes + 1]
    counts = end - begin
    shift = np.repeat(begin - np.concatenate([[0], np.cumsum(counts)[:-1]]), counts)
    columns = graph.indices[np.arange(counts.sum()) + shift]
    return np.repeat(nodes, counts), columns.astype(np.int64)


def _vertex_cover(rows: Ints, columns: Ints) -> Ints:
    """Minimum set of nodes that meets every edge rows[i] - columns[i] of a bipartite graph."""
    left, i = np.unique(rows, return_inverse=True)
    right, j = np.unique(columns, return_inverse=True)
    if not len(left):
        return left
    graph = sp.csr_matrix((np.ones(len(i), dtype=np.int8), (i, j)), (len(left), len(right)))
    match = maximum_bipartite_matching(graph, perm_type="column")  # row -> column or -1
    partner = np.full(len(right), -1)
    partner[match[match >= 0]] = np.flatnonzero(match >= 0)
    seen_left = match < 0  # reached by alternating paths from unmatched rows
    seen_right = np.zeros(len(right), dtype=bool)
    frontier = np.flatnonzero(seen_left)
    while len(frontier):
        _, reached = _edges(graph, frontier)
        reached = np.unique(reached[~seen_right[reached]])
        seen_right[reached] = True
        frontier = partner[reached]
        frontier = frontier[~seen_left[frontier]]
        seen_left[frontier] = True
    return np.concatenate([left[~seen_left], right[seen_right]])


def _symbolic(graph: sp.csr_matrix, order: Ints, starts: Ints) -> Elimination:
    """Borders and parents of the fronts of an order."""
    place = np.empty_like(order)
    place[order] = np.arange(len(order))
    count = len(starts) - 1
    front_of = np.repeat(np.arange(count), np.diff(starts))
    borders: list[Ints] = []
    parents = np.full(count, -1)
    children: list[list[int]] = [[] for _ in range(count)]
    for k in range(count):
        end = starts[k + 1]
        _, near = _edges(graph, order[starts[k] : end])
        parts = [place[near]] + [borders[c] for c in children[k]]
        border = np.unique(np.concatenate(parts))
        border = border[border >= end]
        borders.append(border)
        if len(border):
            parents[k] = front_of[border[0]]
            children[parents[k]].append(k)
    return Elimination(order, starts, tuple(borders), parents)
