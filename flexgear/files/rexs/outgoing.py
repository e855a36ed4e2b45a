"""REXS components that are written: a model built up one by one (XML, REXS 2.0), gears of a stage
with flanks and tools, and gear meshes.

The datum face of every gear is that at its −z end, against its u axis.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from flexgear.files.rexs import tables as table
from flexgear.files.rexs.tables import SCHEMA_UNITS, Word, outward, si_factor, word_of
from flexgear.gears.geometry import StageGeometry
from flexgear.gears.paths import tooth_sides
from flexgear.gears.radii import gears_by_role, stage_radii
from flexgear.gears.tool import CutterTool
from flexgear.model.case import Case
from flexgear.model.modifications import FlankModifications, Relief
from flexgear.model.stage import Stage
from flexgear.model.stage_view import StageView

VERSION = "2.0"
Written = float | int | bool | str | tuple[float, float, float]
Attributes = dict[str, Written]


@dataclass
class Outgoing:
    """Components with attributes in the schema's units, which methods take in SI; relations;
    results of load cases.

    relations: (type, order, roles to ids). load_cases: of each, attributes by the component's id.
    """

    components: list[tuple[str, str, Attributes]] = field(default_factory=list)
    relations: list[tuple[str, int, dict[str, int]]] = field(default_factory=list)
    load_cases: list[dict[int, Attributes]] = field(default_factory=lambda: [{}])

    def add(self, kind: str, name: str = "", **attributes: Written | None) -> int:
        """A component; attributes that are None are left out. Returns its id."""
        self.components.append((kind, name, _in_units(attributes)))
        return len(self.components)

    def relate(self, kind: str, order: int = 0, **roles: int) -> None:
        """A relation between components; order 0 for one without."""
        self.relations.append((kind, order, roles))

    def part(self, whole: int, kind: str, name: str = "", **attributes: Written | None) -> int:
        """A component that belongs to another."""
        number = self.add(kind, name, **attributes)
        self.relate("assembly", assembly=whole, part=number)
        return number

    def side(
        self, kind: str, inner: int, outer: int, name: str = "", **attributes: Written | None
    ) -> int:
        """A bearing or coupling between two components."""
        number = self.add(kind, name, **attributes)
        self.relate("side", inner_part=inner, outer_part=outer, assembly=number)
        return number

    def result(self, number: int, **attributes: Written) -> None:
        """Attributes of a component in the last load case."""
        self.load_cases[-1].setdefault(number, {}).update(_in_units(attributes))

    def begin_load_case(self) -> None:
        """Let results that follow be those of another load case."""
        self.load_cases.append({})

    def xml(self, application: str, version: str, date: str) -> bytes:
        """The file. date: ISO 8601 with its zone."""
        root = ET.Element(
            "model",
            version=VERSION,
            applicationId=application,
            applicationVersion=version,
            date=date,
        )
        relations = ET.SubElement(root, "relations")
        for number, (kind, order, roles) in enumerate(self.relations, 1):
            head = {"id": str(number), "type": kind} | ({"order": str(order)} if order else {})
            relation = ET.SubElement(relations, "relation", head)
            for role, target in roles.items():
                hint = self.components[target - 1][0]
                ET.SubElement(relation, "ref", id=str(target), role=role, hint=hint)
        components = ET.SubElement(root, "components")
        for number, (kind, name, attributes) in enumerate(self.components, 1):
            _component(components, number, kind, name, attributes)
        if any(self.load_cases):
            spectrum = ET.SubElement(root, "load_spectrum", id="1")
            for place, results in enumerate(self.load_cases, 1):
                case = ET.SubElement(spectrum, "load_case", id=str(place))
                for number, attributes in sorted(results.items()):
                    kind, name, _ = self.components[number - 1]
                    _component(case, number, kind, name, attributes)
        ET.indent(root)
        return ET.tostring(root, encoding="utf-8", xml_declaration=True) + b"\n"


def _in_units(attributes: Mapping[str, Written | None]) -> Attributes:
    """What is there, SI numbers in the schema's units; axes are unit vectors in any."""
    present = {key: value for key, value in attributes.items() if value is not None}
    for key, value in present.items():
        scale = 1.0 / si_factor(SCHEMA_UNITS.get(key, "none"))
        if isinstance(value, tuple) and not key.endswith("_axis_vector"):
            x, y, z = value
            present[key] = (x * scale, y * scale, z * scale)
        elif isinstance(value, float) and scale != 1.0:
            present[key] = value * scale
    return present


def _component(
    parent: ET.Element, number: int, kind: str, name: str, attributes: Attributes
) -> None:
    element = ET.SubElement(parent, "component", id=str(number), type=kind, name=name)
    for key, value in attributes.items():
        unit = SCHEMA_UNITS.get(key, "none")
        attribute = ET.SubElement(element, "attribute", id=key, unit=unit)
        if isinstance(value, tuple):
            array = ET.SubElement(attribute, "array")
            for entry in value:
                ET.SubElement(array, "c").text = _text(entry)
        else:
            attribute.text = _text(value)


def _text(value: float | int | bool | str) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return value if isinstance(value, str) else repr(value)


