"""Reduced matrices of a body on six-dof nodes, their table of nodes, and checks of both.

Coordinates: ux, uy, uz (m), rx, ry, rz (rad) of each node in the order of the table, then modal
coordinates. A free body has K R = 0 for its six rigid motions R, whose mass is Rᵀ M R.

Columns of the table of nodes (CSV): row (first of the six consecutive matrix rows of the node, from
1), id, name, and x, y, z with their unit (x_m or x_mm). Rows without a position are modal
coordinates.
"""

import csv
import io
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Self

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from flexgear.arrays import Array
from flexgear.model.errors import InputError, echo
from flexgear.model.input_file import (
    MAX_MATRIX_BYTES,
    MEGABYTE,
    number_in,
    read_cells,
    require_one,
    require_titles,
)

_SYMMETRY_TOLERANCE = 1e-6  # of |K_ij − K_ji| over √(K_ii K_jj)
_RIGID_TOLERANCE = 1e-6  # of the relative energy of rigid motions; single precision leaves 1e-7
_ZERO_EIGENVALUE = 1e-9  # limit for the stiffness matrix scaled to a unit diagonal
_MASS_TOLERANCE = 1e-2  # of the relative difference between the masses along three axes
LENGTHS = {"m": 1.0, "mm": 1e-3}  # m; of node tables and systems of units


@dataclass(frozen=True, eq=False)
class ReducedMatrices:
    """A reduced body with n nodes and d ≥ 6 n coordinates, in SI.

    positions (n, 3) of the nodes, m; stiffness and mass (d, d); recovery (3p, d), displacements of
    p points per unit coordinate, and points (p, 3), m, or None.
    """

    name: str
    node_names: tuple[str, ...]
    positions: Array
    stiffness: Array
    mass: Array
    recovery: Array | None = None
    points: Array | None = None

    @property
    def modes(self) -> int:
        """Number of modal coordinates."""
        return len(self.stiffness) - 6 * len(self.node_names)

    def rigid_motion(self) -> Array:
        """Coordinates (d, 6) of unit rigid displacements and rotations about the origin."""
        motion = np.zeros((len(self.stiffness), 6))
        for k, (x, y, z) in enumerate(self.positions):
            motion[6 * k : 6 * k + 6] = np.eye(6)
            motion[6 * k : 6 * k + 3, 3:] = [[0, z, -y], [-z, 0, x], [y, -x, 0]]
        return motion

    def in_si(self, units: str) -> Self:
        """The body in SI, converted from matrices in N, mm, t, s ("mm") or in SI ("m").

        Positions are in m already. In the "mm" system the energies qᵀ K q and vᵀ M v are in mJ;
        modal coordinates keep their unit mass.
        """
        if units == "m":
            return self
        per = 1.0 / LENGTHS[units]
        scale = np.full(len(self.stiffness), np.sqrt(per))
        scale[: 6 * len(self.node_names)] = np.tile([per] * 3 + [1.0] * 3, len(self.node_names))
        factor = scale[:, None] * scale / per
        return replace(self, stiffness=self.stiffness * factor, mass=self.mass * factor)


@np.errstate(over="ignore")  # what overflows is refused by name
def check(body: ReducedMatrices, where: str) -> dict[str, Any]:
    """Check that the matrices are those of a free elastic body in SI; returns its properties.

    Both matrices must be symmetric, K R = 0 must hold for the six rigid motions and for no others,
    and the mass must be positive and equal in all directions. Raises InputError otherwise.
    Properties: mass_kg, asymmetry_stiffness, asymmetry_mass, rigid_residual, first_frequency_hz and
    modes, the number of modal coordinates.
    """
    require_shapes(body, where)
    asymmetry = {n: _asymmetry(m) for n, m in (("stiffness", body.stiffness), ("mass", body.mass))}
    for name, value in asymmetry.items():
        if value > _SYMMETRY_TOLERANCE:
            problem = f"is not symmetric: entries differ by {value:.1e} of their size"
            remedy = "export the full matrix, or one triangle as such"
            raise InputError(where, name, problem, remedy)
    residual = _rigid_residual(body, where)
    inertia = body.rigid_motion().T @ body.mass @ body.rigid_motion()
    mass_of_matrix = float(np.trace(inertia[:3, :3]) / 3)
    _require_mass(inertia, mass_of_matrix, where)
    flexible = _flexible_modes(body, residual, where)
    return {
        "mass_kg": mass_of_matrix,
        "asymmetry_stiffness": asymmetry["stiffness"],
        "asymmetry_mass": asymmetry["mass"],
        "rigid_residual": residual,
        "first_frequency_hz": flexible,
        "modes": body.modes,
    }


