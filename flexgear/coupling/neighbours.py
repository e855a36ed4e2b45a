"""Neighbouring tooth pairs of a gear mesh yield to each other through the bodies below their teeth.

Rows of pairs in slices whose influence is computed close by δ = Vᵀu + e − Σ B F', F' being the
forces of the pairs before and after: a flexibility between rows beside that of the train, linear
and without mass, B from ``gears.slices``. What is known of it stands in the rows themselves.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from flexgear.coupling.compiled import INNER
from flexgear.coupling.elements import Rows

Array = NDArray[np.float64]


@njit(**INNER)
def add_neighbours(rows, n, matrix):
    """matrix[i, j] += B_ij, m/N, of n rows."""
    for i in range(n):
        row = rows.row[i]
        if row.after >= 0:
            j = row.after
            matrix[i, j] += row.to_near
            matrix[j, i] += row.to_near
            matrix[i, j + 1] += row.to_far
            matrix[j + 1, i] += row.to_far


@njit(**INNER)
def yield_to_neighbours(rows, n, force, motion):
    """motion[i] −= Σ B_ij F_j for forces (≥ n,) of n rows."""
    for i in range(n):
        row = rows.row[i]
        if row.after >= 0:
            j = row.after
            motion[i] -= row.to_near * force[j] + row.to_far * force[j + 1]
            motion[j] -= row.to_near * force[i]
            motion[j + 1] -= row.to_far * force[i]


@njit(**INNER)
def freeze_neighbours(rows, n, force):
    """Make what n rows yield under their forces a part of their offsets."""
    for i in range(n):
        row = rows.row[i]
        if row.after >= 0:
            near, far = rows.row[row.after], rows.row[row.after + 1]
            row.offset -= row.to_near * force[row.after] + row.to_far * force[row.after + 1]
            near.offset -= row.to_near * force[i]
            far.offset -= row.to_far * force[i]


@njit(**INNER)
def neighbour_energy(rows, n, force):
    """½ Fᵀ B F of n rows, J."""
    energy = 0.0
    for i in range(n):
        row = rows.row[i]
        if row.after >= 0:
            j = row.after
            energy += force[i] * (row.to_near * force[j] + row.to_far * force[j + 1])
    return energy


def row_stiffness(rows: Rows, n: int) -> Array:
    """Stiffness (n, n) N/m between the first n rows, (I + k B)⁻¹ k with their nominal k."""
    between, row = np.zeros((n, n)), rows.row[:n]
    for i in np.flatnonzero(row["after"] >= 0):
        j = slice(row["after"][i], row["after"][i] + 2)
        between[i, j] = between[j, i] = row["to_near"][i], row["to_far"][i]
    k = rows.stiffness[:n]
    return np.asarray(np.linalg.solve(np.eye(n) + k[:, None] * between, np.diag(k)))
