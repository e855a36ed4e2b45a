"""A Document from the elements of a .rexs file."""

from __future__ import annotations

import xml.etree.ElementTree as ET

from flexgear.files.rexs.checked import Checked
from flexgear.files.rexs.coded import decoded
from flexgear.files.rexs.document import Attribute, Component, Document, LoadCase, Relation
from flexgear.model.errors import InputError, echo


def document_of_xml(root: ET.Element, where: str) -> Document:
    """The model below the root element. InputError for one that is no REXS model."""
    if root.tag != "model":
        raise InputError(where, root.tag, "is the first element", "a REXS file begins with <model>")
    checked = Checked(where)
    checked.other += [
        f"<{e.tag}>" for e in root if e.tag not in ("relations", "components", "load_spectrum")
    ]
    for element in root.findall("components/component"):
        attributes = [_attribute(a) for a in element.iter("attribute")]
        checked.component(
            Component(
                checked.whole(element.get("id"), "component id"),
                element.get("type", ""),
                element.get("name", ""),
                {a.id: a for a in attributes},
            )
        )
    for element in root.findall("relations/relation"):
        refs = [
            (ref.get("role", ""), checked.whole(ref.get("id"), "ref id"))
            for ref in element.iter("ref")
        ]
        checked.relation(
            Relation(
                checked.whole(element.get("id"), "relation id"),
                element.get("type", ""),
                checked.whole(element.get("order", "0"), "relation order"),
                tuple(refs),
            )
        )
    for spectrum in root.findall("load_spectrum"):
        number = checked.whole(spectrum.get("id", "1"), "load_spectrum id")
        for case in spectrum.findall("load_case"):
            key = checked.whole(case.get("id", "1"), "load_case id")
            checked.load_case(
                LoadCase(number, key, _attributes_of(case, f"load case {key}", checked))
            )
        for total in spectrum.findall("accumulation"):
            checked.accumulation(_attributes_of(total, "", checked))
    return checked.document(root.get("version", ""), _application(root))


def _application(root: ET.Element) -> str:
    application = (root.get("applicationId", ""), root.get("applicationVersion", ""))
    return echo(" ".join(filter(None, application)))[1:-1]


def _attributes_of(
    element: ET.Element, where: str, checked: Checked
) -> list[tuple[int, Attribute]]:
    return [
        (checked.whole(component.get("id"), "component id"), _attribute(a, where))
        for component in element.findall("component")
        for a in component.iter("attribute")
    ]


def _attribute(element: ET.Element, where: str = "") -> Attribute:
    value: str | tuple[str, ...] | None = (element.text or "").strip()
    array = element.find("array") if len(element) else None
    if array is not None:
        code = array.get("code")
        cells = [c.text or "" for c in array.findall("c")]
        value = (
            decoded(code, array.text or "") if code else tuple(cells or (array.text or "").split())
        )
    elif len(element):
        value = None
    return Attribute(element.get("id", ""), element.get("unit", ""), value, where)
