"""From what an analysis returns to a labelled dataset of the stage.

Displacements are elastic: rolling of the undeflected train is taken off. Ring teeth are given in
global axes, carrier nodes and sun in the carrier's, planets in their own (radial, tangential,
axial). Gear-mesh forces count the working flank less the back flank.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from flexgear.analysis.equilibrium import Equilibrium
from flexgear.analysis.recovery import Recovery
from flexgear.analysis.transient import Transient
from flexgear.coupling.pair_data import KINDS, by_kind
from flexgear.gears.kinematics import rated_flow
from flexgear.model.flexible_stage import FlexibleStage
from flexgear.results.dataset import equilibrium_dataset, provenance, transient_dataset
from flexgear.studies.stepping import step_attributes

Array = NDArray[np.float64]


def transient_of(
    case: FlexibleStage, result: Transient, energy: bool | None = None, **attrs: Any
) -> xr.Dataset:
    """Dataset of a transient; attrs are added to the provenance. energy: whether it has an account
    of energy (None: look)."""
    arrays = {
        "carrier_angle": result.carrier_angle,
        "carrier_speed": result.carrier_speed,
        "input_torque": result.input_torque,
        "output_torque": result.output_torque,
        "output_speed": result.output_speed,
        **_pairs(result),
        **_motions(result),
    }
    if energy is None:
        energy = any(np.any(v) for v in result.energy.values())
    if energy:
        arrays |= {f"energy_{name}": value for name, value in result.energy.items()}
    return transient_dataset(
        time=result.time,
        attrs=_attrs(case, result, **step_attributes(result.steps), **attrs),
        rated_mean_force=rated_flow(case).ring_gear_mesh_force,
        planet_angle=case.stage.planet_angles,
        **arrays,
    )


def equilibrium_of(case: FlexibleStage, result: Equilibrium, **attrs: Any) -> xr.Dataset:
    """Dataset of equilibria, one position after the other."""
    return equilibrium_dataset(
        attrs=_attrs(case, result, **attrs),
        rated_mean_force=rated_flow(case).ring_gear_mesh_force,
        planet_angle=case.stage.planet_angles,
        carrier_angle=result.carrier_angle,
        input_torque=result.input_torque,
        output_torque=result.output_torque,
        closure=result.closure,
        **_pairs(result),
        **_motions(result),
    )


def _attrs(case: FlexibleStage, result: Equilibrium | Transient, **more: Any) -> dict[str, Any]:
    system = result.modal.system
    return provenance(
        case=case.name,
        variant=system.variant.label,
        content_hash=case.content_hash(),
        parameters=case.to_dict(),
        contact_law=case.gear_mesh.contact_law,
        tie=f"{case.ring.tie}, {case.ring.tie_kind}",
        pair_stiffness=case.gear_mesh.pair_stiffness,
        **result.modal.figures,
        **system.header,
        **more,
    )


def _pairs(result: Equilibrium | Transient) -> dict[str, Array]:
    """Arrays of all tooth pairs by flank, and the gear-mesh forces."""
    out: dict[str, Array] = {}
    planets = result.modal.system.planets
    load, tooth, stiffness, position = (
        by_kind(values, planets)
        for values in (
            result.pair_load,
            result.pair_tooth,
            result.pair_stiffness,
            result.pair_position,
        )
    )
    for g in range(load.shape[1]):
        start = f"{KINDS[g]}_pair"
        out[f"{start}_load"] = load[:, g]
        out[f"{start}_tooth"] = (tooth[:, g] + 1).astype(np.int16)
        out[f"{start}_stiffness"] = stiffness[:, g]
        out[f"{start}_position"] = position[:, g]
    for kind in ("ring", "sun"):
        force = out[f"{kind}_pair_load"].sum(axis=-1)
        if f"{kind}_back_pair_load" in out:
            force = force - out[f"{kind}_back_pair_load"].sum(axis=-1)
        out[f"{kind}_gear_mesh_force"] = force
    return out


def _motions(result: Equilibrium | Transient) -> dict[str, Any]:
    """Motions of nodes and forces of links, recovered from modal coordinates and pair loads."""
    recovery, system = Recovery(result), result.modal.system
    ring, carrier = system.body("ring"), system.body("carrier")
    teeth = [n for n in ring.node_names if n.startswith("tooth")]
    rows = np.vstack([system.node_rows("ring", n)[:3] for n in teeth])
    samples = len(result.carrier_angle)
    nodes = list(carrier.node_names)
    carrier_rows = np.vstack([system.node_rows("carrier", n) for n in nodes])
    carrier_motion = recovery.motion(carrier_rows).reshape(samples, len(nodes), 6)
    planets = range(1, system.planets + 1)
    pins = [nodes.index(f"pin_{i}") for i in planets]
    position = np.array([ring.position(n) for n in teeth])
    bolts = [link.name for link in system.links if link.name.startswith("bolt")]
    others = [link.name for link in system.links if not link.name.startswith("bolt")]
    out: dict[str, Any] = {
        "tooth_displacement": recovery.motion(rows).reshape(samples, len(teeth), 3),
        "tooth_angle": np.mod(np.arctan2(position[:, 1], position[:, 0]), 2 * np.pi),
        "carrier_displacement": carrier_motion,
        "carrier_node": nodes,
        "pin_displacement": carrier_motion[:, pins],
        "planet_displacement": np.stack(
            [recovery.node(f"planet_{i}", f"planet_{i}") for i in planets], axis=1
        ),
        "sun_displacement": recovery.node("shaft", "sun"),
    }
    if bolts:
        force = [recovery.link_force(name)[:, :3] for name in bolts]
        out["bolt_force"] = np.stack(force, axis=1)
    if others:
        out["bearing_force"] = np.stack([recovery.link_force(n) for n in others], axis=1)
        out["bearing"] = others
    row_loads = recovery.row_loads([f"planet_bearing_{i}" for i in planets])
    if row_loads.size:
        out["planet_bearing_row_load"] = row_loads
    return out
