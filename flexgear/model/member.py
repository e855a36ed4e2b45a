"""Members of a stage: gears with their tools, and carriers."""

import math
from collections.abc import Mapping
from typing import Any, ClassVar, Literal

from pydantic import Field

from flexgear.model.bearings import Bearing
from flexgear.model.bodies import Carrier, Hub, Planet, Shaft
from flexgear.model.modifications import GearModifications, PlanetModifications
from flexgear.model.rating import GearRating
from flexgear.model.ring import Ring
from flexgear.model.section import Absent, Missing, OneOrMany, Refusal, Section
from flexgear.model.units import Angle, DynamicViscosity, Inertia, Length, Mass, Stiffness, Stress


class Tool(Section):
    """A rack (hob, planing tool) or a shaper cutter; its height over the reference line is the
    gear's dedendum, its tip radius the gear's root_fillet.

    teeth: number of teeth z_0 of a shaper cutter; if left out, sun, planet, pinion and gear are cut
    by a rack, and a ring by a cutter with half of its teeth. profile_shift: x_0 of the cutter,
    which decreases with every regrinding. tip_diameter: d_a0 of the cutter; the root circle then
    follows from it, not from dedendum. protuberance: pr_P0, distance of the tip rounding beyond the
    tool's flank, along the normal; protuberance_angle: between the protuberance flank and the
    middle line of the tool's tooth. grinding_allowance: q, ground off each flank after cutting,
    along its normal, but not off the root; at most the protuberance.
    """

    teeth: int | None = Field(default=None, ge=5, le=1000)
    profile_shift: float = Field(default=0.0, ge=-2.0, le=2.0)
    tip_diameter: Length | None = Field(default=None, ge=1e-3, le=10.0)
    protuberance: Length = Field(default=0.0, ge=0.0, le=0.02)
    protuberance_angle: Angle = Field(default=math.radians(8.0), ge=0.0, le=math.radians(30.0))
    grinding_allowance: Length = Field(default=0.0, ge=0.0, le=0.02)

    def _check(self) -> None:
        if self.grinding_allowance > self.protuberance:
            raise Refusal(
                "grinding_allowance",
                f"{1e3 * self.grinding_allowance:g} mm exceed the protuberance of "
                f"{1e3 * self.protuberance:g} mm, which leaves a step above the root",
                "raise protuberance_mm, or leave both out if the root is ground with the flank",
            )


class Gear(Section):
    """One gear; coefficients are multiples of the normal module.

    teeth: number of teeth, positive for the ring, too. profile_shift: coefficient of ISO 21771 with
    the ring's tooth number negative: x > 0 makes the tooth of any gear thicker, and moves the tip
    circle of sun and planet outwards and that of the ring inwards. addendum, dedendum: coefficients
    of the tooth's height from the reference circle to tip and root. root_fillet: radius of the
    tool's tip as a coefficient; a tip that is too narrow for it is fully round. tool: tool that
    generates the teeth. bore_diameter: of the gear, 0 for none.
    """

    teeth: int = Field(ge=5, le=2000)
    profile_shift: float = Field(default=0.0, ge=-2.0, le=2.0)
    addendum: float = Field(default=1.0, ge=0.3, le=2.0)
    dedendum: float = Field(default=1.25, ge=0.5, le=2.5)
    root_fillet: float = Field(default=0.38, ge=0.02, le=0.6)
    tool: Tool = Tool()
    bore_diameter: Length = Field(default=0.0, ge=0.0, le=5.0)


def required_hand(data: Mapping[str, Any]) -> list[Missing]:
    """``planet_hand`` for helical gears, which has no default."""
    helix = data.get("helix_angle")
    if isinstance(helix, float) and helix > 0.0 and "planet_hand" not in data:
        remedy = 'add planet_hand = "right" or "left"'
        if data.get("kind") == "parallel":
            remedy += ", the hand of the gear; the pinion's is the other one"
        return [Missing("planet_hand", "is missing with a helix angle", remedy)]
    return []


def check_bore(name: str, gear: Gear, module: float) -> None:
    """Raise Refusal if the bore of an external gear reaches its root circle."""
    if gear.bore_diameter >= module * (gear.teeth - 2 * gear.dedendum):
        problem = "the bore is as large as the root circle"
        raise Refusal(f"{name}.bore_diameter", problem, "lower it")


Kinematics = Literal["fixed", "torsional", "planar", "axial", "spatial"]


