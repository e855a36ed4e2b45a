r"""Nested dissection by coordinates: an elimination order and tree for a sparse factorisation.

A set of nodes is cut across that of its principal axes whose cut at the median has the smallest
separator (not always the longest axis: teeth are meshed finer than a ring's section); among a few
cuts near the median the smallest separator counts. The separator of a cut is the smallest set of
nodes that meets all edges between the two sides: by Koenig's theorem a minimum vertex cover of
that bipartite graph, read off a maximum matching.
Source: George 1973, SIAM J. Numer. Anal. 10:345; Koenig 1931.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import maximum_bipartite_matching

Ints = NDArray[np.int64]

_CUTS = (0.44, 0.56)  # shares of the nodes on the lower side that are tried beside one half


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
    side = np.zeros(n, dtype=np.int8)
    fronts: list[Ints] = []

    def split(nodes: Ints) -> None:
        if len(nodes) <= leaf:
            if len(nodes):
                fronts.append(nodes)
            return
        low, high, between = _best_cut(graph, coordinates, nodes, side)
        split(low)
        split(high)
        if len(between):
            fronts.append(between)

    split(np.arange(n))
    order = np.concatenate(fronts)
    starts = np.concatenate([[0], np.cumsum([len(f) for f in fronts])])
    return _symbolic(graph, order, starts)


def _best_cut(
    graph: sp.csr_matrix, coordinates: NDArray[np.float64], nodes: Ints, side: NDArray[np.int8]
) -> tuple[Ints, Ints, Ints]:
    """Two sides and the smallest separator found; `side` is zero on entry and on exit."""
    x = coordinates[nodes]
    axes = np.linalg.eigh(np.cov(x.T))[1].T[::-1]
    rows, columns = _edges(graph, nodes)

    def parts(rank: Ints, share: float) -> tuple[Ints, Ints, Ints]:
        cut = int(share * len(nodes))
        side[nodes[rank[:cut]]] = 1
        side[nodes[rank[cut:]]] = 2
        crossing = (side[rows] == 1) & (side[columns] == 2)
        side[_vertex_cover(rows[crossing], columns[crossing])] = 3
        low, high, between = (nodes[side[nodes] == s] for s in (1, 2, 3))
        return low, high, between

    ranks = [np.argsort(x @ axis, kind="stable") for axis in axes]
    halves = [parts(rank, 0.5) for rank in ranks]
    chosen = min(range(len(axes)), key=lambda k: len(halves[k][2]))
    tried = [halves[chosen], *(parts(ranks[chosen], share) for share in _CUTS)]
    side[nodes] = 0
    return min(tried, key=lambda cut: len(cut[2]))


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
