"""What a tolerance study draws: distributions of manufacturing errors (the section ``tolerance``).

Every error of the section ``errors`` can have a distribution of the same name; it then replaces the
value there, and so do distributions of ground amounts those of ``modifications``. What belongs to
planets is drawn for each planet on its own.
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
from flexgear.model.units import Angle, Length

if TYPE_CHECKING:
    from flexgear.model.case import Case
    from flexgear.model.stage import Stage

OF_EITHER_SIGN = (
    "pin_tangential", "pin_radial", "planet_thickness", "ring_gear_mesh", "sun_gear_mesh",
    "sun_helix_slope", "ring_helix_slope", "planet_sun_helix_slope", "planet_ring_helix_slope",
)  # fmt: skip
LARGEST = 2e-3  # m
TAIL = 8.0  # standard deviations that a normal distribution without limits may reach


class SizeDistribution(Section):
    """Distribution of the size of an error.

    normal    mean (0 if left out), standard_deviation, cut off at low and high where they are given
    uniform   between low and high
    rayleigh  distance of a point whose two coordinates are normal with standard_deviation, as
              eccentricities are; cut off at high

    distribution: its kind. mean, standard_deviation: of the normal one before it is cut off. low,
    high: its ends.
    """

    distribution: Literal["normal", "uniform", "rayleigh"] = "normal"
    mean: Length | None = Field(default=None, ge=-LARGEST, le=LARGEST)
    standard_deviation: Length | None = Field(default=None, gt=0.0, le=LARGEST)
    low: Length | None = Field(default=None, ge=-LARGEST, le=LARGEST)
    high: Length | None = Field(default=None, ge=-LARGEST, le=LARGEST)

    @property
    def usual(self) -> tuple[float, float]:
        """Usual range of values, two standard deviations on either side; m."""
        if self.distribution == "uniform":
            assert self.low is not None and self.high is not None
            return self.low, self.high
        mean, reach = self.mean or 0.0, 2.0 * (self.standard_deviation or 0.0)
        return (0.0 if self.distribution == "rayleigh" else mean - reach), mean + reach

    @property
    def largest(self) -> float:
        """Largest size that can be drawn, but for tails beyond 8 standard deviations; m."""
        ends = [abs(x) for x in (self.low, self.high) if x is not None]
        if len(ends) == 2 or self.distribution == "uniform":
            return max(ends)
        tail = abs(self.mean or 0.0) + TAIL * (self.standard_deviation or 0.0)
        return min(tail, self.high) if self.distribution == "rayleigh" and self.high else tail

    def _check(self) -> None:
        needed, foreign = _KEYS[self.distribution]
        self._require_set(needed, f"is missing in a {self.distribution} distribution", "give it")
        self._refuse_set(foreign, f"has no meaning in a {self.distribution} one")
        low = 0.0 if self.distribution == "rayleigh" else self.low
        if low is not None and self.high is not None and not low < self.high:
            raise Refusal("high", "is not above the low end", "put them in order")
        if self.distribution == "normal":
            self._refuse_far_limits()

    def _refuse_far_limits(self) -> None:
        """Limits in a tail, where hardly anything is left between them."""
        assert self.standard_deviation is not None
        reach = TAIL * self.standard_deviation
        for key, sign in (("low", 1), ("high", -1)):
            limit = getattr(self, key)
            if limit is not None and sign * (limit - (self.mean or 0.0)) > reach:
                raise Refusal(
                    key,
                    f"excludes everything within {TAIL:g} standard deviations of the mean",
                    "check value and unit",
                )


_KEYS = {  # needed, without meaning
    "normal": (("standard_deviation",), ()),
    "uniform": (("low", "high"), ("mean", "standard_deviation")),
    "rayleigh": (("standard_deviation",), ("mean", "low")),
}


class PhaseDistribution(Section):
    """Uniform distribution of a phase, over a whole turn if left out.

    distribution: its kind. low, high: its ends.
    """

    distribution: Literal["uniform"] = "uniform"
    low: Angle = 0.0
    high: Angle = 2 * math.pi

    def _check(self) -> None:
        if not self.low < self.high:
            raise Refusal("high", "is not above the low end", "put them in order")


def _distributions_of(section: type[Section], *names: str) -> Any:
    """A section with a distribution for each of these fields of another one."""
    fields: dict[str, Any] = {
        name: (
            PhaseDistribution | None if name.endswith("_phase") else SizeDistribution | None,
            None,
        )
        for name in names
    }
    return create_model(f"Of{section.__name__}", __base__=Section, **fields)


_ERRORS: Any = _distributions_of(GearErrors, *(n for n in GearErrors.model_fields if n != "seed"))
_GROUND: Any = _distributions_of(
    FlankModifications, "profile_crowning", "profile_slope", "lead_crowning", "twist", "tip_relief"
)


class ErrorDistributions(_ERRORS):
    """Distributions of ``GearErrors``. Pitch deviations of single teeth are drawn anew for every
    sample; their distribution here is that of their standard deviation."""

    same_as: ClassVar = (GearErrors,)

    @property
    def given(self) -> dict[str, SizeDistribution | PhaseDistribution]:
        """Errors that have a distribution, in the order of the fields."""
        return self._stated()

    def _check(self) -> None:
        for name, distribution in self.given.items():
            if not isinstance(distribution, SizeDistribution):
                continue
            if name not in OF_EITHER_SIGN:
                _refuse_negative(name, distribution)
            _refuse_large(name, distribution)


def _refuse_large(name: str, distribution: SizeDistribution) -> None:
    """A size that nothing limits to what flanks can have."""
    if distribution.largest > LARGEST:
        raise Refusal(
            f"{name}.standard_deviation",
            f"lets errors reach {1e3 * distribution.largest:g} mm",
            "give low and high, or check the unit",
        )


def _refuse_negative(name: str, distribution: SizeDistribution) -> None:
    """A size that cannot be negative has no tail there."""
    if distribution.distribution == "rayleigh" or (
        distribution.low is not None and distribution.low >= 0
    ):
        return
    raise Refusal(
        f"{name}.low",
        "is not 0 or more, but this size has no sign",
        'give it, or take distribution = "rayleigh"',
    )


class FlankDistributions(_GROUND):
    """Distributions of the amounts of ``FlankModifications``, and of that of its tip relief, whose
    length and form are those of the case."""

    same_as: ClassVar = (FlankModifications,)

    def _check(self) -> None:
        for name, distribution in self._stated().items():
            if name == "tip_relief":
                _refuse_negative(name, distribution)
            _refuse_large(name, distribution)


FLANKS = {  # gear and its flank by field of ``ModificationDistributions``
    "sun": ("sun", "drive"),
    "ring": ("ring", "drive"),
    "planet_sun": ("planet", "sun"),
    "planet_ring": ("planet", "ring"),
}


class ModificationDistributions(Section):
    """Distributions of flank modifications, for pairs with slices (``face_load``).

    sun, ring: of the flank that carries the rated torque (in a parallel stage, sun: of the
    pinion's). planet_sun, planet_ring: of the planets' flanks towards sun and ring (in a parallel
    stage, planet_sun: of the gear's that carries).
    """

    sun: FlankDistributions = FlankDistributions()
    ring: FlankDistributions = FlankDistributions()
    planet_sun: FlankDistributions = FlankDistributions()
    planet_ring: FlankDistributions = FlankDistributions()

    @property
    def given(self) -> dict[tuple[str, str], SizeDistribution]:
        """Distributions by flank and name of the modification, in the order of the fields."""
        return {
            (flank, name): distribution
            for flank in type(self).model_fields
            for name, distribution in getattr(self, flank)._stated().items()
        }


class OfStage(Section):
    """Distributions of one stage of a train, which replace those of all stages key by key.

    stage: its name. errors: distributions of its errors. modifications: distributions of its flank
    modifications.
    """

    stage: str
    errors: ErrorDistributions = ErrorDistributions()
    modifications: ModificationDistributions = ModificationDistributions()


class Tolerance(Section):
    """A tolerance study.

    samples: sets of parts that are drawn; seed: the same gives the same samples;
    positions_per_gear_mesh: equilibria in each gear-mesh period, over one revolution of the
    carrier; confidence: of the intervals about mean and quantiles. errors: distributions for all
    stages that have the part; by_stage: for single stages. modifications: distributions of flank
    modifications for all stages whose pairs have slices.
    """

    samples: int = Field(default=1000, ge=2, le=10**7)
    seed: int = Field(default=1, ge=0)
    positions_per_gear_mesh: int = Field(default=4, ge=4, le=1000)
    confidence: float = Field(default=0.95, ge=0.5, lt=1.0)
    errors: ErrorDistributions = ErrorDistributions()
    modifications: ModificationDistributions = ModificationDistributions()
    by_stage: tuple[OfStage, ...] = ()

    def ground(self, stage: Stage) -> dict[tuple[str, str], SizeDistribution]:
        """Distributions of modifications of a stage by flank and name; of its parts alone, and none
        where its pairs have no slices."""
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
    """Stages that are named exist and have the parts; Refusal otherwise."""
    seen: set[str] = set()
    for k, of_stage in enumerate(case.tolerance.by_stage):
        at, names = f"tolerance.by_stage.{k}", [s.name for s in case.stages]
        if of_stage.stage not in names:
            raise Refusal(
                f"{at}.stage", f"no stage is {echo(of_stage.stage)}", nearest(of_stage.stage, names)
            )
        if of_stage.stage in seen:
            raise Refusal(f"{at}.stage", f"{of_stage.stage} is named twice", "put them together")
        seen.add(of_stage.stage)
        foreign = [key for key in of_stage.errors.given if key in NOT_PARALLEL]
        if case.stage(of_stage.stage).kind == "parallel" and foreign:
            raise Refusal(
                f"{at}.errors.{foreign[0]}",
                "is an error of a part that a parallel stage does not have",
                "use sun_… for the pinion and planet_… for the gear",
            )
    _check_ground(case)


def _check_ground(case: Case) -> None:
    """Modifications are drawn of pairs with slices, tip relief of flanks that have one."""
    drawn = [case.tolerance.ground(stage) for stage in case.stages]
    modifications = {"tolerance.modifications": case.tolerance.modifications.given}
    for k, of_stage in enumerate(case.tolerance.by_stage):
        modifications[f"tolerance.by_stage.{k}.modifications"] = of_stage.modifications.given
    for at, tolerances in modifications.items():
        for key in tolerances:
            if not any(key in section for section in drawn):
                raise Refusal(
                    f"{at}.{key[0]}.{key[1]}",
                    "needs a stage that has this flank, and slices along the face",
                    'set gear_mesh.model = "face_load", or take it out',
                )
    for stage, section in zip(case.stages, drawn, strict=True):
        for flank, name in section:
            part, side = ground_flank(stage, flank)
            relief = getattr(stage, part).modifications.of(side).tip_relief
            if name == "tip_relief" and relief is None:
                raise Refusal(
                    f"tolerance.modifications.{flank}.tip_relief",
                    f"has no tip relief in {part}.modifications whose amount could be drawn",
                    f"give {part}.modifications.tip_relief its amount and length",
                )


def ground_flank(stage: Stage, flank: str) -> tuple[str, str]:
    """Gear of a stage and its flank, as ``modifications`` call them, of a field of
    ``ModificationDistributions``."""
    part, side = FLANKS[flank]
    if stage.kind == "parallel":
        return ("gear" if part == "planet" else "pinion"), "drive"
    return part, side
