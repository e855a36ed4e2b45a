"""Inertia on the drive side and on the output side."""

from __future__ import annotations

from pydantic import Field

from flexgear.model.section import Section
from flexgear.model.units import Inertia, Mass


class Inertias(Section):
    """drive: polar inertia at the carrier's drive end; output: at the end of the sun's shaft.

    output_mass, output_tilt: mass and inertia about a diameter of what hangs on the output.
    """

    drive: Inertia = Field(ge=0.0, le=1e12)
    output: Inertia = Field(ge=0.0, le=1e12)
    output_mass: Mass = Field(ge=1e-3, le=1e7)
    output_tilt: Inertia = Field(ge=1e-9, le=1e12)
