"""Natural modes of a train by type and energy, and its Campbell diagram."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray
from scipy import linalg

from flexgear.analysis.contact_springs import ContactSprings
from flexgear.analysis.gyroscopic import Campbell, crossings, excitation_lines, whirl_sense
from flexgear.analysis.gyroscopic import campbell as whirl_over_speed
from flexgear.analysis.mode_types import (
    PARTS,
    classify,
    members,
    planar_rows,
    strain_shares,
)
from flexgear.coupling.pair_data import BEARING, SUPPORT
from flexgear.model.errors import InputError
from flexgear.results.labelled_dataset import labelled_dataset
from flexgear.solve.dataset import body_rows, result_attrs, result_name
from flexgear.solve.model import Model

Array = NDArray[np.float64]
FACTORS = np.linspace(0.0, 1.2, 13)  # of rated speed
ORDERS = (1, 2, 3)
MOST_MODES = 60  # that are followed over speed


def modes(model: Model, *, angle: float | None = None, limit_hz: float | None = None) -> xr.Dataset:
    """Undamped modes at rest with the mean stiffness of the gear meshes over their cycles.

    angle: with the gear meshes as they are at this rotation of the lead, rad, instead.
    """
    system = model.system
    if angle and not system.input_speeds:
        raise InputError(
            model.case.source, "inputs", "give no speed of a free rotation, which has an angle",
            "look at the modes at angle 0",
        )  # fmt: skip
    found = model.natural_modes(limit_hz, angle)
    rigid = int(np.sum(found.frequencies == 0.0))
    kinds = classify(
        found.frequencies, found.shapes, system.mass, members(system.bodies), rigid=rigid
    )
    springs = strain_shares(contributions(model, model.contact_springs(angle)), kinds.shapes)
    names, rows = body_rows(system)
    count = len(found.frequencies)
    return labelled_dataset(
        "mode",
        np.arange(1, count + 1),
        {
            "frequency": found.frequencies,
            "type": np.array(kinds.kinds, dtype=str),
            "multiplicity": kinds.multiplicity,
            "kinetic_energy": np.column_stack(list(kinds.bodies.values())),
            "motion_energy": np.column_stack([kinds.shares[p] for p in PARTS]),
            "strain_energy": np.column_stack(list(springs.values())),
            "mode_shape": (rows @ kinds.shapes).T.reshape(count, len(names), 6),
        },
        result_attrs(model, **_gear_mesh_state(angle)),
        {
            "body": names,
            "inertia": [result_name(body) for body in kinds.bodies],
            "motion": list(PARTS),
            "spring": list(springs),
        },
    )


def usual_limit(model: Model) -> float | None:
    """Highest frequency worth listing, Hz: the band's top where bodies bend, else all (None)."""
    rigid = all(body.rigid for body in model.system.bodies)
    return None if rigid else model.pace.band


def _gear_mesh_state(angle: float | None) -> dict[str, Any]:
    """What of the gear meshes the modes are those of."""
    if angle is None:
        return {"gear_mesh_stiffness": "mean over the gear-mesh cycle"}
    return {"gear_mesh_stiffness": "at one angle", "angle_rad": angle}


def contributions(model: Model, contact: ContactSprings) -> dict[str, tuple[Array, Array]]:
    """All springs of the train by name: rows (k, d) and matrix (k, k), for strain energies."""
    system = model.system
    found: dict[str, tuple[Array, Array]] = {}
    for link in system.links:
        found[link.name] = (link.rows, link.matrix)
    for g, name in enumerate(model.gear_meshes.names):
        flanks = [contact.gear_meshes[m] for m in np.flatnonzero(model.gear_meshes.sign[:, g])]
        rows = np.vstack([flank.rows for flank in flanks])
        matrix = linalg.block_diag(*(flank.matrix for flank in flanks))
        found[_gear_mesh_spring(name.label)] = rows, matrix
    for kind, label in ((SUPPORT, "turning supports"), (BEARING, "bearings with clearance")):
        if kind in contact.others:
            found[label] = contact.others[kind].rows, contact.others[kind].matrix
    for body in system.bodies:
        if not body.rigid:
            place = np.zeros((body.size, system.size))
            place[:, system.slice_of(body.name)] = np.eye(body.size)
            found[body.name] = (place, body.stiffness)
    return found


def _gear_mesh_spring(label: str) -> str:
    """ "stage_1 ring 2" -> "stage_1 ring gear mesh 2"."""
    group, _, planet = label.rpartition(" ")
    return f"{group} gear mesh {planet}"