def require_shapes(body: ReducedMatrices, where: str) -> None:
    """Raise InputError unless both matrices are square, finite and have rows for all nodes."""
    size = 6 * len(body.node_names)
    for name, matrix in (("stiffness", body.stiffness), ("mass", body.mass)):
        if matrix.ndim != 2 or matrix.shape[0] != matrix.shape[1] or len(matrix) < size:
            remedy = f"{len(body.node_names)} nodes need a square matrix of {size} or more rows"
            raise InputError(where, name, f"is {' x '.join(map(str, matrix.shape))}", remedy)
        if matrix.shape != body.stiffness.shape:
            problem = f"has {len(matrix)} rows, the stiffness {len(body.stiffness)}"
            raise InputError(where, name, problem, "export both on the same coordinates")
        if not np.isfinite(matrix).all():
            raise InputError(where, name, "has entries that are not finite", "export it again")


def _asymmetry(matrix: Array) -> float:
    """Largest |K_ij − K_ji| / √(K_ii K_jj) of a matrix K."""
    scale = np.sqrt(np.abs(np.diag(matrix)))
    scale[scale == 0] = scale.max(initial=1.0) or 1.0
    return float(np.max(np.abs(matrix - matrix.T) / scale[:, None] / scale, initial=0.0))


def _rigid_residual(body: ReducedMatrices, where: str) -> float:
    """Largest relative energy of the six rigid motions R_j: |R_jᵀ K R_j| / Σ_i |K_ii| R_ij².

    Raises InputError above _RIGID_TOLERANCE; the message names the unit of length as the cause if
    positions 1000 or 0.001 times as large would make rotations free of energy.
    """
    rigid = body.rigid_motion()
    uncoupled = np.abs(np.diag(body.stiffness)) @ rigid**2
    energy = np.abs(np.einsum("ij,ik,kj->j", rigid, body.stiffness, rigid))
    residual = energy / np.where(uncoupled > 0, uncoupled, 1.0)
    if residual.max() <= _RIGID_TOLERANCE:
        return float(residual.max())
    scale = _length_scale(body)
    unit_scale = next((k for k in (1e3, 1e-3) if abs(scale / k - 1) < 0.05), None)
    if residual[:3].max() <= _RIGID_TOLERANCE and unit_scale is not None:
        problem = f"rotations are rigid if positions are multiplied by {unit_scale:g}"
        remedy = "give lengths of the node table and of the matrices in the same unit"
        raise InputError(where, "units", problem, remedy)
    raise InputError(
        where, "stiffness",
        f"resists rigid motion, with {residual.max():.1e} of the energy of uncoupled coordinates",
        "export the free body, without supports, with the true positions of its nodes and dofs in "
        "the order ux, uy, uz, rx, ry, rz",
    )  # fmt: skip


def _length_scale(body: ReducedMatrices) -> float:
    """Factor s of the positions that minimises |W K (s L + T)|, the residual of rigid rotations.

    L are the translations of the nodes due to unit rotations about the origin, T their rotations,
    and W = diag(K)^(−1/2).
    """
    rigid, rotations = body.rigid_motion()[:, 3:], np.zeros((len(body.stiffness), 3))
    for k in range(len(body.node_names)):
        rotations[6 * k + 3 : 6 * k + 6] = np.eye(3)
    weight = 1.0 / np.sqrt(np.abs(np.diag(body.stiffness)) + np.finfo(float).tiny)
    by_translation = weight[:, None] * (body.stiffness @ (rigid - rotations))
    by_rotation = weight[:, None] * (body.stiffness @ rotations)
    square = max((by_translation * by_translation).sum(), np.finfo(float).tiny)
    return float(-(by_translation * by_rotation).sum() / square)


