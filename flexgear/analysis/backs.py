"""When back flanks have to be watched."""

from __future__ import annotations

import math

from numba import njit

from flexgear.coupling.compiled import INNER


@njit(**INNER)
def look_at_backs(pairs, rows, n_pairs, theta, motion, wanted):
    """Watch the back flanks of a gear mesh whose gap at the pitch point has nearly closed.

    Mirroring the normal in the planet's radial axis keeps its radial part, turns the rest:
    δ_back = 2 δ_radial − δ, evaluated at the loaded-flank pair nearest the pitch point. The margin
    holds the largest errors of the back flank.
    """
    for m in range(pairs.s0.shape[0]):
        b = pairs.back[m]
        if b < 0:
            continue
        best = -1
        distance = 1e30
        for q in range(n_pairs):
            if rows.pair_mesh[q] == m:
                off = abs(rows.pair_s[q] - pairs.s_pitch[m])
                if off < distance:
                    distance = off
                    best = q
        if best < 0:
            wanted[b] = 1
            continue
        r = rows.pair_row[best]
        angle = pairs.phi[m]
        if pairs.turns[m] >= 0:
            angle += theta[pairs.turns[m]]
        ca, sa = math.cos(angle), math.sin(angle)
        nx = pairs.cos_b[m] * pairs.normal[m, 0]
        delta = 0.0
        radial = -nx * motion[6 * rows.blocks[r, 0]]
        for a in range(rows.width[r]):
            base = 6 * rows.blocks[r, a]
            for p in range(6):
                delta += rows.coef[r, a, p] * motion[base + p]
        gear = 6 * rows.blocks[r, 1]
        radial += nx * (ca * motion[gear] + sa * motion[gear + 1])
        margin = 0.3 * pairs.gap[b] + 2e-5
        near = 2 * radial - delta > pairs.gap[b] - margin - pairs.largest_error[b]
        wanted[b] = 1 if near else 0