def campbell(
    model: Model,
    *,
    factors: ArrayLike = FACTORS,
    orders: Sequence[float] = ORDERS,
    limit_hz: float | None = None,
) -> xr.Dataset:
    """Frequencies over speed factors and where harmonics of gear-mesh frequencies meet them.

    In the frames in which bodies are described. Where the train has no gyroscopic terms the
    frequencies do not depend on speed. limit_hz: highest frequency at rest that is followed.
    """
    system = model.system
    found = _over_speed(model, np.asarray(factors, dtype=float), limit_hz)
    lines = excitation_lines(_bases(model), orders)
    met = crossings(found, lines)
    label = {line: f"{line.name} x {line.order:g}" for line in lines}
    data = labelled_dataset(
        "speed_factor",
        found.factors,
        {
            "campbell_frequency": found.frequencies,
            "whirl": found.sense,
            "excitation_slope": [line.slope for line in lines],
            "crossing_factor": [c.factor for c in met],
            "crossing_frequency": [c.frequency for c in met],
            "crossing_mode": np.array([c.mode + 1 for c in met], dtype=np.int64),
            "crossing_excitation": np.array([label[c.line] for c in met], dtype=str),
        },
        result_attrs(model, gyroscopic=int(system.gyroscopic is not None)),
        {"excitation": [label[line] for line in lines]},
    )
    return data.assign_coords(
        excitation_stage=("excitation", [line.name for line in lines]),
        excitation_order=("excitation", [line.order for line in lines]),
    )


def _over_speed(model: Model, factors: Array, limit_hz: float | None) -> Campbell:
    """Whirl modes over speed; without forces of turning frames those at rest serve for all."""
    system, rest = model.system, model.natural_modes(limit_hz)
    planes, weights = planar_rows(system.mass, members(system.bodies))
    nothing = np.zeros_like(system.mass)
    turning = nothing if system.gyroscopic is None else system.gyroscopic
    pushing = nothing if system.centripetal is None else system.centripetal
    count = max(len(rest.frequencies), 1) if limit_hz else min(system.size, MOST_MODES)
    if np.any(turning) or np.any(pushing):
        return whirl_over_speed(
            system.mass,
            system.stiffness + model.mean_springs.stiffness,
            turning,
            pushing,
            factors,
            count=count,
            planes=planes if len(planes) else None,
            weights=weights if len(planes) else None,
        )
    times, frequencies = np.ones((len(factors), 1)), rest.frequencies[:count]
    sense = np.full(len(frequencies), np.nan)
    if len(planes):
        sense = whirl_sense(rest.shapes[:, :count].astype(complex), planes, weights)
    return Campbell(factors, frequencies * times, np.ones_like(frequencies * times), sense * times)


def _bases(model: Model) -> dict[str, float]:
    """Gear-mesh frequencies that are not zero, Hz, by stage."""
    return {s.name: s.gear_mesh_frequency for s in model.flow.stages if s.gear_mesh_frequency > 0}


def mode_rows(data: xr.Dataset) -> list[dict[str, Any]]:
    """Modes as plain rows, for programs."""
    kinetic, strain = data["kinetic_energy"], data["strain_energy"]
    return [
        {
            "frequency_hz": float(data["frequency"][k]),
            "type": str(data["type"][k].item()),
            "multiplicity": int(data["multiplicity"][k]),
            "kinetic_energy": _shares(kinetic[k], "inertia"),
            "strain_energy": _shares(strain[k], "spring"),
        }
        for k in range(data.sizes["mode"])
    ]


def _shares(values: xr.DataArray, dim: str) -> dict[str, float]:
    return {
        str(n): float(v) for n, v in zip(values[dim].to_numpy(), values.to_numpy(), strict=True)
    }


def top_shares(shares: dict[str, float], count: int = 3) -> list[tuple[str, float]]:
    """Largest shares, those of planets (names that end in a number) taken together."""
    summed: dict[str, float] = {}
    for name, share in shares.items():
        kind = name.rstrip("0123456789").rstrip("_ ")
        together = kind if kind != name and _is_planet(kind) else name
        summed[together] = summed.get(together, 0.0) + share
    ranked = sorted(summed.items(), key=lambda item: -item[1])
    return [(n, s) for n, s in ranked[:count] if s >= 0.005]


def _is_planet(kind: str) -> bool:
    return kind.endswith(("planet", "planet_bearing", "gear mesh"))


def crossing_rows(data: xr.Dataset) -> list[dict[str, Any]]:
    """Crossings of a Campbell diagram as plain rows."""
    return [
        {
            "speed_factor": float(data["crossing_factor"][k]),
            "frequency_hz": float(data["crossing_frequency"][k]),
            "mode": int(data["crossing_mode"][k]),
            "excitation": str(data["crossing_excitation"][k].item()),
        }
        for k in range(data.sizes.get("crossing", 0))
    ]
