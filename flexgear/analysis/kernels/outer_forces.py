"""Forces on a train in a step beside contact: machines at its ports, turning frames, loads.

Machines at the ports are rows of a step's contact problem.

A given torque is part of the prediction. Every other machine is a row V with force F = −T on its
port, linear in the rate δ̇ = ω of the new time:

    brake        F = T_b(ω₀) + T_b'(ω₀) (ω − ω₀),   ω₀ the extrapolated speed
    controller   F = −(I + h/2 k_i e₀) + (k_p + h/2 k_i)(ω − ω_s),   cut off at its limits
    given speed  0 = ω − ω_s,   in a step of no duration 0 = ω̇ − ω̇_s

The integral I of a controller follows by the trapezoidal rule, which is how average acceleration
integrates speeds: I⁺ = I + h/2 k_i (e₀ + e⁺) with the errors e = ω_s − ω before and after the step.
It stands while the torque is at a limit that the error pushes against.

Forces of frames that turn, in a step: they follow the speed that the train has.

Coriolis forces go with the speed, centrifugal ones with its square; both are known at rated speed.
The share of it is that of the rolling, elastic motion left out,

    s = v_rᵀ v / v_rᵀ v_r,   v_r the modal velocities at rated speed,

so s is the ratio of speeds where the train has one independent rotation, and a mean of the ratios,
weighted by inertia, where it has several. Euler forces, m ω̇ E u, are left out: against the Coriolis
forces of a motion of frequency f they are as ω̇ to 4πf ω.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flexgear.analysis.kernels.active_dofs import motions
from flexgear.analysis.kernels.eliminated_springs import place_in_problem
from flexgear.analysis.kernels.row_receptances import row_value
from flexgear.analysis.kernels.vectors import dot
from flexgear.arrays import Array
from flexgear.compiled import FAST, INNER, njit
from flexgear.coupling.laws import HELD_RATE_LAW, LINEAR_RATE_LAW

STICK = 1e-3  # share of rated speed below which a constant brake torque fades
TORQUE, SPEED, BRAKE, CONTROLLER = range(4)
MACHINE = np.dtype(
    [("kind", np.int64)]
    + [(n, float) for n in ("torque", "speed", "exponent")]
    + [(n, float) for n in ("proportional", "integral", "least", "most")]
)
PORT = np.dtype([(n, float) for n in ("torque", "integral", "error")])


class PortSpace(NamedTuple):
    """What is prescribed to the machines at the new time, and what they do then, (P,)."""

    prescribed: Array  # N·m or rad/s; rad/s² of a given speed in a step of no duration
    given_torque: Array  # torques that are given, zero at the other ports, N·m
    torque: Array  # torques of all, N·m
    guess: Array  # extrapolated speeds, rad/s


def port_space(count: int) -> PortSpace:
    """Work space for so many ports."""
    return PortSpace(*np.zeros((4, count)))


@njit(**INNER)
def brake_torque(brake, speed):
    """Torque that a brake takes and its slope at a speed: T = T_r sign(ω)|ω/ω_r|ⁿ.

    A constant torque (n = 0) fades linearly below a thousandth of the rated speed, so that it
    never drives a train at rest. Rated to stand still (ω_r = 0) it is what holds the train, T_r.
    """
    if brake.speed == 0.0:
        return brake.torque, 0.0
    if brake.exponent == 1.0:
        slope = brake.torque / brake.speed
        return slope * speed, slope
    ratio = abs(speed) / brake.speed
    sign = 1.0 if speed >= 0.0 else -1.0
    if brake.exponent == 0.0 and ratio < STICK:
        slope = brake.torque / (STICK * brake.speed)
        return slope * speed, slope
    torque = sign * brake.torque * ratio**brake.exponent
    slope = 0.0
    if ratio != 0.0:
        slope = brake.exponent * brake.torque / brake.speed * ratio ** (brake.exponent - 1.0)
    return torque, slope


@njit(**INNER)
def machine_parameters(machine, h, prescribed, guess, port, parameters):
    """F₀, c, δ̇₀, least and most F of a machine's law; see above. A given speed has c = 1."""
    parameters[0], parameters[1], parameters[2] = 0.0, 1.0, prescribed
    parameters[3], parameters[4] = -machine.most, -machine.least
    if machine.kind == BRAKE:
        parameters[0], parameters[1] = brake_torque(machine, guess)
        parameters[2] = guess
    elif machine.kind == CONTROLLER:
        half = 0.5 * h * machine.integral
        parameters[0] = -(port.integral + half * port.error)
        parameters[1] = machine.proportional + half


@njit(**INNER)
def prescribe(machines, prescribed, ports):
    """Note the first values of ``prescribed``, one for each machine, and the given torques."""
    for p in range(machines.shape[0]):
        ports.prescribed[p] = prescribed[p]
        if machines[p].kind == TORQUE:
            ports.given_torque[p] = prescribed[p]