class Support(Bearing):
    """Springs to the housing, or of a planet to its pin.

    tangential: stiffness against u = r θ, which adds torsion = tangential r²; r is the base radius
    of a gear, the centre distance for a carrier.
    """

    tangential: Stiffness = Field(default=0.0, ge=0.0, le=1e14)

    @property
    def holds_rotation(self) -> bool:
        """Whether the support has a stiffness against rotation about the axis."""
        return self.tangential > 0 or self.stiffness[5] > 0


class Journal(Section):
    """The oil film of a plain bearing between planet and pin, by the theory of short bearings.

    diameter: of the pin. length: of the film, at most the diameter; the load of films longer than
    half of the diameter is overestimated. clearance: radial gap, half of the difference of the
    diameters. viscosity: dynamic viscosity of the oil in the film; if left out, density times
    operating viscosity of the lubricant. least_film: thickness below which surfaces touch.
    """

    diameter: Length = Field(gt=0.0, le=5.0)
    length: Length = Field(gt=0.0, le=5.0)
    clearance: Length = Field(gt=0.0, le=5e-3)
    viscosity: DynamicViscosity | None = Field(default=None, gt=0.0, le=100.0)
    least_film: Length = Field(default=1e-6, gt=0.0, le=1e-3)

    def _check(self) -> None:
        if self.length > self.diameter:
            remedy = "the theory of short bearings needs a shorter film"
            raise Refusal("length", "is more than the diameter", remedy)
        if self.least_film >= 0.5 * self.clearance:
            raise Refusal("least_film", "is not below half of the clearance", "lower it")


class PlanetBearing(Support):
    """Bearing between planet and pin.

    journal: oil film of a plain bearing; radial is then the stiffness of touching surfaces, also
    used in modes and other linear analyses.
    """

    journal: Journal | None = None

    def _check(self) -> None:
        if self.journal is None:
            return
        if self.rollers is not None or self.clearance > 0:
            remedy = "keep one of them; the clearance of the film is journal.clearance"
            raise Refusal("journal", "is given beside rollers or clearance", remedy)
        if self.dynamic_rating is not None:
            problem = "is a rating of rolling elements, and a journal bearing has none"
            raise Refusal("dynamic_rating", problem, "take it out, or the journal")
        if min(self.stiffness[:2]) <= 0 or self.full is not None:
            problem = "is needed beside a journal, as the stiffness of touching surfaces"
            raise Refusal("radial", problem, "give radial, and no full matrix")


class LumpedInertia(Section):
    """Mass properties; those that are left out follow from a disc or ring of the member's size and
    of the stage's material.

    mass: of the lumped body. support: springs to the housing, or a list of them: bearings at their
    z along a rigid shaft. inertia: about the axis, kg m².
    equivalent_mass: inertia / r², kg, with the base radius of a gear or the centre distance for a
    carrier. tilt_inertia: about a diameter. kinematics: "fixed" (), "torsional" (rz), "planar" (x,
    y, rz), "axial" (x, y, z, rz), "spatial" (all six); if left out "spatial" of a member on several
    supports, joined to such a member by a shaft, and in a stage with an FE body or a shaft, else
    the case's, but "axial" where a joint passes it thrust.
    """

    mass: Mass | None = Field(default=None, gt=0.0, le=1e7)
    inertia: Inertia | None = Field(default=None, gt=0.0, le=1e12)
    equivalent_mass: Mass | None = Field(default=None, gt=0.0, le=1e9)
    tilt_inertia: Inertia | None = Field(default=None, gt=0.0, le=1e12)
    kinematics: Kinematics | None = None
    support: OneOrMany[Support] = Support()

    @property
    def supports(self) -> dict[str, Support]:
        """Supports by their keys: "support", of several "support.0", "support.1" …"""
        if isinstance(self.support, Support):
            return {"support": self.support}
        return {f"support.{k}": support for k, support in enumerate(self.support)}

    @property
    def holds_rotation(self) -> bool:
        """Whether one of its supports has a stiffness against rotation about the axis."""
        return any(support.holds_rotation for support in self.supports.values())

    def _check(self) -> None:
        self._keep_one("equivalent_mass", "inertia", ", which says the same (times r²)")
        if len(self.supports) > 1 and self.kinematics in ("torsional", "planar", "axial"):
            problem = f"{self.kinematics!r} does not tilt, so its supports would share no moment"
            raise Refusal("kinematics", problem, 'take "spatial", or one support')

    def _refuse_lumped(self, supports: str) -> None:
        """Raise Refusal if an FE body has keys of a lumped one; supports: its keys for supports."""
        problem = "is for a lumped body, but fe is given"
        lumped = (*LumpedInertia.model_fields, "rim_thickness")
        keys = [key for key in type(self).model_fields if key in lumped and key != "support"]
        self._refuse_set(keys, problem, "keep one")
        self._refuse_set(["support"], problem, f"use {supports}")


