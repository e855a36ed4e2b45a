r"""Where the lowest modes of a body of equal sectors lie, for a shift among them.

A sector whose borders are held vibrates far above the modes that are sought, so that motion of the
borders tells nearly all. Their harmonics X_h move a sector's ends, see `CyclicSolver.shapes`, by
e = E_h X_h, and with g = R^T E R, the inertia of ends of `cyclic/projection.py`,

    S_h X_h = lambda E_h^H g E_h X_h,   h = 0 ... z // 2,

by a few steps of subspace iteration. Ties that not every sector has are left free. Both motions
are orthogonal in K, so that with mu, the lowest of a sector held at its borders, the body's n-th
lies between bounds as Dunkerley's,

    1/(1/lambda_n + 1/mu) <= omega_n^2 <= lambda_n.

Source: Guyan 1965, AIAA J. 3:380.
"""

from __future__ import annotations

import numpy as np
import scipy.linalg as sla
from numpy.typing import NDArray

from flexgear.structures.cyclic.matrices import Circulant
from flexgear.structures.cyclic.solver import CyclicSolver
from flexgear.structures.linalg.threads import shared

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

_STEPS = 4
_SPARE = 4  # vectors beyond those that are sought


def lowest_values(solver: CyclicSolver, inertia: Array, count: int) -> Array:
    """lambda (count,) rising of a body whose sectors' own ties are held."""
    harmonics, z = solver.border_harmonics, solver.count
    b = harmonics.size
    width = min(2 * count // z + _SPARE, b)
    start = np.random.default_rng(20240211).standard_normal((b, width)).astype(complex)
    inside = 2 * b + len(solver.gain)
    mass = np.ascontiguousarray(inertia[:inside, :inside])
    values = np.empty((len(harmonics), width))
    harmonics.made()  # once, not in every thread

    def part(which: slice) -> None:
        for h in range(which.start, which.stop):
            phase = np.exp(2j * np.pi * h / z)
            momentum = _momentum(solver.gain, mass, phase, start)
            for _ in range(_STEPS):
                x = harmonics.of(h, momentum)
                image = _momentum(solver.gain, mass, phase, x)
                strain, motion = x.conj().T @ momentum, x.conj().T @ image
                values[h], turn = sla.eigh(_hermitian(strain), _hermitian(motion))
                momentum = image @ turn

    shared(len(harmonics), part, chunk=1)
    return np.sort(np.repeat(values, harmonics.times, axis=0), axis=None)[:count]


def held_value(solver: CyclicSolver, mass: Circulant) -> float:
    """mu, about."""
    whole = mass.on_dofs().here
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
    far = phase * x
    ends = np.vstack([x, far, gain[:, :b] @ x + gain[:, b:] @ far])
    parts = mass @ np.hstack([ends.real, ends.imag])  # a complex copy of the mass would cost more
    g = parts[:, :k] + 1j * parts[:, k:]
    tied = gain.T @ g[2 * b :]
    out: Complex = g[:b] + tied[:b] + np.conj(phase) * (g[b : 2 * b] + tied[b:])
    return out


def _hermitian(a: Complex) -> Complex:
    return 0.5 * (a + a.conj().T)
