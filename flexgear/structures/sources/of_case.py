"""Sources of the FE bodies of a stage: the only place here that reads a case."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import numpy as np

from flexgear.gears.geometry import stage_geometry
from flexgear.gears.tool import plain_tool
from flexgear.gears.tooth import reference_radius
from flexgear.model.bodies import Carrier
from flexgear.model.member import Gear
from flexgear.model.names import BodyName
from flexgear.model.stage_view import StageView
from flexgear.structures.fe_mesh.carrier import SAME_ANGLE, CarrierFeMeshParameters
from flexgear.structures.fe_mesh.gears import BLOCK, PlanetFeMeshParameters, RingFeMeshParameters
from flexgear.structures.fe_mesh.tooth_segment import SegmentParameters
from flexgear.structures.sources.carrier import CarrierSource
from flexgear.structures.sources.fe_body import FeBody
from flexgear.structures.sources.gears import PlanetSource, RingSource


def fe_sources(view: StageView) -> dict[BodyName, FeBody]:
    """All FE bodies of a stage."""
    makers = {"ring": ring_source, "planet": planet_source, "carrier": carrier_source}
    return {name: makers[name.part](view) for name in view.fe_bodies}


def ring_source(view: StageView) -> RingSource:
    """Source of the FE ring of a stage."""
    return RingSource(
        parameters=_ring_fe_mesh(view),
        reference_radius=reference_radius(view.ring_gear.teeth, view.stage),
        half_offset=view.stage.half_offset if view.stage.double_helical else None,
        segment=_shaped_segment(view),
        along_face=view.gear_mesh.model == "face_load",
        **_common(view, "ring"),
    )


def planet_source(view: StageView) -> PlanetSource:
    """Source of the FE body of the planets of a stage, which are equal."""
    gear = view.stage.planet
    assert gear is not None
    return PlanetSource(
        parameters=PlanetFeMeshParameters(bore_diameter=gear.bore_diameter, **_teeth(view, gear)),
        reference_radius=reference_radius(gear.teeth, view.stage),
        bearing=view.stage.planet_bearing,
        **_common(view, "planet"),
    )


def carrier_source(view: StageView) -> CarrierSource:
    """Source of the FE carrier of a stage."""
    teeth = view.ring_gear.teeth
    return CarrierSource(
        parameters=_carrier_fe_mesh(view),
        pin_angles=view.stage.planet_angles,
        pitch=2.0 * np.pi * reference_radius(teeth, view.stage) / teeth,
        bearings=view.stage.seat_bearings,
        **_common(view, "carrier"),
    )


def _shaped_segment(view: StageView) -> SegmentParameters | None:
    """Segment of a ring's teeth with shapes along the face; None unless slices have FE influence,
    the ring is tied at its roots by averaging ties, and is not given reduced."""
    ring, gear_mesh = view.ring, view.gear_mesh
    bent = (
        gear_mesh.model == "face_load"
        and gear_mesh.tooth_compliance == "fe"
        and view.fe_tie("ring") == "root"
    )
    shaped = ring.tie_kind == "averaging" and ring.tooth_shapes != "none"
    if not bent or not shaped or ring.fe_mesh == "reduced":
        return None
    # half of the package
    from flexgear.structures.tooth_influence.of_case import influence_parameters

    return influence_parameters(view, "ring")


def _common(view: StageView, part: str) -> dict[str, Any]:
    """Parameters that sources of all bodies have."""
    key = BodyName.of(view.name, part)
    return {
        "key": key,
        "section": view.fe_bodies[key],
        "material": view.material,
        "cyclic": view.case.solver.cyclic == "auto",
        "limit_hz": view.case.solver.reduction_limit,
    }


def _teeth(view: StageView, gear: Gear) -> dict[str, Any]:
    """Parameters that FE meshes of ring and planets have in common."""
    stage = view.stage
    return {
        "teeth": gear.teeth,
        "normal_module": stage.normal_module,
        "pressure_angle": stage.pressure_angle,
        "helix_angle": stage.helix_angle,
        "hand": stage.planet_hand,
        "profile_shift": gear.profile_shift,
        "addendum": gear.addendum,
        "dedendum": gear.dedendum,
        "root_fillet": gear.root_fillet,
        "tool": plain_tool(gear.tool),
        "face_width": stage.face_width,
        "fidelity": view.case.solver.fidelity,
        "where": view.case.source,
    }


def _ring_fe_mesh(view: StageView) -> RingFeMeshParameters:
    """The ring of a case, with its teeth and supports.

    Of several bolt circles the FE mesh follows the one with holes, else the innermost.
    """
    ring = view.ring
    circles = sorted(
        (c for c in ring.bolt_circles if c.number),
        key=lambda c: (not c.holes, c.circle_diameter - BLOCK * c.diameter),
    )
    bolts: dict[str, Any] = {"bolts": 0}
    if circles:
        bolts = {
            "bolts": circles[0].number,
            "bolt_circle_diameter": circles[0].circle_diameter,
            "bolt_diameter": circles[0].diameter,
            "bolt_holes": circles[0].holes,
            "first_bolt_angle": circles[0].first_angle,
            "first_bolt": ring.first_bolt(circles[0]),
        }
    return RingFeMeshParameters(
        rim_thickness=ring.rim_thickness,
        fits=tuple(fit.band for fit in ring.fits),
        splines=tuple(spline.band for spline in ring.splines),
        other_bolts=tuple((c.number, c.circle_diameter, c.diameter) for c in circles[1:]),
        **bolts,
        **_teeth(view, view.ring_gear),
    )


def _carrier_fe_mesh(view: StageView) -> CarrierFeMeshParameters:
    """The carrier of a case, with a pin for each planet."""
    stage, carrier = view.stage, view.carrier
    same = {field.name for field in fields(CarrierFeMeshParameters)}
    equal = 2.0 * np.pi * np.arange(stage.planets) / stage.planets
    unequal = not np.allclose(stage.planet_angles, equal, rtol=0.0, atol=SAME_ANGLE)
    gears = stage_geometry(view)
    return CarrierFeMeshParameters(
        planets=stage.planets,
        planet_angles=stage.planet_angles if unequal else None,
        center_distance=gears.center_distance,
        planet_tip_radius=gears.planet.tip_radius,
        gear_face_width=stage.gear_width,
        seat_drive_diameter=carrier.seat_drive.diameter,
        seat_drive_width=carrier.seat_drive.width,
        seat_far_diameter=carrier.seat_far.diameter,
        seat_far_width=carrier.seat_far.width,
        fidelity=view.case.solver.fidelity,
        where=view.case.source,
        **{name: getattr(carrier, name) for name in same & Carrier.model_fields.keys()},
    )
