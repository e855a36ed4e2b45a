"""Vibration from the start of a transient: how long it decays, and a start in steady motion.

A transient starts from the equilibrium at its first position with the velocity of rigid rotation.
Equilibria over a gear-mesh cycle of a stage, projected on natural modes (φᵀMφ = 1, mean stiffness
of the gear meshes), are η_s(t) = Re Σ_l η_l e^{ilωt}. The steady motion of mode j to such a load is

    η(t) = Re Σ_l η_l H_l e^{ilωt},   H_l = ω_j²/(ω_j² − l²ω² + i l ω γ_j),   γ_j = 2 ζ_j ω_j,

with γ_j by structural damping, dampers, brakes and tooth pairs. Its difference from the initial
state, Δη = η_s(0) − η(0) and Δη̇ = −η̇(0), vibrates freely with the amplitude
A = √(Δη² + ((Δη̇ + γΔη/2)/ω_j)²) e^{−γt/2}. In the force of a gear mesh with mean stiffness k̄ and
row v, two values one gear-mesh period P apart differ by

    D_j(t) = k̄ |vᵀφ_j| |1 − e^{−iω_j P}| A e^{−γ_j t/2},

which ``results.settling`` compares with the peak-to-peak of the steady force; likewise in the
radial displacements of bodies, with their rows in the place of k̄ v. Amplitudes of modes add, as
modes beat. Other stages keep their mean stiffness. First order in the variation, without loss of
contact.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from flexgear.analysis.equilibrium import revolution
from flexgear.analysis.excitation import decay
from flexgear.arrays import Array
from flexgear.results.settling import MIN_RANGE, MIN_RELATIVE, SHARE
from flexgear.solve.angles import lead_speed, one_turn, stage_motions
from flexgear.solve.dataset import body_rows
from flexgear.solve.model import Model, rated_rotations
from flexgear.solve.modes import usual_limit

POSITIONS = 24  # equilibria in a gear-mesh cycle


@dataclass(frozen=True)
class _Vibration:
    """Vibration from the start in the gear-mesh cycle of a stage, of m modes.

    shares (r, m): D_j(0) of each quantity over its steady peak-to-peak; offset (m,): Δη; velocity
    (m,): η̇(0), 1/s.
    """

    shares: Array
    offset: Array
    velocity: Array


def decay_duration(model: Model, span: float) -> float:
    """``span``, s, or the longer duration by the middle of which vibration of every damped mode
    from the start has decayed to SHARE of the steady peak-to-peak of any gear-mesh force."""
    omega, shapes, rates = _elastic_modes(model)
    longest = span
    for vibration in _vibrations(model, omega, shapes, rates, displacements=False):
        left = vibration.shares.max(axis=0)
        slow = (left > SHARE) & (rates > 0.0)
        longest = max([longest, *(4.0 / rates[slow] * np.log(left[slow] / SHARE))])
    return float(longest)


def steady_start(
    model: Model, span: float, torque_share: float = 1.0
) -> tuple[Array, Array] | None:
    """Steady motion less equilibrium at the start, to first order: displacement and velocity (k,)
    of the coordinates of ``modal``; None where a run of ``span`` s from equilibrium settles.

    It does not settle, by ``results.settling``, where vibration decays from the third to the last
    quarter by more than 2 SHARE of the steady peak-to-peak of a gear-mesh force or of a radial
    displacement of a body; amplitudes of modes add. torque_share: of rated torque.
    """
    omega, shapes, rates = _elastic_modes(model)
    vibrations = list(_vibrations(model, omega, shapes, rates, torque_share=torque_share))
    if all(_last_decay(v.shares, rates, span) <= 2.0 * SHARE for v in vibrations):
        return None
    to_coordinates = shapes.T @ (model.system.mass @ model.modal.modes)
    offset = sum(v.offset for v in vibrations)
    return -offset @ to_coordinates, sum(v.velocity for v in vibrations) @ to_coordinates


def _elastic_modes(model: Model) -> tuple[Array, Array, Array]:
    """Frequencies ω (m,) rad/s, shapes (d, m) and rates of decay γ (m,) 1/s of elastic modes."""
    modes = model.natural_modes(usual_limit(model))
    elastic = modes.frequencies > 0.0
    dampers = model.modal.structural_damping @ modes.shapes
    structural = np.einsum("dm,dm->m", modes.shapes, dampers)
    rates = decay(structural, modes, model.mean_springs.cycles)[elastic]
    return 2 * np.pi * modes.frequencies[elastic], modes.shapes[:, elastic], rates


def _last_decay(shares: Array, rates: Array, span: float) -> float:
    """Largest Σ_j D_j(T/2) − D_j(3T/4) of any row of shares D_j(0) (r, m); rates γ (m,) 1/s."""
    return float((shares @ (np.exp(-rates * span / 4) - np.exp(-3 * rates * span / 8))).max())


def _vibrations(
    model: Model,
    omega: Array,
    shapes: Array,
    rates: Array,
    *,
    torque_share: float = 1.0,
    displacements: bool = True,
) -> Iterator[_Vibration]:
    """Vibration from the start for each stage that turns, at a share of rated torque; quantities:
    gear-mesh forces, and radial displacements of bodies, if ``displacements``. omega (m,) rad/s,
    shapes (d, m), rates γ (m,) 1/s."""
    system, cycles = model.system, model.mean_springs.cycles
    loaded = [g for g, m in enumerate(model.gear_meshes.carrying) if int(m) in cycles]
    carrying = [cycles[int(model.gear_meshes.carrying[g])] for g in loaded]
    if not carrying:
        return
    force = np.stack([(c.force.mean(axis=0) @ c.blocks) @ shapes for c in carrying])  # k̄ vᵀφ
    elastic = shapes - system.rolling @ (system.input_rows @ shapes)  # as results have it
    radial = (body_rows(system)[1] @ elastic).reshape(-1, 6, len(omega))[:, :2]
    radial = radial.reshape(-1, len(omega))
    slowest = min(s.gear_mesh_frequency for s in model.flow.stages if s.gear_mesh_frequency)
    over_period = np.abs(1.0 - np.exp(-1j * omega / slowest))
    to_modes = shapes.T @ (system.mass @ model.modal.modes)
    lead = lead_speed(model.case, model.flow)
    for stage in stage_motions(model.case, model.flow):
        if not stage.theta:
            continue
        at = rated_rotations(system, one_turn(stage, lead, POSITIONS, 1))
        equilibria = revolution(model.modal, at, torque_share * system.rated_torque)
        motion = equilibria.eta @ to_modes.T
        rate = 2 * np.pi * stage.gear_mesh_frequency * np.arange(POSITIONS // 2 + 1)[:, None]
        response = omega**2 / (omega**2 - rate**2 + 1j * rate * rates)
        harmonics = np.fft.rfft(motion, axis=0)
        steady = np.fft.irfft(harmonics * response, POSITIONS, axis=0)
        velocity = np.fft.irfft(1j * rate * harmonics * response, POSITIONS, axis=0)[0]
        offset = motion[0] - steady[0]
        amplitude = np.hypot(offset, (0.5 * rates * offset - velocity) / omega)
        total = model.gear_meshes.forces(equilibria.pair_load)[:, loaded]
        total = total + (steady - motion) @ force.T
        watched = [(force, total), (radial, steady @ radial.T)][: 1 + displacements]
        shares = np.concatenate([_over_steady(*x) for x in watched]) * (amplitude * over_period)
        yield _Vibration(shares, offset, velocity)


def _over_steady(rows: Array, steady: Array) -> Array:
    """|rows| (r, m) over the peak-to-peak of the steady values (positions, r), which counts as
    large as ``results.settling`` takes it at least."""
    width = np.ptp(steady, axis=0)
    least = max(MIN_RANGE * width.max(), MIN_RELATIVE * np.abs(steady).max())
    width = np.maximum(width, least)[:, None]
    return np.divide(np.abs(rows), width, out=np.zeros_like(rows), where=width > 0.0)
