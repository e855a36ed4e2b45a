"""Stiffness, damping and load of a flank over the gear-mesh cycle of its stage."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexgear.arrays import Array


@dataclass(frozen=True)
class FlankCycle:
    """Stiffness and damping of a flank at P equal positions of its stage's gear-mesh cycle.

    stiffness (P,): 1ᵀ K 1 of its rows, N/m; damping (P,): of the rows in contact, N s/m; force
    (P, c): force 1ᵀ K R on the coordinates ``blocks`` (c, d) per equal closing of all rows, N/m;
    motion (c,): x̄ of rigid ends under the mean load; load (P, c): force Rᵀ K R x̄ by it, N.
    """

    stiffness: Array
    damping: Array
    force: Array
    motion: Array
    load: Array
    blocks: Array

    @property
    def mean_row(self) -> Array:
        """Mean row v (c,): closing by ``blocks``, weighted by stiffness."""
        return np.asarray(self.force.mean(axis=0) / self.stiffness.mean())

    def closing(self, shapes: Array) -> Array:
        """Closing v̄ᵀφ (m,) of the flank in motions (d, m), at its mean row."""
        return np.asarray(self.mean_row @ self.blocks @ shapes)

    def static_motion(self) -> tuple[Array, Array]:
        """Closing x (P,), m, of the flank at its mean tilt and under its mean force, while its
        stiffness varies; and the force (P, c), N, that acts on ``blocks`` in addition to the mean
        force along ``mean_row``, since the load moves along the face."""
        row, force = self.mean_row, self.force @ self.motion
        mean = float(row @ self.motion)
        closing = mean + (force.mean() - force) / self.stiffness
        beside = self.load - np.outer(force, row)
        beside += (closing - mean)[:, None] * (self.force - np.outer(self.stiffness, row))
        return closing, beside

    def harmonic_force(self, order: int) -> NDArray[np.complex128]:
        """Harmonic l = ``order`` of the force (d,) on all coordinates at the mean motion, N."""
        load = harmonics(self.load)[order]
        cosine, sine = np.stack([load.real, load.imag]) @ self.blocks
        return np.asarray(cosine + 1j * sine)


def harmonics(values: Array) -> NDArray[np.complex128]:
    """Harmonics f_l (P // 2 + 1, …) of values (P, …) at equal phases ψ of a cycle:
    f(ψ) = Re Σ f_l e^{ilψ}."""
    coefficients = np.fft.rfft(values, axis=0) / len(values)
    coefficients[1:] *= 2.0
    return coefficients
