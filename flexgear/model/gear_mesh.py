"""Gear mesh of a stage: stiffness, contact, damping, and manufacturing errors of its gears."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from typing import Any, Literal

from pydantic import Field

from flexgear.model.section import Missing, Refusal, Section
from flexgear.model.units import Angle, Length, Rate, Stiffness, StiffnessPerWidth, Time


class StiffnessTable(Section):
    """Stiffness of a tooth pair per face width, along the 3D normal, over the path of contact.

    position: share of the path of contact from 0 (smallest distance to the planet's base tangent
    point, the planet's root) to 1 (the planet's tip), rising. stiffness: at these positions.
    """

    position: tuple[float, ...] = Field(min_length=2)
    stiffness: tuple[StiffnessPerWidth, ...] = Field(min_length=2)

    def _check(self) -> None:
        p = self.position
        if len(p) != len(self.stiffness):
            raise Refusal(
                "stiffness", f"{len(self.stiffness)} values at {len(p)} positions", "match them"
            )
        if any(b <= a for a, b in itertools.pairwise(p)) or p[0] < 0 or p[-1] > 1:
            raise Refusal("position", "does not rise from 0 to 1", "put it in order")
        if min(self.stiffness) <= 0 or max(self.stiffness) > 1e12:
            raise Refusal("stiffness", "is not plausible", "about 10 to 25 N/(mm µm)")


class GearMeshTables(Section):
    """Tables of both gear meshes, for pair_stiffness = "table".

    ring, sun: of the planets' pairs with the ring, with the sun.
    """

    ring: StiffnessTable
    sun: StiffnessTable


class GearMesh(Section):
    """Gear-mesh options.

    table: of both gear meshes, for pair_stiffness = "table". slices: of a contact line under
    face_load. tooth_compliance: of slices: width, independent springs by pair_stiffness; fe, an FE
    influence matrix of both teeth (half a minute for each gear, cached) with Hertz's line contact.
    root_stress: under face_load, stress of all tooth roots; fe, by an FE submodel of three teeth
    (about a minute for each gear, cached). path_only: under face_load tips do not touch before and
    after the path of contact. harmonics: terms of a fourier wave.

    model: per_pair, one spring for every tooth pair; face_load, its contact line cut into slices,
    for load along the face; lumped, one element at the pitch point for all pairs together;
    constant, the mean stiffness there; rectangular, a wave between the two numbers of pairs in
    contact; fourier, that wave's first ``harmonics`` terms. ring_stiffness, sun_stiffness: mean,
    N/m along the 3D normal, of one gear mesh (of each half of a double-helical stage); if left out
    from pair_stiffness, for waves c_γ b of ISO 6336-1. A parallel stage uses sun_*.
    ring_contact_ratio, sun_contact_ratio: of the waves; from the geometry if left out.
    ring_stiffness_step, sun_stiffness_step: increase of a rectangular wave by one more pair in
    contact about the given mean, and likewise of a fourier wave; mean over contact ratio if left
    out. ring_harmonic_shares, sun_harmonic_shares: a_1, a_2 … of a fourier wave with prescribed
    terms, k = mean [1 + Σ a_h cos(2π h s/p_b + φ_h)], s being the planet's place on the path of the
    flank that carries the rated torque, as in ring_gear_mesh of errors; the other flank has the
    same stiffness at every instant. ring_harmonic_phases, sun_harmonic_phases: φ_h; 0 if left out.
    contact_law: one-sided, with backlash and coast flanks; linear, pairs on the path also pull.
    pair_stiffness: iso6336, parabola with the peak c'; weber-banaschek, deflection of the real
    profiles; table. end_ratio: value of the parabola at the ends of the path over its peak.
    damping_ratio: of each pair against the gears' equivalent mass. damping_law: in-contact, pairs
    are damped only while they touch and never pull, by c ~ √k; always, the flank that carries has a
    constant damper of the mean stiffness, whether pairs touch or not. Defaults of a stage of lumped
    members are constant stiffness and linear contact, one-sided with face_load.
    """

    model: Literal["per_pair", "face_load", "lumped", "constant", "rectangular", "fourier"] = (
        "per_pair"
    )
    slices: int = Field(default=15, ge=1, le=101)
    path_only: bool = False
    tooth_compliance: Literal["width", "fe"] = "width"
    root_stress: Literal["none", "fe"] = "none"
    contact_law: Literal["one-sided", "linear"] = "one-sided"
    pair_stiffness: Literal["iso6336", "weber-banaschek", "table"] = "iso6336"
    end_ratio: float = Field(default=0.67, ge=0.05, le=1.0)
    table: GearMeshTables | None = None
    damping_ratio: float = Field(default=0.07, ge=0.0, le=1.0)
    damping_law: Literal["in-contact", "always"] = "in-contact"
    ring_stiffness: Stiffness | None = Field(default=None, gt=0.0, le=1e13)
    sun_stiffness: Stiffness | None = Field(default=None, gt=0.0, le=1e13)
    harmonics: int = Field(default=5, ge=1, le=100)
    ring_contact_ratio: float | None = Field(default=None, ge=1.0, le=20.0)
    sun_contact_ratio: float | None = Field(default=None, ge=1.0, le=20.0)
    ring_stiffness_step: Stiffness | None = Field(default=None, gt=0.0, le=1e13)
    sun_stiffness_step: Stiffness | None = Field(default=None, gt=0.0, le=1e13)
    ring_harmonic_shares: tuple[float, ...] = Field(default=(), max_length=100)
    sun_harmonic_shares: tuple[float, ...] = Field(default=(), max_length=100)
    ring_harmonic_phases: tuple[Angle, ...] = ()
    sun_harmonic_phases: tuple[Angle, ...] = ()

    def _check(self) -> None:
        if self.pair_stiffness == "table" and self.table is None:
            raise Missing(
                "table", "is missing", "give [gear_mesh.table.ring] and [gear_mesh.table.sun]"
            )
        if self.model == "face_load" and self.contact_law == "linear":
            raise Refusal(
                "contact_law",
                "'linear' lets flanks pull, which slices along the face do not",
                'use "one-sided" with face_load',
            )
        if self.root_stress == "fe" and self.model != "face_load":
            raise Refusal(
                "root_stress",
                f"'fe' needs the load along the face, which model = '{self.model}' does not give",
                'use model = "face_load" with it, or take it out',
            )
        for role in ("ring", "sun"):
            self._check_wave(role)

    def _check_wave(self, role: str) -> None:
        """Refusal of steps and terms of a wave that the model or other keys leave no place."""
        step, shares = self.of(role, "stiffness_step"), self.of(role, "harmonic_shares")
        phases = self.of(role, "harmonic_phases")
        if step is not None and self.model not in ("rectangular", "fourier"):
            raise Refusal(
                f"{role}_stiffness_step",
                f"has no place in model = '{self.model}'",
                'use model = "rectangular", or take it out',
            )
        if step is not None and self.of(role, "stiffness") is None:
            raise Missing(f"{role}_stiffness", f"is missing beside {role}_stiffness_step")
        if shares and (self.model != "fourier" or step is not None):
            beside = "a stiffness step" if step is not None else f"model = '{self.model}'"
            raise Refusal(
                f"{role}_harmonic_shares",
                f"has no place beside {beside}",
                'use model = "fourier" without a step, or take it out',
            )
        if phases and len(phases) != len(shares):
            raise Refusal(
                f"{role}_harmonic_phases",
                f"{len(phases)} phases of {len(shares)} terms",
                f"give one for each of {role}_harmonic_shares",
            )

    def of(self, role: str, name: str) -> Any:
        """An option of "sun" or "ring": stiffness, contact_ratio, stiffness_step, harmonic_shares,
        harmonic_phases."""
        return getattr(self, f"{role}_{name}")


class Damping(Section):
    """Structural damping: modal ratio of the coupled system, or C = α M + β K.

    kind: one of the two. ratio: of every mode to critical damping. ratios: of the first elastic
    modes of the train without its gear meshes, by rising frequency, in the place of ratio. alpha,
    beta: of mass and of stiffness in Rayleigh damping.
    """

    kind: Literal["modal", "rayleigh"] = "modal"
    ratio: float = Field(default=0.02, ge=0.0, le=1.0)
    ratios: tuple[float, ...] = ()
    alpha: Rate = Field(default=0.0, ge=0.0, le=1e4)
    beta: Time = Field(default=0.0, ge=0.0, le=1.0)

    def _check(self) -> None:
        if self.ratios and self.kind != "modal":
            raise Refusal("ratios", "are given for Rayleigh damping", 'use kind = "modal"')
        if not all(0.0 <= ratio <= 1.0 for ratio in self.ratios):
            raise Refusal("ratios", "are shares of critical damping", "give numbers from 0 to 1")


_LARGEST = 2e-3  # m
PLANET_LISTS = (
    "planet_eccentricity", "planet_eccentricity_phase", "planet_thickness",
    "planet_sun_helix_slope", "planet_ring_helix_slope",
)  # fmt: skip
PIN_LISTS = ("pin_tangential", "pin_radial")
OF_PLANETS = (*PIN_LISTS, *PLANET_LISTS)  # of which each planet has its own
MOST_PLANETS = 20


def equal_spacing(planets: int) -> tuple[float, ...]:
    """Angles of equally spaced planets, rad."""
    return tuple(2.0 * math.pi * i / planets for i in range(planets))


def each_planet(name: str, values: Any, planets: Any) -> Any:
    """SI values of a list of planets, read or not yet read, one for each: a number is that of all
    of them, and one value, too, of errors that are not the pins'; where there is none, zeros, and
    angles of equal spacing. Other fields stay as they are."""
    count = planets if isinstance(planets, int) and planets <= MOST_PLANETS else 0
    if name == "planet_positions":
        return values or equal_spacing(count)
    if name not in OF_PLANETS:
        return values
    if isinstance(values, (int, float)):
        return (values,) * count
    if values and len(values) == 1 and name in PLANET_LISTS:
        return tuple(values) * count
    return values or (0.0,) * count


def _or_one_number(schema: dict[str, Any]) -> None:
    """JSON schema of a list that takes a number, too."""
    several = {key: schema.pop(key) for key in ("type", "items")}
    schema["anyOf"] = [several, several["items"]]


def _of_planets() -> Any:
    """Field of a list of planets."""
    return Field(default=(), json_schema_extra=_or_one_number)


class GearErrors(Section):
    """Errors stated once, at the part that has them; geometry projects them onto both gear meshes.

    An eccentricity is the position of a gear's geometric centre from its axis of rotation:
    amplitude and phase, counted from the stage's x axis at θ = 0 for sun, ring and carrier (turning
    with them) and from the planet's radial axis for planets. A number in place of a list of planets
    holds for all of them.

    sun_eccentricity, ring_eccentricity, carrier_eccentricity, planet_eccentricity: its amplitude.
    sun_eccentricity_phase, ring_eccentricity_phase, carrier_eccentricity_phase,
    planet_eccentricity_phase: its direction. ring_offset: of the ring's centre, fixed in space.
    ring_offset_phase: its direction from the x axis. ring_gear_mesh_phase, sun_gear_mesh_phase:
    phase of the error at gear-mesh frequency. seed: of random deviations. planet_thickness: excess
    of the tooth thickness on the reference circle. Lists of planets have one value for all or one
    for each planet. ring_gear_mesh, sun_gear_mesh: amplitude of an error at gear-mesh frequency,
    excess of material positive. In a parallel stage the pinion has the sun's errors and the wheel
    the planet's.

    ring_tooth, planet_tooth, sun_tooth: tooth-to-tooth (single-tooth) deviation f_i' of each gear;
    a gear mesh has the harmonic error 0.5 (f_i'1 + f_i'2) sin(2π s/p_b + phase), the same for all
    its teeth. ring_phase, sun_phase: its phase at the ring and at the sun gear mesh.
    harmonic_on_coast: effect of all errors at gear-mesh frequency on coast flanks: excess, material
    there, too, at their position on the path; opposite, they open a coast flank by as much as they
    close the drive flank at the same instant, as the e(t) of oscillators with clearance.
    ring_pitch, planet_pitch, sun_pitch: standard deviation of random single-tooth deviations, drawn
    once for each tooth with ``seed``. pin_tangential, pin_radial: position error of each pin (list,
    one value for each planet; empty: none), + in the sense of rotation and outward.

    sun_helix_slope, ring_helix_slope: helix slope deviation f_Hβ of the drive flank, positive where
    more is missing at the +z end of the face, as helix_slope of modifications.
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
    harmonic_on_coast: Literal["excess", "opposite"] = "excess"

    @staticmethod
    def for_each(data: Mapping[str, Any], planets: int) -> dict[str, Any]:
        """Data of the section, not yet read, with numbers in place of lists said once a planet."""
        numbers = [key for key in OF_PLANETS if isinstance(data.get(key), (int, float))]
        return {**data, **{key: each_planet(key, data[key], planets) for key in numbers}}

    def require_planets(self, planets: int) -> None:
        """Refusal where a list has another number of values than there are planets."""
        for key in OF_PLANETS:
            count = len(getattr(self, key))
            if count in (0, planets) or (count == 1 and key in PLANET_LISTS):
                continue
            one_for_all = ", or one for all" if key in PLANET_LISTS else ""
            more = count > planets
            mismatch = f"planet {planets + 1} does not exist" if more else "some planets have none"
            raise Refusal(
                f"errors.{key}",
                f"{count} values for {planets} planets: {mismatch}",
                f"give one for each planet{one_for_all}",
            )

    def refuse_parallel(self) -> None:
        """Refusal of errors of parts that a parallel stage does not have."""
        keys = [key for key in NOT_PARALLEL if not key.endswith("_phase")]
        problem = "is an error of a part that a parallel stage does not have"
        self._refuse_set(keys, problem, "use sun_… for the pinion and planet_… for the gear")

    def of_planets(self, name: str, planets: int) -> tuple[float, ...]:
        """One value a planet of one of the lists; zeros where it is empty."""
        values: tuple[float, ...] = each_planet(name, getattr(self, name), planets)
        return values

    def _check(self) -> None:
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


NOT_PARALLEL = tuple(  # errors of parts that a parallel stage does not have
    name
    for name in GearErrors.model_fields
    if name.startswith(("ring", "carrier", "pin", "planet_ring"))
)
