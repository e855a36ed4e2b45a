"""Random samples of manufacturing errors that depend only on the seed and the number of the sample.

Every error of every sample has a separate random stream: Philox with a key from the seed and the
name of the error, and the sample number as counter (Salmon et al. 2011, "Parallel random numbers:
as easy as 1, 2, 3"). So samples and errors do not depend on which others are drawn, nor on their
order. Sizes are uniform numbers transformed by the inverse of the cumulative distribution.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.special import ndtr, ndtri

from flexgear.analysis.error_sets import ErrorSets, no_errors
from flexgear.arrays import Array
from flexgear.coupling.gear_meshes import GearMeshLabel
from flexgear.coupling.pair_data import PairData
from flexgear.gears.contact import GearMeshKind, GearMeshPath
from flexgear.gears.errors import PairErrors, stage_errors
from flexgear.gears.paths import PathKey, stage_paths
from flexgear.gears.power_flow import power_flow
from flexgear.model.case import Case
from flexgear.model.errors import InputError
from flexgear.model.gear_mesh import HARMONICS, NOT_PARALLEL, OF_PLANETS
from flexgear.model.modifications import Relief
from flexgear.model.stage import Stage
from flexgear.model.tolerance import PhaseDistribution, SizeDistribution, modified_flank
from flexgear.studies.flank_amounts import FlankAmount

Values = Mapping[tuple[str, str], Array]  # (stage, key) -> (J, count)
TINY = 1e-30  # m; stands for a size of zero, for which gear meshes would omit the error
PITCHES = ("ring_pitch", "planet_pitch", "sun_pitch")


@dataclass(frozen=True)
class DrawnError:
    """A random error. stage: name of the stage; planets: their number for an error of planets, else
    0; flank: the modification if the error is one of its amount."""

    stage: str
    key: str
    planets: int
    distribution: SizeDistribution | PhaseDistribution
    flank: FlankAmount | None = None

    @property
    def count(self) -> int:
        """Number of values of the error in a sample."""
        return self.planets or 1

    @property
    def is_phase(self) -> bool:
        """Whether the error is an angle, not a size."""
        return isinstance(self.distribution, PhaseDistribution)

    @property
    def labels(self) -> tuple[str, ...]:
        """Labels of the values: "stage.sun_eccentricity", "stage_1.pin_radial 2"."""
        name = f"{self.stage}.{self.key}"
        return tuple(f"{name} {i + 1}" for i in range(self.planets)) or (name,)


def drawn_errors(case: Case) -> tuple[DrawnError, ...]:
    """Random errors of the section ``tolerance``; InputError where there are none."""
    drawn: list[DrawnError] = []
    errors = [s.errors for s in case.stages]
    for stage in case.stages:
        tolerances = case.tolerance.of(stage.name)
        if stage.kind == "parallel":
            tolerances = {key: d for key, d in tolerances.items() if key not in NOT_PARALLEL}
        drawn += [
            DrawnError(stage.name, key, stage.planets if key in OF_PLANETS else 0, distribution)
            for key, distribution in tolerances.items()
        ]
        drawn += _drawn_amounts(case, stage)
    if not drawn and not any(getattr(e, pitch) for e in errors for pitch in PITCHES):
        problem = "has no error of a part of these stages, so there is nothing to draw"
        key = "pin_tangential" if "planetary" in {s.kind for s in case.stages} else "sun_gear_mesh"
        remedy = f"give a distribution: [tolerance.errors.{key}] standard_deviation_um = 10"
        raise InputError(case.source, "tolerance.errors", problem, remedy)
    return tuple(drawn)


def _drawn_amounts(case: Case, stage: Stage) -> list[DrawnError]:
    """Random amounts of flank modifications, drawn for each planet."""
    errors = []
    for (flank, name), distribution in case.tolerance.modifications_of(stage).items():
        part, side = modified_flank(stage, flank)
        modification = getattr(getattr(stage, part).modifications.of(side), name)
        relief = modification if isinstance(modification, Relief) else None
        base = float(relief.amount if relief else modification or 0.0)
        amount = FlankAmount(stage.name, f"{part}.modifications.{side}.{name}", base, relief)
        planets = stage.planets if part in ("planet", "gear") else 0
        errors.append(DrawnError(stage.name, f"{flank}_{name}", planets, distribution, amount))
    return errors


def sample_values(drawn: Sequence[DrawnError], seed: int, numbers: Sequence[int]) -> Values:
    """Sizes (m) and phases (rad) of J samples by stage and key, (J, values of the error)."""
    values = {}
    for error in drawn:
        draw = streams(seed, f"{error.stage}/{error.key}")
        uniform = np.array([draw(k).random(error.count) for k in numbers])
        values[error.stage, error.key] = inverse(error.distribution, uniform)
    return values


def pitch_seeds(stage: str, seed: int, numbers: Sequence[int]) -> list[int]:
    """Seed of the random single pitch deviations of a stage, for each sample."""
    draw = streams(seed, f"{stage}/pitch deviations")
    return [int(draw(k).integers(2**62)) for k in numbers]


def streams(seed: int, name: str) -> Callable[[int], np.random.Generator]:
    """Function of a sample number that returns the random stream of an error."""
    words = [seed, int.from_bytes(name.encode())]
    key = np.random.SeedSequence(words).generate_state(2, np.uint64)

    def stream(number: int) -> np.random.Generator:
        return np.random.Generator(np.random.Philox(key=key, counter=[0, 0, number, 0]))

    return stream


def inverse(distribution: SizeDistribution | PhaseDistribution, uniform: Array) -> Array:
    """Inverse of the cumulative distribution at ``uniform`` in [0, 1); sizes of 0 are ``TINY``."""
    d, u = distribution, np.maximum(uniform, 2.0**-54)  # the inverse is infinite at 0
    if isinstance(d, PhaseDistribution):
        return d.low + (d.high - d.low) * uniform
    if d.distribution == "uniform":
        assert d.low is not None and d.high is not None
        size = d.low + (d.high - d.low) * uniform
    elif d.distribution == "rayleigh":
        assert d.standard_deviation is not None
        end = 1.0 if d.high is None else -math.expm1(-0.5 * (d.high / d.standard_deviation) ** 2)
        size = d.standard_deviation * np.sqrt(-2 * np.log1p(-end * u))
    else:
        assert d.standard_deviation is not None
        mean, scale = d.mean or 0.0, d.standard_deviation
        low = -math.inf if d.low is None else (d.low - mean) / scale
        high = math.inf if d.high is None else (d.high - mean) / scale
        size = mean + scale * cut_normal(u, low, high)
    return np.where(size == 0, TINY, size)


def cut_normal(u: Array, low: float, high: float) -> Array:
    """Standard normal numbers truncated to low … high, from uniform numbers u."""
    if low > 0:  # by symmetry in the lower tail, where the distribution has more digits
        return -cut_normal(1 - u, -high, -low)
    first, last = ndtr(low), ndtr(high)
    return np.asarray(ndtri(first + u * (last - first)))


def with_sample(case: Case, values: Values, j: int, seeds: Sequence[int]) -> Case:
    """The case with the errors of sample j; seeds: of the pitch deviations, by stage. A number that
    is drawn for a gear mesh is that of its first harmonic; the case has the others."""
    stages = []
    for stage, seed in zip(case.stages, seeds, strict=True):
        update: dict[str, Any] = {"seed": seed}
        for (name, key), lines in values.items():
            if name == stage.name and key in type(stage.errors).model_fields:
                numbers = tuple(float(x) for x in lines[j])
                higher = getattr(stage.errors, key)[1:] if key in HARMONICS else ()
                several = key in (*OF_PLANETS, *HARMONICS)
                update[key] = (*numbers, *higher) if several else numbers[0]
        errors = stage.errors.model_copy(update=update)
        stages.append(stage.model_copy(update={"errors": errors}))
    return case.model_copy(update={"stages": tuple(stages)})


def nominal(case: Case, drawn: Sequence[DrawnError]) -> Values:
    """One sample with the errors that the case states, in place of random ones."""
    values = {}
    for error in drawn:
        of_errors = case.stage(error.stage).errors
        stated: Any = error.flank.base if error.flank else getattr(of_errors, error.key)
        line = np.zeros((1, error.count))
        if stated != ():
            line[:] = stated[:1] if error.key in HARMONICS else stated
        values[error.stage, error.key] = line if error.is_phase else np.where(line == 0, TINY, line)
    return values


StagePaths = tuple[Mapping[PathKey, GearMeshPath], ...]


def paths_of(case: Case) -> StagePaths:
    """Paths of contact of every stage."""
    flows = power_flow(case).stages
    return tuple(stage_paths(case.view(flow.name), flow.gear_mesh_forces) for flow in flows)


def error_sets(
    cases: Sequence[Case],
    paths: StagePaths,
    gear_meshes: Sequence[GearMeshLabel],
    base: PairData,
) -> ErrorSets:
    """Errors of all cases, in arrays of the shapes of ``base``: pair data of a case that has errors
    of the same bodies as each of ``cases``."""
    sets = no_errors(base, len(cases))
    groups: dict[tuple[int, GearMeshKind, str], tuple[list[int], list[int]]] = {}
    for m, label in enumerate(gear_meshes):
        places, planets = groups.setdefault((label.stage, label.kind, label.side), ([], []))
        places.append(m)
        planets.append(label.planet)
    for j, case in enumerate(cases):
        stages = zip(case.stages, paths, strict=True)
        errors = [stage_errors(case.view(s.name), paths_of_stage) for s, paths_of_stage in stages]
        for (stage, kind, side), (places, planets) in groups.items():
            _write_errors(sets, j, places, planets, errors[stage][kind, side])
    return sets


def _write_errors(
    sets: ErrorSets, j: int, places: list[int], planets: list[int], e: PairErrors
) -> None:
    """Write the errors of one kind of gear mesh into set j; places: indices of gear meshes."""
    orders = e.harmonic_amplitude.shape[1]
    sets.amplitude[j, places, :orders] = e.harmonic_amplitude[planets]
    sets.phase[j, places, :orders] = e.harmonic_phase[planets]
    sets.offset[j, places] = e.offset[planets]
    sets.slope[j, places] = e.slope[planets]
    sets.gear[j, places, : len(e.gear_tooth)] = e.gear_tooth
    sets.planet[j, places, : e.planet_tooth.shape[1]] = e.planet_tooth[planets]
    terms = e.runout_amplitude.shape[1]
    sets.runout_amplitude[j, places, :terms] = e.runout_amplitude[planets]
    sets.runout_phase[j, places, :terms] = e.runout_phase[planets]
