"""How loops are compiled by numba: options of functions called from Python, and of inner ones.

Wrappers for callers that never come take a good part of the compilation.
"""

from __future__ import annotations

OUTER = {"cache": True, "no_cfunc_wrapper": True}
INNER = {**OUTER, "no_cpython_wrapper": True}
FAST = {"reassoc", "contract", "nsz"}  # sums may be taken in another order: they are vectorised
