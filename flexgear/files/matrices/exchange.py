"""Reading and writing of reduced matrices for exchange with other programs.

The format follows from a file's content: OP4 (text, binary), DMIG, Matrix Market, Abaqus and
CalculiX, npz. The name of a matrix in the file, or else the name of the file, states its role:
k… or …stiff… is stiffness, m… or …mass… is mass.
"""

import io
import re
import zipfile
from collections.abc import Iterable
from pathlib import Path
from typing import IO, Any

import numpy as np
import scipy.io
import scipy.sparse as sp

from flexgear.arrays import Array
from flexgear.files.matrices.body import (
    LENGTHS,
    NodeTable,
    ReducedMatrices,
    as_double,
    read_table,
    require_form,
    require_real,
    require_shapes,
    table_text,
)
from flexgear.files.matrices.formats import op4_text, read_abaqus, read_dmig, read_op4
from flexgear.model.errors import InputError
from flexgear.model.input_file import DAMAGED, MAX_MATRIX_BYTES, read_bytes

_HEADERS = {
    (1, 0): np.lib.format.read_array_header_1_0,
    (2, 0): np.lib.format.read_array_header_2_0,
}


def read_reduced(
    files: Iterable[str | Path], nodes: str | Path, units: str = "m", name: str = "body"
) -> ReducedMatrices:
    """Read a reduced body in SI from one or more files of matrices and its table of nodes.

    units: "m" for SI, "mm" for N, mm, t, s. Raises InputError for a file that cannot be read
    and for matrices that are not square or lack rows of nodes; ``check`` checks the rest.
    """
    if units not in LENGTHS:
        raise InputError("units", units, "is unknown", f"choose {', '.join(LENGTHS)}")
    table = read_table(Path(nodes))
    matrices: dict[str, Array] = {}
    for file in files:
        data = read_bytes(Path(file), "file", MAX_MATRIX_BYTES)
        for key, matrix in matrices_of(data, file, table).items():
            role = _role(key) or _role(Path(file).stem)
            if role is not None:
                matrices[role] = matrix
    for role in ("stiffness", "mass"):
        if role not in matrices:
            remedy = "name the matrices K… and M…, or the files …stiffness and …mass"
            raise InputError(str(nodes), role, "is in none of the files", remedy)
    reduced = ReducedMatrices(
        name,
        table.names,
        table.positions,
        matrices["stiffness"],
        matrices["mass"],
        matrices.get("recovery"),
    )
    require_shapes(reduced, str(nodes))
    return reduced.in_si(units)


def matrices_of(data: bytes, file: str | Path, table: NodeTable) -> dict[str, Array]:
    """All matrices of a file by name, rows and columns in the order of the table. The header of a
    matrix is checked for shape and type before the matrix is unpacked."""
    where = str(file)
    read = _numpy if data.startswith((b"PK", b"\x93NUMPY")) else _text_or_binary
    matrices = read(data, where, table)
    return {key: as_double(matrix, where, key, table) for key, matrix in matrices.items()}


def _text_or_binary(data: bytes, where: str, table: NodeTable) -> dict[str, Any]:
    if data.lstrip().startswith(b"%%MatrixMarket"):
        return _matrix_market(data, where, table)
    if b"\0" in data[:64] or re.match(rb"\s*\d+\s+-?\d+\s+\d+\s+[1-4][A-Za-z]", data):

        def require(shape: tuple[int, int], key: str) -> None:
            require_form(shape, where, key, table)

        return dict(read_op4(data, where, require))
    text = data.decode("utf-8", errors="replace")
    if re.search(r"^DMIG\b", text, re.IGNORECASE | re.MULTILINE):
        entries = read_dmig(text, where)
    else:
        entries = read_abaqus(text, where)
    return {key: matrix_entries.matrix(table, where) for key, matrix_entries in entries.items()}


def _role(name: str) -> str | None:
    """ "recovery", "stiffness" or "mass" by the name of a matrix or file, else None."""
    name = name.lower()
    for role, pattern in (
        ("recovery", r"recov|^otm|^psi"),
        ("stiffness", r"stif|^k([^a-z]|aa|gg|red|xx|2gg|\d|$)|_k$"),
        ("mass", r"mass|^m([^a-z]|aa|gg|red|xx|2gg|\d|$)|_m$"),
    ):
        if re.search(pattern, name):
            return role
    return None


