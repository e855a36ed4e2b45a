"""Energy balance of a time step.

Kinetic and elastic energy of modes, ½ fᵀ R f of the residual flexibility and the potentials of the
force elements change by the work of machines, of modal damping, of weight and given loads, of
forces of elements without potential, and by *parametric work*: stiffness, contact vectors and
errors change with the carrier angle, which the small-motion model prescribes (so the energy that
dampers of pairs dissipate by the rate of errors comes from parametric work, too). The state of a
controller has no energy: its work is that of its torque. With E(rows, u) the potential of a set of
rows at the motion u, F(rows, u) their forces and δ their closing, the parametric work of a step is
B(new rows) − B(old rows), with

    B(rows) = ½ [E(rows, u⁺) + E(rows, u)] − ¼ [F(rows, u⁺) − F(rows, u)]ᵀ (δ⁺ − δ) ,

for springs ½ k δ δ⁺. B does not depend on which pairs enter or leave contact, and for springs it is
exact even where a pair enters or leaves under load: then R f, and so u, jumps in steps of any size
(derivation: ½ uᵀ(K_new − K_old)u⁺ closes the balance identically; the mean of changing the rows at
either motion would leave ¼ Δuᵀ(K_old − K_new)Δu). The flexibility between neighbouring rows, and
its energy, are taken with the rows' own forces at both motions.
"""

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

LEFT_OVER = {  # signs of the terms in the residual of the balance: stored minus supplied energy
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
    + [(name, float) for name in ("potential", "between")]
)
LAST, FRESH, SPARE, HELD = range(4)


class Ledger(NamedTuple):
    """Rows and forces of the last step, and work space for the energy balance; R rows."""

    booked: Any  # (1,) BOOKED: whether energy is tracked; of the last step the numbers of rows and
    # elements, the potential and its part between neighbouring rows
    rows: Rows
    lost: Array  # (4, R) N: forces without potential of the last step (LAST) and this one (FRESH);
    # forces with potential at the other motion (SPARE) and at the rows' own motion (HELD)
    now: Array  # (2, R) δ at the new motion, m, and a rate of zero
    before: Array  # (2, R) δ at the old motion, m, and a rate of zero
    delta: Array  # (R,) δ of the last step's rows at its motion, m
    force: Array  # (n_c,) on all channels at the last step, N
    error_rates: Array  # (M,) of the errors of gear meshes at the last step, m/s


@njit(**INNER)
def _approach(rows, n, motion, out):
    """Compute δ of n rows at a motion of the active dofs."""
    for i in range(n):
        out[0, i] = rows.row[i].offset + row_value(rows, i, motion)


@njit(**INNER)
def _potential(laws, rows, count, motion, space, elastic):
    """Potential of all elements at a motion (2, R) with zero rates, J; elastic (R,): set to the
    forces of this potential, N."""
    total = 0.0
    for e in range(count):
        total += linearise(laws, rows, e, motion, space, e)
        element = rows.element[e]
        for a in range(element.rows):
            elastic[element.first + a] = space.force[e, 1, a]
    return total


@njit(**INNER)
def _book_work(rows, force, now, before, n, h, rates, energy):
    """Add to ``energy``, J, half the work of a step by forces F without potential.

    ½ F (δ⁺ − δ) is work of given loads, or for other rows dissipated; ½ F ė h is dissipated and
    supplied by parametric work. force (n,): F, N; before, now (2, n): δ and δ⁺, m; rates (M,): ė of
    the gear meshes' errors, m/s.
    """
    for i in range(n):
        work = 0.5 * force[i] * (now[0, i] - before[0, i])
        if rows.row[i].kind == LOAD:
            energy[LOADED] -= work
        else:
            by_errors = 0.5 * force[i] * h * error_rate(rows, i, rates)
            energy[LOST] += work + by_errors
            energy[PARAMETRIC] += by_errors


