"""Law of force elements, and compilation with the signature of all laws."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from flexgear.arrays import Array
from flexgear.model.bearings import Bearing

CENTERING = 1e-4  # fraction of the stiffness of a nonlinear bearing that remains a linear spring


@dataclass(frozen=True)
class Law:
    """Law of force elements; see ``laws``.

    function: of ``compiled_law``; components: indices of the components (x, y, z, rx, ry, rz) of
    the relative motion on which the rows of a bearing act, none for laws of other rows; nominal:
    stiffness (r,) of the rows for given parameters, used in modes and linear analyses; stated_by:
    parameters for a bearing of a case and the dynamic viscosity of the lubricant, Pa·s or None,
    None if the bearing does not have the law; replaces: whether the law replaces the springs of the
    bearing or is added to them; part_loads: loads (t, rows, parts), N, of rolling elements, equally
    spaced from the x axis on, for parameters, motions (t, r) and the angle (t,); turned: index of
    the parameter that is an angle of the system, −1 none.
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
    """Function that returns a law compiled for calls by address; it is compiled at the first
    call."""

    @cache
    def compiled() -> Any:
        from numba import cfunc, types

        from flexgear.compiled import cached

        real = types.float64
        signature = real(real[::1], real[:, ::1], real[:, ::1], real[:, :, ::1])
        return cached(cfunc, signature, error_model="numpy")(function)

    return compiled