def _numpy(data: bytes, where: str, table: NodeTable) -> dict[str, Any]:
    try:
        if not data.startswith(b"PK"):
            _require_header(io.BytesIO(data), where, "", table)
            return {"": np.load(io.BytesIO(data), allow_pickle=False)}
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            arrays = {}
            for member in archive.namelist():
                key = member.removesuffix(".npy")
                with archive.open(member) as stream:
                    _require_header(stream, where, key, table)
                with archive.open(member) as stream:
                    arrays[key] = np.lib.format.read_array(stream, allow_pickle=False)
        return arrays
    except DAMAGED as error:
        raise InputError(where, "npz", f"cannot be read: {error}", "write it with savez") from None


def _require_header(stream: IO[bytes], where: str, key: str, table: NodeTable) -> None:
    """Raise InputError unless NumPy's header describes a real matrix that fits the table."""
    version = np.lib.format.read_magic(stream)
    if version not in _HEADERS:
        raise ValueError(f"version {version} of npy is not for matrices")
    shape, _, dtype = _HEADERS[version](stream)
    require_form(shape, where, key, table)
    require_real(dtype, where, key)


def _matrix_market(data: bytes, where: str, table: NodeTable) -> dict[str, Any]:
    try:
        rows, columns, entries, form, _, symmetry = scipy.io.mminfo(io.BytesIO(data))
        require_form((rows, columns), where, "", table)
        if form == "array":  # of which SciPy fills up what is missing with zeros
            lines = (line for line in data.splitlines() if not line.startswith(b"%"))
            count = sum(len(line.split()) for line in lines) - 2
            needed = rows * (rows + 1) // 2 if symmetry == "symmetric" else entries
            if count < needed:
                raise ValueError(f"has {count} of {needed} numbers")
        matrix = scipy.io.mmread(io.BytesIO(data))
    except (ValueError, OverflowError, OSError) as error:
        problem = f"cannot be read: {error}"
        raise InputError(where, "Matrix Market", problem, "is the file whole?") from None
    return {"": matrix.toarray() if sp.issparse(matrix) else matrix}


FORMATS = ("op4", "mtx", "npz")
_OP4_NAMES = {"stiffness": "KRED", "mass": "MRED", "recovery": "RECOV"}


def write_reduced(body: ReducedMatrices, folder: Path, form: str) -> list[Path]:
    """Write <name>_nodes.csv and <name>.op4, <name>.npz or <name>_stiffness.mtx …; returns paths.

    Matrices are in N, m, kg. The recovery (m per coordinate) at the points of <name>_vertices.csv
    is written if the body has one. form: one of FORMATS.
    """
    matrices = {"stiffness": body.stiffness, "mass": body.mass}
    texts = {f"{body.name}_nodes.csv": table_text(body.node_names, body.positions, body.modes)}
    if body.recovery is not None and body.points is not None:
        matrices["recovery"] = np.asarray(body.recovery, dtype=np.float64)
        rows = (",".join(repr(float(v)) for v in point) for point in body.points)
        texts[f"{body.name}_vertices.csv"] = "x_m,y_m,z_m\n" + "\n".join(rows) + "\n"
    files = {name: text.encode() for name, text in texts.items()}
    files |= _matrix_files(body.name, matrices, form)
    for name, data in files.items():
        (folder / name).write_bytes(data)
    return [folder / name for name in files]


def _matrix_files(name: str, matrices: dict[str, Array], form: str) -> dict[str, bytes]:
    if form == "op4":
        named = {_OP4_NAMES[key]: matrix for key, matrix in matrices.items()}
        return {f"{name}.op4": op4_text(named).encode()}
    if form == "npz":
        data = io.BytesIO()
        np.savez_compressed(data, **matrices)  # type: ignore[arg-type]
        return {f"{name}.npz": data.getvalue()}
    files = {}
    for key, matrix in matrices.items():
        data = io.BytesIO()
        symmetry = "symmetric" if key != "recovery" else "general"
        scipy.io.mmwrite(data, matrix, comment=f"{name} {key}, SI", precision=17, symmetry=symmetry)
        files[f"{name}_{key}.mtx"] = data.getvalue()
    return files
