"""Harmonic steady state of a linear train: a check on the time stepping, and its load sharing."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from flexgear.analysis.harmonic import SteadyState
from flexgear.model.errors import FlexgearError
from flexgear.results.group_sharing import sharing_coefficients
from flexgear.results.labelled_dataset import groups_of, labelled_dataset, variable
from flexgear.results.settling import settled
from flexgear.solve.angles import lead_speed, samples_of_stage, stage_motions
from flexgear.solve.dataset import body_rows, result_attrs, result_labels
from flexgear.solve.linear import steady_harmonics, why_not_linear
from flexgear.solve.model import Model

Array = NDArray[np.float64]
CHUNK = 20_000  # times at once
SAME = 12  # digits of the highest frequency in which equal ones agree
COMPARED = 100_000  # samples of a transient beside the harmonic solution


def train_harmonic(model: Model, torque_share: float = 1.0) -> SteadyState:
    """Steady state at rated speed. FlexgearError, with the reason, where a train has none."""
    reason = why_not_linear(model.system)
    if reason is not None:
        raise FlexgearError(f"there is no harmonic steady state: {reason}")
    return steady_harmonics(model.modal, torque_share)


def harmonic_data(
    model: Model, state: SteadyState, transient: xr.Dataset | None = None
) -> xr.Dataset:
    """Amplitudes of gear-mesh forces and bodies by frequency of the errors.

    transient: its settled part, at most the last `COMPARED` samples, is fitted with the same
    frequencies and compared sample by sample; attribute ``largest_difference_of_stage`` is the
    largest over the stage's largest force.
    """
    omega, forces = _merged(state.omega, state.forces.T @ model.gear_meshes.sign)
    _, motion = _merged(state.omega, (_rows(model) @ state.motion).T)
    names, _ = body_rows(model.system)
    data = labelled_dataset(
        "harmonic",
        omega / (2 * np.pi),
        {
            "force_amplitude": np.abs(forces),
            "displacement_amplitude": np.abs(motion).reshape(len(omega), len(names), 6),
            "rated_gear_mesh_force": model.rated,
            **_coefficients(model, state),
        },
        result_attrs(model),
        {**result_labels(model), "body": names},
        model.gear_meshes.names,
    )
    if transient is None:
        return data
    rest = settled(transient, COMPARED)
    time, stepped = rest["time"].to_numpy(), rest["gear_mesh_force"].to_numpy()
    fitted = fitted_amplitudes(time, stepped, omega)
    data["stepped_force_amplitude"] = variable("stepped_force_amplitude", fitted, "harmonic")
    gap = np.abs(stepped - state.forces_at(time) @ model.gear_meshes.sign)
    by_stage = [
        _share(float(gap[:, at].max()), float(np.abs(stepped[:, at]).max()))
        for at in (model.gear_meshes.of_stage(s.name) for s in model.case.stages)
    ]
    data.attrs["largest_difference_of_stage"] = by_stage
    data.attrs["largest_difference"] = max(by_stage)
    return data


def _share(part: float, whole: float) -> float:
    """part / whole; nothing of nothing is nothing, and something of nothing all."""
    return part / whole if whole else float(part > 0)


def _rows(model: Model) -> Array:
    return body_rows(model.system)[1]


def _merged(omega: Array, values: NDArray[np.complex128]) -> tuple[Array, NDArray[np.complex128]]:
    """Frequencies once each, rising; amplitudes (K, n) of one frequency added."""
    largest = omega.max(initial=0.0) or 1.0
    _, first, place = np.unique(
        np.round(omega / largest, SAME), return_index=True, return_inverse=True
    )
    unique = omega[first]
    out = np.zeros((len(unique), values.shape[1]), dtype=complex)
    np.add.at(out, place, values)
    return unique, out


def fitted_amplitudes(time: Array, values: Array, omega: Array) -> Array:
    """Amplitudes (K, n) of Σ Re(X_k e^{iω_k t}) that fit values (t, n) best; ω = 0 is the mean."""
    turning = omega[omega > 0]
    angle = np.multiply.outer(time, turning)
    columns = np.column_stack([np.ones(len(time)), np.cos(angle), np.sin(angle)])
    coefficients = np.linalg.lstsq(columns, values, rcond=None)[0]
    k = len(turning)
    size = np.hypot(coefficients[1 : 1 + k], coefficients[1 + k :])
    out = np.zeros((len(omega), values.shape[1]))
    out[omega > 0], out[omega == 0] = size, np.abs(coefficients[0])
    return out


def _coefficients(model: Model, state: SteadyState) -> dict[str, Array]:
    """Load sharing over the error cycles of the stages, each over its own gear-mesh cycles."""
    groups: dict[str, Array] = {}
    names = model.gear_meshes.names
    motions = stage_motions(model.case, model.flow)
    for number, stage in enumerate(model.case.stages):
        if motions[number].theta == 0 or stage.planets < 2:
            continue
        samples = samples_of_stage(model.case, motions, number, None, linear=True)
        times = samples.angles / abs(lead_speed(model.case, model.flow))
        parts = [
            state.forces_at(times[first : first + CHUNK]) @ model.gear_meshes.sign
            for first in range(0, len(times), CHUNK)
        ]
        per_cycle = {s.name: 0.0 for s in model.case.stages}
        per_cycle[stage.name] = float(samples.per_gear_mesh)
        coefficients = sharing_coefficients(np.concatenate(parts), names, per_cycle)
        groups = _of_stage(groups, coefficients, model, stage.name)
    return groups


def _of_stage(
    of_others: dict[str, Array], values: dict[str, Array], model: Model, stage: str
) -> dict[str, Array]:
    """``of_others`` with what ``values`` says about one stage put in."""
    names = model.gear_meshes.names
    columns = {
        "planet_coefficient": np.array([n.stage == stage for n in names]),
        "load_sharing_coefficient": np.array([g.stage == stage for g in groups_of(names)]),
    }
    out = {**values, **of_others}
    for name, column in columns.items():
        both = np.where(
            column, values[name], of_others.get(name, np.full_like(values[name], np.nan))
        )
        out[name] = both
    return out


def harmonic_figures(data: xr.Dataset) -> dict[str, Any]:
    """Largest difference between time stepping and harmonic steady state, for summaries."""
    return {
        "frequencies_hz": [float(f) for f in data["harmonic"].to_numpy() if f > 0],
        "largest_difference": data.attrs.get("largest_difference"),
    }