@njit(**INNER)
def _cross(force, other_force, now, before, n):
    """¼ Σ ΔF (δ⁺ − δ) of n rows, J, ΔF being their forces at the motion of their own step (force)
    minus those at the motion of the other one of the last two steps (other_force), N."""
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
    """Set kinetic and elastic energy of modes; returns the energy lost by modal damping, J."""
    kinetic = elastic = dissipated = 0.0
    for j in range(modal.omega2.shape[0]):
        v, q = modes.free_rate[j], modes.free[j]
        kinetic += 0.5 * v * v
        elastic += 0.5 * modal.omega2[j] * q * q
        dissipated += modal.damping[j] * 0.5 * (v + state.velocity[j]) * (q - state.eta[j])
    energy[KINETIC], energy[ELASTIC] = kinetic, elastic
    return dissipated


@njit(**PART)
def motion_before(active, level, eta, spare, dofs, force):
    """Motion Φη + R f of the active dofs at the last step, in ``dofs.before``; force (n_c,): f of
    that step; spare (≥ n,): work space."""
    put(spare, eta)
    motions(active, spare, spare, dofs.before, dofs.before)
    for d in range(active.counts[0].dofs):
        dofs.motion[d] = force[active.channel[d]]
    add_residual(active, level, dofs.motion, dofs.image, dofs.before)


@njit(**INNER)
def settle(laws, modal, h, channels, count, n, state, work, ledger):
    """Update the energies for one step of h s from ``state`` to the modal motion in
    ``work.modes.free``.

    work.dofs: motion of the active dofs at the last step (``before``) and this one (``motion``),
    and R f (``image``). n, count: numbers of rows and elements without machines.
    """
    rows, dofs, active = work.rows, work.dofs, work.active
    modes, space, problem, energy = work.modes, work.space, work.problem, state.energy
    booked, last, lost = ledger.booked[0], ledger.rows, ledger.lost
    now, before, last_delta, ports = ledger.now, ledger.before, ledger.delta, state.ports
    force, torque, delta = problem.force, modes.ports.torque, problem.motion[0, :n]
    dissipated = _book_modes(modal, state, modes, energy)
    for d in range(active.counts[0].dofs):
        energy[ELASTIC] += 0.5 * dofs.force[d] * dofs.image[2 * d + 1]
    put(now[0], delta)
    between = neighbour_energy(rows, n, force)
    potential = between + _potential(laws, rows, count, now, space, lost[HELD])
    for i in range(n):
        lost[FRESH, i] = force[i] - lost[HELD, i]
    if booked.rows >= 0:
        for t in range(ports.shape[0]):
            work_at_port = 0.5 * (torque[t] + ports[t].torque) * (dofs.motion[t] - dofs.before[t])
            if t < ports.shape[0] - 1:
                energy[INPUT] += work_at_port
            else:
                energy[BRAKE] -= work_at_port
        energy[DAMPING] += dissipated
        _approach(rows, n, dofs.before, before)
        _book_work(rows, lost[FRESH], now, before, n, h, work.error_rates, energy)
        new_rows_before = between + _potential(laws, rows, count, before, space, lost[SPARE])
        cross = _cross(lost[HELD], lost[SPARE], now, before, n)
        place_rows(active, channels, last, booked.rows, ZERO)
        _approach(last, booked.rows, dofs.motion, now)
        put(before[0], last_delta[: booked.rows])
        _book_work(last, lost[LAST], now, before, booked.rows, h, ledger.error_rates, energy)
        _potential(laws, last, booked.elements, before, space, lost[HELD])
        old_rows_now = booked.between
        old_rows_now += _potential(laws, last, booked.elements, now, space, lost[SPARE])
        cross += _cross(lost[HELD], lost[SPARE], now, before, booked.rows)
        change = potential + new_rows_before - old_rows_now - booked.potential
        energy[PARAMETRIC] += 0.5 * change - cross
    energy[ELEMENTS] = potential
    put(lost[LAST], lost[FRESH])
    put(ledger.error_rates, work.error_rates)
    put(last_delta, delta)
    _copy_rows(rows, n, count, last)
    booked.rows, booked.elements = n, count
    booked.potential, booked.between = potential, between
