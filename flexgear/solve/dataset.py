"""Labelled datasets of equilibria and transients.

Displacements are elastic, without the rigid rotation of the undeflected train. Those of ring teeth
are in fixed axes, of central members and carrier nodes in the axes of their stage's carrier, of
planets in planet axes (radial, tangential, axial).
"""

from collections.abc import Collection, Iterator
from functools import partial
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from flexgear.analysis.equilibrium import Equilibrium
from flexgear.analysis.recording import Recorder
from flexgear.analysis.recovery import Recovery
from flexgear.analysis.transient import Transient
from flexgear.analysis.transmission_error import dynamic_transmission_error
from flexgear.arrays import Array
from flexgear.coupling.laws.journal import CLEARANCE, JOURNAL
from flexgear.coupling.pair_data import WAVE
from flexgear.coupling.system import System
from flexgear.model.names import BodyName, NodeName
from flexgear.results.dataset_file import provenance
from flexgear.results.labelled_dataset import GEAR_MESH, fields_of, labelled_dataset
from flexgear.results.load_sharing import DEFINITIONS, sharing_histories
from flexgear.results.sinks import SENSOR_TIME
from flexgear.solve.angles import given_speeds
from flexgear.solve.face_load import face_arrays, face_labels
from flexgear.solve.model import Model, flank_name
from flexgear.solve.sensors import NODES


def transient_data(model: Model, result: Transient, **attrs: Any) -> xr.Dataset:
    """Dataset of a transient; attrs: further attributes."""
    speeds = result.input_motion[:, :, 1]
    recovery = Recovery(result, model.outputs)
    angles = model.system.angles @ model.system.rolling
    arrays = {
        "dynamic_transmission_error": dynamic_transmission_error(
            recovery, model.gear_meshes.carrying
        ),
        "input_speed": speeds,
        "inertia_torque": result.torques @ (model.system.port_rows @ model.system.rolling),
        "stage_speed": (speeds @ angles.T)[:, _stage_angles(model)],
        "port_speed": result.speeds,
        "output_speed": result.speeds[:, -1],
    }
    return _dataset(model, "time", result.time, recovery, arrays, attrs)


def equilibrium_data(
    model: Model, result: Equilibrium, only: Collection[str] = (), **attrs: Any
) -> xr.Dataset:
    """Dataset of equilibria over positions. only: names of variables that are needed, for a dataset
    without provenance; all if left out."""
    count, arrays = np.arange(len(result.input_angles)), {"closure": result.closure}
    recovery = Recovery(result, model.outputs)
    return _dataset(model, "position", count, recovery, arrays, attrs, only)


def sensor_data(model: Model, recorder: Recorder, run: Transient) -> xr.Dataset:
    """Dataset of sensor signals from the next samples of a run, over the time of the sensors."""
    sensors = model.sensors
    assert sensors is not None
    time, signals, rotations = sensors.record(recorder, Recovery(run, model.outputs))
    clock = sensors.clock
    return labelled_dataset(
        SENSOR_TIME,
        time,
        {"sensor_signal": signals, "sensor_input_angle": rotations},
        {"sensor_band_hz": clock.band, "sensor_sampling_rate_hz": clock.rate},
        {"input_coordinate": given_speeds(model.case), **sensors.labels},
    )


def _stage_angles(model: Model) -> list[int]:
    """Index of the angle of each stage among those of the system."""
    return [frame.theta for frame in model.system.frames.values()]


def _turned(model: Model, result: Equilibrium | Transient, part: str) -> Array:
    """Rotations (t, stages) of the carriers or rings in space, rad; part: "carrier" or "ring"."""
    rotation = [getattr(frame, part) for frame in model.system.frames.values()]
    return np.where(np.array(rotation) < 0, 0.0, result.theta[:, rotation])


def _dataset(
    model: Model,
    dim: str,
    samples: ArrayLike,
    recovery: Recovery,
    arrays: dict[str, Any],
    attrs: dict[str, Any],
    only: Collection[str] = (),
) -> xr.Dataset:
    """Dataset over ``samples`` of the dimension ``dim`` with the variables common to equilibria and
    transients and further ``arrays``; only: see ``equilibrium_data``."""
    result = recovery.result
    force = model.gear_meshes.forces(result.pair_load)
    motions, labels = _motions(model, recovery, only)
    loads, time = model.case.loads, np.asarray(samples) if dim == "time" else np.zeros(len(force))
    if loads:
        arrays = {**arrays, "applied_load": np.stack([load.at(time) for load in loads], axis=1)}
        labels["load"] = [f"{k} {x.member} {x.frame}" for k, x in enumerate(loads)]
    every = {
        "input_angle": result.input_angles,
        "stage_angle": result.theta[:, _stage_angles(model)],
        "carrier_angle": _turned(model, result, "carrier"),
        "ring_angle": _turned(model, result, "ring"),
        "port_torque": result.torques,
        "gear_mesh_force": force,
        "rated_gear_mesh_force": model.rated,
        **sharing_histories(force, model.rated, model.gear_meshes.names),
        **_pairs(model, result),
        **face_arrays(model, recovery, only),
        **motions,
        **arrays,
    }
    if not only:
        attrs = result_attrs(model, **model.modal.figures, **model.system.header, **attrs)
    return labelled_dataset(
        dim,
        samples,
        {name: every[name] for name in every if not only or name in only},
        attrs,
        {**result_labels(model), **_flanks(model), **face_labels(model), **labels},
        model.gear_meshes.names,
    )


