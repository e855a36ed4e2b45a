"""Compiled Newmark step in modal coordinates with constant receptances of the contact channels.

Average acceleration (β = 1/4, γ = 1/2, Newmark 1959). For a mode, with D = 1/(1 + γ h d + β h² ω²)
and d = 2ζω,

    a⁺ = D (p⁺ − d v* − ω² η*),  η⁺ = η* + β h² a⁺,  v⁺ = v* + γ h a⁺,

so unit channel forces move the channels by G = Φ βh² D Φᵀ + R and change their velocity by
(γ/βh) (G − R), constant for a step size. A step

    predicts the motion without contact forces and the angles of the new time   (``_predict``),
    builds the rows of the force elements at these angles                       (``_build``),
    solves one small contact problem for their forces and the machines' torques (``_contact``),
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
from flexgear.analysis.coast_flanks import look_after_step
from flexgear.analysis.contact_newton import remember, solve_contact, start_guess
from flexgear.analysis.energy import motion_before, settle
from flexgear.analysis.frame_forces import rotating_forces, set_loads
from flexgear.analysis.machines import (
    add_machines,
    carry_on,
    hold_at_instant,
    machine_torques,
    moved_energy,
    tell_machines,
)
from flexgear.analysis.refinement import after_step, choose_level, step_error
from flexgear.analysis.vectors import add, dot, fill, put
from flexgear.coupling.compiled import FAST, INNER, PART, UNCOUNTED
from flexgear.coupling.laws import HELD_RATE_LAW
from flexgear.coupling.neighbours import add_neighbours, freeze_neighbours
from flexgear.coupling.pair_data import LOAD
from flexgear.coupling.pairs import fill_rows

BETA, GAMMA = 0.25, 0.5
LOOK = 4  # steps between two looks at unloaded flanks; twice as many while all are far
RUNAWAY = 1e3  # times the energy that a train had and was given: motion that comes from nowhere


@njit(**INNER, fastmath=FAST)
def _predict(h, level, modal, active, state, modes):
    """Motion under given torques alone; angles of the new time; guess of the ports' speeds; share
    of rated speed by which frames turn.

    Plain loops of one statement or two: these are vectorised.
    """
    n, ports = modal.omega2.shape[0], modes.ports
    free, rate, a = modes.free, modes.free_rate, modes.acceleration
    eta, velocity, before = state.eta, state.velocity, state.acceleration
    share = rotating_forces(h, modal.frames, state, modes.rotating)
    for j in range(n):
        free[j] = eta[j] + h * velocity[j] + (0.5 - BETA) * h * h * before[j]
        rate[j] = velocity[j] + (1.0 - GAMMA) * h * before[j]
    for j in range(n):
        a[j] = -modal.damping[j] * rate[j] - modal.omega2[j] * free[j] - modes.rotating[j]
    for t in range(ports.given.shape[0]):
        if ports.given[t] != 0.0:
            add(a[:n], ports.given[t], active.modes[t])
    for j in range(n):
        a[j] *= modal.inverse[level, j]
        free[j] += BETA * h * h * a[j]
        rate[j] += GAMMA * h * a[j]
    # elastic accelerations would carry the rule's own oscillation into the geometry
    for j in range(n):
        rigid = h * before[j] if modal.omega2[j] == 0.0 else 0.0
        modes.push[j] = velocity[j] + rigid
        modes.spare[j] = eta[j] + h * (velocity[j] + 0.5 * rigid)
    for t in range(ports.guess.shape[0]):
        ports.guess[t] = dot(modes.push[:n], active.modes[t])
    for t in range(modes.theta.shape[0]):
        modes.theta[t] = dot(modal.angles[t], modes.spare)
    return share


@njit(**PART)
def _build(data, share, told, state, work, ledger, level):
    """Rows and elements at the new angles on active dofs; their numbers. told (L,): of loads."""
    rows, active = work.rows, work.active
    n, count, pairs = fill_rows(data.elements, work.modes.theta, state.active_flanks, rows)
    set_loads(share, told, data.elements.fixed, rows, count)
    last = ledger.booked[0].rows
    gather(active, data.channels, rows, n, ledger.rows, last)
    gather_receptance(active, data.channels, level)
    place_rows(active, rows, n, work.on_dofs)
    return n, count, pairs


@njit(**PART)
def _contact(laws, data, level, n, count, state, work):
    """Forces of n rows of ``count`` elements and of the machines' behind them, in ``work.problem``
    and on the active dofs; the rows, or −1 without a solution."""
    dofs, problem, on_dofs, h = work.dofs, work.problem, work.on_dofs, data.modal.h[level]
    # by which a displacement within a step is a rate; a step of no duration changes none
    share = GAMMA / (BETA * h) if h > 0.0 else 0.0
    total, elements = add_machines(
        h, data.machines, work.modes.ports, state.ports, work.rows, on_dofs, work.space.motion,
        n, count,
    )  # fmt: skip
    motions(work.active, work.modes.free, work.modes.free_rate, dofs.free, dofs.free_rate)
    # given torques move dropped modes, too
    fill(dofs.force[: work.active.counts[0].dofs], 0.0)
    put(dofs.force, work.modes.ports.given)
    add_residual(work.active, level, dofs.force, dofs.image, dofs.free)
    for i in range(total):
        problem.free[0, i] = work.rows.row[i].offset + row_value(on_dofs, i, dofs.free)
        problem.free[1, i] = row_value(on_dofs, i, dofs.free_rate)
    row_receptances(
        work.active, level, share, on_dofs, total, dofs.image, problem.displacement, problem.rate
    )
    add_neighbours(work.rows, n, problem.displacement)
    for e in range(count, elements):
        i = n + e - count
        if work.rows.element[e].law == HELD_RATE_LAW:
            if h == 0.0:
                acceleration = work.modes.acceleration
                hold_at_instant(total, i, work.active, acceleration, on_dofs, dofs.image, problem)
            work.rows.parameters[e, 1] = 1.0 / problem.rate[i, i]  # its forces are torques
    start_guess(laws, work.rows, elements, state.memory, work.space)
    if solve_contact(laws, work.rows, elements, total, work.space, problem) < 0:
        return -1
    freeze_neighbours(work.rows, n, problem.force)
    for i in range(total):
        if problem.force[i] != 0.0:
            add_row(on_dofs, i, -problem.force[i], dofs.force)
    return total


@njit(**PART)
def _accelerate(level, modal, given, work):
    """Modal accelerations by contact forces and machines; given torques are in the prediction."""
    dofs, push = work.dofs, work.modes.push
    for t in range(given.shape[0]):
        dofs.force[t] -= given[t]
    modal_forces(work.active, dofs.force, push)
    for t in range(given.shape[0]):
        dofs.force[t] += given[t]
    for j in range(modal.omega2.shape[0]):
        push[j] *= modal.inverse[level, j]


@njit(**PART)
def _advance_motion(h, machines, n_rows, work, state):
    """The new motion in ``work.modes.free``; False where it holds energy from nowhere."""
    modes = work.modes
    n = state.eta.shape[0]
    for j in range(n):
        modes.free[j] += BETA * h * h * modes.push[j]
        modes.free_rate[j] += GAMMA * h * modes.push[j]
        modes.acceleration[j] += modes.push[j]
    velocity = modes.free_rate[:n]
    state.given[0] += moved_energy(h, machines, modes.ports, velocity, work.active.modes)
    for i in range(n_rows):
        if work.rows.row[i].kind == LOAD:
            state.given[0] += h * abs(work.problem.force[i] * work.problem.motion[1, i])
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
    rows, force = work.rows, work.problem.force
    put(samples.eta[at], state.eta)
    put(samples.theta[at], work.modes.theta)
    for f in range(modal.inputs.shape[0]):
        samples.input_motion[at, f, 0] = dot(modal.inputs[f], state.eta)
        samples.input_motion[at, f, 1] = dot(modal.inputs[f], state.velocity)
    for t in range(state.ports.shape[0]):
        samples.torques[at, t] = state.ports[t].torque
        samples.speeds[at, t] = dot(state.velocity, work.active.modes[t])
    for q in range(pairs):
        pair = rows.pair[q]
        m, slot = pair.mesh, pair.slot
        samples.pair_load[at, m, slot] = pair.share * force[pair.row]
        if pair.rows == 2:
            samples.far_load[at, m, slot] = force[pair.row + 1]
            samples.pair_load[at, m, slot] += force[pair.row + 1]
            for a in range(2):
                delta = work.problem.motion[0, pair.row + a]
                samples.pair_approach[at, m, slot, a] = delta
                samples.pair_approach[at, m, slot, 2 + a] = delta - rows.row[pair.row + a].offset
        samples.pair_tooth[at, m, slot] = pair.tooth
        samples.pair_stiffness[at, m, slot] = pair.stiffness
        samples.pair_position[at, m, slot] = pair.s
    for i in range(n):
        if rows.row[i].kind < 0:
            samples.support_load[at, rows.row[i].owner] = force[i]
    put(samples.energy[at], state.energy)
    put(samples.active_flanks[at], state.active_flanks)


@njit(**PART)
def _finish(h, machines, state, work, count):
    """Make the new motion the state."""
    modes = work.modes
    put(state.acceleration, modes.acceleration[: state.eta.shape[0]])
    put(state.eta, modes.free[: state.eta.shape[0]])
    put(state.velocity, modes.free_rate[: state.eta.shape[0]])
    carry_on(h, machines, modes.ports, state.velocity, work.active.modes, state.ports)
    remember(work.rows, count, work.problem.motion, state.memory)


@njit(**UNCOUNTED, nogil=True)
def advance(data, laws, told, first, state, space, samples, control):
    """Go len(told) ticks of h₀ on; told (ticks, P + L): what the ports' machines follow at each new
    time, torques N·m or speeds rad/s (see ``machines``), nothing of a brake; then by how much the
    vectors of loads that are histories are multiplied.

    A sample is saved at every ``control.every``-th tick, counted from ``first`` ticks before.
    Returns (status, samples saved): status 0, the 1-based tick of a step without a solution, or
    less than 0 that of one at which the motion ran away or is not finite. A tick of no duration
    (see ``consistent_acceleration``) finds accelerations and looks nowhere.
    """
    work, ledger, counts = space.work, space.ledger, control.counts[0]
    modal, machines, ports = data.modal, data.machines, space.work.modes.ports
    saved = tick = np.int64(0)
    while tick < told.shape[0]:
        level = choose_level(control, first + tick, told.shape[0] - tick)
        h, end = modal.h[level], tick + (1 << level)
        tell_machines(machines, told[end - 1], ports)
        share = _predict(h, level, modal, work.active, state, work.modes)
        loads = told[end - 1, machines.shape[0] :]
        n, count, pairs = _build(data, share, loads, state, work, ledger, level)
        total = _contact(laws, data, level, n, count, state, work)
        if total < 0:
            return end, saved
        _accelerate(level, modal, ports.given, work)
        if control.tolerance > 0.0:
            error = step_error(h, level, modal, state, work, n, control.load)
            if not after_step(control, level, error):
                continue  # the same step again
        machine_torques(machines, work.problem.force, n, ports)
        if not _advance_motion(h, machines, n, work, state):
            return -end, saved
        if data.elements.gears.mesh.shape[0] > 0 and h > 0.0:
            now = first + tick
            if now % LOOK == 0 and now >= counts.next_look:
                ahead = 2 * LOOK * modal.h[0] + h
                margins = look_after_step(data, work, pairs, ahead, state.active_flanks)
                counts.next_look = now + 2 * LOOK if margins > 2.0 else 0
        if ledger.booked[0].tracked == 1:
            _book(laws, data, level, n, count, state, work, ledger)
        _finish(h, machines, state, work, count)
        counts.taken += 1
        control.by_level[level] += 1
        tick = end
        if (first + tick) % control.every == 0:
            _save(samples, saved, modal, work, n, pairs, state)
            saved += 1
    return np.int64(0), saved
