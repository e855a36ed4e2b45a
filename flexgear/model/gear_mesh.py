"""Gear mesh of a stage: stiffness, contact, damping, and manufacturing errors of its gears."""

import itertools
import math
from collections.abc import Mapping
from typing import Any, Literal

from pydantic import Field, field_validator

from flexgear.model.section import Missing, Refusal, Section
from flexgear.model.units import Angle, Length, Rate, Stiffness, StiffnessPerWidth, Time


class StiffnessTable(Section):
    """Stiffness of a tooth pair per face width, along the 3D normal, over the path of contact.

    position: positions on the path of contact, increasing from 0 (smallest distance to the planet's
    base tangent point, the planet's root) to 1 (the planet's tip). stiffness: at these positions.
    """

    position: tuple[float, ...] = Field(min_length=2)
    stiffness: tuple[StiffnessPerWidth, ...] = Field(min_length=2)

    def _check(self) -> None:
        p = self.position
        if len(p) != len(self.stiffness):
            problem = f"{len(self.stiffness)} values at {len(p)} positions"
            raise Refusal("stiffness", problem, "match them")
        if any(b <= a for a, b in itertools.pairwise(p)) or p[0] < 0 or p[-1] > 1:
            raise Refusal("position", "does not increase from 0 to 1", "put it in order")
        if min(self.stiffness) <= 0 or max(self.stiffness) > 1e12:
            raise Refusal("stiffness", "is not plausible", "about 10 to 25 N/(mm µm)")


class GearMeshTables(Section):
    """Stiffness tables of both gear meshes, for pair_stiffness = "table".

    ring, sun: table of the planets' tooth pairs with the ring, with the sun.
    """

    ring: StiffnessTable
    sun: StiffnessTable


class GearMesh(Section):
    """Gear-mesh options.

    table: stiffness of both gear meshes, for pair_stiffness = "table". slices: number of slices of
    a contact line with face_load. tooth_compliance: compliance of slices: width, independent
    springs by pair_stiffness; fe, an FE influence matrix of both teeth (half a minute for each
    gear, cached) with Hertz's line contact. root_stress: stress in all tooth roots with face_load:
    fe, by an FE submodel of three teeth (about a minute for each gear, cached). path_only: with
    face_load, whether tip contact before and after the path of contact is ignored. harmonics:
    number of terms of a fourier wave.

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
    flank that carries the rated torque, as in ring_gear_mesh of errors; s falls with time where the
    planet is driven, and rises where it drives; the other flank has the same stiffness at every
    instant. ring_harmonic_phases, sun_harmonic_phases: φ_h; 0 if left out.
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
            problem = "is missing"
            raise Missing("table", problem, "give [gear_mesh.table.ring] and [gear_mesh.table.sun]")
        if self.model == "face_load" and self.contact_law == "linear":
            problem = "'linear' allows tensile forces, which slices along the face do not have"
            raise Refusal("contact_law", problem, 'use "one-sided" with face_load')
        if self.root_stress == "fe" and self.model != "face_load":
            problem = (
                f"'fe' needs the load along the face, which model = '{self.model}' does not give"
            )
            raise Refusal("root_stress", problem, 'use model = "face_load" with it, or take it out')
        for role in ("ring", "sun"):
            self._check_wave(role)

    def _check_wave(self, role: str) -> None:
        """Raise Refusal for steps and terms of a wave that do not suit the model or other keys."""
        step, shares = self.of(role, "stiffness_step"), self.of(role, "harmonic_shares")
        phases = self.of(role, "harmonic_phases")
        if step is not None and self.model not in ("rectangular", "fourier"):
            problem = f"has no effect with model = '{self.model}'"
            remedy = 'use model = "rectangular", or take it out'
            raise Refusal(f"{role}_stiffness_step", problem, remedy)
        if step is not None and self.of(role, "stiffness") is None:
            raise Missing(f"{role}_stiffness", f"is missing beside {role}_stiffness_step")
        if shares and (self.model != "fourier" or step is not None):
            beside = "a stiffness step" if step is not None else f"model = '{self.model}'"
            remedy = 'use model = "fourier" without a step, or take it out'
            raise Refusal(f"{role}_harmonic_shares", f"cannot be used with {beside}", remedy)
        if phases and len(phases) != len(shares):
            problem = f"{len(phases)} phases for {len(shares)} terms"
            remedy = f"give one for each of {role}_harmonic_shares"
            raise Refusal(f"{role}_harmonic_phases", problem, remedy)

    def of(self, role: str, name: str) -> Any:
        """An option of "sun" or "ring": stiffness, contact_ratio, stiffness_step, harmonic_shares,
        harmonic_phases."""
        return getattr(self, f"{role}_{name}")


class Damping(Section):
    """Structural damping: modal ratio of the coupled system, or C = α M + β K.

    kind: modal or rayleigh. ratio: damping of every mode over critical damping. ratios: damping of
    the first elastic modes of the train without its gear meshes, by increasing frequency, in place
    of ratio. alpha, beta: factors of mass and stiffness in Rayleigh damping.
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
            raise Refusal("ratios", "are outside 0 … 1 of critical damping", "correct them")


