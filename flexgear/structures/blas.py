"""Products of matrices added in place, by SciPy's BLAS, with the interpreter's lock let go.

scipy.linalg.blas holds the lock while it works, and NumPy's product wants a result of its own.
Arrays have contiguous rows, or contiguous columns where they are operands.
"""

from __future__ import annotations

from ctypes import byref, c_char, c_double, c_int

import numpy as np
from numpy.typing import NDArray

from flexgear.structures.routines import scipy_routine

Array = NDArray[np.float64]

_gemm, _syrk = scipy_routine("blas", "dgemm", 13), scipy_routine("blas", "dsyrk", 10)
_NORMAL, _TRANSPOSED, _UPPER = byref(c_char(b"N")), byref(c_char(b"T")), byref(c_char(b"U"))


def add_product(alpha: float, a: Array, b: Array, beta: float, c: Array) -> None:
    """c <- alpha a b + beta c of a (m, k), b (k, n), c (m, n)."""
    m, n = c.shape
    k = a.shape[1]
    assert a.shape == (m, k) and b.shape == (k, n)
    if not k:
        c *= beta
    if not m or not n or not k:
        return
    flag_a, lead_a = _read(a)
    flag_b, lead_b = _read(b)
    _gemm(  # BLAS reads rows as columns: c^T = b^T a^T
        flag_b,
        flag_a,
        byref(c_int(n)),
        byref(c_int(m)),
        byref(c_int(k)),
        byref(c_double(alpha)),
        b.ctypes.data,
        lead_b,
        a.ctypes.data,
        lead_a,
        byref(c_double(beta)),
        c.ctypes.data,
        _lead(c),
    )


def subtract_square(a: Array, c: Array) -> None:
    """c <- c - a a^T, lower triangle, of a (m, k), c (m, m), both with contiguous rows."""
    m, k = a.shape
    assert c.shape == (m, m)
    if not m:
        return
    _syrk(
        _UPPER,
        _TRANSPOSED,
        byref(c_int(m)),
        byref(c_int(k)),
        byref(c_double(-1.0)),
        a.ctypes.data,
        _lead(a),
        byref(c_double(1.0)),
        c.ctypes.data,
        _lead(c),
    )


def _read(a: Array):  # type: ignore[no-untyped-def]
    """How BLAS reads an operand, and the step between its rows (columns)."""
    if a.strides[1] == a.itemsize:
        return _NORMAL, _lead(a)
    return _TRANSPOSED, _lead(a.T)


def _lead(a: Array):  # type: ignore[no-untyped-def]
    """Entries from row to row."""
    assert a.strides[1] == a.itemsize and a.dtype == np.float64
    return byref(c_int(max(a.strides[0] // a.itemsize, a.shape[1])))
