"""From a file (.rexs XML, .rexsj JSON, .rexsz zip of either) to a Document.

Building a Document with what every reader must check: ids that are whole, once, and there.

Arrays that a file holds as base64 of little-endian numbers.

A Document from the data of a .rexsj file.

A Document from the elements of a .rexs file.

What a file is follows from its content. XML is read by the standard library's expat with document
types refused, so that no entity is ever expanded and nothing outside the file is read.
"""

from __future__ import annotations

import base64
import binascii
import io
import json
import re
import xml.etree.ElementTree as ET
import zipfile
from collections import Counter
from pathlib import Path
from typing import Any
from xml.parsers import expat

import numpy as np

from flexgear.files.packed import DAMAGED
from flexgear.files.rexs.document import Attribute, Component, Document, LoadCase, Relation
from flexgear.model.errors import InputError, echo
from flexgear.model.input_file import MOST_REXS, read_bytes


class Checked:
    """Components, relations and load cases as they are read. ``other``: what is only listed."""

    def __init__(self, where: str) -> None:
        self.where = where
        self.other: list[str] = []
        self._components: dict[int, Component] = {}
        self._relations: list[Relation] = []
        self._load_cases: list[LoadCase] = []

    def whole(self, value: Any, key: str) -> int:
        """An id. InputError for what is no whole number."""
        try:
            return int(value if isinstance(value, str) else str(value))
        except ValueError:
            raise InputError(
                self.where, key, f"{echo(value)} is not a whole number", "is the file whole?"
            ) from None

    def component(self, component: Component) -> None:
        """Take a component; its id must be new."""
        if component.id in self._components:
            raise InputError(
                self.where, "component id", f"{component.id} is there twice",
                f"give {component.label} an id of its own",
            )  # fmt: skip
        self._components[component.id] = component

    def relation(self, relation: Relation) -> None:
        """Take a relation."""
        self._relations.append(relation)

    def load_case(self, load_case: LoadCase) -> None:
        """Take a load case."""
        self._load_cases.append(load_case)

    def accumulation(self, accumulation: list[tuple[int, Attribute]]) -> None:
        """List results that are summed over load cases."""
        for number, count in Counter(number for number, _ in accumulation).items():
            names = ", ".join(sorted(a.id for k, a in accumulation if k == number))
            self.other.append(f"accumulation of component {number}: {count} attributes ({names})")

    def document(self, version: str, application: str) -> Document:
        """What was taken. InputError where nothing is, or a reference leads nowhere."""
        if not self._components:
            raise InputError(self.where, "components", "there are none", "is the file whole?")
        for relation in self._relations:
            lost = [number for _, number in relation.refs if number not in self._components]
            if lost:
                self.other.append(
                    f"{relation.kind} relation {relation.id}: refers to component {lost[0]}, which"
                    " is not in the file"
                )
        for case in self._load_cases:
            attributes = [(k, a) for k, a in case.attributes if k in self._components]
            if len(attributes) < len(case.attributes):
                self.other.append(f"load case {case.id}: attributes of components not in the file")
            case.attributes = attributes
        relations = [r for r in self._relations if all(k in self._components for _, k in r.refs)]
        return Document(
            version, application, self._components, relations, self._load_cases, self.other
        )


_TYPES = {"int32": "<i4", "float32": "<f4", "float64": "<f8"}


def decoded(code: str, text: str) -> tuple[str, ...] | None:
    """The numbers as text; None for what cannot be decoded."""
    try:
        data = base64.b64decode("".join(text.split()), validate=True)
        return tuple(repr(v) for v in np.frombuffer(data, dtype=_TYPES[code]).tolist())
    except (KeyError, ValueError, binascii.Error):
        return None


_KNOWN = ("version", "applicationId", "applicationVersion", "applicationLanguage", "date",
          "relations", "components", "load_spectrum", "accumulation")  # fmt: skip


