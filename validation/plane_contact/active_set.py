"""Frictionless contact of two bodies that one number brings together.

    g = g₀ + C p − L x ≥ 0,   p ≥ 0,   p · g = 0,   L · p = T

with gaps g₀ (m) of the undeformed bodies, their compliance C of nodal forces p (N per m of face),
the gaps L x that a motion x of the one body closes, and the load T that is conjugate to x. Solved
by a primal-dual active set (Hintermüller, Ito and Kunisch 2002), which ends with both
conditions exact.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
MOST_STEPS = 200


def solve(gap: Array, compliance: Array, lever: Array, load: float) -> tuple[Array, float]:
    """p (n,) and x."""
    order = np.argsort(gap / lever)
    active = np.zeros(len(gap), bool)
    active[order[: max(3, len(gap) // 20)]] = True
    scale = 1.0 / np.median(np.diag(compliance))
    seen: set[bytes] = set()
    for _ in range(MOST_STEPS):
        p, x = _on(active, gap, compliance, lever, load)
        room = gap + compliance @ p - lever * x
        wanted = p - scale * room > 0
        if (wanted == active).all():
            return p, x
        if wanted.tobytes() in seen or not wanted.any():
            wanted = _one_step(active, p, room, scale)
        seen.add(wanted.tobytes())
        active = wanted
    raise RuntimeError("the active set did not settle")


def _one_step(active: NDArray[np.bool_], p: Array, room: Array, scale: float) -> NDArray[np.bool_]:
    """Only the worst offender changes sides, where whole sets go round in a circle."""
    worst = np.where(active, -p, -scale * room)
    out = active.copy()
    k = int(np.argmax(worst))
    out[k] = not out[k]
    return out


def _on(
    active: NDArray[np.bool_], gap: Array, compliance: Array, lever: Array, load: float
) -> tuple[Array, float]:
    """Forces of nodes that all touch, others free."""
    inner = np.linalg.solve(
        compliance[np.ix_(active, active)], np.column_stack([lever[active], gap[active]])
    )
    by_lever, by_gap = inner.T
    x = (load + lever[active] @ by_gap) / (lever[active] @ by_lever)
    p = np.zeros(len(gap))
    p[active] = x * by_lever - by_gap
    return p, float(x)
