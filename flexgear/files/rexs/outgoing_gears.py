"""Gears and gear meshes of a stage as REXS components."""

from __future__ import annotations

import math

from flexgear.files.rexs.outgoing_flanks import MM, ORIENTATION, FlanksOut
from flexgear.files.rexs.writing import Outgoing, Written
from flexgear.gears.geometry import StageGeometry
from flexgear.gears.radii import gears_by_role
from flexgear.model.stage import Stage


def halves(stage: Stage) -> tuple[int, ...]:
    """−1 and +1 for the halves of a double helix, 0 for a single one."""
    return (-1, 1) if stage.double_helical else (0,)


def middle(stage: Stage, half: int) -> float:
    """Place of a half's middle from that of the stage, mm."""
    return half * MM * (stage.face_width + stage.half_gap) / 2


def hand(stage: Stage, role: str, half: int) -> float:
    """+1 for a right hand: planet and ring have the stage's hand, sun and pinion the other.

    In a parallel stage the gear has the planet's role. The right half is the mirror of the left.
    """
    sign = 1.0 if stage.planet_hand == "right" else -1.0
    sign *= -1.0 if role == "sun" else 1.0
    return -sign if half > 0 else sign


class GearsOut:
    """Adds gears of one stage to a model."""

    def __init__(
        self, model: Outgoing, stage: Stage, geometry: StageGeometry, flanks: FlanksOut
    ) -> None:
        self.model, self.stage, self.geometry, self.flanks = model, stage, geometry, flanks
        self.members = gears_by_role(stage)
        self.gears: list[tuple[str, int]] = []  # role and id of every gear
        self.meshes: list[tuple[str, int]] = []  # and of every gear mesh

    def add(self, role: str, shaft: int, start: float, name: str, place: tuple[float, float, float],
            half: int, material: int) -> int:  # fmt: skip
        """A gear on a shaft that begins ``start`` mm before the stage's middle; its id.

        place: of the gear's middle, mm.
        """
        gear, tooth = self.members[role], self.geometry.gears[role]
        ring = role == "ring"
        base = tooth.base_radius if gear.base_diameter is None else gear.base_diameter / 2
        helix = math.degrees(self.stage.helix_angle)
        blank: dict[str, Written | None] = {}
        if gear.mass is not None:
            blank["mass_of_component"] = gear.mass / (1 if ring else len(halves(self.stage)))
        if not ring and gear.bore_diameter:
            blank["inner_diameter"] = MM * gear.bore_diameter
        number = self.model.part(
            shaft,
            "ring_gear" if ring else "cylindrical_gear",
            name,
            number_of_teeth=gear.teeth,
            normal_module=MM * self.stage.normal_module,
            face_width=MM * self.stage.face_width,
            helix_angle_reference_diameter=helix * hand(self.stage, role, half) if helix else 0.0,
            tip_diameter=2 * MM * tooth.tip_radius,
            root_diameter=2 * MM * tooth.root_radius,
            base_diameter=2 * MM * base,
            reference_diameter_cylindrical_gear=2 * MM * tooth.reference_radius,
            u_coordinate_on_shaft=start + middle(self.stage, half),
            support_vector=place,
            datum_face_orientation=ORIENTATION,
            **axes(),
            **blank,
        )
        self.gears.append((role, number))
        self.model.relate("reference", origin=number, referenced=material)
        if ring and gear.rim_thickness is not None:
            rim = MM * gear.rim_thickness
            self.model.part(number, "gear_body", gear_body_rim_thickness=rim)
        self.flanks.add(number, role, half)
        return number

    def mesh(
        self, whole: int, role: str, gears: tuple[int, int], name: str, *, loaded: bool
    ) -> int:
        """A cylindrical_stage of two gears (of this role and the planet's); its id. loaded: whether
        the case has a torque."""
        geometry = self.geometry.gear_meshes[role]
        number = self.model.add(
            "cylindrical_stage",
            name,
            center_distance=MM * self.geometry.center_distance,
            common_face_width=MM * self.stage.face_width,
            minimum_normal_backlash=MM * geometry.backlash,
            maximum_normal_backlash=MM * geometry.backlash,
            radial_contact_ratio=geometry.transverse_contact_ratio,
            overlap_contact_ratio=geometry.overlap_ratio,
            total_contact_ratio=geometry.total_contact_ratio,
        )
        self.meshes.append((role, number))
        self.model.relate("assembly", assembly=whole, part=number)
        self.model.relate("stage", stage=number, gear_1=gears[0], gear_2=gears[1])
        for gear, part in zip(gears, (role, "planet"), strict=True):
            data = self.model.add(
                "cylindrical_stage_gear_data",
                operating_pressure_angle_in_the_transverse_section=math.degrees(
                    geometry.working_angle
                ),
            )
            self.model.relate("stage_gear_data", stage=number, gear=gear, stage_gear_data=data)
            if loaded:
                self.model.result(data, loaded_tooth_flank=self.flanks.loaded(part, role))
        return number


def axes() -> dict[str, Written | None]:
    """Attributes of an axis along u, with v and w those of the gear unit."""
    return {"u_axis_vector": (1.0, 0.0, 0.0), "w_axis_vector": (0.0, 0.0, 1.0)}
