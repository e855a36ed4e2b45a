"""Manufacturing errors of gears and pins (the section ``errors`` of a case)."""

from __future__ import annotations

from pydantic import Field

from flexgear.model.section import Section
from flexgear.model.units import Angle, Length


class GearErrors(Section):
    """Errors that follow the gears' angle.

    ring_tooth, planet_tooth, sun_tooth: tooth-to-tooth (single-tooth) deviation f_i' of each gear;
    a gear mesh has the harmonic error 0.5 (f_i'1 + f_i'2) sin(2π s/p_b + phase), the same for all
    its teeth. ring_phase, sun_phase: its phase at the ring and at the sun gear mesh.
    ring_pitch, planet_pitch, sun_pitch: standard deviation of random single-tooth deviations,
    drawn once a tooth with ``seed``. pin_tangential, pin_radial: position error of each pin
    (list, one value a planet; empty: none), + in the sense of rotation and outward.
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
    pin_tangential: tuple[Length, ...] = ()
    pin_radial: tuple[Length, ...] = ()
