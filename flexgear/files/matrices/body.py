"""Reduced matrices of a body on six-dof nodes, their table of nodes, and checks of both.

Coordinates: ux, uy, uz (m), rx, ry, rz (rad) of each node in the order of the table, then modal
ones. A free body has K R = 0 for its six rigid motions R, whose mass is Rᵀ M R.

Columns of the table of nodes, CSV: row (first row of the node in the matrices, from 1; six follow
one another), id, name, and x, y, z with their unit: x_m or x_mm. Rows without a position are modal
coordinates.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from flexgear.arrays import Array
from flexgear.model.errors import InputError, echo
from flexgear.model.input_file import (
    MEGABYTE,
    MOST_MATRICES,
    number_in,
    read_cells,
    require_titles,
)

SYMMETRIC = 1e-6  # of the largest entry of the two rows, scaled by their diagonals
RIGID = 1e-6  # of the energy that the coordinates alone would take; single precision leaves 1e-7
FREE = 1e-9  # eigenvalue of the stiffness scaled to a unit diagonal that counts as zero
SPREAD = 1e-2  # between the masses along three axes
LENGTHS = {"m": 1.0, "mm": 1e-3}  # m; of node tables and systems of units


@dataclass(frozen=True, eq=False)
class ReducedMatrices:
    """A reduced body as arrays.

    positions (n, 3) m; stiffness, mass (d, d), d ≥ 6 n, SI; recovery (3p, d) m per coordinate at
    points (p, 3) m, or None.
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
        """Coordinates (d, 6) of unit rigid motion about the origin."""
        motion = np.zeros((len(self.stiffness), 6))
        for k, (x, y, z) in enumerate(self.positions):
            motion[6 * k : 6 * k + 6] = np.eye(6)
            motion[6 * k : 6 * k + 3, 3:] = [[0, z, -y], [-z, 0, x], [y, -x, 0]]
        return motion

    def in_si(self, units: str) -> ReducedMatrices:
        """The same body from matrices in N, mm, t, s ("mm") or SI ("m"); positions are in m.

        Energies q^T K q and v^T M v are in mJ there; modal coordinates keep their unit mass.
        """
        if units == "m":
            return self
        per = 1.0 / LENGTHS[units]
        scale = np.full(len(self.stiffness), np.sqrt(per))
        scale[: 6 * len(self.node_names)] = np.tile([per] * 3 + [1.0] * 3, len(self.node_names))
        factor = scale[:, None] * scale / per
        return replace(self, stiffness=self.stiffness * factor, mass=self.mass * factor)


def check(body: ReducedMatrices, where: str) -> dict[str, Any]:
    """Figures of a body. InputError where it is not a free elastic body in SI.

    Symmetry of both matrices; K R = 0 for six rigid motions, and no other motion without
    stiffness; positive mass, the same in all directions.
    """
    for name, matrix in (("stiffness", body.stiffness), ("mass", body.mass)):
        _require_shape(body, name, matrix, where)
    worst = {n: _asymmetry(m) for n, m in (("stiffness", body.stiffness), ("mass", body.mass))}
    for name, value in worst.items():
        if value > SYMMETRIC:
            raise InputError(
                where, name, f"is not symmetric: entries differ by {value:.1e} of their size",
                "export the full matrix, or one triangle as such",
            )  # fmt: skip
    residual = _rigid_residual(body, where)
    inertia = body.rigid_motion().T @ body.mass @ body.rigid_motion()
    mass_of_matrix = float(np.trace(inertia[:3, :3]) / 3)
    _require_mass(inertia, mass_of_matrix, where)
    flexible = _flexible_modes(body, where)
    return {
        "mass_kg": mass_of_matrix,
        "asymmetry_stiffness": worst["stiffness"],
        "asymmetry_mass": worst["mass"],
        "rigid_residual": residual,
        "first_frequency_hz": flexible,
        "modes": body.modes,
    }


def _require_shape(body: ReducedMatrices, name: str, matrix: Array, where: str) -> None:
    least = 6 * len(body.node_names)
    if matrix.ndim != 2 or matrix.shape[0] != matrix.shape[1] or len(matrix) < least:
        raise InputError(
            where, name, f"is {' x '.join(map(str, matrix.shape))}",
            f"{len(body.node_names)} nodes need a square matrix of {least} or more",
        )  # fmt: skip
    if matrix.shape != body.stiffness.shape:
        raise InputError(
            where, name, f"has {len(matrix)} rows, the stiffness {len(body.stiffness)}",
            "export both on the same coordinates",
        )  # fmt: skip
    if not np.isfinite(matrix).all():
        raise InputError(where, name, "holds entries that are no numbers", "export it again")


