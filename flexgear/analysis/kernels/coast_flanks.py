"""Check of coast flanks: when they have to be included in the contact problem.

The normal of the coast flank is that of the drive flank mirrored at the radial axis of the planet.
So the coast flank closes by δ_coast = 2 δ_radial − δ, evaluated at the drive-flank pair nearest to
the pitch point. Its remaining gap must exceed a margin: shares of backlash and base pitch, the
deflection that is released when the drive flank parts, and twice the motion of the coast flank
until the next check, at the largest recent speed. A flank included too late, with overlap, would
have elastic energy that no work has supplied.
"""

import math

import numpy as np

from flexgear.analysis.kernels.active_dofs import channel_motion, dof_motion
from flexgear.compiled import INNER, PART, njit
from flexgear.coupling.kernels.elements import of_blocks

GAP = 0.3  # share of the backlash in the margin
PITCH = 4e-4  # share of the base pitch in the margin, for small backlash
LATE = 0.9  # factor on the largest approach speed from one check to the next
NONE = 1e30  # number of margins without coast flanks


@njit(**INNER)
def _nearest(pairs, count, m, s_pitch):
    """Index of the pair of gear mesh m nearest to the pitch point, −1 without a pair."""
    best = -1
    distance = 1e30
    for q in range(count):
        if pairs[q].gear_mesh == m:
            from_pitch_point = abs(pairs[q].s - s_pitch)
            if from_pitch_point < distance:
                distance = from_pitch_point
                best = q
    return best


@njit(**INNER)
def _margins_left(coast, radial, delta, path):
    """Remaining gap of a coast flank over the margin; below 1 the flank has to be included.

    radial, delta: approaches along the line of centres and of the drive flank, m; path: motion of
    the coast flank until the next check, m.
    """
    margin = GAP * coast.gap + PITCH * coast.pitch + max(delta, 0.0) + 2.0 * path
    return (coast.gap - coast.largest_error - (2.0 * radial - delta)) / margin


@njit(**INNER)
def _gear_approach(gear_mesh, theta, x, y):
    """Approach along the line of centres by the motion x, y of the gear in its frame, m."""
    angle = gear_mesh.phi
    if gear_mesh.turns >= 0:
        angle += theta[gear_mesh.turns]
    return gear_mesh.cos_b * gear_mesh.normal_x * (math.cos(angle) * x + math.sin(angle) * y)


@njit(**INNER)
def _planet_tooth_approach(gear_mesh, theta, x, y):
    """Approach along the line of centres by the elastic displacement x, y of a planet's tooth in
    the frame of the planet's teeth, m."""
    angle = theta[gear_mesh.planet_turns]
    return -gear_mesh.cos_b * gear_mesh.normal_x * (math.cos(angle) * x - math.sin(angle) * y)


@njit(**PART)
def _beside_rotation(x, y, turned, place):
    """Motion x, y of a tooth's node without that by its rotation ``turned`` about the axis: as the
    node is not exactly on the line of centres, rotation of the ring would appear as an approach."""
    return x + turned * place[1], y - turned * place[0]


@njit(**INNER)
def look_at_rest(gears, rows, pairs, theta, motion, m, active_flanks):
    """Include the coast flank of gear mesh m in ``active_flanks`` if its gap has nearly closed at a
    motion of the channels, else exclude it."""
    gear_meshes, gear_mesh = gears.gear_mesh, gears.gear_mesh[m]
    best = _nearest(rows.pair, pairs, m, gear_mesh.s_pitch)
    if best < 0:
        active_flanks[gear_mesh.opposite] = 1
        return
    r, count, delta = rows.pair[best].row, rows.pair[best].rows, 0.0
    radial = -gear_mesh.cos_b * gear_mesh.normal_x * motion[6 * rows.blocks[r, 0]]
    for i in range(r, r + count):
        delta += of_blocks(rows, i, motion) / count
    c = 6 * rows.blocks[r, 1]
    x, y, turned = motion[c], motion[c + 1], motion[c + 5]
    if gear_mesh.per_tooth == 1:
        x, y = _beside_rotation(x, y, turned, gears.tooth_position[rows.blocks[r, 1]])
    radial += _gear_approach(gear_mesh, theta, x, y)
    if gear_mesh.planet_turns >= 0:
        c = 6 * rows.blocks[r, rows.row[r].width - 1]
        radial += _planet_tooth_approach(gear_mesh, theta, motion[c], motion[c + 1])
    left = _margins_left(gear_meshes[gear_mesh.opposite], radial, delta, 0.0)
    active_flanks[gear_mesh.opposite] = 1 if left < 1.0 else 0


