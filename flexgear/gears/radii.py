"""Radii, centre distance and working angles of one stage of a train.

Reference radius r = m_n z / (2 cosβ), base radius r_b = r cos α_t unless a base diameter is given;
R_c = (r_b,sun + r_b,planet)/cos α_s = (r_b,ring − r_b,planet)/cos α_r. What a case gives wins over
what follows from tooth numbers and profile shifts. Papers that print rounded or approximate values
break these relations; that is allowed, because small motion needs only the arms (base radii), the
directions (working angles) and the places of the planets (centre distance).

A parallel stage has its pinion in the sun's slots and its gear in the planet's.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from flexgear.gears.geometry import stage_geometry
from flexgear.gears.messages import gear_mesh_name, named, stage_key
from flexgear.gears.tooth import (
    base_helix_angle,
    inverse_involute,
    involute,
    tooth_geometry,
    transverse_angle,
)
from flexgear.model.errors import InputError

if TYPE_CHECKING:
    from flexgear.model.train_member import TrainGear
    from flexgear.model.train_stage import TrainStage

SLOTS = ("sun", "planet", "ring")


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


def gears_by_slot(stage: TrainStage) -> dict[str, TrainGear]:
    """Gears by "sun", "planet", "ring"; of a parallel stage pinion and gear in the first two."""
    names = ("sun", "planet", "ring") if stage.kind == "planetary" else ("pinion", "gear")
    found = {}
    for slot, name in zip(SLOTS, names, strict=False):
        gear = getattr(stage, name)
        assert gear is not None  # the model refuses a stage that lacks a gear
        found[slot] = gear
    return found


def is_overridden(stage: TrainStage) -> bool:
    """Whether a base diameter or a working angle takes the place of the gears' geometry."""
    angles = (stage.sun_pressure_angle, stage.ring_pressure_angle)
    diameters = (gear.base_diameter for gear in gears_by_slot(stage).values())
    return any(value is not None for value in (*angles, *diameters))


def stage_radii(stage: TrainStage, where: str = "case") -> StageRadii:
    """Radii and angles of a stage; ``where`` is the file or case named in errors.

    Raises InputError, with the stage named, for gears that cannot mesh at their distance.
    """
    at = transverse_angle(stage)
    gears = gears_by_slot(stage)
    reference, base = dict.fromkeys(SLOTS, 0.0), dict.fromkeys(SLOTS, 0.0)
    for slot, gear in gears.items():
        tooth, given = tooth_geometry(gear, stage, internal=slot == "ring"), gear.base_diameter
        reference[slot] = tooth.reference_radius
        base[slot] = tooth.base_radius if given is None else given / 2
    distance, sun_angle, ring_angle = _distance_and_angles(stage, base, at, where)
    return StageRadii(
        sun=base["sun"],
        planet=base["planet"],
        ring=base["ring"],
        center_distance=distance,
        sun_angle=sun_angle,
        ring_angle=ring_angle,
        transverse_angle=at,
        base_helix_angle=base_helix_angle(stage),
        sun_reference=reference["sun"],
        planet_reference=reference["planet"],
        ring_reference=reference["ring"],
    )


def _distance_and_angles(
    stage: TrainStage, base: dict[str, float], at: float, where: str
) -> tuple[float, float, float]:
    """R_c (m), α_s and α_r (rad; 0 in a parallel stage)."""
    if stage.kind == "planetary" and not is_overridden(stage):
        with named(stage):
            g = stage_geometry(stage.stage, where)
        return g.center_distance, g.sun_mesh.working_angle, g.ring_mesh.working_angle
    arms = {"sun": base["sun"] + base["planet"]}
    given = {"sun": stage.sun_pressure_angle}
    if stage.kind == "planetary":
        arms["ring"] = base["ring"] - base["planet"]
        given["ring"] = stage.ring_pressure_angle
    distance = stage.center_distance
    if distance is None:
        distance = _derived_distance(stage, arms, given, at, where)
    angles = {}
    for name, arm in arms.items():
        angle = given[name]
        if angle is None:
            if not 0 < arm < distance:
                raise InputError(
                    where, stage_key(stage, "center_distance_mm"),
                    f"{1e3 * distance:.3f} mm is below the base circles' {1e3 * arm:.3f} mm"
                    f" ({gear_mesh_name(stage, name)})",
                    f"make the centre distance larger, or give {name}_pressure_angle_deg",
                )  # fmt: skip
            angle = math.acos(arm / distance)
        angles[name] = angle
    return distance, angles["sun"], angles.get("ring", 0.0)


def _derived_distance(
    stage: TrainStage,
    arms: dict[str, float],
    given: dict[str, float | None],
    at: float,
    where: str,
) -> float:
    """R_c from a given working angle (the sun's first), else from the profile shifts; m."""
    for name, arm in arms.items():
        angle = given[name]
        if angle is not None:
            return arm / math.cos(angle)
    sun, planet = (gears_by_slot(stage)[slot] for slot in ("sun", "planet"))
    shift = (sun.profile_shift + planet.profile_shift) / (sun.teeth + planet.teeth)
    value = involute(at) + 2 * math.tan(stage.pressure_angle) * shift
    if value < 0:
        raise InputError(
            where, stage_key(stage, ""), "the profile shifts leave no working pressure angle",
            "reduce the negative profile shifts",
        )  # fmt: skip
    return arms["sun"] / math.cos(inverse_involute(value))
