"""What a law of force elements is, and the signature that all of them are compiled for."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from flexgear.arrays import Array
from flexgear.model.bearings import Bearing

CENTERING = 1e-4  # of its stiffness: what a bearing with a law keeps as a spring about its middle


@dataclass(frozen=True)
class Law:
    """A law by name; see ``laws``.

    function: as ``compiled_law`` gives it; components: of the relative motion (x, y, z, rx, ry, rz)
    that a bearing's rows act on, none for laws of rows that come from elsewhere; nominal: stiffness
    (r,) of the rows of an element with the given parameters, for modes and what is linear;
    stated_by: the parameters of the law where a bearing of a case states it, else None, from the
    bearing and the dynamic viscosity of the case's lubricant, Pa·s, None where it has none;
    replaces: whether the law stands in the place of the bearing's springs or beside them;
    part_loads: loads (t, rows, parts) N of the parts of its rows, evenly spaced from the bearing's
    x axis on, from parameters, motions (t, r) and the angle (t,) that turns it, where it has parts;
    turned: which of its parameters is one of the system's angles, −1 none.
    """

    name: str
    function: Callable[[], Any]
    components: tuple[int, ...] = ()
    nominal: Callable[[Array], Array] = np.zeros_like
    stated_by: Callable[[Bearing, float | None], Sequence[float] | None] = lambda bearing, oil: None
    replaces: bool = True
    part_loads: Callable[[Array, Array, Array], Array] | None = None
    turned: int = -1


def compiled_law(function: Callable[..., float]) -> Callable[[], Any]:
    """What gives the function compiled so that it can be called by its address; it is compiled when
    that is first asked for."""

    @cache
    def compiled() -> Any:
        from numba import cfunc, types

        from flexgear.compiled import cached

        real = types.float64
        signature = real(real[::1], real[:, ::1], real[:, ::1], real[:, :, ::1])
        return cached(cfunc, signature, error_model="numpy")(function)

    return compiled
