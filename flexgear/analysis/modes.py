"""Natural modes of the coupled train with its gear meshes at a carrier angle.

(K + Σ k V Vᵀ) φ = ω² M φ with every pair in mesh as a linear spring; damping is left out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from flexgear.coupling.elements import Rows, pair_rows
from flexgear.coupling.mode_choice import row_motions
from flexgear.coupling.neighbours import row_stiffness
from flexgear.coupling.pair_data import carrying_flanks
from flexgear.coupling.pairs import build_rows
from flexgear.coupling.system import System

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Modes:
    """frequencies (m,) Hz rising; shapes (d, m) with ΦᵀMΦ = I; energy: body -> (m,) share of
    kinetic energy in each body; carrier_angle rad."""

    frequencies: Array
    shapes: Array
    energy: dict[str, Array]
    carrier_angle: float


def gear_mesh_stiffness(system: System, carrier_angle: float, only_pairs: bool = False) -> Array:
    """Σ k V Vᵀ of all rows at a carrier angle in physical coordinates, (d, d)."""
    rows, n = rows_at(system, carrier_angle)
    vectors, stiffness = row_vectors(system, rows, n), row_stiffness(rows, n)
    if only_pairs:
        stiffness[rows.kind[:n] < 0] = 0.0
    return np.asarray(vectors.T @ stiffness @ vectors)


def rows_at(system: System, carrier_angle: float | Array = 0.0) -> tuple[Rows, int]:
    """Rows of the loaded flanks at independent rotations (F,) or the first of them, rad."""
    rows, input_angles = pair_rows(system.pairs), np.zeros(len(system.input_rows))
    given = np.atleast_1d(np.asarray(carrier_angle, dtype=float))
    input_angles[: len(given)] = given
    n, _ = build_rows(system.pairs, rows, system.theta(input_angles), carrying_flanks(system.pairs))
    return rows, n


def row_vectors(system: System, rows: Rows, n: int) -> Array:
    """Rows V in physical coordinates, (n, d)."""
    return row_motions(rows, n, system.blocks)


def modes(system: System, *, carrier_angle: float = 0.0, limit_hz: float | None = None) -> Modes:
    """Undamped modes up to ``limit_hz`` (None: all); rigid rotations of the train come first.

    Frequencies below 1e-3 of the first elastic one are set to zero exactly where they are rigid.
    """
    k = system.stiffness + gear_mesh_stiffness(system, carrier_angle)
    free = len(system.input_rows)
    values, shapes = _lowest(0.5 * (k + k.T), system.mass, free, limit_hz)
    omega = np.sqrt(np.clip(values, 0.0, None))
    if 0 < free < len(omega) and omega[free - 1] < 1e-3 * omega[free]:
        omega[:free] = 0.0
    frequencies = omega / (2 * np.pi)
    keep = len(frequencies) if limit_hz is None else int(np.sum(frequencies <= limit_hz))
    shapes = shapes[:, :keep]
    momentum = system.mass @ shapes
    energy = {
        b.name: np.einsum(
            "dm,dm->m", shapes[system.slice_of(b.name)], momentum[system.slice_of(b.name)]
        )
        for b in system.bodies
    }
    return Modes(frequencies[:keep], shapes, energy, carrier_angle)


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
