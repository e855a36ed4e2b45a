"""The least a step has to do, compiled: what flexgear's kernel is measured by.

Two products with the kept modes, the contact matrix from the receptance, and its Cholesky solve:

    u = P_l eta,   A = diag(1/k) + V^T G V,   A F = V^T u + e,   eta <- eta - s P_l^T V F.

No search for loaded pairs, no damping, no moving teeth, no update of velocities, no outputs: the
rows V, their blocks and their number are those of one position of the same stage.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from flexgear.analysis.modes import rows_at
from flexgear.analysis.step_space import step_data
from flexgear.coupling.modal import ModalSystem

Array = np.ndarray


class BareData(NamedTuple):
    """modes: (n_l, n) of the channels in use; receptance: (n_l, n_l); rows: r of them."""

    modes: Array
    receptance: Array
    place: Array  # (r, B) first local channel of each block of a row
    width: Array  # (r,)
    coef: Array  # (r, B, 6)
    stiffness: Array  # (r,)
    offset: Array  # (r,)


def bare_data(modal: ModalSystem, time_step: float) -> BareData:
    """Sizes and numbers of the stage at the starting position."""
    rows, n = rows_at(modal.system)
    width = rows.row["width"][:n].copy()
    blocks = rows.blocks[:n]
    used = np.unique(np.concatenate([blocks[i, : width[i]] for i in range(n)]))
    local = {int(b): 6 * k for k, b in enumerate(used)}
    place = np.zeros_like(blocks)
    for i in range(n):
        place[i, : width[i]] = [local[int(b)] for b in blocks[i, : width[i]]]
    ports = len(modal.system.ports)
    channels = (6 * used[:, None] + np.arange(6)).ravel()
    channels = np.append(channels, len(modal.channels) - ports + np.arange(ports))
    data = step_data(modal, time_step)
    return BareData(
        np.ascontiguousarray(data.channels.modes[channels][:, : len(modal.omega)]),
        np.ascontiguousarray(data.channels.displacement[0][np.ix_(channels, channels)]),
        place,
        width,
        rows.coef[:n].copy(),
        rows.row["stiffness"][:n].copy(),
        rows.row["offset"][:n].copy(),
    )


@njit(cache=True, fastmath={"reassoc", "contract"})
def bare_steps(data, steps, eta):
    """Take steps; returns the sum of forces so that nothing is optimised away."""
    nl, n = data.modes.shape
    r = data.stiffness.shape[0]
    motion, push = np.zeros(nl), np.zeros(nl)
    matrix, x, y = np.zeros((r, r)), np.zeros(r), np.zeros(nl)
    total = 0.0
    for _ in range(steps):
        for c in range(nl):
            line = data.modes[c]
            sum_c = 0.0
            for j in range(n):
                sum_c += line[j] * eta[j]
            motion[c] = sum_c
            push[c] = 0.0
        for j in range(r):
            y[:] = 0.0
            delta = data.offset[j]
            for a in range(data.width[j]):
                base = data.place[j, a]
                for p in range(6):
                    v = data.coef[j, a, p]
                    delta += v * motion[base + p]
                    line = data.receptance[base + p]
                    for c in range(nl):
                        y[c] += v * line[c]
            x[j] = delta
            for i in range(j, r):
                entry = 0.0
                for a in range(data.width[i]):
                    base = data.place[i, a]
                    for p in range(6):
                        entry += data.coef[i, a, p] * y[base + p]
                matrix[i, j] = entry
            matrix[j, j] += 1.0 / data.stiffness[j]
        for j in range(r):  # Cholesky in place, then both triangular solves
            for i in range(j, r):
                entry = matrix[i, j]
                for c in range(j):
                    entry -= matrix[i, c] * matrix[j, c]
                matrix[i, j] = math.sqrt(entry) if i == j else entry / matrix[j, j]
        for i in range(r):
            entry = x[i]
            for c in range(i):
                entry -= matrix[i, c] * x[c]
            x[i] = entry / matrix[i, i]
        for i in range(r - 1, -1, -1):
            entry = x[i]
            for c in range(i + 1, r):
                entry -= matrix[c, i] * x[c]
            x[i] = entry / matrix[i, i]
        for i in range(r):
            total += x[i]
            for a in range(data.width[i]):
                base = data.place[i, a]
                for p in range(6):
                    push[base + p] += data.coef[i, a, p] * x[i]
        for c in range(nl):
            f = 1e-15 * push[c]
            if f != 0.0:
                line = data.modes[c]
                for j in range(n):
                    eta[j] -= f * line[j]
    return total
