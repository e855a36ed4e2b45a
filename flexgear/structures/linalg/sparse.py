"""Sparse symmetric matrices: factors by CHOLMOD, elimination of the first rows, flexibilities.

Cholesky factorisation by CHOLMOD, used many times:

    P A P^T = L L^T

with P the order of nested dissection by METIS, whose factors of solid bodies have half the entries
that approximate minimum degree gives. Forward and backward solution are separate: W = L^{-1} P B^T
is sparse where B^T is.
Sources: Chen, Davis, Hager, Rajamanickam 2008, ACM TOMS 35:22, Python interface CVXOPT; Karypis,
Kumar 1998, SIAM J. Sci. Comput. 20:359, Python interface PyMetis.

Elimination of the first rows for many columns at a time. With inner rows i, outer rows b and
constraint rows c,

    [K_ii K_ib C_i^T]   [L   0]   [I 0]   [L^T W]
    [K_bi K_bb C_b^T] = [W^T I] x [0 S] x [0   I],   W = L^{-1} [K_ib C_i^T],
    [C_i  C_b  0    ]

S the Schur complement of the inner rows. CHOLMOD factors [K_ii K_ib; K_bi K_bb + D] in this order,
D large enough that it is definite; its factor consists of L, W^T of the outer rows, and the factor
of S + D. CHOLMOD solves one column at a time; compiled loops over the factor's columns solve for
all columns of a right-hand side together.

Flexibility R^T K^{-1} R for many loads on few rows: loaded rows are eliminated last. L^{-1} P R
then has entries in these rows only, W = C^{-1} R with the block C of L on them, and R^T K^{-1} R =
W^T W is symmetric and positive semidefinite by construction.
"""

from threading import Lock
from typing import Any

import numpy as np
import pymetis
import scipy.sparse as sp
from scipy.linalg import solve_triangular

from flexgear.arrays import Array, Ints
from flexgear.compiled import njit
from flexgear.structures.linalg import cholmod
from flexgear.structures.linalg.cholmod import dense_matrix, spmatrix

_SOLVE, _FORWARD, _BACKWARD, _PERMUTE, _PERMUTE_BACK = 0, 4, 5, 7, 8  # CHOLMOD's `sys`


