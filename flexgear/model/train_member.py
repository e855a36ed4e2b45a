"""Lumped members of a train's stage: gears and carriers, and how the housing supports them."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from flexgear.model.section import Refusal, Section
from flexgear.model.springs import Bearing, Rolling
from flexgear.model.stage import Gear
from flexgear.model.units import Inertia, Length, Mass, Stiffness

Kinematics = Literal["fixed", "torsional", "planar", "axial", "spatial"]


class Support(Bearing):
    """Springs to the housing, or of a planet to its pin.

    tangential acts against u = r θ and adds torsion = tangential r²; r is the base radius of a
    gear, the centre distance for a carrier. clearance: radial gap before the spring carries.
    """

    tangential: Stiffness = Field(default=0.0, ge=0.0, le=1e14)
    clearance: Length = Field(default=0.0, ge=0.0, le=5e-3)

    @property
    def holds_rotation(self) -> bool:
        """Whether it has a stiffness against turning about the axis."""
        return self.tangential > 0 or self.stiffness[5] > 0

    @model_validator(mode="after")
    def _clearance_of_something(self) -> Support:
        if self.clearance > 0 and min(self.stiffness[:2]) <= 0:
            raise Refusal(
                "clearance", "is the gap of a support without radial stiffness", "give radial"
            )
        if self.clearance > 0 and self.rollers is not None:
            raise Refusal("clearance", "stands beside rollers", "give it as rollers.clearance")
        if self.clearance > 0 and self.matrix[:2, 2:].any():
            raise Refusal(
                "clearance",
                "is a gap at the middle, but z or full couples radial motion with other directions",
                "take one of the two out",
            )
        return self


class PlanetBearing(Support, Rolling):
    """Bearing between planet and pin."""


class LumpedInertia(Section):
    """Mass properties; what is left out is derived from the geometry of a steel disc or ring.

    inertia: about the axis, kg m². equivalent_mass: inertia / r², kg, with the base radius of a
    gear or the centre distance for a carrier. tilt_inertia: about a diameter. kinematics: "fixed"
    (), "torsional" (rz), "planar" (x, y, rz), "axial" (x, y, z, rz), "spatial" (all six); the
    train's if left out.
    """

    mass: Mass | None = Field(default=None, gt=0.0, le=1e7)
    inertia: Inertia | None = Field(default=None, gt=0.0, le=1e12)
    equivalent_mass: Mass | None = Field(default=None, gt=0.0, le=1e9)
    tilt_inertia: Inertia | None = Field(default=None, gt=0.0, le=1e12)
    kinematics: Kinematics | None = None
    support: Support = Support()

    @model_validator(mode="after")
    def _inertia_once(self) -> LumpedInertia:
        if self.inertia is not None and self.equivalent_mass is not None:
            raise Refusal(
                "equivalent_mass",
                "is given beside inertia, which says the same",
                "keep one of them (equivalent_mass = inertia / r²)",
            )
        return self


class TrainGear(LumpedInertia, Gear):
    """A lumped gear. base_diameter replaces the one from module and teeth; rim_thickness (of a
    ring, outside its root circle) serves only to derive mass and inertia."""

    base_diameter: Length | None = Field(default=None, ge=1e-4, le=10.0)
    rim_thickness: Length | None = Field(default=None, ge=1e-4, le=3.0)

    @property
    def gear(self) -> Gear:
        """The geometry alone."""
        return Gear(**{name: getattr(self, name) for name in Gear.model_fields})


class TrainCarrier(LumpedInertia):
    """A lumped carrier."""
