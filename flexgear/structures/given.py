"""Ring, carrier and housing that a case gives as reduced matrices, in place of an FE mesh.

The table of nodes names them as ours are named; what is in its place is compared with the case. The
body has no FE mesh: it bends, but nothing of it can be drawn.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexgear.files.matrices.body import ReducedMatrices, check
from flexgear.files.matrices.reading import read_reduced
from flexgear.gears.geometry import stage_geometry
from flexgear.model.carrier import Carrier
from flexgear.model.errors import InputError
from flexgear.model.housing import Housing
from flexgear.model.names import MOUNT, BodyName, NodeName
from flexgear.model.ring import Ring
from flexgear.model.ring_supports import ring_supports
from flexgear.model.stage_view import StageView
from flexgear.structures.bodies import Body
from flexgear.structures.reduced import ReducedBody

Array = NDArray[np.float64]
Place = tuple[float, float, float]
_OFF = 0.2  # tooth pitches (across the axis) and face widths (along it) that a node may be off
_SIZES = 30.0  # between the masses of a body and of a steel one of the case's size; units make 1000


@dataclass(frozen=True)
class Expected:
    """Nodes of a body with their places (m); which of them must be in place along the axis, too;
    mass: that of a steel body of its size, kg."""

    places: dict[str, Place]
    along: frozenset[str]
    mass: float


def given_ring(view: StageView) -> ReducedBody:
    """The ring's matrices. InputError unless they are a free body with the case's nodes."""
    geometry, width = stage_geometry(view).ring, view.stage.face_width
    teeth, radius = view.ring_gear.teeth, geometry.reference_radius
    places: dict[str, Place] = {}
    for j in range(teeth):
        angle = 2 * math.pi * j / teeth
        places[f"tooth_{j + 1:03d}"] = (radius * math.cos(angle), radius * math.sin(angle), 0.0)
    along = frozenset(places)
    places |= {support.node: support.place for support in ring_supports(view.ring, width)}
    outer = geometry.root_radius + view.ring.rim_thickness
    mass = view.material.density * math.pi * (outer**2 - geometry.root_radius**2) * width
    return _body(view, "ring", view.ring, Expected(places, along, mass))


def given_carrier(view: StageView) -> ReducedBody:
    """The carrier's matrices, likewise."""
    part, radius = view.carrier, stage_geometry(view).center_distance
    on_axis = dict.fromkeys(("drive", "bearing_drive", "bearing_far"), (0.0, 0.0, 0.0))
    pins = {
        f"pin_{i + 1}": (radius * math.cos(phi), radius * math.sin(phi), 0.0)
        for i, phi in enumerate(view.stage.planet_angles)
    }
    thickness = part.plate_thickness_drive + part.plate_thickness_far
    mass = view.material.density * math.pi * (part.plate_diameter / 2) ** 2 * thickness
    return _body(view, "carrier", part, Expected({**on_axis, **pins}, frozenset(pins), mass))


def given_housing(housing: Housing, source: str) -> Body:
    """The housing's matrices, in fixed axes. InputError unless they are a free body with a mount.

    source: where the case is from.
    """
    files = [f for f in (housing.fe_mesh_file, housing.fe_mesh_mass_file) if f is not None]
    assert housing.fe_mesh_nodes is not None  # the model refuses a reduced one without them
    try:
        read = read_reduced(files, housing.fe_mesh_nodes, housing.fe_mesh_unit, "housing")
        check(read, files[0])
    except InputError as fault:
        problem = f"{fault.where}: {fault.key}: {fault.problem}"
        raise InputError(source, "housing.fe_mesh_file", problem, fault.remedy) from None
    if not any(NodeName.parse(name).kind == MOUNT for name in read.node_names):
        raise InputError(
            source, "housing.fe_mesh_nodes", "has no node mount_1, so nothing holds the housing",
            "name the nodes that stand on the ground mount_1, mount_2 …",
        )  # fmt: skip
    return Body(
        name=BodyName.of("", "housing"),
        node_names=read.node_names,
        positions=read.positions,
        mass=(read.mass + read.mass.T) / 2,
        stiffness=(read.stiffness + read.stiffness.T) / 2,
        node_map=np.eye(6 * len(read.node_names), len(read.stiffness)),
    )


