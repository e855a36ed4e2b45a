"""Matrices that a file lists entry by entry, by node and component: DMIG, Abaqus, CalculiX.

Nastran DMIG bulk data: real matrices by grid point and component.

DMIG NAME 0 IFO TIN …, then columns DMIG NAME GJ CJ _ G1 C1 A1 _ G2 C2 A2 …; IFO 6 is symmetric,
given as one triangle. Fields of 8 letters, of 16 (DMIG*), or separated by commas; component 0 is a
scalar point, a modal coordinate. Source: MSC Nastran quick reference guide.

Matrices of Abaqus and CalculiX: *MATRIX GENERATE output, and substructures as user elements.

Lines "node, component, node, component, value" (matrix input format), or *USER ELEMENT with the
dofs of its nodes and *MATRIX, TYPE=STIFFNESS or MASS with one triangle row by row, as *SUBSTRUCTURE
MATRIX OUTPUT writes.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from flexgear.files.matrices.body import NodeTable, require_form
from flexgear.model.errors import InputError

Place = tuple[int, int]


@dataclass
class Entries:
    """Entries of one matrix; component 0: a modal coordinate; symmetric: given as one triangle."""

    symmetric: bool
    values: dict[tuple[Place, Place], float] = field(default_factory=dict)

    def add(self, row: Place, column: Place, value: float) -> None:
        """One entry."""
        self.values[row, column] = value

    def matrix(self, table: NodeTable, where: str) -> NDArray[np.float64]:
        """The matrix (d, d) with rows in the table's order, modal coordinates behind the nodes."""
        rows = {(node, c): 6 * k + c - 1 for k, node in enumerate(table.ids) for c in range(1, 7)}
        named = {place for pair in self.values for place in pair}
        extra = sorted({*named} - {*rows}, key=lambda p: _order(p, table))
        lost = [node for node, component in extra if component != 0]
        if lost:
            raise InputError(
                where, "nodes", f"the matrices name node {lost[0]}, which the table lacks",
                "give a table of all their nodes",
            )  # fmt: skip
        rows |= {place: 6 * len(table.ids) + k for k, place in enumerate(extra)}
        require_form((len(rows), len(rows)), where, "", table)
        dense = np.zeros((len(rows), len(rows)))
        for (row, column), value in self.values.items():
            dense[rows[row], rows[column]] = value
            if self.symmetric:
                dense[rows[column], rows[row]] = value
        return dense


def _order(place: Place, table: NodeTable) -> tuple[int, int]:
    number = table.mode_ids.index(place[0]) if place[0] in table.mode_ids else len(table.mode_ids)
    return number, place[0]


_SYMMETRIC = 6


def read_dmig(text: str, where: str) -> dict[str, Entries]:
    """All real DMIG matrices of bulk data, by name."""
    matrices: dict[str, Entries] = {}
    try:
        for card in _cards(text):
            name, first = card[1].upper(), card[2].strip()
            if first in ("", "0"):
                if int(card[4] or 1) > 2:
                    raise ValueError(f"{name} is complex")
                matrices[name] = Entries(symmetric=int(card[3]) == _SYMMETRIC)
                continue
            column = int(first), int(card[3] or 0)
            for k in range(5, len(card) - 2, 4):
                if card[k].strip():
                    row = int(card[k]), int(card[k + 1] or 0)
                    matrices[name].add(row, column, _number(card[k + 2]))
    except (IndexError, KeyError, ValueError) as error:
        raise InputError(
            where, "DMIG", f"cannot be read: {error}", "write real DMIG cards with their header"
        ) from None
    return matrices


def _cards(text: str) -> list[list[str]]:
    """DMIG cards with their continuation lines, as fields; field 0 is the card's name."""
    cards: list[list[str]] = []
    inside = False
    for raw in text.splitlines():
        line = raw.split("$")[0].rstrip()
        if not line:
            continue
        if re.match(r"DMIG\b", line, re.IGNORECASE):
            cards.append(_fields(line))
            inside = True
        elif inside and line[0] in "*+ ,":
            cards[-1] += _fields(line)[1:]
        else:
            inside = False
    return cards


