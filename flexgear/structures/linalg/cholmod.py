"""CHOLMOD of CVXOPT with the BLAS kernels that NumPy has for this processor.

CVXOPT's wheel carries OpenBLAS 0.3.15 of 2021, which runs processors it does not know with kernels
of 2004: products of matrices take five times, factors of solid bodies three times as long. OpenBLAS
reads the name of its kernels from the environment while it is loaded; a name set by the user stays.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np  # noqa: F401  loads the OpenBLAS that knows this processor
from threadpoolctl import threadpool_info  # type: ignore[import-untyped]

_VARIABLE = "OPENBLAS_CORETYPE"
_SAME = {  # kernels of OpenBLAS 0.3.15 by those of later versions, for the same instructions
    "haswell": "Haswell",
    "zen": "Zen",
    "skylakex": "SkylakeX",
    "cooperlake": "SkylakeX",
    "sapphirerapids": "SkylakeX",
}


@contextmanager
def _kernels_of_numpy() -> Iterator[None]:
    """Context in which an OpenBLAS that is loaded takes the same kernels as NumPy's, if both have
    them."""
    names = [str(x.get("architecture")).lower() for x in threadpool_info()]
    kernels = next((_SAME[name] for name in names if name in _SAME), None)
    if kernels is None or _VARIABLE in os.environ:
        yield
        return
    os.environ[_VARIABLE] = kernels
    try:
        yield
    finally:
        del os.environ[_VARIABLE]


with _kernels_of_numpy():
    from cvxopt import matrix as dense_matrix
    from cvxopt import spmatrix
    from cvxopt.cholmod import getfactor, numeric, options, solve, spsolve, symbolic

__all__ = [
    "dense_matrix", "getfactor", "numeric", "options", "solve", "spmatrix", "spsolve", "symbolic",
]  # fmt: skip
