"""Gears of a stage at their centre distance: working angles, paths of contact, backlash.

Teeth are those of ``tooth``. Working angle: inv α_w = inv α_t + 2 tanα_n (x_1 + x_2)/(z_1 + z_2) at
zero backlash, with the ring's z negative; centre distance R_c = (r_b1 ± r_b2)/cos α_w (ISO 21771).
Where a centre distance is given, cos α_w follows from it and the thicknesses leave the backlash
that they leave.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from flexgear.gears.tooth import (
    ToothGeometry,
    base_helix_angle,
    inverse_involute,
    involute,
    tooth_geometry,
    transverse_angle,
)
from flexgear.model.errors import InputError

if TYPE_CHECKING:
    from flexgear.model.stage import Gear, Stage


@dataclass(frozen=True)
class ExternalPair:
    """Two external gears in the places of sun and planet; SI, fields as in ``Stage``."""

    normal_module: float
    pressure_angle: float
    helix_angle: float
    face_width: float
    backlash_sun: float
    sun: Gear
    planet: Gear
    backlash_ring: float = 0.0  # there is no ring


SAME_DISTANCE = 5e-4  # modules that two centre distances may differ by
NO_PLAY = 1e-7  # modules of overlap that are rounding


@dataclass(frozen=True)
class GearMeshGeometry:
    """One gear mesh: working transverse pressure angle (rad), path of contact on the planet's
    line of action s_lo…s_hi (m), base pitch (m), contact ratios, normal backlash (m)."""

    working_angle: float
    s_lo: float
    s_hi: float
    base_pitch: float
    transverse_contact_ratio: float
    overlap_ratio: float
    backlash: float

    @property
    def total_contact_ratio(self) -> float:
        """ε_γ = ε_α + ε_β."""
        return self.transverse_contact_ratio + self.overlap_ratio


@dataclass(frozen=True)
class StageGeometry:
    """A planetary stage.

    center_distance m; transverse_angle α_t and base_helix_angle β_b rad; planet_clearance: gap
    between tips of neighbouring planets, m (negative: they collide); assembly: (z_s + z_r)/N.
    """

    sun: ToothGeometry
    planet: ToothGeometry
    ring: ToothGeometry
    sun_mesh: GearMeshGeometry
    ring_mesh: GearMeshGeometry
    center_distance: float
    transverse_angle: float
    base_helix_angle: float
    planet_clearance: float
    assembly: float


def _center_distance(
    stage: Stage, at: float, sun: float, planet: float, ring: float, where: str
) -> float:
    """Centre distance (m) at zero backlash of both gear meshes, or the one that is given."""
    given = stage.center_distance
    if given is not None:
        return given
    tan_n = math.tan(stage.pressure_angle)
    z_s, z_p, z_r = stage.sun.teeth, stage.planet.teeth, stage.ring.teeth
    x_s, x_p, x_r = (getattr(stage, g).profile_shift for g in ("sun", "planet", "ring"))
    values = []
    for total_x, total_z, base in (
        (x_s + x_p, z_s + z_p, sun + planet),
        (-x_r - x_p, z_r - z_p, ring - planet),
    ):
        value = involute(at) + 2 * tan_n * total_x / total_z
        if value < 0 or total_z <= 0:
            raise InputError(
                where, "stage", "the profile shifts leave no working pressure angle",
                "reduce the negative profile shifts",
            )  # fmt: skip
        values.append(base / math.cos(inverse_involute(value)))
    if abs(values[0] - values[1]) > SAME_DISTANCE * stage.normal_module:
        raise InputError(
            where,
            "stage.center_distance_mm",
            f"sun–planet wants {1e3 * values[0]:.3f} mm and planet–ring {1e3 * values[1]:.3f} mm",
            "choose profile shifts with equal centre distances, or give center_distance_mm",
        )
    return values[0]


def _gear_mesh(
    stage: Stage | ExternalPair,
    gear: ToothGeometry,
    planet: ToothGeometry,
    distance: float,
    where: str,
) -> GearMeshGeometry:
    internal = gear.internal
    name = "ring" if internal else "sun"
    play = stage.backlash_ring if internal else stage.backlash_sun
    base = gear.base_radius - planet.base_radius if internal else (
        gear.base_radius + planet.base_radius
    )  # fmt: skip
    if not 0 < base < distance:
        raise InputError(
            where, "stage.center_distance_mm",
            f"{1e3 * distance:.3f} mm is below the base circles' {1e3 * base:.3f} mm ({name})",
            "make the centre distance larger",
        )  # fmt: skip
    angle = math.acos(base / distance)
    if internal:
        if gear.tip_radius <= gear.base_radius:
            raise InputError(
                where, "stage.ring.addendum", "the ring's tip lies inside its base circle",
                "reduce the addendum or raise the profile shift of the ring",
            )  # fmt: skip
        if planet.interferes_with(gear, angle):
            raise InputError(
                where, "stage.ring.addendum",
                "the ring's tip touches the planet's flank below its base circle (interference)",
                "reduce it, or raise the number of planet teeth",
            )  # fmt: skip
    low, high = planet.path_of_contact(gear, angle)
    room = _bottom_clearance(gear, planet, distance)
    if min(room) < 0:
        raise InputError(
            where, f"stage.{name if room[0] < room[1] else 'planet'}.dedendum",
            f"a tip reaches {-1e3 * min(room):.2f} mm into the root of its mate ({name})",
            "raise it, or lower the mate's addendum",
        )  # fmt: skip
    pitch = planet.base_pitch
    if high - low < pitch:
        raise InputError(
            where, f"stage.{name}",
            f"transverse contact ratio {(high - low) / pitch:.3f} is below 1",
            "raise addenda or change profile shifts",
        )  # fmt: skip
    # normal play left by thicknesses at the working circles, plus what the case asks for
    scale = distance / base
    r_g, r_p = gear.base_radius * scale, planet.base_radius * scale
    thick = gear.thickness_at(r_g) + planet.thickness_at(r_p)
    inherent = (planet.pitch_angle * r_p - thick) * math.cos(angle)
    backlash = play + inherent * math.cos(base_helix_angle(stage))
    if backlash < -NO_PLAY * stage.normal_module:
        raise InputError(
            where, f"stage.{name}", f"teeth overlap by {-1e6 * backlash:.1f} µm at this distance",
            f"raise backlash_{name}_mm or change the centre distance",
        )  # fmt: skip
    overlap = stage.face_width * math.sin(stage.helix_angle) / (math.pi * stage.normal_module)
    return GearMeshGeometry(
        angle, low, high, pitch, (high - low) / pitch, overlap, max(backlash, 0.0)
    )


def _bottom_clearance(
    gear: ToothGeometry, planet: ToothGeometry, distance: float
) -> tuple[float, float]:
    """Room at the gear's root below the planet's tip, and at the planet's root; m."""
    if gear.internal:
        return (
            gear.root_radius - distance - planet.tip_radius,
            gear.tip_radius - distance - planet.root_radius,
        )
    return (
        distance - planet.tip_radius - gear.root_radius,
        distance - gear.tip_radius - planet.root_radius,
    )


