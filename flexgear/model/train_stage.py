"""One stage of a train: planetary or parallel, of lumped members, or a flexible stage in it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Literal

from pydantic import Field, ValidationError, ValidationInfo, model_validator

from flexgear.model.flexible_stage import FlexibleStage
from flexgear.model.gear_errors import GearErrors
from flexgear.model.section import Missing, Refusal, Section, error_details
from flexgear.model.stage import Stage, check_bore, required_hand
from flexgear.model.train_errors import TrainErrors
from flexgear.model.train_gear_mesh import TrainGearMesh
from flexgear.model.train_member import PlanetBearing, Support, TrainCarrier, TrainGear
from flexgear.model.units import Angle, Length

# what a flexible stage takes from its own case
FROM_FLEXIBLE = (
    "planets", "normal_module", "pressure_angle", "helix_angle", "face_width", "planet_hand",
    "center_distance", "planet_positions", "allow_unassemblable", "backlash_ring",
    "backlash_sun", "sun", "planet", "ring",
)  # fmt: skip
PLANETARY = ("sun", "ring", "carrier")
PARALLEL = ("pinion", "gear")


class TrainStage(Section):
    """A stage. Geometry as in ``Stage``; what is new:

    kind: planetary (sun, planet, ring, carrier) or parallel (pinion and gear; ``position`` is the
    direction from pinion to gear). double_helical: two halves of ``face_width`` each with
    ``half_gap`` between them and separate ring halves; planet_hand is then that of the planet's
    left half (−z), mass, inertia, support and stiffness of the ring and its gear mesh those of one
    half. ring_pressure_angle, sun_pressure_angle: transverse working angles in place of
    those from the geometry. case: a flexible stage, by bundled name or file, whose gears, planet
    bearing, gear mesh and errors are taken from it; ``flexible`` is that case once read.
    """

    name: str = Field(default="", pattern=r"^([A-Za-z][A-Za-z0-9_-]*)?$")
    kind: Literal["planetary", "parallel"] = "planetary"
    planets: int = Field(default=1, ge=1, le=20)  # 1 stands for a parallel stage only
    normal_module: Length = Field(ge=2e-4, le=0.1)
    pressure_angle: Angle = Field(ge=math.radians(10), le=math.radians(35))
    helix_angle: Angle = Field(default=0.0, ge=0.0, le=math.radians(45))
    face_width: Length = Field(ge=1e-3, le=2.0)
    planet_hand: Literal["right", "left"] = "right"
    double_helical: bool = False
    half_gap: Length = Field(default=0.0, ge=0.0, le=1.0)
    center_distance: Length | None = Field(default=None, ge=1e-3, le=5.0)
    planet_positions: tuple[Angle, ...] | None = None
    allow_unassemblable: bool = False
    backlash_ring: Length = Field(default=0.0, ge=0.0, le=0.02)
    backlash_sun: Length = Field(default=0.0, ge=0.0, le=0.02)
    ring_pressure_angle: Angle | None = Field(default=None, ge=math.radians(5), le=math.radians(45))
    sun_pressure_angle: Angle | None = Field(default=None, ge=math.radians(5), le=math.radians(45))
    position: Angle = 0.0
    sun: TrainGear | None = None
    planet: TrainGear | None = None
    ring: TrainGear | None = None
    carrier: TrainCarrier | None = None
    pinion: TrainGear | None = None
    gear: TrainGear | None = None
    planet_bearing: PlanetBearing = PlanetBearing()
    gear_mesh: TrainGearMesh = TrainGearMesh()
    errors: TrainErrors = TrainErrors()
    case: str | None = None
    flexible: FlexibleStage | None = None

    @property
    def planet_angles(self) -> tuple[float, ...]:
        """Angles of the planets in the carrier, rad; of the gear from the pinion if parallel."""
        if self.kind == "parallel":
            return (self.position,)
        if self.planet_positions is not None:
            return self.planet_positions
        return tuple(2.0 * math.pi * i / self.planets for i in range(self.planets))

    @property
    def members(self) -> tuple[str, ...]:
        """Members that turn about fixed axes, without the stage's name."""
        return PLANETARY if self.kind == "planetary" else PARALLEL

    def member(self, name: str) -> TrainGear | TrainCarrier:
        """One of ``members`` or "planet"."""
        member = getattr(self, name)
        if member is None:
            raise KeyError(f"stage {self.name} has no {name}")
        assert isinstance(member, TrainGear | TrainCarrier)
        return member

    @property
    def stage(self) -> Stage:
        """Geometry alone of a planetary stage (of one half, if double-helical)."""
        gears = {"sun": self.sun, "planet": self.planet, "ring": self.ring}
        return Stage(
            **{name: getattr(self, name) for name in Stage.model_fields if name not in gears},
            **{name: gear and gear.gear for name, gear in gears.items()},  # type: ignore[arg-type]
        )

    @classmethod
    def required(cls, data: Mapping[str, Any]) -> list[Missing]:
        """Parts and number of planets by the kind of the stage, the hand of helical gears."""
        if data.get("flexible") is not None:  # has them from its own case
            return []
        kind = data.get("kind", "planetary")
        if kind == "parallel":
            parts: tuple[str, ...] = PARALLEL
        else:
            parts = ("sun", "planet", "ring", "carrier")
        lacks = [
            Missing(name, f"is missing in a {kind} stage", f"add a section for the {name}")
            for name in parts
            if data.get(name) is None
        ]
        if kind == "planetary" and "planets" not in data:
            lacks.append(Missing("planets", "is missing in a planetary stage"))
        return lacks + required_hand(data)

    @model_validator(mode="before")
    @classmethod
    def _from_flexible(cls, data: Any, info: ValidationInfo) -> Any:
        """A flexible stage has the gears of its own case."""
        if not isinstance(data, dict) or data.get("flexible") is None:
            return data
        case = data["flexible"]
        if not isinstance(case, FlexibleStage):
            case = _inner_case(case, strict=info.mode != "json")
        taken = {name: getattr(case.stage, name) for name in FROM_FLEXIBLE}
        for name in ("sun", "planet", "ring"):
            taken[name] = taken[name].model_dump()
        errors = data.get("errors") or {}
        if isinstance(errors, TrainErrors):
            errors = errors.model_dump()
        return {
            **data,
            **taken,
            "carrier": {},
            "planet_bearing": case.bearings.planet.model_dump(),
            "gear_mesh": case.gear_mesh.model_dump(),
            "errors": {**errors, **{k: getattr(case.errors, k) for k in GearErrors.model_fields}},
            "flexible": case,
        }

    @model_validator(mode="after")
    def _complete(self) -> TrainStage:
        if self.kind == "parallel":
            self._check_parallel()
        else:
            self._check_planetary()
        self._check_errors()
        self._check_clearances()
        return self

    def _check_parallel(self) -> None:
        self._check_parts(PARALLEL, ("sun", "planet", "ring", "carrier"))
        if self.planets != 1 or self.planet_positions is not None:
            key = "planets" if self.planets != 1 else "planet_positions"
            raise Refusal(key, "a parallel stage has no planets", "take it out, or use position")
        if self.double_helical and self.helix_angle == 0:
            raise Refusal("helix_angle", "is zero in a double-helical stage", "give it")
        for name, gear in (("pinion", self.pinion), ("gear", self.gear)):
            assert gear is not None
            check_bore(name, gear, self.normal_module)

    def _check_planetary(self) -> None:
        self._check_parts(("sun", "planet", "ring", "carrier"), PARALLEL)
        try:
            _ = self.stage  # its own checks, with the same keys
        except ValidationError as fault:
            first = fault.errors()[0]
            raise first.get("ctx", {}).get("error") or ValueError(first["msg"]) from None
        if self.double_helical and self.helix_angle == 0:
            raise Refusal("helix_angle", "is zero in a double-helical stage", "give it")
        assert self.planet is not None and self.carrier is not None
        turning = self.planet.kinematics
        if turning == "fixed" or (turning == "torsional" and self.carrier.kinematics != "fixed"):
            raise Refusal(
                "planet.kinematics",
                f"{turning!r} planets cannot follow the carrier",
                "use planar, axial or spatial",
            )
        if min(self.planet_bearing.stiffness[:2]) <= 0:
            raise Refusal(
                "planet_bearing.radial", "is zero, so the planet is not held", "give a stiffness"
            )
        if self.planet.support.matrix.any() or self.planet.support.tangential:
            raise Refusal(
                "planet.support", "planets are not supported by the housing", "use planet_bearing"
            )

    def _check_parts(self, needed: tuple[str, ...], foreign: tuple[str, ...]) -> None:
        for name in foreign:
            if getattr(self, name) is not None:
                raise Refusal(
                    name,
                    f"is no part of a {self.kind} stage",
                    f"take it out; its parts are {', '.join(needed)}",
                )

    def _check_errors(self) -> None:
        self.errors.require_planets(self.planets)
        if self.kind == "parallel":
            for key in ("ring_eccentricity", "carrier_eccentricity", "ring_offset",
                        "ring_gear_mesh", "ring_tooth", "ring_pitch", "pin_radial",
                        "pin_tangential"):  # fmt: skip
                if getattr(self.errors, key):
                    raise Refusal(
                        f"errors.{key}",
                        "is an error of a part that a parallel stage does not have",
                        "use sun_… for the pinion and planet_… for the gear",
                    )

    def _check_clearances(self) -> None:
        """A gear that moves by a module has lost its mates."""
        supports: dict[str, Support] = {"planet_bearing": self.planet_bearing}
        for name in self.members:
            supports[f"{name}.support"] = self.member(name).support
        for key, support in supports.items():
            if support.clearance >= self.normal_module:
                raise Refusal(
                    f"{key}.clearance",
                    f"{1e3 * support.clearance:g} mm is as much as the module of "
                    f"{1e3 * self.normal_module:g} mm: the teeth would come apart",
                    "check the unit; bearings have some hundredths of a millimetre",
                )


def _inner_case(data: Any, strict: bool) -> FlexibleStage:
    """A flexible stage's case; its faults are located below ``flexible``."""
    try:
        return FlexibleStage.model_validate(data, strict=strict)
    except ValidationError as fault:
        lines = error_details(fault, "flexible")
        raise ValidationError.from_exception_data("TrainStage", lines) from None
