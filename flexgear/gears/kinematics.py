"""Speeds, torques and mean forces of a stage with a held ring and a driven carrier (Willis)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from flexgear.gears.geometry import stage_geometry

if TYPE_CHECKING:
    from flexgear.model.flexible_stage import FlexibleStage


LEAST_STEPS = 4  # of a transient in a gear-mesh period


@dataclass(frozen=True)
class StageKinematics:
    """Speeds rad/s, frequency Hz, torques N·m, forces N (normal, along the 3D line of action).

    ω_s = ω_c (1 + z_r/z_s); ω_p (absolute) = −ω_c (z_r − z_p)/z_p; f = z_r ω_c / 2π;
    T_r = T z_r/(z_r + z_s); T_out = T z_s/(z_s + z_r); F = T_gear/(N r_b cosβ_b).
    """

    carrier_speed: float
    sun_speed: float
    planet_speed: float
    gear_mesh_frequency: float
    input_torque: float
    ring_torque: float
    output_torque: float
    ring_mesh_force: float
    sun_mesh_force: float

    @property
    def ratio(self) -> float:
        """ω_sun / ω_carrier."""
        return self.sun_speed / self.carrier_speed


def stage_kinematics(case: FlexibleStage) -> StageKinematics:
    """Kinematics and statics at the rated speed and torque of the drive."""
    geometry = stage_geometry(case.stage, case.source)
    z_s, z_p, z_r = (g.teeth for g in (geometry.sun, geometry.planet, geometry.ring))
    speed, torque = case.drive.rated_speed, case.drive.rated_torque
    ring, sun = torque * z_r / (z_r + z_s), torque * z_s / (z_r + z_s)
    share = case.stage.planets * math.cos(geometry.base_helix_angle)
    return StageKinematics(
        carrier_speed=speed,
        sun_speed=speed * (1 + z_r / z_s),
        planet_speed=-speed * (z_r - z_p) / z_p,
        gear_mesh_frequency=z_r * speed / (2 * math.pi),
        input_torque=torque,
        ring_torque=ring,
        output_torque=sun,
        ring_mesh_force=ring / (share * geometry.ring.base_radius),
        sun_mesh_force=sun / (share * geometry.sun.base_radius),
    )


def longest_time_step(gear_mesh_frequency: float) -> float:
    """A quarter of a gear-mesh period, s; infinite at rest.

    With longer steps pairs come and go unseen between two of them, and stiffness that rises and
    falls once a period is not followed.
    """
    return 1.0 / (LEAST_STEPS * gear_mesh_frequency) if gear_mesh_frequency else math.inf
