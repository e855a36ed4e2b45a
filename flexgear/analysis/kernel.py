"""Compiled Newmark step in modal coordinates with constant receptances of the contact channels.

Average acceleration (β = 1/4, γ = 1/2, Newmark 1959). For a mode, with D = 1/(1 + γ h d + β h² ω²)
and d = 2ζω,

    a⁺ = D (p⁺ − d v* − ω² η*),  η⁺ = η* + β h² a⁺,  v⁺ = v* + γ h a⁺,

so unit channel forces move the channels by G_d = Φ βh² D Φᵀ + R and change their velocity by
G_v = Φ γh D Φᵀ, constant for a step size. A step builds the rows of the pairs in mesh at the
angles of the new time, solves one small contact problem and projects the forces back. Forces of a
turning frame, G v − C q, act with motion extrapolated to the new time, second order.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from flexgear.analysis.backs import look_at_backs
from flexgear.analysis.contact import (
    local_blocks,
    look_along,
    release,
    right_side,
    row_products,
    row_values,
    solve_active,
)
from flexgear.analysis.energy import settle
from flexgear.coupling.pair_data import PER_PAIR
from flexgear.coupling.pairs import build_rows

Array = NDArray[np.float64]
BETA, GAMMA = 0.25, 0.5
STICK = 1e-3  # share of rated speed below which a constant brake torque fades


class StepData(NamedTuple):
    """Constant arrays of a step size h; n modes, n_c channels (6 a block, then P ports)."""

    h: float
    omega2: Array  # (n,)
    damping: Array  # (n,) 2ζω
    inverse: Array  # (n,) D
    angles: Array  # (A, n)
    masters: Array  # (F, n)
    gyroscopic: Array  # (n, n) or (0, 0)
    centripetal: Array  # (n, n) or (0, 0)
    ports: int  # P, the braked one last
    channel_modes: Array  # (n_c, n)
    residual: Array  # (n_c, n_c)
    g_displacement: Array  # (n_c, n_c)
    g_velocity: Array  # (n_c, n_c)
    brake_torque: float
    brake_speed: float
    brake_exponent: float


class State(NamedTuple):
    """What a step carries on; arrays are updated in place."""

    eta: Array  # (n,)
    velocity: Array  # (n,)
    acceleration: Array  # (n,)
    touched: NDArray[np.uint8]  # (M, 8) pair was loaded at the last step, by index mod 8
    wanted: NDArray[np.int64]  # (M,) gear meshes to look at
    forces: Array  # (n_c,) channel forces of the last step, valid on the blocks then in contact
    torques: Array  # (P,) given torques and the brake's of the last step
    energy: Array  # (8,) in the order of ENERGIES


class Samples(NamedTuple):
    """Where a chunk of saved samples goes, (n_saved, …)."""

    eta: Array
    theta: Array  # (…, A) angles used for the pairs' geometry
    masters: Array  # (…, F, 2) independent rotations and their speeds
    torques: Array  # (…, P) given torques, and the brake's
    output_speed: Array
    pair_load: Array  # (…, M, SLOTS)
    pair_tooth: NDArray[np.int16]
    pair_stiffness: Array
    pair_position: Array
    support_load: Array  # (…, extra rows)
    direction: Array  # (…, n_c, 3)
    energy: Array  # (…, 8)
    wanted: NDArray[np.int64]


@njit(cache=True)
def brake_line(data, speed):
    """Brake torque and its slope at an output speed: T = T_r sign(ω)|ω/ω_r|ⁿ.

    A constant torque (n = 0) fades linearly below a thousandth of the rated speed, so that it
    never drives a train at rest.
    """
    ratio = abs(speed) / data.brake_speed
    sign = 1.0 if speed >= 0.0 else -1.0
    n = data.brake_exponent
    if n == 1.0:
        slope = data.brake_torque / data.brake_speed
        return slope * speed, slope
    if n == 0.0 and ratio < STICK:
        slope = data.brake_torque / (STICK * data.brake_speed)
        return slope * speed, slope
    torque = sign * data.brake_torque * ratio**n
    slope = 0.0 if ratio == 0.0 else n * data.brake_torque / data.brake_speed * ratio ** (n - 1.0)
    return torque, slope


@njit(cache=True, fastmath={"reassoc", "contract"})
def _channels(data, blocks, m, vector, out):
    """out = channel_modes @ vector on the local blocks and the ports."""
    nc, n = data.channel_modes.shape
    for c in range(m):
        for p in range(6):
            row = data.channel_modes[6 * blocks[c] + p]
            total = 0.0
            for j in range(n):
                total += row[j] * vector[j]
            out[6 * blocks[c] + p] = total
    for c in range(nc - data.ports, nc):
        row = data.channel_modes[c]
        total = 0.0
        for j in range(n):
            total += row[j] * vector[j]
        out[c] = total


@njit(cache=True, fastmath={"reassoc", "contract"})
def _project(data, blocks, m, forces, out):
    """out = channel_modesᵀ @ forces, forces being zero outside the local blocks and torques."""
    nc, n = data.channel_modes.shape
    for j in range(n):
        out[j] = 0.0
    for c in range(m + 1):
        first, count = (6 * blocks[c], 6) if c < m else (nc - data.ports, data.ports)
        for p in range(count):
            f = forces[first + p]
            if f != 0.0:
                row = data.channel_modes[first + p]
                for j in range(n):
                    out[j] += f * row[j]


@njit(cache=True)
def _spread(rows, n, x, blocks, m, torques, forces):
    """Channel forces of pair forces x and of torques (P,), the last one braking."""
    nc = forces.shape[0]
    ports = torques.shape[0]
    for c in range(m):
        for p in range(6):
            forces[6 * blocks[c] + p] = 0.0
    for i in range(n):
        if x[i] == 0.0:
            continue
        for a in range(rows.width[i]):
            base = 6 * rows.blocks[i, a]
            for p in range(6):
                forces[base + p] -= x[i] * rows.coef[i, a, p]
    for q in range(ports):
        forces[nc - ports + q] = torques[q]
    forces[nc - 1] = -torques[ports - 1]


@njit(cache=True)
def _damping_of_rows(pairs, rows, n, n_pairs, state, c):
    """Row damping; under one-sided contact a pair damps once it has been loaded for a step."""
    for i in range(n):
        c[i] = rows.damping[i]
    if pairs.one_sided:
        for q in range(n_pairs):
            mesh = rows.pair_mesh[q]
            if pairs.model[mesh] == PER_PAIR and state.touched[mesh, rows.pair_index[q] % 8] == 0:
                c[rows.pair_row[q]] = 0.0


@njit(cache=True, fastmath={"reassoc", "contract"})
def local_motion(data, blocks, m, eta, forces, out):
    """Channel displacement Φ η + R f on the local blocks and the ports."""
    _channels(data, blocks, m, eta, out)
    nc = out.shape[0]
    for c in range(m + 1):
        first, count = (6 * blocks[c], 6) if c < m else (nc - data.ports, data.ports)
        for p in range(count):
            line = data.residual[first + p]
            total = 0.0
            for q in range(nc - data.ports, nc):
                total += line[q] * forces[q]
            for b in range(m):
                at = 6 * blocks[b]
                for q in range(6):
                    total += line[at + q] * forces[at + q]
            out[first + p] += total


@njit(cache=True)
def _save(samples, at, data, rows, n, n_pairs, x, state, theta, torques):
    """Copy one sample."""
    samples.eta[at] = state.eta
    samples.theta[at] = theta
    for f in range(data.masters.shape[0]):
        samples.masters[at, f, 0] = np.dot(data.masters[f], state.eta)
        samples.masters[at, f, 1] = np.dot(data.masters[f], state.velocity)
    samples.torques[at] = torques
    nc = data.channel_modes.shape[0]
    samples.output_speed[at] = np.dot(data.channel_modes[nc - 1], state.velocity)
    samples.pair_load[at] = 0.0
    samples.pair_tooth[at] = -1
    samples.pair_stiffness[at] = 0.0
    samples.pair_position[at] = 0.0
    for q in range(n_pairs):
        m, slot = rows.pair_mesh[q], rows.pair_slot[q]
        samples.pair_load[at, m, slot] = rows.pair_share[q] * x[rows.pair_row[q]]
        samples.pair_tooth[at, m, slot] = rows.pair_tooth[q]
        samples.pair_stiffness[at, m, slot] = rows.pair_stiffness[q]
        samples.pair_position[at, m, slot] = rows.pair_s[q]
    for r in range(n):
        if rows.kind[r] < 0:
            samples.support_load[at, rows.owner[r]] = x[r]
    samples.direction[at] = rows.direction
    samples.energy[at] = state.energy
    samples.wanted[at] = state.wanted


@njit(cache=True, fastmath={"reassoc", "contract"})
def forces_at_state(data, pairs, rows, state, theta, torques, scratch, x):
    """Pair forces of a given state (η, v): the contact problem with frozen modes.

    Returns (rows, pairs, local blocks, status). Used for consistent accelerations.
    """
    (matrix, _, work, wide, right, delta, rate, c, motion, place, blocks, active) = scratch
    n, n_pairs = build_rows(pairs, rows, theta, state.wanted)
    m = local_blocks(rows, n, place, blocks)
    nc = data.channel_modes.shape[0]
    _channels(data, blocks, m, state.eta, motion)
    for b in range(m):
        for p in range(6):
            at = 6 * blocks[b] + p
            for q in range(data.ports - 1):
                motion[at] += data.residual[at, nc - data.ports + q] * torques[q]
            motion[at] -= data.residual[at, nc - 1] * torques[data.ports - 1]
    row_values(rows, n, motion, delta)
    _channels(data, blocks, m, state.velocity, motion)
    row_values(rows, n, motion, rate)
    row_products(rows, n, data.residual, place, blocks, wide, matrix)
    _damping_of_rows(pairs, rows, n, n_pairs, state, c)
    for i in range(n):
        k = rows.stiffness[i]
        right[i] = right_side(rows, i, delta[i], rate[i], c[i])
        for j in range(n):
            matrix[i, j] *= k
        matrix[i, i] += 1.0
        active[i] = 1
    status = solve_active(matrix, right, rows, n, 0, active, work, x)
    return n, n_pairs, m, status


@njit(cache=True)
def consistent_acceleration(data, pairs, rows, state, drive, scratch, x, ledger):
    """Set accelerations (and stored forces) so that the equation of motion holds now.

    drive (P − 1,): given torques. A jump of the torque moves the quasi-static part at once; the
    ledger books it as a step of no duration.
    """
    blocks, place = scratch[10], scratch[9]
    nc = data.channel_modes.shape[0]
    theta = np.zeros(data.angles.shape[0])
    for a in range(theta.shape[0]):
        theta[a] = np.dot(data.angles[a], state.eta)
    torques = np.zeros(data.ports)
    torques[: data.ports - 1] = drive
    brake, _ = brake_line(data, np.dot(data.channel_modes[nc - 1], state.velocity))
    torques[data.ports - 1] = brake
    n, n_pairs, m, status = forces_at_state(data, pairs, rows, state, theta, torques, scratch, x)
    if status < 0:
        release(place, blocks, m)
        return -1
    state.forces[:] = 0.0
    _spread(rows, n, x, blocks, m, torques, state.forces)
    _project(data, blocks, m, state.forces, state.acceleration)
    for j in range(state.eta.shape[0]):
        state.acceleration[j] -= data.damping[j] * state.velocity[j] + data.omega2[j] * state.eta[j]
    if data.gyroscopic.shape[0] > 0:
        state.acceleration[:] -= data.gyroscopic @ state.velocity
        state.acceleration[:] += data.centripetal @ state.eta
    if ledger.now.shape[0] > 0:
        settle(data, pairs, rows, n, x, state, torques, ledger)
    state.torques[:] = torques
    _remember(rows, n, n_pairs, x, state)
    release(place, blocks, m)
    return 0


@njit(cache=True)
def _remember(rows, n, n_pairs, x, state):
    """Note which pairs carry load, by index."""
    state.touched[:] = 0
    for q in range(n_pairs):
        if x[rows.pair_row[q]] > 0.0:
            state.touched[rows.pair_mesh[q], rows.pair_index[q] % 8] = 1


@njit(cache=True, nogil=True, fastmath={"reassoc", "contract"})
def advance(data, pairs, rows, state, torque, save_every, first_step, samples, scratch, ledger):
    """Take len(torque) steps with the given torques (steps, P − 1) of each new time; save some.

    ledger: work space of the energy account (see ``energy.py``), or length-0 arrays to skip it.
    Returns (status, samples saved): status 0, or the 1-based step that failed.
    """
    (matrix, matrix_v, work, wide, right, delta, rate, c, motion, place, blocks, active) = scratch
    nm = state.eta.shape[0]
    nc = data.channel_modes.shape[0]
    h = data.h
    ports, out_row = data.ports, nc - 1
    first_port = nc - ports
    theta = np.zeros(data.angles.shape[0])
    torques = np.zeros(ports)
    turning = np.zeros(nm)
    x = np.zeros(right.shape[0])
    free = np.zeros(nm)
    free_v = np.zeros(nm)
    push = np.zeros(nm)
    saved = 0
    bb_v = data.g_velocity[out_row, out_row]
    for step in range(torque.shape[0]):
        torques[: ports - 1] = torque[step]
        theta[:] = 0.0
        speed_guess = 0.0
        if data.gyroscopic.shape[0] > 0:
            turning[:] = data.gyroscopic @ (state.velocity + h * state.acceleration)
            turning[:] -= data.centripetal @ (state.eta + h * state.velocity)
        for j in range(nm):
            a, v, q = state.acceleration[j], state.velocity[j], state.eta[j]
            # elastic accelerations would carry the rule's own oscillation into the geometry
            rigid = h * a if data.omega2[j] == 0.0 else 0.0
            ahead = q + h * v + 0.5 * h * rigid
            for t in range(theta.shape[0]):
                theta[t] += data.angles[t, j] * ahead
            speed_guess += data.channel_modes[out_row, j] * (v + rigid)
            star = q + h * v + (0.5 - BETA) * h * h * a
            star_v = v + (1.0 - GAMMA) * h * a
            push_0 = -data.damping[j] * star_v - data.omega2[j] * star - turning[j]
            for t in range(ports - 1):
                push_0 += data.channel_modes[first_port + t, j] * torques[t]
            a0 = data.inverse[j] * push_0
            state.acceleration[j] = a0
            free[j] = star + BETA * h * h * a0
            free_v[j] = star_v + GAMMA * h * a0
        n, n_pairs = build_rows(pairs, rows, theta, state.wanted)
        m = local_blocks(rows, n, place, blocks)
        _channels(data, blocks, m, free, motion)
        for b in range(m):
            for p in range(6):
                at = 6 * blocks[b] + p
                for t in range(ports - 1):
                    motion[at] += data.residual[at, first_port + t] * torques[t]
        row_values(rows, n, motion, delta)
        _channels(data, blocks, m, free_v, motion)
        free_speed = motion[out_row]
        row_values(rows, n, motion, rate)
        row_products(rows, n, data.g_displacement, place, blocks, wide, matrix)
        row_products(rows, n, data.g_velocity, place, blocks, wide, matrix_v)
        _damping_of_rows(pairs, rows, n, n_pairs, state, c)
        torque0, slope = brake_line(data, speed_guess)
        for i in range(n):
            k = rows.stiffness[i]
            right[i] = right_side(rows, i, delta[i], rate[i], c[i])
            for j in range(n):
                matrix[i, j] = k * matrix[i, j] + c[i] * matrix_v[i, j]
            matrix[i, i] += 1.0
            # pair forces and brake torque act through −V F and −T
            gd = 0.0
            gv = 0.0
            for a in range(rows.width[i]):
                base = 6 * rows.blocks[i, a]
                for p in range(6):
                    gd += rows.coef[i, a, p] * data.g_displacement[out_row, base + p]
                    gv += rows.coef[i, a, p] * data.g_velocity[out_row, base + p]
            matrix[i, n] = k * gd + c[i] * gv
            matrix[n, i] = slope * gv
            active[i] = 1
        if pairs.one_sided:
            for q in range(n_pairs):
                mesh = rows.pair_mesh[q]
                if pairs.model[mesh] == PER_PAIR:
                    loaded = state.touched[mesh, rows.pair_index[q] % 8] == 1
                    active[rows.pair_row[q]] = 1 if loaded or pairs.front[mesh] == 1 else 0
        matrix[n, n] = 1.0 + slope * bb_v
        right[n] = torque0 + slope * (free_speed - speed_guess)
        status = solve_active(matrix, right, rows, n, 1, active, work, x)
        if status < 0:
            release(place, blocks, m)
            return step + 1, saved
        # given torques are in the free motion already: only the brake is projected
        torques[: ports - 1] = 0.0
        torques[ports - 1] = x[n]
        _spread(rows, n, x, blocks, m, torques, state.forces)
        _project(data, blocks, m, state.forces, push)
        torques[: ports - 1] = torque[step]
        for t in range(ports - 1):
            state.forces[first_port + t] = torques[t]
        for j in range(nm):
            extra = data.inverse[j] * push[j]
            state.acceleration[j] += extra
            state.eta[j] = free[j] + BETA * h * h * extra
            state.velocity[j] = free_v[j] + GAMMA * h * extra
        clearances = pairs.clearance_stiffness.shape[0] > 0
        if clearances or ((first_step + step) % 4 == 0 and pairs.one_sided):
            local_motion(data, blocks, m, state.eta, state.forces, motion)
            look_at_backs(pairs, rows, n_pairs, theta, motion, state.wanted)
        if ledger.now.shape[0] > 0:
            settle(data, pairs, rows, n, x, state, torques, ledger)
        state.torques[:] = torques
        _remember(rows, n, n_pairs, x, state)
        release(place, blocks, m)
        if (first_step + step + 1) % save_every == 0:
            _save(samples, saved, data, rows, n, n_pairs, x, state, theta, torques)
            saved += 1
        if clearances:
            look_along(pairs, rows, motion)
    return 0, saved
