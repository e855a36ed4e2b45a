"""Neighbouring tooth pairs of a gear mesh yield to each other through the bodies below their teeth.

Rows of pairs in slices whose influence is computed close by δ = Vᵀu + e − Σ B F', F' being the
forces of the two pairs before and the two after: a flexibility between rows beside that of the
train, linear and without mass, B from ``gears.slices``. What is known of it stands in the rows
themselves.
"""

from __future__ import annotations

import numpy as np

from flexgear.arrays import Array
from flexgear.compiled import INNER, njit
from flexgear.coupling.kernels.elements import Rows


@njit(**INNER)
def add_neighbours(rows, n, matrix):
    """matrix[i, j] += B_ij, m/N, of n rows."""
    for i in range(n):
        first = rows.row[i].after
        for k in range(rows.row[i].following):
            matrix[i, first + k] += rows.yields[i, k]
            matrix[first + k, i] += rows.yields[i, k]


@njit(**INNER)
def yield_to_neighbours(rows, n, force, motion):
    """motion[i] −= Σ B_ij F_j for forces (≥ n,) of n rows."""
    for i in range(n):
        first = rows.row[i].after
        for k in range(rows.row[i].following):
            motion[i] -= rows.yields[i, k] * force[first + k]
            motion[first + k] -= rows.yields[i, k] * force[i]


@njit(**INNER)
def freeze_neighbours(rows, n, force):
    """Make what n rows yield under their forces a part of their offsets."""
    for i in range(n):
        row = rows.row[i]
        for k in range(row.following):
            further = rows.row[row.after + k]
            row.offset -= rows.yields[i, k] * force[row.after + k]
            further.offset -= rows.yields[i, k] * force[i]


@njit(**INNER)
def neighbour_energy(rows, n, force):
    """½ Fᵀ B F of n rows, J."""
    energy = 0.0
    for i in range(n):
        first = rows.row[i].after
        for k in range(rows.row[i].following):
            energy += force[i] * rows.yields[i, k] * force[first + k]
    return energy


def between_rows(rows: Rows, n: int) -> Array:
    """B (n, n) m/N between the first n rows."""
    flexibility, row = np.zeros((n, n)), rows.row[:n]
    for i in np.flatnonzero(row["following"]):
        at = slice(row["after"][i], row["after"][i] + row["following"][i])
        flexibility[i, at] = flexibility[at, i] = rows.yields[i, : row["following"][i]]
    return flexibility


def row_stiffness(rows: Rows, n: int) -> Array:
    """Stiffness (n, n) N/m between the first n rows, (I + k B)⁻¹ k with their nominal k."""
    k = rows.stiffness[:n]
    return np.asarray(np.linalg.solve(np.eye(n) + k[:, None] * between_rows(rows, n), np.diag(k)))