def _require_mass(inertia: Array, mass_of_matrix: float, where: str) -> None:
    if not np.isfinite(inertia).all() or not np.all(np.linalg.eigvalsh(inertia) > 0):
        remedy = "export the mass on the same coordinates as the stiffness"
        raise InputError(where, "mass", "is not positive in rigid motion", remedy)
    spread = np.ptp(np.diag(inertia)[:3]) / mass_of_matrix
    if spread > _MASS_TOLERANCE:
        problem = f"differs by {spread:.1e} between directions"
        raise InputError(where, "mass", problem, "export the free body")


def _flexible_modes(body: ReducedMatrices, residual: float, where: str) -> float:
    """Lowest elastic natural frequency, Hz. residual: relative energy of rigid motions, which the
    rounding of a file leaves. Raises InputError if the stiffness is zero for any motion beside the
    rigid ones, or the mass is not positive definite."""
    scale = 1.0 / np.sqrt(np.abs(np.diag(body.stiffness)) + np.finfo(float).tiny)
    scaled = body.stiffness * scale[:, None] * scale
    if not np.isfinite(scaled).all():
        problem = "has entries that are too large beside those on its diagonal"
        raise InputError(where, "stiffness", problem, "export the full matrix")
    elastic = scipy.linalg.null_space((body.rigid_motion() / scale[:, None]).T)
    values = np.linalg.eigvalsh(elastic.T @ scaled @ elastic)
    free = 6 + int(np.count_nonzero(values < max(_ZERO_EIGENVALUE, residual)))
    if free > 6:
        problem = f"has {free} motions without stiffness, but a free body has six"
        remedy = "export a single connected body with all six dofs of its nodes"
        raise InputError(where, "stiffness", problem, remedy)
    small = np.finfo(float).eps * np.abs(np.diag(body.mass)).max()
    try:
        squares = scipy.linalg.eigh(
            body.stiffness, body.mass + small * np.eye(len(body.mass)), eigvals_only=True
        )
    except (np.linalg.LinAlgError, ValueError):  # ValueError: sums that overflow
        problem = "is not positive definite"
        raise InputError(where, "mass", problem, "export the consistent mass") from None
    return float(np.sqrt(max(squares[6], 0.0)) / (2 * np.pi))


@dataclass(frozen=True, eq=False)
class NodeTable:
    """Nodes in the order of the matrices: ids of the exporting program, names, positions (n, 3) m.
    mode_ids: ids of the modal coordinates, which follow the nodes."""

    ids: tuple[int, ...]
    names: tuple[str, ...]
    positions: Array
    mode_ids: tuple[int, ...] = ()


def table_text(names: tuple[str, ...], positions: Array, modes: int) -> str:
    """The table of nodes as CSV text; ids count from 1 through nodes and modal coordinates."""
    out = io.StringIO()
    rows = csv.writer(out, lineterminator="\n")
    rows.writerow(["row", "id", "name", "x_m", "y_m", "z_m"])
    for k, (name, place) in enumerate(zip(names, positions, strict=True)):
        rows.writerow([6 * k + 1, k + 1, name, *(repr(float(v)) for v in place)])
    for k in range(modes):
        rows.writerow([6 * len(names) + k + 1, len(names) + k + 1, f"mode_{k + 1:03d}", "", "", ""])
    return out.getvalue()


