r"""Fixed-interface modes of a body of equal sectors, harmonic by harmonic.

Where a turn by one sector maps every tie to a tie, as of pins or teeth and of nodes on the axis,
each mode has one harmonic,

    x(s) = Re X e^{i h s 2π/z},   h = 0 … z // 2,

and T = K^{-1} M of the held body maps harmonics to themselves. So one solution for a field with a
part in every harmonic is a step of a block Lanczos iteration of each,

    T M V_h = V_h T_h + remainder,   V_h^H M V_h = I,

with full orthogonalisation in bases V_h (m, 3n) of one sector, z times shorter than those of whole
fields and with z times fewer vectors. A harmonic with a conjugate, 0 < h < z/2, has its modes in
pairs, X and iX. Source of the iteration: see `linalg/lanczos.py`; of the harmonics: Thomas 1979,
Int. J. Numer. Methods Eng. 14:81.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
import scipy.fft

from flexgear.arrays import Array, Complex, Ints
from flexgear.structures.cyclic.condensation import CyclicCondensation
from flexgear.structures.linalg.dense import THREADS, shared
from flexgear.structures.linalg.lanczos import DEPENDENT, RESIDUAL, Eigenpairs

# calibrated: 400 modes of a carrier of 60 000 dofs take 14 s with 4, 12 s with 8; 300 of a planet
# 5 s with 2 and 4, 7 s with 8
_BLOCK = 4  # vectors that a step adds to each harmonic's basis
_CHECKS = 12  # vectors of a basis over those between two checks of convergence
_CERTAIN = 1e-3  # largest residual over 1/omega² of the mode after those that are sought
_LOST = 1e-14  # least eigenvalue of a block's Gram matrix over the largest
T = TypeVar("T")


@dataclass(frozen=True, eq=False)
class _Ritz:
    """Values 1/omega² (m,) falling, vectors (m, m) on a basis, residuals (m,) over the values."""

    values: Array
    vectors: Complex
    residuals: Array


class _Harmonic:
    """State of the Lanczos iteration of one harmonic.

    basis: vectors of V_h as rows, of which ``filled`` are in use; projected: V_h^H M T M V_h;
    coupling: R (p, p), which couples the basis to the next block; times: 1 of real harmonics, 2 of
    those with a conjugate.
    """

    def __init__(self, n: int, room: int, times: int) -> None:
        """n: dofs of a sector; room: vectors of the first basis; times: see the class."""
        self.basis, self.projected = np.empty((room, n), complex), np.zeros((room, room), complex)
        self.coupling, self.filled, self.times = np.eye(_BLOCK, dtype=complex), 0, times

    def add(self, q: Complex) -> None:
        """Add a block (3n, p) to the basis."""
        size = self.filled + q.shape[1]
        if size > len(self.basis):  # grow by half
            more = max(size, len(self.basis) * 3 // 2)
            basis = np.empty((more, self.basis.shape[1]), complex)
            basis[: self.filled] = self.basis[: self.filled]
            projected = np.zeros((more, more), complex)
            projected[: self.filled, : self.filled] = self.projected[: self.filled, : self.filled]
            self.basis, self.projected = basis, projected
        self.basis[self.filled : size] = q.T
        self.filled = size

    def without(self, w: Complex, p: Complex) -> Complex:
        """Make w (3n, p) M-orthogonal to the basis in place; p: M w. Returns V^H p."""
        v = self.basis[: self.filled]
        column: Complex = (v @ p.conj()).conj()
        w -= v.T @ column
        return column

    def orthogonal(self, w: Complex, p: Complex) -> None:
        """Turn w (n, p) into Q with w = Q R, Q^H M Q = I, and p = M w into M Q, both in place; R is
        kept. LinAlgError where w has fewer directions than columns."""
        self.coupling = np.eye(w.shape[1], dtype=complex)
        for _ in range(3):  # again where directions nearly agree
            gram = w.conj().T @ p
            values, vectors = np.linalg.eigh(0.5 * (gram + gram.conj().T))
            if values[0] <= _LOST * values[-1]:
                raise np.linalg.LinAlgError("the harmonic has no further direction")
            root = np.sqrt(values)
            w[:], p[:] = w @ (vectors / root), p @ (vectors / root)
            self.coupling = (vectors * root).conj().T @ self.coupling
            if values[0] > DEPENDENT * values[-1]:
                break

    def extend(self, column: Complex, again: Complex) -> None:
        """Add the columns (m, p) of V^H M T M V for the newest block: the sum of what both passes
        of ``without`` return."""
        column = column + again
        new = slice(self.filled - column.shape[1], self.filled)
        self.projected[: self.filled, new] = column
        self.projected[new, : self.filled] = column.conj().T

    def ritz(self) -> _Ritz:
        """Modes of T on the basis."""
        m, p = self.filled, len(self.coupling)
        matrix = self.projected[:m, :m]
        values, vectors = np.linalg.eigh(matrix.real if self.times == 1 else matrix)
        values, vectors = values[::-1], vectors[:, ::-1]
        remainder = np.linalg.norm(self.coupling @ vectors[m - p :], axis=0)
        return _Ritz(values, vectors, remainder / np.abs(values))


def harmonic_modes(
    condensation: CyclicCondensation, count: int, progress: Callable[[float], None]
) -> Eigenpairs | None:
    """The ``count`` lowest modes with the interface held, of ties that a turn by one sector maps to
    ties (`SectorTies.invariant`).

    None where a basis would have half as many vectors as a sector has dofs, or a harmonic has too
    few directions: all of its modes are found, which an iteration of whole fields allows for.
    """
    solver, times = condensation.solver, condensation.solver.border_harmonics.times
    z, n = solver.count, condensation.dofs // solver.count
    rows = [_Harmonic(n, max(8 * _BLOCK, 3 * count // z), t) for t in times]

    def each(function: Callable[..., T], *parts: Sequence[Complex] | Complex) -> list[T]:
        """Values of function(harmonic, its parts) of all harmonics."""
        out: dict[int, T] = {}

        def part(which: slice) -> None:
            for h in range(which.start, which.stop):
                out[h] = function(rows[h], *(of_all[h] for of_all in parts))

        shared(len(rows), part, chunk=1)
        return [out[h] for h in range(len(rows))]

    def mass(x: Complex) -> Complex:
        return harmonics_of_field(condensation.fe_mass.product(field_of_harmonics(x, z)))

    start = np.random.default_rng(20230617).standard_normal((n, z, _BLOCK))
    q, unchecked = harmonics_of_field(solver.solve(start)), 0
    p = mass(q)
    try:
        each(_Harmonic.orthogonal, q, p)
        while 2 * (rows[0].filled + _BLOCK) <= n:
            each(_Harmonic.add, q)
            q = harmonics_of_field(solver.solve(field_of_harmonics(p, z)))
            columns: list[list[Complex]] = []
            for _ in range(2):  # the second time for what rounding leaves of the first
                p = mass(q)
                columns.append(each(_Harmonic.without, q, p))
            p = mass(q)
            each(_Harmonic.orthogonal, q, p)
            each(_Harmonic.extend, *columns)
            unchecked += _BLOCK
            few = rows[0].filled * times.sum() < count + _BLOCK
            if few or unchecked < max(_BLOCK, rows[0].filled // _CHECKS):
                continue
            unchecked, ritz = 0, each(_Harmonic.ritz)
            share, last = _converged(ritz, times, count)
            progress(share)
            if share == 1.0:
                return _modes(rows, ritz, z, count, last)
    except np.linalg.LinAlgError:
        pass
    return None


def field_of_harmonics(x: Complex, z: int) -> Array:
    """Field (3n, z, p) of its harmonics (h, 3n, p)."""
    return scipy.fft.irfft(x.transpose(1, 0, 2), z, axis=1, norm="ortho", workers=THREADS)


def harmonics_of_field(field: Array) -> Complex:
    """Harmonics (h, 3n, p) of a field (3n, z, p)."""
    x = scipy.fft.rfft(field, axis=1, norm="ortho", workers=THREADS)
    return np.ascontiguousarray(x.transpose(1, 0, 2))


def _converged(ritz: Sequence[_Ritz], times: Ints, count: int) -> tuple[float, float]:
    """Share of the ``count`` lowest modes that have converged, 1 where the next one of every
    harmonic is certain to be above them, too; and the value of the last of them."""
    every = np.sort(
        np.concatenate([np.repeat(one.values, t) for one, t in zip(ritz, times, strict=True)])
    )
    last = float(every[-count])
    converged, certain = 0, True
    for one, t in zip(ritz, times, strict=True):
        sought = one.values >= last
        good = one.residuals <= RESIDUAL
        converged += t * int((sought & good).sum())
        k = int(sought.sum())
        certain &= bool(good[:k].all())
        certain &= k < len(good) and bool(one.residuals[k] <= _CERTAIN)
    return (1.0 if certain else min(converged / count, 0.99)), last


def _modes(
    rows: Sequence[_Harmonic], ritz: Sequence[_Ritz], z: int, count: int, last: float
) -> Eigenpairs:
    """The ``count`` lowest modes as fields, 1/omega² not below ``last``."""
    values, residuals = [], []
    fields: list[Array] = []
    for h, (row, one) in enumerate(zip(rows, ritz, strict=True)):
        k = int((one.values >= last).sum())
        shapes = one.vectors[:, :k].T @ row.basis[: row.filled]
        turn = np.exp(2j * np.pi * h / z * np.arange(z)) * np.sqrt(row.times / z)
        for shape, value, residual in zip(shapes, one.values, one.residuals, strict=False):
            wave = shape[:, None] * turn
            fields += [wave.real.ravel(), -wave.imag.ravel()][: row.times]
            values += [value] * row.times
            residuals += [residual * value] * row.times
        row.basis = np.empty((0, 0), complex)  # a slice would keep the memory
    order = np.argsort(-np.array(values), kind="stable")[:count]
    vectors = np.array([fields[i] for i in order]).T
    return Eigenpairs(np.array(values)[order], vectors, np.array(residuals)[order])
