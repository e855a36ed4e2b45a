"""Radii, centre distance and working angles of a stage.

Reference radius r = m_n z / (2 cosβ), base radius r_b = r cos α_t unless a base diameter is given;
R_c = (r_b,sun + r_b,planet)/cos α_s = (r_b,ring − r_b,planet)/cos α_r. Without a centre distance or
working angle that is given, inv α_w = inv α_t + 2 tan α_n (x_1 + x_2)/(z_1 + z_2) at zero backlash,
with the ring's z negative (ISO 21771). What a case gives wins over what follows from tooth numbers
and profile shifts. Papers that print rounded or approximate values
break these relations; that is allowed, because small motion needs only the arms (base radii), the
directions (working angles) and the places of the planets (centre distance).

A parallel stage has its pinion in the sun's roles and its gear in the planet's.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from flexgear.gears.tooth import (
    base_helix_angle,
    inverse_involute,
    involute,
    reference_radius,
    transverse_angle,
)

if TYPE_CHECKING:
    from flexgear.model.member import MatedGear, PlanetGear
    from flexgear.model.stage import Stage
    from flexgear.model.stage_view import StageView

ROLES = ("sun", "planet", "ring")
SAME_DISTANCE = 5e-4  # modules that two centre distances may differ by


@dataclass(frozen=True)
class StageRadii:
    """Base and reference radii (m), centre distance (m), transverse angles (rad) of a stage.

    sun_angle, ring_angle: working, of each gear mesh; transverse_angle: α_t at the reference
    circles. A parallel stage has no ring: its radii and angle are 0.
    """

    sun: float
    planet: float
    ring: float
    center_distance: float
    sun_angle: float
    ring_angle: float
    transverse_angle: float
    base_helix_angle: float
    sun_reference: float
    planet_reference: float
    ring_reference: float

    def distance_of_circles(self, role: str) -> float:
        """Centre distance at which the base circles of a gear mesh ("sun" or "ring") have its
        working angle, (r_b1 ± r_b2)/cos α_w; m. That of the stage but for overridden radii."""
        if role == "ring":
            return (self.ring - self.planet) / math.cos(self.ring_angle)
        return (self.sun + self.planet) / math.cos(self.sun_angle)


def gears_by_role(stage: Stage) -> dict[str, MatedGear | PlanetGear]:
    """Gears by "sun", "planet", "ring"; of a parallel stage pinion and gear in the first two."""
    names = ("sun", "planet", "ring") if stage.kind == "planetary" else ("pinion", "gear")
    gears = {}
    for role, name in zip(ROLES, names, strict=False):
        gear = getattr(stage, name)
        assert gear is not None  # the model refuses a stage that lacks a gear
        gears[role] = gear
    return gears


def is_overridden(stage: Stage) -> bool:
    """Whether a base diameter or a working angle takes the place of the gears' geometry."""
    angles = (stage.sun_pressure_angle, stage.ring_pressure_angle)
    diameters = (gear.base_diameter for gear in gears_by_role(stage).values())
    return any(value is not None for value in (*angles, *diameters))


def stage_radii(view: StageView) -> StageRadii:
    """Radii and angles of a stage. InputError for gears that cannot mesh at their distance."""
    stage = view.stage
    reference, base = dict.fromkeys(ROLES, 0.0), dict.fromkeys(ROLES, 0.0)
    cos = math.cos(transverse_angle(stage))
    for role, gear in gears_by_role(stage).items():
        reference[role], base_diameter = reference_radius(gear.teeth, stage), gear.base_diameter
        base[role] = reference[role] * cos if base_diameter is None else base_diameter / 2
    arms = {"sun": base["sun"] + base["planet"]}
    if stage.kind == "planetary":
        arms["ring"] = base["ring"] - base["planet"]
    distance = stage.center_distance
    if distance is None:
        distance = _derived_distance(view, arms)
    angles = {role: _working_angle(view, role, arm, distance) for role, arm in arms.items()}
    return StageRadii(
        sun=base["sun"],
        planet=base["planet"],
        ring=base["ring"],
        center_distance=distance,
        sun_angle=angles["sun"],
        ring_angle=angles.get("ring", 0.0),
        transverse_angle=transverse_angle(stage),
        base_helix_angle=base_helix_angle(stage),
        sun_reference=reference["sun"],
        planet_reference=reference["planet"],
        ring_reference=reference["ring"],
    )


def _given_angles(stage: Stage) -> dict[str, float | None]:
    return {"sun": stage.sun_pressure_angle, "ring": stage.ring_pressure_angle}


def _working_angle(view: StageView, role: str, arm: float, distance: float) -> float:
    """Given, or cos α_w = (r_b1 ± r_b2)/R_c; rad."""
    angle = _given_angles(view.stage)[role]
    if angle is not None:
        return angle
    if not 0 < arm < distance:
        instead = "" if view.stage.form("ring") == "fe" else f", or give {role}_pressure_angle_deg"
        raise view.refuse(
            "center_distance_mm",
            f"{1e3 * distance:.3f} mm is below the base circles' {1e3 * arm:.3f} mm"
            f" ({view.part(role)})",
            f"make the centre distance larger{instead}",
        )
    return math.acos(arm / distance)


def _derived_distance(view: StageView, arms: dict[str, float]) -> float:
    """R_c from a given working angle (the sun's first), else from the profile shifts; m.

    True teeth have no backlash in both gear meshes at one distance; where base diameters are given
    the sun's counts.
    """
    stage = view.stage
    for role, angle in _given_angles(stage).items():
        if angle is not None and role in arms:
            return arms[role] / math.cos(angle)
    if is_overridden(stage):
        return _distance_of_shifts(view, "sun", arms["sun"])
    values = [_distance_of_shifts(view, role, arm) for role, arm in arms.items()]
    if abs(values[0] - values[-1]) > SAME_DISTANCE * stage.normal_module:
        raise view.refuse(
            "center_distance_mm",
            f"sun–planet wants {1e3 * values[0]:.3f} mm and planet–ring {1e3 * values[1]:.3f} mm",
            "choose profile shifts with equal centre distances, or give center_distance_mm",
        )
    return values[0]


def _distance_of_shifts(view: StageView, role: str, arm: float) -> float:
    """R_c at which the gear mesh has no backlash, m."""
    gears = gears_by_role(view.stage)
    gear, planet = gears[role], gears["planet"]
    shifts = gear.profile_shift + planet.profile_shift
    teeth = planet.teeth + (-gear.teeth if role == "ring" else gear.teeth)
    value = involute(transverse_angle(view.stage))
    value += 2 * math.tan(view.stage.pressure_angle) * shifts / teeth
    if value < 0:
        raise view.refuse(
            "", "the profile shifts leave no working pressure angle",
            "reduce the negative profile shifts",
        )  # fmt: skip
    return arm / math.cos(inverse_involute(value))
