"""Compiled Newmark step in modal coordinates with constant receptances of the contact channels.

Average acceleration (β = 1/4, γ = 1/2, Newmark 1959). For a mode, with D = 1/(1 + γ h d + β h² ω²)
and d = 2ζω,

    a⁺ = D (p⁺ − d v* − ω² η*),  η⁺ = η* + β h² a⁺,  v⁺ = v* + γ h a⁺,

so unit channel forces move the channels by G = Φ βh² D Φᵀ + R and change their velocity by
(γ/βh) (G − R), constant for a step size. A step builds the rows of the pairs in mesh at the
angles of the new time, solves one small contact problem and projects the forces back. Forces of a
turning frame, G v − C q, act with motion extrapolated to the new time, second order.

Steps of several sizes, each twice the one before, may take turns: see ``ladder.py``.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from flexgear.analysis.backs import look_from_near
from flexgear.analysis.brake import brake_line
from flexgear.analysis.contact import look_along, solve_set
from flexgear.analysis.contact_law import (
    CAUTIOUS,
    TRIES,
    change_states,
    place_of,
    remember,
    right_sides,
    rows_of_law,
)
from flexgear.analysis.contact_matrix import contact_matrix
from flexgear.analysis.energy import settle
from flexgear.analysis.ladder import after_step, choose_rung, step_error
from flexgear.analysis.lines import dot, fill, put
from flexgear.analysis.near import fill_rung, place_rows, spread
from flexgear.analysis.near_products import (
    add_line,
    answered,
    moved,
    near_forces,
    near_values,
    pushed,
    whole,
)
from flexgear.coupling.compiled import FAST, INNER, UNCOUNTED, ZERO
from flexgear.coupling.pair_data import PER_PAIR
from flexgear.coupling.pairs import build_rows_beyond

BETA, GAMMA = 0.25, 0.5
BRAKE = np.int64(1)  # unknown beside pair forces
LOOK = 4  # steps between two looks at the back flanks; twice as many while all are far
RUNAWAY = 1e3  # times the energy that a train had and was given: motion that comes from nowhere


@njit(**INNER, fastmath=FAST)
def _predict(
    h, omega2, damping, inverse, angles, output, ports, rigid, eta, velocity, acceleration, turning,
    torques, theta, a0, free, free_v,
):  # fmt: skip
    """Motion without contact forces and brake; angles of the new time; guess of output speed.

    Many short loops: one over all of these arrays is not vectorised, nor is one around another.
    """
    nm = eta.shape[0]
    for j in range(nm):
        free[j] = eta[j] + h * velocity[j] + (0.5 - BETA) * h * h * acceleration[j]
        free_v[j] = velocity[j] + (1.0 - GAMMA) * h * acceleration[j]
    for j in range(nm):
        a0[j] = -damping[j] * free_v[j] - omega2[j] * free[j] - turning[j]
    for t in range(torques.shape[0] - 1):
        own, torque = ports[t], torques[t]
        for j in range(nm):
            a0[j] += own[j] * torque
    for j in range(nm):
        a0[j] *= inverse[j]
    for j in range(nm):
        free[j] += BETA * h * h * a0[j]
        free_v[j] += GAMMA * h * a0[j]
    for t in range(theta.shape[0]):
        own, total = angles[t], 0.0
        for j in range(nm):
            total += own[j] * (eta[j] + h * velocity[j])
        theta[t] = total
    guess = 0.0
    for j in range(nm):
        guess += output[j] * velocity[j]
    # elastic accelerations would carry the rule's own oscillation into the geometry
    for j in range(min(rigid, nm)):
        if omega2[j] == 0.0:
            gained = h * acceleration[j]
            guess += output[j] * gained
            for t in range(theta.shape[0]):
                theta[t] += 0.5 * h * angles[t, j] * gained
    return guess


@njit(**INNER, fastmath=FAST)
def _product(matrix, vector, sign, out):
    """out += sign · matrix @ vector."""
    for i in range(matrix.shape[0]):
        total = 0.0
        for j in range(matrix.shape[1]):
            total += matrix[i, j] * vector[j]
        out[i] += sign * total


@njit(**INNER)
def _save(samples, at, data, rows, n, n_pairs, x, state, theta, torques):
    """Copy one sample; pairs that are not in contact stay as they were made."""
    put(samples.eta[at], state.eta)
    put(samples.theta[at], theta)
    for f in range(data.masters.shape[0]):
        samples.masters[at, f, 0] = dot(data.masters[f], state.eta)
        samples.masters[at, f, 1] = dot(data.masters[f], state.velocity)
    put(samples.torques[at], torques)
    samples.output_speed[at] = dot(data.channel_modes[data.output], state.velocity)
    for q in range(n_pairs):
        m, slot = rows.pair_mesh[q], rows.pair_slot[q]
        samples.pair_load[at, m, slot] = rows.pair_share[q] * x[rows.pair_row[q]]
        samples.pair_tooth[at, m, slot] = rows.pair_tooth[q]
        samples.pair_stiffness[at, m, slot] = rows.pair_stiffness[q]
        samples.pair_position[at, m, slot] = rows.pair_s[q]
    for r in range(n):
        if rows.kind[r] < 0:
            samples.support_load[at, rows.owner[r]] = x[r]
    for r in range(rows.direction.shape[0]):
        put(samples.direction[at, r], rows.direction[r])
    put(samples.energy[at], state.energy)
    put(samples.wanted[at], state.wanted)


@njit(**INNER)
def _motion_before(near, eta, head):
    """Motion at the last step of channels that came at hand at this one."""
    for k in range(near.counts[0]):
        c = head + 6 * near.fresh[k]
        for p in range(c, c + 6):
            near.motion[p] = dot(eta, near.modes[p]) + dot(near.residual[p], near.forces)


@njit(**UNCOUNTED, nogil=True, fastmath=FAST)
def advance(
    data, pairs, rows, state, torque, save_every, first, samples, near, work, ledger, control
):
    """Go len(torque) ticks of h₀ on with the given torques (ticks, P − 1) of each new time.

    A sample is saved at every ``save_every``-th tick, counted from ``first`` ticks before. ledger:
    work space of the energy account (see ``energy.py``), of length 0 to skip it. Returns (status,
    samples saved): status 0, the 1-based tick of a step without a solution, or less than 0 that of
    one at which the motion ran away or is not finite. A tick of no duration (see ``standing.py``)
    finds accelerations and looks nowhere.
    """
    ports, head, out, nm = data.ports, data.head, data.ports - 1, state.eta.shape[0]
    port_modes = data.channel_modes[data.output - out : data.output + 1]
    output = data.channel_modes[data.output]
    torques, theta, x, k, c = work.torques, work.theta, work.x, work.stiffness, work.damping
    shapes, low, high, rigid, elastic = near.shapes, near.low, near.high, near.rigid, near.elastic
    span = near.span
    tracked = ledger.booked.shape[0] > 0
    clearances = pairs.clearance_stiffness.shape[0] > 0
    saved = tick = tries = ZERO
    while tick < torque.shape[0]:
        rung = choose_rung(control, first + tick, torque.shape[0] - tick, save_every)
        h = data.h[rung]
        end = tick + (1 << rung)
        put(torques, torque[end - 1])
        torques[out] = 0.0
        if data.gyroscopic.shape[0] > 0:
            fill(work.turning, 0.0)
            for j in range(nm):
                work.free_v[j] = state.velocity[j] + h * state.acceleration[j]
                work.free[j] = state.eta[j] + h * state.velocity[j]
            _product(data.gyroscopic, work.free_v, 1.0, work.turning)
            _product(data.centripetal, work.free, -1.0, work.turning)
        guess = _predict(
            h, data.omega2, data.damping, data.inverse[rung], data.angles, output, port_modes,
            span[0], state.eta, state.velocity, state.acceleration, work.turning, torques, theta,
            work.acceleration, work.free, work.free_v,
        )  # fmt: skip
        n, n_pairs = build_rows_beyond(pairs, rows, theta, state.wanted)
        place_rows(
            near, rows.line, rows.blocks, rows.width, rows.beyond, n, data.channel_modes,
            data.residual, head,
        )  # fmt: skip
        fill_rung(near, rung, data.displacement[rung], head)
        top, receptance = near.counts[2], near.displacement[rung]
        lines = ports + 2 * near.counts[4]
        now = first + tick
        due = now % LOOK == 0 and now >= near.counts[5]
        looks = h > 0.0 and (clearances or (due and pairs.one_sided))
        # approaches, and lines without a pair, are only read where somebody looks
        seen = head if tracked or looks else whole(lines)
        if tracked:
            _motion_before(near, state.eta, head)
        moved(shapes, seen, span, low, high, rigid, elastic, work.free, near.free)
        moved(shapes, seen, span, low, high, rigid, elastic, work.free_v, near.rate)
        for t in range(out):
            if torques[t] != 0.0:
                add_line(near.residual, t, torques[t], ZERO, seen, near.free)
                for g in range(low.shape[0]):
                    if near.linked[g] == 1:
                        add_line(near.residual, t, torques[t], low[g], whole(high[g]), near.free)
        near_values(
            rows.line, rows.along, near.at, rows.coef, rows.width, rows.beyond, ports, n,
            near.free, near.rate, work.delta, work.rate,
        )  # fmt: skip
        share = GAMMA / (BETA * h) if h > 0.0 else 0.0
        rows_of_law(
            pairs.sided, pairs.model, state.limited, rows.stiffness, rows.damping, rows.pair_row,
            rows.pair_mesh, rows.pair_index, n, n_pairs, share, k, c, work.share,
        )  # fmt: skip
        contact_matrix(
            receptance, near.residual, rows.line, rows.along, near.at, near.part, rows.coef,
            rows.width, rows.beyond, near.order, near.since, near.reach, ports, lines, low, high,
            near.linked, n, near.counts[3], k, work.share, rung, near.contact,
            work.matrix,
        )  # fmt: skip
        brake, slope = brake_line(data.brake_torque, data.brake_speed, data.brake_exponent, guess)
        right_sides(rows.kind, k, rows.offset, n, work.delta, work.rate, c, work.right)
        # the brake's speed answers pair forces by G − R; these and its torque act through −V F, −T
        for d in range(top):
            near.line[d] = slope * share * (receptance[out, d] - near.residual[out, d])
        near_values(
            rows.line, rows.along, near.at, rows.coef, rows.width, rows.beyond, ports, n, near.line,
            near.line, work.matrix[n], work.delta,
        )  # fmt: skip
        for i in range(n):
            work.active[i] = 1
        if pairs.one_sided:
            for q in range(n_pairs):
                m = rows.pair_mesh[q]
                if pairs.model[m] == PER_PAIR:
                    loaded = state.load[m, place_of(PER_PAIR, rows.pair_index[q])] > 0.0
                    work.active[rows.pair_row[q]] = 1 if loaded or pairs.front[m] == 1 else 0
        moves = share * (receptance[out, out] - near.residual[out, out])
        work.matrix[n, n] = 1.0 + slope * moves
        work.right[n] = brake + slope * (near.rate[out] - guess)
        status = solve_set(
            work.matrix, work.right, rows.sided, n, BRAKE, work.active, work.small, x, 0.0, 0.0
        )
        if status < 0:
            return end, saved
        # given torques are in the free motion already: only the brake is projected
        near_forces(
            rows.line, rows.along, near.at, rows.coef, rows.width, rows.beyond, ports, top, n, x,
            near.line_2,
        )  # fmt: skip
        near.line_2[out] = -x[n]
        pushed(near.modes, lines, span, low, high, rigid, elastic, near.line_2, work.push)
        answer = data.inverse[rung]
        for j in range(nm):
            work.push[j] *= answer[j]
        if pairs.one_sided:
            changed = change_states(
                pairs.sided, pairs.model, state.load, state.limited, rows.stiffness, rows.damping,
                rows.line, rows.along, near.at, rows.coef, rows.width, rows.beyond, rows.pair_row,
                rows.pair_mesh, rows.pair_index, n_pairs, ports, near.modes, work.push, h,
                GAMMA * h, x, work.rate, tries >= CAUTIOUS,
            )  # fmt: skip
            if changed > 0:
                tries += 1
                if tries == TRIES:
                    return end, saved
                near.counts[1] -= 1  # the same step again
                continue
        tries = ZERO
        if control.tolerance > 0.0:
            error = step_error(
                h, data.inverse[rung], state.acceleration, work.acceleration, work.push,
                control.load, near, ports, seen, rows, n, work.active, work.error, work.delta,
                work.rate,
            )  # fmt: skip
            if not after_step(control, rung, error):
                near.counts[1] -= 1  # the same step again
                continue
        torques[out] = x[n]
        if tracked or looks:
            answered(
                receptance, lines, head, low, high, near.linked, top, near.line_2,
                near.line,
            )  # fmt: skip
            for d in range(top):
                near.line[d] += near.free[d]
        if looks:
            near_values(
                rows.line, rows.along, near.at, rows.coef, rows.width, rows.beyond, ports, n,
                near.line, near.rate, work.delta, work.rate,
            )  # fmt: skip
            margins = look_from_near(
                pairs, rows, near.at, work.delta, work.rate, ports, n_pairs, theta, near.line,
                near.rate, near.modes, work.push, GAMMA * h, 2 * LOOK * data.h[0] + h,
                work.back_speed, state.wanted,
            )  # fmt: skip
            near.counts[5] = now + 2 * LOOK if margins > 2.0 else 0
            if clearances:
                spread(near, near.line, head, work.motion)
        for d in range(top):
            near.forces[d] = near.line_2[d]
        for t in range(out):
            near.forces[t] = torques[t]
        for j in range(nm):
            work.free[j] += BETA * h * h * work.push[j]
            work.free_v[j] += GAMMA * h * work.push[j]
        for t in range(out):
            state.given[0] += h * abs(torques[t] * dot(port_modes[t], work.free_v))
        if not 0.5 * dot(work.free_v, work.free_v) <= RUNAWAY * state.given[0]:
            return -end, saved
        if tracked:
            for d in range(top):
                near.line_2[d] = near.line[d]
            answered(
                near.residual, lines, head, low, high, near.linked, top, near.forces,
                near.line,
            )  # fmt: skip
            settle(
                data.omega2, data.damping, ports, rows, n, x, state.eta, state.velocity, work.free,
                work.free_v, state.torques, torques, near, state.energy, ledger,
            )  # fmt: skip
        for j in range(nm):
            state.acceleration[j] = work.acceleration[j] + work.push[j]
        for j in range(nm):
            state.eta[j] = work.free[j]
        for j in range(nm):
            state.velocity[j] = work.free_v[j]
        put(state.torques, torques)
        remember(
            pairs.sided, pairs.model, rows.damping, rows.pair_mesh, rows.pair_index, rows.pair_row,
            n_pairs, x, state.load, state.limited,
        )  # fmt: skip
        control.counts[2] += 1
        control.taken[rung] += 1
        tick = end
        if (first + tick) % save_every == 0:
            _save(samples, saved, data, rows, n, n_pairs, x, state, theta, torques)
            saved += 1
        if clearances and looks:
            look_along(pairs, rows, work.motion)
    return 0, saved