def _pairs(model: Model, result: Equilibrium | Transient) -> dict[str, Array]:
    """Variables of the tooth pairs; none if all gear meshes are stiffness waves without pairs."""
    if np.all(model.system.pairs.model == WAVE):
        return {}
    return {
        "pair_load": result.pair_load,
        "pair_tooth": (result.pair_tooth + 1).astype(np.int16),
        "pair_stiffness": result.pair_stiffness,
        "pair_position": result.pair_position,
    }


def _flanks(model: Model) -> dict[str, list[Any]]:
    """Labels of the flanks of all gear meshes, in the order of the system."""
    drive = model.system.pairs.carries
    names = [flank_name(model.case, label) for label in model.system.gear_meshes]
    sense = ["drive" if is_drive else "coast" for is_drive in drive]
    return {
        "flank": [f"{name} {s}" for name, s in zip(names, sense, strict=True)],
        "flank_sense": sense,
        **fields_of(names, GEAR_MESH, "flank_"),
    }


def result_labels(model: Model) -> dict[str, list[str]]:
    """Labels of axes that only depend on the train."""
    return {
        "input_coordinate": given_speeds(model.case),
        "turning_stage": [stage.name for stage in model.case.stages],
        "port": [p.name for p in model.system.ports],
        "definition": list(DEFINITIONS),
    }


def result_attrs(model: Model, **more: Any) -> dict[str, Any]:
    """Attributes of a result: provenance, contact laws, reduction errors of FE bodies, ``more``."""
    case = model.case
    of_stages: dict[str, list[str]] = {
        "contact_law": [s.gear_mesh.contact_law for s in case.stages],
        "pair_stiffness": [s.gear_mesh.pair_stiffness for s in case.stages],
        "tie": [f"{s.ring.tie}, {s.ring.tie_kind}" for s in case.fe_ring_stages.values()],
    }
    laws = {name: "; ".join(dict.fromkeys(words)) for name, words in of_stages.items() if words}
    return provenance(case, model.variant, **laws, **_reduction_errors(model), **more)


def _reduction_errors(model: Model) -> dict[str, float]:
    """Relative static and frequency errors of the flexible reduced bodies: "stage.ring_…"."""
    return {
        f"{name}_{kind}": float(body.report[kind])
        for name, body in model.bodies.items()
        for kind in ("static_error", "frequency_error")
        if body.report.get(kind) is not None and name not in model.system.rigid_bodies
    }


def result_name(body: BodyName) -> BodyName:
    """Name of a body in results: "sun" for the shaft of a flexible stage."""
    return BodyName.of(body.stage, "sun") if body.part == "shaft" else body


def body_rows(system: System) -> tuple[list[str], Array]:
    """Names (n,) in results and rows (6 n, d) of the bodies of ``result_bodies``."""
    bodies = list(result_bodies(system))
    rows = np.vstack([system.node_rows(body, node) for _, body, node in bodies])
    return [name for name, _, _ in bodies], rows


def result_bodies(system: System) -> Iterator[tuple[str, str, str]]:
    """Name in results, body, and node that represents it, of lumped and flexible bodies."""
    for body in system.bodies:
        part = body.name.part
        single = len(body.node_names) == 1 or part == "planet"  # for FE planets their rigid motion
        node = body.node_names[0] if single else NODES.get(part, "drive")
        if node not in body.node_names or part == "output":
            continue
        yield result_name(body.name), body.name, node


