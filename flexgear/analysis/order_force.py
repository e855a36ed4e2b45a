r"""Gear-mesh force that an order of the gear-mesh frequency raises in modes that it meets exactly.

The stiffness of gear mesh m varies about its mean as Re Σ_l k_l e^{ilψ}. Under its mean force F̄ it
is closed by x̄ = F̄/k̄, so that order l pushes the bodies with g_l x̄ (g_l: force of the rows on all
coordinates per metre, ``FlankCycle``). Modes j of one frequency answer at it with

    η_j = Σ_m φ_jᵀ g_{m,l} x̄_m / (ω_j γ_j),   γ_j = 2 ζ_j ω_j,

which raises the force k̄_m |Σ_j v_mᵀ φ_j η_j| in gear mesh m, v_m being its mean row. γ_j is the
decay of the mode: that of the springs between bodies, by their strain energy, and of tooth pairs.
First order in the variation, one group of modes, teeth that stay in contact.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexgear.analysis.contact_springs import FlankCycle
from flexgear.analysis.modes import Modes
from flexgear.coupling.system import System

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True)
class Loaded:
    """A gear mesh of a stage: its cycle, its mean force N, its planet."""

    cycle: FlankCycle
    force: float
    planet: int


def decay(system: System, modes: Modes, cycles: Mapping[int, FlankCycle]) -> Array:
    """γ = 2ζω of modes (m,), 1/s."""
    shapes = modes.shapes
    strained = np.einsum("dm,dm->m", shapes, system.stiffness @ shapes)
    total = system.damping.rate(np.sqrt(np.clip(strained, 0.0, None)))
    for cycle in cycles.values():
        closing = _mean_row(cycle) @ shapes
        total = total + cycle.damping.mean() * closing**2
    return np.asarray(total)


def resonant_force(
    modes: Modes,
    rates: Array,
    gear_meshes: Sequence[Loaded],
    orders: Sequence[int],
    groups: Sequence[IntArray],
    alone: int | None = None,
) -> Array:
    """Largest force of any gear mesh over its mean one, (orders, groups); infinite without damping.

    rates: γ of the modes (m,); groups: indices of modes of one frequency; alone: the only planet
    whose gear meshes push.
    """
    omega = 2 * np.pi * modes.frequencies
    closing = np.stack([_mean_row(gear_mesh.cycle) @ modes.shapes for gear_mesh in gear_meshes])
    stiffness = np.array([gear_mesh.cycle.stiffness.mean() for gear_mesh in gear_meshes])
    mean = np.array([gear_mesh.force for gear_mesh in gear_meshes])
    out = np.zeros((len(orders), len(groups)))
    for row, order in zip(out, orders, strict=True):
        pushed = sum(
            gear_mesh.force / k * gear_mesh.cycle.harmonic_force(order)
            for gear_mesh, k in zip(gear_meshes, stiffness, strict=True)
            if alone in (None, gear_mesh.planet)
        )
        work = modes.shapes.T @ pushed
        for g, group in enumerate(groups):
            with np.errstate(divide="ignore", invalid="ignore"):
                answer = closing[:, group] @ (work[group] / (omega[group] * rates[group]))
            row[g] = np.nan_to_num(stiffness * np.abs(answer) / mean, nan=np.inf).max()
    return out


def _mean_row(cycle: FlankCycle) -> Array:
    """v (d,), closing of a gear mesh by all coordinates, weighted by its stiffness."""
    return np.asarray((cycle.force.mean(axis=0) @ cycle.blocks) / cycle.stiffness.mean())