def _fields(line: str) -> list[str]:
    """Ten fields, without the last, which names the continuation."""
    if "," in line:
        return [f.strip() for f in (line.split(",") + [""] * 9)[:9]]
    wide = "*" in line[:8]
    step, count = (16, 4) if wide else (8, 8)
    body = line[8:].ljust(step * count)
    return [line[:8].strip(), *(body[k * step : (k + 1) * step].strip() for k in range(count))]


def _number(text: str) -> float:
    """Nastran writes 1.2-5 and 1.2D-5 for 1.2e-5."""
    plain = text.strip().upper().replace("D", "E")
    return float(re.sub(r"(?<=[0-9.])([+-])", r"E\1", plain) if "E" not in plain else plain)


_FIVE = 5


def read_abaqus(text: str, where: str) -> dict[str, Entries]:
    """Matrices by name: "STIFFNESS", "MASS", or "MATRIX" for one whose name is not in the file."""
    try:
        if re.search(r"^\s*\*\s*USER ELEMENT", text, re.IGNORECASE | re.MULTILINE):
            return _user_element(text)
        return {"MATRIX": _listed(text)}
    except (ValueError, IndexError) as error:
        raise InputError(
            where, "matrix", f"cannot be read: {error or 'it ends too early'}",
            "write it with *MATRIX OUTPUT, FORMAT=MATRIX INPUT or *SUBSTRUCTURE MATRIX OUTPUT",
        ) from None  # fmt: skip


def _listed(text: str) -> Entries:
    rows = [
        re.split(r"[,\s]+", line.strip().rstrip(","))
        for line in text.splitlines()
        if line.strip() and line.strip()[0] not in "*#%"
    ]
    if not rows or any(len(row) != _FIVE for row in rows):
        raise ValueError("lines have other than five numbers")
    entries = Entries(symmetric=False)
    for a, i, b, j, value in rows:
        entries.add((int(a), int(i)), (int(b), int(j)), float(value.replace("D", "E")))
    entries.symmetric = not any(
        row != column and (column, row) in entries.values for row, column in entries.values
    )
    return entries


def _user_element(text: str) -> dict[str, Entries]:
    nodes: list[int] = []
    dofs: list[Place] = []
    matrices: dict[str, Entries] = {}
    state = ""
    numbers: list[float] = []
    blocks: list[tuple[str, list[float]]] = []
    for raw in text.splitlines():
        line = raw.strip()
        if line.upper().startswith("** ELEMENT NODES"):
            state = "nodes"
        elif state == "nodes" and line.startswith("**") and re.search(r"\d", line):
            nodes += [int(n) for n in re.findall(r"\d+", line)]
        elif line.startswith("**") or not line:
            continue
        elif line.startswith("*"):
            kind = re.match(r"\*\s*MATRIX\s*,\s*TYPE\s*=\s*(\w+)", line, re.IGNORECASE)
            numbers = []
            state = "dofs" if line.upper().replace(" ", "").startswith("*USERELEMENT") else ""
            if kind is not None:
                state = "matrix"
                blocks.append((kind[1].upper(), numbers))
        elif state == "dofs":
            _dofs(line, nodes, dofs)
        elif state == "matrix":
            numbers += [float(v.replace("D", "E")) for v in re.split(r"[,\s]+", line) if v]
    for name, values in blocks:
        matrices[name] = _triangle(values, dofs)
    if not matrices:
        raise ValueError("there is no *MATRIX")
    return matrices


def _dofs(line: str, nodes: list[int], dofs: list[Place]) -> None:
    """A line of *USER ELEMENT: dofs of the first node, or the number of a node and its dofs."""
    values = [int(v) for v in re.split(r"[,\s]+", line.strip(", ")) if v]
    if not dofs:
        first = nodes[0] if nodes else 1
        dofs += [(first, component) for component in values]
        return
    place, components = values[0], values[1:]
    node = nodes[place - 1] if nodes else place
    dofs += [(node, component) for component in components]


def _triangle(values: list[float], dofs: list[Place]) -> Entries:
    """Rows of the lower triangle."""
    size = len(dofs)
    if len(values) != size * (size + 1) // 2:
        raise ValueError(f"{len(values)} numbers are no triangle of {size} rows")
    entries = Entries(symmetric=True)
    for value, row, column in zip(values, *np.tril_indices(size), strict=True):
        entries.add(dofs[row], dofs[column], value)
    return entries