@njit(**INNER)
def add_machines(h, machines, ports, carried, rows, motion, n, count, springs):
    """Machines that are no given torques as rows n … and elements ``count`` …; the ends of both.

    carried (P,) PORT: of the last step; motion (E, 2, r): what elements are linearised about;
    springs: how many rows before are eliminated, which come last in the contact problem.
    """
    for p in range(machines.shape[0]):
        if machines[p].kind == TORQUE:
            continue
        row = rows.row[n]
        row.dof, row.along, row.beyond, row.width, row.offset = p, 0.0, 0, 0, 0.0
        row.since = rows.row[n - 1].since if n > 0 else 0
        element = rows.element[count]
        element.law = HELD_RATE_LAW if machines[p].kind == SPEED else LINEAR_RATE_LAW
        element.first, element.rows, element.place = n - springs, 1, -1
        motion[count, 0, 0], motion[count, 1, 0] = 0.0, ports.guess[p]
        machine_parameters(
            machines[p], h, ports.prescribed[p], ports.guess[p], carried[p], rows.parameters[count]
        )
        n, count = n + 1, count + 1
    return n, count


@njit(**INNER)
def hold_at_instant(total, n, e, springs, active, acceleration, rows, image, problem):
    """In a step of no duration: the row of element e, of a given speed, in terms of accelerations,
    which ``total`` rows change by Φ Φᵀ; image (2 C,): work. So many springs, the last of the first
    n rows, are eliminated."""
    at = rows.element[e].first
    port, remaining = active.modes[rows.row[at + springs].dof], total - springs
    motions(active, port, port, image, image)
    for j in range(total):
        place, value = place_in_problem(j, springs, n, total), row_value(rows, j, image)
        if place < remaining:
            problem.rate[at, place] = value
        else:
            problem.springs.rate[at, place - remaining] = value
    problem.free[1, at] = dot(port, acceleration)


@njit(**INNER)
def machine_torques(machines, force, n, ports):
    """Torques of all ports from the given ones and the forces of their rows, from row n on."""
    for p in range(machines.shape[0]):
        ports.torque[p] = ports.given_torque[p]
        if machines[p].kind != TORQUE:
            ports.torque[p] = -force[n]
            n += 1


@njit(**INNER)
def machine_work(h, machines, ports, velocity, modes):
    """Work of machines beside brakes in a step at modal velocities, without its sign, J."""
    total = 0.0
    for p in range(machines.shape[0]):
        if machines[p].kind != BRAKE:
            total += h * abs(ports.torque[p] * dot(velocity, modes[p]))
    return total


@njit(**INNER)
def carry_on(h, machines, ports, velocity, modes, carried):
    """Torques, errors and integrals of the new time; carried (P,) PORT."""
    for p in range(machines.shape[0]):
        machine, port = machines[p], carried[p]
        port.torque = ports.torque[p]
        if machine.kind == CONTROLLER:
            error = ports.prescribed[p] - dot(velocity, modes[p])
            above = port.torque >= machine.most and error > 0.0
            if not above and not (port.torque <= machine.least and error < 0.0):
                port.integral += 0.5 * h * machine.integral * (port.error + error)
            port.error = error


class FrameData(NamedTuple):
    """n modes; all empty where frames make no forces."""

    gyroscopic: Array  # (n, n) G at rated speed
    centripetal: Array  # (n, n) C at rated speed
    rated: Array  # (n,) v_r / v_rᵀ v_r


@njit(**INNER, fastmath=FAST)
def rotating_forces(h, frames, state, out):
    """G v − C q at the extrapolated motion into ``out`` (n,); the share of rated speed, 1 without
    such forces."""
    n = frames.rated.shape[0]
    velocity, acceleration = state.velocity, state.acceleration
    if n == 0:
        return 1.0
    share = dot(frames.rated, velocity) + h * dot(frames.rated, acceleration)
    for i in range(n):
        coriolis = centrifugal = 0.0
        for j in range(n):
            coriolis += frames.gyroscopic[i, j] * (velocity[j] + h * acceleration[j])
            centrifugal += frames.centripetal[i, j] * (state.eta[j] + h * velocity[j])
        out[i] = share * (coriolis - share * centrifugal)
    return share


@njit(**INNER)
def set_loads(share, histories, fixed, rows, count):
    """Forces that go with the square of speed, and those of load histories (L,) at the new time;
    the fixed elements are the last of ``count``."""
    first = count - fixed.element.shape[0]
    for e in range(fixed.element.shape[0]):
        element = fixed.element[e]
        if element.grows == 1:
            rows.parameters[first + e, 0] = share * share * fixed.parameters[e, 0]
        elif element.history >= 0:
            rows.parameters[first + e, 0] = histories[element.history]
