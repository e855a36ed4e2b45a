"""How evenly planets share the load.

K = N max_i F_i / Σ F_i, spread = (max_i F_i − min_i F_i) / F_rated. K loses its meaning where
ΣF passes zero and is not a number below 3 % of rated ΣF.

Papers that look at the maximum of each gear-mesh cycle k define

    B_ik = N max_k(F_i) / Σ_j max_k(F_j),

where the maxima of planets need not fall together, so that B stays below the largest K. They then
differ: the mean-based factor of Hu et al. 2023 (eqs. 19, 20) is max_k B_ik, the cycle-based factor
of Ren et al. 2021 (eqs. 21 to 24) 1 + max_k |B_ik − 1|, which counts a planet that carries too
little as well. Hu's eq. 19 as printed runs its maxima over all planets and cycles at once, which
makes it 1 whatever the forces are; the text beside it and eq. 20 only make sense planet by planet
and cycle by cycle.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flexgear.model.errors import FlexgearError

Array = NDArray[np.float64]
Definition = Literal["instantaneous", "mean-based", "cycle-based"]

# IEC 61400-4:2012, design requirements for wind turbine gearboxes; read in the source code of
# Drivetrain (G. Rebouças, NTNU), which names the standard
MESH_LOAD_FACTOR = {3: 1.10, 4: 1.25, 5: 1.35, 6: 1.44, 7: 1.47}
LEAST_SHARE = 0.03  # of rated ΣF, or of the largest F, below which K is not evaluated


def load_sharing(force: ArrayLike, rated_mean_force: float) -> Array:
    """K (...,) of gear-mesh forces (..., N) in N; NaN where ΣF is too small (``carry_together``).

    Under reversed torque (ΣF < 0) the planet with the largest load of that sign counts.
    """
    f = np.asarray(force, dtype=float)
    planets = f.shape[-1]
    total = f.sum(axis=-1)
    largest = (f * np.sign(total)[..., None]).max(axis=-1)
    enough = carry_together(f, rated_mean_force)
    return np.divide(
        planets * largest, np.abs(total), out=np.full(total.shape, np.nan), where=enough
    )


def carry_together(force: ArrayLike, rated_mean_force: float = 0.0) -> NDArray[np.bool_]:
    """Where (...,) the planets carry a load that they can share, of their forces (..., N) in N.

    |ΣF| ≥ 3 % of N · rated mean and of the largest |F|, and more than nothing: at no torque what
    errors press on one planet others take off, and ΣF is rounding.
    """
    f = np.asarray(force, dtype=float)
    total = np.abs(f.sum(axis=-1))
    least = np.maximum(f.shape[-1] * abs(rated_mean_force), np.abs(f).max(axis=-1, initial=0.0))
    return np.asarray((total >= LEAST_SHARE * least) & (total > 0))


def planet_force_spread(force: ArrayLike, rated_mean_force: float) -> Array:
    """(max − min) / rated mean (...,) of gear-mesh forces (..., N) in N; defined everywhere."""
    f = np.asarray(force, dtype=float)
    return np.asarray(np.ptp(f, axis=-1) / abs(rated_mean_force))


def planet_load_factors(force: ArrayLike, rated_mean_force: float) -> Array:
    """K_γ of every planet N F_i / Σ F, (..., N), of gear-mesh forces (..., N) in N.

    Their mean is 1 and their maximum is ``load_sharing``; NaN where that is.
    """
    f = np.asarray(force, dtype=float)
    total = f.sum(axis=-1, keepdims=True)
    enough = carry_together(f, rated_mean_force)[..., None]
    return np.divide(
        f.shape[-1] * f, total, out=np.full(f.shape, np.nan), where=np.broadcast_to(enough, f.shape)
    )


def mesh_load_factor(planets: int) -> float | None:
    """K_γ that IEC 61400-4 has designers assume for this number of planets (3 to 7), or None."""
    return MESH_LOAD_FACTOR.get(planets)


@dataclass(frozen=True)
class LoadSharing:
    """Load sharing by one definition.

    definition: name; history: (c, N) factors of planets by gear-mesh cycle ("instantaneous": by
    sample); planets: (N,) coefficient of each planet; coefficient: the largest of them.
    """

    definition: str
    history: Array
    planets: Array
    coefficient: float


def cycle_maxima(force: ArrayLike, samples_per_cycle: float) -> Array:
    """Largest force of each planet in each whole gear-mesh cycle, (c, N) from (t, N).

    samples_per_cycle may be a fraction; cycle k holds the samples k ≤ t/samples_per_cycle < k + 1,
    a last one that is cut short is left out. FlexgearError with less than one sample a cycle or
    less than one cycle.
    """
    f = np.asarray(force, dtype=float)
    if samples_per_cycle < 1:
        raise FlexgearError(
            f"{samples_per_cycle:.3g} samples a gear-mesh cycle cannot show its maximum; "
            "save results more often"
        )
    starts = cycle_starts(len(f), samples_per_cycle)
    if len(starts) < 2:
        raise FlexgearError(
            f"{len(f)} samples are less than one gear-mesh cycle of {samples_per_cycle:.6g}"
        )
    return np.maximum.reduceat(f[: starts[-1]], starts[:-1], axis=0)


def cycle_starts(samples: int, samples_per_cycle: float, first: int = 0) -> NDArray[np.int64]:
    """First samples of whole gear-mesh cycles from number ``first`` on, and of the one after."""
    # a hair of slack keeps whole cycles whole when their length is a rounded fraction
    cycles = int(np.floor(samples / samples_per_cycle * (1 + 1e-12)))
    return np.ceil(np.arange(first, cycles + 1) * samples_per_cycle * (1 - 1e-12)).astype(np.int64)


def shares(force: Array) -> Array:
    """N F_i/ΣF (..., N) of forces whose sum is positive."""
    return np.asarray(force.shape[-1] * force / force.sum(axis=-1, keepdims=True))


def planet_figures(definition: Definition, history: Array) -> Array:
    """What of the shares (c, N) counts: itself, or 1 + |B − 1| of the cycle-based factor."""
    return np.asarray(1 + np.abs(history - 1) if definition == "cycle-based" else history)


def sharing_by(
    definition: Definition, force: ArrayLike, samples_per_cycle: float = 1.0
) -> LoadSharing:
    """Load sharing of the gear-mesh forces (t, N) of one gear mesh side by a named definition.

    "instantaneous": K_i(t) = N F_i/ΣF, largest over time; "mean-based" and "cycle-based": see the
    head of this file. Reversed torque (ΣF < 0 on average) counts as carried. FlexgearError where
    the planets together carry nothing in some cycle, so that there is nothing to share.
    """
    if definition not in get_args(Definition):
        raise FlexgearError(
            f"{definition!r} is no definition of load sharing; take one of "
            + ", ".join(get_args(Definition))
        )
    f = np.asarray(force, dtype=float)
    f = f * (np.sign(f.sum()) or 1.0)
    largest = f if definition == "instantaneous" else cycle_maxima(f, samples_per_cycle)
    if np.any(largest.sum(axis=-1) <= 0):
        raise FlexgearError(
            "the load sharing factor is not defined: in some cycle the planets carry no load "
            "together"
        )
    history = shares(largest)
    planets = planet_figures(definition, history).max(axis=0)
    return LoadSharing(definition, history, planets, float(planets.max()))


def system_coefficient(sides: Iterable[LoadSharing]) -> float:
    """The largest coefficient of all gear meshes and sides (Ren et al. 2021, eq. 24)."""
    return max(side.coefficient for side in sides)
