"""Radii, centre distance and working angles of a stage.

Reference radius r = m_n z / (2 cosβ), base radius r_b = r cos α_t unless a base diameter is given;
R_c = (r_b,sun + r_b,planet)/cos α_s = (r_b,ring − r_b,planet)/cos α_r. If a case has neither centre
distance nor working angles, inv α_w = inv α_t + 2 tan α_n (x_1 + x_2)/(z_1 + z_2) at zero backlash,
with the ring's z negative (ISO 21771). Values of the case take precedence over those from tooth
numbers and profile shifts. Rounded values from publications need not satisfy these relations, as
small motion depends only on arms (base radii), directions (working angles) and positions of the
planets (centre distance).

In a parallel stage the pinion has the role of the sun and the gear that of the planet.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from flexgear.gears.tooth import (
    base_helix_angle,
    inverse_involute,
    involute,
    reference_radius,
    transverse_angle,
)
from flexgear.model.member import MatedGear, PlanetGear
from flexgear.model.stage import Stage
from flexgear.model.stage_view import StageView

ROLES = ("sun", "planet", "ring")
SAME_DISTANCE = 5e-4  # modules, largest difference of centre distances that count as equal


@dataclass(frozen=True)
class StageRadii:
    """Radii (m) and transverse angles (rad) of a stage.

    base, reference: radii of "sun", "planet" and "ring"; working_angles: of the gear meshes "sun"
    and "ring"; center_distance: m; transverse_angle: α_t at the reference circles;
    base_helix_angle: β_b. A parallel stage has no ring.
    """

    base: Mapping[str, float]
    reference: Mapping[str, float]
    working_angles: Mapping[str, float]
    center_distance: float
    transverse_angle: float
    base_helix_angle: float

    def rotation_radius(self, member: str) -> float:
        """Radius r of u = r θ, m: base radius of a gear, centre distance of a carrier."""
        return self.center_distance if member == "carrier" else self.base[role_of(member)]


def role_of(member: str) -> str:
    """Role of a member: "sun" of a pinion, "planet" of its mate, else the member itself."""
    return {"pinion": "sun", "gear": "planet"}.get(member, member)


def base_arm(base: Mapping[str, float], role: str) -> float:
    """Sum of the base radii of planet and sun, or difference of ring and planet, m."""
    return base["ring"] - base["planet"] if role == "ring" else base[role] + base["planet"]


def gears_by_role(stage: Stage) -> dict[str, MatedGear | PlanetGear]:
    """Gears by role; a parallel stage has its pinion as "sun" and its gear as "planet"."""
    names = ROLES if stage.kind == "planetary" else ("pinion", "gear")
    return {role: getattr(stage, name) for role, name in zip(ROLES, names, strict=False)}


def is_overridden(stage: Stage) -> bool:
    """Whether the case gives a base diameter or a working angle of the stage."""
    angles = (stage.sun_pressure_angle, stage.ring_pressure_angle)
    diameters = (gear.base_diameter for gear in gears_by_role(stage).values())
    return any(value is not None for value in (*angles, *diameters))


def stage_radii(view: StageView) -> StageRadii:
    """Radii and angles of a stage. Raises InputError for gears that do not mesh."""
    stage, gears = view.stage, gears_by_role(view.stage)
    cos = math.cos(transverse_angle(stage))
    reference = {role: reference_radius(gear.teeth, stage) for role, gear in gears.items()}
    base = {
        role: reference[role] * cos if gear.base_diameter is None else gear.base_diameter / 2
        for role, gear in gears.items()
    }
    arms = {role: base_arm(base, role) for role in gears if role != "planet"}
    distance = stage.center_distance
    if distance is None:
        distance = _derived_distance(view, arms)
    return StageRadii(
        base=base,
        reference=reference,
        working_angles={role: _working_angle(view, role, arms[role], distance) for role in arms},
        center_distance=distance,
        transverse_angle=transverse_angle(stage),
        base_helix_angle=base_helix_angle(stage),
    )


def _given_angles(stage: Stage) -> dict[str, float | None]:
    return {"sun": stage.sun_pressure_angle, "ring": stage.ring_pressure_angle}


def _working_angle(view: StageView, role: str, arm: float, distance: float) -> float:
    """Working angle of the case, or α_w of cos α_w = (r_b1 ± r_b2)/R_c, rad."""
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
    """R_c, m, from a given working angle (of the sun, else of the ring), else from profile shifts.
    Profile shifts must give both gear meshes zero backlash at one distance; where the case gives
    base diameters, that of the sun is used."""
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
            f"sun–planet needs {1e3 * values[0]:.3f} mm and planet–ring {1e3 * values[1]:.3f} mm",
            "choose profile shifts with equal centre distances, or give center_distance_mm",
        )
    return values[0]


def _distance_of_shifts(view: StageView, role: str, arm: float) -> float:
    """R_c at which profile shifts leave zero backlash, m."""
    gears = gears_by_role(view.stage)
    gear, planet = gears[role], gears["planet"]
    shifts = gear.profile_shift + planet.profile_shift
    teeth = planet.teeth + (-gear.teeth if role == "ring" else gear.teeth)
    value = involute(transverse_angle(view.stage))
    value += 2 * math.tan(view.stage.pressure_angle) * shifts / teeth
    if value < 0:
        problem = "the profile shifts leave no working pressure angle"
        raise view.refuse("", problem, "reduce the negative profile shifts")
    return arm / math.cos(inverse_involute(value))
