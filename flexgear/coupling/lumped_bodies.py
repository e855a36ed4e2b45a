"""Lumped bodies of a train's stage, from what the case gives or a steel disc of that size."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexgear.gears.radii import StageRadii, gears_by_slot, stage_radii
from flexgear.gears.tooth import tooth_geometry
from flexgear.model.case import Case
from flexgear.model.train_member import TrainCarrier, TrainGear
from flexgear.model.train_stage import TrainStage
from flexgear.structures.bodies import Body, lumped_body

Array = NDArray[np.float64]
RIM_MODULES = 4.0  # rim of a ring outside its root circle where none is given, in modules


@dataclass(frozen=True)
class LumpedMember:
    """One lumped body of a stage. part: "sun", "ring", "carrier", "planet", "pinion", "gear";
    side: half of a double-helical ring, or ""; planet: number from 0, or −1; radius: r of the
    tangential stiffness, m; inertia: polar, kg m²; tilt: about a diameter, kg m²; mass: kg."""

    body: Body
    part: str
    side: str
    planet: int
    radius: float
    mass: float
    inertia: float
    tilt: float


def stage_width(stage: TrainStage) -> float:
    """Width of the gears, m: both halves and the gap of a double-helical stage."""
    return 2 * stage.face_width + stage.half_gap if stage.double_helical else stage.face_width


def mass_properties(
    train: Case, stage: TrainStage, part: str, radii: StageRadii
) -> tuple[float, float, float]:
    """Mass (kg), polar and diametral inertia (kg m²) of one member.

    What is not given is that of a hollow steel cylinder: gears between bore and reference circle,
    rings between reference circle and rim (four modules outside the root where no rim is given),
    carriers a disc of the pins' circle, all as wide as the gears.
    """
    member, width = stage.member(part), stage_width(stage)
    if part == "ring" and stage.double_helical:
        width = stage.face_width
    inner, outer = _radii_of(stage, part, member, radii)
    mass = member.mass
    if mass is None:
        mass = train.material.density * math.pi * (outer**2 - inner**2) * width
    polar = member.inertia
    if polar is None and member.equivalent_mass is not None:
        polar = member.equivalent_mass * reference_radius(stage, part, radii) ** 2
    if polar is None:
        polar = 0.5 * mass * (outer**2 + inner**2)
    tilt = member.tilt_inertia
    return mass, polar, 0.5 * polar + mass * width**2 / 12 if tilt is None else tilt


def _radii_of(
    stage: TrainStage, part: str, member: TrainGear | TrainCarrier, radii: StageRadii
) -> tuple[float, float]:
    """Inner and outer radius of the steel disc, m."""
    if isinstance(member, TrainCarrier):
        return 0.0, radii.center_distance
    reference = getattr(radii, f"{_slot(stage, part)}_reference")
    if part != "ring":
        return member.bore_diameter / 2, reference
    rim, tooth = member.rim_thickness, tooth_geometry(member, stage, internal=True)
    return reference, tooth.root_radius + (
        RIM_MODULES * stage.normal_module if rim is None else rim
    )


def _slot(stage: TrainStage, part: str) -> str:
    gears = gears_by_slot(stage)
    return next(slot for slot, gear in gears.items() if gear is stage.member(part))


def reference_radius(stage: TrainStage, part: str, radii: StageRadii) -> float:
    """r of u = r θ: base radius of a gear, centre distance of a carrier, m."""
    if part == "carrier":
        return radii.center_distance
    return float(getattr(radii, _slot(stage, part)))


def lumped_members(train: Case, stage: TrainStage) -> list[LumpedMember]:
    """All lumped bodies of a stage, planets last; names "<stage>.sun", "<stage>.planet_1", …

    A held member without a support against rotation has no rotation.
    """
    radii, held = stage_radii(train.view(stage.name)), train.held_members()
    out = []
    for part in [*stage.members, *(["planet"] if stage.kind == "planetary" else [])]:
        name = f"{stage.name}.{part}"
        member = stage.member(part)
        mass, polar, tilt = mass_properties(train, stage, part, radii)
        fast = name in held and not member.support.holds_rotation
        for suffix, side, planet in _copies(stage, part):
            body = lumped_body(
                f"{name}{suffix}", mass, (tilt, tilt, polar), train.kinematics_of(name), held=fast
            )
            out.append(
                LumpedMember(
                    body,
                    part,
                    side,
                    planet,
                    reference_radius(stage, part, radii),
                    mass,
                    polar,
                    tilt,
                )
            )
    return out


def _copies(stage: TrainStage, part: str) -> list[tuple[str, str, int]]:
    """Suffix of the body's name, side and planet of every body that a member stands for."""
    if part == "planet":
        return [(f"_{i + 1}", "", i) for i in range(stage.planets)]
    if part == "ring" and stage.double_helical:
        return [("_left", "left", -1), ("_right", "right", -1)]
    return [("", "", -1)]
