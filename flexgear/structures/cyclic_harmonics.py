r"""The borders of all sectors together, by a discrete Fourier transform over the sectors.

One sector's condensed matrix on [its border, the next border] is [S_00 S_01; S_10 S_11]. With
x(s) = 1/z sum_h X_h e^{i h s 2 pi/z} the borders separate by harmonics,

    S_h = S_00 + S_11 + S_01 e^{i h 2 pi/z} + S_10 e^{-i h 2 pi/z},   S_h X_h = R_h,

Hermitian and definite where the sectors are held; harmonics h and z - h are conjugates, so
h = 0 ... z // 2 suffice. Source: Thomas 1979, Int. J. Numer. Methods Eng. 14:81.
"""

from __future__ import annotations

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from flexgear.model.errors import FlexgearError
from flexgear.structures.cyclic_threads import shared
from flexgear.structures.hermitian import definite_inverse, regular_inverse
from flexgear.structures.tall import THREADS

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


_PANEL = 256  # rows of an inverse that are kept together up to the diagonal: it is Hermitian
_LARGE = 2e8  # bytes of inverses that are worth to be made twice


class Harmonics:
    """Inverse of every S_h (b, b), the lower triangle by panels of rows.

    Of wide borders the inverses are the largest part of all factors.
    """

    def __init__(self, condensed: Array, count: int, definite: bool = True) -> None:
        """condensed: (2b, 2b) of one sector; count: z; definite: whether all S_h are."""
        b = len(condensed) // 2
        self.size, self.count = b, count
        self._panels = [slice(begin, min(begin + _PANEL, b)) for begin in range(0, b, _PANEL)]
        self._condensed, self._definite = condensed, definite
        self._inverse: list[list[Complex]] = []
        self._invert()

    def forget(self) -> None:
        """Give large inverses' memory back; the next solution makes them anew."""
        if sum(panel.nbytes for panels in self._inverse for panel in panels) > _LARGE:
            self._inverse = []

    def _invert(self) -> None:
        b = self.size
        inverse: list[list[Complex]] = [[] for _ in range(len(self))]
        diagonal = self._condensed[:b, :b] + self._condensed[b:, b:]
        diagonal = 0.5 * (diagonal + diagonal.T)
        across = self._condensed[:b, b:]

        def part(harmonics: slice) -> None:
            for h in range(harmonics.start, harmonics.stop):
                phase = np.exp(2j * np.pi * h / self.count)
                matrix = diagonal + phase * across + np.conj(phase) * across.T
                inverse[h] = _lower_panels(matrix, self._panels, self._definite)

        shared(len(self), part, chunk=1)
        self._inverse = inverse

    def __len__(self) -> int:
        return self.count // 2 + 1

    def solve(self, right: Array) -> Array:
        """Borders x (b, z, k) under loads (b, z, k)."""
        if not right.shape[2]:
            return right
        r = scipy.fft.rfft(right, axis=1, workers=THREADS).transpose(1, 0, 2)
        x = np.empty(r.shape, dtype=complex)
        if not self._inverse:
            self._invert()

        def part(harmonics: slice) -> None:
            for h in range(harmonics.start, harmonics.stop):
                self._multiply(h, np.ascontiguousarray(r[h]), x[h])

        shared(len(self), part, chunk=1)
        return scipy.fft.irfft(x.transpose(1, 0, 2), self.count, axis=1, workers=THREADS)

    def of(self, h: int, right: Complex) -> Complex:
        """S_h^{-1} right (b, k)."""
        x = np.empty(right.shape, dtype=complex)
        self._multiply(h, right, x)
        return x

    def _multiply(self, h: int, r: Complex, x: Complex) -> None:
        """x <- S_h^{-1} r (b, k)."""
        adjoint = np.ascontiguousarray(r.conj().T)
        for rows, panel in zip(self._panels, self._inverse[h], strict=True):
            x[rows] = panel @ r[: rows.stop]
            if rows.start:  # what the panel is above the diagonal
                x[: rows.start] += (adjoint[:, rows] @ panel[:, : rows.start]).conj().T


def _lower_panels(matrix: Complex, panels: list[slice], definite: bool) -> list[Complex]:
    """Rows of the inverse of a Hermitian matrix up to their diagonal block."""
    try:
        inverse = definite_inverse(matrix) if definite else regular_inverse(matrix)
    except np.linalg.LinAlgError:
        raise FlexgearError("a sector is not held by the ties of its teeth") from None
    out = []
    for rows in panels:
        panel = np.ascontiguousarray(inverse[rows, : rows.stop])
        block = panel[:, rows.start :]
        block[:] = np.tril(block) + np.tril(block, -1).conj().T
        out.append(panel)
    return out
