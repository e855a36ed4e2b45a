"""Speeds and mean forces of one stage, from the speeds and torques of its members.

All forces follow from the torques T that the rest of the train puts on the members; N planets, S
sides (two if double-helical), base radii r_b, base helix angle β_b, working angles α, positive
where the flanks carry that carry when the carrier drives (docs/conventions.md):

    normal      F_s = −T_s/(N S r_b,s cos β_b),  F_r = −T_r/(N S r_b,r cos β_b)
    tangential  on a working circle F cos β_b cos α; on the sun's reference circle −T_s/(N S r_s)
    bearing     tangential S cos β_b (F_s cos α_s + F_r cos α_r) = T_c/(N R_c), radial
                S cos β_b (|F_s| sin α_s − |F_r| sin α_r); axial forces cancel on a planet
    planet      ω_p − ω_c = −(r_b,r/r_b,p)(ω_c − ω_r); gear-mesh frequency z_r |ω_c − ω_r| / 2π

Rolling power T_s (ω_s − ω_c) is what the teeth pass from sun to ring as seen from the carrier: the
part that makes losses; the rest of a member's power turns with the carrier as a coupling does.
Weight and centrifugal force of planets are left out. A parallel stage has its pinion in the place
of the sun, its gear in that of the planet, and a carrier at rest; its forces have the other sign,
F = T_pinion/(S r_b cos β_b), positive where the gear drives.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from flexgear.gears.radii import stage_radii

if TYPE_CHECKING:
    from flexgear.model.stage import Stage
    from flexgear.model.stage_view import StageView


@dataclass(frozen=True)
class StageFlow:
    """Speeds rad/s, frequency Hz, torques N m, forces N, powers W of one stage.

    sun_speed, …_torque, by the rest of the train on the member: a pinion's is the sun's, a gear's
    the planet's; planet_speed:
    absolute; planet_relative_speed: to the carrier. tangential_force (on the sun's reference
    circle), sun_working_force, ring_working_force (tangential on the working circles), and
    sun_gear_mesh_force, ring_gear_mesh_force (normal, along the 3D line of action) are of one
    planet and side; planet_bearing_… of one planet: radial outward on the planet by its teeth,
    tangential against the sense of rotation. stage_power: rolling power, > 0 from sun to ring.
    circulating_power: part of the stage's power that runs round a closed loop of the train.
    """

    name: str
    kind: str
    sun_speed: float
    ring_speed: float
    carrier_speed: float
    sun_torque: float
    ring_torque: float
    carrier_torque: float
    planet_torque: float
    planet_speed: float
    planet_relative_speed: float
    gear_mesh_frequency: float
    tangential_force: float
    sun_working_force: float
    ring_working_force: float
    sun_gear_mesh_force: float
    ring_gear_mesh_force: float
    planet_bearing_radial: float
    planet_bearing_tangential: float
    stage_power: float
    circulating_power: float

    @property
    def gear_mesh_forces(self) -> dict[str, float]:
        """Normal force of one gear mesh of "sun" and "ring", N; no ring in a parallel stage: 0."""
        return {"sun": self.sun_gear_mesh_force, "ring": self.ring_gear_mesh_force}

    @property
    def planet_bearing_force(self) -> float:
        """Size of the in-plane force on a planet's bearing, N."""
        return math.hypot(self.planet_bearing_radial, self.planet_bearing_tangential)


def stage_flow(
    view: StageView,
    speed: dict[str, float],
    torque: dict[str, float],
    circulating: float = 0.0,
) -> StageFlow:
    """Flow of a stage; speed and torque by part ("sun", "ring", "carrier" / "pinion", "gear").

    speed rad/s, torque N m by the rest of the train on the member; circulating W.
    """
    stage, radii = view.stage, stage_radii(view)
    first = "pinion" if stage.kind == "parallel" else "sun"
    carrier_speed = speed.get("carrier", 0.0)
    if stage.kind == "parallel":
        relative = speed["gear"]
    else:
        relative = -(radii.ring / radii.planet) * (carrier_speed - speed["ring"])
    sides = 2 if stage.double_helical else 1
    paths = stage.planets * sides
    # pinion and gear of a parallel stage turn against each other, planet and sun's torques don't
    sign = 1.0 if stage.kind == "parallel" else -1.0
    in_plane_sun = sign * torque[first] / (paths * radii.sun)
    in_plane_ring = -torque["ring"] / (paths * radii.ring) if "ring" in torque else 0.0
    cos_bb = math.cos(radii.base_helix_angle)
    sun_working = in_plane_sun * math.cos(radii.sun_angle)
    ring_working = in_plane_ring * math.cos(radii.ring_angle)
    return StageFlow(
        name=stage.name,
        kind=stage.kind,
        sun_speed=speed[first],
        ring_speed=speed.get("ring", 0.0),
        carrier_speed=carrier_speed,
        sun_torque=torque[first],
        ring_torque=torque.get("ring", 0.0),
        carrier_torque=torque.get("carrier", 0.0),
        planet_torque=torque.get("gear", 0.0),
        planet_speed=carrier_speed + relative,
        planet_relative_speed=relative,
        gear_mesh_frequency=_gear_mesh_frequency(stage, speed),
        tangential_force=sign * torque[first] / (paths * radii.sun_reference),
        sun_working_force=sun_working,
        ring_working_force=ring_working,
        sun_gear_mesh_force=in_plane_sun / cos_bb,
        ring_gear_mesh_force=in_plane_ring / cos_bb,
        planet_bearing_radial=sides
        * (
            # teeth push apart, whichever flanks carry
            abs(in_plane_sun) * math.sin(radii.sun_angle)
            - abs(in_plane_ring) * math.sin(radii.ring_angle)
        ),
        planet_bearing_tangential=sides * (sun_working + ring_working),
        stage_power=torque[first] * (speed[first] - carrier_speed),
        circulating_power=circulating,
    )


def _gear_mesh_frequency(stage: Stage, speed: dict[str, float]) -> float:
    """Teeth that pass a gear mesh in a second, Hz."""
    if stage.pinion is not None:
        return abs(stage.pinion.teeth * speed["pinion"]) / (2 * math.pi)
    assert stage.ring is not None  # the model refuses a planetary stage without one
    return abs(stage.ring.teeth * (speed["carrier"] - speed["ring"])) / (2 * math.pi)
