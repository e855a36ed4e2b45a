"""Natural modes of the coupled train with its gear meshes as linear springs.

(K + K_g) φ = ω² M φ, K_g of the contact rows; damping is left out.

``springs_at`` takes every tooth pair on the loaded flanks at one position of the train. What of the
pairs carries under a load, and the mean over a gear-mesh cycle: ``gear_mesh_cycle``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from flexgear.arrays import Array
from flexgear.coupling.kernels.elements import Rows, pair_rows, row_motions, row_stiffness
from flexgear.coupling.kernels.pairs import build_rows
from flexgear.coupling.pair_data import BEARING, SUPPORT, carrying_flanks
from flexgear.coupling.system import System


@dataclass(frozen=True)
class Springs:
    """Springs of energy ½ qᵀ Rᵀ K R q: rows R (n, d), matrix K (n, n) N/m."""

    rows: Array
    matrix: Array

    @property
    def stiffness(self) -> Array:
        """Rᵀ K R (d, d)."""
        return np.asarray(self.rows.T @ self.matrix @ self.rows)


@dataclass(frozen=True)
class FlankCycle:
    """A flank over P positions, evenly spread over the gear-mesh cycle of its stage.

    stiffness (P,) N/m: 1ᵀ K 1 of its rows; damping (P,) N s/m of the rows that touch; force (P, c)
    per metre: what its rows do on the coordinates ``blocks`` (c, d) of the bodies as all of them
    close alike, (1ᵀ K R).
    """

    stiffness: Array
    damping: Array
    force: Array
    blocks: Array

    def harmonic_stiffness(self) -> NDArray[np.complex128]:
        """k_l (P // 2 + 1,), k(θ) = Re Σ k_l e^{ilψ} with ψ = 2π over the cycle."""
        return _harmonics(self.stiffness)

    def harmonic_force(self, order: int) -> NDArray[np.complex128]:
        """Force (d,) on all coordinates per metre of closing at one order, as k_l."""
        return np.asarray(_harmonics(self.force)[order] @ self.blocks)


def _harmonics(values: Array) -> NDArray[np.complex128]:
    coefficients = np.fft.rfft(values, axis=0) / len(values)
    coefficients[1:] *= 2.0
    return coefficients


@dataclass(frozen=True)
class ContactSprings:
    """gear_meshes: springs of every flank (M,), without rows where it does not carry; others: of
    supports and bearings by the kind of their rows; cycles: by flank, of a mean over cycles."""

    gear_meshes: tuple[Springs, ...]
    others: Mapping[int, Springs]
    cycles: Mapping[int, FlankCycle] = field(default_factory=dict)

    @cached_property
    def stiffness(self) -> Array:
        """Sum of all springs, (d, d)."""
        total = sum(s.stiffness for s in (*self.gear_meshes, *self.others.values()))
        return np.asarray(total)


def springs_at(system: System, input_angles: Array | float = 0.0) -> ContactSprings:
    """All tooth pairs of the loaded flanks at independent rotations (F,) or the first of them, rad,
    with their nominal stiffness."""
    rows, n = rows_at(system, input_angles)
    vectors, stiffness = row_vectors(system, rows, n), row_stiffness(rows, n)
    kinds, owner = rows.row["kind"][:n], rows.row["owner"][:n]
    rows_of_mesh = [
        np.flatnonzero((kinds >= 0) & (owner == m)) for m in range(len(system.pairs.s0))
    ]
    return ContactSprings(
        tuple(Springs(vectors[at], stiffness[np.ix_(at, at)]) for at in rows_of_mesh),
        other_springs(system, rows, n),
    )


def other_springs(system: System, rows: Rows, n: int) -> dict[int, Springs]:
    """Springs of the supports and bearings among the first n rows, with nominal stiffness."""
    springs = {}
    for kind in (SUPPORT, BEARING):
        at = np.flatnonzero(rows.row["kind"][:n] == kind)
        if len(at):
            vectors = row_vectors(system, rows, n)[at]
            springs[kind] = Springs(vectors, np.diag(rows.row["stiffness"][at]))
    return springs


def rows_at(system: System, input_angles: float | Array = 0.0) -> tuple[Rows, int]:
    """Rows of the loaded flanks at independent rotations (F,) or the first of them, rad."""
    rows, angles = pair_rows(system.pairs), np.zeros(len(system.input_rows))
    rotations = np.atleast_1d(np.asarray(input_angles, dtype=float))
    angles[: len(rotations)] = rotations
    n, _ = build_rows(system.pairs, rows, system.theta(angles), carrying_flanks(system.pairs))
    return rows, n


def row_vectors(system: System, rows: Rows, n: int) -> Array:
    """Rows V in physical coordinates, (n, d)."""
    return row_motions(rows, n, system.blocks)


@dataclass(frozen=True)
class Modes:
    """frequencies (m,) Hz rising; shapes (d, m) with ΦᵀMΦ = I; energy: body -> (m,) share of
    kinetic energy in each body."""

    frequencies: Array
    shapes: Array
    energy: dict[str, Array]


def modes(system: System, contact: Array, limit_hz: float | None = None) -> Modes:
    """Undamped modes up to ``limit_hz`` (None: all) with the stiffness (d, d) of the contact rows;
    rigid rotations of the train come first.

    Frequencies below 1e-3 of the first elastic one are set to zero exactly where they are rigid.
    """
    k = system.stiffness + contact
    free = len(system.input_rows)
    values, shapes = _lowest(0.5 * (k + k.T), system.mass, free, limit_hz)
    omega = np.sqrt(np.clip(values, 0.0, None))
    if 0 < free < len(omega) and omega[free - 1] < 1e-3 * omega[free]:
        omega[:free] = 0.0
    frequencies = omega / (2 * np.pi)
    keep = len(frequencies) if limit_hz is None else int(np.sum(frequencies <= limit_hz))
    shapes = shapes[:, :keep]
    momentum = system.mass @ shapes
    energy: dict[str, Array] = {
        b.name: np.einsum(
            "dm,dm->m", shapes[system.slice_of(b.name)], momentum[system.slice_of(b.name)]
        )
        for b in system.bodies
    }
    return Modes(frequencies[:keep], shapes, energy)


def _lowest(
    stiffness: Array, mass: Array, free: int, limit_hz: float | None
) -> tuple[Array, Array]:
    """ω² and shapes up to the limit, and at least those of the rigid motions and one more."""
    if limit_hz is None:
        return linalg.eigh(stiffness, mass)  # type: ignore[no-any-return]
    top = (2 * np.pi * limit_hz) ** 2
    values, shapes = linalg.eigh(stiffness, mass, subset_by_value=(-np.inf, top))
    if len(values) <= free < len(mass):
        values, shapes = linalg.eigh(stiffness, mass, subset_by_index=(0, free))
    return values, shapes
