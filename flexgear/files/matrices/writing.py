"""Writes reduced bodies for other programs: matrices, table of nodes, recovery."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import scipy.io
from numpy.typing import NDArray

from flexgear.files.matrices.body import ReducedMatrices
from flexgear.files.matrices.nodes import table_text
from flexgear.files.matrices.op4 import op4_text
from flexgear.model.errors import InputError

Array = NDArray[np.float64]
FORMATS = ("op4", "mtx", "npz")
NAMES = {"stiffness": "KRED", "mass": "MRED", "recovery": "RECOV"}


def write_reduced(body: ReducedMatrices, folder: Path, form: str) -> list[Path]:
    """Files <name>_nodes.csv and <name>.op4, <name>.npz or <name>_stiffness.mtx …; their paths.

    Matrices in N, m, kg; the recovery (m per coordinate) at the vertices of <name>_vertices.csv is
    written if the body has one. InputError for an unknown form.
    """
    if form not in FORMATS:
        raise InputError("--format", form, "is unknown", f"choose {', '.join(FORMATS)}")
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
        named = {NAMES[key]: matrix for key, matrix in matrices.items()}
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