def document_of_json(data: Any, where: str) -> Document:
    """The model of parsed JSON. InputError for what is no REXS model."""
    model = data.get("model") if isinstance(data, dict) else None
    if not isinstance(model, dict):
        raise InputError(where, "model", "is missing", 'a .rexsj file begins with {"model": {…')
    checked = Checked(where)
    checked.other += [f'"{key}"' for key in model if key not in _KNOWN]
    for part in _list(model, "components", where):
        attributes = [_json_attribute(a, where) for a in _list(part, "attributes", where)]
        checked.component(
            Component(
                checked.whole(part.get("id"), "component id"),
                str(part.get("type", "")),
                str(part.get("name", "") or ""),
                {a.id: a for a in attributes},
            )
        )
    for part in _list(model, "relations", where):
        refs = [
            (str(ref.get("role", "")), checked.whole(ref.get("id"), "ref id"))
            for ref in _list(part, "refs", where)
        ]
        checked.relation(
            Relation(
                checked.whole(part.get("id"), "relation id"),
                str(part.get("type", "")),
                checked.whole(part.get("order", 0), "relation order"),
                tuple(refs),
            )
        )
    for spectrum in _list(model, "load_spectrum", where):
        number = checked.whole(spectrum.get("id", 1), "load_spectrum id")
        for case in _list(spectrum, "load_cases", where):
            key = checked.whole(case.get("id", 1), "load_case id")
            attributes_of = _json_attributes(case, f"load case {key}", checked)
            checked.load_case(LoadCase(number, key, attributes_of))
        for total in _list(spectrum, "accumulation", where):
            checked.accumulation(_json_attributes(total, "", checked))
    for total in _list(model, "accumulation", where):
        checked.accumulation(_json_attributes(total, "", checked))
    program = (model.get("applicationId"), model.get("applicationVersion"))
    application = echo(" ".join(str(s) for s in program if s))[1:-1]
    return checked.document(str(model.get("version", "")), application)


def _list(data: dict[str, Any], key: str, where: str) -> list[dict[str, Any]]:
    """A list of objects, one object as such a list, nothing for a key that is missing."""
    listed = data.get(key)
    items = listed if isinstance(listed, list) else [] if listed is None else [listed]
    if not all(isinstance(item, dict) for item in items):
        raise InputError(where, key, "is not a list of objects", "is this a REXS file?")
    return items


def _json_attributes(
    data: dict[str, Any], text: str, checked: Checked
) -> list[tuple[int, Attribute]]:
    return [
        (checked.whole(part.get("id"), "component id"), _json_attribute(a, checked.where, text))
        for part in _list(data, "components", checked.where)
        for a in _list(part, "attributes", checked.where)
    ]


def _json_attribute(data: dict[str, Any], where: str, load_case: str = "") -> Attribute:
    values = [v for key, v in data.items() if key not in ("id", "unit")]
    return Attribute(
        str(data.get("id", "")),
        str(data.get("unit", "") or ""),
        _value(values[0] if values else ""),
        load_case,
    )


def _value(value: Any) -> str | tuple[str, ...] | None:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, (int, float, str)):
        return str(value) if isinstance(value, str) else repr(value)
    if isinstance(value, list) and not any(isinstance(x, (list, dict)) for x in value):
        return tuple(str(x) for x in value)
    if isinstance(value, dict) and {"code", "value"} <= value.keys():
        return decoded(str(value["code"]), str(value["value"]))
    return None if value is not None else ""


def document_of_xml(root: ET.Element, where: str) -> Document:
    """The model below the root element. InputError for one that is no REXS model."""
    if root.tag != "model":
        raise InputError(where, root.tag, "is the first element", "a REXS file begins with <model>")
    checked = Checked(where)
    checked.other += [
        f"<{e.tag}>" for e in root if e.tag not in ("relations", "components", "load_spectrum")
    ]
    for element in root.findall("components/component"):
        attributes = [_xml_attribute(a) for a in element.iter("attribute")]
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
                LoadCase(number, key, _xml_attributes(case, f"load case {key}", checked))
            )
        for total in spectrum.findall("accumulation"):
            checked.accumulation(_xml_attributes(total, "", checked))
    return checked.document(root.get("version", ""), _application(root))


def _application(root: ET.Element) -> str:
    application = (root.get("applicationId", ""), root.get("applicationVersion", ""))
    return echo(" ".join(filter(None, application)))[1:-1]