@njit(**PART)
def _radial_approach(data, work, level, m, r):
    """Approach along the line of centres of gear mesh m, m, and rate, m/s; r: row of a pair."""
    channels, active, rows, modes = data.channels, work.active, work.rows, work.modes
    counts, gears, theta = active.counts[0], data.elements.gears, modes.theta
    gear_meshes = gears.gear_mesh
    force, eta, rate = work.dofs.force, modes.free, modes.free_rate
    line = 6 * counts.blocks + counts.ports + 2 * gear_meshes.shape[0] + m
    radial, nearing = channel_motion(channels, active, line, eta, rate, force)
    if rows.row[r].beyond == 1:
        d, place = np.int64(rows.place[r, 1]), gears.tooth_position[rows.blocks[r, 1]]
        x, x_speed = dof_motion(active, level, d, eta, rate, force)
        y, y_speed = dof_motion(active, level, d + 1, eta, rate, force)
        turned, turning = dof_motion(active, level, d + 5, eta, rate, force)
        x, y = _beside_rotation(x, y, turned, place)
        radial += _gear_approach(gear_meshes[m], theta, x, y)
        x, y = _beside_rotation(x_speed, y_speed, turning, place)
        nearing += _gear_approach(gear_meshes[m], theta, x, y)
    if gear_meshes[m].planet_turns >= 0:
        d = np.int64(rows.place[r, rows.row[r].width - 1])
        x, x_speed = dof_motion(active, level, d, eta, rate, force)
        y, y_speed = dof_motion(active, level, d + 1, eta, rate, force)
        radial += _planet_tooth_approach(gear_meshes[m], theta, x, y)
        nearing += _planet_tooth_approach(gear_meshes[m], theta, x_speed, y_speed)
    return radial, nearing


@njit(**INNER)
def look_after_step(data, work, level, pairs, ahead, active_flanks):
    """Include or exclude all coast flanks at the new motion of a step; ahead: time until the next
    check, s. Returns the least gap over its margin: at 2 and more, half as many checks suffice."""
    gear_meshes, rows, speed = data.elements.gears.gear_mesh, work.rows, work.closing_speed
    fewest, motion = NONE, work.problem.motion
    for m in range(gear_meshes.shape[0]):
        b = gear_meshes[m].opposite
        if b < 0:
            continue
        best = _nearest(rows.pair, pairs, m, gear_meshes[m].s_pitch)
        if best < 0:
            active_flanks[b] = 1
            fewest = 0.0
            continue
        r, far = rows.pair[best].row, rows.pair[best].row + rows.pair[best].rows - 1
        radial, nearing = _radial_approach(data, work, level, m, r)
        delta = 0.5 * (motion[0, r] + motion[0, far] - rows.row[r].offset - rows.row[far].offset)
        approach = 0.5 * (motion[1, r] + motion[1, far])
        speed[m] = max(abs(2.0 * nearing - approach), LATE * speed[m])
        left = _margins_left(gear_meshes[b], radial, delta, ahead * speed[m])
        active_flanks[b] = 1 if left < 1.0 else 0
        fewest = min(fewest, left)
    return fewest
