"""Compiled Newmark step in modal coordinates with constant receptances of the contact channels.

Average acceleration (β = 1/4, γ = 1/2, Newmark 1959). For a mode, with D = 1/(1 + γ h d + β h² ω²)
and d = 2ζω,

    a⁺ = D (p⁺ − d v* − ω² η*),  η⁺ = η* + β h² a⁺,  v⁺ = v* + γ h a⁺,

so unit channel forces move the channels by G = Φ βh² D Φᵀ + R and change their velocity by
(γ/βh) (G − R), constant for a step size. A step

    predicts the motion without contact forces and the angles of the new time   (``_predict``),
    builds the rows of the force elements at these angles                       (``_build``),
    solves one small contact problem for their forces, the brake's among them   (``_contact``),
    projects these on the modes, and is taken again where it errs too much      (``_accelerate``),
    looks whether unloaded flanks come near, books energy, saves a sample       (``_finish``).

Forces of a rotating frame, G v − C q, act with motion extrapolated to the new time, second order.
Steps of several sizes, each twice the one before, may take turns: see ``refinement``.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from flexgear.analysis.active_dofs import (
    add_residual,
    add_row,
    gather,
    gather_receptance,
    modal_forces,
    motions,
    place_rows,
    row_receptances,
    row_value,
)
from flexgear.analysis.brake import brake_line
from flexgear.analysis.coast_flanks import look_after_step
from flexgear.analysis.contact_newton import remember, solve_contact, start_guess
from flexgear.analysis.energy import motion_before, settle
from flexgear.analysis.refinement import after_step, choose_level, step_error
from flexgear.analysis.vectors import add, dot, fill, put
from flexgear.coupling.compiled import FAST, INNER, PART, UNCOUNTED
from flexgear.coupling.laws import LINEAR_RATE_LAW
from flexgear.coupling.pairs import fill_rows

BETA, GAMMA = 0.25, 0.5
LOOK = 4  # steps between two looks at unloaded flanks; twice as many while all are far
RUNAWAY = 1e3  # times the energy that a train had and was given: motion that comes from nowhere
BRAKE_LAW = LINEAR_RATE_LAW


@njit(**INNER, fastmath=FAST)
def _rotating_forces(h, modal, state, modes):
    """G v − C q of a rotating frame at the extrapolated motion."""
    n = modal.omega2.shape[0]
    for i in range(modal.gyroscopic.shape[0]):
        total = 0.0
        for j in range(n):
            total += modal.gyroscopic[i, j] * (state.velocity[j] + h * state.acceleration[j])
            total -= modal.centripetal[i, j] * (state.eta[j] + h * state.velocity[j])
        modes.rotating[i] = total


@njit(**INNER, fastmath=FAST)
def _predict(h, level, modal, active, state, modes):
    """Motion without contact forces and brake; angles of the new time; guess of output speed.

    Plain loops of one statement or two: these are vectorised.
    """
    n, ports = modal.omega2.shape[0], modes.torques.shape[0]
    free, rate, a = modes.free, modes.free_rate, modes.acceleration
    eta, velocity, before = state.eta, state.velocity, state.acceleration
    _rotating_forces(h, modal, state, modes)
    for j in range(n):
        free[j] = eta[j] + h * velocity[j] + (0.5 - BETA) * h * h * before[j]
        rate[j] = velocity[j] + (1.0 - GAMMA) * h * before[j]
    for j in range(n):
        a[j] = -modal.damping[j] * rate[j] - modal.omega2[j] * free[j] - modes.rotating[j]
    for t in range(ports - 1):
        add(a[:n], modes.torques[t], active.modes[t])
    for j in range(n):
        a[j] *= modal.inverse[level, j]
        free[j] += BETA * h * h * a[j]
        rate[j] += GAMMA * h * a[j]
    # elastic accelerations would carry the rule's own oscillation into the geometry
    output, guess = active.modes[ports - 1], 0.0
    for j in range(n):
        rigid = h * before[j] if modal.omega2[j] == 0.0 else 0.0
        modes.spare[j] = eta[j] + h * (velocity[j] + 0.5 * rigid)
        guess += output[j] * (velocity[j] + rigid)
    for t in range(modes.theta.shape[0]):
        modes.theta[t] = dot(modal.angles[t], modes.spare)
    return guess


@njit(**PART)
def _add_brake(brake, guess, rows, n, count, ports, on_dofs):
    """The brake as row n and element ``count``: its torque and slope about a speed."""
    torque, slope = brake_line(brake[0], brake[1], brake[2], guess)
    rows.row[n].offset = 0.0
    element = rows.element[count]
    element.law, element.first, element.rows, element.place = BRAKE_LAW, n, 1, -1
    parameters = rows.parameters[count]
    parameters[0], parameters[1], parameters[2] = torque, slope, guess
    t = on_dofs.first[n]
    on_dofs.dof[t], on_dofs.value[t], on_dofs.first[n + 1] = ports - 1, 1.0, t + 1


@njit(**PART)
def _build(data, state, work, ledger, level, guess):
    """Rows and elements at the new angles, the brake last, on active dofs; their numbers."""
    rows, active = work.rows, work.active
    n, count, pairs = fill_rows(data.elements, work.modes.theta, state.active_flanks, rows)
    last = ledger.booked[0].rows
    gather(active, data.channels, rows, n, ledger.rows, last)
    gather_receptance(active, data.channels, level)
    place_rows(active, rows, n, work.on_dofs)
    _add_brake(data.brake, guess, rows, n, count, state.torques.shape[0], work.on_dofs)
    return n, count, pairs


@njit(**PART)
def _contact(laws, share, level, n, count, state, work):
    """Forces of all elements, in ``work.problem`` and on the active dofs; −1 without a solution.

    share: γ/(βh), by which a displacement within a step is a rate; 0 in a step of no duration.
    """
    dofs, problem, on_dofs = work.dofs, work.problem, work.on_dofs
    motions(work.active, work.modes.free, work.modes.free_rate, dofs.free, dofs.free_rate)
    # given torques move dropped modes, too
    fill(dofs.force[: work.active.counts[0].dofs], 0.0)
    given = state.torques.shape[0] - 1
    put(dofs.force, work.modes.torques[:given])
    add_residual(work.active, level, dofs.force, dofs.image, dofs.free)
    for i in range(n + 1):
        problem.free[0, i] = work.rows.row[i].offset + row_value(on_dofs, i, dofs.free)
        problem.free[1, i] = row_value(on_dofs, i, dofs.free_rate)
    row_receptances(
        work.active, level, share, on_dofs, n + 1, dofs.image, problem.displacement, problem.rate
    )
    start_guess(laws, work.rows, count, state.memory, work.space)
    solved = solve_contact(laws, work.rows, count + 1, n + 1, work.space, problem)
    for i in range(n + 1):
        if problem.force[i] != 0.0:
            add_row(on_dofs, i, -problem.force[i], dofs.force)
    return solved


@njit(**PART)
def _accelerate(level, modal, given, work):
    """Modal accelerations by contact forces and brake; given torques are in the prediction."""
    dofs, push = work.dofs, work.modes.push
    put(dofs.image, dofs.force[:given])
    fill(dofs.force[:given], 0.0)
    modal_forces(work.active, dofs.force, push)
    put(dofs.force, dofs.image[:given])
    for j in range(modal.omega2.shape[0]):
        push[j] *= modal.inverse[level, j]


@njit(**PART)
def _advance_motion(h, work, state):
    """The new motion in ``work.modes.free``; False where it holds energy from nowhere."""
    modes = work.modes
    n = state.eta.shape[0]
    for j in range(n):
        modes.free[j] += BETA * h * h * modes.push[j]
        modes.free_rate[j] += GAMMA * h * modes.push[j]
        modes.acceleration[j] += modes.push[j]
    for t in range(modes.torques.shape[0] - 1):
        speed = dot(modes.free_rate[:n], work.active.modes[t])
        state.given[0] += h * abs(modes.torques[t] * speed)
    return 0.5 * dot(modes.free_rate[:n], modes.free_rate) <= RUNAWAY * state.given[0]


@njit(**PART)
def _book(laws, data, level, n, count, state, work, ledger):
    """Energies of a step that stands."""
    active, dofs, modes = work.active, work.dofs, work.modes
    many = active.counts[0].dofs
    if active.counts[0].fresh == 1:
        motion_before(active, level, state, work, ledger)
        active.counts[0].fresh = 0
    else:
        put(dofs.before, dofs.motion[:many])
    motions(active, modes.free, modes.free, dofs.motion, dofs.motion)
    add_residual(active, level, dofs.force, dofs.image, dofs.motion)
    settle(laws, data.modal, count, n, state, work, ledger)
    fill(ledger.force, 0.0)
    for d in range(many):
        ledger.force[active.channel[d]] = dofs.force[d]


@njit(**PART)
def _save(samples, at, modal, work, n, pairs, state):
    """Copy one sample; pairs that are not in contact stay as they were made."""
    rows, force, output = work.rows, work.problem.force, state.torques.shape[0] - 1
    put(samples.eta[at], state.eta)
    put(samples.theta[at], work.modes.theta)
    for f in range(modal.inputs.shape[0]):
        samples.masters[at, f, 0] = dot(modal.inputs[f], state.eta)
        samples.masters[at, f, 1] = dot(modal.inputs[f], state.velocity)
    put(samples.torques[at], state.torques)
    samples.output_speed[at] = dot(state.velocity, work.active.modes[output])
    for q in range(pairs):
        pair = rows.pair[q]
        m, slot = pair.mesh, pair.slot
        samples.pair_load[at, m, slot] = pair.share * force[pair.row]
        samples.pair_tooth[at, m, slot] = pair.tooth
        samples.pair_stiffness[at, m, slot] = pair.stiffness
        samples.pair_position[at, m, slot] = pair.s
    for i in range(n):
        if rows.row[i].kind < 0:
            samples.support_load[at, rows.row[i].owner] = force[i]
    put(samples.energy[at], state.energy)
    put(samples.active_flanks[at], state.active_flanks)


@njit(**PART)
def _finish(state, work, count, output, n):
    """Make the new motion the state."""
    modes = work.modes
    put(state.acceleration, modes.acceleration[: state.eta.shape[0]])
    put(state.eta, modes.free[: state.eta.shape[0]])
    put(state.velocity, modes.free_rate[: state.eta.shape[0]])
    put(state.torques, modes.torques)
    remember(work.rows, count, work.problem.motion, state.memory)


@njit(**UNCOUNTED, nogil=True)
def advance(data, laws, torque, first, state, space, samples, control):
    """Go len(torque) ticks of h₀ on with the given torques (ticks, P − 1) of each new time.

    A sample is saved at every ``control.every``-th tick, counted from ``first`` ticks before.
    Returns (status, samples saved): status 0, the 1-based tick of a step without a solution, or
    less than 0 that of one at which the motion ran away or is not finite. A tick of no duration
    (see ``consistent_acceleration``) finds accelerations and looks nowhere.
    """
    work, ledger, counts = space.work, space.ledger, control.counts[0]
    modal, output = data.modal, state.torques.shape[0] - 1
    saved = tick = np.int64(0)
    while tick < torque.shape[0]:
        level = choose_level(control, first + tick, torque.shape[0] - tick)
        h, end = modal.h[level], tick + (1 << level)
        share = GAMMA / (BETA * h) if h > 0.0 else 0.0
        put(work.modes.torques, torque[end - 1])
        guess = _predict(h, level, modal, work.active, state, work.modes)
        n, count, pairs = _build(data, state, work, ledger, level, guess)
        if _contact(laws, share, level, n, count, state, work) < 0:
            return end, saved
        _accelerate(level, modal, output, work)
        if control.tolerance > 0.0:
            error = step_error(h, level, modal, state, work, n, control.load)
            if not after_step(control, level, error):
                continue  # the same step again
        work.modes.torques[output] = work.problem.force[n]
        if not _advance_motion(h, work, state):
            return -end, saved
        if data.elements.gears.mesh.shape[0] > 0 and h > 0.0:
            now = first + tick
            if now % LOOK == 0 and now >= counts.next_look:
                ahead = 2 * LOOK * modal.h[0] + h
                margins = look_after_step(data, work, pairs, ahead, state.active_flanks)
                counts.next_look = now + 2 * LOOK if margins > 2.0 else 0
        if ledger.booked[0].tracked == 1:
            _book(laws, data, level, n, count, state, work, ledger)
        _finish(state, work, count, output, n)
        counts.taken += 1
        control.by_level[level] += 1
        tick = end
        if (first + tick) % control.every == 0:
            _save(samples, saved, modal, work, n, pairs, state)
            saved += 1
    return np.int64(0), saved