def _xml_attributes(
    element: ET.Element, where: str, checked: Checked
) -> list[tuple[int, Attribute]]:
    return [
        (checked.whole(component.get("id"), "component id"), _xml_attribute(a, where))
        for component in element.findall("component")
        for a in component.iter("attribute")
    ]


def _xml_attribute(element: ET.Element, where: str = "") -> Attribute:
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


VERSIONS = ("1.0", "1.1", "1.2", "1.3", "1.4", "1.5", "1.6", "1.7", "2.0")
_DEEPEST = 32  # elements inside one another; the format has 8


def read_rexs(path: str | Path) -> Document:
    """The model in a REXS file. InputError in one line for anything that is wrong with it."""
    where, data = str(path), read_bytes(Path(path), "file", MOST_REXS)
    if zipfile.is_zipfile(io.BytesIO(data)) or data.startswith(b"PK"):
        data = _unpacked(data, where)
    _require_size(data, where)
    start = data.lstrip(b"\xef\xbb\xbf \t\r\n")[:1]
    if start == b"{":
        document = document_of_json(_json(data, where), where)
    elif start == b"<" or data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        document = document_of_xml(_xml(data, where), where)
    else:
        raise InputError(
            where, "file", "is neither XML, JSON nor zip" if data else "is empty",
            "name a .rexs, .rexsj or .rexsz file",
        )  # fmt: skip
    _require_version(document.version, where)
    return document


def _require_version(version: str, where: str) -> None:
    match = re.fullmatch(r"\s*(\d+\.\d+)(\.\d+)*\s*", version)
    if match is None or match[1] not in VERSIONS:
        raise InputError(
            where, "version", f"{echo(version)} is not known",
            f"known are {', '.join(VERSIONS)}; save it as one of them",
        )  # fmt: skip


def _require_size(data: bytes, where: str) -> None:
    if len(data) > MOST_REXS:
        raise InputError(
            where, "file", f"is larger than {MOST_REXS >> 20} MB", "save it without field results"
        )


def _unpacked(data: bytes, where: str) -> bytes:
    """The model in a zip; others in it (pictures, FE data) are not looked at."""
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            names = [n for n in archive.namelist() if n.lower().endswith((".rexs", ".rexsj"))]
            if len(names) != 1:
                held = ", ".join(sorted(archive.namelist())[:3]) or "nothing"
                raise InputError(
                    where, "zip", f"holds {len(names)} models (.rexs, .rexsj), not one: {held}",
                    "save the model again",
                )  # fmt: skip
            with archive.open(names[0]) as file:
                return file.read(MOST_REXS + 1)
    except DAMAGED as error:
        raise InputError(where, "zip", f"is damaged or locked: {error}", "save it again") from None


def _xml(data: bytes, where: str) -> ET.Element:
    builder, parser = ET.TreeBuilder(), expat.ParserCreate()

    def refuse(*_: Any) -> None:
        raise InputError(
            where, "DOCTYPE", "REXS files declare no document type or entities", "take it out"
        )

    parser.buffer_text = True
    parser.StartElementHandler, parser.EndElementHandler = builder.start, builder.end
    parser.CharacterDataHandler = builder.data
    parser.StartDoctypeDeclHandler = parser.EntityDeclHandler = refuse
    try:
        parser.Parse(data, True)
        root = builder.close()
    except (expat.ExpatError, LookupError, AssertionError, ValueError) as error:
        raise InputError(where, "XML", f"cannot be read: {error}", "is the file whole?") from None
    _require_shallow(root, where)
    if ":" in root.tag:
        for element in root.iter():
            element.tag = element.tag.rpartition(":")[2]
    return root


def _require_shallow(root: ET.Element, where: str) -> None:
    level = [root]
    for _ in range(_DEEPEST):
        level = [child for element in level for child in element]
    if level:
        problem = f"lies {_DEEPEST} elements deep"
        raise InputError(where, level[0].tag, problem, "is this a REXS file?")


def _json(data: bytes, where: str) -> Any:
    try:
        return json.loads(data.decode("utf-8-sig"))
    except (ValueError, RecursionError) as error:
        reason = "lists in lists without end" if isinstance(error, RecursionError) else str(error)
        raise InputError(where, "JSON", f"cannot be read: {reason}", "is the file whole?") from None
