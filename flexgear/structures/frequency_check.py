"""Frequencies of a reduced body on supports against those of its FE model.

Supported modes of the reduced body, u = Psi q + Phi eta, are the start U of one step of
simultaneous inverse iteration on the full model; Rayleigh-Ritz on span[U, A U], A = K_s^{-1} M,
K_s = K + B^T S B, gives the full model's frequencies. An error e of the start leaves one of the
order e (f / f_fixed)^4 (the tests compare with Lanczos on the full matrices).

Where a turn by one sector maps ties to ties and supports to supports, each mode has one harmonic
of the sectors. One field then holds a mode of every harmonic, and the bases are those of harmonics,
one sector long (`cyclic/harmonic_modes.py`).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.linalg as sla
from numpy.typing import NDArray

from flexgear.arrays import Array
from flexgear.structures.cyclic.condensation import CyclicCondensation
from flexgear.structures.cyclic.harmonic_modes import field_of_harmonics, harmonics_of_field
from flexgear.structures.linalg.dense import blocks, dot, times
from flexgear.structures.reduced import Progress, silent
from flexgear.structures.reduction import AnyCondensation, Reduction

_BLOCK = 32  # most vectors that are processed together
_BLOCK_BYTES = 128e6
_GUARD = 1.15  # highest frequency of the starting modes over the limit
_FEWEST = 6  # modes that are compared where fewer lie below the limit
_RIGID = 1e-5  # frequency over the limit below which a motion counts as free
_IMPURE = 1e-10  # largest share of other harmonics in the square of a mode
_NEW = 1e-6  # least part of a mode that the former ones of its harmonic do not span
_DEPENDENT = 1e-11  # least eigenvalue of the mass of scaled vectors of a basis


@dataclass(frozen=True, eq=False)
class FrequencyComparison:
    """Frequencies of a supported body, Hz (k,), rising: of the reduced and of the full model."""

    reduced: Array
    full: Array

    @property
    def errors(self) -> Array:
        """Relative errors (k,)."""
        return np.abs(self.reduced / self.full - 1)


def compare_frequencies(
    reduction: Reduction, supports: Array, limit_hz: float, progress: Progress = silent
) -> FrequencyComparison:
    """Frequencies up to limit_hz, and at least the lowest few, of the reduced and of the full model
    on supports (b, b); motions that the supports leave free are omitted."""
    body, condensation = reduction.body, reduction.condensation
    b = condensation.interface.size
    progress("frequency check", 0.0)
    stiffness = body.stiffness.copy()
    stiffness[:b, :b] += supports
    top = (2 * np.pi * limit_hz) ** 2
    lowest = min(_FEWEST + 6, len(stiffness))  # six may be rigid
    values, vectors = sla.eigh(stiffness, body.mass, subset_by_value=(-np.inf, top * _GUARD**2))
    if len(values) < lowest:
        values, vectors = sla.eigh(stiffness, body.mass, subset_by_index=(0, lowest - 1))
    count = len(values)
    basis = np.empty((condensation.dofs, 2 * count))
    for block in blocks(count, _block(condensation)):
        basis[:, block] = condensation.constraint_motion(vectors[:b, block])
        basis[:, block] += times(reduction.fixed_modes, vectors[b:, block])
        progress("frequency check", 0.2 * block.stop / count)
    start = _of_harmonics(condensation, basis[:, :count], values) or _Start([basis], [values])
    full = _ritz_values(condensation, supports, start, progress)
    reduced_hz = np.sqrt(np.maximum(values, 0.0)) / (2 * np.pi)
    full_hz = np.sqrt(np.maximum(full, 0.0)) / (2 * np.pi)
    free = int(np.sum(reduced_hz <= _RIGID * limit_hz))
    compared = slice(free, max(min(int(np.searchsorted(full, top)), count), free + 1))
    progress("frequency check", 1.0)
    return FrequencyComparison(reduced_hz[compared], full_hz[compared])


Basis = NDArray[Any]  # real of whole fields, complex of a harmonic


@dataclass(frozen=True, eq=False)
class _Start:
    """Modes from which the iteration starts: a basis of each harmonic, or one of whole fields.

    bases: (n, 2k_h) of one sector, modes U in the first half, the rest is overwritten; values:
    omega² (k_h,); multiplicity: of a harmonic's modes in the body; sectors: their number, 0 of
    whole fields, n = d.
    """

    bases: Sequence[Basis]
    values: Sequence[Array]
    multiplicity: Sequence[int] = (1,)
    sectors: int = 0

    def field(self, parts: Sequence[Basis]) -> Array:
        """Fields (d, m) whose parts in each basis are ``parts``, of at most m columns."""
        if not self.sectors:
            return np.ascontiguousarray(parts[0])
        widest = max(part.shape[1] for part in parts)
        x = np.zeros((len(parts), len(parts[0]), widest), complex)
        for h, part in enumerate(parts):
            x[h, :, : part.shape[1]] = part
        return field_of_harmonics(x, self.sectors).reshape(-1, widest)

    def parts(self, field: Array) -> Sequence[Basis]:
        """The parts of fields (d, m) in each basis."""
        if not self.sectors:
            return [field]
        return list(harmonics_of_field(field.reshape(-1, self.sectors, field.shape[1])))


def _of_harmonics(condensation: AnyCondensation, shapes: Array, values: Array) -> _Start | None:
    """The modes (d, k) with omega² = values (k,) by harmonic, one of each pair X, iX; None where a
    mode has several."""
    if not (isinstance(condensation, CyclicCondensation) and condensation.ties.invariant):
        return None
    z = condensation.sectors.count
    x = harmonics_of_field(shapes.reshape(-1, z, len(values)))
    size = np.einsum("hnk,hnk->hk", x, x.conj()).real
    if np.any(size.max(axis=0) < (1 - _IMPURE) * size.sum(axis=0)):
        return None
    of_harmonic, of_values = [], []
    for h, strongest in enumerate(np.arange(len(x))[:, None] == size.argmax(axis=0)):
        columns, span = [], np.zeros((x.shape[1], 0), complex)
        for k in np.flatnonzero(strongest):
            rest = x[h, :, k] - span @ (span.conj().T @ x[h, :, k])
            if np.linalg.norm(rest) > _NEW * np.linalg.norm(x[h, :, k]):
                span = np.column_stack([span, rest / np.linalg.norm(rest)])
                columns.append(k)
        of_harmonic.append(np.hstack([x[h][:, columns]] * 2))
        of_values.append(values[columns])
    times_of = condensation.solver.border_harmonics.times.tolist()
    return _Start(of_harmonic, of_values, times_of, z)


def _ritz_values(
    condensation: AnyCondensation, supports: Array, start: _Start, progress: Progress
) -> Array:
    """Ritz values of (K_s, M) on [U, A U], rising, rad²/s².

    U and A U diag(omega²) nearly agree, so their scaled difference is the second half of each
    basis.
    """
    widest, step, bases = max(map(len, start.values)), _block(condensation), start.bases
    halves = [np.hsplit(basis, 2) for basis in bases]  # views
    for block in blocks(widest, step):
        load = condensation.mass_product(start.field([u[:, block] for u, _ in halves]))
        images = start.parts(condensation.supported_solve(load, supports))
        for (u, change), values, image in zip(halves, start.values, images, strict=True):
            omega2 = values[block]
            change[:, block] = image[:, : len(omega2)] * omega2 - u[:, block]
            norm = np.linalg.norm(change[:, block], axis=0)
            change[:, block] /= np.maximum(norm, 1e-300)
        progress("frequency check", 0.2 + 0.4 * block.stop / widest)
    stiffness, mass = ([np.empty((v.shape[1], v.shape[1]), v.dtype) for v in bases] for _ in "km")
    for block in blocks(2 * widest, step):
        field = start.field([v[:, block] for v in bases])
        reactions = condensation.interface_load(supports @ condensation.interface_motion(field))
        forces = start.parts(condensation.stiffness_product(field) + reactions)
        momenta = start.parts(condensation.mass_product(field))
        for h, basis in enumerate(bases):
            width = stiffness[h][:, block].shape[1]
            stiffness[h][:, block] = _inner(basis, forces[h][:, :width])
            mass[h][:, block] = _inner(basis, momenta[h][:, :width])
        progress("frequency check", 0.6 + 0.3 * block.stop / (2 * widest))
    ritz = map(_eigenvalues, stiffness, mass)
    return np.sort(
        np.concatenate(
            [np.repeat(values, m) for values, m in zip(ritz, start.multiplicity, strict=True)]
        )
    )


def _inner(a: Basis, b: Basis) -> Basis:
    """a^H b (k, p) of a (n, k) and b (n, p)."""
    return np.asarray(a.conj().T @ b) if np.iscomplexobj(a) else dot(a, b)


def _eigenvalues(k: Basis, m: Basis) -> Array:
    """Eigenvalues of k x = lambda m x, Hermitian, without directions on which m nearly vanishes."""
    scale = 1 / np.sqrt(np.diag(m).real)
    m = scale[:, None] * 0.5 * (m + m.conj().T) * scale
    k = scale[:, None] * 0.5 * (k + k.conj().T) * scale
    size, basis = sla.eigh(m)
    basis = basis[:, size > _DEPENDENT] / np.sqrt(size[size > _DEPENDENT])
    return np.asarray(sla.eigvalsh(basis.conj().T @ k @ basis))


def _block(condensation: AnyCondensation) -> int:
    """Number of fields that are processed together."""
    return max(8, min(_BLOCK, int(_BLOCK_BYTES / (8 * condensation.dofs))))
