"""Matrices of Abaqus and CalculiX: *MATRIX GENERATE output, and substructures as user elements.

Lines "node, component, node, component, value" (matrix input format), or *USER ELEMENT with the
dofs of its nodes and *MATRIX, TYPE=STIFFNESS or MASS with one triangle row by row, as *SUBSTRUCTURE
MATRIX OUTPUT writes.
"""

from __future__ import annotations

import re

import numpy as np

from flexgear.files.matrices.entries import Entries, Place
from flexgear.model.errors import InputError

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
