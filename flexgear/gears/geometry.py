"""Involute geometry of a planetary stage in the transverse plane.

Reference radius r = m_n z / (2 cosβ), base radius r_b = r cosα_t, tanα_t = tanα_n / cosβ
(ISO 21771). Thickness at the reference circle: s = m_n (π/2 + 2 x tanα_n)/cosβ for every gear; for
the ring ISO's tooth number is negative, so that x > 0 thickens its tooth, too, and moves its tip
and root circles inward: r_a = r - m_n (h_a + x), r_f = r + m_n (h_f - x).

Working angle: inv α_w = inv α_t + 2 tanα_n (x_1 + x_2)/(z_1 + z_2) at zero backlash, with the
ring's z negative; centre distance R_c = (r_b1 ± r_b2)/cos α_w. Where a centre distance is given,
cos α_w follows from it and the thicknesses leave the backlash that they leave.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

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


def involute(angle: float) -> float:
    """inv α = tan α − α, rad."""
    return math.tan(angle) - angle


def inverse_involute(value: float) -> float:
    """α with inv α = value, by Newton's rule from α ≈ (3 v)^{1/3}."""
    if value < 0:
        raise ValueError("an involute function below zero has no angle")
    angle = min((3 * value) ** (1 / 3), 1.4)
    for _ in range(50):
        step = (involute(angle) - value) / max(math.tan(angle) ** 2, 1e-300)
        angle -= step
        if abs(step) < 1e-15:
            break
    return angle


@dataclass(frozen=True)
class GearGeometry:
    """One gear: radii (m), transverse tooth thickness at the reference circle (m)."""

    teeth: int
    internal: bool
    reference_radius: float
    base_radius: float
    tip_radius: float
    root_radius: float
    thickness: float

    def roll_length(self, radius: float) -> float:
        """ρ = √(r² − r_b²): length along the line of action from the base tangent point, m."""
        return math.sqrt(max(radius**2 - self.base_radius**2, 0.0))

    def thickness_at(self, radius: float, pressure_angle: float) -> float:
        """Transverse tooth thickness (m) at ``radius``; pressure_angle is α_t at the reference."""
        local = math.acos(min(1.0, self.base_radius / radius))
        sign = -1.0 if self.internal else 1.0
        half = self.thickness / (2 * self.reference_radius)
        return 2 * radius * (half + sign * (involute(pressure_angle) - involute(local)))


@dataclass(frozen=True)
class MeshGeometry:
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

    sun: GearGeometry
    planet: GearGeometry
    ring: GearGeometry
    sun_mesh: MeshGeometry
    ring_mesh: MeshGeometry
    center_distance: float
    transverse_angle: float
    base_helix_angle: float
    planet_clearance: float
    assembly: float


