"""Bodies that a case gives as reduced matrices, without an FE mesh.

Their table of nodes has the names of generated bodies' nodes, and their positions are compared with
the case. Without an FE mesh such a body is flexible, but cannot be drawn.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager

import numpy as np

from flexgear.arrays import Array
from flexgear.files.matrices.body import ReducedMatrices, check
from flexgear.files.matrices.exchange import read_reduced
from flexgear.model.bodies import FeMeshSource, Housing, Material
from flexgear.model.errors import InputError
from flexgear.model.names import MOUNT, BodyName, NodeName
from flexgear.structures.bodies import Body, node_motions
from flexgear.structures.reduced import ReducedBody

_ALONG = ("tooth", "pin")  # kinds of nodes whose position along the axis is compared, too
_TOLERANCE = 0.2  # of a node's position, in tooth pitches across the axis and face widths along it
_MASS_RATIO = 30.0  # largest ratio to the mass of a steel body; wrong units make 1000
_LOWEST, _HIGHEST = 1 / 15, 9.0  # over ``first_frequency``; flanges lower it; wrong units make 31.6


def given_body(
    section: FeMeshSource,
    name: str,
    places: Mapping[NodeName, Array],
    sizes: tuple[float, float],
    inertia: Array,
    material: Material,
    where: str,
) -> ReducedBody:
    """The body of a case's matrix files. InputError unless it is a free body with these nodes.

    name: of the member, as "ring"; places: positions (3,) m of its nodes; sizes: tooth pitch and
    face width, m, which determine tolerances; inertia (6, 6): of a steel body of its size about
    the origin, kg to kg m²; where: source of the case.
    """
    with _faults_of(where, f"stage.{name}.fe.fe_mesh_file"):
        read = _read(section, name)
        ordered = _in_order(read, list(places), str(section.fe_mesh_nodes))
        _require_places(ordered, places, sizes, str(section.fe_mesh_nodes))
        figures = check(ordered, str(section.fe_mesh_file))
        _require_size(figures, name, inertia, material, str(section.fe_mesh_file))
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
            "given": section.fe_mesh_file,
            **dict.fromkeys(("static_error", "frequency_error", "frequency_limit_hz")),
            **figures,
        },
        points=np.zeros((0, 3)),
        cells=np.zeros((0, 8), dtype=np.int64),
        recovery=np.zeros((0, size), dtype=np.float32),
    )


def given_housing(housing: Housing, source: str) -> Body:
    """The housing from its matrix files. InputError unless it is a free body with a mount; source:
    of the case."""
    with _faults_of(source, "housing.fe_mesh_file"):
        read = _read(housing, "housing")
        check(read, str(housing.fe_mesh_file))
    if not any(NodeName.parse(name).kind == MOUNT for name in read.node_names):
        problem = "has no node mount_1, so nothing holds the housing"
        remedy = "name the nodes that stand on the ground mount_1, mount_2 …"
        raise InputError(source, "housing.fe_mesh_nodes", problem, remedy)
    return Body(
        name=BodyName.of("", "housing"),
        node_names=read.node_names,
        positions=read.positions,
        mass=(read.mass + read.mass.T) / 2,
        stiffness=(read.stiffness + read.stiffness.T) / 2,
        node_map=np.eye(6 * len(read.node_names), len(read.stiffness)),
        rigid_motions=node_motions(read.positions, len(read.stiffness)),
    )


def _read(section: FeMeshSource | Housing, name: str) -> ReducedMatrices:
    files = [file for file in (section.fe_mesh_file, section.fe_mesh_mass_file) if file is not None]
    assert section.fe_mesh_nodes is not None  # input validation requires it
    return read_reduced(files, section.fe_mesh_nodes, section.fe_mesh_unit, name)


@contextmanager
def _faults_of(where: str, key: str) -> Iterator[None]:
    """Context that changes an InputError of a file to one of the case's key that names the file."""
    try:
        yield
    except InputError as fault:
        problem = f"{fault.where}: {fault.key}: {fault.problem}"
        raise InputError(where, key, problem, fault.remedy) from None


