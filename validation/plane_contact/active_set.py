"""Frictionless contact of bodies that some rigid motions bring together.

    g = g₀ + C p − A x ≥ 0,   p ≥ 0,   p · g = 0,   K x + Aᵀ p = t

with gaps g₀ (m) of the undeformed bodies, their compliance C of nodal forces p (N per m of face),
the gaps A x that motions x close, the stiffness K of what holds the bodies and the loads t on them.
Solved by a primal-dual active set (Hintermüller, Ito and Kunisch 2002), which ends with both
conditions exact.
"""

import numpy as np
from numpy.typing import NDArray

from flexgear.arrays import Array

Active = NDArray[np.bool_]
MOST_STEPS = 200


def solve(
    gap: Array, compliance: Array, closing: Array, load: Array, support: Array | None = None
) -> tuple[Array, Array]:
    """p (n,) and x (m,); closing: A (n, m); load: t (m,); support: K (m, m), none if left out."""
    held = np.zeros((len(load), len(load))) if support is None else support
    active = np.zeros(len(gap), bool)
    active[np.argsort(gap)[: max(3, len(gap) // 20)]] = True
    scale = 1.0 / np.median(np.diag(compliance))
    seen: set[bytes] = set()
    for _ in range(MOST_STEPS):
        p, x = _on(active, gap, compliance, closing, load, held)
        room = gap + compliance @ p - closing @ x
        next_active = p - scale * room > 0
        if (next_active == active).all():
            return p, x
        if next_active.tobytes() in seen or not next_active.any():
            next_active = _one_step(active, p, room, scale)
        seen.add(next_active.tobytes())
        active = next_active
    raise RuntimeError("the active set did not settle")


def _one_step(active: Active, p: Array, room: Array, scale: float) -> Active:
    """Only the worst offender changes sides, where whole sets go round in a circle."""
    worst = np.where(active, -p, -scale * room)
    out = active.copy()
    k = int(np.argmax(worst))
    out[k] = not out[k]
    return out


def _on(
    active: Active, gap: Array, compliance: Array, closing: Array, load: Array, support: Array
) -> tuple[Array, Array]:
    """Forces of nodes that all touch, others free."""
    reach = closing[active]
    inner = np.linalg.solve(
        compliance[np.ix_(active, active)], np.column_stack([reach, gap[active]])
    )
    by_motion, by_gap = inner[:, :-1], inner[:, -1]
    x = np.linalg.solve(support + reach.T @ by_motion, load + reach.T @ by_gap)
    p = np.zeros(len(gap))
    p[active] = by_motion @ x - by_gap
    return p, x
