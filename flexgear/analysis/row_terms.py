"""Terms of contact rows at a time step that are no products: damping, right sides, loaded pairs."""

from __future__ import annotations

from numba import njit

from flexgear.coupling.compiled import FAST, INTO
from flexgear.coupling.pair_data import LOAD, PER_PAIR


@njit(**INTO)
def damping_of_rows(
    sided, model, touched, damping, pair_row, pair_mesh, pair_index, n, n_pairs, share, c, f
):  # fmt: skip
    """Row damping c and f = share · c; under one-sided contact a pair damps once it has been
    loaded for a step."""
    for i in range(n):
        c[i] = damping[i]
    for q in range(n_pairs):
        m = pair_mesh[q]
        if sided[m] == 1 and model[m] == PER_PAIR and touched[m, pair_index[q] % 8] == 0:
            c[pair_row[q]] = 0.0
    for i in range(n):
        f[i] = share * c[i]


@njit(**INTO, fastmath=FAST)
def right_sides(kind, stiffness, offset, n, delta, rate, c, right):
    """k (δ + e) + c δ̇ of every row, or the force itself where it is given."""
    for i in range(n):
        right[i] = stiffness[i] * (delta[i] + offset[i]) + c[i] * rate[i]
    for i in range(n):
        if kind[i] == LOAD:
            right[i] = offset[i]


@njit(**INTO)
def remember(pair_mesh, pair_index, pair_row, n_pairs, x, touched):
    """Note which pairs carry load, by index."""
    for m in range(touched.shape[0]):
        for k in range(touched.shape[1]):
            touched[m, k] = 0
    for q in range(n_pairs):
        if x[pair_row[q]] > 0.0:
            touched[pair_mesh[q], pair_index[q] % 8] = 1