DATUM_SIDE, ORIENTATION = -1, "negative"


def halves(stage: Stage) -> tuple[int, ...]:
    """−1 and +1 for the halves of a double helix, 0 for a single one."""
    return (-1, 1) if stage.double_helical else (0,)


def middle(stage: Stage, half: int) -> float:
    """Place of a half's middle from that of the stage, m."""
    return half * (stage.face_width + stage.half_gap) / 2


def hand(stage: Stage, role: str, half: int) -> float:
    """+1 for a right hand: planet and ring have the stage's hand, sun and pinion the other.

    In a parallel stage the gear has the planet's role. The right half is the mirror of the left.
    """
    sign = 1.0 if stage.planet_hand == "right" else -1.0
    sign *= -1.0 if role == "sun" else 1.0
    return -sign if half > 0 else sign


class GearsOut:
    """Adds gears of one stage with their flanks and tools, and its gear meshes, to a model.

    forward: whether its forces are so (``tooth_sides``). gears, meshes: role and id of each.
    """

    def __init__(
        self, model: Outgoing, view: StageView, geometry: StageGeometry, forward: bool
    ) -> None:
        self.model, self.view, self.stage, self.geometry = model, view, view.stage, geometry
        self.members = gears_by_role(view.stage)
        self.gears: list[tuple[str, int]] = []
        self.meshes: list[tuple[str, int]] = []
        self.words: dict[tuple[str, str], Word] = {
            key: word_of(side, key[0] == "ring", DATUM_SIDE)
            for key, side in tooth_sides(view.stage.kind, forward).items()
        }

    def add(self, role: str, shaft: int, start: float, name: str, place: tuple[float, float, float],
            half: int, material: int) -> int:  # fmt: skip
        """A gear on a shaft that begins ``start`` before the stage's middle; its id.

        place: of the gear's middle; m. half: −1 for the left one of a double helix.
        """
        gear, tooth = self.members[role], self.geometry.gears[role]
        ring = role == "ring"
        base = tooth.base_radius if gear.base_diameter is None else gear.base_diameter / 2
        helix = self.stage.helix_angle * hand(self.stage, role, half)
        copies = 1 if ring else len(halves(self.stage))
        number = self.model.part(
            shaft,
            "ring_gear" if ring else "cylindrical_gear",
            name,
            number_of_teeth=gear.teeth,
            normal_module=self.stage.normal_module,
            face_width=self.stage.face_width,
            helix_angle_reference_diameter=helix + 0.0,  # no −0
            tip_diameter=2 * tooth.tip_radius,
            root_diameter=2 * tooth.root_radius,
            base_diameter=2 * base,
            reference_diameter_cylindrical_gear=2 * tooth.reference_radius,
            u_coordinate_on_shaft=start + middle(self.stage, half),
            support_vector=place,
            datum_face_orientation=ORIENTATION,
            **axes(),
            mass_of_component=None if gear.mass is None else gear.mass / copies,
            inner_diameter=None if ring else gear.bore_diameter or None,
        )
        self.gears.append((role, number))
        self.model.relate("reference", origin=number, referenced=material)
        if ring and gear.rim_thickness is not None:
            self.model.part(number, "gear_body", gear_body_rim_thickness=gear.rim_thickness)
        self._flanks(number, role, half)
        return number

    def mesh(
        self, whole: int, role: str, gears: tuple[int, int], name: str, *, loaded: bool
    ) -> int:
        """A cylindrical_stage of two gears (of this role and the planet's); its id. loaded: whether
        the case has a torque."""
        geometry = self.geometry.gear_meshes[role]
        number = self.model.part(
            whole,
            "cylindrical_stage",
            name,
            center_distance=self.geometry.center_distance,
            common_face_width=self.stage.face_width,
            minimum_normal_backlash=geometry.backlash,
            maximum_normal_backlash=geometry.backlash,
            radial_contact_ratio=geometry.transverse_contact_ratio,
            overlap_contact_ratio=geometry.overlap_ratio,
            total_contact_ratio=geometry.total_contact_ratio,
        )
        self.meshes.append((role, number))
        self.model.relate("stage", stage=number, gear_1=gears[0], gear_2=gears[1])
        for gear, of in zip(gears, (role, "planet"), strict=True):
            data = self.model.add(
                "cylindrical_stage_gear_data",
                operating_pressure_angle_in_the_transverse_section=geometry.working_angle,
            )
            self.model.relate("stage_gear_data", stage=number, gear=gear, stage_gear_data=data)
            if loaded:
                part = self.view.part(of)
                flank = self.words[part, role if part == "planet" else "drive"]
                self.model.result(data, loaded_tooth_flank=flank)
        return number

    def _flanks(self, number: int, role: str, half: int) -> None:
        """Both flanks of a gear."""
        gear, part = self.members[role], self.view.part(role)
        flanks = {
            word: self.model.add(
                "cylindrical_gear_flank",
                normal_pressure_angle=self.stage.pressure_angle,
                addendum_modification_coefficient=gear.profile_shift,
            )
            for word in table.WORDS
        }
        self.model.relate("flank", gear=number, left=flanks["left"], right=flanks["right"])
        tool = self._tool(role)
        settings = self.model.add(
            "cylindrical_gear_manufacturing_settings",
            machining_allowance=gear.tool.grinding_allowance or None,
        )
        names = {word: name for (of, name), word in self.words.items() if of == part}
        for word, flank in flanks.items():
            self.model.relate(
                "manufacturing_step", 1, workpiece=flank, tool=tool, manufacturing_settings=settings
            )
            modifications = gear.modifications.of(names[word])
            for component in self._ground(modifications, outward(DATUM_SIDE, half)):
                self.model.relate("reference", origin=flank, referenced=component)

    def _tool(self, role: str) -> int:
        """The rack or cutter of a gear."""
        gear, tool = self.members[role], self.geometry.gears[role].tool
        cutter = tool if isinstance(tool, CutterTool) else None
        freed = gear.tool.protuberance > 0.0
        return self.model.add(
            "cutter_wheel_tool" if cutter else "rack_shaped_tool",
            number_of_teeth=round(cutter.teeth) if cutter else None,
            addendum_modification_coefficient=gear.tool.profile_shift if cutter else None,
            tip_diameter=2 * cutter.tip_circle if cutter else None,
            tip_corner_radius_factor_reference_profile=tool.tip_radius / self.stage.normal_module,
            protuberance_amount=gear.tool.protuberance if freed else None,
            protuberance_angle=gear.tool.protuberance_angle if freed else None,
            addendum_coefficient_reference_profile=None if cutter else gear.dedendum,
        )

    def _ground(self, modifications: FlankModifications, datum: int) -> Iterator[int]:
        """What one flank lacks; datum: +1 where z of a modification counts to the datum face. Signs
        of slopes as in ``flanks``: positive towards the tip, and towards the non-datum face."""
        for kind, (key, ends) in table.CROWNINGS.items():
            crowned = getattr(modifications, key.removesuffix("_um"))
            if crowned is not None:
                amounts = dict.fromkeys(ends, crowned)
                yield self.model.add(kind, **amounts, **{f"shape_of_{kind}": "parabolic"})
        for kind, (key, by_face) in table.SLOPES.items():
            slope = getattr(modifications, key.removesuffix("_um"))
            if slope is not None:
                reference = "facewidth" if kind == "helix_slope" else None
                yield self.model.add(
                    kind,
                    **{kind: -datum * slope if by_face else slope},
                    helix_evaluation_reference=reference,
                )
        for kind in table.RELIEFS:
            relief: Relief | None = getattr(modifications, kind)
            if relief is not None:
                sizes: dict[str, Written | None] = {
                    f"{kind}_depth": relief.amount,
                    f"{kind}_datum_length": relief.length,
                    f"{kind}_datum_diameter": relief.start_diameter,
                }
                yield self.model.add(kind, "", shape_of_relief=relief.form, **sizes)
        end = modifications.end_relief
        for face, side in zip(table.FACES, (datum, -datum), strict=True):
            if end is not None and end.end in ("both", "+z" if side > 0 else "-z"):
                sizes = {
                    f"{table.END_RELIEF}_depth_{face}": end.amount,
                    f"{table.END_RELIEF}_length_{face}": end.length,
                }
                yield self.model.add(
                    f"{table.END_RELIEF}_{face}", "", shape_of_relief=end.form, **sizes
                )