def gear_geometry(stage: Stage | ExternalPair, name: str, transverse_angle: float) -> GearGeometry:
    """Radii and thickness of "sun", "planet" or "ring"."""
    gear = getattr(stage, name)
    cos_b = math.cos(stage.helix_angle)
    module, x = stage.normal_module, gear.profile_shift
    r = module * gear.teeth / (2 * cos_b)
    out = -1.0 if name == "ring" else 1.0
    return GearGeometry(
        teeth=gear.teeth,
        internal=name == "ring",
        reference_radius=r,
        base_radius=r * math.cos(transverse_angle),
        tip_radius=r + out * module * (gear.addendum + x),
        root_radius=r - out * module * (gear.dedendum - x),
        thickness=module * (math.pi / 2 + 2 * x * math.tan(stage.pressure_angle)) / cos_b,
    )


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
    gear: GearGeometry,
    planet: GearGeometry,
    distance: float,
    at: float,
    where: str,
) -> MeshGeometry:
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
    reach = distance * math.sin(angle)
    tip = planet.roll_length(planet.tip_radius)
    if internal:
        if gear.tip_radius <= gear.base_radius:
            raise InputError(
                where, "stage.ring.addendum", "the ring's tip lies inside its base circle",
                "reduce the addendum or raise the profile shift of the ring",
            )  # fmt: skip
        low, high = gear.roll_length(gear.tip_radius) - reach, tip
        high = min(high, gear.roll_length(gear.root_radius) - reach)
        if low < 0.0:
            raise InputError(
                where, "stage.ring.addendum",
                "the ring's tip touches the planet's flank below its base circle (interference)",
                "reduce it, or raise the number of planet teeth",
            )  # fmt: skip
    else:  # undercut flanks end at the base circle
        low, high = max(reach - gear.roll_length(gear.tip_radius), 0.0), min(tip, reach)
    room = _bottom_clearance(gear, planet, distance)
    if min(room) < 0:
        raise InputError(
            where, f"stage.{name if room[0] < room[1] else 'planet'}.dedendum",
            f"a tip reaches {-1e3 * min(room):.2f} mm into the root of its mate ({name})",
            "raise it, or lower the mate's addendum",
        )  # fmt: skip
    pitch = 2 * math.pi * planet.base_radius / planet.teeth
    if high - low < pitch:
        raise InputError(
            where, f"stage.{name}",
            f"transverse contact ratio {(high - low) / pitch:.3f} is below 1",
            "raise addenda or change profile shifts",
        )  # fmt: skip
    # normal play left by thicknesses at the working circles, plus what the case asks for
    scale = distance / base
    r_g, r_p = gear.base_radius * scale, planet.base_radius * scale
    s_g, s_p = gear.thickness_at(r_g, at), planet.thickness_at(r_p, at)
    inherent = (2 * math.pi * r_p / planet.teeth - s_g - s_p) * math.cos(angle)
    cos_bb = math.cos(math.asin(math.sin(stage.helix_angle) * math.cos(stage.pressure_angle)))
    backlash = play + inherent * cos_bb
    if backlash < -NO_PLAY * stage.normal_module:
        raise InputError(
            where, f"stage.{name}", f"teeth overlap by {-1e6 * backlash:.1f} µm at this distance",
            f"raise backlash_{name}_mm or change the centre distance",
        )  # fmt: skip
    overlap = stage.face_width * math.sin(stage.helix_angle) / (math.pi * stage.normal_module)
    return MeshGeometry(angle, low, high, pitch, (high - low) / pitch, overlap, max(backlash, 0.0))


def _bottom_clearance(
    gear: GearGeometry, planet: GearGeometry, distance: float
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
) -> tuple[GearGeometry, GearGeometry, MeshGeometry]:
    """Sun, planet and their gear mesh at a centre distance (m), without a ring.

    Raises InputError for gears that cannot mesh.
    """
    at = math.atan(math.tan(pair.pressure_angle) / math.cos(pair.helix_angle))
    sun, planet = (gear_geometry(pair, name, at) for name in ("sun", "planet"))
    return sun, planet, _gear_mesh(pair, sun, planet, distance, at, where)


def stage_geometry(stage: Stage, where: str = "case") -> StageGeometry:
    """Geometry of a stage; ``where`` is named in errors.

    Raises InputError for gears that cannot mesh and for planets that collide.
    """
    at = math.atan(math.tan(stage.pressure_angle) / math.cos(stage.helix_angle))
    sun, planet, ring = (gear_geometry(stage, name, at) for name in ("sun", "planet", "ring"))
    distance = _center_distance(
        stage, at, sun.base_radius, planet.base_radius, ring.base_radius, where
    )
    clearance = planet_clearance(stage.planet_angles, distance, planet.tip_radius)
    sun_mesh = _gear_mesh(stage, sun, planet, distance, at, where)
    ring_mesh = _gear_mesh(stage, ring, planet, distance, at, where)
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
        base_helix_angle=math.asin(math.sin(stage.helix_angle) * math.cos(stage.pressure_angle)),
        planet_clearance=clearance,
        assembly=(sun.teeth + ring.teeth) / stage.planets,
    )