def _in_order(body: ReducedMatrices, names: Sequence[str], where: str) -> ReducedMatrices:
    """The body with its nodes in the order of ``names``. InputError for missing or more nodes."""
    missing = [name for name in names if name not in body.node_names]
    unknown = [name for name in body.node_names if name not in names]
    if missing or unknown:
        listed = ", ".join((missing or unknown)[:3])
        problem = f"lacks {listed}" if missing else f"has unknown nodes {listed}"
        more = max(len(missing or unknown) - 3, 0)
        remedy = f"the case has {names[0]} … {names[-1]}; see docs/conventions.md"
        raise InputError(where, "nodes", problem + (f" and {more} more" if more else ""), remedy)
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


def _require_places(
    body: ReducedMatrices, places: Mapping[NodeName, Array], sizes: tuple[float, float], where: str
) -> None:
    """InputError where a node is not at its position in the case."""
    pitch, face_width = sizes
    for (name, place), position in zip(places.items(), body.positions, strict=True):
        x, y, z = map(float, place)
        across = math.hypot(position[0] - x, position[1] - y)
        along = abs(position[2] - z) if name.kind in _ALONG else 0.0
        if across > _TOLERANCE * pitch or along > _TOLERANCE * face_width:
            actual = ", ".join(f"{1e3 * v:.1f}" for v in position)
            raise InputError(
                where, name, f"is at {actual} mm",
                f"it belongs to {1e3 * x:.1f}, {1e3 * y:.1f}, {1e3 * z:.1f} mm; check the frame"
                " and the unit",
            )  # fmt: skip


def _require_size(
    figures: Mapping[str, float], name: str, inertia: Array, material: Material, where: str
) -> None:
    """InputError where the mass of given matrices, or the first natural frequency of the free body,
    shows that they are in wrong units. figures: of ``files.matrices.body.check``; inertia: of a
    steel body of the size that the case states."""
    mass, expected = figures["mass_kg"], float(inertia[0, 0])
    if not 1 / _MASS_RATIO < mass / expected < _MASS_RATIO:
        problem = f"is {mass:.3g} kg; a steel body of this size has about {expected:.3g}"
        remedy = 'check fe_mesh_unit: "mm" for N, mm, t, s, "m" for SI'
        raise InputError(where, "mass", problem, remedy)
    frequency, expected = figures["first_frequency_hz"], first_frequency(name, inertia, material)
    if not _LOWEST < frequency / expected < _HIGHEST:
        problem = f"gives the free body a first natural frequency of {frequency:.3g} Hz; a steel "
        problem += f"body of this size has about {expected:.2g}"
        remedy = "check the unit of its forces (N, not kN) and of Young's modulus in its FE model"
        raise InputError(where, "stiffness", problem, remedy)


def first_frequency(name: str, inertia: Array, material: Material) -> float:
    """Estimate of the first natural frequency of a free steel body, Hz, by which wrong units show.

    Rings: 0.123 √(E/ρ) min(t, b)/r², bending of a thin ring (Love 1944, art. 293), with radius r,
    width b and thickness t of the ring that has this inertia. Planets and carriers:
    0.02 √(E/ρ) V/r⁴, with volume V and r² = ∫ |x|² dV/V about the centre of mass; 0.02 is
    calibrated: generated planets and carriers have 0.015 to 0.022.

    name: "ring", "planet" or "carrier"; inertia: (6, 6) about the origin, kg to kg m².
    """
    mass = inertia[0, 0]
    arm = inertia[:3, 3:] / mass  # −[s]×, s from the origin to the centre of mass
    x, y, z = np.diag(inertia[3:, 3:] / mass + arm @ arm)
    volume, width = mass / material.density, math.sqrt(6.0 * (x + y - z))
    if name == "ring":
        shape = 0.123 * min(volume / (2.0 * math.pi * math.sqrt(z) * width), width) / z
    else:
        shape = 0.02 * volume / ((x + y + z) / 2.0) ** 2
    return float(math.sqrt(material.young_modulus / material.density) * shape)
