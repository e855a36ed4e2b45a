"""Distributions of manufacturing errors and flank modifications for tolerance studies (the section
``tolerance``).

A distribution replaces the value of the same name in ``errors`` or ``modifications``. Errors and
modifications of planets are drawn for each planet separately.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from pydantic import Field, create_model

from flexgear.model.errors import echo
from flexgear.model.gear_mesh import NOT_PARALLEL, GearErrors
from flexgear.model.modifications import FlankModifications
from flexgear.model.read import nearest
from flexgear.model.section import Refusal, Section
from flexgear.model.units import Angle, Deviation

if TYPE_CHECKING:
    from flexgear.model.case import Case
    from flexgear.model.stage import Stage

OF_EITHER_SIGN = (
    "pin_tangential", "pin_radial", "planet_thickness", "ring_gear_mesh", "sun_gear_mesh",
    "sun_helix_slope", "ring_helix_slope", "planet_sun_helix_slope", "planet_ring_helix_slope",
)  # fmt: skip
LARGEST = 2e-3  # m, limit of an error
TAIL = 8.0  # standard deviations, assumed largest value of an unlimited normal distribution


class SizeDistribution(Section):
    """Distribution of the size of an error.

    normal    with mean (0 if left out) and standard_deviation, truncated at low and high if given
    uniform   between low and high
    rayleigh  distance of a point whose two coordinates are normal with standard_deviation, as
              eccentricities are; truncated at high

    distribution: kind of the distribution. mean, standard_deviation: of the normal distribution
    before it is truncated. low, high: limits of the distribution.
    """

    distribution: Literal["normal", "uniform", "rayleigh"] = "normal"
    mean: Deviation | None = Field(default=None, ge=-LARGEST, le=LARGEST)
    standard_deviation: Deviation | None = Field(default=None, gt=0.0, le=LARGEST)
    low: Deviation | None = Field(default=None, ge=-LARGEST, le=LARGEST)
    high: Deviation | None = Field(default=None, ge=-LARGEST, le=LARGEST)

    @property
    def usual(self) -> tuple[float, float]:
        """Usual range of values: the mean ± two standard deviations, m."""
        if self.distribution == "uniform":
            assert self.low is not None and self.high is not None
            return self.low, self.high
        mean, half = self.mean or 0.0, 2.0 * (self.standard_deviation or 0.0)
        return (0.0 if self.distribution == "rayleigh" else mean - half), mean + half

    @property
    def largest(self) -> float:
        """Largest size that can be drawn, within 8 standard deviations; m."""
        ends = [abs(x) for x in (self.low, self.high) if x is not None]
        if len(ends) == 2 or self.distribution == "uniform":
            return max(ends)
        tail = abs(self.mean or 0.0) + TAIL * (self.standard_deviation or 0.0)
        return min(tail, self.high) if self.distribution == "rayleigh" and self.high else tail

    def _check(self) -> None:
        required, unused = _KEYS[self.distribution]
        self._require_set(required, f"is missing in a {self.distribution} distribution", "give it")
        self._refuse_set(unused, f"has no meaning in a {self.distribution} distribution")
        low = 0.0 if self.distribution == "rayleigh" else self.low
        if low is not None and self.high is not None and not low < self.high:
            raise Refusal("high", "is not above the low end", "put them in order")
        if self.distribution == "normal":
            self._refuse_far_limits()

    def _refuse_far_limits(self) -> None:
        """Raise Refusal for a limit that excludes nearly the whole normal distribution."""
        assert self.standard_deviation is not None
        tail = TAIL * self.standard_deviation
        for key, sign in (("low", 1), ("high", -1)):
            limit = getattr(self, key)
            if limit is not None and sign * (limit - (self.mean or 0.0)) > tail:
                problem = f"excludes everything within {TAIL:g} standard deviations of the mean"
                raise Refusal(key, problem, "check value and unit")


_KEYS = {  # required and unused keys
    "normal": (("standard_deviation",), ()),
    "uniform": (("low", "high"), ("mean", "standard_deviation")),
    "rayleigh": (("standard_deviation",), ("mean", "low")),
}


class PhaseDistribution(Section):
    """Uniform distribution of a phase, by default over a full revolution.

    distribution: kind of the distribution. low, high: limits of the distribution.
    """

    distribution: Literal["uniform"] = "uniform"
    low: Angle = 0.0
    high: Angle = 2 * math.pi

    def _check(self) -> None:
        if not self.low < self.high:
            raise Refusal("high", "is not above the low end", "put them in order")


def _distributions_of(section: type[Section], *names: str) -> Any:
    """A section class with a distribution for each of these fields of another section."""
    fields: dict[str, Any] = {
        name: (
            PhaseDistribution | None if name.endswith("_phase") else SizeDistribution | None,
            None,
        )
        for name in names
    }
    return create_model(f"Of{section.__name__}", __base__=Section, **fields)


_ERRORS: Any = _distributions_of(GearErrors, *(n for n in GearErrors.model_fields if n != "seed"))
_MODIFICATIONS: Any = _distributions_of(
    FlankModifications, "profile_crowning", "profile_slope", "lead_crowning", "twist", "tip_relief"
)


class ErrorDistributions(_ERRORS):
    """Distributions of ``GearErrors``. For pitch deviations of single teeth, which are drawn anew
    for every sample, the distribution is that of their standard deviation; of the harmonics of a
    gear mesh the first is drawn."""

    same_as: ClassVar = (GearErrors,)

    @property
    def given(self) -> dict[str, SizeDistribution | PhaseDistribution]:
        """The given distributions by error, in the order of the fields."""
        return self._stated()

    def _check(self) -> None:
        for name, distribution in self.given.items():
            if not isinstance(distribution, SizeDistribution):
                continue
            if name not in OF_EITHER_SIGN:
                _refuse_negative(name, distribution)
            _refuse_large(name, distribution)


def _refuse_large(name: str, distribution: SizeDistribution) -> None:
    """Raise Refusal for a distribution that can exceed the largest error."""
    if distribution.largest > LARGEST:
        problem = f"lets errors reach {1e3 * distribution.largest:g} mm"
        raise Refusal(f"{name}.standard_deviation", problem, "give low and high, or check the unit")


def _refuse_negative(name: str, distribution: SizeDistribution) -> None:
    """Raise Refusal for a distribution that can be negative."""
    if distribution.distribution == "rayleigh" or (
        distribution.low is not None and distribution.low >= 0
    ):
        return
    problem = "is not 0 or more, but this size cannot be negative"
    raise Refusal(f"{name}.low", problem, 'give it, or use distribution = "rayleigh"')


class FlankDistributions(_MODIFICATIONS):
    """Distributions of amounts in ``FlankModifications``; for tip relief that of its amount, with
    length and form of the case."""

    same_as: ClassVar = (FlankModifications,)

    def _check(self) -> None:
        for name, distribution in self._stated().items():
            if name == "tip_relief":
                _refuse_negative(name, distribution)
            _refuse_large(name, distribution)


FLANKS = {  # gear and flank by field of ``ModificationDistributions``
    "sun": ("sun", "drive"),
    "ring": ("ring", "drive"),
    "planet_sun": ("planet", "sun"),
    "planet_ring": ("planet", "ring"),
}


class ModificationDistributions(Section):
    """Distributions of flank modifications, for pairs with slices (``face_load``).

    sun, ring: of the flank that transmits the rated torque; in a parallel stage sun means the
    pinion. planet_sun, planet_ring: of the planets' flanks towards sun and ring; in a parallel
    stage planet_sun means the loaded flank of the gear.
    """

    sun: FlankDistributions = FlankDistributions()
    ring: FlankDistributions = FlankDistributions()
    planet_sun: FlankDistributions = FlankDistributions()
    planet_ring: FlankDistributions = FlankDistributions()

    @property
    def given(self) -> dict[tuple[str, str], SizeDistribution]:
        """The given distributions by flank and modification, in the order of the fields."""
        return {
            (flank, name): distribution
            for flank in type(self).model_fields
            for name, distribution in getattr(self, flank)._stated().items()
        }


class OfStage(Section):
    """Distributions of one stage of a train, which replace those of all stages key by key.

    stage: name of the stage. errors: distributions of its errors. modifications: distributions of
    its flank modifications.
    """

    stage: str
    errors: ErrorDistributions = ErrorDistributions()
    modifications: ModificationDistributions = ModificationDistributions()


class Tolerance(Section):
    """A tolerance study.

    samples: number of sets of parts; seed: equal seeds give equal samples; positions_per_gear_mesh:
    equilibria in each gear-mesh period, over one revolution of the carrier; confidence: of the
    intervals about mean and quantiles. errors: distributions for all stages that have the part;
    by_stage: distributions for single stages. modifications: distributions of flank modifications
    for all stages whose pairs have slices.
    """

    samples: int = Field(default=1000, ge=2, le=10**7)
    seed: int = Field(default=1, ge=0)
    positions_per_gear_mesh: int = Field(default=4, ge=4, le=1000)
    confidence: float = Field(default=0.95, ge=0.5, lt=1.0)
    errors: ErrorDistributions = ErrorDistributions()
    modifications: ModificationDistributions = ModificationDistributions()
    by_stage: tuple[OfStage, ...] = ()

    def modifications_of(self, stage: Stage) -> dict[tuple[str, str], SizeDistribution]:
        """Distributions of modifications of a stage by flank and name.

        There are none for parts that the stage does not have, or if its pairs have no slices.
        """
        distributions = self.modifications.given
        for of_stage in self.by_stage:
            if of_stage.stage == stage.name:
                distributions |= of_stage.modifications.given
        if stage.gear_mesh.model != "face_load":
            return {}
        parallel = stage.kind == "parallel"
        return {
            key: x
            for key, x in distributions.items()
            if not (parallel and "ring" in FLANKS[key[0]])
        }

    def of(self, stage: str) -> dict[str, SizeDistribution | PhaseDistribution]:
        """Distributions of one stage."""
        distributions = self.errors.given
        for of_stage in self.by_stage:
            if of_stage.stage == stage:
                distributions |= of_stage.errors.given
        return distributions


def check_tolerance(case: Case) -> None:
    """Check stages and parts of the distributions of a case; raises Refusal."""
    seen: set[str] = set()
    for k, of_stage in enumerate(case.tolerance.by_stage):
        at, names = f"tolerance.by_stage.{k}", [s.name for s in case.stages]
        if of_stage.stage not in names:
            problem = f"no stage is {echo(of_stage.stage)}"
            raise Refusal(f"{at}.stage", problem, nearest(of_stage.stage, names))
        if of_stage.stage in seen:
            raise Refusal(f"{at}.stage", f"{of_stage.stage} is named twice", "combine them")
        seen.add(of_stage.stage)
        unused = [key for key in of_stage.errors.given if key in NOT_PARALLEL]
        if case.stage(of_stage.stage).kind == "parallel" and unused:
            problem = "is an error of a part that a parallel stage does not have"
            remedy = "use sun_… for the pinion and planet_… for the gear"
            raise Refusal(f"{at}.errors.{unused[0]}", problem, remedy)
    _check_modifications(case)


def _check_modifications(case: Case) -> None:
    """Raise Refusal for distributions of modifications without slices or without tip relief."""
    drawn = [case.tolerance.modifications_of(stage) for stage in case.stages]
    modifications = {"tolerance.modifications": case.tolerance.modifications.given}
    for k, of_stage in enumerate(case.tolerance.by_stage):
        modifications[f"tolerance.by_stage.{k}.modifications"] = of_stage.modifications.given
    for at, tolerances in modifications.items():
        for key in tolerances:
            if not any(key in section for section in drawn):
                problem = "needs a stage that has this flank, and slices along the face"
                remedy = 'set gear_mesh.model = "face_load", or take it out'
                raise Refusal(f"{at}.{key[0]}.{key[1]}", problem, remedy)
    for stage, section in zip(case.stages, drawn, strict=True):
        for flank, name in section:
            part, side = modified_flank(stage, flank)
            relief = getattr(stage, part).modifications.of(side).tip_relief
            if name == "tip_relief" and relief is None:
                problem = f"has no tip relief in {part}.modifications whose amount could be drawn"
                remedy = f"give {part}.modifications.tip_relief its amount and length"
                raise Refusal(f"tolerance.modifications.{flank}.tip_relief", problem, remedy)


def modified_flank(stage: Stage, flank: str) -> tuple[str, str]:
    """Part and flank in ``modifications`` for a field of ``ModificationDistributions``."""
    part, side = FLANKS[flank]
    if stage.kind == "parallel":
        return ("gear" if part == "planet" else "pinion"), "drive"
    return part, side
