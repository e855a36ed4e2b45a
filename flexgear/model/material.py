"""Material of ring, carrier, shaft and gears."""

from __future__ import annotations

from pydantic import Field

from flexgear.model.section import Section
from flexgear.model.units import Density, Modulus


class Material(Section):
    """Isotropic, linear elastic.

    young_modulus: modulus of elasticity; poisson_ratio: transverse contraction; density: mass of
    a volume.
    """

    young_modulus: Modulus = Field(ge=1e9, le=1e12)
    poisson_ratio: float = Field(ge=0.0, le=0.49)
    density: Density = Field(ge=500.0, le=3e4)