class GearMember(LumpedInertia, Gear):
    """A lumped gear.

    base_diameter: replaces that from module and teeth. rim_thickness: of a ring, outside its root
    circle; for mass and inertia, and for the rating of its roots. body_factor: C_R of ISO 6336-1,
    below 1 of a gear with a thin web, by which the stiffness of its teeth falls.
    allowable_root_stress: permissible stress σ_FP of ISO 6336-3, limit of the computed root stress.
    allowable_flank_pressure: permissible contact stress σ_HP of ISO 6336-2, limit of the computed
    flank pressure. rating: steel, surface and accuracy.
    """

    absent: ClassVar[Absent] = {
        "material|young|poisson|density": (
            "is not available: all gears of a stage are of one material",
            "give stage.material; for teeth of two materials in contact its Young's modulus is "
            "2 E_1 E_2/(E_1 + E_2), and mass_kg gives the masses",
        ),
        "hand": (
            "is not available: the hands of a stage's gears follow from one another",
            "give stage.planet_hand, that of planets and ring, of a pair that of the gear; the sun "
            "or pinion has the other one",
        ),
    }

    base_diameter: Length | None = Field(default=None, ge=1e-4, le=10.0)
    rim_thickness: Length | None = Field(default=None, ge=1e-4, le=3.0)
    body_factor: float = Field(default=1.0, ge=0.3, le=1.0)
    allowable_root_stress: Stress | None = Field(default=None, gt=0.0, le=1e10)
    allowable_flank_pressure: Stress | None = Field(default=None, gt=0.0, le=1e10)
    rating: GearRating = GearRating()


class PlanetGear(GearMember):
    """A planet: a lumped gear, or an FE body from its teeth to its bore.

    fe: the FE body in place of the lumped one. modifications: of its flanks.
    """

    fe: Planet | None = None
    modifications: PlanetModifications = PlanetModifications()

    def _check(self) -> None:
        if self.fe is None:
            return
        self._refuse_lumped("planet_bearing")
        if self.bore_diameter == 0.0:
            raise Missing("bore_diameter", "is missing beside fe", "give the seat of its bearing")


class MatedGear(GearMember):
    """A gear with one gear mesh. modifications: of its flanks."""

    modifications: GearModifications = GearModifications()


class SunGear(MatedGear):
    """A sun: a lumped gear, or one on a shaft, a beam that begins at its middle. support: springs
    to the housing, on a shaft at the node of the beam that is nearest to their z. shaft: the beam
    from the gear to a spline."""

    shaft: Shaft | None = None


class RingGear(MatedGear):
    """A ring: a lumped gear, or an FE body. The supports of an FE ring connect it to the housing,
    or to a hub if the ring rotates.

    fe: the FE body in place of the lumped one. hub: hub of a rotating FE ring.
    """

    fe: Ring | None = None
    hub: Hub | None = None

    def _check(self) -> None:
        if self.fe is None:
            problem = "is for an FE ring, but the ring is lumped"
            self._refuse_set(["hub"], problem, "take it out, or give the ring fe")
        else:
            self._refuse_lumped("its bolts, fits and splines")


class CarrierMember(LumpedInertia):
    """A carrier: a lumped body, or an FE body on two bearings.

    fe: the FE body in place of the lumped one. bearing_drive, bearing_far: bearing between the
    housing and the seat on the drive side, on the far side.
    """

    fe: Carrier | None = None
    bearing_drive: Bearing | None = None
    bearing_far: Bearing | None = None

    def _check(self) -> None:
        seats = ("bearing_drive", "bearing_far")
        if self.fe is None:
            self._refuse_set(seats, "is on a seat of an FE carrier", "use support, or give fe")
        else:
            self._refuse_lumped("bearing_drive and bearing_far")
            self._require_set(seats, "is missing beside fe")
