"""Schur complement of a sparse symmetric positive definite matrix onto few of its rows.

    [A_ii A_ib]
    [A_bi A_bb],   S = A_bb − A_bi A_ii⁻¹ A_ib

by the multifrontal method: inner rows are eliminated in an order of minimum degree, groups of them
with equal structure (supernodes) in one dense matrix each, the *front*: rows of the group, p, and
the rows they are coupled to then, r. With the Cholesky factor F_pp = L Lᵀ the remainder

    U = F_rr − F_rp F_pp⁻¹ F_pr

is added to the front of the next group that it reaches, and at last to A_bb. No factor is stored:
the memory needed is that of the remainders not yet added.

Flexibility Rᵀ K⁻¹ R for many loads on few rows is Wᵀ W, W = C⁻¹ R with S = C Cᵀ on the loaded rows:
symmetric and positive semidefinite by construction.
Source: Duff, Reid 1983, ACM TOMS 9:302; Liu 1990, SIAM J. Matrix Anal. Appl. 11:134 (elimination
tree, supernodes).
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy import linalg
from scipy.linalg import blas

from flexgear.arrays import Array, Ints
from flexgear.compiled import njit
from flexgear.structures.linalg.sparse import minimum_degree_order

FILL = 0.1  # share of zeros that a node may add to the columns of a group that it joins


def schur_complement(matrix: sp.csr_matrix, kept: Ints) -> Array:
    """S (b, b) onto the rows ``kept`` (b,) of a symmetric matrix (n, n), both triangles of which
    are stored. numpy.linalg.LinAlgError where the other rows are not positive definite."""
    if len(kept) == matrix.shape[0]:
        return np.asarray(matrix[kept][:, kept].toarray())
    matrix = matrix.sorted_indices()
    node = _nodes(matrix.indptr, matrix.indices, np.isin(np.arange(matrix.shape[0]), kept))
    members = sp.csr_matrix((np.ones(len(node)), (node, np.arange(len(node)))))
    pattern = sp.csr_matrix((np.ones(matrix.nnz), matrix.indices, matrix.indptr), matrix.shape)
    graph = (members @ pattern @ members.T).tocsr()
    last = np.unique(node[kept])
    inner = np.setdiff1d(np.arange(graph.shape[0]), last)
    order = np.concatenate([inner[minimum_degree_order(graph[inner][:, inner])], last])
    parent, count = _tree(*_rows(graph, order), len(inner))
    post = _postorder(parent)
    order[: len(inner)] = order[post]
    parent, count = _renumbered(parent, post), count[post]
    graph = graph[order][:, order]
    size = np.bincount(node)[order]
    first = np.concatenate([[0], np.cumsum(size)])
    rank = np.argsort(order)
    dofs = np.argsort(rank[node], kind="stable")
    ordered = matrix[dofs][:, dofs].sorted_indices()
    rest = _eliminated(ordered, graph, first, parent, _groups(parent, count), len(inner))
    place = np.argsort(dofs)[kept] - first[len(inner)]
    return rest[np.ix_(place, place)]


def flexibility(matrix: sp.csr_matrix, loads: sp.csc_matrix) -> Array:
    """Flexibility Rᵀ K⁻¹ R (k, k) of loads R (n, k) on few rows; matrix: K (n, n), symmetric.
    numpy.linalg.LinAlgError where K is not positive definite."""
    loaded = np.unique(loads.tocsc().indices)
    lower = np.linalg.cholesky(schur_complement(matrix, loaded))
    w = linalg.solve_triangular(lower, loads.tocsr()[loaded].toarray(), lower=True)
    return np.asarray(w.T @ w)


def _eliminated(
    matrix: sp.csr_matrix, graph: sp.csr_matrix, first: Ints, parent: Ints, groups: Ints, inner: int
) -> Array:
    """S (b, b) of a matrix in elimination order. graph: of its nodes; first: dof of each node;
    groups (g + 1,): first nodes of the groups, and the number of ``inner`` nodes."""
    group_of = np.repeat(np.arange(len(groups) - 1), np.diff(groups))
    waiting: list[list[tuple[Ints, Array]]] = [[] for _ in range(len(groups))]
    place = np.zeros(matrix.shape[0], dtype=np.int64)
    for g, (begin, stop) in enumerate(pairwise(groups)):
        remainders, waiting[g] = waiting[g], []
        coupled = graph.indices[graph.indptr[begin] : graph.indptr[stop]]
        coupled = np.unique(np.concatenate([coupled, *(nodes for nodes, _ in remainders)]))
        nodes = coupled[coupled >= stop]
        own, beside, rest = _front(matrix, first, (begin, stop), nodes, remainders, place)
        lower = linalg.cholesky(own, lower=True, check_finite=False)
        if len(nodes):
            w = linalg.solve_triangular(lower, beside.T, lower=True, check_finite=False)
            rest = blas.dsyrk(-1.0, w, beta=1.0, c=rest, trans=1, lower=1, overwrite_c=1)
            over = parent[stop - 1]
            waiting[group_of[over] if over < inner else -1].append((nodes, rest))
    nodes = np.arange(inner, graph.shape[0])
    kept, _, _ = _front(matrix, first, (inner, graph.shape[0]), nodes[:0], waiting[-1], place)
    return np.tril(kept) + np.tril(kept, -1).T


def _front(
    matrix: sp.csr_matrix, first: Ints, span: tuple[int, int], nodes: Ints,
    remainders: list[tuple[Ints, Array]], place: Ints,
) -> tuple[Array, Array, Array]:  # fmt: skip
    """Lower triangle F_pp (p, p), F_rp (r, p) and lower triangle F_rr (r, r) of the front of the
    nodes ``span`` and the further ``nodes`` they are coupled to. place (n,): work space."""
    begin, stop = first[span[0]], first[span[1]]
    rows = _dofs(first, nodes)
    p, r = stop - begin, len(rows)
    place[begin:stop], place[rows] = np.arange(p), p + np.arange(r)
    front = np.zeros((p, p)), np.zeros((r, p)), np.zeros((r, r), order="F")
    _add_rows(matrix.indptr, matrix.indices, matrix.data, begin, stop, place, *front[:2])
    while remainders:  # one at a time, so that its memory is free again
        at, remainder = remainders.pop()
        _add_lower(remainder, place[_dofs(first, at)], *front)
    return front


def _dofs(first: Ints, nodes: Ints) -> Ints:
    """Dofs of nodes, in their order."""
    size = first[nodes + 1] - first[nodes]
    ends = np.cumsum(size)
    return np.repeat(first[nodes] - ends + size, size) + np.arange(size.sum())


def _rows(graph: sp.csr_matrix, order: Ints) -> tuple[Ints, Ints]:
    ordered = graph[order][:, order]
    return ordered.indptr.astype(np.int64), ordered.indices.astype(np.int64)


def _postorder(parent: Ints) -> Ints:
    """Order (n,) of a forest in which each node directly follows its descendants."""
    n = len(parent)
    children: list[list[int]] = [[] for _ in range(n + 1)]
    for node, over in enumerate(parent.tolist()):
        children[over].append(node)
    order, stack = [], [*children[n]]
    while stack:
        node = stack.pop()
        order.append(node)
        stack += children[node]
    return np.array(order[::-1], dtype=np.int64)


def _renumbered(parent: Ints, order: Ints) -> Ints:
    """The forest of ``parent`` with its nodes numbered in another order."""
    rank = np.append(np.argsort(order), len(order))
    return rank[parent[order]]


def _groups(parent: Ints, count: Ints) -> Ints:
    """First nodes (g + 1,) of groups of nodes in postorder that are eliminated together, and the
    number of nodes. count (n,): nodes in the columns of the factor."""
    starts, width = [0], 1
    for j in range(1, len(parent)):
        zeros = width * (count[j] + 1 - count[j - 1])
        if parent[j - 1] == j and zeros <= FILL * (width + 1) * (count[j] + 1):
            width += 1
        else:
            starts.append(j)
            width = 1
    return np.array([*starts, len(parent)])


@njit(nogil=True)
def _nodes(pointers: Ints, columns: Ints, kept: NDArray[np.bool_]) -> Ints:  # pragma: no cover
    """Numbers (n,) of nodes: successive rows with the same columns, all of them kept or none."""
    node = np.zeros(len(pointers) - 1, dtype=np.int64)
    for i in range(1, len(node)):
        begin, last = pointers[i], pointers[i - 1]
        same = pointers[i + 1] - begin == begin - last and kept[i] == kept[i - 1]
        e = 0
        while same and e < begin - last:
            same = columns[begin + e] == columns[last + e]
            e += 1
        node[i] = node[i - 1] if same else node[i - 1] + 1
    return node


@njit(nogil=True)
def _tree(pointers: Ints, columns: Ints, inner: int) -> tuple[Ints, Ints]:  # pragma: no cover
    """Elimination tree of the first ``inner`` nodes of a symmetric graph: parents, ``inner`` for
    none, and numbers of nodes in the columns of the factor, without the diagonal."""
    parent, ancestor = np.full(inner, inner), np.full(inner, inner)
    for i in range(inner):
        for e in range(pointers[i], pointers[i + 1]):
            j = columns[e]
            while j < i:
                above = ancestor[j]
                ancestor[j] = i
                if above == inner:
                    parent[j] = i
                if above >= i:
                    break
                j = above
    count, mark = np.zeros(inner, dtype=np.int64), np.full(inner, -1)
    for i in range(len(pointers) - 1):
        for e in range(pointers[i], pointers[i + 1]):
            j = columns[e]
            while j < min(i, inner) and mark[j] != i:
                mark[j] = i
                count[j] += 1
                j = parent[j]
    return parent, count


@njit(nogil=True)
def _add_rows(
    pointers: Ints, columns: Ints, data: Array, begin: int, stop: int, place: Ints,
    own: Array, beside: Array,
) -> None:  # pragma: no cover  # fmt: skip
    """Add the entries of rows begin … stop − 1 to the lower triangle of a front."""
    p = stop - begin
    for i in range(begin, stop):
        for e in range(pointers[i], pointers[i + 1]):
            if columns[e] >= i:
                row = place[columns[e]]
                if row < p:
                    own[row, i - begin] += data[e]
                else:
                    beside[row - p, i - begin] += data[e]


@njit(nogil=True)
def _add_lower(
    remainder: Array, place: Ints, own: Array, beside: Array, rest: Array
) -> None:  # pragma: no cover
    """Add the lower triangle of a remainder to rows ``place`` (r,), rising, of a front."""
    p = own.shape[0]
    for j in range(len(place)):
        column = place[j]
        for i in range(j, len(place)):
            row = place[i]
            if column >= p:
                rest[row - p, column - p] += remainder[i, j]
            elif row >= p:
                beside[row - p, column] += remainder[i, j]
            else:
                own[row, column] += remainder[i, j]
