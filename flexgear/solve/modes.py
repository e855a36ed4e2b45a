"""Natural modes of a train by type and energy."""

from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy import linalg

from flexgear.analysis.excitation import ABSENT, MIXED, UNEVEN, nodal_indices
from flexgear.analysis.modes import PARTS, ContactSprings, classify, strain_shares
from flexgear.arrays import Array
from flexgear.coupling.pair_data import BEARING, SUPPORT
from flexgear.model.errors import InputError
from flexgear.results.labelled_dataset import labelled_dataset
from flexgear.solve.dataset import body_rows, result_attrs, result_name
from flexgear.solve.model import Model


def modes(model: Model, *, angle: float | None = None, limit_hz: float | None = None) -> xr.Dataset:
    """Dataset of the undamped modes at zero speed.

    angle: rotation of the reference member, rad, at which the stiffness of gear meshes is taken; if
    left out it is the mean over their cycles. limit_hz: highest frequency, None for all.
    InputError for an angle in a train without rated speed.
    """
    system = model.system
    if angle and not system.input_speeds:
        problem = "give no speed of a free rotation, which has an angle"
        raise InputError(model.case.source, "inputs", problem, "look at the modes at angle 0")
    natural = model.natural_modes(limit_hz, angle)
    rigid = int(np.sum(natural.frequencies == 0.0))
    kinds = classify(natural.frequencies, natural.shapes, system.mass, system.bodies, rigid=rigid)
    springs = strain_shares(contributions(model, model.contact_springs(angle)), kinds.shapes)
    names, rows = body_rows(system)
    count = len(natural.frequencies)
    state: dict[str, Any] = {"gear_mesh_stiffness": "mean over the gear-mesh cycle"}
    if angle is not None:
        state = {"gear_mesh_stiffness": "at one angle", "angle_rad": angle}
    return labelled_dataset(
        "mode",
        np.arange(1, count + 1),
        {
            "frequency": natural.frequencies,
            "type": np.array(kinds.kinds, dtype=str),
            "multiplicity": kinds.multiplicity,
            "kinetic_energy": np.column_stack(list(kinds.bodies.values())),
            "motion_energy": np.column_stack([kinds.shares[p] for p in PARTS]),
            "strain_energy": np.column_stack(list(springs.values())),
            "nodal_index": nodal_index(model, kinds.shapes),
            "mode_shape": (rows @ kinds.shapes).T.reshape(count, len(names), 6),
        },
        result_attrs(model, **state),
        {
            "body": names,
            "inertia": [result_name(body) for body in kinds.bodies],
            "motion": list(PARTS),
            "spring": list(springs),
            "turning_stage": [stage.name for stage in model.case.stages],
        },
    )


def nodal_index(model: Model, shapes: Array) -> NDArray[np.int64]:
    """``nodal_indices`` of modes (d, m) in every stage, (m, stages)."""
    columns = [
        nodal_indices(model.system, shapes, stage.name, stage.planet_angles)
        for stage in model.case.stages
    ]
    return np.stack(columns, axis=1)


def index_word(index: int) -> str:
    """A nodal index or its code as text: "2", "mixed", "at rest", "uneven planets"."""
    return {MIXED: "mixed", ABSENT: "at rest", UNEVEN: "uneven planets"}.get(index, f"{index}")


def usual_limit(model: Model) -> float | None:
    """Highest frequency of a list of modes, Hz: that of the band of interest with flexible bodies,
    else None for all modes."""
    rigid = all(body.rigid for body in model.system.bodies)
    return None if rigid else model.pace.band


def contributions(model: Model, contact: ContactSprings) -> dict[str, tuple[Array, Array]]:
    """All springs of the train by name: rows (k, d) and matrix (k, k), for strain energies."""
    system = model.system
    shares: dict[str, tuple[Array, Array]] = {}
    for link in system.links:
        shares[link.name] = (link.rows, link.matrix)
    for g, name in enumerate(model.gear_meshes.names):
        flanks = [contact.gear_meshes[m] for m in np.flatnonzero(model.gear_meshes.sign[:, g])]
        rows = np.vstack([flank.rows for flank in flanks])
        matrix = linalg.block_diag(*(flank.matrix for flank in flanks))
        shares[f"{name.group} gear mesh {name.planet}"] = rows, matrix
    for support in dict.fromkeys(system.support_names):
        at = [k for k, other in enumerate(system.support_names) if other == support]
        turning = contact.others[SUPPORT]
        rows, matrix = turning.rows[at], turning.matrix[np.ix_(at, at)]
        if support in shares:
            constant_rows, constant = shares[support]
            rows, matrix = np.vstack([constant_rows, rows]), linalg.block_diag(constant, matrix)
        shares[support] = rows, matrix
    if BEARING in contact.others:
        bearings = contact.others[BEARING]
        shares["bearings with clearance"] = bearings.rows, bearings.matrix
    for body in system.bodies:
        if not body.rigid:
            place = np.zeros((body.size, system.size))
            place[:, system.slice_of(body.name)] = np.eye(body.size)
            shares[body.name] = (place, body.stiffness)
    return shares


def mode_rows(data: xr.Dataset) -> list[dict[str, Any]]:
    """Modes as dictionaries, for JSON."""
    kinetic, strain, index = data["kinetic_energy"], data["strain_energy"], data["nodal_index"]
    return [
        {
            "frequency_hz": float(data["frequency"][k]),
            "type": str(data["type"][k].item()),
            "multiplicity": int(data["multiplicity"][k]),
            "kinetic_energy": kinetic[k].to_series().to_dict(),
            "strain_energy": strain[k].to_series().to_dict(),
            "nodal_index": {
                stage: index_word(value) for stage, value in index[k].to_series().items()
            },
        }
        for k in range(data.sizes["mode"])
    ]


def top_shares(shares: dict[str, float]) -> list[tuple[str, float]]:
    """The three largest shares of at least 0.5 %, those of planets (numbered names) added up."""
    summed: dict[str, float] = {}
    for name, share in shares.items():
        kind = name.rstrip("0123456789").rstrip("_ ")
        by_planet = kind != name and kind.endswith(("planet", "planet_bearing", "gear mesh"))
        label = kind if by_planet else name
        summed[label] = summed.get(label, 0.0) + share
    ranked = sorted(summed.items(), key=lambda item: -item[1])
    return [(n, s) for n, s in ranked[:3] if s >= 0.005]
