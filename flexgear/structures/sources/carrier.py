"""A planet carrier between two bearings, driven at a flange.

Nodes, in order: drive, bearing_drive, bearing_far on the axis at the middle of their patches,
pin_1.. on the pins' axes at mid-face.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any

import numpy as np

from flexgear.gears.geometry import stage_geometry
from flexgear.gears.tooth import reference_radius
from flexgear.model.bearings import Bearing
from flexgear.model.bodies import Carrier
from flexgear.model.names import NodeName
from flexgear.model.stage_view import StageView
from flexgear.structures.bodies import Spring
from flexgear.structures.fe_mesh.carrier import SAME_ANGLE, CarrierFeMeshParameters
from flexgear.structures.fe_mesh.carrier_mesh import carrier_fe_mesh
from flexgear.structures.fe_mesh.fe_mesh import FeMesh
from flexgear.structures.fe_mesh.groups import Groups, carrier_groups
from flexgear.structures.fe_mesh.solids import carrier_solid
from flexgear.structures.sources.fe_body import FeBody, TiedNode
from flexgear.structures.sources.of_case import common_parameters

if TYPE_CHECKING:
    from flexgear.structures.estimate import ProbeLoad
    from flexgear.structures.fem.assembly import FeModel

SEATS = ("drive", "bearing_drive", "bearing_far")


@dataclass(frozen=True, eq=False)
class CarrierSource(FeBody):
    """A carrier as an FE body. pin_angles: (N,) rad; pitch: of the ring's teeth, m, which
    determines tolerances of positions; bearings: on the seats "drive" and "far"."""

    meshed = staticmethod(carrier_fe_mesh)
    as_solid = staticmethod(carrier_solid)
    turning = "drive"

    section: Carrier
    parameters: CarrierFeMeshParameters
    pin_angles: tuple[float, ...]
    pitch: float
    bearings: Mapping[str, Bearing]

    @property
    def groups(self) -> Groups:
        """Drive flange, bearing seats and pins."""
        return carrier_groups(self.parameters, np.array(self.pin_angles), self.pitch)

    @property
    def repeats(self) -> int:
        """Number of its pins."""
        return len(self.pin_angles)

    @property
    def ties(self) -> tuple[str, str]:
        """Tied surface and kind of tie of the pins."""
        return "surface", "seats of pins"

    def nodes(self, fe_mesh: FeMesh | None = None) -> list[TiedNode]:
        """Nodes of drive flange, bearing seats and pins.

        Pins have seat ties for planet bearings. Carrier bearings are narrow for their diameter and
        also act on shoulders, so their nodes have averaging ties.
        """
        heights = self.parameters.seat_heights
        if fe_mesh is not None:
            heights = {name: float(fe_mesh.centre(name)[2]) for name in SEATS}
        nodes = [
            TiedNode(NodeName.parse(name), np.array([0.0, 0.0, z]), "averaging", name)
            for name, z in heights.items()
        ]
        for i, angle in enumerate(self.pin_angles):
            name = NodeName.of("pin", i + 1)
            place = self.parameters.center_distance * np.array([np.cos(angle), np.sin(angle), 0.0])
            nodes.append(TiedNode(name, place, "seat", name))
        return nodes

    @property
    def springs(self) -> list[Spring]:
        """Springs of its bearings."""
        return [
            Spring(NodeName.parse(f"bearing_{side}"), np.asarray(bearing.matrix))
            for side, bearing in self.bearings.items()
        ]

    def probe_loads(self, model: FeModel) -> Sequence[ProbeLoad]:
        """Pressure on the seats of all pins."""
        from flexgear.structures.estimate import pin_pressures

        return pin_pressures(model, len(self.pin_angles), np.asarray(self.pin_angles))

    def _content(self) -> Mapping[str, Any]:
        return {
            "ties": "seats of pins",
            "pins": [list(self.pin_angles), self.parameters.center_distance],
        }


def source(view: StageView) -> CarrierSource:
    """Source of the FE carrier of a stage."""
    teeth = view.ring_gear.teeth
    return CarrierSource(
        parameters=_carrier_fe_mesh(view),
        pin_angles=view.stage.planet_angles,
        pitch=2.0 * np.pi * reference_radius(teeth, view.stage) / teeth,
        bearings=view.stage.seat_bearings,
        **common_parameters(view, "carrier"),
    )


def _carrier_fe_mesh(view: StageView) -> CarrierFeMeshParameters:
    """Parameters of the FE mesh of a case's carrier, with a pin for each planet."""
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
