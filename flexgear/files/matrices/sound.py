"""What a matrix of a file must be: before it is unpacked from the figures of its header, then
itself."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexgear.files.matrices.nodes import NodeTable
from flexgear.model.errors import InputError
from flexgear.model.input_file import MEGABYTE, MOST_MATRICES

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
