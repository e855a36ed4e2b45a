"""How loops are compiled by numba: options of functions called from Python, and of inner ones.

Wrappers for callers that never come take a good part of the compilation. Arrays are counted by
every function that takes or slices them unless it is told not to: work arrays outlive the loops
that use them, and counting took a third of a time step. Such functions must not make arrays.

Where numba's own switch NUMBA_DISABLE_JIT is set, as it is by commands that look at a train in one
position only, loops of the coupling run as they are and numba, which takes as long to load as all
the rest, is not imported.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

UNCOMPILED = os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0")

# a division by zero is not looked for, as in NumPy: looking costs a branch each
UNCOUNTED: dict[str, Any] = {"no_cfunc_wrapper": True, "error_model": "numpy"}
if not UNCOMPILED:
    from flexgear.coupling.numba_setup import CAN_LEAVE_UNCOUNTED, set_up

    set_up([Path(__file__).parent, Path(__file__).parents[1] / "analysis"])
    if CAN_LEAVE_UNCOUNTED:
        UNCOUNTED["_nrt"] = False
INNER = {**UNCOUNTED, "no_cpython_wrapper": True}
FAST = {"reassoc", "contract", "nsz"}  # sums may be taken in another order: they are vectorised
ZERO = np.int64(0)  # to pass on: every literal number would compile the function called anew
# becomes a part of its caller, and is neither compiled nor kept by itself
PART = {"inline": "always", "cache": False}


def njit(**options: Any) -> Callable[[Callable[..., Any]], Any]:
    """numba's decorator of that name, or one that leaves functions as they are."""
    if UNCOMPILED:
        return lambda function: function
    from flexgear.structures.linalg.compiled import njit as kept_njit

    return kept_njit(**options)


def as_read(data: Any) -> Any:
    """Arrays in (nested) named tuples as the loops read them: where these are not compiled, records
    whose fields are attributes."""
    if not UNCOMPILED:
        return data
    if isinstance(data, tuple):
        return type(data)(*map(as_read, data))
    return data.view(np.recarray) if data.dtype.names else data