def planet_clearance(positions: Sequence[float], distance: float, tip_radius: float) -> float:
    """Gap between tips of neighbouring planets at angles ``positions``, m; ∞ for one planet."""
    angles = sorted(angle % (2 * math.pi) for angle in positions)
    if len(angles) < 2:
        return math.inf
    gaps = [b - a for a, b in zip(angles, [*angles[1:], angles[0] + 2 * math.pi], strict=True)]
    return 2 * distance * math.sin(min(*gaps, math.pi) / 2) - 2 * tip_radius


def external_pair_geometry(
    pair: ExternalPair, distance: float, where: str = "case"
) -> tuple[ToothGeometry, ToothGeometry, GearMeshGeometry]:
    """Sun, planet and their gear mesh at a centre distance (m), without a ring.

    Raises InputError for gears that cannot mesh.
    """
    sun, planet = (tooth_geometry(gear, pair) for gear in (pair.sun, pair.planet))
    return sun, planet, _gear_mesh(pair, sun, planet, distance, where)


def stage_geometry(stage: Stage, where: str = "case") -> StageGeometry:
    """Geometry of a stage; ``where`` is named in errors.

    Raises InputError for gears that cannot mesh and for planets that collide.
    """
    at = transverse_angle(stage)
    sun, planet = (tooth_geometry(gear, stage) for gear in (stage.sun, stage.planet))
    ring = tooth_geometry(stage.ring, stage, internal=True)
    distance = _center_distance(
        stage, at, sun.base_radius, planet.base_radius, ring.base_radius, where
    )
    clearance = planet_clearance(stage.planet_angles, distance, planet.tip_radius)
    sun_mesh = _gear_mesh(stage, sun, planet, distance, where)
    ring_mesh = _gear_mesh(stage, ring, planet, distance, where)
    if clearance < 0:
        raise InputError(
            where, "stage.planets",
            f"neighbouring planets collide: their tips overlap by {-1e3 * clearance:.2f} mm",
            "use fewer planets, fewer planet teeth or other planet positions",
        )  # fmt: skip
    return StageGeometry(
        sun=sun,
        planet=planet,
        ring=ring,
        sun_mesh=sun_mesh,
        ring_mesh=ring_mesh,
        center_distance=distance,
        transverse_angle=at,
        base_helix_angle=base_helix_angle(stage),
        planet_clearance=clearance,
        assembly=(sun.teeth + ring.teeth) / stage.planets,
    )
