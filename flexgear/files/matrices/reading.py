"""Reads reduced matrices of other programs with their table of nodes.

Formats by content: OP4 (text, binary), DMIG, Matrix Market, Abaqus and CalculiX, npz. Which matrix
is which follows from its name in the file, else from that of the file: k… or …stiff… is stiffness,
m… or …mass… mass.
"""

from __future__ import annotations

import io
import re
import zipfile
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import scipy.io
import scipy.sparse as sp
from numpy.typing import NDArray

from flexgear.files.matrices.abaqus import read_abaqus
from flexgear.files.matrices.body import LENGTHS, ReducedMatrices
from flexgear.files.matrices.dmig import read_dmig
from flexgear.files.matrices.nodes import NodeTable, read_table
from flexgear.files.matrices.op4 import read_op4
from flexgear.model.errors import InputError

Array = NDArray[np.float64]


def read_reduced(
    files: Iterable[str | Path], nodes: str | Path, units: str = "m", name: str = "body"
) -> ReducedMatrices:
    """A reduced body in SI from one or more files of matrices and its table of nodes.

    units: "m" for SI, "mm" for N, mm, t, s. Raises InputError; ``check`` judges what was read.
    """
    if units not in LENGTHS:
        raise InputError("units", units, "is unknown", f"choose {', '.join(LENGTHS)}")
    table = read_table(_bytes(nodes).decode("utf-8-sig", errors="replace"), str(nodes))
    found: dict[str, Array] = {}
    for file in files:
        for key, matrix in matrices_of(_bytes(file), file, table).items():
            role = _role(key) or _role(Path(file).stem)
            if role is not None:
                found[role] = matrix
    for role in ("stiffness", "mass"):
        if role not in found:
            raise InputError(
                str(nodes), role, "is in none of the files",
                "name the matrices K… and M…, or the files …stiffness and …mass",
            )  # fmt: skip
    made = ReducedMatrices(
        name, table.names, table.positions, found["stiffness"], found["mass"], found.get("recovery")
    )
    return made.in_si(units)


def matrices_of(data: bytes, file: str | Path, table: NodeTable) -> dict[str, Array]:
    """All matrices of a file by name, entries by node in the order of the table."""
    where = str(file)
    if data.startswith((b"PK", b"\x93NUMPY")):
        return _numpy(data, where)
    if data.lstrip().startswith(b"%%MatrixMarket"):
        return _matrix_market(data, where)
    if b"\0" in data[:64] or re.match(rb"\s*\d+\s+-?\d+\s+\d+\s+[1-4][A-Za-z]", data):
        return read_op4(data, where)
    text = data.decode("utf-8", errors="replace")
    if re.search(r"^DMIG\b", text, re.IGNORECASE | re.MULTILINE):
        entries = read_dmig(text, where)
    else:
        entries = read_abaqus(text, where)
    return {key: one.matrix(table, where) for key, one in entries.items()}


def _role(name: str) -> str | None:
    plain = name.lower()
    for role, pattern in (
        ("recovery", r"recov|^otm|^psi"),
        ("stiffness", r"stif|^k([^a-z]|aa|gg|red|xx|2gg|\d|$)|_k$"),
        ("mass", r"mass|^m([^a-z]|aa|gg|red|xx|2gg|\d|$)|_m$"),
    ):
        if re.search(pattern, plain):
            return role
    return None


def _numpy(data: bytes, where: str) -> dict[str, Array]:
    try:
        loaded = np.load(io.BytesIO(data), allow_pickle=False)
        if isinstance(loaded, np.ndarray):
            return {"": np.asarray(loaded, dtype=np.float64)}
        return {key: np.asarray(loaded[key], dtype=np.float64) for key in loaded.files}
    except (ValueError, OSError, zipfile.BadZipFile, EOFError) as error:
        raise InputError(where, "npz", f"cannot be read: {error}", "write it with savez") from None


def _matrix_market(data: bytes, where: str) -> dict[str, Array]:
    try:
        matrix = scipy.io.mmread(io.BytesIO(data))
    except (ValueError, OverflowError, OSError) as error:
        raise InputError(
            where, "Matrix Market", f"cannot be read: {error}", "is the file whole?"
        ) from None
    dense = matrix.toarray() if sp.issparse(matrix) else matrix
    return {"": np.asarray(dense, dtype=np.float64)}


def _bytes(path: str | Path) -> bytes:
    try:
        return Path(path).read_bytes()
    except (OSError, ValueError) as error:
        said = getattr(error, "strerror", None) or str(error)
        raise InputError(str(path), "file", f"cannot be read: {said}", "check its name") from None
