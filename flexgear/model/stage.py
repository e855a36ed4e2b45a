"""One stage: planetary or parallel, of lumped members, FE bodies and shafts."""

import cmath
import math
from collections.abc import Mapping
from typing import Any, ClassVar, Literal

from pydantic import Field, model_validator

from flexgear.model.bearings import Bearing
from flexgear.model.bodies import Material
from flexgear.model.errors import echo
from flexgear.model.gear_mesh import MAX_PLANETS, GearErrors, GearMesh, equal_spacing
from flexgear.model.member import (
    CarrierMember,
    Gear,
    GearMember,
    MatedGear,
    PlanetBearing,
    PlanetGear,
    RingGear,
    SunGear,
    Support,
    check_bore,
    required_hand,
)
from flexgear.model.names import BodyName
from flexgear.model.read import nearest
from flexgear.model.ring import Ring
from flexgear.model.section import Absent, Missing, Refusal, Section, below, raw_value
from flexgear.model.units import Angle, Length

Form = Literal["lumped", "fe", "beam"]
PLANETARY = ("sun", "ring", "carrier")
PARALLEL = ("pinion", "gear")
ONE_SET_OF_TEETH = (
    "planets have one set of teeth: stepped planets (Wolfrom) and planets that mesh with one "
    "another (Ravigneaux) are not modelled"
)
_PARTS = {"planetary": ("sun", "planet", "ring", "carrier"), "parallel": PARALLEL}
_GEOMETRY = dict.fromkeys(
    (
        "planets", "normal_module", "pressure_angle", "helix_angle", "face_width", "planet_hand",
        "center_distance", "planet_positions", "allow_unassemblable", "backlash_ring",
        "backlash_sun",
    ),
    True,
)  # fmt: skip


