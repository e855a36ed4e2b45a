"""Load sharing factors of planets.

K = N max_i F_i / Σ F_i, spread = (max_i F_i − min_i F_i) / F_rated. K is undefined near ΣF = 0 and
is NaN below 3 % of rated ΣF.

Papers that use the maximum in each gear-mesh cycle k define

    B_ik = N max_k(F_i) / Σ_j max_k(F_j),

in which the maxima of planets may occur at different times, so that B is below the largest K. The
mean-based factor of Hu et al. 2023 (eqs. 19, 20) is max_k B_ik. The cycle-based factor of Ren et
al. 2021 (eqs. 21 to 24) is 1 + max_k |B_ik − 1|, which also counts planets with too little load.
Hu's eq. 19 as printed takes maxima over all planets and cycles at once, which gives 1 for any
forces; its text and eq. 20 require maxima for each planet and cycle.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flexgear.arrays import Array
from flexgear.model.errors import FlexgearError
from flexgear.model.names import GearMeshName
from flexgear.results.labelled_dataset import groups_of

Definition = Literal["instantaneous", "mean-based", "cycle-based"]

# K_γ by number of planets that IEC 61400-4:2012, design requirements for wind turbine gearboxes,
# prescribes, as quoted in the source code of Drivetrain (G. Rebouças, NTNU)
MESH_LOAD_FACTOR = {3: 1.10, 4: 1.25, 5: 1.35, 6: 1.44, 7: 1.47}
LEAST_SHARE = 0.03  # of rated ΣF, or of the largest F, below which K is undefined


def load_sharing(force: ArrayLike, rated_mean_force: float) -> Array:
    """K (...,) of gear-mesh forces (..., N) in N; NaN if ΣF is too small (``carry_together``).
    Under reversed torque (ΣF < 0) K is that of the planet with the largest negative load."""
    return np.asarray(planet_load_factors(force, rated_mean_force).max(axis=-1))


def carry_together(force: ArrayLike, rated_mean_force: float = 0.0) -> NDArray[np.bool_]:
    """Whether (...,) the planets carry a common load, from their forces (..., N) in N.

    |ΣF| must be at least 3 % of N · rated mean and of the largest |F|, and not zero: at zero torque
    the loads due to errors cancel, and ΣF is rounding.
    """
    f = np.asarray(force, dtype=float)
    total = np.abs(f.sum(axis=-1))
    least = np.maximum(f.shape[-1] * abs(rated_mean_force), np.abs(f).max(axis=-1, initial=0.0))
    return np.asarray((total >= LEAST_SHARE * least) & (total > 0))


def planet_load_factors(force: ArrayLike, rated_mean_force: float) -> Array:
    """K_γ of each planet, N F_i / Σ F, (..., N), of gear-mesh forces (..., N) in N. The mean is 1
    and the maximum is ``load_sharing``; NaN if that is NaN."""
    f = np.asarray(force, dtype=float)
    total = f.sum(axis=-1, keepdims=True)
    enough = carry_together(f, rated_mean_force)[..., None]
    return np.divide(
        f.shape[-1] * f, total, out=np.full(f.shape, np.nan), where=np.broadcast_to(enough, f.shape)
    )


def cycle_maxima(force: ArrayLike, samples_per_cycle: float) -> Array:
    """Largest force of each planet in each complete gear-mesh cycle, (c, N) from (t, N).

    samples_per_cycle may be a fraction; cycle k has the samples k ≤ t/samples_per_cycle < k + 1.
    Raises FlexgearError for less than one sample per cycle or less than one cycle.
    """
    f = np.asarray(force, dtype=float)
    if samples_per_cycle < 1:
        problem = f"{samples_per_cycle:.3g} samples per gear-mesh cycle do not resolve its maximum"
        raise FlexgearError(f"{problem}; save results more often")
    starts = cycle_starts(len(f), samples_per_cycle)
    if len(starts) < 2:
        problem = f"less than one gear-mesh cycle of {samples_per_cycle:.6g}"
        raise FlexgearError(f"{len(f)} samples are {problem}")
    return np.maximum.reduceat(f[: starts[-1]], starts[:-1], axis=0)


def cycle_starts(samples: int, samples_per_cycle: float, first: int = 0) -> NDArray[np.int64]:
    """First samples of the complete gear-mesh cycles from number ``first``, and of the next one."""
    # the tolerance keeps cycles complete if their length is a rounded fraction
    cycles = int(np.floor(samples / samples_per_cycle * (1 + 1e-12)))
    return np.ceil(np.arange(first, cycles + 1) * samples_per_cycle * (1 - 1e-12)).astype(np.int64)


DEFINITIONS: tuple[Definition, ...] = get_args(Definition)
FEWEST = 4.0  # samples per gear-mesh cycle that resolve its maximum


class RunningSharing:
    """Coefficients of N planets that share a load, from chunks of their forces.

    Only largest values over samples and gear-mesh cycles are stored, and the samples of the
    incomplete cycle. Both signs of the load are followed, since the sign is that of the mean load.
    Results are stored by window of time, so that coefficients can be computed from a later window
    on; a gear-mesh cycle in two windows counts in the later one.
    """

    def __init__(self, planets: int, samples_per_cycle: float) -> None:
        self._per_cycle = samples_per_cycle
        self._open = np.zeros((0, planets))  # forces of the incomplete cycle
        self._sum, self._samples, self._cycles = 0.0, 0, 0
        # largest values (sign, definition, planet) of each window; NaN if a sample has the other
        # sign
        self._windows = [np.full((2, len(DEFINITIONS), planets), -math.inf)]

    def append(self, force: ArrayLike, window: int = 0) -> None:
        """Add samples of the gear-mesh forces (t, N), N, in the last window or a later one."""
        f = np.asarray(force, dtype=float)
        if not len(f):
            return
        while len(self._windows) <= window:
            self._windows.append(np.full_like(self._windows[0], -math.inf))
        first, stored = self._samples - len(self._open), np.concatenate([self._open, f])
        self._sum, self._samples = self._sum + float(f.sum()), self._samples + len(f)
        starts = np.zeros(1, dtype=np.int64)
        if self._per_cycle >= FEWEST:
            starts = cycle_starts(self._samples, self._per_cycle, self._cycles) - first
            self._open = stored[starts[-1] :]
            self._cycles += len(starts) - 1
        carried, total = carry_together(f), f.sum(axis=1)
        for sign, largest in zip((1.0, -1.0), self._windows[-1], strict=True):
            if not np.all(carried & (sign * total > 0)):
                largest[:] = math.nan
            if np.isnan(largest).any():
                continue
            np.maximum(largest[0], _shares(sign * f).max(axis=0), out=largest[0])
            if len(starts) > 1:
                peaks = np.maximum.reduceat(sign * stored[: starts[-1]], starts[:-1], axis=0)
                shares = _shares(peaks)
                for k, factors in ((1, shares), (2, 1 + np.abs(shares - 1))):
                    np.maximum(largest[k], factors.max(axis=0), out=largest[k])

    def planets(self, definition: Definition, first: int = 0) -> Array:
        """Coefficients (N,) of the planets from the window ``first`` on, NaN if undefined."""
        sign, k = 0 if self._sum >= 0 else 1, DEFINITIONS.index(definition)
        first = min(first, len(self._windows) - 1)
        largest = np.max([window[sign, k] for window in self._windows[first:]], axis=0)
        enough = k == 0 or (self._per_cycle >= FEWEST and self._samples >= self._per_cycle)
        if not (enough and np.isfinite(largest).all()):
            return np.full_like(largest, math.nan)
        return np.asarray(largest)


def _shares(force: Array) -> Array:
    """N F_i/ΣF of forces (k, N)."""
    return np.asarray(force.shape[-1] * force / force.sum(axis=-1, keepdims=True))


ROUNDING = 1e-9  # of the largest force of a train, below which forces are zero


def without_rounding(force: ArrayLike, largest: float = 0.0) -> Array:
    """Forces (t, G) of all gear meshes of a train with rounding errors set to zero.

    largest: lower limit of the largest force, N. Without torque, errors may load a single stage or
    both flanks of a gear mesh, and the forces of other gear meshes are rounding errors.
    """
    f = np.asarray(force, dtype=float)
    return np.where(np.abs(f) <= ROUNDING * np.abs(f).max(initial=largest), 0.0, f)


def sharing_histories(
    force: ArrayLike, rated: ArrayLike, gear_meshes: Sequence[GearMeshName]
) -> dict[str, Array]:
    """ "load_sharing" (t, groups) and "planet_load_factor" (t, G) of forces (t, G) in N.

    rated: (G,) mean force at rated torque, N. Both results are NaN without a common load
    (``carry_together``), the latter also for gear meshes outside of groups.
    """
    f, mean = without_rounding(force), np.asarray(rated, dtype=float)
    groups = groups_of(gear_meshes)
    factor = np.full(f.shape, np.nan)
    largest = np.full((len(f), len(groups)), np.nan)
    for k, at in enumerate(groups.values()):
        factor[:, at] = planet_load_factors(f[:, at], float(mean[at].mean()))
        largest[:, k] = factor[:, at].max(axis=1)
    return {"load_sharing": largest, "planet_load_factor": factor}


class SharingCoefficients:
    """Coefficients of all gear meshes of a train, from chunks of their forces. samples_per_cycle:
    by stage. Undefined coefficients (too few samples, no load) are NaN."""

    def __init__(
        self, gear_meshes: Sequence[GearMeshName], samples_per_cycle: Mapping[str, float]
    ) -> None:
        self._groups = [
            (at, RunningSharing(len(at), samples_per_cycle[group.stage]))
            for group, at in groups_of(gear_meshes).items()
        ]
        self._count = len(gear_meshes)

    def append(self, force: ArrayLike, window: int = 0) -> None:
        """Add samples of the gear-mesh forces (t, G), N, in a window."""
        f = without_rounding(force)
        for at, group in self._groups:
            group.append(f[:, at], window)

    def coefficients(self, first: int = 0) -> dict[str, Array]:
        """ "load_sharing_coefficient" (definitions, groups) and "planet_coefficient" (definitions,
        G) from the window ``first`` on, "mesh_load_factor" (groups,)."""
        planets = np.full((len(DEFINITIONS), self._count), np.nan)
        for at, group in self._groups:
            planets[:, at] = [group.planets(d, first) for d in DEFINITIONS]
        largest = [planets[:, at].max(axis=1) for at, _ in self._groups]
        assumed = [MESH_LOAD_FACTOR.get(len(at), math.nan) for at, _ in self._groups]
        return {
            "load_sharing_coefficient": np.reshape(largest, (-1, len(DEFINITIONS))).T,
            "planet_coefficient": planets,
            "mesh_load_factor": np.array(assumed),
        }


def sharing_coefficients(
    force: ArrayLike,
    gear_meshes: Sequence[GearMeshName],
    samples_per_cycle: Mapping[str, float],
) -> dict[str, Array]:
    """``SharingCoefficients.coefficients`` of forces (t, G), N."""
    running = SharingCoefficients(gear_meshes, samples_per_cycle)
    running.append(force)
    return running.coefficients()
