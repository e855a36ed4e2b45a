"""A REXS model to which components are added one by one, its XML (REXS 2.0), and a train as such a
model, with the ids of its shafts, materials and results by member."""

import xml.etree.ElementTree as ET
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import Any

from flexgear.files.rexs import tables as table
from flexgear.gears.power_flow import PowerFlow
from flexgear.gears.rating.steels import allowable_stress
from flexgear.model.case import Case
from flexgear.model.names import GroupName
from flexgear.model.rating import GearRating
from flexgear.model.section import Refusal

VERSION = "2.0"
Place = tuple[float, float, float]  # u, v, w; m
Written = float | int | bool | str | Place
Attributes = dict[str, Written]


@dataclass
class Outgoing:
    """Components, relations and load cases of a REXS model.

    Methods take attributes in SI and store them in the schema's units. components: type, name,
    attributes. relations: type, order, ids by role. load_cases: name, attributes by component id.
    """

    components: list[tuple[str, str, Attributes]] = field(default_factory=list)
    relations: list[tuple[str, int, dict[str, int]]] = field(default_factory=list)
    load_cases: list[tuple[str, dict[int, Attributes]]] = field(default_factory=lambda: [("", {})])

    def add(self, kind: str, name: str = "", **attributes: Written | None) -> int:
        """Add a component, without attributes that are None; returns its id."""
        self.components.append((kind, name, _in_units(attributes)))
        return len(self.components)

    def relate(self, kind: str, order: int = 0, **roles: int) -> None:
        """Add a relation between components; order 0 for a relation without order."""
        self.relations.append((kind, order, roles))

    def part(self, whole: int, kind: str, name: str = "", **attributes: Written | None) -> int:
        """Add a component that belongs to another; returns its id."""
        number = self.add(kind, name, **attributes)
        self.relate("assembly", assembly=whole, part=number)
        return number

    def side(
        self, kind: str, inner: int, outer: int, name: str = "", **attributes: Written | None
    ) -> int:
        """Add a bearing or coupling between two components; returns its id."""
        number = self.add(kind, name, **attributes)
        self.relate("side", inner_part=inner, outer_part=outer, assembly=number)
        return number

    def result(self, number: int, **attributes: Written) -> None:
        """Add attributes of a component to the last load case."""
        self.load_cases[-1][1].setdefault(number, {}).update(_in_units(attributes))

    def xml(self, version: str) -> bytes:
        """The model as XML with the present date. version: of flexgear."""
        root = ET.Element(
            "model",
            version=VERSION,
            applicationId="flexgear",
            applicationVersion=version,
            date=datetime.now(UTC).isoformat(timespec="seconds"),
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
        if any(results for _, results in self.load_cases):
            spectrum = ET.SubElement(root, "load_spectrum", id="1")
            for place, (name, results) in enumerate(self.load_cases, 1):
                head = {"id": str(place)} | ({"name": name} if name else {})
                case = ET.SubElement(spectrum, "load_case", head)
                for number, attributes in sorted(results.items()):
                    kind, name, _ = self.components[number - 1]
                    _component(case, number, kind, name, attributes)
        ET.indent(root)
        return ET.tostring(root, encoding="utf-8", xml_declaration=True) + b"\n"


@dataclass(kw_only=True)
class TrainOut(Outgoing):
    """The REXS model of a train, with the ids of its components.

    places: positions of members. unit, casing: ids. shafts, begins: id of the shaft of a member or
    planet, and where it begins along u, m. materials: ids by their attributes.
    ends: ids of the shafts behind the splines of suns, at which ports and joints act. gear_data:
    ids by gear meshes of one half and gear, "" for theirs. bearings: ids by bearing.
    """

    case: Case
    flow: PowerFlow
    places: dict[str, Place]
    unit: int = 0
    casing: int = 0
    shafts: dict[str, int] = field(default_factory=dict)
    begins: dict[str, float] = field(default_factory=dict)
    ends: dict[str, int] = field(default_factory=dict)
    gear_data: dict[tuple[GroupName, str], list[int]] = field(default_factory=dict)
    bearings: dict[str, list[int]] = field(default_factory=dict)
    materials: dict[tuple[tuple[str, Any], ...], int] = field(default_factory=dict)

    def material(self, rating: GearRating) -> int:
        """Id of the material of a gear, which gears of the same steel share. Strengths that the
        case leaves to steel, grade and hardness are written as ISO 6336-5 has them."""
        steel = table.STEELS.get((rating.steel or "").removesuffix("_carbon"))
        attributes = {
            **table.written(self.case.material, table.MATERIAL),
            **table.written(rating, table.GEAR_STRENGTH),
            **({table.STEEL[0]: steel} if steel else {}),
        }
        for place, row in zip(("flank", "root"), table.GEAR_STRENGTH, strict=False):
            with suppress(Refusal):  # of a hardness that the standard has no strength for
                strength = allowable_stress(rating, place)
                attributes |= {} if strength is None else {row.names[0]: strength}
        key = tuple(attributes.items())
        if key not in self.materials:
            self.materials[key] = self.add("material", rating.steel or "steel", **attributes)
        return self.materials[key]

    def shaft(self, member: str, place: Place, whole: int) -> int:
        """Write a REXS shaft of a member or planet, which begins at ``place``; returns the id of
        this component."""
        port = self.case.port_at(member)
        defines = None if port is None else port.speed is not None
        number = self.part(whole, "shaft", member, **located(place), defines_speed=defines)
        self.shafts[member], self.begins[member] = number, place[0]
        return number

    def end(self, member: str) -> int:
        """Id of the shaft of a member at which ports and joints act."""
        return self.ends.get(member, self.shafts[member])


def _in_units(attributes: Mapping[str, Written | None]) -> Attributes:
    """Attributes that are not None, converted from SI to the schema's units."""
    present = {key: value for key, value in attributes.items() if value is not None}
    for key, value in present.items():
        scale = table.from_si(table.SCHEMA_UNITS.get(key, "none"))
        if isinstance(value, tuple) and not key.endswith("_axis_vector"):  # a unit vector
            x, y, z = value
            present[key] = (x * scale, y * scale, z * scale)
        elif isinstance(value, float) and scale != 1.0:
            present[key] = table.without_rounding(value * scale)
    return present


def _component(
    parent: ET.Element, number: int, kind: str, name: str, attributes: Attributes
) -> None:
    element = ET.SubElement(parent, "component", id=str(number), type=kind, name=name)
    for key, value in attributes.items():
        unit = table.SCHEMA_UNITS.get(key, "none")
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


def located(place: Place) -> dict[str, Written | None]:
    """REXS attributes of position and axes of a component that is parallel to the gear unit."""
    axes = {"u_axis_vector": (1.0, 0.0, 0.0), "w_axis_vector": (0.0, 0.0, 1.0)}
    return {"support_vector": place, **axes}
