"""Reading of REXS files: .rexs (XML), .rexsj (JSON), and .rexsz (zip of either).

The format is detected from the content. XML is parsed by the standard library's expat; document
types are refused, so that no entity is expanded and no other file is read. XML elements are
converted to the data of a .rexsj file, which are then interpreted. Arrays may be little-endian
numbers in base64.
"""

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
from flexgear.model.input_file import DAMAGED, MAX_REXS_BYTES, read_bytes

_MODEL = ("version", "applicationId", "applicationVersion", "applicationLanguage", "date",
          "relations", "components", "load_spectrum", "accumulation")  # fmt: skip
_LISTS = {"relation": "relations", "ref": "refs", "component": "components",
          "attribute": "attributes", "load_spectrum": "load_spectrum", "load_case": "load_cases",
          "accumulation": "accumulation"}  # fmt: skip
_TYPES = {"int32": "<i4", "float32": "<f4", "float64": "<f8"}


class _Reader:
    """Converts the data of a .rexsj file to a document. Raises InputError for data of a wrong type
    and for ids that are not integers or not unique."""

    def __init__(self, where: str) -> None:
        self.where = where
        self.other: list[str] = []

    def document(self, model: Any) -> Document:
        """The document; InputError if the data are no REXS model."""
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
            number = self._integer(spectrum.get("id", 1), "load_spectrum id")
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
                self._integer(part.get("id"), "component id"),
                str(part.get("type", "")),
                str(part.get("name", "") or ""),
                {a.id: a for a in attributes},
            )
            if component.id in components:
                remedy = f"give {component.label} a unique id"
                raise InputError(self.where, "component id", f"{component.id} occurs twice", remedy)
            components[component.id] = component
        if not components:
            raise InputError(self.where, "components", "there are none", "is the file complete?")
        return components

    def _relation(self, part: dict[str, Any], components: Container[int]) -> Relation | None:
        """The relation; None if it refers to a component that is not in the file."""
        number, kind = self._integer(part.get("id"), "relation id"), str(part.get("type", ""))
        refs: dict[str, int] = {}
        for ref in self._list(part, "refs"):
            component = self._integer(ref.get("id"), "ref id")
            refs.setdefault(str(ref.get("role", "")), component)
            if component not in components:
                missing = f"refers to component {component}, which is not in the file"
                self.other.append(f"{kind} relation {number}: {missing}")
                return None
        return Relation(number, kind, refs)

    def _load_case(
        self, case: dict[str, Any], spectrum: int, components: dict[int, Component]
    ) -> LoadCase:
        number = self._integer(case.get("id", 1), "load_case id")
        every = self._results(case, f"load case {number}")
        attributes = [(k, attribute) for k, attribute in every if k in components]
        if len(attributes) < len(every):
            self.other.append(f"load case {number}: attributes of components not in the file")
        name = " ".join(str(case.get("name", "")).split())
        return LoadCase(spectrum, number, attributes, name)

    def _accumulations(self, data: dict[str, Any]) -> None:
        """Add results that are accumulated over load cases to the list of unused content."""
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
            (self._integer(part.get("id"), "component id"), _attribute(a, load_case))
            for part in self._list(data, "components")
            for a in self._list(part, "attributes")
        ]

    def _integer(self, value: Any, key: str) -> int:
        """An id as integer; InputError if it is not an integer."""
        try:
            return int(str(value))
        except ValueError:
            problem = f"{echo(value)} is not a whole number"
            raise InputError(self.where, key, problem, "is the file complete?") from None

    def _list(self, data: dict[str, Any], key: str) -> list[dict[str, Any]]:
        """The objects under a key: a list, one object as a list, or [] if the key is missing."""
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
    """Text of a scalar, texts of an array, which may be numbers in base64; None for other types."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, (int, float, str)):
        return str(value)
    if isinstance(value, list) and not any(isinstance(x, (list, dict)) for x in value):
        return tuple(str(x) for x in value)
    if not isinstance(value, dict):
        return None if value is not None else ""
    try:
        data = base64.b64decode("".join(str(value["value"]).split()), validate=True)
        numbers = np.frombuffer(data, dtype=_TYPES[str(value["code"])])
    except (KeyError, ValueError, binascii.Error):
        return None
    return tuple(repr(number) for number in numbers.tolist())


def _data_of_xml(element: ET.Element) -> dict[str, Any]:
    """An element as the object of a .rexsj file: its attributes, and its parts in lists."""
    parts = defaultdict(list)
    for child in element:
        for part in child if child.tag in ("relations", "components") else (child,):
            data = _data_of_attribute(part) if part.tag == "attribute" else _data_of_xml(part)
            parts[_LISTS.get(part.tag, f"<{part.tag}>")].append(data)
    return {**element.attrib, **parts}


def _data_of_attribute(element: ET.Element) -> dict[str, Any]:
    value: Any = (element.text or "").strip()
    array = element.find("array") if len(element) else None
    if array is not None and array.get("code"):
        value = {"code": array.get("code"), "value": array.text or ""}
    elif array is not None:
        value = [c.text or "" for c in array.findall("c")] or (array.text or "").split()
    elif len(element):
        value = {}  # another type, such as a matrix
    return {"id": element.get("id", ""), "unit": element.get("unit", ""), "value": value}


VERSIONS = ("1.0", "1.1", "1.2", "1.3", "1.4", "1.5", "1.6", "1.7", "2.0")
_MAX_NESTING = 32  # of elements; the format has 8 levels


def read_rexs(path: str | Path) -> Document:
    """Read the model in a REXS file; InputError if the file is damaged or of an unknown version."""
    where, data = str(path), read_bytes(Path(path), "file", MAX_REXS_BYTES)
    if zipfile.is_zipfile(io.BytesIO(data)) or data.startswith(b"PK"):
        data = _unpacked(data, where)
    if len(data) > MAX_REXS_BYTES:
        problem = f"is larger than {MAX_REXS_BYTES >> 20} MB"
        raise InputError(where, "file", problem, "save it without field results")
    start = data.lstrip(b"\xef\xbb\xbf \t\r\n")[:1]
    if start == b"{":
        root = _json(data, where)
        model = root.get("model") if isinstance(root, dict) else None
    elif start == b"<" or data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        every = _data_of_xml(_xml(data, where)).items()
        model = {key: part for key, part in every if key in _MODEL or key.startswith("<")}
    else:
        problem = "is neither XML, JSON nor zip" if data else "is empty"
        raise InputError(where, "file", problem, "name a .rexs, .rexsj or .rexsz file")
    document = _Reader(where).document(model)
    match = re.fullmatch(r"\s*(\d+\.\d+)(\.\d+)*\s*", document.version)
    if match is None or match[1] not in VERSIONS:
        remedy = f"known are {', '.join(VERSIONS)}; save it as one of them"
        raise InputError(where, "version", f"{echo(document.version)} is not known", remedy)
    return document


def _unpacked(data: bytes, where: str) -> bytes:
    """The model file in a zip; other files (pictures, FE data) are ignored."""
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            names = [n for n in archive.namelist() if n.lower().endswith((".rexs", ".rexsj"))]
            if len(names) != 1:
                content = ", ".join(sorted(archive.namelist())[:3]) or "nothing"
                problem = f"holds {len(names)} models (.rexs, .rexsj), not one: {content}"
                raise InputError(where, "zip", problem, "save the model again")
            with archive.open(names[0]) as file:
                return file.read(MAX_REXS_BYTES + 1)
    except DAMAGED as error:
        raise InputError(where, "zip", f"is damaged or locked: {error}", "save it again") from None


class _Builder(ET.TreeBuilder):
    """Builder of elements that refuses document types, in which entities could be declared."""

    def __init__(self, where: str) -> None:
        super().__init__()
        self.where = where

    def doctype(self, *_: Any) -> None:
        """Raise InputError for a document type."""
        problem = "REXS files declare no document type or entities"
        raise InputError(self.where, "DOCTYPE", problem, "delete it")


def _xml(data: bytes, where: str) -> ET.Element:
    try:
        root = ET.fromstring(data, ET.XMLParser(target=_Builder(where)))
    except (ET.ParseError, LookupError, ValueError) as error:
        problem = f"cannot be read: {error}"
        raise InputError(where, "XML", problem, "is the file complete?") from None
    level = [root]
    for _ in range(_MAX_NESTING):
        level = [child for element in level for child in element]
    if level:
        problem = f"is nested in {_MAX_NESTING} elements"
        raise InputError(where, level[0].tag, problem, "is this a REXS file?")
    for element in root.iter() if root.tag[0] == "{" else ():
        element.tag = element.tag.rpartition("}")[2]
    if root.tag != "model":
        raise InputError(where, root.tag, "is the first element", "a REXS file begins with <model>")
    return root


def _json(data: bytes, where: str) -> Any:
    try:
        return json.loads(data.decode("utf-8-sig"))
    except (ValueError, RecursionError) as error:
        reason = "nested too deeply" if isinstance(error, RecursionError) else str(error)
        problem = f"cannot be read: {reason}"
        raise InputError(where, "JSON", problem, "is the file complete?") from None
