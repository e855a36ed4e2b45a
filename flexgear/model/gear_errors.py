"""Manufacturing errors of gears, carrier and pins (the section ``errors`` of a stage)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pydantic import Field, model_validator

from flexgear.model.section import Refusal, Section
from flexgear.model.units import Angle, Length

_LARGEST = 2e-3  # m
PLANET_LISTS = (
    "planet_eccentricity", "planet_eccentricity_phase", "planet_thickness",
    "planet_sun_helix_slope", "planet_ring_helix_slope",
)  # fmt: skip


PIN_LISTS = ("pin_tangential", "pin_radial")


def _or_one_number(schema: dict[str, Any]) -> None:
    """JSON schema of a list that takes a number, too."""
    several = {key: schema.pop(key) for key in ("type", "items")}
    schema["anyOf"] = [several, several["items"]]


def _of_planets() -> Any:
    """Field of a list of planets."""
    return Field(default=(), json_schema_extra=_or_one_number)


class GearErrors(Section):
    """Errors described once, at the part that has them; geometry projects them onto both meshes.

    An eccentricity is where a gear's geometric centre lies from its axis of rotation: amplitude
    and phase, counted from the stage's x axis at θ = 0 for sun, ring and carrier (turning with
    them) and from the planet's radial axis for planets. A number in place of a list of planets is
    the same for all of them.

    sun_eccentricity, ring_eccentricity, carrier_eccentricity, planet_eccentricity: its amplitude.
    sun_eccentricity_phase, ring_eccentricity_phase, carrier_eccentricity_phase,
    planet_eccentricity_phase: its direction. ring_offset: of the ring's centre, which stands still
    in space. ring_offset_phase: its direction from the x axis. ring_gear_mesh_phase,
    sun_gear_mesh_phase: phase of the error at gear-mesh frequency. seed: of random deviations.
    planet_thickness: excess of the tooth thickness on the reference circle. Lists of planets hold
    one value for all or one a planet. ring_gear_mesh, sun_gear_mesh: amplitude of an error at
    gear-mesh frequency, excess of material positive. In a parallel stage the pinion has the sun's
    errors and the wheel the planet's.

    ring_tooth, planet_tooth, sun_tooth: tooth-to-tooth (single-tooth) deviation f_i' of each gear;
    a gear mesh has the harmonic error 0.5 (f_i'1 + f_i'2) sin(2π s/p_b + phase), the same for all
    its teeth. ring_phase, sun_phase: its phase at the ring and at the sun gear mesh.
    ring_pitch, planet_pitch, sun_pitch: standard deviation of random single-tooth deviations,
    drawn once a tooth with ``seed``. pin_tangential, pin_radial: position error of each pin
    (list, one value a planet; empty: none), + in the sense of rotation and outward.

    sun_helix_slope, ring_helix_slope: helix slope deviation f_Hβ of the drive flank, how much more
    is missing at the +z end of the face than at its -z end, as helix_slope of modifications.
    planet_sun_helix_slope, planet_ring_helix_slope: that of the planets' flank towards sun, ring.
    """

    ring_tooth: Length = Field(default=0.0, ge=0.0, le=1e-3)
    planet_tooth: Length = Field(default=0.0, ge=0.0, le=1e-3)
    sun_tooth: Length = Field(default=0.0, ge=0.0, le=1e-3)
    ring_phase: Angle = 0.0
    sun_phase: Angle = 0.0
    ring_pitch: Length = Field(default=0.0, ge=0.0, le=1e-3)
    planet_pitch: Length = Field(default=0.0, ge=0.0, le=1e-3)
    sun_pitch: Length = Field(default=0.0, ge=0.0, le=1e-3)
    seed: int = Field(default=1, ge=0)
    pin_tangential: tuple[Length, ...] = _of_planets()
    pin_radial: tuple[Length, ...] = _of_planets()
    sun_eccentricity: Length = Field(default=0.0, ge=0.0, le=_LARGEST)
    sun_eccentricity_phase: Angle = 0.0
    ring_eccentricity: Length = Field(default=0.0, ge=0.0, le=_LARGEST)
    ring_eccentricity_phase: Angle = 0.0
    carrier_eccentricity: Length = Field(default=0.0, ge=0.0, le=_LARGEST)
    carrier_eccentricity_phase: Angle = 0.0
    planet_eccentricity: tuple[Length, ...] = _of_planets()
    planet_eccentricity_phase: tuple[Angle, ...] = _of_planets()
    ring_offset: Length = Field(default=0.0, ge=0.0, le=_LARGEST)
    ring_offset_phase: Angle = 0.0
    planet_thickness: tuple[Length, ...] = _of_planets()
    sun_helix_slope: Length = Field(default=0.0, ge=-_LARGEST, le=_LARGEST)
    ring_helix_slope: Length = Field(default=0.0, ge=-_LARGEST, le=_LARGEST)
    planet_sun_helix_slope: tuple[Length, ...] = _of_planets()
    planet_ring_helix_slope: tuple[Length, ...] = _of_planets()
    ring_gear_mesh: Length = Field(default=0.0, ge=-_LARGEST, le=_LARGEST)
    ring_gear_mesh_phase: Angle = 0.0
    sun_gear_mesh: Length = Field(default=0.0, ge=-_LARGEST, le=_LARGEST)
    sun_gear_mesh_phase: Angle = 0.0

    @staticmethod
    def for_each(data: Mapping[str, Any], planets: int) -> dict[str, Any]:
        """Data of the section, not yet read, with numbers in place of lists said once a planet."""
        numbers = {
            key: (data[key],) * planets
            for key in (*PLANET_LISTS, *PIN_LISTS)
            if isinstance(data.get(key), (int, float))
        }
        return {**data, **numbers}

    def require_planets(self, planets: int) -> None:
        """Refusal where a list has another number of values than there are planets."""
        for key in (*PLANET_LISTS, *PIN_LISTS):
            count = len(getattr(self, key))
            if count in (0, planets) or (count == 1 and key in PLANET_LISTS):
                continue
            one_for_all = ", or one for all" if key in PLANET_LISTS else ""
            more = count > planets
            there = f"planet {planets + 1} does not exist" if more else "some planets have none"
            raise Refusal(
                f"errors.{key}",
                f"{count} values for {planets} planets: {there}",
                f"give one for each planet{one_for_all}",
            )

    def of_planets(self, name: str, planets: int) -> tuple[float, ...]:
        """One value a planet of one of the lists; zeros where it is empty."""
        values: tuple[float, ...] = getattr(self, name)
        if not values:
            return (0.0,) * planets
        return values * planets if len(values) == 1 else values

    @model_validator(mode="after")
    def _plausible(self) -> GearErrors:
        for name in PLANET_LISTS:
            if name == "planet_eccentricity_phase":
                continue
            values = getattr(self, name)
            low = 0.0 if name == "planet_eccentricity" else -_LARGEST
            wrong = [v for v in values if not low <= v <= _LARGEST]
            if wrong:
                raise Refusal(
                    name,
                    f"{1e3 * wrong[0]:g} mm is outside {1e3 * low:g} … {1e3 * _LARGEST:g} mm",
                    "check value and unit",
                )
        return self
