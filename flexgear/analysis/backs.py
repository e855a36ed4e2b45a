"""When back flanks have to be watched.

Mirroring the normal in the planet's radial axis keeps its radial part, turns the rest:
δ_back = 2 δ_radial − δ, evaluated at the loaded-flank pair nearest the pitch point. The gap that is
left has to exceed shares of backlash and pitch, the deflection that is let go when the front parts,
and twice the way of the back flank until the next look at the largest speed of late: a flank that
is found late, deep inside the other, would get its elastic energy for nothing.
"""

from __future__ import annotations

import math

from numba import njit

from flexgear.analysis.contact_law import gained
from flexgear.analysis.lines import dot
from flexgear.coupling.compiled import INNER

GAP = 0.3  # of the backlash: what else than the look may close until the next one
PITCH = 4e-4  # of the base pitch: the same where there is hardly a backlash
LATE = 0.9  # of the largest approach speed that is remembered from one look to the next


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
def _margins_left(pairs, b, radial, delta, way):
    """How many margins the gap of back flank b still has; below 1 it has nearly closed.

    radial, delta: approaches along the line of centres and of the front flank, m; way: of the back
    flank until the next look.
    """
    margin = GAP * pairs.gap[b] + PITCH * pairs.pitch[b] + max(delta, 0.0) + 2.0 * way
    return (pairs.gap[b] - pairs.largest_error[b] - (2.0 * radial - delta)) / margin


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
        wanted[b] = 1 if _margins_left(pairs, b, radial, delta, 0.0) < 1.0 else 0


@njit(**INNER)
def look_from_near(
    pairs, rows, at, change, rate, ports, n_pairs, theta, motion, motion_rate, modes, push,
    gain, ahead, speed, wanted,
):  # fmt: skip
    """The same at a motion of near channels and its rate; change and rate (R,): those of the rows.

    Rates are those of the free motion: loads push modes (n,) and add gain times that to velocities.
    ahead: time until the next look, s; speed (M,): largest approach speed of late, m/s, updated.
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
        line = ports + 2 * count + m
        motion_rate[line] += gain * dot(push, modes[line])
        radial, nearing = motion[line], motion_rate[line]
        if rows.beyond[r] < rows.width[r]:
            for c in range(at[r, 1], at[r, 1] + 2):
                motion_rate[c] += gain * dot(push, modes[c])
            radial += _gear_approach(pairs, m, theta, motion, at[r, 1])
            nearing += _gear_approach(pairs, m, theta, motion_rate, at[r, 1])
        approach = rate[r] + gain * gained(
            r, rows.line, rows.along, at, rows.coef, rows.width, rows.beyond, ports, modes, push
        )
        speed[m] = max(abs(2.0 * nearing - approach), LATE * speed[m])
        left = _margins_left(pairs, b, radial, change[r], ahead * speed[m])
        wanted[b] = 1 if left < 1.0 else 0
        fewest = min(fewest, left)
    return fewest