def _asymmetry(matrix: Array) -> float:
    """Largest difference of K_ij and K_ji over √(K_ii K_jj)."""
    scale = np.sqrt(np.abs(np.diag(matrix)))
    scale[scale == 0] = scale.max(initial=1.0) or 1.0
    return float(np.max(np.abs(matrix - matrix.T) / scale[:, None] / scale, initial=0.0))


def _rigid_residual(body: ReducedMatrices, where: str) -> float:
    """|Rᵀ K R| over Σ K_ii R_i², what the coordinates would resist one by one; the largest.

    InputError above RIGID. The factor of the positions that would make rotations free is found as
    well: 1000 or 0.001 are units of length.
    """
    rigid = body.rigid_motion()
    alone = np.abs(np.diag(body.stiffness)) @ rigid**2
    energy = np.abs(np.einsum("ij,ik,kj->j", rigid, body.stiffness, rigid))
    residual = energy / np.where(alone > 0, alone, 1.0)
    if residual.max() <= RIGID:
        return float(residual.max())
    lever = _lever(body)
    near = next((k for k in (1e3, 1e-3) if abs(lever / k - 1) < 0.05), None)
    if residual[:3].max() <= RIGID and near is not None:
        raise InputError(
            where, "units", f"rotations are rigid where positions are taken {near:g} times",
            "give lengths of the node table and of the matrices in the same unit",
        )  # fmt: skip
    raise InputError(
        where, "stiffness",
        f"resists rigid motion: {residual.max():.1e} of what its coordinates do alone",
        "export the free body, without supports, with nodes where they are",
    )  # fmt: skip


def _lever(body: ReducedMatrices) -> float:
    """Factor s of the positions that makes K (s L + T) least, with L the levers of rotations."""
    rigid, alone = body.rigid_motion()[:, 3:], np.zeros((len(body.stiffness), 3))
    for k in range(len(body.node_names)):
        alone[6 * k + 3 : 6 * k + 6] = np.eye(3)
    weight = 1.0 / np.sqrt(np.abs(np.diag(body.stiffness)) + np.finfo(float).tiny)
    levers = weight[:, None] * (body.stiffness @ (rigid - alone))
    turns = weight[:, None] * (body.stiffness @ alone)
    return float(-(levers * turns).sum() / max((levers * levers).sum(), np.finfo(float).tiny))


def _require_mass(inertia: Array, mass_of_matrix: float, where: str) -> None:
    if not np.isfinite(inertia).all() or not np.all(np.linalg.eigvalsh(inertia) > 0):
        raise InputError(
            where, "mass", "is not positive in rigid motion",
            "export the mass on the same coordinates as the stiffness",
        )  # fmt: skip
    spread = np.ptp(np.diag(inertia)[:3]) / mass_of_matrix
    if spread > SPREAD:
        raise InputError(
            where, "mass", f"differs by {spread:.1e} between directions", "export the free body"
        )


def _flexible_modes(body: ReducedMatrices, where: str) -> float:
    """Lowest elastic frequency, Hz. InputError for other than six motions without stiffness."""
    scale = 1.0 / np.sqrt(np.abs(np.diag(body.stiffness)) + np.finfo(float).tiny)
    scaled = body.stiffness * scale[:, None] * scale
    if not np.isfinite(scaled).all():
        problem = "has entries beyond all measure beside those on its diagonal"
        raise InputError(where, "stiffness", problem, "export the full matrix")
    values = np.linalg.eigvalsh(scaled)
    free = int(np.count_nonzero(values < FREE))
    if free != 6:
        raise InputError(
            where, "stiffness", f"has {free} motions without stiffness, a free body six",
            "export a body that is whole, with all six dofs of its nodes",
        )  # fmt: skip
    small = np.finfo(float).eps * np.abs(np.diag(body.mass)).max()
    try:
        squares = scipy.linalg.eigh(
            body.stiffness, body.mass + small * np.eye(len(body.mass)), eigvals_only=True
        )
    except (np.linalg.LinAlgError, ValueError):  # ValueError: sums that overflow
        raise InputError(
            where, "mass", "is not positive definite", "export the consistent mass"
        ) from None
    return float(np.sqrt(max(squares[6], 0.0)) / (2 * np.pi))


@dataclass(frozen=True, eq=False)
class NodeTable:
    """Nodes in the order of the matrices: ids as the program numbers them, positions (n, 3) m;
    mode_ids: ids of the modal coordinates behind them."""

    ids: tuple[int, ...]
    names: tuple[str, ...]
    positions: Array
    mode_ids: tuple[int, ...] = ()