def _motions(
    model: Model, recovery: Recovery, only: Collection[str]
) -> tuple[dict[str, Array], dict[str, Any]]:
    """Displacements of bodies and forces in links, with their labels; with ``only`` just forces."""
    result, count = recovery.result, len(recovery.result.theta)
    arrays, labels = dict[str, Array](), dict[str, Any]()
    if not only:
        names = [name for name, _, _ in result_bodies(model.system)]
        bodies = recovery.named("bodies", lambda: body_rows(model.system)[1])
        arrays["body_displacement"], labels["body"] = bodies.reshape(count, len(names), 6), names
    bearings, supports = planet_bearings(model), support_names(model)
    for axis, name, links, parts in (
        ("bearing", "planet_bearing_force", bearings, 3),
        ("bolt", "bolt_force", [x.name for x in model.system.links if x.kind == "bolt"], 3),
        ("support", "bearing_force", supports, 6),
    ):
        if links and (not only or name in only):
            forces = [recovery.link_force(link)[:, :parts] for link in links]
            arrays[name], labels[axis] = np.stack(forces, axis=1), links
    node_groups = (
        ("tooth", "tooth_displacement", _nodes(model, "ring", "tooth"), 3),
        ("carrier_node", "carrier_displacement", _nodes(model, "carrier"), 6),
    )
    for axis, _, nodes, _ in node_groups:
        labels |= _node_labels(model, axis, nodes) if nodes else {}
    if only:
        return arrays, labels
    if bearings:
        # the motion of these links is pin − planet, the result is the force on the pin
        arrays["planet_bearing_force"] *= -1.0
        arrays |= _films(model, recovery, bearings)
    arrays |= _row_loads(recovery, bearings, supports)
    if isinstance(result, Equilibrium) and model.sensors is not None:
        arrays["sensor_static"] = model.sensors.static(recovery)
        labels |= model.sensors.static_labels
    if isinstance(result, Equilibrium) and len(model.rim_stress):
        arrays["rim_stress"] = recovery.named("rim", lambda: model.rim_stress)
    for axis, name, nodes, dofs in node_groups:
        if nodes:
            motion = recovery.named(axis, partial(_node_rows, model.system, nodes, dofs))
            arrays[name] = motion.reshape(count, len(nodes), dofs)
    return arrays, labels


def _films(model: Model, recovery: Recovery, bearings: list[str]) -> dict[str, Array]:
    """Least film thickness (t, bearings) of the planets' plain bearings, m; empty without any."""
    films = {b.name: b for b in model.system.bearings if b.law == JOURNAL.name}
    thickness = np.full((len(recovery.result.theta), len(bearings)), np.nan)
    for i, name in enumerate(bearings):
        if name in films:
            eccentricity = recovery.motion(films[name].relative[:2])
            thickness[:, i] = films[name].parameters[CLEARANCE] - np.hypot(*eccentricity.T)
    return {"film_thickness": thickness} if films else {}


def _row_loads(recovery: Recovery, bearings: list[str], supports: list[str]) -> dict[str, Array]:
    """Loads of roller rows of planet bearings, and of all supports if any other has rollers."""
    others = [name for name in supports if name not in bearings]
    loads = {"planet_bearing_row_load": recovery.row_loads(bearings)}
    if recovery.row_loads(others).shape[2]:
        loads["bearing_row_load"] = recovery.row_loads(supports)
    return {name: rows for name, rows in loads.items() if rows.shape[2]}


def support_names(model: Model) -> list[str]:
    """Names of springs between two nodes, without bolts, and of bearings in turning frames."""
    links = [x.name for x in model.system.links if len(x.rows) == 6 and x.kind != "bolt"]
    return [*links, *_turning_bearings(model)]


def _turning_bearings(model: Model) -> list[str]:
    """Names of the bearings that are supports in turning frames, such as those of FE planets."""
    links = {link.name for link in model.system.links}
    return [x.name for x in model.system.rotating_frame_supports if x.name not in links]


def _nodes(model: Model, part: str, kind: str = "") -> list[tuple[BodyName, NodeName]]:
    """Body and node of all nodes of a kind (any if left out) of the FE bodies of a part."""
    return [
        (body, node)
        for stage in model.case.flexible_stages.values()
        for body in stage.fe_bodies
        if body.part == part
        for node in model.system.body(body).nodes
        if not kind or node.kind == kind
    ]


def _node_rows(system: System, nodes: list[tuple[BodyName, NodeName]], dofs: int) -> Array:
    """Rows of the first ``dofs`` dofs of nodes, each in its body's frame."""
    return np.vstack([system.own_rows(*node)[:dofs] for node in nodes])


def _node_labels(model: Model, name: str, nodes: list[tuple[BodyName, NodeName]]) -> dict[str, Any]:
    stages = [body.stage for body, _ in nodes]
    if name == "carrier_node":
        return {name: [f"{stage}.{node}" for stage, (_, node) in zip(stages, nodes, strict=True)]}
    place = np.array([model.system.body(body).position(node) for body, node in nodes])
    return {
        "tooth_stage": stages,
        "tooth_side": [node.side for _, node in nodes],
        "tooth_number": [node.number for _, node in nodes],
        "tooth_angle": np.mod(np.arctan2(place[:, 1], place[:, 0]), 2 * np.pi),
    }


def planet_bearings(model: Model) -> list[str]:
    """Names of the planets' bearings, those in turning frames last."""
    names = [link.name for link in model.system.links if link.kind == "planet_bearing"]
    return names + _turning_bearings(model)
