"""From what an analysis of a train returns to a labelled dataset.

Displacements are elastic: rolling of the undeflected train is taken off. Central members are given
in the axes of their stage's carrier, planets in their own (radial, tangential, axial).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from flexgear.analysis.equilibrium import Equilibrium
from flexgear.analysis.recovery import Recovery
from flexgear.analysis.transient import Transient
from flexgear.coupling.modal import ModalSystem, chosen_modal
from flexgear.coupling.pace import Pace, train_pace
from flexgear.coupling.system import System
from flexgear.gears.power_flow import PowerFlow, power_flow
from flexgear.model.case import Case
from flexgear.results.dataset import provenance
from flexgear.results.train_dataset import train_dataset
from flexgear.results.train_sharing import DEFINITIONS, sharing_histories
from flexgear.studies.train_angles import given_speeds
from flexgear.studies.train_labels import GearMeshes, gear_meshes_of, rated_forces

Array = NDArray[np.float64]
NODES = {"shaft": "sun", "carrier": "drive"}  # nodes that stand for bodies of a flexible stage


@dataclass(frozen=True)
class TrainContext:
    """A train put together: what every dataset of it needs.

    variant: what bends in it; gear_meshes, rated: as results name them, and their mean forces
    (G,) N; made: its modes where they are known already.
    """

    train: Case
    flow: PowerFlow
    system: System
    variant: str
    gear_meshes: GearMeshes
    rated: Array
    made: ModalSystem | None = None

    @cached_property
    def pace(self) -> Pace:
        """Steps, samples and modes that follow from the train."""
        return train_pace(self.train)

    @cached_property
    def modal(self) -> ModalSystem:
        """The coupled train in the modes that ``solver`` asks for; InputError without load."""
        self.train.require_load()
        return self.made or chosen_modal(self.system, self.pace)


def context_of(train: Case, coupled: ModalSystem | System, variant: str = "lumped") -> TrainContext:
    """What datasets of a coupled train need; its modes are only made where they are asked for."""
    made = coupled if isinstance(coupled, ModalSystem) else None
    system = coupled if isinstance(coupled, System) else coupled.system
    flow, gear_meshes = power_flow(train), gear_meshes_of(train, system)
    rated = rated_forces(flow, gear_meshes.names)
    return TrainContext(train, flow, system, variant, gear_meshes, rated, made)


def transient_data(context: TrainContext, result: Transient, **attrs: Any) -> xr.Dataset:
    """Dataset of a transient; attrs are added to the provenance."""
    torques = result.torques.copy()
    torques[:, -1] = -result.output_torque  # the brake's, as it acts on the member
    arrays = {"master_speed": result.masters[:, :, 1]}
    return _dataset(context, "time", result.time, result, torques, arrays, attrs)


def equilibrium_data(context: TrainContext, result: Equilibrium, **attrs: Any) -> xr.Dataset:
    """Dataset of equilibria, one position after the other."""
    count = np.arange(len(result.masters))
    return _dataset(context, "position", count, result, result.torques, {}, attrs)


def _dataset(
    context: TrainContext,
    dim: str,
    samples: ArrayLike,
    result: Equilibrium | Transient,
    torques: Array,
    arrays: dict[str, Any],
    attrs: dict[str, Any],
) -> xr.Dataset:
    force = context.gear_meshes.forces(result.pair_load)
    masters = result.masters if result.masters.ndim == 2 else result.masters[:, :, 0]
    motions, labels = _motions(context, result)
    return train_dataset(
        dim,
        samples,
        {
            "master_angle": masters,
            "port_torque": torques,
            "gear_mesh_force": force,
            "rated_gear_mesh_force": context.rated,
            **sharing_histories(force, context.rated, context.gear_meshes.names),
            **motions,
            **arrays,
        },
        train_attrs(context, **context.modal.figures, **attrs),
        {**train_labels(context), **labels},
        context.gear_meshes.names,
    )


def train_labels(context: TrainContext) -> dict[str, list[str]]:
    """Labels of axes that only depend on the train."""
    return {
        "master": given_speeds(context.train),
        "port": [p.name for p in context.system.ports],
        "definition": list(DEFINITIONS),
    }


def train_attrs(context: TrainContext, **more: Any) -> dict[str, Any]:
    """Provenance of a result."""
    train = context.train
    return provenance(
        case=train.name,
        variant=context.variant,
        content_hash=train.content_hash(),
        parameters=train.to_dict(),
        **more,
    )


def result_name(body: str) -> str:
    """Name of a body in results: the shaft of a flexible stage carries its sun."""
    return body.replace(".shaft", ".sun")


def body_rows(system: System) -> tuple[list[str], Array]:
    """Names (n) and rows (6 n, d) of lumped bodies and of nodes that stand for those that bend."""
    names, rows = [], []
    for body in system.bodies:
        part = body.name.rpartition(".")[2]
        node = body.node_names[0] if len(body.node_names) == 1 else NODES.get(part, "")
        if node not in body.node_names or part == "output":
            continue
        names.append(result_name(body.name))
        rows.append(system.node_rows(body.name, node))
    return names, np.vstack(rows)


def _motions(
    context: TrainContext, result: Equilibrium | Transient
) -> tuple[dict[str, Array], dict[str, list[str]]]:
    """Displacements of bodies and forces of planet bearings, with their labels."""
    recovery, count = Recovery(result), len(result.theta)
    names, rows = body_rows(context.system)
    arrays = {"body_displacement": recovery.motion(rows).reshape(count, len(names), 6)}
    bearings = planet_bearings(context, recovery)
    if bearings:
        arrays["planet_bearing_force"] = np.stack(list(bearings.values()), axis=1)
        rows = recovery.row_loads(list(bearings))
        if rows.size:
            arrays["planet_bearing_row_load"] = rows
    return arrays, {"body": names, "bearing": list(bearings)}


def planet_bearings(context: TrainContext, recovery: Recovery) -> dict[str, Array]:
    """Forces (t, 3) of planets on their pins, radial, tangential, axial, N, by bearing."""
    found = {}
    for link in context.system.links:
        if ".planet_bearing_" not in link.name:
            continue
        # links pull the pin towards the planet: pin − planet is their motion
        found[link.name] = -recovery.link_force(link.name)[:, :3]
    return found
