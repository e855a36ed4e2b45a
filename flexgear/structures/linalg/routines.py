"""SciPy's BLAS and LAPACK routines themselves: its wrappers hold the interpreter's lock."""

from __future__ import annotations

import ctypes
from collections.abc import Callable

from numba.extending import get_cython_function_address


def scipy_routine(library: str, name: str, arguments: int) -> Callable[..., None]:
    """A routine of ``scipy.linalg.cython_<library>``; it takes addresses."""
    address = get_cython_function_address(f"scipy.linalg.cython_{library}", name)
    kinds = (ctypes.c_void_p,) * arguments
    return ctypes.CFUNCTYPE(None, *kinds)(address)  # type: ignore[return-value]