def axes() -> dict[str, Written | None]:
    """Attributes of an axis along u, with v and w those of the gear unit."""
    return {"u_axis_vector": (1.0, 0.0, 0.0), "w_axis_vector": (0.0, 0.0, 1.0)}


def places(case: Case) -> dict[str, tuple[float, float, float]]:
    """Place of every member (u, v, w in m): stages side by side along u, joined ones coaxial."""
    across: dict[str, tuple[float, float]] = {}
    offset: dict[tuple[str, str], tuple[float, float]] = {}
    for stage in case.stages:
        first = f"{stage.name}.{stage.members[0]}"
        radii = stage_radii(case.view(stage.name))
        arm, angle = radii.center_distance, stage.position
        for part in stage.members[1:]:
            apart = (0.0, 0.0)
            if stage.kind == "parallel":
                apart = (arm * math.cos(angle), arm * math.sin(angle))
            offset[first, f"{stage.name}.{part}"] = apart
    offset |= {(j.first, j.second): (0.0, 0.0) for j in case.joints}
    for start in case.member_names():
        waiting: list[str] = [] if start in across else [start]
        across.setdefault(start, (0.0, 0.0))
        while waiting:
            here = waiting.pop()
            v, w = across[here]
            for (a, b), (dv, dw) in offset.items():
                for end, other, sign in ((a, b, 1.0), (b, a, -1.0)):
                    if end == here and other not in across:
                        across[other] = (v + sign * dv, w + sign * dw)
                        waiting.append(other)
    placed, u = {}, 0.0
    for stage in case.stages:
        width = stage.gear_width
        for part in stage.members:
            name = f"{stage.name}.{part}"
            placed[name] = (u + width / 2, *across[name])
        u += 2 * width
    return placed
