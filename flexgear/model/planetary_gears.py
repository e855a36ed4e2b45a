"""Gears of a planetary stage, their tools and their relative positions."""

from __future__ import annotations

import cmath
import math
from collections.abc import Mapping
from typing import Any, Literal

from pydantic import Field, model_validator

from flexgear.model.section import Missing, Refusal, Section
from flexgear.model.units import Angle, Length


class Tool(Section):
    """A rack (hob, planing tool) or a shaper cutter; its height over the reference line is the
    gear's dedendum, its tip radius the gear's root_fillet.

    teeth: of a shaper cutter, z_0; left out, sun, planet, pinion and gear are cut by a rack, and a
    ring by a cutter of half of its teeth. profile_shift: x_0 of the cutter, which falls as it is
    ground again. tip_diameter: d_a0 of the cutter; the root circle then follows from it, not from
    dedendum.
    protuberance: pr_P0, by which the tip rounding stands beyond the tool's flank, along the flank's
    normal; protuberance_angle: of the flank between both to the middle line of the tool's tooth.
    grinding_allowance: q, which is ground off each flank after the tool, along its normal, and not
    off the root: at most the protuberance.
    """

    teeth: int | None = Field(default=None, ge=5, le=1000)
    profile_shift: float = Field(default=0.0, ge=-2.0, le=2.0)
    tip_diameter: Length | None = Field(default=None, ge=1e-3, le=10.0)
    protuberance: Length = Field(default=0.0, ge=0.0, le=0.02)
    protuberance_angle: Angle = Field(default=math.radians(8.0), ge=0.0, le=math.radians(30.0))
    grinding_allowance: Length = Field(default=0.0, ge=0.0, le=0.02)

    @model_validator(mode="after")
    def _no_step(self) -> Tool:
        if self.grinding_allowance > self.protuberance:
            raise Refusal(
                "grinding_allowance",
                f"{1e3 * self.grinding_allowance:g} mm are ground off flanks that the protuberance "
                f"frees by {1e3 * self.protuberance:g} mm, which leaves a step above the root",
                "raise protuberance_mm, or leave both out where the root is ground with the flank",
            )
        return self


class Gear(Section):
    """One gear; coefficients are multiples of the normal module.

    teeth: their number, positive for the ring, too. profile_shift: coefficient of ISO 21771 with
    the ring's tooth number negative: x > 0 makes the tooth of any gear thicker, moves the tip
    circle of sun and planet outward and that of the ring towards its centre. addendum, dedendum:
    coefficients of the tooth's height from the reference circle to tip and root. root_fillet:
    radius of the tool's tip as a coefficient; a tip too narrow for it is fully round. tool: what
    generates the teeth. bore_diameter: of the gear's hole, 0 for none.
    """

    teeth: int = Field(ge=5, le=2000)
    profile_shift: float = Field(default=0.0, ge=-2.0, le=2.0)
    addendum: float = Field(default=1.0, ge=0.3, le=2.0)
    dedendum: float = Field(default=1.25, ge=0.5, le=2.5)
    root_fillet: float = Field(default=0.38, ge=0.02, le=0.6)
    tool: Tool = Tool()
    bore_diameter: Length = Field(default=0.0, ge=0.0, le=5.0)


class PlanetaryGears(Section):
    """A simple planetary stage: sun, equally or freely spaced planets, ring.

    planets: their number. normal_module, pressure_angle: of the basic rack in the normal section.
    helix_angle: at the reference cylinder, 0 for spur gears. face_width: common to all gears.
    planet_hand: of the planets' helix; the ring has the same, the sun the other. center_distance:
    of sun and planet; from teeth and profile shifts if left out. sun, planet, ring: the gears.
    planet_positions: angles in the carrier, equal spacing if left out. allow_unassemblable: take
    tooth numbers that do not assemble (for papers that print such); every planet then sees a sun
    whose teeth fit it. backlash_ring, backlash_sun: normal backlash of each gear
    mesh beside what profile shifts leave at the centre distance a; if left out 2/3 (0.06 mm +
    0.0005 a + 0.03 m_n) after ISO/TR 10064-2, and none with linear contact.
    """

    planets: int = Field(ge=1, le=20)
    normal_module: Length = Field(ge=2e-4, le=0.1)
    pressure_angle: Angle = Field(ge=math.radians(10), le=math.radians(35))
    helix_angle: Angle = Field(default=0.0, ge=0.0, le=math.radians(45))
    face_width: Length = Field(ge=1e-3, le=2.0)
    planet_hand: Literal["right", "left"] = "right"
    center_distance: Length | None = Field(default=None, ge=1e-3, le=5.0)
    planet_positions: tuple[Angle, ...] | None = None
    allow_unassemblable: bool = False
    backlash_ring: Length | None = Field(default=None, ge=0.0, le=0.02)
    backlash_sun: Length | None = Field(default=None, ge=0.0, le=0.02)
    sun: Gear
    planet: Gear
    ring: Gear

    @property
    def planet_angles(self) -> tuple[float, ...]:
        """Angles of the planets in the carrier, rad; equally spaced unless given."""
        if self.planet_positions is not None:
            return self.planet_positions
        return tuple(2.0 * math.pi * i / self.planets for i in range(self.planets))

    @property
    def planet_period(self) -> float:
        """Smallest turn of the carrier, rad, after which planets stand where planets stood: the
        planet spacing where that is one, else a part of a turn or all of it."""
        place = [cmath.exp(1j * angle) for angle in self.planet_angles]
        for n in range(self.planets, 1, -1):
            turn = cmath.exp(2j * math.pi / n)
            if all(min(abs(p * turn - q) for q in place) < 1e-9 for p in place):
                return 2.0 * math.pi / n
        return 2.0 * math.pi

    @classmethod
    def required(cls, data: Mapping[str, Any]) -> list[Missing]:
        """The hand of helical gears."""
        return required_hand(data)

    @model_validator(mode="after")
    def _consistent(self) -> PlanetaryGears:
        angles = self.planet_positions
        if angles is not None and len(angles) != self.planets:
            raise Refusal(
                "planet_positions",
                f"{len(angles)} angles for {self.planets} planets",
                "give one angle for each planet, or leave the key out for equal spacing",
            )
        if self.ring.teeth <= self.planet.teeth:
            raise Refusal(
                "ring.teeth",
                f"a ring of {self.ring.teeth} teeth cannot hold planets of {self.planet.teeth}",
                "about z_sun + 2 z_planet",
            )
        for name, gear in (("planet", self.planet), ("sun", self.sun)):
            check_bore(name, gear, self.normal_module)
        if self.face_width > 20 * self.normal_module * self.planet.teeth:
            raise Refusal(
                "face_width",
                f"{self.face_width:g} m is more than 20 planet diameters",
                "check the units of face width and module",
            )
        return self


def required_hand(data: Mapping[str, Any]) -> list[Missing]:
    """``planet_hand`` where gears are helical: with the other hand it is another stage."""
    helix = data.get("helix_angle")
    if isinstance(helix, float) and helix > 0.0 and "planet_hand" not in data:
        remedy = 'add planet_hand = "right" or "left"'
        return [Missing("planet_hand", "is missing with a helix angle", remedy)]
    return []


def check_bore(name: str, gear: Gear, module: float) -> None:
    """Refusal if the bore of an external gear reaches its root circle."""
    if gear.bore_diameter >= module * (gear.teeth - 2 * gear.dedendum):
        raise Refusal(
            f"{name}.bore_diameter", "the bore is as large as the root circle", "lower it"
        )