class Stage(Section):
    """A stage: sun, planets, ring and carrier, or pinion and gear.

    name: prefix of its members' names; stage_1, stage_2, … if left out. kind: planetary (sun,
    planet, ring, carrier) or parallel (pinion and gear). position: direction from pinion to gear in
    a parallel stage, from the x axis. half_gap: between the halves of a double-helical stage.

    planets: number of planets. normal_module, pressure_angle: of the basic rack in the normal
    section. helix_angle: at the reference cylinder, 0 for spur gears. face_width: common to all
    gears. planet_hand: of the planets' helix, needed where there is one; the ring has the same, the
    sun the opposite hand; in a parallel stage hand of the gear, the pinion has the opposite one.
    center_distance: of sun and planet; from teeth and profile shifts if left out.
    planet_positions: angles in the carrier, equal spacing if left out. allow_unassemblable: accept
    tooth numbers that do not assemble (as printed in some papers); the sun's teeth then suit every
    planet. backlash_ring, backlash_sun: normal backlash of each gear mesh in addition to that of
    profile shifts at the centre distance a; if left out 2/3 (0.06 mm + 0.0005 a + 0.03 m_n) after
    ISO/TR 10064-2, and none with linear contact.

    sun, planet, ring, carrier: members of a planetary stage. pinion, gear: members of a parallel
    stage. planet_bearing: between each planet and its pin. gear_mesh: how tooth contact is
    modelled. errors: manufacturing errors of gears and pins. double_helical: two halves of
    ``face_width`` each with ``half_gap`` between them and separate ring halves; planet_hand is then
    that of the planet's left half (−z), mass, inertia, support, FE body and stiffness of the ring
    and its gear mesh those of one half, the left one. ring_pressure_angle, sun_pressure_angle:
    transverse working angles in place of those from the geometry. material: of this stage, the
    case's if left out. case: bundled name or file of a case whose only stage this is, except for
    the keys beside it.
    """

    absent: ClassVar[Absent] = {
        r"(sun|planet|ring)s?_?([2-9]|[b-d]$|large|small|long|short|step)|second|stepped": (
            "is not available",
            f"a stage has one sun and one ring, and {ONE_SET_OF_TEETH}; several simple stages are "
            "connected by [[joints]]",
        ),
    }

    name: str = Field(default="", pattern=r"^([A-Za-z][A-Za-z0-9_-]*)?$")
    kind: Literal["planetary", "parallel"] = "planetary"
    planets: int = Field(default=1, ge=1, le=MAX_PLANETS)  # the default is for parallel stages
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
    backlash_ring: Length | None = Field(default=None, ge=0.0, le=0.02)
    backlash_sun: Length | None = Field(default=None, ge=0.0, le=0.02)
    ring_pressure_angle: Angle | None = Field(default=None, ge=math.radians(5), le=math.radians(45))
    sun_pressure_angle: Angle | None = Field(default=None, ge=math.radians(5), le=math.radians(45))
    position: Angle = 0.0
    sun: SunGear | None = None
    planet: PlanetGear | None = None
    ring: RingGear | None = None
    carrier: CarrierMember | None = None
    pinion: MatedGear | None = None
    gear: MatedGear | None = None
    planet_bearing: PlanetBearing = PlanetBearing()
    gear_mesh: GearMesh = GearMesh()
    errors: GearErrors = GearErrors()
    material: Material | None = None
    case: str | None = None

    @property
    def planet_angles(self) -> tuple[float, ...]:
        """Angles of the planets in the carrier, rad; in a parallel stage the gear's position."""
        if self.kind == "parallel":
            return (self.position,)
        if self.planet_positions is not None:
            return self.planet_positions
        return equal_spacing(self.planets)

    @property
    def gear_width(self) -> float:
        """Total width of the gears, m, in a double-helical stage both halves and the gap."""
        return 2.0 * self.face_width + self.half_gap if self.double_helical else self.face_width

    @property
    def sides(self) -> tuple[str, ...]:
        """Sides of its gear meshes: "left" and "right" of a double-helical stage, else ""."""
        return ("left", "right") if self.double_helical else ("",)

    @property
    def half_offset(self) -> float:
        """Axial position of the middle of the right half of a double-helical stage, m.

        That of the left half is its negative.
        """
        return 0.5 * (self.half_gap + self.face_width)

    @property
    def planet_period(self) -> float:
        """Smallest rotation of the carrier that maps the planets onto planets, rad.

        It is the planet spacing for equally spaced planets, at most a full revolution.
        """
        positions = [cmath.exp(1j * angle) for angle in self.planet_angles]
        for n in range(self.planets, 1, -1):
            rotation = cmath.exp(2j * math.pi / n)
            if all(min(abs(p * rotation - q) for q in positions) < 1e-9 for p in positions):
                return 2.0 * math.pi / n
        return 2.0 * math.pi

    @property
    def is_flexible(self) -> bool:
        """Whether one of its members is an FE body or a shaft."""
        return any(self.form(part) != "lumped" for part in (*self.members, "planet"))

    def form(self, part: str) -> Form:
        """Form of one of ``members`` or "planet": "lumped", "fe", or "beam" for a sun on a
        shaft."""
        member = getattr(self, part)
        if getattr(member, "fe", None) is not None:
            return "fe"
        return "lumped" if getattr(member, "shaft", None) is None else "beam"

    @property
    def members(self) -> tuple[str, ...]:
        """Parts of the stage that rotate about fixed axes."""
        return PLANETARY if self.kind == "planetary" else PARALLEL

    @property
    def bearings(self) -> dict[str, Bearing]:
        """Bearings by their keys: of planets, of the seats of an FE carrier, of the hub of a ring,
        and supports of lumped members and of a sun on a shaft."""
        bearings: dict[str, Bearing] = {}
        if self.kind == "planetary":
            bearings["planet_bearing"] = self.planet_bearing
        bearings |= {f"carrier.bearing_{side}": seat for side, seat in self.seat_bearings.items()}
        for part in (name for name in self.members if self.form(name) != "fe"):
            supports = self.member(part).supports
            bearings |= {f"{part}.{key}": support for key, support in supports.items()}
        if self.ring is not None and self.ring.hub is not None and self.ring.hub.bearing:
            bearings["ring.hub.bearing"] = self.ring.hub.bearing
        return bearings

    @property
    def seat_bearings(self) -> dict[str, Bearing]:
        """Bearings of an FE carrier by seat, "drive" and "far"; none for a lumped carrier."""
        seats = {side: getattr(self.carrier, f"bearing_{side}", None) for side in ("drive", "far")}
        return {side: seat for side, seat in seats.items() if seat is not None}

    def member(self, name: str) -> GearMember | CarrierMember:
        """Section of one of ``members`` or "planet"; KeyError if the stage does not have it."""
        member = getattr(self, name)
        if member is None:
            raise KeyError(f"stage {self.name} has no {name}")
        assert isinstance(member, GearMember | CarrierMember)
        return member

    def body_names(self, part: str) -> list[BodyName]:
        """Bodies of a member: all planets, both halves of a lumped double-helical ring; "shaft" of
        a sun on one."""
        form = self.form(part)
        if form == "beam":
            return [BodyName.of(self.name, "shaft")]
        if part == "planet":
            return [BodyName.of(self.name, part, i) for i in range(self.planets)]
        sides = self.sides if part == "ring" and form == "lumped" else ("",)
        return [BodyName.of(self.name, part, side=side) for side in sides]

    def dump_geometry(self) -> dict[str, Any]:
        """Plain SI data of the stage's gears and their positions."""
        gear = dict.fromkeys(Gear.model_fields, True)
        return self.model_dump(include={**_GEOMETRY, "sun": gear, "planet": gear, "ring": gear})

    @classmethod
    def required(cls, data: Mapping[str, Any]) -> list[Missing]:
        """Parts and number of planets by the kind of the stage, the hand of helical gears. Raises
        Refusal for an unknown kind and for planets with several sets of teeth."""
        kind = data.get("kind", "planetary")
        if kind not in list(_PARTS):
            remedy = nearest(str(kind), list(_PARTS))
            if "did you mean" not in remedy:
                remedy += (
                    '; a differential or star is "planetary", as held, inputs and output say; '
                    f"{ONE_SET_OF_TEETH}, nor are bevel and worm gears"
                )
            raise Refusal("kind", f"{echo(kind)} is unknown", remedy)
        if isinstance(teeth := raw_value(data, "planet", "teeth"), list | tuple):
            remedy = f"give one; {ONE_SET_OF_TEETH}"
            raise Refusal("planet.teeth", f"has {len(teeth)} numbers", remedy)
        planetary, parallel = ({*names} & {*data} for names in _PARTS.values())
        if "kind" not in data and parallel and not planetary:
            problem = "is planetary if left out, and such a stage has no pinion or gear"
            return [Missing("kind", problem, 'add kind = "parallel"')]
        missing = [
            Missing(name, f"is missing in a {kind} stage", f"add a section for the {name}")
            for name in _PARTS[kind]
            if data.get(name) is None
        ]
        if kind == "planetary" and "planets" not in data:
            missing.append(Missing("planets", "is missing in a planetary stage"))
        return missing + required_hand(data)

    @model_validator(mode="before")
    @classmethod
    def _lumped_gear_meshes(cls, data: Any) -> Any:
        """Set constant stiffness and linear contact as defaults in stages of lumped members."""
        if not isinstance(data, dict) or _has_flexible_body(data):
            return data
        section = data.get("gear_mesh", {})
        defaults = {"model": "constant", "contact_law": "linear"}
        if isinstance(section, Mapping):
            if section.get("model") == "face_load":
                defaults["contact_law"] = "one-sided"
            return {**data, "gear_mesh": {**defaults, **section}}
        return data

    @model_validator(mode="before")
    @classmethod
    def _errors_of_each_planet(cls, data: Any) -> Any:
        """Expand numbers in place of lists to one value for each planet."""
        errors = data.get("errors") if isinstance(data, dict) else None
        planets = data.get("planets", 1) if isinstance(data, dict) else None
        if not isinstance(errors, Mapping) or not isinstance(planets, int):
            return data
        count = min(planets, MAX_PLANETS)  # the field refuses more
        return {**data, "errors": GearErrors.for_each(errors, count)}

    def _check(self) -> None:
        parts = _PARTS[self.kind]
        others = [name for name in (*_PARTS["planetary"], *PARALLEL) if name not in parts]
        remedy = f"take it out; the parts are {', '.join(parts)}"
        self._refuse_set(others, f"is no part of a {self.kind} stage", remedy)
        if self.kind == "parallel":
            self._check_parallel()
        else:
            self._check_planetary()
        for name in ("pinion", "gear", "planet", "sun"):
            if (gear := getattr(self, name)) is not None:
                check_bore(name, gear, self.normal_module)
        if self.double_helical and self.helix_angle == 0:
            raise Refusal("helix_angle", "is zero in a double-helical stage", "give it")
        self.errors.require_planets(self.planets)
        self._check_clearances()

    def _check_parallel(self) -> None:
        keys, remedy = ("planets", "planet_positions"), "take it out, or use position"
        self._refuse_set(keys, "a parallel stage has no planets", remedy)
        with below("errors"):
            self.errors.refuse_parallel()

    def _check_planetary(self) -> None:
        self._check_gears()
        assert self.planet is not None and self.carrier is not None
        kinematics, carrier_fixed = self.planet.kinematics, self.carrier.kinematics == "fixed"
        if kinematics == "fixed" or (kinematics == "torsional" and not carrier_fixed):
            problem = f"{kinematics!r} planets cannot follow the carrier"
            raise Refusal("planet.kinematics", problem, "use planar, axial or spatial")
        if min(self.planet_bearing.stiffness[:2]) <= 0:
            problem = "is zero, so the planet is not held"
            raise Refusal("planet_bearing.radial", problem, "give a stiffness")
        if self.is_flexible:
            self._check_flexible()
        if self.planet.support != Support():
            raise Refusal(
                "planet.support", "planets are not supported by the housing", "use planet_bearing"
            )

    def _check_gears(self) -> None:
        """Check planet positions, tooth numbers and face width of planetary gears."""
        assert self.sun is not None and self.planet is not None and self.ring is not None
        angles = self.planet_positions
        if angles is not None and len(angles) != self.planets:
            problem = f"{len(angles)} angles for {self.planets} planets"
            remedy = "give one angle for each planet, or leave the key out for equal spacing"
            raise Refusal("planet_positions", problem, remedy)
        if angles and max(map(abs, angles)) > 4.0 * math.pi:
            raise Refusal("planet_positions", "are more than two turns", "check the unit")
        if self.ring.teeth <= self.planet.teeth:
            problem = (
                f"a ring of {self.ring.teeth} teeth cannot hold planets of {self.planet.teeth}"
            )
            raise Refusal("ring.teeth", problem, "about z_sun + 2 z_planet")
        if self.face_width > 20 * self.normal_module * self.planet.teeth:
            problem = f"{self.face_width:g} m is more than 20 planet diameters"
            raise Refusal("face_width", problem, "check the units of face width and module")

    def _check_flexible(self) -> None:
        """Check FE bodies against gears and against unsupported combinations."""
        assert self.planet is not None and self.ring is not None and self.carrier is not None
        if self.double_helical and self.planet.fe is not None:
            problem = "is not available for planets with two halves of teeth"
            raise Refusal("planet.fe", problem, "take it out, or make the stage single-helical")
        if self.double_helical and self.ring.fe is not None and self.gear_mesh.root_stress == "fe":
            problem = "is not available for an FE ring in two halves"
            raise Refusal("gear_mesh.root_stress", problem, 'use "none", or a lumped ring')
        if self.planet.fe is not None and self.planet_bearing.journal is not None:
            problem = "is not available in the bore of a flexible planet"
            raise Refusal("planet_bearing.journal", problem, "take out planet.fe, or the journal")
        body, bore = self.carrier.fe, self.planet.bore_diameter
        if body is not None and 0.0 < bore <= body.pin_diameter:
            pin = body.pin_diameter * 1e3
            problem = f"a pin of {pin:g} mm does not fit in the planets' bore of {bore * 1e3:g} mm"
            remedy = "lower it, or raise stage.planet.bore_diameter_mm"
            raise Refusal("carrier.fe.pin_diameter", problem, remedy)
        if body is not None and body.plate_gap <= self.gear_width:
            halves = ", both halves and their gap" if self.double_helical else " face width"
            problem = (
                f"{body.plate_gap * 1e3:g} mm leaves no room for planets of "
                f"{self.gear_width * 1e3:g} mm{halves}"
            )
            raise Refusal("carrier.fe.plate_gap", problem, "make it wider than the planets")
        if self.ring.fe is not None:
            self._check_bands(self.ring.fe)

    def _check_bands(self, ring: Ring) -> None:
        """Check that fits and splines are within the face of the ring."""
        half = self.face_width / 2 * (1 + 1e-9)
        bands = [("fits", k, fit) for k, fit in enumerate(ring.fits)]
        bands += [("splines", k, spline) for k, spline in enumerate(ring.splines)]
        for name, k, fit in bands:
            if fit.band[0] < -half or fit.band[1] > half:
                problem = (
                    f"the band of ±{fit.half_width * 1e3:g} mm extends beyond the face of "
                    f"±{half * 1e3:.1f} mm"
                )
                raise Refusal(f"ring.fe.{name}.{k}.z", problem, "move it or make it narrower")

    def _check_clearances(self) -> None:
        """Check that clearances of bearings are below one module, so that gears stay in mesh."""
        for key, support in self.bearings.items():
            if support.clearance >= self.normal_module:
                raise Refusal(
                    f"{key}.clearance",
                    f"{1e3 * support.clearance:g} mm is as much as the module of "
                    f"{1e3 * self.normal_module:g} mm: the teeth would lose contact",
                    "check the unit; bearings have some hundredths of a millimetre",
                )


def _has_flexible_body(data: Mapping[str, Any]) -> bool:
    """Whether the data of a stage, validated or raw, have an FE body or a shaft."""
    bodies = (("ring", "fe"), ("planet", "fe"), ("carrier", "fe"), ("sun", "shaft"))
    return any(raw_value(data, *body) is not None for body in bodies)
