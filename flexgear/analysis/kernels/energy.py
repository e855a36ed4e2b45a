"""Energy account of a time step.

Kinetic and elastic energy of modes, ½ fᵀ R f of the residual flexibility and the potentials of the
force elements change by the work of the machines at the ports, of modal damping, of weight and
given loads, of what else in the elements has no potential, and by *parametric work*: stiffness and
contact vectors change with the carrier angle, which the small-motion model imposes, and so do
errors: what dampers of pairs take at the rate of these comes from there, too. What a
controller remembers is no energy of the train; all that it does is in its torque. With E(rows, u)
the potential of a set of rows at motion u, F(rows, u) the forces in it and δ their closing, the
parametric work of a step is B(new) − B(old), with

    B(rows) = ½ [E(rows, u⁺) + E(rows, u)] − ¼ [F(rows, u⁺) − F(rows, u)]ᵀ (δ⁺ − δ) ,

of springs ½ k δ δ⁺. It is free of bookkeeping about which pair entered or left, and exact for
springs where a pair comes or goes under load, too: then R f, and so u, jumps, however short the
step is (**derived**: ½ uᵀ(K_new − K_old)u⁺ closes the balance identically; the mean of changing
the rows at either motion leaves ¼ Δuᵀ(K_old − K_new)Δu). What rows yield to their neighbours, and
the energy in it, are those of the rows' own forces in both.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from flexgear.analysis.kernels.active_dofs import add_residual, motions
from flexgear.analysis.kernels.contact_newton import linearise
from flexgear.analysis.kernels.row_receptances import place_rows, row_value
from flexgear.analysis.kernels.vectors import put
from flexgear.arrays import Array
from flexgear.compiled import FAST, INNER, PART, ZERO, njit
from flexgear.coupling.kernels.elements import Rows, neighbour_energy
from flexgear.coupling.kernels.pair_errors import error_rate
from flexgear.coupling.pair_data import LOAD

LEFT_OVER = {  # what is stored less what entered
    "kinetic": 1.0,
    "elastic": 1.0,
    "pair_elastic": 1.0,
    "input_work": -1.0,
    "brake_work": 1.0,
    "damping_work": 1.0,
    "pair_damping_work": 1.0,
    "parametric_work": -1.0,
    "load_work": -1.0,
}
ENERGIES = tuple(LEFT_OVER)
KINETIC, ELASTIC, ELEMENTS, INPUT, BRAKE, DAMPING, LOST, PARAMETRIC, LOADED = range(9)
BOOKED = np.dtype(
    [(name, np.int64) for name in ("tracked", "rows", "elements")]
    + [(name, float) for name in ("potential", "beside")]
)
LAST, FRESH, SPARE, HELD = range(4)


class Ledger(NamedTuple):
    """Rows of the last step, and work space; row vectors are (R,)."""

    booked: Any  # (1,) BOOKED: whether energy is tracked; rows, elements, potential of the last one
    rows: Rows
    lost: Array  # (4, R) force without a potential of the last step and of this one, N; forces
    # with one at the other motion, and at that of the rows themselves
    now: Array  # (2, R) δ at the new motion, and a rate of zero
    before: Array  # (2, R) the same at the old motion
    delta: Array  # δ of the last step's rows at its motion
    force: Array  # (n_c,) on all channels at the last step
    error_rates: Array  # (M,) of the errors of gear meshes at the last step, m/s


@njit(**INNER)
def _approach(rows, n, motion, out):
    """δ of rows at a motion of the active dofs."""
    for i in range(n):
        out[0, i] = rows.row[i].offset + row_value(rows, i, motion)


@njit(**INNER)
def _potential(laws, rows, count, motion, space, elastic):
    """Potential of all elements at rest at a motion (2, R), J; elastic (R,) gets its forces."""
    total = 0.0
    for e in range(count):
        total += linearise(laws, rows, e, motion, space, e)
        element = rows.element[e]
        for a in range(element.rows):
            elastic[element.first + a] = space.force[e, 1, a]
    return total


@njit(**INNER)
def _book_work(rows, force, now, before, n, h, rates, energy):
    """Add to ``energy``, J, half the work of a step: ½ F (δ⁺ − δ) of given loads, which they do, of
    all other rows, which is lost, and ½ F ė h, which is lost, too, and done by errors that change.

    force F (n,) N: without a potential; before, now (2, n): δ and δ⁺, m; rates ė (M,) m/s.
    """
    for i in range(n):
        work = 0.5 * force[i] * (now[0, i] - before[0, i])
        if rows.row[i].kind == LOAD:
            energy[LOADED] -= work
        else:
            of_errors = 0.5 * force[i] * h * error_rate(rows, i, rates)
            energy[LOST] += work + of_errors
            energy[PARAMETRIC] += of_errors


@njit(**INNER)
def _cross(force, other_force, now, before, n):
    """¼ (F⁺ − F) (δ⁺ − δ) of rows. force: at the motion of their step; other_force: at that of
    the other step, the last one for rows of this one and the reverse."""
    total = 0.0
    for i in range(n):
        total += (force[i] - other_force[i]) * (now[0, i] - before[0, i])
    return 0.25 * total


@njit(**INNER)
def _copy_records(source, target, count):
    for i in range(count):
        target[i] = source[i]


@njit(**INNER)
def _copy_rows(source, n, count, target):
    _copy_records(source.row, target.row, n)
    _copy_records(source.element, target.element, count)
    for i in range(n):
        put(target.blocks[i], source.blocks[i])
        for a in range(source.row[i].beyond, source.row[i].width):
            put(target.coef[i, a], source.coef[i, a])
    for e in range(count):
        put(target.parameters[e], source.parameters[e])


@njit(**INNER, fastmath=FAST)
def _book_modes(modal, state, modes, energy):
    """Kinetic and elastic energy of modes, and what modal damping took."""
    kinetic = elastic = taken = 0.0
    for j in range(modal.omega2.shape[0]):
        v, q = modes.free_rate[j], modes.free[j]
        kinetic += 0.5 * v * v
        elastic += 0.5 * modal.omega2[j] * q * q
        taken += modal.damping[j] * 0.5 * (v + state.velocity[j]) * (q - state.eta[j])
    energy[KINETIC], energy[ELASTIC] = kinetic, elastic
    return taken


@njit(**PART)
def motion_before(active, level, eta, spare, dofs, force):
    """Motion of the active dofs at the last step: Φη + R f; spare (≥ n,): work, force (n_c,)."""
    put(spare, eta)
    motions(active, spare, spare, dofs.before, dofs.before)
    for d in range(active.counts[0].dofs):
        dofs.motion[d] = force[active.channel[d]]
    add_residual(active, level, dofs.motion, dofs.image, dofs.before)


@njit(**INNER)
def settle(laws, modal, h, channels, count, n, state, work, ledger):
    """Book one step of h s from ``state`` to the new modal motion in ``work.modes.free``.

    work.dofs holds the motion of the active dofs at the last step in ``before``, at this one in
    ``motion``, and R f in ``image``; n rows of ``count`` elements, without the brake.
    """
    rows, dofs, active = work.rows, work.dofs, work.active
    modes, space, problem, energy = work.modes, work.space, work.problem, state.energy
    booked, last, lost = ledger.booked[0], ledger.rows, ledger.lost
    now, before, last_delta, ports = ledger.now, ledger.before, ledger.delta, state.ports
    force, torque, delta = problem.force, modes.ports.torque, problem.motion[0, :n]
    taken = _book_modes(modal, state, modes, energy)
    for d in range(active.counts[0].dofs):
        energy[ELASTIC] += 0.5 * dofs.force[d] * dofs.image[2 * d + 1]
    put(now[0], delta)
    beside = neighbour_energy(rows, n, force)
    potential = beside + _potential(laws, rows, count, now, space, lost[HELD])
    for i in range(n):
        lost[FRESH, i] = force[i] - lost[HELD, i]
    if booked.rows >= 0:
        for t in range(ports.shape[0]):
            of_port = 0.5 * (torque[t] + ports[t].torque) * (dofs.motion[t] - dofs.before[t])
            if t < ports.shape[0] - 1:
                energy[INPUT] += of_port
            else:
                energy[BRAKE] -= of_port
        energy[DAMPING] += taken
        _approach(rows, n, dofs.before, before)
        _book_work(rows, lost[FRESH], now, before, n, h, work.error_rates, energy)
        was = beside + _potential(laws, rows, count, before, space, lost[SPARE])
        cross = _cross(lost[HELD], lost[SPARE], now, before, n)
        place_rows(active, channels, last, booked.rows, ZERO)
        _approach(last, booked.rows, dofs.motion, now)
        put(before[0], last_delta[: booked.rows])
        _book_work(last, lost[LAST], now, before, booked.rows, h, ledger.error_rates, energy)
        _potential(laws, last, booked.elements, before, space, lost[HELD])
        goes = booked.beside
        goes += _potential(laws, last, booked.elements, now, space, lost[SPARE])
        cross += _cross(lost[HELD], lost[SPARE], now, before, booked.rows)
        energy[PARAMETRIC] += 0.5 * (potential + was - goes - booked.potential) - cross
    energy[ELEMENTS] = potential
    put(lost[LAST], lost[FRESH])
    put(ledger.error_rates, work.error_rates)
    put(last_delta, delta)
    _copy_rows(rows, n, count, last)
    booked.rows, booked.elements = n, count
    booked.potential, booked.beside = potential, beside