def _body(view: StageView, name: str, part: Ring | Carrier, expected: Expected) -> ReducedBody:
    files = [file for file in (part.fe_mesh_file, part.fe_mesh_mass_file) if file is not None]
    assert part.fe_mesh_nodes is not None  # the model refuses a reduced body without them
    try:
        read = read_reduced(files, part.fe_mesh_nodes, part.fe_mesh_unit, name)
        ordered = _in_order(read, expected, part.fe_mesh_nodes)
        _require_places(ordered, expected, view, part.fe_mesh_nodes)
        figures = check(ordered, files[0])
        _require_size(figures["mass_kg"], expected.mass, files[0])
    except InputError as fault:
        problem = f"{fault.where}: {fault.key}: {fault.problem}"
        raise InputError(
            view.source, f"stage.{name}.fe.fe_mesh_file", problem, fault.remedy
        ) from None
    size = len(ordered.stiffness)
    return ReducedBody(
        name=name,
        node_names=ordered.node_names,
        positions=ordered.positions,
        mass=(ordered.mass + ordered.mass.T) / 2,
        stiffness=(ordered.stiffness + ordered.stiffness.T) / 2,
        n_modes=ordered.modes,
        report={
            "fe_dofs": None,
            "interface_dofs": 6 * len(ordered.node_names),
            "fixed_interface_modes": ordered.modes,
            "given": part.fe_mesh_file,
            **dict.fromkeys(("static_error", "frequency_error", "frequency_limit_hz")),
            **figures,
        },
        points=np.zeros((0, 3)),
        cells=np.zeros((0, 8), dtype=np.int64),
        recovery=np.zeros((0, size), dtype=np.float32),
    )


def _in_order(body: ReducedMatrices, expected: Expected, where: str) -> ReducedMatrices:
    """The body with its nodes in our order. InputError for nodes too many or too few."""
    names = list(expected.places)
    lost = [name for name in names if name not in body.node_names]
    odd = [name for name in body.node_names if name not in expected.places]
    if lost or odd:
        problem = f"lacks {', '.join(lost[:3])}" if lost else f"has {', '.join(odd[:3])}, no node"
        more = max(len(lost or odd) - 3, 0)
        raise InputError(
            where, "nodes", problem + (f" and {more} more" if more else ""),
            f"the case has {names[0]} … {names[-1]}; see docs/conventions.md",
        )  # fmt: skip
    order = [body.node_names.index(name) for name in names]
    rows = np.concatenate([np.arange(6 * k, 6 * k + 6) for k in order])
    rows = np.concatenate([rows, np.arange(6 * len(order), len(body.stiffness))])
    return ReducedMatrices(
        body.name,
        tuple(names),
        body.positions[order],
        body.stiffness[np.ix_(rows, rows)],
        body.mass[np.ix_(rows, rows)],
    )


def _require_places(body: ReducedMatrices, expected: Expected, view: StageView, where: str) -> None:
    pitch = math.pi * view.stage.normal_module / math.cos(view.stage.helix_angle)
    for name, position in zip(body.node_names, body.positions, strict=True):
        x, y, z = expected.places[name]
        across = math.hypot(position[0] - x, position[1] - y)
        along = abs(position[2] - z) if name in expected.along else 0.0
        if across > _OFF * pitch or along > _OFF * view.stage.face_width:
            stands = ", ".join(f"{1e3 * v:.1f}" for v in position)
            raise InputError(
                where, name, f"is at {stands} mm",
                f"it belongs to {1e3 * x:.1f}, {1e3 * y:.1f}, {1e3 * z:.1f} mm; check the frame"
                " and the unit",
            )  # fmt: skip


def _require_size(mass: float, expected: float, where: str) -> None:
    if not 1 / _SIZES < mass / expected < _SIZES:
        raise InputError(
            where, "mass", f"is {mass:.3g} kg; a steel body of this size has about {expected:.3g}",
            'check fe_mesh_unit: "mm" for N, mm, t, s, "m" for SI',
        )  # fmt: skip
