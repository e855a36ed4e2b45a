"""Constant load of a bearing over the positions of its stage, in the axes of its load."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from flexgear.arrays import Array
from flexgear.gears.bearings.basic_life import varying_load

ROUNDING = 1e-9  # of the radial load: less is no thrust


@dataclass(frozen=True)
class BearingLoad:
    """radial: constant radial load of the same damage, N; axial: mean, N; moment: mean (2,) about
    the direction of the radial load and across it, N m; largest: radial load at any position, N;
    stationary: ring against which the load stands still, of a bearing whose inner ring is on what
    its axes turn with."""

    radial: float
    axial: float
    moment: tuple[float, float]
    largest: float
    stationary: Literal["inner", "outer"]

    @property
    def vector(self) -> Array:
        """Force and moment (5,) x, y, z, about x and y, the radial load along x."""
        return np.array([self.radial, 0.0, self.axial, *self.moment])


def bearing_load(force: Array, turned: Array, exponent: float, z: float = 0.0) -> BearingLoad:
    """Of forces and moments (p, 6), N and N m, at positions that count alike.

    turned: (p,) rotation in space of the axes that the force is given in, rad: the load stands
    still against the ring that sees more of its mean. exponent: of the load in the damage, P_m =
    (mean P^p)^{1/p} (Palmgren 1924, Miner 1945). z: of the bearing's middle from where moments are
    given, m. Moments are taken in axes that follow the radial load, as raceways see it.
    """
    x, y = force[:, 0], force[:, 1]
    radial = np.hypot(x, y)
    largest = float(radial.max())
    if largest == 0.0:
        return BearingLoad(0.0, float(force[:, 2].mean()), (0.0, 0.0), 0.0, "inner")
    cos, sin = np.divide([x, y], radial, out=np.zeros((2, len(x))), where=radial > 0.0)
    along = cos * force[:, 3] + sin * force[:, 4]
    across = cos * force[:, 4] - sin * force[:, 3] - z * radial
    load, axial = x + 1j * y, float(force[:, 2].mean())
    turns_along = abs(load.mean()) >= abs((load * np.exp(1j * turned)).mean())
    return BearingLoad(
        radial=varying_load(radial, exponent),
        axial=axial if abs(axial) > ROUNDING * largest else 0.0,
        moment=(float(along.mean()), float(across.mean())),
        largest=largest,
        stationary="inner" if turns_along else "outer",
    )
