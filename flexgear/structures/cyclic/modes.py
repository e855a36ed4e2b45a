"""Fixed-interface modes of a body of equal sectors: harmonic by harmonic where its ties allow it
(`cyclic/harmonic_modes.py`), else by an iteration of whole fields with a shift among the modes.

Choice of the shift. The frequencies of a sector with its borders held are far above those of the
modes that are sought, so that the motion of the borders nearly determines these modes (Guyan
reduction). Harmonics X_h of the borders move a sector's ends, see `CyclicSolver.shapes`, by
e = E_h X_h, and with g = R^T E R, the inertia of the ends of `cyclic/projection.py`,

    S_h X_h = lambda E_h^H g E_h X_h,   h = 0 ... z // 2,

which a few steps of subspace iteration solve. Ties that not every sector has are left free. The
motion by the borders and that with held borders are orthogonal in K, so that with mu, the lowest
omega^2 of a sector with held borders, the n-th omega^2 of the body has bounds as Dunkerley's,

    1/(1/lambda_n + 1/mu) <= omega_n^2 <= lambda_n.

Source: Guyan 1965, AIAA J. 3:380.

The modes. With the shift

    (K - sigma M) x = M v + B^T rho,   B x = 0

takes no more work than with sigma = 0, and with sigma among the modes the iteration converges
faster. K - sigma M is not definite, but its part of a sector's interior is while the sector's
frequencies with held borders are higher; where they are not, sigma is lowered. Signs of pivots give
the number of modes below sigma (Sturm's count). If the iteration has missed one, it is repeated
without a shift, where the lowest modes come first.
"""

from collections.abc import Callable

import numpy as np
import scipy.linalg as sla

from flexgear.arrays import Array, Complex
from flexgear.model.errors import FlexgearError
from flexgear.structures.cyclic.condensation import CyclicCondensation
from flexgear.structures.cyclic.harmonic_modes import harmonic_modes
from flexgear.structures.cyclic.sectors import Circulant
from flexgear.structures.cyclic.solver import CyclicSolver
from flexgear.structures.linalg.dense import shared
from flexgear.structures.linalg.lanczos import (
    Eigenpairs,
    lowest_modes,
    most_vectors,
    vectors_a_step,
)

_STEPS = 4  # of subspace iterations
_SPARE = 4  # vectors in addition to those that are sought


def lowest_values(solver: CyclicSolver, inertia: Array, count: int) -> Array:
    """Upper bounds lambda (count,), rising, of the lowest omega^2 of a body held at the ties that
    every sector has; inertia: g (e, e) of a sector's ends."""
    harmonics, z = solver.border_harmonics, solver.count
    b = harmonics.size
    width = min(2 * count // z + _SPARE, b)
    start = np.random.default_rng(20240211).standard_normal((b, width)).astype(complex)
    values = np.empty((len(harmonics), width))
    harmonics.inverses()  # computed here once and not by every thread

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
    """Estimate of mu, the lowest omega^2 of a sector with its borders held."""
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
    """Momentum E_h^H g E_h x (b, k) of the borders' harmonic x (b, k); phase: e^{2πi h/z}."""
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


_SHARE = 0.75  # shift over the highest omega^2 sought, about: fewest steps with a ring's modes
_CERTAIN = 0.95  # largest shift over the lower bound of that: else many modes above it converge
_ATTEMPTS = 12
_CLOSEST = 1e5  # largest ratio of sigma to its distance from a mode


def cyclic_modes(
    condensation: CyclicCondensation, count: int, progress: Callable[[float], None]
) -> Eigenpairs:
    """The `count` lowest modes with the interface held."""
    if condensation.ties.invariant:
        pairs = harmonic_modes(condensation, count, progress)
        if pairs is not None:
            return pairs
    shift, solver = 0.0, condensation.solver
    if condensation.has_short_borders:  # else another factor costs more than the steps it saves
        shift, solver = _shifted(condensation, count)
    pairs = _from_shift(condensation, count, shift, solver, progress)
    if shift and (1 / pairs.values < shift).sum() != min(modes_below(solver), count):
        return _from_shift(condensation, count, 0.0, condensation.solver, progress)
    return pairs


def modes_below(solver: CyclicSolver) -> int:
    """Number of modes of the body with held interface below the shift in the solver's K.

    K with its ties has one negative eigenvalue for each of these modes and one for every tie
    (Haynsworth 1968, Linear Algebra Appl. 1:73): only the latter from interiors and ties that every
    sector has, the rest from the borders' S_h and, for the other ties, from -G.
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
    """The `count` lowest modes by an iteration with a shift, and the solver with that shift."""
    dofs = condensation.dofs
    block = vectors_a_step(count)
    most = min(most_vectors(count, block, dofs), dofs - block)
    start = np.random.default_rng(20230617).standard_normal((dofs, block))
    if shift:
        condensation.solver.border_harmonics.forget()  # memory for the basis and one set only

    def solve(load: Array) -> Array:
        return solver.solve(load.reshape(-1, solver.count, load.shape[1])).reshape(dofs, -1)

    mass = condensation.mass_product
    return lowest_modes(solve, mass, start, count, most, progress=progress, shift=shift)


def _shifted(condensation: CyclicCondensation, count: int) -> tuple[float, CyclicSolver]:
    """A shift sigma and its solver; zero and the unshifted solver where none is possible."""
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
        if _is_clear_of_modes(condensation, solver, shift):
            return shift, solver
        shift *= 0.97
    return 0.0, condensation.solver


def _is_clear_of_modes(
    condensation: CyclicCondensation, solver: CyclicSolver, shift: float
) -> bool:
    """Whether no mode is so near the shift that rounding would hide the others, by |T M x|/|x|."""
    shape = (condensation.dofs // solver.count, solver.count, 1)
    x = solver.solve(np.random.default_rng(7).standard_normal(shape))
    image = solver.solve(condensation.mass_product(x.reshape(-1, 1)).reshape(shape))
    return bool(shift * np.linalg.norm(image) <= _CLOSEST * np.linalg.norm(x))
