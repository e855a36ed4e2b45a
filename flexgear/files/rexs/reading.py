"""From a file (.rexs XML, .rexsj JSON, .rexsz zip of either) to a Document.

What a file is follows from its content. XML is read by the standard library's expat with document
types refused, so that no entity is ever expanded and nothing outside the file is read.
"""

from __future__ import annotations

import io
import json
import re
import xml.etree.ElementTree as ET
import zipfile
from pathlib import Path
from typing import Any
from xml.parsers import expat

from flexgear.files.packed import DAMAGED
from flexgear.files.rexs.document import Document
from flexgear.files.rexs.json_model import document_of_json
from flexgear.files.rexs.xml_model import document_of_xml
from flexgear.model.errors import InputError, echo
from flexgear.model.input_file import MOST_REXS, read_bytes

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
