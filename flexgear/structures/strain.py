r"""Strain and stress at the vertices of an FE mesh, from the displacements of its vertices.

At every vertex the quadratic polynomial that best fits the displacements at all vertices of the
cells that meet there (least squares) gives the displacement gradient, one value a vertex for all
elements around. Where they do not determine a quadratic, as at surfaces, the gradient is the mean
over the neighbours' polynomials. Constant and linear strain are reproduced exactly, up to the
surface; the error of other fields falls with the square of the element size. Bodies of one layer of
cells get linear polynomials. Source: polynomial preserving recovery, Zhang, Naga 2005, SIAM J. Sci.
Comput. 26:1192.

    eps = (grad u + grad u^T)/2,   sigma = lambda tr(eps) I + 2 mu eps
    von Mises^2 = (3/2) s : s with the deviator s

Components come in the order of ``COMPONENTS``; shear components of strain are tensor components,
half of gamma. A notch is resolved only as well as the mesh resolves it.
"""

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from flexgear.arrays import Array

COMPONENTS = ("xx", "yy", "zz", "xy", "yz", "xz")  # VTK's order of a symmetric tensor
_PLACES = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2))
# smallest over largest singular value of a fit: 0.2 in a cube of 27, 0.04 … 0.15 among tetrahedra,
# up to 0.008 at surfaces, where only their curvature determines the normal direction
_DETERMINED = 0.02
_QUADRATIC_WEIGHT = 1e-5  # small: where both fit, the linear term does and not the quadratic
_FLAT = 1e-12  # of a patch's largest extent squared: rounding
_PATCHES_TOGETHER = 2048


def vertex_gradient(points: Array, cells: NDArray[np.integer]) -> sp.csr_matrix:
    """G (3p, p): rows 3v, 3v+1, 3v+2 give ∂f/∂x, ∂f/∂y, ∂f/∂z at vertex v of vertex values f (p,);
    points (p, 3) m; cells (c, 8 or 4) vertex numbers."""
    corners = np.repeat(np.arange(len(cells)), cells.shape[1])
    at = sp.csr_matrix(
        (np.ones(cells.size, dtype=np.int32), (cells.ravel(), corners)),
        shape=(len(points), len(cells)),
    )
    around, used = (at @ at.T).tocsr(), np.diff(at.indptr) > 0
    fits, determined = _fits(points, around, np.flatnonzero(used), determined_only=True)
    neighbours = (around @ sp.diags_array(determined.astype(float))).tocsr()
    neighbours.eliminate_zeros()
    isolated = used & (np.diff(neighbours.indptr) == 0)
    wider, _ = _fits(
        points, (around @ around).tocsr(), np.flatnonzero(isolated), determined_only=False
    )
    fitted = (determined | isolated).astype(float)
    sources = (sp.diags_array(fitted) + sp.diags_array(1.0 - fitted) @ neighbours).tocsr()
    sources.eliminate_zeros()
    return (_mean_gradient(points, sources) @ (fits + wider)).tocsr()


def strain_of_gradient(gradient: Array) -> Array:
    """eps (..., 6) of displacement gradients (..., 3, 3), last axes: component of u, direction."""
    return np.stack(
        [0.5 * (gradient[..., i, j] + gradient[..., j, i]) for i, j in _PLACES], axis=-1
    )


def stress_of_strain(strain: Array, young_modulus: float, poisson_ratio: float) -> Array:
    """sigma (..., 6) Pa of an isotropic body, E in Pa."""
    mu = young_modulus / (2 * (1 + poisson_ratio))
    lam = 2 * mu * poisson_ratio / (1 - 2 * poisson_ratio)
    stress = 2 * mu * strain
    stress[..., :3] += lam * strain[..., :3].sum(axis=-1, keepdims=True)
    return stress


def von_mises(stress: Array) -> Array:
    """Equivalent stress (...) of stresses (..., 6), in their unit."""
    deviator = stress.copy()
    deviator[..., :3] -= stress[..., :3].mean(axis=-1, keepdims=True)
    squares = (deviator[..., :3] ** 2).sum(axis=-1) + 2 * (deviator[..., 3:] ** 2).sum(axis=-1)
    return np.sqrt(1.5 * squares)