def read_table(path: Path) -> NodeTable:
    """Read a table of nodes from a CSV file; InputError if it cannot be read."""
    where = str(path)
    header, rows, separator = read_cells(path, "table of nodes")
    heads = [head.lower() for head in header]
    for head in filter(None, heads):
        require_one([title for title in heads if title == head], where)
    unit = next((u for u in LENGTHS if {f"{axis}_{u}" for axis in "xyz"} <= {*heads}), None)
    if unit is None:
        problem = f"{echo(', '.join(heads))} lack positions"
        raise InputError(where, "columns", problem, "give id, name, x_m, y_m, z_m (or x_mm …)")
    axes = [f"{axis}_{unit}" for axis in "xyz"]
    entries: list[dict[str, str]] = []
    for number, row in rows:
        require_titles(row, header, where, number)
        cells = [cell.strip() for cell in row] + [""] * (len(heads) - len(row))
        entries.append({**dict(zip(heads, cells, strict=False)), "line": f"line {number}"})
    if "row" in heads:
        entries.sort(key=lambda row: _integer(row["row"], where, "row"))
    nodes = [row for row in entries if row[axes[0]]]
    modes = [row for row in entries if not row[axes[0]]]
    ids = [_integer(row.get("id", str(k)), where, "id") for k, row in enumerate(nodes, 1)]
    if not nodes or len({*ids}) < len(ids):
        problem = "have equal ids" if nodes else "are missing"
        raise InputError(where, "nodes", problem, "give each node one row with a unique id")
    places = [
        [number_in(row[axis], separator, where, f"{row['line']}, {axis}") for axis in axes]
        for row in nodes
    ]
    names = [row.get("name") or f"node_{k}" for k, row in zip(ids, nodes, strict=True)]
    for name in names:
        if names.count(name) > 1:
            remedy = "give each node a name of its own"
            raise InputError(where, "nodes", f"{echo(name)} is the name of several nodes", remedy)
    mode_ids = tuple(_integer(row["id"], where, "id") for row in modes if row.get("id"))
    return NodeTable(tuple(ids), tuple(names), LENGTHS[unit] * np.array(places), mode_ids)


def _integer(text: str, where: str, key: str) -> int:
    try:
        return int(text)
    except ValueError:
        problem = f"{echo(text)} is not a whole number"
        raise InputError(where, key, problem, "write whole numbers") from None


MAX_MODAL_COORDINATES = 5000  # modal coordinates of a body; hundreds are usual
_REAL_KINDS = "fiu"  # NumPy's codes of real number types


def require_form(shape: Sequence[int], where: str, key: str, table: NodeTable) -> None:
    """Raise InputError unless a matrix of this shape can belong to the nodes of a table. Called
    before memory is allocated for the matrix."""
    key, rows = key or "matrix", 6 * len(table.ids)
    if len(shape) != 2 or 0 in shape:
        size = " x ".join(map(str, shape)) or "a single number"
        raise InputError(where, key, f"is {size}, not a matrix", "write rows and columns")
    if shape[1] > rows + MAX_MODAL_COORDINATES:
        raise InputError(
            where, key, f"is {shape[0]} x {shape[1]}",
            f"the {len(table.ids)} nodes have {rows} rows, and up to {MAX_MODAL_COORDINATES} modal "
            "coordinates may follow",
        )  # fmt: skip
    if 8 * math.prod(shape) > MAX_MATRIX_BYTES:
        problem = f"is {shape[0]} x {shape[1]}, more than {MAX_MATRIX_BYTES // MEGABYTE} MB"
        raise InputError(where, key, problem, "recover displacements at fewer points")


def require_real(dtype: np.dtype[Any], where: str, key: str) -> None:
    """Raise InputError unless the type is one of real numbers."""
    if dtype.kind not in _REAL_KINDS:
        raise InputError(where, key or "matrix", f"holds {dtype}", "write real numbers")


def as_double(matrix: Any, where: str, key: str, table: NodeTable) -> NDArray[np.float64]:
    """The matrix in double precision; InputError unless it has finite real entries."""
    array = np.asarray(matrix)
    require_form(array.shape, where, key, table)
    require_real(array.dtype, where, key)
    if not np.isfinite(array).all():
        problem = "has entries that are not finite"
        raise InputError(where, key or "matrix", problem, "export it again")
    return np.asarray(array, dtype=np.float64)
