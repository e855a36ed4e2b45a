"""Compiled Newmark step in modal coordinates with constant receptances of the contact channels.

Average acceleration (β = 1/4, γ = 1/2, Newmark 1959). For a mode, with D = 1/(1 + γ h d + β h² ω²)
and d = 2ζω,

    a⁺ = D (p⁺ − d v* − ω² η*),  η⁺ = η* + β h² a⁺,  v⁺ = v* + γ h a⁺,

so that unit forces on the channels move them by G = Φ βh² D Φᵀ + R and change their velocity by
(γ/βh) (G − R), which are constant for a step size. A step

    predicts the motion without contact forces, and the new angles              (``_predict``),
    builds the rows of the force elements at these angles                       (``_build``),
    solves one small contact problem for their forces and the machines' torques (``_contact``),
    projects these on the modes; a step with too large an error is repeated     (``_accelerate``),
    checks the gaps of unloaded flanks, updates energies and state, and saves   (``_finish``).

Forces of a rotating frame, G v − C q, act with motion extrapolated to the new time, to second
order. Step sizes may differ by powers of two: see ``refinement``.
"""

import numpy as np

from flexgear.analysis.kernels.active_dofs import (
    add_residual,
    apply_receptance,
    gather,
    gather_receptance,
    modal_forces,
    motions,
)
from flexgear.analysis.kernels.coast_flanks import look_after_step
from flexgear.analysis.kernels.contact_newton import remember, solve_contact, start_guess
from flexgear.analysis.kernels.eliminated_springs import (
    add_springs,
    eliminate_springs,
    place_in_problem,
)
from flexgear.analysis.kernels.energy import motion_before, settle
from flexgear.analysis.kernels.outer_forces import (
    add_machines,
    carry_on,
    hold_at_instant,
    machine_torques,
    machine_work,
    prescribe,
    rotating_forces,
    set_loads,
)
from flexgear.analysis.kernels.refinement import after_step, choose_level, step_error
from flexgear.analysis.kernels.row_receptances import (
    add_row,
    place_rows,
    row_receptances,
    row_value,
)
from flexgear.analysis.kernels.samples import note_loads
from flexgear.analysis.kernels.vectors import add, dot, fill, put
from flexgear.compiled import FAST, INNER, PART, UNCOUNTED, njit
from flexgear.coupling.kernels.elements import add_neighbours, freeze_neighbours
from flexgear.coupling.kernels.pair_errors import error_rate, error_rates
from flexgear.coupling.kernels.pairs import fill_rows
from flexgear.coupling.laws import HELD_RATE_LAW
from flexgear.coupling.pair_data import LOAD

BETA, GAMMA = 0.25, 0.5
LOOK = 4  # steps between two checks of unloaded flanks; twice as many while all gaps are wide
RUNAWAY = 1e3  # kinetic energy over the energy at the start and input, above which motion diverges


@njit(**INNER, fastmath=FAST)
def _predict(h, level, modal, active, state, modes):
    """Motion under given torques alone, new angles, and extrapolated speeds of the ports; returns
    the share of rated speed. Loops of one or two statements are vectorised by the compiler."""
    n, ports = modal.omega2.shape[0], modes.ports
    free, rate, a = modes.free, modes.free_rate, modes.acceleration
    eta, velocity, before = state.eta, state.velocity, state.acceleration
    share = rotating_forces(h, modal.frames, state, modes.rotating)
    for j in range(n):
        free[j] = eta[j] + h * velocity[j] + (0.5 - BETA) * h * h * before[j]
        rate[j] = velocity[j] + (1.0 - GAMMA) * h * before[j]
    for j in range(n):
        a[j] = -modal.damping[j] * rate[j] - modal.omega2[j] * free[j] - modes.rotating[j]
    for t in range(ports.given_torque.shape[0]):
        if ports.given_torque[t] != 0.0:
            add(a[:n], ports.given_torque[t], active.modes[t])
    for j in range(n):
        a[j] *= modal.inverse[level, j]
        free[j] += BETA * h * h * a[j]
        rate[j] += GAMMA * h * a[j]
    # elastic accelerations oscillate numerically and are not used for the geometry
    for j in range(n):
        rigid = h * before[j] if modal.omega2[j] == 0.0 else 0.0
        modes.push[j] = velocity[j] + rigid
        modes.spare[j] = eta[j] + h * (velocity[j] + 0.5 * rigid)
    for t in range(ports.guess.shape[0]):
        ports.guess[t] = dot(modes.push[:n], active.modes[t])
    for t in range(modes.theta.shape[0]):
        modes.theta[t] = dot(modal.angles[t], modes.spare)
        modes.speeds[t] = dot(modal.angles[t], modes.push)
    return share


