"""Forces on a train in a step beside contact: machines at its ports, turning frames, loads.

**Machines.** A given torque is part of the prediction. Every other machine is a row of the contact
problem with the force F = −T on its port, linear in the rate δ̇ = ω at the new time:

    brake        F = T_b(ω₀) + T_b'(ω₀) (ω − ω₀),   ω₀ the extrapolated speed; constant: F = T_b(ω)
    controller   F = −(I + h/2 k_i e₀) + (k_p + h/2 k_i)(ω − ω_s),   limited
    given speed  0 = ω − ω_s,   in a step of zero duration 0 = ω̇ − ω̇_s

The integral I of a controller is integrated by the trapezoidal rule, as speeds are by average
acceleration: I⁺ = I + h/2 k_i (e₀ + e⁺), with the errors e = ω_s − ω before and after the step. It
is constant while the torque is at a limit and the error would increase it further.

**Turning frames.** Coriolis forces are proportional to speed, centrifugal forces to its square,
both known at rated speed. The share of rated speed is that of the rigid rotation,

    s = v_rᵀ v / v_rᵀ v_r,   v_r the modal velocities at rated speed:

the ratio of speeds if the train has one independent rotation, a mean of ratios weighted by inertia
if it has several. Euler forces, m ω̇ E u, are neglected: their ratio to the Coriolis forces of a
motion of frequency f is ω̇/(4πf ω).
"""

from typing import NamedTuple

import numpy as np

from flexgear.analysis.kernels.active_dofs import motions
from flexgear.analysis.kernels.eliminated_springs import place_in_problem
from flexgear.analysis.kernels.row_receptances import row_value
from flexgear.analysis.kernels.vectors import dot
from flexgear.arrays import Array
from flexgear.compiled import FAST, INNER, njit
from flexgear.coupling.laws import HELD_RATE_LAW, LINEAR_RATE_LAW

STICK = 1e-3  # share of rated speed below which a constant brake torque is proportional to speed
TORQUE, SPEED, BRAKE, CONTROLLER = range(4)
MACHINE = np.dtype(
    [("kind", np.int64)]
    + [(n, float) for n in ("torque", "speed", "exponent")]
    + [(n, float) for n in ("proportional", "integral", "least", "most")]
)
PORT = np.dtype([(n, float) for n in ("torque", "integral", "error")])


class PortSpace(NamedTuple):
    """Prescribed values, torques and speeds of the ports at the new time, (P,)."""

    prescribed: Array  # N·m or rad/s; rad/s² for a given speed in a step of zero duration
    given_torque: Array  # N·m, zero at ports without given torque
    torque: Array  # N·m, of all ports
    guess: Array  # extrapolated speeds, rad/s


def port_space(count: int) -> PortSpace:
    """Work space for ``count`` ports."""
    return PortSpace(*np.zeros((4, count)))


@njit(**INNER)
def brake_torque(brake, speed):
    """Braking torque, N·m, and its derivative by speed: T = T_r sign(ω)|ω/ω_r|ⁿ.

    A constant torque (n = 0) is proportional to speed below a thousandth of rated speed, so that it
    never drives a train at rest. With zero rated speed it is the holding torque T_r.
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
    """Set F₀, c, δ̇₀, lower and upper limit of the law of a machine,
    F = F₀ + c (δ̇ − δ̇₀); c = 1 for a given speed.

    A constant brake torque (n = 0) is that of ``brake_torque`` at the new speed: a step that passes
    zero speed does not reverse it."""
    parameters[0], parameters[1], parameters[2] = 0.0, 1.0, prescribed
    parameters[3], parameters[4] = -machine.most, -machine.least
    if machine.kind == BRAKE and machine.exponent == 0.0 and machine.speed > 0.0:
        parameters[1], parameters[2] = machine.torque / (STICK * machine.speed), 0.0
        parameters[3], parameters[4] = -machine.torque, machine.torque
    elif machine.kind == BRAKE:
        parameters[0], parameters[1] = brake_torque(machine, guess)
        parameters[2] = guess
    elif machine.kind == CONTROLLER:
        half = 0.5 * h * machine.integral
        parameters[0] = -(port.integral + half * port.error)
        parameters[1] = machine.proportional + half


@njit(**INNER)
def prescribe(machines, prescribed, ports):
    """Copy the values prescribed to the machines, and the given torques, to ``ports``."""
    for p in range(machines.shape[0]):
        ports.prescribed[p] = prescribed[p]
        if machines[p].kind == TORQUE:
            ports.given_torque[p] = prescribed[p]


@njit(**INNER)
def add_machines(h, machines, ports, carried, rows, motion, n, count, springs):
    """Append machines without given torque as rows from n on and elements from ``count`` on;
    returns the new numbers of rows and elements.

    carried (P,) PORT: states of the last step; motion (E, 2, r): about which elements are
    linearised; springs: number of eliminated rows, which come last in the contact problem.
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
    """In a step of zero duration, state the row of element e, a given speed, in accelerations, on
    which forces of the ``total`` rows act by Φ Φᵀ. springs: number of eliminated rows, the last of
    the first n; image (2 C,): work space."""
    i = rows.element[e].first
    port, remaining = active.modes[rows.row[i + springs].dof], total - springs
    motions(active, port, port, image, image)
    for j in range(total):
        place, value = place_in_problem(j, springs, n, total), row_value(rows, j, image)
        if place < remaining:
            problem.rate[i, place] = value
        else:
            problem.springs.rate[i, place - remaining] = value
    problem.free[1, i] = dot(port, acceleration)


@njit(**INNER)
def machine_torques(machines, force, n, ports):
    """Torques of all ports: given ones, and those of the machines' rows, which begin with row n."""
    for p in range(machines.shape[0]):
        ports.torque[p] = ports.given_torque[p]
        if machines[p].kind != TORQUE:
            ports.torque[p] = -force[n]
            n += 1


@njit(**INNER)
def machine_work(h, machines, ports, velocity, modes):
    """Sum of the absolute works of all machines but brakes in a step with modal velocities, J."""
    total = 0.0
    for p in range(machines.shape[0]):
        if machines[p].kind != BRAKE:
            total += h * abs(ports.torque[p] * dot(velocity, modes[p]))
    return total


@njit(**INNER)
def carry_on(h, machines, ports, velocity, modes, carried):
    """Update torques, errors and integrals ``carried`` (P,) PORT to the new time."""
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
    """Forces of turning frames in n modes; all arrays empty where there are none."""

    gyroscopic: Array  # (n, n) G at rated speed
    centripetal: Array  # (n, n) C at rated speed
    rated: Array  # (n,) v_r / v_rᵀ v_r


@njit(**INNER, fastmath=FAST)
def rotating_forces(h, frames, state, out):
    """Compute in ``out`` (n,) the forces s (G v − s C q) at the extrapolated motion; returns the
    share s of rated speed, 1 without such forces."""
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
    """Set the loads that grow with the square of speed, and those of load histories (L,), at the
    new time; the fixed elements are the last of ``count``."""
    first = count - fixed.element.shape[0]
    for e in range(fixed.element.shape[0]):
        element = fixed.element[e]
        if element.grows == 1:
            rows.parameters[first + e, 0] = share * share * fixed.parameters[e, 0]
        elif element.history >= 0:
            rows.parameters[first + e, 0] = histories[element.history]
