"""When back flanks have to be watched.

Mirroring the normal in the planet's radial axis keeps its radial part, turns the rest:
δ_back = 2 δ_radial − δ, evaluated at the loaded-flank pair nearest the pitch point. The margin
holds the largest errors of the back flank.
"""

from __future__ import annotations

import math

from numba import njit

from flexgear.coupling.compiled import INNER

GAP = 0.3  # of the backlash: what else than the look may close until the next one
PITCH = 4e-4  # of the base pitch: the same where there is hardly a backlash


@njit(**INNER)
def _nearest(rows, n_pairs, m, s_pitch):
    """The pair of gear mesh m nearest the pitch point, −1 where there is none."""
    best = -1
    distance = 1e30
    for q in range(n_pairs):
        if rows.pair_mesh[q] == m:
            off = abs(rows.pair_s[q] - s_pitch)
            if off < distance:
                distance = off
                best = q
    return best


@njit(**INNER)
def _margins_left(pairs, b, radial, delta):
    """How many margins the gap of back flank b still has; below 1 it has nearly closed."""
    margin = GAP * pairs.gap[b] + PITCH * pairs.pitch[b]
    return (pairs.gap[b] - pairs.largest_error[b] - (2 * radial - delta)) / margin


@njit(**INNER)
def _gear_approach(pairs, m, theta, motion, c):
    """Approach of the gear end at the line of centres, from channels c, c + 1 of its block."""
    angle = pairs.phi[m]
    if pairs.turns[m] >= 0:
        angle += theta[pairs.turns[m]]
    nx = pairs.cos_b[m] * pairs.normal[m, 0]
    return nx * (math.cos(angle) * motion[c] + math.sin(angle) * motion[c + 1])


@njit(**INNER)
def look_at_backs(pairs, rows, n_pairs, theta, motion, wanted):
    """Watch the back flanks of a gear mesh whose gap has nearly closed at a channel motion."""
    for m in range(pairs.s0.shape[0]):
        b = pairs.back[m]
        if b < 0:
            continue
        best = _nearest(rows, n_pairs, m, pairs.s_pitch[m])
        if best < 0:
            wanted[b] = 1
            continue
        r = rows.pair_row[best]
        delta = 0.0
        radial = -pairs.cos_b[m] * pairs.normal[m, 0] * motion[6 * rows.blocks[r, 0]]
        for a in range(rows.width[r]):
            base = 6 * rows.blocks[r, a]
            for p in range(6):
                delta += rows.coef[r, a, p] * motion[base + p]
        radial += _gear_approach(pairs, m, theta, motion, 6 * rows.blocks[r, 1])
        wanted[b] = 1 if _margins_left(pairs, b, radial, delta) < 1.0 else 0


@njit(**INNER)
def look_from_near(pairs, rows, at, change, ports, n_pairs, theta, motion, wanted):
    """The same at a motion of near channels, change (R,) that of the rows.

    Returns the fewest margins that any gap has: at two, half as many looks are as safe.
    """
    count = pairs.s0.shape[0]
    fewest = 1e30
    for m in range(count):
        b = pairs.back[m]
        if b < 0:
            continue
        best = _nearest(rows, n_pairs, m, pairs.s_pitch[m])
        if best < 0:
            wanted[b] = 1
            fewest = 0.0
            continue
        r = rows.pair_row[best]
        radial = motion[ports + 2 * count + m]
        if rows.beyond[r] < rows.width[r]:
            radial += _gear_approach(pairs, m, theta, motion, at[r, 1])
        left = _margins_left(pairs, b, radial, change[r])
        wanted[b] = 1 if left < 1.0 else 0
        fewest = min(fewest, left)
    return fewest