@njit(**PART)
def _build(data, share, prescribed, state, work, ledger, level):
    """Build rows and elements at the new angles, with their active dofs; returns the numbers of
    rows, elements and pairs. prescribed (L,): factors of loads."""
    rows, active, elements, channels = work.rows, work.active, data.elements, data.channels
    theta, speeds = work.modes.theta, work.modes.speeds
    n, count, pairs = fill_rows(elements, theta, state.active_flanks, rows)
    error_rates(elements.gears, theta, speeds, state.active_flanks, work.error_rates)
    set_loads(share, prescribed, elements.fixed, rows, count)
    gather(active, channels, rows, n, ledger.rows, ledger.booked[0].rows)
    gather_receptance(active, channels, level)
    place_rows(active, channels, rows, n, data.springs.stiffness.shape[0])
    return n, count, pairs


@njit(**PART)
def _contact(laws, data, level, n, count, state, work):
    """Forces of the n rows of ``count`` elements, and of the machines' rows after them, in
    ``work.problem`` and on the active dofs; returns the number of all rows, −1 without a solution.
    """
    active, rows, dofs = work.active, work.rows, work.dofs
    problem, space, modes, h = work.problem, work.space, work.modes, data.modal.h[level]
    machines, port_forces, memory = data.machines, modes.ports.given_torque, state.memory
    springs, eliminated = data.springs, data.springs.stiffness.shape[0]
    # rate per displacement by forces of the new time; a step of zero duration changes no rate
    share = GAMMA / (BETA * h) if h > 0.0 else 0.0
    total, elements = add_machines(
        h, machines, modes.ports, state.ports, rows, space.motion, n, count, eliminated
    )  # fmt: skip
    m = total - eliminated
    motions(active, modes.free, modes.free_rate, dofs.free, dofs.free_rate)
    # given torques also act on the residual flexibility
    fill(dofs.force[: active.counts[0].dofs], 0.0)
    put(dofs.force, port_forces)
    add_residual(active, level, dofs.force, dofs.image, dofs.free)
    for d in range(active.counts[0].dofs):
        dofs.torque_motion[d] = dofs.image[2 * d]
    for i in range(total):
        at = place_in_problem(i, eliminated, n, total)
        problem.free[0, at] = rows.row[i].offset + row_value(rows, i, dofs.free)
        problem.free[1, at] = row_value(rows, i, dofs.free_rate)
        if i < n:
            problem.free[1, at] += error_rate(rows, i, work.error_rates)
    row_receptances(active, level, share, rows, n, total, springs, dofs, problem)
    add_neighbours(rows, n - eliminated, problem.displacement)
    for e in range(count, elements):
        i = rows.element[e].first
        if rows.element[e].law == HELD_RATE_LAW:
            if h == 0.0:
                hold_at_instant(
                    total, n, e, eliminated, active, modes.acceleration, rows, dofs.image, problem
                )
            rows.parameters[e, 1] = 1.0 / problem.rate[i, i]  # its forces are torques
    if eliminated > 0:
        eliminate_springs(springs, level, m, problem)
    start_guess(laws, rows, count - eliminated, count, elements, memory, space)
    if solve_contact(laws, rows, count - eliminated, count, elements, m, space, problem) < 0:
        return -1
    if eliminated > 0:
        add_springs(springs, n, total, problem)
    freeze_neighbours(rows, n, problem.force)
    for i in range(total):
        if problem.force[i] != 0.0:
            add_row(rows, i, -problem.force[i], dofs.force)
    return total


@njit(**PART)
def _accelerate(inverse, active, force, port_forces, push):
    """Modal accelerations by contact and machines, without the given torques of the prediction."""
    for t in range(port_forces.shape[0]):
        force[t] -= port_forces[t]
    modal_forces(active, force, push)
    for t in range(port_forces.shape[0]):
        force[t] += port_forces[t]
    for j in range(inverse.shape[0]):
        push[j] *= inverse[j]


@njit(**PART)
def _advance_motion(h, machines, n_rows, work, state):
    """Compute the new motion in ``work.modes.free``; returns False where its kinetic energy is not
    finite or exceeds ``RUNAWAY`` times the energy put in."""
    rows, problem, modes = work.rows, work.problem, work.modes
    energy_in, n = state.energy_in, state.eta.shape[0]
    free, rate, acceleration, push = modes.free, modes.free_rate, modes.acceleration, modes.push
    ports, port_modes = modes.ports, work.active.modes
    for j in range(n):
        free[j] += BETA * h * h * push[j]
        rate[j] += GAMMA * h * push[j]
        acceleration[j] += push[j]
    energy_in[0] += machine_work(h, machines, ports, rate[:n], port_modes)
    for i in range(n_rows):
        if rows.row[i].kind == LOAD:
            energy_in[0] += h * abs(problem.force[i] * problem.motion[1, i])
    return 0.5 * dot(rate[:n], rate) <= RUNAWAY * energy_in[0]


