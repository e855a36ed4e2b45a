"""What a tolerance study draws: distributions of manufacturing errors (the section ``tolerance``).

Every error of the section ``errors`` can have a distribution of the same name; it then replaces the
value there. Errors that belong to planets are drawn for each planet on its own.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, ClassVar, Literal

from pydantic import Field, model_validator

from flexgear.model.errors import echo
from flexgear.model.gear_errors import GearErrors
from flexgear.model.read import nearest
from flexgear.model.section import Refusal, Section
from flexgear.model.units import Angle, Length

if TYPE_CHECKING:
    from flexgear.model.case import Case

OF_PLANETS = (
    "pin_tangential", "pin_radial", "planet_eccentricity", "planet_eccentricity_phase",
    "planet_thickness", "planet_sun_helix_slope", "planet_ring_helix_slope",
)  # fmt: skip
OF_EITHER_SIGN = (
    "pin_tangential", "pin_radial", "planet_thickness", "ring_gear_mesh", "sun_gear_mesh",
    "sun_helix_slope", "ring_helix_slope", "planet_sun_helix_slope", "planet_ring_helix_slope",
)  # fmt: skip
NOT_PARALLEL = (  # errors of parts that a parallel stage does not have
    "ring_tooth", "ring_phase", "ring_pitch", "pin_tangential", "pin_radial", "ring_eccentricity",
    "ring_eccentricity_phase", "carrier_eccentricity", "carrier_eccentricity_phase", "ring_offset",
    "ring_offset_phase", "ring_gear_mesh", "ring_gear_mesh_phase", "ring_helix_slope",
    "planet_ring_helix_slope",
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
    def largest(self) -> float:
        """Largest size that can be drawn, but for tails beyond 8 standard deviations; m."""
        ends = [abs(x) for x in (self.low, self.high) if x is not None]
        if len(ends) == 2 or self.distribution == "uniform":
            return max(ends)
        tail = abs(self.mean or 0.0) + TAIL * (self.standard_deviation or 0.0)
        return min(tail, self.high) if self.distribution == "rayleigh" and self.high else tail

    @model_validator(mode="after")
    def _complete(self) -> SizeDistribution:
        needed, foreign = _KEYS[self.distribution]
        for key in needed:
            if getattr(self, key) is None:
                raise Refusal(key, f"is missing in a {self.distribution} distribution", "give it")
        for key in foreign:
            if getattr(self, key) is not None:
                raise Refusal(key, f"has no meaning in a {self.distribution} one", "take it out")
        low = 0.0 if self.distribution == "rayleigh" else self.low
        if low is not None and self.high is not None and not low < self.high:
            raise Refusal("high", "is not above the low end", "put them in order")
        if self.distribution == "normal":
            self._refuse_far_limits()
        return self

    def _refuse_far_limits(self) -> None:
        """Limits in a tail, where hardly anything is left between them."""
        assert self.standard_deviation is not None
        reach = TAIL * self.standard_deviation
        for key, sign in (("low", 1), ("high", -1)):
            limit = getattr(self, key)
            if limit is not None and sign * (limit - (self.mean or 0.0)) > reach:
                raise Refusal(
                    key,
                    f"leaves out all within {TAIL:g} standard deviations of the mean",
                    "check value and unit",
                )


_KEYS = {  # needed, without meaning
    "normal": (("standard_deviation",), ()),
    "uniform": (("low", "high"), ("mean", "standard_deviation")),
    "rayleigh": (("standard_deviation",), ("mean", "low")),
}


class PhaseDistribution(Section):
    """Distribution of a phase: uniform, all round if nothing is said.

    distribution: its kind. low, high: its ends.
    """

    distribution: Literal["uniform"] = "uniform"
    low: Angle = 0.0
    high: Angle = 2 * math.pi

    @model_validator(mode="after")
    def _rising(self) -> PhaseDistribution:
        if not self.low < self.high:
            raise Refusal("high", "is not above the low end", "put them in order")
        return self


class ErrorDistributions(Section):
    """Distributions of what ``GearErrors`` holds. Pitch deviations of single teeth, where there are
    any, are drawn anew for every sample; theirs here is one of their standard deviation."""

    same_as: ClassVar = (GearErrors,)

    ring_tooth: SizeDistribution | None = None
    planet_tooth: SizeDistribution | None = None
    sun_tooth: SizeDistribution | None = None
    ring_phase: PhaseDistribution | None = None
    sun_phase: PhaseDistribution | None = None
    ring_pitch: SizeDistribution | None = None
    planet_pitch: SizeDistribution | None = None
    sun_pitch: SizeDistribution | None = None
    pin_tangential: SizeDistribution | None = None
    pin_radial: SizeDistribution | None = None
    sun_eccentricity: SizeDistribution | None = None
    sun_eccentricity_phase: PhaseDistribution | None = None
    ring_eccentricity: SizeDistribution | None = None
    ring_eccentricity_phase: PhaseDistribution | None = None
    carrier_eccentricity: SizeDistribution | None = None
    carrier_eccentricity_phase: PhaseDistribution | None = None
    planet_eccentricity: SizeDistribution | None = None
    planet_eccentricity_phase: PhaseDistribution | None = None
    ring_offset: SizeDistribution | None = None
    ring_offset_phase: PhaseDistribution | None = None
    planet_thickness: SizeDistribution | None = None
    sun_helix_slope: SizeDistribution | None = None
    ring_helix_slope: SizeDistribution | None = None
    planet_sun_helix_slope: SizeDistribution | None = None
    planet_ring_helix_slope: SizeDistribution | None = None
    ring_gear_mesh: SizeDistribution | None = None
    ring_gear_mesh_phase: PhaseDistribution | None = None
    sun_gear_mesh: SizeDistribution | None = None
    sun_gear_mesh_phase: PhaseDistribution | None = None

    @property
    def given(self) -> dict[str, SizeDistribution | PhaseDistribution]:
        """Errors that have a distribution, in the order of the fields."""
        every = {name: getattr(self, name) for name in type(self).model_fields}
        return {name: found for name, found in every.items() if found is not None}

    @model_validator(mode="after")
    def _possible(self) -> ErrorDistributions:
        for name, found in self.given.items():
            if not isinstance(found, SizeDistribution):
                continue
            if name not in OF_EITHER_SIGN:
                _refuse_negative(name, found)
            if found.largest > LARGEST:
                raise Refusal(
                    f"{name}.standard_deviation",
                    f"lets errors reach {1e3 * found.largest:g} mm",
                    "give low and high, or check the unit",
                )
        return self


def _refuse_negative(name: str, found: SizeDistribution) -> None:
    """A size that cannot be negative has no tail there."""
    if found.distribution == "rayleigh" or (found.low is not None and found.low >= 0):
        return
    raise Refusal(
        f"{name}.low",
        "is not 0 or more, but this size has no sign",
        'give it, or take distribution = "rayleigh"',
    )


class OfStage(Section):
    """Distributions of one stage of a train, which replace those of all stages key by key.

    stage: its name. errors: distributions of its errors.
    """

    stage: str
    errors: ErrorDistributions


class Tolerance(Section):
    """How a tolerance study samples.

    samples: sets of parts that are drawn; seed: the same gives the same samples;
    positions_per_gear_mesh: equilibria a gear-mesh period, over one revolution of the carrier;
    confidence: of the intervals about mean and quantiles. errors: of all stages that have the part;
    by_stage: of single stages.
    """

    samples: int = Field(default=1000, ge=2, le=10**7)
    seed: int = Field(default=1, ge=0)
    positions_per_gear_mesh: int = Field(default=4, ge=4, le=1000)
    confidence: float = Field(default=0.95, ge=0.5, lt=1.0)
    errors: ErrorDistributions = ErrorDistributions()
    by_stage: tuple[OfStage, ...] = ()

    def of(self, stage: str) -> dict[str, SizeDistribution | PhaseDistribution]:
        """Distributions of one stage."""
        found = self.errors.given
        for one in self.by_stage:
            if one.stage == stage:
                found |= one.errors.given
        return found


def check_tolerance(train: Case) -> None:
    """Stages that are named exist and have the parts; Refusal otherwise."""
    seen: set[str] = set()
    for k, one in enumerate(train.tolerance.by_stage):
        at, names = f"tolerance.by_stage.{k}", [s.name for s in train.stages]
        if one.stage not in names:
            raise Refusal(
                f"{at}.stage", f"no stage is {echo(one.stage)}", nearest(one.stage, names)
            )
        if one.stage in seen:
            raise Refusal(f"{at}.stage", f"{one.stage} is named twice", "put them together")
        seen.add(one.stage)
        foreign = [key for key in one.errors.given if key in NOT_PARALLEL]
        if train.stage(one.stage).kind == "parallel" and foreign:
            raise Refusal(
                f"{at}.errors.{foreign[0]}",
                "is an error of a part that a parallel stage does not have",
                "use sun_… for the pinion and planet_… for the gear",
            )