def table_text(names: tuple[str, ...], positions: Array, modes: int) -> str:
    """The table as CSV; ids count from 1 through nodes and modes."""
    out = io.StringIO()
    rows = csv.writer(out, lineterminator="\n")
    rows.writerow(["row", "id", "name", "x_m", "y_m", "z_m"])
    for k, (name, place) in enumerate(zip(names, positions, strict=True)):
        rows.writerow([6 * k + 1, k + 1, name, *(repr(float(v)) for v in place)])
    for k in range(modes):
        rows.writerow([6 * len(names) + k + 1, len(names) + k + 1, f"mode_{k + 1:03d}", "", "", ""])
    return out.getvalue()


def read_table(path: Path) -> NodeTable:
    """A table from a CSV file. InputError for what cannot be read."""
    where = str(path)
    header, rows, separator = read_cells(path, "table of nodes")
    heads = [head.lower() for head in header]
    unit = next((u for u in LENGTHS if {f"{axis}_{u}" for axis in "xyz"} <= {*heads}), None)
    if unit is None:
        raise InputError(
            where, "columns", f"{echo(', '.join(heads))} lack positions",
            "give id, name, x_m, y_m, z_m (or x_mm …)",
        )  # fmt: skip
    axes = [f"{axis}_{unit}" for axis in "xyz"]
    entries: list[dict[str, str]] = []
    for number, row in rows:
        require_titles(row, header, where, number)
        cells = [cell.strip() for cell in row] + [""] * (len(heads) - len(row))
        entries.append({**dict(zip(heads, cells, strict=False)), "line": f"line {number}"})
    if "row" in heads:
        entries.sort(key=lambda row: _whole(row["row"], where, "row"))
    nodes = [row for row in entries if row[axes[0]]]
    modes = [row for row in entries if not row[axes[0]]]
    ids = [_whole(row.get("id", str(k)), where, "id") for k, row in enumerate(nodes, 1)]
    if not nodes or len({*ids}) < len(ids):
        problem = "are there twice" if nodes else "are none"
        raise InputError(where, "nodes", problem, "give each node one row with an id of its own")
    places = [
        [number_in(row[axis], separator, where, f"{row['line']}, {axis}") for axis in axes]
        for row in nodes
    ]
    names = [row.get("name") or f"node_{k}" for k, row in zip(ids, nodes, strict=True)]
    mode_ids = tuple(_whole(row["id"], where, "id") for row in modes if row.get("id"))
    return NodeTable(tuple(ids), tuple(names), LENGTHS[unit] * np.array(places), mode_ids)


def _whole(text: str, where: str, key: str) -> int:
    try:
        return int(text)
    except ValueError:
        raise InputError(where, key, f"{echo(text)} is not whole", "write whole numbers") from None


MOST_MODES = 5000  # modal coordinates of a body; hundreds are usual
_REAL = "fiu"  # kinds of NumPy's that are real numbers


def require_form(shape: Sequence[int], where: str, key: str, table: NodeTable) -> None:
    """InputError unless a matrix of this shape can belong to the nodes of a table; asked before
    anything of that size is made."""
    key, rows = key or "matrix", 6 * len(table.ids)
    if len(shape) != 2 or 0 in shape:
        size = " x ".join(map(str, shape)) or "a single number"
        raise InputError(where, key, f"is {size}, no matrix", "write rows and columns")
    if shape[1] > rows + MOST_MODES:
        raise InputError(
            where, key, f"is {shape[0]} x {shape[1]}",
            f"the {len(table.ids)} nodes have {rows} rows, and up to {MOST_MODES} modal "
            "coordinates may follow",
        )  # fmt: skip
    if 8 * math.prod(shape) > MOST_MATRICES:
        problem = f"is {shape[0]} x {shape[1]}, more than {MOST_MATRICES // MEGABYTE} MB"
        raise InputError(where, key, problem, "recover displacements at fewer points")


def require_real(dtype: np.dtype[Any], where: str, key: str) -> None:
    """InputError for other than real numbers."""
    if dtype.kind not in _REAL:
        raise InputError(where, key or "matrix", f"holds {dtype}", "write real numbers")


def sound(matrix: Any, where: str, key: str, table: NodeTable) -> NDArray[np.float64]:
    """The matrix in double precision; InputError unless it is one of finite real numbers."""
    array = np.asarray(matrix)
    require_form(array.shape, where, key, table)
    require_real(array.dtype, where, key)
    if not np.isfinite(array).all():
        raise InputError(
            where, key or "matrix", "holds entries that are no numbers", "export it again"
        )
    return np.asarray(array, dtype=np.float64)