_LARGEST = 2e-3  # m
PLANET_LISTS = (
    "planet_eccentricity", "planet_eccentricity_phase", "planet_thickness",
    "planet_sun_helix_slope", "planet_ring_helix_slope",
)  # fmt: skip
PIN_LISTS = ("pin_tangential", "pin_radial")
OF_PLANETS = (*PIN_LISTS, *PLANET_LISTS)  # keys with one value for each planet
HARMONICS = (
    "ring_gear_mesh", "ring_gear_mesh_phase", "sun_gear_mesh", "sun_gear_mesh_phase",
)  # fmt: skip
MAX_PLANETS = 20


def equal_spacing(planets: int) -> tuple[float, ...]:
    """Angles of equally spaced planets, rad."""
    return tuple(2.0 * math.pi * i / planets for i in range(planets))


def each_planet(name: str, values: Any, planets: Any) -> Any:
    """SI values of a list of planets, validated or raw, expanded to one value for each planet.

    A number holds for all planets, and so does a list of one value except for errors of pins. Empty
    lists become zeros, or angles of equal spacing. Other fields are returned unchanged.
    """
    count = planets if isinstance(planets, int) and planets <= MAX_PLANETS else 0
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
    """Change the JSON schema of a list to one that also accepts a number."""
    several = {key: schema.pop(key) for key in ("type", "items")}
    schema["anyOf"] = [several, several["items"]]


def _or_number() -> Any:
    """Field for a list, with one value for each planet or harmonic, or a number."""
    return Field(default=(), json_schema_extra=_or_one_number)