def _fits(
    points: Array, around: sp.csr_matrix, vertices: NDArray[np.integer], *, determined_only: bool
) -> tuple[sp.csr_matrix, NDArray[np.bool_]]:
    """First and second derivatives (12p, p) of the quadratics fitted about vertices, and whether
    the values determine them (p,).

    Rows 12v + i: gradient at vertex v; rows 12v + 3 + 3i + j: second derivatives; columns: values
    at all vertices, those ``around`` (p, p) each vertex with entries. determined_only: whether rows
    of undetermined quadratics are left empty.
    """
    count = len(points)
    determined, parts = np.zeros(count, dtype=bool), []
    neighbours = around[vertices]
    sizes = np.diff(neighbours.indptr)
    for size in np.unique(sizes):
        rows = np.flatnonzero(sizes == size)
        for start in range(0, len(rows), _PATCHES_TOGETHER):
            some = rows[start : start + _PATCHES_TOGETHER]
            at, near = (
                vertices[some],
                neighbours.indices[neighbours.indptr[some][:, None] + np.arange(size)],
            )
            terms, scaling = _terms(points[near] - points[at][:, None])
            # the values determine a quadratic whose terms have no small singular value
            squared_singular_values = np.linalg.eigvalsh(terms.swapaxes(1, 2) @ terms)
            smallest, largest = squared_singular_values[:, 0], squared_singular_values[:, -1]
            too_few = terms.shape[1] < terms.shape[2]
            solvable = determined[at] = (not too_few) & (smallest > _DETERMINED**2 * largest)
            fitted = solvable if determined_only else np.ones_like(solvable)
            at, near = at[fitted], near[fitted]
            weights = _derivatives(terms[fitted], scaling[fitted], solvable[fitted])
            lines = (12 * at[:, None] + np.arange(12))[..., None]
            lines, near = np.broadcast_to(lines, weights.shape), near[:, None]
            parts.append((weights, lines, np.broadcast_to(near, weights.shape)))
    if not parts:
        return sp.csr_matrix((12 * count, count)), determined
    values, lines, columns = (
        np.concatenate([x.ravel() for x in pieces]) for pieces in zip(*parts, strict=True)
    )
    return sp.csr_matrix((values, (lines, columns)), shape=(12 * count, count)), determined


def _terms(arm: Array) -> tuple[Array, Array]:
    """Terms (n, m, 10) of quadratics at arms (n, m, 3) from n vertices, in ξ = arm @ scaling, and
    scaling (n, 3, 3).

    Scaled patches have the same extent in all directions: else those of flat cells would appear
    undetermined.
    """
    spread, axes = np.linalg.eigh(np.einsum("nmi,nmj->nij", arm, arm) / arm.shape[1])
    spread = np.maximum(spread, _FLAT * spread[:, -1:])
    scaling = axes / np.sqrt(spread)[:, None]  # grad = scaling @ grad_ξ
    x, y, z = np.moveaxis(arm @ scaling, 2, 0)
    squares = [0.5 * x * x, 0.5 * y * y, 0.5 * z * z, x * y, y * z, x * z]
    return np.stack([np.ones_like(x), x, y, z, *squares], axis=2), scaling


def _derivatives(terms: Array, scaling: Array, determined: NDArray[np.bool_]) -> Array:
    """Weights (n, 12, m) of values in the first and second derivatives of the fitted quadratics.

    terms, scaling: see ``_terms``. Undetermined quadratics get small second derivatives.
    """
    inverse = np.empty(terms.swapaxes(1, 2).shape)
    best, rest = terms[determined], terms[~determined]
    across = best.swapaxes(1, 2)
    inverse[determined] = np.linalg.solve(across @ best, across)
    if len(rest):
        rest[..., 4:] *= _QUADRATIC_WEIGHT
        fitted = np.linalg.pinv(rest, rcond=1e-10)
        fitted[:, 4:] *= _QUADRATIC_WEIGHT
        inverse[~determined] = fitted
    second = inverse[:, 4:][:, [0, 3, 5, 3, 1, 4, 5, 4, 2]]
    second = second.reshape(len(terms), 3, 3, terms.shape[1])
    second = np.einsum("nia,nabm,njb->nijm", scaling, second, scaling, optimize=True)
    second = second.reshape(len(terms), 9, terms.shape[1])
    return np.concatenate([scaling @ inverse[:, 1:4], second], axis=1)


def _mean_gradient(points: Array, sources: sp.csr_matrix) -> sp.csr_matrix:
    """Gradients (3p, 12p) at vertices from derivatives of fits as in ``_fits``.

    sources (p, p): entry (v, w) where the quadratic about w, v itself or a neighbour, is used at v.
    The gradient at v is the mean over w of grad(w) + H(w) (x_v − x_w), H the second derivatives.
    """
    count, share, source = len(points), np.diff(sources.indptr), sources.indices
    to = np.repeat(np.arange(count), share)
    arm = points[to] - points[source]  # (k, 3)
    axis = np.arange(3)
    derivative = np.stack([axis, *(3 + 3 * axis + j for j in axis)], axis=1)
    columns = 12 * source[:, None, None] + derivative
    weights = np.concatenate([np.ones((len(to), 1)), arm], axis=1)[:, None]  # (k, 1, 4)
    weights = np.broadcast_to(weights / share[to][:, None, None], columns.shape)
    rows = np.broadcast_to(3 * to[:, None, None] + axis[:, None], columns.shape)
    table = (weights.ravel(), (rows.ravel(), columns.ravel()))
    out = sp.csr_matrix(table, shape=(3 * count, 12 * count))
    out.eliminate_zeros()
    return out