@njit(**PART)
def _book(laws, data, level, n, count, state, work, ledger):
    """Update the energy balance for an accepted step. Contact forces f move the dofs from the
    prediction Φη* + R t with given torques t to Φη + R (f + t) = Φη* + R t + G f."""
    active, dofs, modes, modal, force = work.active, work.dofs, work.modes, data.modal, ledger.force
    count_dofs = active.counts[0].dofs
    if active.counts[0].fresh == 1:
        motion_before(active, level, state.eta, modes.spare, dofs, force)
        active.counts[0].fresh = 0
    else:
        put(dofs.before, dofs.motion[:count_dofs])
    apply_receptance(active, level, dofs.force, dofs.image)
    for d in range(count_dofs):
        dofs.motion[d] = dofs.free[d] + dofs.image[2 * d] - dofs.torque_motion[d]
    settle(laws, modal, modal.h[level], data.channels, count, n, state, work, ledger)
    fill(force, 0.0)
    for d in range(count_dofs):
        force[active.channel[d]] = dofs.force[d]


@njit(**PART)
def _save(samples, at, modal, work, n, pairs, state):
    """Save the state as sample ``at``."""
    eta, velocity, ports = state.eta, state.velocity, state.ports
    turned, torques, speeds = samples.input_motion[at], samples.torques[at], samples.speeds[at]
    inputs, port_modes = modal.inputs, work.active.modes
    put(samples.eta[at], eta)
    put(samples.theta[at], work.modes.theta)
    put(samples.energy[at], state.energy)
    put(samples.active_flanks[at], state.active_flanks)
    for f in range(inputs.shape[0]):
        turned[f, 0], turned[f, 1] = dot(inputs[f], eta), dot(inputs[f], velocity)
    for t in range(ports.shape[0]):
        torques[t], speeds[t] = ports[t].torque, dot(velocity, port_modes[t])
    note_loads(work.rows, n, pairs, work.problem.force, work.problem.motion[0], at, samples.pairs)


@njit(**PART)
def _finish(h, machines, state, work, count):
    """Copy the new motion to the state."""
    modes, n = work.modes, state.eta.shape[0]
    put(state.acceleration, modes.acceleration[:n])
    put(state.eta, modes.free[:n])
    put(state.velocity, modes.free_rate[:n])
    carry_on(h, machines, modes.ports, state.velocity, work.active.modes, state.ports)
    remember(work.rows, count, work.problem.motion, state.memory, work.space.remembered)


@njit(**UNCOUNTED, nogil=True)
def advance(data, laws, prescribed, first, state, space, samples, control):
    """Advance the state by len(prescribed) ticks of the shortest step h₀.

    prescribed (ticks, P + L): values for the machines at each new time, torques N·m or speeds rad/s
    (see ``outer_forces``; ignored for brakes), then factors on the vectors of load histories. A
    sample is saved at every ``control.every``-th tick, with ``first`` ticks done before.
    Returns (status, samples saved). status: 0; or the number from 1 of the tick whose step has no
    solution; or minus the number of the tick at which the motion diverges or is not finite. A step
    of zero duration (``step_space.consistent_acceleration``) sets accelerations and does not check
    unloaded flanks.
    """
    work, ledger, counts, by_level = space.work, space.ledger, control.counts[0], control.by_level
    modal, machines, gear_meshes = data.modal, data.machines, data.elements.gears.gear_mesh.shape[0]
    modes, active, force = work.modes, work.active, work.problem.force
    ports, sizes, loads = modes.ports, modal.h, prescribed[:, machines.shape[0] :]
    tracked = ledger.booked[0].tracked == 1
    saved = tick = np.int64(0)
    while tick < prescribed.shape[0]:
        level = choose_level(control, first + tick, prescribed.shape[0] - tick)
        h, end = sizes[level], tick + (1 << level)
        prescribe(machines, prescribed[end - 1], ports)
        share = _predict(h, level, modal, active, state, modes)
        n, count, pairs = _build(data, share, loads[end - 1], state, work, ledger, level)
        total = _contact(laws, data, level, n, count, state, work)
        if total < 0:
            return end, saved
        _accelerate(modal.inverse[level], active, work.dofs.force, ports.given_torque, modes.push)
        if control.tolerance > 0.0:
            error = step_error(h, level, modal, state, work, n, control.load)
            if not after_step(control, level, error):
                continue  # repeat the step
        machine_torques(machines, force, n, ports)
        if not _advance_motion(h, machines, n, work, state):
            return -end, saved
        if gear_meshes > 0 and h > 0.0:
            now = first + tick
            if now % LOOK == 0 and now >= counts.next_look:
                ahead = 2 * LOOK * sizes[0] + h
                margins = look_after_step(data, work, level, pairs, ahead, state.active_flanks)
                counts.next_look = now + 2 * LOOK if margins > 2.0 else 0
        if tracked:
            _book(laws, data, level, n, count, state, work, ledger)
        _finish(h, machines, state, work, count)
        counts.taken += 1
        by_level[level] += 1
        tick = end
        if (first + tick) % control.every == 0:
            _save(samples, saved, modal, work, n, pairs, state)
            saved += 1
    return np.int64(0), saved
