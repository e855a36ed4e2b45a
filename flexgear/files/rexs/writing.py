"""A model that is built up component by component and written as a .rexs file (XML, REXS 2.0)."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import dataclass, field

from flexgear.files.rexs.units import SCHEMA_UNITS

VERSION = "2.0"
Written = float | int | bool | str | tuple[float, float, float]
Attributes = dict[str, Written]


@dataclass
class Outgoing:
    """Components with attributes in the schema's units; relations; results of one load case.

    relations: (type, order, roles to ids). load_case: attributes by the component's id.
    """

    components: list[tuple[str, str, Attributes]] = field(default_factory=list)
    relations: list[tuple[str, int, dict[str, int]]] = field(default_factory=list)
    load_case: dict[int, Attributes] = field(default_factory=dict)

    def add(self, kind: str, name: str = "", **attributes: Written | None) -> int:
        """A component; attributes that are None are left out. Returns its id."""
        present = {key: value for key, value in attributes.items() if value is not None}
        self.components.append((kind, name, present))
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
        """Attributes of a component under load."""
        self.load_case.setdefault(number, {}).update(attributes)

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
        if self.load_case:
            spectrum = ET.SubElement(root, "load_spectrum", id="1")
            case = ET.SubElement(spectrum, "load_case", id="1")
            for number, attributes in sorted(self.load_case.items()):
                kind, name, _ = self.components[number - 1]
                _component(case, number, kind, name, attributes)
        ET.indent(root)
        return ET.tostring(root, encoding="utf-8", xml_declaration=True) + b"\n"


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
