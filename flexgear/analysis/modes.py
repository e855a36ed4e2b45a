"""Natural modes of the coupled train with its gear meshes as linear springs.

(K + K_g) φ = ω² M φ, K_g of the contact rows (``contact_springs``); damping is left out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from flexgear.coupling.system import System

Array = NDArray[np.float64]


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