class GearErrors(Section):
    """Manufacturing errors of gears and pins, from which the errors of both gear meshes follow.

    An eccentricity is the vector from a gear's axis of rotation to its geometric centre, given by
    amplitude and phase. The phase counts from the stage's x axis at θ = 0 for sun, ring and carrier
    (and rotates with them), and from the planet's radial axis for planets. A number in place of a
    list holds for all planets.

    sun_eccentricity, ring_eccentricity, carrier_eccentricity, planet_eccentricity: amplitude
    of the eccentricity. sun_eccentricity_phase, ring_eccentricity_phase,
    carrier_eccentricity_phase, planet_eccentricity_phase: phase of the eccentricity. ring_offset:
    offset of the ring's centre, fixed in space. ring_offset_phase: direction of the offset from the
    x axis. seed: of random deviations. planet_thickness: excess of the tooth thickness on the
    reference circle. Lists of planets have one value for all or one for each planet.
    ring_gear_mesh, sun_gear_mesh: amplitudes A_l of an error Σ A_l sin(2π l s/p_b + φ_l) at
    gear-mesh frequency and its multiples, excess of material positive; a number is that of the
    first. ring_gear_mesh_phase, sun_gear_mesh_phase: φ_l; 0 if left out. In a parallel stage the
    pinion has the sun's errors and the wheel the planet's.

    ring_tooth, planet_tooth, sun_tooth: tooth-to-tooth (single-tooth) deviation f_i' of each gear;
    a gear mesh has the harmonic error 0.5 (f_i'1 + f_i'2) sin(2π s/p_b + phase), the same for all
    its teeth. ring_phase, sun_phase: phase of this error at the ring and at the sun gear mesh.
    harmonic_on_coast: effect of all errors at gear-mesh frequency on coast flanks: excess, excess
    material on these, too, at their position on the path; opposite, the errors open a coast flank
    by as much as they close the drive flank at the same instant, as e(t) of oscillators with
    clearance. ring_pitch, planet_pitch, sun_pitch: standard deviation of random single-tooth
    deviations, drawn once for each tooth with ``seed``. pin_tangential, pin_radial: position error
    of each pin (one value for each planet; none if empty), positive in the sense of rotation and
    outwards.

    sun_helix_slope, ring_helix_slope: helix slope deviation f_Hβ of the drive flank, positive if
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
    pin_tangential: tuple[Length, ...] = _or_number()
    pin_radial: tuple[Length, ...] = _or_number()
    sun_eccentricity: Length = Field(default=0.0, ge=0.0, le=_LARGEST)
    sun_eccentricity_phase: Angle = 0.0
    ring_eccentricity: Length = Field(default=0.0, ge=0.0, le=_LARGEST)
    ring_eccentricity_phase: Angle = 0.0
    carrier_eccentricity: Length = Field(default=0.0, ge=0.0, le=_LARGEST)
    carrier_eccentricity_phase: Angle = 0.0
    planet_eccentricity: tuple[Length, ...] = _or_number()
    planet_eccentricity_phase: tuple[Angle, ...] = _or_number()
    ring_offset: Length = Field(default=0.0, ge=0.0, le=_LARGEST)
    ring_offset_phase: Angle = 0.0
    planet_thickness: tuple[Length, ...] = _or_number()
    sun_helix_slope: Length = Field(default=0.0, ge=-_LARGEST, le=_LARGEST)
    ring_helix_slope: Length = Field(default=0.0, ge=-_LARGEST, le=_LARGEST)
    planet_sun_helix_slope: tuple[Length, ...] = _or_number()
    planet_ring_helix_slope: tuple[Length, ...] = _or_number()
    ring_gear_mesh: tuple[Length, ...] = _or_number()
    ring_gear_mesh_phase: tuple[Angle, ...] = _or_number()
    sun_gear_mesh: tuple[Length, ...] = _or_number()
    sun_gear_mesh_phase: tuple[Angle, ...] = _or_number()
    harmonic_on_coast: Literal["excess", "opposite"] = "excess"

    @staticmethod
    def for_each(data: Mapping[str, Any], planets: int) -> dict[str, Any]:
        """Raw data of the section with numbers in place of lists expanded to one per planet."""
        numbers = {key: data[key] for key in data if isinstance(data[key], (int, float))}
        of_planets = {k: each_planet(k, x, planets) for k, x in numbers.items() if k in OF_PLANETS}
        return {**data, **of_planets}

    @field_validator(*HARMONICS, mode="before")
    @classmethod
    def _first_harmonic(cls, value: Any) -> Any:
        """A number as the list of a first harmonic."""
        if isinstance(value, (int, float)):
            return (value,) if value else ()
        return value

    def require_planets(self, planets: int) -> None:
        """Raise Refusal for a list whose number of values differs from that of the planets."""
        for key in OF_PLANETS:
            count = len(getattr(self, key))
            if count in (0, planets) or (count == 1 and key in PLANET_LISTS):
                continue
            one_for_all = ", or one for all" if key in PLANET_LISTS else ""
            more = count > planets
            mismatch = f"planet {planets + 1} does not exist" if more else "some planets have none"
            problem = f"{count} values for {planets} planets: {mismatch}"
            raise Refusal(f"errors.{key}", problem, f"give one for each planet{one_for_all}")

    def refuse_parallel(self) -> None:
        """Raise Refusal for errors of parts that a parallel stage does not have."""
        keys = [key for key in NOT_PARALLEL if not key.endswith("_phase")]
        problem = "is an error of a part that a parallel stage does not have"
        self._refuse_set(keys, problem, "use sun_… for the pinion and planet_… for the gear")

    def of_planets(self, name: str, planets: int) -> tuple[float, ...]:
        """Values of a list, one for each planet; zeros if it is empty."""
        values: tuple[float, ...] = each_planet(name, getattr(self, name), planets)
        return values

    def _check(self) -> None:
        for name in ("ring_gear_mesh", "sun_gear_mesh"):
            phases, stated = getattr(self, f"{name}_phase"), getattr(self, name)
            if stated and phases and len(phases) != len(stated):
                problem = f"{len(phases)} phases for {len(stated)} harmonics"
                raise Refusal(f"{name}_phase", problem, f"give one for each of {name}")
        for name in (*OF_PLANETS, *HARMONICS):
            if name.endswith("_phase"):
                continue
            values = getattr(self, name)
            low = 0.0 if name == "planet_eccentricity" else -_LARGEST
            wrong = [v for v in values if not low <= v <= _LARGEST]
            if wrong:
                problem = f"{1e3 * wrong[0]:g} mm is outside {1e3 * low:g} … {1e3 * _LARGEST:g} mm"
                raise Refusal(name, problem, "check value and unit")


NOT_PARALLEL = tuple(  # errors of parts that a parallel stage does not have
    name
    for name in GearErrors.model_fields
    if name.startswith(("ring", "carrier", "pin", "planet_ring"))
)
