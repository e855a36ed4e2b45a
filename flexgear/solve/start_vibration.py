"""Vibration from the start of a transient, and the duration in which it decays.

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
GROWTH = 1.1  # from a duration to the next that is tried


def decay_duration(model: Model, span: float, whole: bool = False) -> float:
    """``span``, s, or the longer duration in which vibration from the start decays, from the third
    to the last quarter, by no more than SHARE of the steady peak-to-peak of any gear-mesh force,
    and of any radial displacement of a body; amplitudes of modes add.

    It is longer only where that is more than 2 SHARE for ``span``, by which ``results.settling``
    tells that a run has not settled. With ``whole`` it is the longer duration by the middle of
    which all vibration of every damped mode has decayed to SHARE, in gear-mesh forces alone.
    """
    modes = model.natural_modes(usual_limit(model))
    elastic = modes.frequencies > 0.0
    dampers = model.modal.structural_damping @ modes.shapes
    structural = np.einsum("dm,dm->m", modes.shapes, dampers)
    rates = decay(structural, modes, model.mean_springs.cycles)[elastic]
    omega, shapes = 2 * np.pi * modes.frequencies[elastic], modes.shapes[:, elastic]
    longest = span
    for shares in _shares(model, omega, shapes, rates, displacements=not whole):
        if whole:
            left = shares.max(axis=0)
            slow = (left > SHARE) & (rates > 0.0)
            longest = max([longest, *(4.0 / rates[slow] * np.log(left[slow] / SHARE))])
            continue
        largest = _last_decay(shares, rates, span)
        while largest > (2.0 * SHARE if longest == span else SHARE):
            longest *= GROWTH
            largest = _last_decay(shares, rates, longest)
    return float(longest)


def _last_decay(shares: Array, rates: Array, span: float) -> float:
    """Largest Σ_j D_j(T/2) − D_j(3T/4) of any row of shares D_j(0) (r, m); rates γ (m,) 1/s."""
    return float((shares @ (np.exp(-rates * span / 4) - np.exp(-3 * rates * span / 8))).max())


def _shares(
    model: Model, omega: Array, shapes: Array, rates: Array, displacements: bool
) -> Iterator[Array]:
    """For each stage that turns: D_j(0) (r, m) of gear-mesh forces, and of radial displacements of
    bodies, if ``displacements``, over the steady peak-to-peak of each. omega (m,) rad/s, shapes
    (d, m), rates γ (m,) 1/s."""
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
        equilibria = revolution(model.modal, at, system.rated_torque)
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
        yield np.concatenate([_over_steady(*x) for x in watched]) * (amplitude * over_period)


def _over_steady(rows: Array, steady: Array) -> Array:
    """|rows| (r, m) over the peak-to-peak of the steady values (positions, r), which counts as
    large as ``results.settling`` takes it at least."""
    width = np.ptp(steady, axis=0)
    least = max(MIN_RANGE * width.max(), MIN_RELATIVE * np.abs(steady).max())
    width = np.maximum(width, least)[:, None]
    return np.divide(np.abs(rows), width, out=np.zeros_like(rows), where=width > 0.0)
