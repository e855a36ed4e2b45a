"""Parameter studies of Figures 10 to 12 with the plain equations."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np
from scipy.optimize import brentq

from flexgear.arrays import Array
from hu2023.cases import drive
from hu2023.equations import Drive, matrices
from hu2023.errors import TABLE_4, Errors, changed, harmonics
from hu2023.sharing import StageFigures, stage_figures

CYCLES = 100
STIFFNESSES = np.geomspace(1e8, 1e10, 9)
SIZES = np.linspace(0.0, 60e-6, 7)
PRINTED_K = 1.076  # stage 1, outside
PARTS = ("sun", "ring", "planet", "carrier")


def with_stage(base: Drive, j: int, **values: object) -> Drive:
    """The drive with other values of stage j."""
    stages = list(base.stages)
    stages[j] = replace(stages[j], **values)  # type: ignore[arg-type]
    return replace(base, stages=tuple(stages))


def of(base: Drive, j: int, errors: tuple[Errors, ...] = TABLE_4, quasi_static: bool = False,
       signs: str = "geometry") -> StageFigures:  # fmt: skip
    """Load sharing of stage j."""
    return stage_figures(
        base, matrices(base), j, harmonics(base, errors, signs), quasi_static, CYCLES
    )


@cache
def fitted_bearing(signs: str = "geometry") -> float:
    """Stiffness of stage 1's planet bearings (N/m) that gives the printed K outside: a fit."""

    def gap(exponent: float) -> float:
        soft = with_stage(drive(), 0, bearing=10.0**exponent)
        return of(soft, 0, quasi_static=True, signs=signs).outside - PRINTED_K

    return float(10.0 ** brentq(gap, 5.0, 9.0, xtol=1e-3))


@cache
def soft_drive() -> Drive:
    """The drive with planet bearings of stage 1 as fitted."""
    return with_stage(drive(), 0, bearing=fitted_bearing())


@cache
def over_stiffness(j: int, kind: str) -> tuple[StageFigures, ...]:
    """Stage j over its outer ("sun") or inner ("ring") gear-mesh stiffness, dynamic."""
    base, out = soft_drive(), []
    for k in STIFFNESSES:
        sun, ring = base.stages[j].stiffness
        pair = (float(k), ring) if kind == "sun" else (sun, float(k))
        out.append(of(with_stage(base, j, stiffness=pair), j))
    return tuple(out)


@cache
def over_eccentricity(part: str, quasi_static: bool) -> tuple[StageFigures, ...]:
    """Stage 1 over one eccentricity, the other errors as in Table 4."""
    return tuple(of(soft_drive(), 0, changed(0, **{part: float(e)}), quasi_static) for e in SIZES)


@cache
def over_tooth_error(j: int, kind: str) -> tuple[StageFigures, ...]:
    """Stage j over its tooth error outside ("sun") or inside ("ring"), dynamic."""
    return tuple(of(soft_drive(), j, changed(j, **{f"{kind}_tooth": float(e)})) for e in SIZES)


def values(results: Sequence[StageFigures], side: str) -> Array:
    """K "outside" or "inside" along a study."""
    return np.array([getattr(one, side) for one in results])
