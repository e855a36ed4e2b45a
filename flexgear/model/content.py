"""Paths and digests of the files that a case names; hashes of its content."""

import hashlib
import json
import os
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Any

from flexgear.model.bodies import FE_MESH_FILES
from flexgear.model.errors import InputError
from flexgear.model.input_file import MAX_FE_MESH_BYTES, require_regular
from flexgear.model.load_cases import files_named
from flexgear.model.machine import Followed, read_load_series, read_time_series
from flexgear.model.modifications import read_flank_table

_FILES = {"file", "files", *FE_MESH_FILES}  # keys that name files, in all sections


def content_hash(data: Any) -> str:
    """SHA-256 of plain data with numbers rounded to 12 digits, 64 hex digits."""
    text = json.dumps(_canonical(data), sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()


def file_digest(path: str | None) -> str | None:
    """SHA-256 of a file's content, 64 hex digits; "missing:NAME" if the file cannot be read."""
    if path is None:
        return None
    try:
        require_regular(Path(path), "file", MAX_FE_MESH_BYTES)
        with open(path, "rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except (OSError, InputError):
        return f"missing:{Path(path).name}"


def _canonical(value: Any) -> Any:
    """Data with floats rounded to 12 digits, so that 430 mm and 0.43 m are equal."""
    if isinstance(value, dict):
        return {k: _canonical(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [_canonical(v) for v in value]
    if isinstance(value, float):
        return f"{value:.12g}"
    return value


def _sections(data: Any, key: str = "") -> Iterator[tuple[str, dict[str, Any]]]:
    """All sections in the data of a case, each with the key of the section or of its list."""
    if isinstance(data, dict):
        yield key, data
        for name, value in data.items():
            yield from _sections(value, name)
    elif isinstance(data, (list, tuple)):
        for value in data:
            if isinstance(value, (dict, list, tuple)):
                yield from _sections(value, key)


def tables_in(data: dict[str, Any]) -> set[str]:
    """Paths of the files of tables and histories that a case names; data: the case in SI."""
    files = (section.get("file") for _, section in _sections(data))
    return {file for file in files if isinstance(file, str)}


def resolve_files(data: dict[str, Any], folder: Path, earlier: Collection[str] = ()) -> None:
    """Make paths in SI data of a case absolute, relative to ``folder``; read tables and
    histories, but for ``earlier`` files, whose content the data have."""
    for name, section in list(_sections(data)):
        for key in _FILES:
            if isinstance(section.get(key), str):
                section[key] = os.path.abspath(folder / os.path.expanduser(section[key]))
        if not isinstance(section.get("file"), str) or section["file"] in earlier:
            continue
        path = Path(section["file"])
        if name == "table":
            section |= read_flank_table(path)
        elif name == "loads":
            section["times"], section["forces"], section["moments"] = read_load_series(path)
        elif section.get("kind") == "csv":  # of a drive or a machine
            what: Followed = "speed" if section.get("law") in ("speed", "controller") else "torque"
            section["times"], section[f"{what}s"] = read_time_series(path, what)


def digest_files(data: dict[str, Any]) -> None:
    """Replace names of files in dumped data by the digests of their content."""
    for _, section in _sections(data):
        for key in section.keys() & _FILES:
            if key == "files":  # a pattern
                section[key] = [file_digest(name) for name in sorted(files_named(section[key]))]
            else:
                section[key] = file_digest(section[key])
