"""Gears and gear meshes of one stage of a train, with what the case gives in place of geometry.

Where base diameters or working angles are given, tooth numbers still say how the gears roll: the
phases of planets and the order of the gear mesh come from radii p_b z/2π with the planet's base
pitch p_b = 2π r_b,planet/z_planet, which are the base radii wherever these fit one another. The
path of contact then lies between the tips, or is as long as the given contact ratio says.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from flexgear.gears.geometry import (
    ExternalPair,
    GearMeshGeometry,
    StageGeometry,
    external_pair_geometry,
    planet_clearance,
    stage_geometry,
)
from flexgear.gears.messages import gear_mesh_name, named, stage_key
from flexgear.gears.radii import StageRadii, gears_by_slot, is_overridden, stage_radii
from flexgear.gears.tooth import ToothGeometry, tooth_geometry
from flexgear.model.errors import InputError

if TYPE_CHECKING:
    from flexgear.model.train_stage import TrainStage

PER_PAIR_MODELS = ("per_pair", "lumped")


@dataclass(frozen=True)
class TrainGeometry:
    """Gears by slot ("sun", "planet", "ring"), gear meshes by "sun" and "ring", radii.

    overridden: whether a base diameter or working angle is given; gears then have the radii that
    their tooth numbers give. planet_clearance: gap between tips of neighbouring planets, m;
    assembly: (z_s + z_r)/N. A parallel stage has no ring.
    """

    gears: dict[str, ToothGeometry]
    gear_meshes: dict[str, GearMeshGeometry]
    radii: StageRadii
    overridden: bool
    planet_clearance: float
    assembly: float

    @property
    def planetary(self) -> StageGeometry:
        """The geometry as paths of contact of a planetary stage take it."""
        return StageGeometry(
            **self.gears,
            sun_mesh=self.gear_meshes["sun"],
            ring_mesh=self.gear_meshes["ring"],
            center_distance=self.radii.center_distance,
            transverse_angle=self.radii.transverse_angle,
            base_helix_angle=self.radii.base_helix_angle,
            planet_clearance=self.planet_clearance,
            assembly=self.assembly,
        )


def train_geometry(stage: TrainStage, where: str = "case") -> TrainGeometry:
    """Geometry of a stage; ``where`` is the file or case named in errors.

    Raises InputError, with the stage named, for gears that cannot mesh, planets that collide, and
    models of the gear mesh that need true teeth where base diameters or angles are given.
    """
    radii = stage_radii(stage, where)
    if is_overridden(stage):
        return _overridden(stage, radii, where)
    with named(stage):
        if stage.kind == "parallel":
            pair = external_pair(stage)
            sun, planet, gear_mesh = external_pair_geometry(pair, radii.center_distance, where)
            return TrainGeometry(
                {"sun": sun, "planet": planet},
                {"sun": _of_ratio(stage, "sun", gear_mesh)},
                radii,
                overridden=False,
                planet_clearance=math.inf,
                assembly=math.nan,
            )
        g = stage_geometry(stage.stage, where)
    return TrainGeometry(
        {"sun": g.sun, "planet": g.planet, "ring": g.ring},
        {"sun": _of_ratio(stage, "sun", g.sun_mesh), "ring": _of_ratio(stage, "ring", g.ring_mesh)},
        radii,
        overridden=False,
        planet_clearance=g.planet_clearance,
        assembly=g.assembly,
    )


def external_pair(stage: TrainStage) -> ExternalPair:
    """Pinion and gear of a parallel stage in the places of sun and planet."""
    gears = gears_by_slot(stage)
    return ExternalPair(
        normal_module=stage.normal_module,
        pressure_angle=stage.pressure_angle,
        helix_angle=stage.helix_angle,
        face_width=stage.face_width,
        backlash_sun=stage.backlash_sun,
        sun=gears["sun"].gear,
        planet=gears["planet"].gear,
    )


def given_contact_ratio(stage: TrainStage, slot: str) -> float | None:
    """Transverse contact ratio that the case gives for "sun" or "ring"; only waves use it."""
    if stage.gear_mesh.model in PER_PAIR_MODELS:
        return None
    options = stage.gear_mesh
    return options.sun_contact_ratio if slot == "sun" else options.ring_contact_ratio


def _of_ratio(stage: TrainStage, slot: str, gear_mesh: GearMeshGeometry) -> GearMeshGeometry:
    """The gear mesh with a path as long as the given contact ratio, about the same middle."""
    ratio = given_contact_ratio(stage, slot)
    return gear_mesh if ratio is None else _as_long_as(gear_mesh, ratio)


def _as_long_as(gear_mesh: GearMeshGeometry, ratio: float) -> GearMeshGeometry:
    middle = 0.5 * (gear_mesh.s_lo + gear_mesh.s_hi)
    half = 0.5 * ratio * gear_mesh.base_pitch
    return replace(
        gear_mesh, s_lo=middle - half, s_hi=middle + half, transverse_contact_ratio=ratio
    )


def _overridden(stage: TrainStage, radii: StageRadii, where: str) -> TrainGeometry:
    if stage.gear_mesh.model in PER_PAIR_MODELS:
        raise InputError(
            where, stage_key(stage, "gear_mesh.model"),
            f"{stage.gear_mesh.model} needs true teeth, but base diameters or angles are given",
            "use constant, rectangular or fourier, or take those out",
        )  # fmt: skip
    pitch = 2 * math.pi * radii.planet / gears_by_slot(stage)["planet"].teeth
    gears = {}
    for slot, gear in gears_by_slot(stage).items():
        plain = tooth_geometry(gear, stage, internal=slot == "ring")
        gears[slot] = replace(plain, base_radius=pitch * gear.teeth / (2 * math.pi))
    slots: list[str] = [slot for slot in ("sun", "ring") if slot in gears]
    gear_meshes = {slot: _overridden_mesh(stage, radii, gears, slot, where) for slot in slots}
    clearance = planet_clearance(
        stage.planet_angles, radii.center_distance, gears["planet"].tip_radius
    )
    if clearance < 0 and not stage.allow_unassemblable:
        raise InputError(
            where, stage_key(stage, "planets"),
            f"neighbouring planets collide: their tips overlap by {-1e3 * clearance:.2f} mm",
            "use fewer planets, fewer planet teeth or other planet positions, or set "
            "allow_unassemblable = true",
        )  # fmt: skip
    teeth = sum(gears[slot].teeth for slot in slots)
    assembly = teeth / stage.planets if stage.kind == "planetary" else math.nan
    return TrainGeometry(
        gears, gear_meshes, radii, overridden=True, planet_clearance=clearance, assembly=assembly
    )


def _overridden_mesh(
    stage: TrainStage, radii: StageRadii, gears: dict[str, ToothGeometry], slot: str, where: str
) -> GearMeshGeometry:
    planet, gear = gears["planet"], gears[slot]
    angle = radii.ring_angle if gear.internal else radii.sun_angle
    pitch = planet.base_pitch
    low, high = planet.path_of_contact(gear, angle)
    ratio = given_contact_ratio(stage, slot)
    if ratio is None and high - low < pitch:
        if not _contact_ratio_is_idle(stage, slot):
            raise InputError(
                where, stage_key(stage, f"gear_mesh.{slot}_contact_ratio"),
                f"the tips leave a contact ratio of {(high - low) / pitch:.3f} "
                f"({gear_mesh_name(stage, slot)})",
                f"give {slot}_contact_ratio, or check module and base diameters",
            )  # fmt: skip
        ratio = 1.0
    if high - low < pitch:  # about the pitch point
        low = high = radii.planet * math.tan(angle)
    overlap = stage.face_width * math.sin(stage.helix_angle) / (math.pi * stage.normal_module)
    gear_mesh = GearMeshGeometry(
        working_angle=angle,
        s_lo=low,
        s_hi=high,
        base_pitch=pitch,
        transverse_contact_ratio=(high - low) / pitch,
        overlap_ratio=overlap,
        backlash=stage.backlash_ring if gear.internal else stage.backlash_sun,
    )
    return gear_mesh if ratio is None else _as_long_as(gear_mesh, ratio)


def _contact_ratio_is_idle(stage: TrainStage, slot: str) -> bool:
    """Whether nothing follows from the contact ratio: constant stiffness that is given."""
    options = stage.gear_mesh
    given = options.sun_stiffness if slot == "sun" else options.ring_stiffness
    return options.model == "constant" and given is not None
