"""From a file (.rexs XML, .rexsj JSON, .rexsz zip of either) to a Document.

What a file is follows from its content. XML is read by the standard library's expat with document
types refused, so that no entity is ever expanded and nothing outside the file is read; its elements
become the data of a .rexsj file, which are read then. Arrays may be base64 of little-endian
numbers.
"""

from __future__ import annotations

import base64
import binascii
import io
import json
import re
import xml.etree.ElementTree as ET
import zipfile
from collections import defaultdict
from collections.abc import Container
from pathlib import Path
from typing import Any

import numpy as np

from flexgear.files.rexs.document import Attribute, Component, Document, LoadCase, Relation
from flexgear.model.errors import InputError, echo
from flexgear.model.input_file import DAMAGED, MOST_REXS, read_bytes

_MODEL = ("version", "applicationId", "applicationVersion", "applicationLanguage", "date",
          "relations", "components", "load_spectrum", "accumulation")  # fmt: skip
_TYPES = {"int32": "<i4", "float32": "<f4", "float64": "<f8"}


class _Reader:
    """Reads a model as the data of a .rexsj file, with what every reader must check: objects that
    are some, ids that are whole, once, and there."""

    def __init__(self, where: str) -> None:
        self.where = where
        self.other: list[str] = []

    def document(self, model: Any) -> Document:
        """The document; InputError where it is no REXS model."""
        if not isinstance(model, dict):
            problem, remedy = "is missing", 'a .rexsj file begins with {"model": {…'
            raise InputError(self.where, "model", problem, remedy)
        unread = (key for key in model if key not in _MODEL)
        self.other += [key if key.startswith("<") else f'"{key}"' for key in unread]
        components = self._components(model)
        every = [self._relation(part, components) for part in self._list(model, "relations")]
        relations = [relation for relation in every if relation is not None]
        load_cases = []
        for spectrum in self._list(model, "load_spectrum"):
            number = self._whole(spectrum.get("id", 1), "load_spectrum id")
            for case in self._list(spectrum, "load_cases"):
                load_cases.append(self._load_case(case, number, components))
            self._accumulations(spectrum)
        self._accumulations(model)
        program = (model.get("applicationId"), model.get("applicationVersion"))
        application = echo(" ".join(str(s) for s in program if s))[1:-1]
        version = str(model.get("version", ""))
        return Document(version, application, components, relations, load_cases, self.other)

    def _components(self, model: dict[str, Any]) -> dict[int, Component]:
        components: dict[int, Component] = {}
        for part in self._list(model, "components"):
            attributes = [_attribute(a) for a in self._list(part, "attributes")]
            component = Component(
                self._whole(part.get("id"), "component id"),
                str(part.get("type", "")),
                str(part.get("name", "") or ""),
                {a.id: a for a in attributes},
            )
            if component.id in components:
                raise InputError(
                    self.where, "component id", f"{component.id} is there twice",
                    f"give {component.label} an id of its own",
                )  # fmt: skip
            components[component.id] = component
        if not components:
            raise InputError(self.where, "components", "there are none", "is the file whole?")
        return components

    def _relation(self, part: dict[str, Any], components: Container[int]) -> Relation | None:
        """The relation; None for one that refers to a component that is not in the file."""
        number, kind = self._whole(part.get("id"), "relation id"), str(part.get("type", ""))
        refs: dict[str, int] = {}
        for ref in self._list(part, "refs"):
            component = self._whole(ref.get("id"), "ref id")
            refs.setdefault(str(ref.get("role", "")), component)
            if component not in components:
                missing = f"refers to component {component}, which is not in the file"
                self.other.append(f"{kind} relation {number}: {missing}")
                return None
        return Relation(number, kind, refs)

    def _load_case(
        self, case: dict[str, Any], spectrum: int, components: dict[int, Component]
    ) -> LoadCase:
        number = self._whole(case.get("id", 1), "load_case id")
        every = self._results(case, f"load case {number}")
        attributes = [(k, attribute) for k, attribute in every if k in components]
        if len(attributes) < len(every):
            self.other.append(f"load case {number}: attributes of components not in the file")
        return LoadCase(spectrum, number, attributes)

    def _accumulations(self, data: dict[str, Any]) -> None:
        """List results that are summed over load cases."""
        for total in self._list(data, "accumulation"):
            names = defaultdict(list)
            for number, attribute in self._results(total):
                names[number].append(attribute.id)
            for number, ids in names.items():
                self.other.append(
                    f"accumulation of component {number}: {len(ids)} attributes"
                    f" ({', '.join(sorted(ids))})"
                )

    def _results(self, data: dict[str, Any], load_case: str = "") -> list[tuple[int, Attribute]]:
        """Attributes with the ids of their components."""
        return [
            (self._whole(part.get("id"), "component id"), _attribute(a, load_case))
            for part in self._list(data, "components")
            for a in self._list(part, "attributes")
        ]

    def _whole(self, value: Any, key: str) -> int:
        """An id as integer; InputError where it is none."""
        try:
            return int(str(value))
        except ValueError:
            raise InputError(
                self.where, key, f"{echo(value)} is not a whole number", "is the file whole?"
            ) from None

    def _list(self, data: dict[str, Any], key: str) -> list[dict[str, Any]]:
        """A list of objects, one object as such a list, nothing for a key that is missing."""
        listed = data.get(key)
        items = listed if isinstance(listed, list) else [] if listed is None else [listed]
        if not all(isinstance(item, dict) for item in items):
            raise InputError(self.where, key, "is not a list of objects", "is this a REXS file?")
        return items


