"""How loops are compiled by numba: options of functions called from Python, and of inner ones.

Wrappers for callers that never come take a good part of the compilation. Arrays are counted by
every function that takes or slices them unless it is told not to: work arrays outlive the loops
that use them, and counting took a third of a time step. Such functions must not make arrays.
"""

from __future__ import annotations

import gc
from pathlib import Path

import numpy as np
from numba.core import event
from numba.core.options import DefaultOptions

from flexgear.coupling.compile_cache import keep_by_content


class _WithoutCollection(event.Listener):
    """Python looks for no garbage while code is compiled: that makes millions of objects, hardly
    any of them garbage, and looking through them took a tenth of the time."""

    def __init__(self) -> None:
        self._depth, self._collects = 0, False

    def on_start(self, event: event.Event) -> None:
        if self._depth == 0:
            self._collects = gc.isenabled()
            gc.disable()
        self._depth += 1

    def on_end(self, event: event.Event) -> None:
        self._depth -= 1
        if self._depth == 0 and self._collects:
            gc.enable()


event.register("numba:compile", _WithoutCollection())
keep_by_content([Path(__file__).parent, Path(__file__).parents[1] / "analysis"])
# a division by zero is not looked for, as in NumPy: looking costs a branch each
UNCOUNTED = {"cache": True, "no_cfunc_wrapper": True, "error_model": "numpy"}
if hasattr(DefaultOptions, "_nrt"):  # numba's own name for it, not promised for ever
    UNCOUNTED["_nrt"] = False
INNER = {**UNCOUNTED, "no_cpython_wrapper": True}
FAST = {"reassoc", "contract", "nsz"}  # sums may be taken in another order: they are vectorised
ZERO = np.int64(0)  # to pass on: every literal number would compile the function called anew
PART = {"inline": "always"}  # becomes a part of its caller, and is not compiled by itself
