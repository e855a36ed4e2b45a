"""Borders of sectors: their rigid motion, and all of them together by harmonics.

The condensed matrices of one sector keep its rigid motion to the last digit. Where a large body
bends softly, its sectors move nearly as rigid pieces, and rounding of the size of a sector's own
stiffness would outweigh what strain there is. Of a free sector condensed to its borders, S x_b,
with B^ the motion its ties take from them and R rigid motion (R_b on the borders),

    S R_b = 0,   B^ R_b = B R

hold exactly, if what both of its neighbours add at a border is shared out rightly; only the sum
of the two shares counts. With R_b^T R_b = I these are restored by the smallest changes that do so,

    S <- (I - R_b R_b^T) S (I - R_b R_b^T),   B^ <- B^ + (B R - B^ R_b) R_b^T.

All borders together are solved by a Fourier transform over the sectors. One sector's condensed
matrix on [its border, the next border] is [S_00 S_01; S_10 S_11]. With x(s) = 1/z sum_h X_h e^{i h
s 2 pi/z} the borders separate by harmonics,

    S_h = S_00 + S_11 + S_01 e^{i h 2 pi/z} + S_10 e^{-i h 2 pi/z},   S_h X_h = R_h,

Hermitian and definite where the sectors are held; harmonics h and z - h are conjugates, so
h = 0 ... z // 2 suffice. Source: Thomas 1979, Int. J. Numer. Methods Eng. 14:81.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import scipy.fft

from flexgear.arrays import Array, Complex
from flexgear.model.errors import FlexgearError
from flexgear.structures.cyclic.sectors import Sectors
from flexgear.structures.kinematics import rigid_motion, rotation
from flexgear.structures.linalg.dense import hermitian_inverse
from flexgear.structures.linalg.threads import THREADS, shared


def rigid_fields(nodes: Array, sectors: Sectors) -> Array:
    """R (3n + 3b, 6) on own nodes and the next border, each in its axes; nodes (N, 3)."""
    sector_nodes, ahead = sectors.nodes[:, 0], sectors.nodes[sectors.interior :, 1]
    points = nodes[np.concatenate([sector_nodes, ahead])]
    fields = rigid_motion(points - points[sectors.interior :].mean(axis=0))
    fields[len(sector_nodes) :] = rotation(sectors.pitch).T @ fields[len(sector_nodes) :]
    flat = fields.reshape(-1, 6)
    _, triangle = np.linalg.qr(flat[3 * sectors.interior :])
    return np.linalg.solve(triangle.T, flat.T).T


def without_rigid(stiffness: Array, rigid: Array) -> Array:
    """S (2b, 2b) with S R_b = 0."""
    stiffness = _balanced(stiffness, rigid)
    half = stiffness - rigid @ (rigid.T @ stiffness)
    return half - (half @ rigid) @ rigid.T


def _balanced(stiffness: Array, rigid: Array) -> Array:
    """S with its share X in S_00 + S_11 moved between the two so that S_00 R_0 + S_01 R_1 = 0."""
    b = len(stiffness) // 2
    q, triangle = np.linalg.qr(rigid[:b])
    y = np.linalg.solve(triangle.T, (stiffness[:b] @ rigid).T).T
    across = q.T @ y
    share = y @ q.T + q @ y.T - q @ (0.5 * (across + across.T)) @ q.T
    out = stiffness.copy()
    out[:b, :b] -= share
    out[b:, b:] += share
    return out


def with_rigid(ties: Array, rigid: Array, motion: Array) -> Array:
    """B^ (r, 2b) with B^ R_b = B R (r, 6)."""
    return ties + (motion - ties @ rigid) @ rigid.T


_PANEL = 256  # rows of an inverse that are kept together up to the diagonal: it is Hermitian


class Harmonics:
    """Inverse of every S_h (b, b), the lower triangle by panels of rows.

    Of wide borders the inverses are the largest part of all factors.
    """

    def __init__(self, condensed: Array, count: int) -> None:
        """condensed: (2b, 2b) of one sector; count: z."""
        b = len(condensed) // 2
        self.size, self.count = b, count
        self._panels = [slice(begin, min(begin + _PANEL, b)) for begin in range(0, b, _PANEL)]
        entries = sum((rows.stop - rows.start) * rows.stop for rows in self._panels)
        self._inverses = np.empty((len(self), entries), dtype=complex)
        diagonal = condensed[:b, :b] + condensed[b:, b:]
        diagonal = 0.5 * (diagonal + diagonal.T)
        across = condensed[:b, b:]
        for h in range(len(self)):
            phase = np.exp(2j * np.pi * h / count)
            self._keep_lower(diagonal + phase * across + np.conj(phase) * across.T, h)

    def __len__(self) -> int:
        return self.count // 2 + 1

    def solve(self, right: Array) -> Array:
        """Borders x (b, z, k) under loads (b, z, k)."""
        if not right.shape[2]:
            return right
        r = scipy.fft.rfft(right, axis=1, workers=THREADS).transpose(1, 0, 2)
        x = np.empty(r.shape, dtype=complex)

        def part(harmonics: slice) -> None:
            for h in range(harmonics.start, harmonics.stop):
                self._multiply(h, np.ascontiguousarray(r[h]), x[h])

        shared(len(self), part, chunk=1)
        return scipy.fft.irfft(x.transpose(1, 0, 2), self.count, axis=1, workers=THREADS)

    def _multiply(self, h: int, r: Complex, x: Complex) -> None:
        """x <- S_h^{-1} r (b, k)."""
        adjoint = np.ascontiguousarray(r.conj().T)
        for rows, panel in self._of_panels(h):
            x[rows] = panel @ r[: rows.stop]
            if rows.start:  # what the panel is above the diagonal
                x[: rows.start] += (adjoint[:, rows] @ panel[:, : rows.start]).conj().T

    def _of_panels(self, h: int) -> Iterator[tuple[slice, Complex]]:
        """Rows of each panel, and the panel up to its diagonal block, of one harmonic."""
        begin = 0
        for rows in self._panels:
            shape = rows.stop - rows.start, rows.stop
            end = begin + shape[0] * shape[1]
            yield rows, self._inverses[h, begin:end].reshape(shape)
            begin = end

    def _keep_lower(self, matrix: Complex, h: int) -> None:
        """The inverse of a Hermitian matrix into the panels of a harmonic."""
        try:
            inverse = hermitian_inverse(matrix)
        except np.linalg.LinAlgError:
            raise FlexgearError("a sector is not held by the ties of its teeth") from None
        for rows, panel in self._of_panels(h):
            panel[:] = inverse[rows, : rows.stop]
            block = panel[:, rows.start :]
            block[:] = np.tril(block) + np.tril(block, -1).conj().T
