r"""Largest eigenpairs of an operator that is self-adjoint in the mass product, in blocks.

    A v = nu v,  <v, A w>_M = <A v, w>_M,  V^T M V = I.

Block Lanczos with full reorthogonalisation (two passes of classical Gram-Schmidt), Rayleigh-Ritz
on the whole basis, and a thick restart when the basis is full. Blocks serve clusters of equal
frequencies, which a ring has, and let a direct solver take many right-hand sides at once.
Source: Grimes, Lewis, Simon 1994, SIAM J. Matrix Anal. Appl. 15:228.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.linalg as sla
from numpy.typing import NDArray

from flexgear.model.errors import FlexgearError
from flexgear.structures.linalg.tall import dot, times

_CHECK = 2  # steps between looks at convergence

Operator = Callable[[NDArray[np.float64]], NDArray[np.float64]]


@dataclass(frozen=True, eq=False)
class Eigenpairs:
    """nu (k,) falling, vectors (n, k) with V^T M V = I, residual estimates |A v - nu v|_M (k,).

    beside (r, k): what the operator gave beside its image of M V, where it gives something.
    """

    values: NDArray[np.float64]
    vectors: NDArray[np.float64]
    residuals: NDArray[np.float64]
    applications: int
    beside: NDArray[np.float64] | None = None


def largest_eigenpairs(
    apply: Operator,
    mass: Operator,
    start: NDArray[np.float64],
    count: int,
    tolerance: float = 1e-8,
    most: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> Eigenpairs:
    """The `count` largest eigenpairs; start (n, p) gives block size and seed.

    tolerance: residual over nu; the error of nu is of the order of its square.
    """
    n, block = start.shape
    most = most or max(6 * count, count + 12 * block)
    if most + block > n:
        return _dense(apply, mass, n, count)
    basis = np.empty((n, most + block))
    projected = np.zeros((most + block, most + block))
    new, _ = _orthonormal(apply(start), basis[:, :0], mass)
    applied = block
    size = 0  # columns of the basis whose image is already projected
    basis[:, :block] = new
    filled = block
    for _ in range(1000):
        image = apply(np.ascontiguousarray(basis[:, size:filled]))
        applied += filled - size
        old = basis[:, :filled]
        weighted = mass(image)
        column = dot(old, weighted)
        image -= times(old, column)
        projected[:filled, size:filled] = column
        projected[size:filled, :filled] = column.T
        new, coupling = _orthonormal(image, old, mass)
        size = filled
        full = size + block > most
        if not full and (size < 2 * count or (size // block) % _CHECK):
            filled = size + block
            basis[:, size:filled] = new
            continue
        square = projected[:size, :size]
        values, vectors = np.linalg.eigh(0.5 * (square + square.T))
        values, vectors = values[::-1], vectors[:, ::-1]
        tail = coupling @ vectors[size - block :]
        residuals = np.linalg.norm(tail, axis=0)
        good = residuals[:count] <= tolerance * np.abs(values[:count])
        if progress is not None:
            progress(float(good.sum()) / count)
        if good.all():
            return Eigenpairs(
                values[:count], times(old, vectors[:, :count]), residuals[:count], applied
            )
        if full:
            keep = min(count + block, size - block)
            basis[:, :keep] = times(old, vectors[:, :keep])
            projected[:] = 0.0
            projected[range(keep), range(keep)] = values[:keep]
            size = keep
        filled = size + block
        basis[:, size:filled] = new
    raise FlexgearError("the eigenvalue iteration did not converge: ask for fewer modes")


def _orthonormal(
    block: NDArray[np.float64], basis: NDArray[np.float64], mass: Operator
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Q (n, p), R (p, p) with block = basis (...) + Q R, Q^T M Q = I, basis^T M Q = 0.

    Two Euclidean passes first keep the Gram matrix well conditioned; directions of rounding size
    become arbitrary ones, which the projection makes orthogonal and which do no harm.
    """
    q, r = block, np.eye(block.shape[1])
    for _ in range(2):
        q, r = _normalised(q, r, dot(q, q))
    weighted = mass(q)
    overlap = dot(basis, weighted)
    q = q - times(basis, overlap)
    q, r = _normalised(q, r, dot(q, mass(q)))
    return q, r


def _normalised(
    q: NDArray[np.float64], r: NDArray[np.float64], gram: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """q G^{-1/2} and G^{1/2} r, tiny eigenvalues of G raised to rounding size."""
    values, vectors = np.linalg.eigh(0.5 * (gram + gram.T))
    root = np.sqrt(np.maximum(values, 1e-14 * values[-1]))
    return q @ (vectors / root), (vectors * root).T @ r


def _dense(apply: Operator, mass: Operator, n: int, count: int) -> Eigenpairs:
    """All pairs at once, for problems hardly larger than the number of pairs wanted."""
    identity = np.eye(n)
    m = mass(identity)
    image = mass(apply(identity))
    values, vectors = sla.eigh(0.5 * (image + image.T), 0.5 * (m + m.T))
    values, vectors = values[::-1][:count], vectors[:, ::-1][:, :count]
    return Eigenpairs(values, vectors, np.zeros(count), n)