def _attribute(data: dict[str, Any], load_case: str = "") -> Attribute:
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
        return _decoded(str(value["code"]), str(value["value"]))
    return None if value is not None else ""


def _decoded(code: str, text: str) -> tuple[str, ...] | None:
    """The numbers of base64 as text; None for what cannot be decoded."""
    try:
        data = base64.b64decode("".join(text.split()), validate=True)
        return tuple(repr(v) for v in np.frombuffer(data, dtype=_TYPES[code]).tolist())
    except (KeyError, ValueError, binascii.Error):
        return None


def _data_of_xml(root: ET.Element, where: str) -> dict[str, Any]:
    """The root element in the form of a .rexsj file's "model"."""
    if root.tag != "model":
        raise InputError(where, root.tag, "is the first element", "a REXS file begins with <model>")
    spectra = [
        {
            **spectrum.attrib,
            "load_cases": [_with_components(e) for e in spectrum.findall("load_case")],
            "accumulation": [_with_components(e) for e in spectrum.findall("accumulation")],
        }
        for spectrum in root.findall("load_spectrum")
    ]
    relations = [
        {**relation.attrib, "refs": [ref.attrib for ref in relation.iter("ref")]}
        for relation in root.findall("relations/relation")
    ]
    return {
        **{f"<{e.tag}>": None for e in root if e.tag not in _MODEL},
        **{key: value for key, value in root.attrib.items() if key in _MODEL},
        "components": _components_of(root.findall("components/component")),
        "relations": relations,
        "load_spectrum": spectra,
    }


def _with_components(element: ET.Element) -> dict[str, Any]:
    return {**element.attrib, "components": _components_of(element.findall("component"))}


def _components_of(elements: list[ET.Element]) -> list[dict[str, Any]]:
    return [
        {**e.attrib, "attributes": [_data_of_attribute(a) for a in e.iter("attribute")]}
        for e in elements
    ]


def _data_of_attribute(element: ET.Element) -> dict[str, Any]:
    value: Any = (element.text or "").strip()
    array = element.find("array") if len(element) else None
    if array is not None and array.get("code"):
        value = {"code": array.get("code"), "value": array.text or ""}
    elif array is not None:
        value = [c.text or "" for c in array.findall("c")] or (array.text or "").split()
    elif len(element):
        value = {}  # a matrix or the like
    return {"id": element.get("id", ""), "unit": element.get("unit", ""), "value": value}


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
        root = _json(data, where)
        model = root.get("model") if isinstance(root, dict) else None
    elif start == b"<" or data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        model = _data_of_xml(_xml(data, where), where)
    else:
        raise InputError(
            where, "file", "is neither XML, JSON nor zip" if data else "is empty",
            "name a .rexs, .rexsj or .rexsz file",
        )  # fmt: skip
    document = _Reader(where).document(model)
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
    """The model in a zip; other files in it (pictures, FE data) are ignored."""
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


class _Builder(ET.TreeBuilder):
    """Elements of a file without a document type, in which alone entities can be declared."""

    def __init__(self, where: str) -> None:
        super().__init__()
        self.where = where

    def doctype(self, *_: Any) -> None:
        """Refuse a document type. Raises InputError."""
        problem = "REXS files declare no document type or entities"
        raise InputError(self.where, "DOCTYPE", problem, "take it out")


def _xml(data: bytes, where: str) -> ET.Element:
    try:
        root = ET.fromstring(data, ET.XMLParser(target=_Builder(where)))
    except (ET.ParseError, LookupError, ValueError) as error:
        raise InputError(where, "XML", f"cannot be read: {error}", "is the file whole?") from None
    _require_shallow(root, where)
    for element in root.iter() if root.tag[0] == "{" else ():
        element.tag = element.tag.rpartition("}")[2]
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
