r"""Forced response of a train to its static transmission error, at mean gear-mesh stiffness.

The mean force F̄ closes a gear mesh of stiffness k(ψ) quasi-statically by x(ψ) = F̄/k(ψ) − e(ψ), e
its error at gear-mesh frequency (``FlankCycle.static_motion``: at its mean tilt). The harmonics
x_l, those of e in the dampers, and those of the moment w(ψ) of a load that moves along the face,
excite the train with its mean stiffness; in modes

    (K̄ − s² K_c − ω² + iω (C̄ + s G)) q_l = Σ_m (v_m p_{m,l} − w_{m,l}),   p = k̄ x_l − iω c̄ e_l,

ω = l ω_z, v_m the mean row of gear mesh m, s speed over rated speed. Its force varies by

    F_{m,l} = (k̄_m + iω c̄_m) v_mᵀ q_l − p_{m,l},

which vanishes at low speed in a train that is free to follow. In all modes that are not kept the
train moves in the shapes that v and w cause statically, with their inertia (``following_modes``):
without, forces at low speed, all of which are forces of inertia, would lack theirs. The share of
mode j is its term in v_mᵀ q_l (Özgüven & Houser 1988, J. Sound Vib. 125:71, for one gear pair).
Contact is not lost, orders are not coupled, and k(ψ) does not include gaps of modified flanks.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy
import xarray as xr

from flexgear.analysis.excitation import PeriodicTrain
from flexgear.analysis.flank_cycle import harmonics
from flexgear.arrays import Array, Complex
from flexgear.model.arguments import Count, Positive
from flexgear.results.labelled_dataset import labelled_dataset
from flexgear.solve.bodies import Progress, silent
from flexgear.solve.dataset import result_attrs, result_labels
from flexgear.solve.model import Model
from flexgear.solve.stability import (
    following_modes,
    kept_modes,
    speed_range,
    train_in_modes,
    turning_stages,
)

SPEEDS = 401  # number of equally spaced speeds
ZOOMS, ZOOM = 5, 9  # passes towards a peak between two speeds, and speeds of each
CROWD = 0.25 ** np.arange(1, 5)  # speeds beside a peak, in distances of the equally spaced ones
RISE = 0.01  # of a peak above its sides, over its height: less is rounding, or no resonance
LEAST_PEAK = 1e-3  # of the largest of a stage: lower ones are read at the equally spaced speeds
ROUNDING = 1e-12  # of a harmonic of the closing over its mean
ORDERS = 5  # number of orders of the gear-mesh frequency


@dataclass(frozen=True)
class _Excited:
    """The loaded gear meshes of a stage. indices (g,): among all gear meshes; rows (g, n): in
    modes; residual (g, g): closing of one by a force of another in all other modes, m/N;
    stiffness, damping (g,): k̄, c̄; closing, error (g, orders): x_l and e_l, m."""

    indices: list[int]
    rows: Array
    stiffness: Array
    damping: Array
    closing: Complex
    error: Complex
    shift: Complex


def linear_response(
    model: Model,
    speeds: tuple[float, float] | None = None,
    *,
    count: Count = SPEEDS,
    orders: Count = ORDERS,
    limit_hz: Positive | None = None,
    progress: Progress = silent,
) -> xr.Dataset:
    """Forced response to the static transmission error at mean gear-mesh stiffness: amplitudes of
    forces and transmission errors by order over speed, each stage excited by its gear meshes, and
    the share of every mode in each peak.

    speeds, limit_hz: see ``stability``; count: number of equally spaced speeds, to which peaks add
    more; orders: number of orders of the gear-mesh frequency.
    """
    model.case.require_load()
    first, last = speed_range(model, speeds)
    numbers, shapes, omega = kept_modes(model, limit_hz, None)
    names = model.gear_meshes.names
    stages = [s.name for s in turning_stages(model)]
    excitations = [_excitation(model, stage, shapes, omega, orders) for stage in stages]
    spaced, more = np.linspace(first, last, count), list[float]()
    for train, excited in excitations:
        more += _near_peaks(train, excited, spaced, orders)
    factors = np.union1d(spaced, more)
    count = len(factors)
    force = np.zeros((count, len(names), orders))
    motion, static = np.zeros_like(force), np.zeros((len(names), orders))
    peaks: list[dict[str, Any]] = []
    for done, (train, excited) in enumerate(excitations):
        static[excited.indices] = np.abs(excited.closing)
        for order in range(1, orders + 1):
            amplitudes, parts, closing = _over_speed(train, excited, factors, order)
            force[:, excited.indices, order - 1] = np.abs(amplitudes)
            motion[:, excited.indices, order - 1] = np.abs(closing)
            for g, index in enumerate(excited.indices):
                for k in _peaks(np.abs(amplitudes[:, g])):
                    peak = amplitudes[k, g]
                    share = (parts[k, g, : len(omega)] * np.conj(peak)).real / abs(peak) ** 2
                    place = {"factor": factors[k], "gear_mesh": names[index], "order": order}
                    peaks.append({**place, "force": abs(peak), "mode_share": share})
        progress("speeds", (done + 1) / len(stages))
    peaks.sort(key=lambda peak: -peak["force"])
    types = {"gear_mesh": str, "order": np.int64}
    columns: dict[str, Any] = {
        f"peak_{name}": np.array([peak[name] for peak in peaks], dtype=types.get(name, float))
        for name in ("factor", "gear_mesh", "order", "force")
    }
    shares = np.array([peak["mode_share"] for peak in peaks]).reshape(-1, len(omega))
    arrays = {
        "linear_force_amplitude": force,
        "linear_transmission_error_amplitude": motion,
        "static_transmission_error_amplitude": static,
        "kept_frequency": omega / (2 * np.pi),
        **columns,
        "peak_mode_share": shares,
    }
    labels = {**result_labels(model), "kept_mode": numbers.tolist()}
    return labelled_dataset("speed_factor", factors, arrays, result_attrs(model), labels, names)


def _excitation(
    model: Model, stage: str, shapes: Array, omega: Array, orders: int
) -> tuple[PeriodicTrain, _Excited]:
    """The train in modes (see ``train_in_modes``) and in the motions that the loads of a stage
    cause in all others, and these loads."""
    cycles, pairs = model.mean_springs.cycles, model.system.pairs
    indices = [
        g
        for g in model.gear_meshes.of_stage(stage)
        if int(model.gear_meshes.carrying[g]) in cycles and model.mean_forces[g] > 0.0
    ]
    rows, (closings, error) = [], np.zeros((2, len(indices), orders), dtype=complex)
    shift = np.zeros((orders, model.system.size), dtype=complex)
    flanks = [int(model.gear_meshes.carrying[g]) for g in indices]
    angle = int(pairs.angle[flanks[0]]) if flanks else 0
    system = model.system
    speed = float(system.angles[angle] @ system.rolling @ system.rated_input_speeds)
    for k, m in enumerate(flanks):
        cycle = cycles[m]
        varying, moving = cycle.static_motion()
        rows.append(cycle.mean_row @ cycle.blocks)
        closings[k] = _harmonics(varying, orders, varying)
        shift += _harmonics(moving, orders, cycle.load) @ cycle.blocks
        order = np.arange(1, pairs.error_amplitude.shape[1] + 1)
        phase = 2 * np.pi * order * pairs.s0[m] / pairs.pitch[m] + pairs.error_phase[m]
        waves = (-1j * pairs.error_amplitude[m] * np.exp(1j * phase))[:orders]
        error[k, : len(waves)] = waves if pairs.rate[m] > 0.0 else waves.conj()
    stiffness = np.array([cycles[m].stiffness.mean() for m in flanks])
    damping = np.array([cycles[m].damping.mean() for m in flanks])
    whole = np.reshape(rows, (len(indices), len(shapes)))
    loads = np.concatenate([whole, shift.real, shift.imag])
    motions, rates = following_modes(model, loads, shapes, omega)
    shapes, omega = np.hstack([shapes, motions]), np.concatenate([omega, rates])
    waves = [closings - error, error, shift @ shapes]
    if speed < 0.0:
        waves = [wave.conj() for wave in waves]
    train = train_in_modes(model, stage, shapes, omega)
    return train, _Excited(indices, whole @ shapes, stiffness, damping, *waves)


def _harmonics(values: Array, orders: int, of: Array) -> Complex:
    """Harmonics 1 … ``orders`` of values (P, …) over a cycle; those below the rounding of the
    largest of ``of`` are zero."""
    waves = harmonics(values)
    waves[np.abs(waves) < ROUNDING * np.abs(of).max()] = 0.0  # of constant stiffness
    return np.asarray(waves[1 : orders + 1])


def _peaks(forces: Array) -> list[int]:
    """Indices of the peaks of forces (s,) over speed."""
    at, sides = scipy.signal.find_peaks(forces, prominence=0.0)
    return [int(k) for k in at[sides["prominences"] > RISE * forces[at]]]


def _near_peaks(train: PeriodicTrain, excited: _Excited, spaced: Array, orders: int) -> list[float]:
    """Speed factors of the peaks of gear-mesh forces, and others beside each: with little damping a
    peak is narrower than the distance of equally spaced factors (s,)."""
    size = [np.abs(_over_speed(train, excited, spaced, n + 1)[0]) for n in range(orders)]
    least, more = LEAST_PEAK * np.max(size, initial=0.0), list[float]()
    for n, forces in enumerate(size):
        high = ((k, g) for g, row in enumerate(forces.T) for k in _peaks(row) if row[k] > least)
        peaks = {(k, *np.round(forces[k - 1 : k + 2, g] / forces[k, g], 6)): g for k, g in high}
        for (k, *_), g in peaks.items():  # one of gear meshes that pass a peak alike
            near = spaced[k - 1 : k + 2]
            for _ in range(ZOOMS):
                near = np.linspace(near[0], near[-1], ZOOM)
                top = int(np.argmax(np.abs(_over_speed(train, excited, near, n + 1)[0][:, g])))
                at, near = near[top], near[max(top - 1, 0) : top + 2]
            beside = (spaced[k] - spaced[k - 1]) * CROWD
            more += [at, *(at - beside), *(at + beside)]
    return more


def _over_speed(
    train: PeriodicTrain, excited: _Excited, factors: Array, order: int
) -> tuple[Complex, Complex, Complex]:
    """Gear-mesh forces (s, g), N, parts (s, g, n) of modes in them, N, and closings (s, g), m, at
    speed factors (s,) by one order."""
    n, mean = len(train.omega), train.stiffness.mean(axis=0)
    damping = train.damping.mean(axis=0)
    w = order * train.rate * factors
    excitation = excited.stiffness * excited.closing[:, order - 1]
    by_dampers = 1j * np.multiply.outer(w, excited.damping * excited.error[:, order - 1])
    excitation = excitation - by_dampers
    matrices = (
        mean
        - (factors**2)[:, None, None] * train.centripetal
        - (w**2)[:, None, None] * np.eye(n)
        + 1j * w[:, None, None] * (damping + factors[:, None, None] * train.gyroscopic)
    )
    on_modes = excitation @ excited.rows - excited.shift[order - 1]
    modes: Complex = np.linalg.solve(matrices, on_modes[..., None])[..., 0]
    complex_stiffness = excited.stiffness + 1j * np.multiply.outer(w, excited.damping)
    parts = complex_stiffness[:, :, None] * excited.rows * modes[:, None, :]
    force: Complex = parts.sum(axis=2) - excitation
    return force, parts, modes @ excited.rows.T
