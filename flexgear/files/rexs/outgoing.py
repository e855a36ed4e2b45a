"""A REXS model to which components are added one by one, and its XML (REXS 2.0)."""

import xml.etree.ElementTree as ET
from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime

from flexgear.files.rexs.tables import SCHEMA_UNITS, from_si, without_rounding

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

    def begin_load_case(self, name: str) -> None:
        """Begin a new load case, to which ``result`` then adds attributes."""
        self.load_cases.append((name, {}))

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


def _in_units(attributes: Mapping[str, Written | None]) -> Attributes:
    """Attributes that are not None, converted from SI to the schema's units."""
    present = {key: value for key, value in attributes.items() if value is not None}
    for key, value in present.items():
        scale = from_si(SCHEMA_UNITS.get(key, "none"))
        if isinstance(value, tuple) and not key.endswith("_axis_vector"):  # a unit vector
            x, y, z = value
            present[key] = (x * scale, y * scale, z * scale)
        elif isinstance(value, float) and scale != 1.0:
            present[key] = without_rounding(value * scale)
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


def located(place: Place) -> dict[str, Written | None]:
    """REXS attributes of position and axes of a component that is parallel to the gear unit."""
    axes = {"u_axis_vector": (1.0, 0.0, 0.0), "w_axis_vector": (0.0, 0.0, 1.0)}
    return {"support_vector": place, **axes}