class Factor:
    """Cholesky factor L of a symmetric positive definite matrix (n, n), CSR.
    numpy.linalg.LinAlgError where the matrix is not positive definite."""

    def __init__(self, matrix: sp.csr_matrix) -> None:
        self._factor = _factored(to_cvxopt(sp.tril(matrix)), nested_dissection_order(matrix))

    def solve(self, right: Array) -> Array:
        """x (n, k) with A x = right (n, k)."""
        return self._each(right, _SOLVE)

    def forward(self, right: Array) -> Array:
        """f = L^{-1} P right (n, k)."""
        return self._each(right, _PERMUTE, _FORWARD)

    def forward_sparse(self, right: sp.csr_matrix) -> sp.csr_matrix:
        """L^{-1} P right of a sparse right (n, k), as a sparse matrix."""
        solution = to_cvxopt(right)
        for step in (_PERMUTE, _FORWARD):
            solution = cholmod.spsolve(self._factor, solution, sys=step)
        return _to_scipy(solution).tocsr()

    def backward(self, f: Array) -> Array:
        """x = P^T L^{-T} f (n, k)."""
        return self._each(f, _BACKWARD, _PERMUTE_BACK)

    def _each(self, right: Array, *steps: int) -> Array:
        """Result of CHOLMOD's steps (values of `sys`) on right (n, k) or (n,)."""
        columns = dense_matrix(0.0, (len(right), right.size // len(right)))
        view = np.asarray(columns)  # the same memory, columns contiguous
        view[:] = right.reshape(view.shape)
        for step in steps:
            cholmod.solve(self._factor, columns, sys=step)
        return np.ascontiguousarray(view).reshape(right.shape)


def factor_in_order(matrix: sp.csr_matrix) -> sp.csc_matrix:
    """L (n, n) with matrix = L L^T, without reordering; row numbers rise in every column.
    numpy.linalg.LinAlgError where the matrix is not positive definite."""
    return _to_scipy(_factor_in(np.arange(matrix.shape[0]), matrix))


def flexibility(matrix: sp.csr_matrix, loads: sp.csc_matrix) -> Array:
    """Flexibility R^T K^{-1} R (k, k) of loads R (n, k) on few rows; matrix: K (n, n), symmetric.
    numpy.linalg.LinAlgError where K is not positive definite."""
    loaded = np.unique(loads.tocsc().indices)
    rest = np.setdiff1d(np.arange(matrix.shape[0]), loaded)
    first = rest[nested_dissection_order(matrix[rest][:, rest])] if len(rest) else rest
    factor = _factor_in(np.concatenate([first, loaded]), matrix)
    block = _to_scipy(factor[len(rest) :, len(rest) :]).toarray()
    w = solve_triangular(block, loads.tocsr()[loaded].toarray(), lower=True)
    return np.asarray(w.T @ w)


def _factor_in(order: Ints, matrix: sp.csr_matrix) -> spmatrix:
    """L of a symmetric matrix (n, n) whose rows are eliminated in ``order`` (n,)."""
    lower = to_cvxopt(sp.tril(matrix))
    return cholmod.getfactor(_factored(lower, order, nmethods=1, postorder=False))


def to_cvxopt(matrix: sp.sparray) -> spmatrix:
    """A sparse matrix in CVXOPT's form."""
    entries = sp.coo_matrix(matrix)
    rows, columns = (dense_matrix(i.astype(np.int64)) for i in (entries.row, entries.col))
    return spmatrix(dense_matrix(entries.data.astype(float)), rows, columns, matrix.shape)


def _to_scipy(matrix: spmatrix) -> sp.csc_matrix:
    begins, rows, data = (np.array(part).ravel() for part in matrix.CCS)
    return sp.csc_matrix((data, rows, begins), matrix.size)


_ANALYSIS = Lock()  # CHOLMOD's options are global, so only one thread may set them at a time


def _factored(lower: spmatrix, order: Ints, **options: Any) -> Any:
    """CHOLMOD's factor of a symmetric matrix with the lower triangle ``lower``; order: rows (n,) as
    they are eliminated; options: of CHOLMOD's analysis."""
    with _ANALYSIS:
        before = dict(cholmod.options)
        cholmod.options.update(options)
        try:
            factor = cholmod.symbolic(lower, p=dense_matrix(np.asarray(order, dtype=np.int64)))
        finally:
            cholmod.options.clear()
            cholmod.options.update(before)
    try:
        cholmod.numeric(lower, factor)
    except ArithmeticError:
        raise np.linalg.LinAlgError("the matrix is not positive definite") from None
    return factor


def nested_dissection_order(graph: sp.csr_matrix) -> Ints:
    """Order (n,) in which the rows of a symmetric graph (n, n) are eliminated, by nested
    dissection. Rows with entries in the same columns, as the three of a node of a solid body, are
    one node of the graph that is divided."""
    pattern = sp.csr_matrix((np.ones(graph.nnz, np.int64), graph.indices, graph.indptr))
    # rows with the same columns have the same sum of random marks of these
    marks = np.random.default_rng(0).integers(2**62, size=pattern.shape[1])
    _, first, group = np.unique(pattern @ marks, return_index=True, return_inverse=True)
    groups = sp.csr_matrix(pattern[first][:, first])
    groups.setdiag(0)
    groups.eliminate_zeros()
    place = np.arange(len(first))
    if groups.nnz:
        adjacency = pymetis.CSRAdjacency(groups.indptr, groups.indices)
        place = np.argsort(pymetis.nested_dissection(adjacency)[0])
    return np.argsort(place[group], kind="stable")


class Elimination:
    """Factor of the inner rows of a symmetric matrix [K C^T; C 0]; size: number of inner rows i;
    rest: Schur complement S (b + c, b + c)."""

    def __init__(
        self, stiffness: sp.csr_matrix, constraints: sp.csr_matrix, size: int, shift: Array
    ) -> None:
        """stiffness: K (i + b, i + b); constraints: C (c, i + b); shift: D (b, b) of the module's
        docstring. numpy.linalg.LinAlgError where [K_ii K_ib; K_bi K_bb + D] is not definite."""
        self.size = size
        outer = stiffness.shape[0] - size
        lifted = stiffness + sp.block_diag([sp.csr_matrix((size, size)), sp.csr_matrix(shift)])
        factor = factor_in_order(lifted)
        remainder = factor[size:, size:].toarray()
        columns = factor[:, :size]
        self._reach = columns.shape[0]
        pointers, rows = columns.indptr.astype(np.int64), columns.indices.astype(np.int64)
        self._sweeps = pointers, rows, columns.data
        transposed = constraints.T.toarray()
        forward(*self._sweeps, transposed)
        self._constraints = transposed[:size]  # L^{-1} C_i^T (i, c)
        self.rest = np.zeros((outer + transposed.shape[1],) * 2)
        self.rest[:outer, :outer] = remainder @ remainder.T - shift
        self.rest[:outer, outer:] = transposed[size:]
        self.rest[outer:, :outer] = transposed[size:].T
        self.rest[outer:, outer:] = -self._constraints.T @ self._constraints

    def forward(self, x: Array) -> None:
        """Replace x = [g_i; g_bc] (i + b + c, k) by [L^{-1} g_i; g_bc - W^T L^{-1} g_i]."""
        forward(*self._sweeps, x)
        x[self._reach :] -= self._constraints.T @ x[: self.size]

    def backward(self, x: Array) -> None:
        """Replace x = [f; x_bc] (i + b + c, k) by [L^{-T} (f - W x_bc); x_bc]."""
        x[: self.size] -= self._constraints @ x[self._reach :]
        backward(*self._sweeps, x)


@njit(nogil=True, fastmath={"contract"})
def forward(pointers: Ints, rows: Ints, data: Array, x: Array) -> None:  # pragma: no cover
    """Replace x (n, k) by [L 0; W^T I]^{-1} x; a column of the factor begins with its diagonal."""
    k = x.shape[1]
    for j in range(len(pointers) - 1):
        inverse = 1 / data[pointers[j]]
        for c in range(k):
            x[j, c] *= inverse
        for e in range(pointers[j] + 1, pointers[j + 1]):
            row, entry = rows[e], data[e]
            for c in range(k):
                x[row, c] -= entry * x[j, c]


@njit(nogil=True, fastmath={"contract"})
def backward(pointers: Ints, rows: Ints, data: Array, x: Array) -> None:  # pragma: no cover
    """Replace x (n, k) by [L 0; W^T I]^{-T} x; a column of the factor begins with its diagonal."""
    k = x.shape[1]
    for j in range(len(pointers) - 2, -1, -1):
        for e in range(pointers[j] + 1, pointers[j + 1]):
            row, entry = rows[e], data[e]
            for c in range(k):
                x[j, c] -= entry * x[row, c]
        inverse = 1 / data[pointers[j]]
        for c in range(k):
            x[j, c] *= inverse
