"""Inverses of Hermitian matrices, which threads compute beside one another."""

from __future__ import annotations

import ctypes
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from flexgear.structures.linalg.routines import scipy_routine

Complex = NDArray[np.complex128]


_zpotrf, _zpotri = scipy_routine("lapack", "zpotrf", 5), scipy_routine("lapack", "zpotri", 5)
_zhetrf, _zhetri2 = scipy_routine("lapack", "zhetrf", 8), scipy_routine("lapack", "zhetri2", 8)


def definite_inverse(matrix: Complex) -> Complex:
    """Lower triangle (n, n) for a positive definite one.

    Raises numpy.linalg.LinAlgError where it is not.
    """
    a = np.array(matrix, order="F")
    n, lower = ctypes.c_int(len(a)), ctypes.c_char(b"L")
    for routine in (_zpotrf, _zpotri):
        _call(routine, lower, n, a, n)
    return a


def regular_inverse(matrix: Complex) -> tuple[Complex, int]:
    """Lower triangle (n, n) for a regular one, and how many of its eigenvalues are negative.

    A = L D L^H has as many as D (Sylvester); of Bunch and Kaufman's 2 x 2 blocks, one each.
    Raises numpy.linalg.LinAlgError where it is not regular.
    """
    a = np.array(matrix, order="F")
    n, lower = ctypes.c_int(len(a)), ctypes.c_char(b"L")
    pivots = np.empty(len(a), dtype=np.intc)
    negative = 0
    for routine in (_zhetrf, _zhetri2):
        wanted = np.empty(1, dtype=complex)
        _call(routine, lower, n, a, n, pivots, wanted, ctypes.c_int(-1))
        room = np.empty(int(wanted[0].real), dtype=complex)
        _call(routine, lower, n, a, n, pivots, room, ctypes.c_int(len(room)))
        if routine is _zhetrf:
            single = pivots > 0
            negative = int((a.diagonal().real[single] < 0).sum() + (~single).sum() // 2)
    return a, negative


def _call(routine: Callable[..., None], *arguments: object) -> None:
    """With addresses of all arguments and of info, LAPACK's verdict."""
    info = ctypes.c_int(0)
    routine(*map(_address, arguments), _address(info))
    if info.value:
        raise np.linalg.LinAlgError(f"LAPACK stopped at row {info.value}")


def _address(argument: object) -> int:
    if isinstance(argument, np.ndarray):
        return argument.ctypes.data
    return ctypes.addressof(argument)  # type: ignore[arg-type]
