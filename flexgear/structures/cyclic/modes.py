"""Fixed-interface modes of a body of equal sectors, from a shift among them.

Where to put the shift. A sector whose borders are held vibrates far above the modes that are
sought, so that motion of the borders tells nearly all. Their harmonics X_h move a sector's ends,
see `CyclicSolver.shapes`, by e = E_h X_h, and with g = R^T E R, the inertia of ends of
`cyclic/projection.py`,

    S_h X_h = lambda E_h^H g E_h X_h,   h = 0 ... z // 2,

by a few steps of subspace iteration. Ties that not every sector has are left free. Both motions
are orthogonal in K, so that with mu, the lowest of a sector held at its borders, the body's n-th
lies between bounds as Dunkerley's,

    1/(1/lambda_n + 1/mu) <= omega_n^2 <= lambda_n.

Source: Guyan 1965, AIAA J. 3:380.

The modes. With the shift

    (K - sigma M) x = M v + B^T rho,   B x = 0

is solved as easily as with sigma = 0, and with sigma among the modes these lie far apart for the
iteration. K - sigma M is not definite, but the interior of a sector between its borders is while
its own frequencies lie above; where they do not, sigma is lowered. Signs of pivots tell how many
modes lie below sigma (Sturm's count): an iteration that passed one over is done again from zero,
where the lowest come first.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy.linalg as sla

from flexgear.arrays import Array, Complex
from flexgear.model.errors import FlexgearError
from flexgear.structures.cyclic.condensation import CyclicCondensation
from flexgear.structures.cyclic.sectors import Circulant
from flexgear.structures.cyclic.solver import CyclicSolver
from flexgear.structures.linalg.dense import shared
from flexgear.structures.linalg.lanczos import Eigenpairs, lowest_modes, most_vectors

_STEPS = 4
_SPARE = 4  # vectors beyond those that are sought


def lowest_values(solver: CyclicSolver, inertia: Array, count: int) -> Array:
    """lambda (count,) rising of a body whose sectors' own ties are held."""
    harmonics, z = solver.border_harmonics, solver.count
    b = harmonics.size
    width = min(2 * count // z + _SPARE, b)
    start = np.random.default_rng(20240211).standard_normal((b, width)).astype(complex)
    values = np.empty((len(harmonics), width))
    harmonics.inverses()  # once, not in every thread

    def part(which: slice) -> None:
        for h in range(which.start, which.stop):
            phase = np.exp(2j * np.pi * h / z)
            momentum = _momentum(solver.gain, inertia, phase, start)
            for _ in range(_STEPS):
                x = harmonics.of(h, momentum)
                image = _momentum(solver.gain, inertia, phase, x)
                strain, motion = x.conj().T @ momentum, x.conj().T @ image
                values[h], turn = sla.eigh(_hermitian(strain), _hermitian(motion))
                momentum = image @ turn

    shared(len(harmonics), part, chunk=1)
    return np.sort(np.repeat(values, harmonics.times, axis=0), axis=None)[:count]


def held_value(solver: CyclicSolver, mass: Circulant) -> float:
    """Estimate of mu, the lowest eigenvalue of a held sector."""
    whole = mass.sector
    size = whole.shape[0] - solver.border_harmonics.size
    inertia = whole[:size, :size]
    load = np.random.default_rng(20240211).standard_normal((size, _SPARE))
    for _ in range(_STEPS):
        x = solver.inside(load)
        image = inertia @ x
        values, turn = sla.eigh(x.T @ load, x.T @ image)
        load = image @ turn
    return float(values[0])


def _momentum(gain: Array, mass: Array, phase: complex, x: Complex) -> Complex:
    """E_h^H g E_h x (b, k)."""
    b, k = x.shape
    shifted = phase * x
    ends = np.vstack([x, shifted, gain[:, :b] @ x + gain[:, b:] @ shifted])
    parts = mass @ np.hstack([ends.real, ends.imag])  # a complex copy of the mass would cost more
    g = parts[:, :k] + 1j * parts[:, k:]
    tied = gain.T @ g[2 * b :]
    out: Complex = g[:b] + tied[:b] + np.conj(phase) * (g[b : 2 * b] + tied[b:])
    return out


def _hermitian(a: Complex) -> Complex:
    return 0.5 * (a + a.conj().T)


BLOCK = 4  # vectors a step: columns of all sectors make them wide
_SHARE = 0.75  # of the highest omega^2 sought, about: fewest steps with a ring's modes
_CERTAIN = 0.95  # of its lower bound: above it a basis would fill with modes nobody seeks
_ATTEMPTS = 12
_NEAR = 1e5  # sigma over a mode's distance from it, at most


def cyclic_modes(
    condensation: CyclicCondensation, count: int, progress: Callable[[float], None]
) -> Eigenpairs:
    """The `count` lowest modes with the interface held."""
    shift, solver = 0.0, condensation.solver
    if condensation.has_short_borders:  # else it spares fewer steps than it costs
        shift, solver = _shifted(condensation, count)
    pairs = _from_shift(condensation, count, shift, solver, progress)
    if shift and (1 / pairs.values < shift).sum() != min(modes_below(solver), count):
        return _from_shift(condensation, count, 0.0, condensation.solver, progress)
    return pairs


def modes_below(solver: CyclicSolver) -> int:
    """Number of modes of the held body below the shift in the solver's K.

    K with its ties has a negative eigenvalue for each, beside one for every tie (Haynsworth 1968,
    Linear Algebra Appl. 1:73): interiors and own ties give only these, borders those of S_h, others
    those of -G.
    """
    units = 1 / np.sqrt(np.abs(np.diag(solver.flexibility)))
    signs = np.linalg.eigvalsh(units[:, None] * solver.flexibility * units)
    return solver.border_harmonics.negative - int((signs < 0).sum())


def _from_shift(
    condensation: CyclicCondensation,
    count: int,
    shift: float,
    solver: CyclicSolver,
    progress: Callable[[float], None],
) -> Eigenpairs:
    dofs = condensation.dofs
    most = min(most_vectors(count, BLOCK, dofs), dofs - BLOCK)
    start = np.random.default_rng(20230617).standard_normal((dofs, BLOCK))
    if shift:
        condensation.solver.border_harmonics.forget()  # beside the basis one set has room

    def solve(load: Array) -> Array:
        return solver.solve(load.reshape(-1, solver.count, load.shape[1])).reshape(dofs, -1)

    mass = condensation.mass_product
    return lowest_modes(solve, mass, start, count, most, progress=progress, shift=shift)


def _shifted(condensation: CyclicCondensation, count: int) -> tuple[float, CyclicSolver]:
    """sigma and the solver with it; sigma = 0 where none serves."""
    static = condensation.solver
    above = float(lowest_values(static, condensation.motion.inertia, count)[-1])
    held = held_value(static, condensation.fe_mass)
    below = 1 / (1 / above + 1 / held)
    shift = min(_SHARE * float(np.sqrt(below * above)), _CERTAIN * below)
    for _ in range(_ATTEMPTS):
        try:
            solver = condensation.shifted(shift)
        except FlexgearError:
            shift *= 0.5
            continue
        if _far(condensation, solver, shift):
            return shift, solver
        shift *= 0.97  # it met a mode
    return 0.0, condensation.solver


def _far(condensation: CyclicCondensation, solver: CyclicSolver, shift: float) -> bool:
    """Whether no mode is so near that it would drown the others: |T M x| against |x|."""
    shape = (condensation.dofs // solver.count, solver.count, 1)
    x = solver.solve(np.random.default_rng(7).standard_normal(shape))
    image = solver.solve(condensation.mass_product(x.reshape(-1, 1)).reshape(shape))
    return bool(shift * np.linalg.norm(image) <= _NEAR * np.linalg.norm(x))
