"""The case from which an output file was computed, as stated in the file.

It is stated in the attributes of datasets, keys of summaries and parameters, the head of reports,
and the last line of exported FE meshes. Files without it were not written by flexgear.
"""

from __future__ import annotations

import html
import json
import os
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from flexgear.model.case import Case
from flexgear.model.errors import InputError
from flexgear.model.input_file import MAX_CASE_BYTES, MAX_DATASET_BYTES, read_text, require_regular

_REPORT = re.compile(r'<meta name="flexgear-case" content="([^"]*)">')


@dataclass(frozen=True)
class Origin:
    """The case of a result: name; source: file or bundled case, "" if unknown; result: "run" or
    "tolerance" for summaries."""

    name: str
    source: str = ""
    result: str = ""

    def same(self, other: Origin) -> bool:
        """Whether both have the same case, by name or file, and, if known, kind of result."""
        if self.result and other.result and self.result != other.result:
            return False
        if self.name == other.name:
            return True
        files = [os.path.realpath(origin.source) for origin in (self, other) if origin.source]
        return len(files) == 2 and files[0] == files[1]


def origin_of_case(case: Case, result: str = "") -> Origin:
    """Origin of results of a case."""
    return Origin(case.name, case.source, result)


def is_picture(path: Path) -> bool:
    """Whether files of this type do not state their case."""
    return path.suffix.lower() in (".png", ".svg", ".pdf", ".gif", ".csv", ".rexs")


def origin_of(path: Path) -> Origin | None:
    """Origin stated by a file; None if flexgear did not write it, or it cannot be read."""
    try:
        require_regular(path, "output", MAX_DATASET_BYTES)
        with open(path, "rb") as file:
            if file.read(4) == b"\x89HDF":
                return _of_dataset(path)
        return _READERS[path.suffix.lower()](path)
    except (InputError, OSError, RuntimeError, ValueError, KeyError, TypeError, RecursionError):
        return None


def _of_dataset(path: Path) -> Origin | None:
    import h5py  # loaded only for datasets

    with h5py.File(path) as data:
        values = {name: data.attrs[name] for name in ("title", "case", "parameters")}
    attrs = {n: v.decode() if isinstance(v, bytes) else v for n, v in values.items()}
    if not str(attrs["title"]).startswith("flexgear "):
        return None
    return Origin(str(attrs["case"]), _text(json.loads(attrs["parameters"]).get("source", "")))


def _of_json(path: Path) -> Origin | None:
    content = json.loads(read_text(path, "output", MAX_CASE_BYTES * 16))
    if "content_hash" in content:  # a summary
        return Origin(_text(content["case"]), result=_text(content.get("result", "")))
    return Origin(_text(content["name"]), _text(content["source"]))


def _of_report(path: Path) -> Origin | None:
    with open(path, encoding="utf-8", errors="replace") as file:
        match = _REPORT.search(file.read(4096))
    return Origin(html.unescape(match[1])) if match else None


def _of_fe_mesh(path: Path) -> Origin | None:
    from flexgear.structures.fe_mesh.files import fe_mesh_case  # loaded only for FE meshes

    name = fe_mesh_case(path)
    return Origin(name) if name else None


def _text(value: Any) -> str:
    if not isinstance(value, str):
        raise TypeError(value)
    return value


_READERS: dict[str, Callable[[Path], Origin | None]] = {
    ".json": _of_json,
    ".html": _of_report,
    **dict.fromkeys((".vtu", ".msh", ".inp"), _of_fe_mesh),
}
