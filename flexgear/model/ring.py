"""Ring gear body: rim, bolts, housing fits, and how its teeth are tied."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from flexgear.model.fe_mesh_source import FeMeshSource
from flexgear.model.section import Refusal, Section
from flexgear.model.units import Angle, Length, RotationalStiffness, Stiffness

Fidelity = Literal["quick", "standard", "fine"]


class Bolts(Section):
    """Bolts that hold the ring; stiffness of one bolt with its clamped joint to the housing.

    Bolt k stands at first_angle + 2πk/number; radial and tangential are the bolt's own directions.
    """

    number: int = Field(ge=0, le=400)
    circle_diameter: Length = Field(ge=1e-2, le=20.0)
    diameter: Length = Field(ge=1e-3, le=0.3)
    holes: bool = False
    first_angle: Angle = 0.0
    stiffness_radial: Stiffness = Field(ge=0.0, le=1e13)
    stiffness_tangential: Stiffness = Field(ge=0.0, le=1e13)
    stiffness_axial: Stiffness = Field(ge=0.0, le=1e13)
    stiffness_tilt: RotationalStiffness = Field(default=0.0, ge=0.0, le=1e13)
    stiffness_twist: RotationalStiffness = Field(default=0.0, ge=0.0, le=1e13)


class Fit(Section):
    """A housing fit: a cylindrical band of the outer diameter, tied to one node on the axis."""

    z: Length = Field(ge=-2.0, le=2.0)
    half_width: Length = Field(ge=1e-4, le=1.0)
    stiffness_radial: Stiffness = Field(default=0.0, ge=0.0, le=1e14)
    stiffness_axial: Stiffness = Field(default=0.0, ge=0.0, le=1e14)
    stiffness_tilt: RotationalStiffness = Field(default=0.0, ge=0.0, le=1e14)

    @property
    def band(self) -> tuple[float, float]:
        """Axial limits of the band, m."""
        return (self.z - self.half_width, self.z + self.half_width)


class Ring(FeMeshSource):
    """Ring gear as a body. rim_thickness is counted outside the root circle of the teeth."""

    flexible: bool = True
    rim_thickness: Length = Field(ge=1e-3, le=3.0)
    tie: Literal["root", "flank"] = "root"
    tie_kind: Literal["averaging", "rigid"] = "averaging"
    fixed_interface_modes: int = Field(default=120, ge=0, le=2000)
    end: Literal["+z", "-z"]
    bolts: Bolts
    fits: tuple[Fit, ...] = ()

    @model_validator(mode="after")
    def _consistent(self) -> Ring:
        held = self.bolts.number * self.bolts.stiffness_tangential > 0
        if not held:
            raise Refusal(
                "bolts.stiffness_tangential",
                "is zero, so nothing takes the ring's torque",
                "give the bolts a stiffness",
            )
        return self
