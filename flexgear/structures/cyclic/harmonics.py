r"""The borders of all sectors together, by a discrete Fourier transform over the sectors.

One sector's condensed matrix on [its border, the next border] is [S_00 S_01; S_10 S_11]. With
x(s) = 1/z sum_h X_h e^{i h s 2 pi/z} the borders separate by harmonics,

    S_h = S_00 + S_11 + S_01 e^{i h 2 pi/z} + S_10 e^{-i h 2 pi/z},   S_h X_h = R_h,

Hermitian and definite where the sectors are held; harmonics h and z - h are conjugates, so
h = 0 ... z // 2 suffice. Source: Thomas 1979, Int. J. Numer. Methods Eng. 14:81.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from flexgear.model.errors import FlexgearError
from flexgear.structures.linalg.inverses import hermitian_inverse, signed_hermitian_inverse
from flexgear.structures.linalg.threads import THREADS, shared

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Ints = NDArray[np.int64]


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
        self._inverse: Complex | None = None
        self._negative = np.zeros(len(self), dtype=int)
        self.made()

    def forget(self) -> None:
        """Give large inverses' memory back; the next solution makes them anew."""
        if self._inverse is not None and self._inverse.nbytes > _LARGE:
            self._inverse = None

    def made(self) -> Complex:
        """Inverses (harmonics, entries of all panels): one array goes back to the system whole."""
        if self._inverse is not None:
            return self._inverse
        b = self.size
        entries = sum((rows.stop - rows.start) * rows.stop for rows in self._panels)
        inverse = np.empty((len(self), entries), dtype=complex)
        diagonal = self._condensed[:b, :b] + self._condensed[b:, b:]
        diagonal = 0.5 * (diagonal + diagonal.T)
        across = self._condensed[:b, b:]

        for h in range(len(self)):
            phase = np.exp(2j * np.pi * h / self.count)
            matrix = diagonal + phase * across + np.conj(phase) * across.T
            self._negative[h] = self._keep_lower(matrix, inverse[h])
        self._inverse = inverse
        return inverse

    def __len__(self) -> int:
        return self.count // 2 + 1

    @property
    def times(self) -> Ints:
        """(harmonics,) 2 where the conjugate is another harmonic, else 1."""
        twice = np.full(len(self), 2)
        twice[0] = 1
        if self.count % 2 == 0:
            twice[-1] = 1
        return twice

    @property
    def negative(self) -> int:
        """Negative eigenvalues of all S_h, those of conjugates counted too."""
        return int(self.times @ self._negative)

    def solve(self, right: Array) -> Array:
        """Borders x (b, z, k) under loads (b, z, k)."""
        if not right.shape[2]:
            return right
        r = scipy.fft.rfft(right, axis=1, workers=THREADS).transpose(1, 0, 2)
        x = np.empty(r.shape, dtype=complex)
        self.made()

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
        for rows, panel in self._of_panels(self.made()[h]):
            x[rows] = panel @ r[: rows.stop]
            if rows.start:  # what the panel is above the diagonal
                x[: rows.start] += (adjoint[:, rows] @ panel[:, : rows.start]).conj().T

    def _of_panels(self, entries: Complex) -> Iterator[tuple[slice, Complex]]:
        """Rows of each panel, and the panel up to its diagonal block, of one harmonic's entries."""
        begin = 0
        for rows in self._panels:
            shape = rows.stop - rows.start, rows.stop
            end = begin + shape[0] * shape[1]
            yield rows, entries[begin:end].reshape(shape)
            begin = end

    def _keep_lower(self, matrix: Complex, entries: Complex) -> int:
        """The inverse of a Hermitian matrix into its panels; its negative eigenvalues."""
        negative = 0
        try:
            if self._definite:
                inverse = hermitian_inverse(matrix)
            else:
                inverse, negative = signed_hermitian_inverse(matrix)
        except np.linalg.LinAlgError:
            raise FlexgearError("a sector is not held by the ties of its teeth") from None
        for rows, panel in self._of_panels(entries):
            panel[:] = inverse[rows, : rows.stop]
            block = panel[:, rows.start :]
            block[:] = np.tril(block) + np.tril(block, -1).conj().T
        return negative
