"""The table of nodes beside reduced matrices, as CSV.

Columns: row (first row of the node in the matrices, from 1; six follow one another), id, name, and
x, y, z with their unit: x_m or x_mm. Rows without a position are modal coordinates.
"""

from __future__ import annotations

import csv
import io
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexgear.files.matrices.body import LENGTHS
from flexgear.model.errors import InputError, echo

Array = NDArray[np.float64]


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


def read_table(text: str, where: str) -> NodeTable:
    """A table from CSV. InputError for what cannot be read."""
    try:
        rows = [row for row in csv.reader(io.StringIO(text)) if any(c.strip() for c in row)]
    except csv.Error as error:
        raise InputError(where, "table", f"cannot be read: {error}", "save it as CSV") from None
    heads = [head.strip().lower() for head in rows[0]] if rows else []
    unit = next((u for u in LENGTHS if {f"{axis}_{u}" for axis in "xyz"} <= {*heads}), None)
    if unit is None:
        raise InputError(
            where, "columns", f"{echo(', '.join(heads))} lack positions",
            "give id, name, x_m, y_m, z_m (or x_mm …)",
        )  # fmt: skip
    entries = [_by_head(heads, row, where, number) for number, row in enumerate(rows[1:], 2)]
    if "row" in heads:
        entries.sort(key=lambda row: _whole(row["row"], where, "row"))
    axes = [f"{axis}_{unit}" for axis in "xyz"]
    nodes = [row for row in entries if row.get(axes[0])]
    modes = [row for row in entries if not row.get(axes[0])]
    ids = [_whole(row.get("id", str(k)), where, "id") for k, row in enumerate(nodes, 1)]
    if not nodes or len({*ids}) < len(ids):
        problem = "are there twice" if nodes else "are none"
        raise InputError(where, "nodes", problem, "give each node one row with an id of its own")
    places = [[_number(row[axis], where, axis) for axis in axes] for row in nodes]
    names = [row.get("name") or f"node_{k}" for k, row in zip(ids, nodes, strict=True)]
    mode_ids = tuple(_whole(row["id"], where, "id") for row in modes if row.get("id"))
    return NodeTable(tuple(ids), tuple(names), LENGTHS[unit] * np.array(places), mode_ids)


def _by_head(heads: list[str], row: list[str], where: str, number: int) -> dict[str, str]:
    """Cells by column; modal coordinates may leave out the empty ones at the end."""
    cells = [cell.strip() for cell in row]
    full = cells + [""] * (len(heads) - len(cells))
    cells_by_head = dict(zip(heads, full, strict=False))
    if len(cells) != len(heads) and any(cells_by_head.get(f"x_{unit}") for unit in LENGTHS):
        raise InputError(
            where, f"row {number}", f"has {len(cells)} columns, the first {len(heads)}",
            "give every node all of them",
        )  # fmt: skip
    return cells_by_head


def _whole(text: str, where: str, key: str) -> int:
    try:
        return int(text)
    except ValueError:
        raise InputError(where, key, f"{echo(text)} is not whole", "write whole numbers") from None


def _number(text: str, where: str, key: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError(where, key, f"{echo(text)} is no number", "write numbers")
    return value
