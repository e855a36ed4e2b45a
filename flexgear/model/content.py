"""Content of a case and of the files that it names: paths, digests, hash."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterator
from glob import glob
from pathlib import Path
from typing import Any

from flexgear.model.bodies import FE_MESH_FILES
from flexgear.model.errors import InputError
from flexgear.model.input_file import MOST_FE_MESH, require_regular
from flexgear.model.machine import Followed, read_load_series, read_time_series
from flexgear.model.modifications import flank_tables, read_flank_table


def content_hash(data: Any) -> str:
    """SHA-256 of plain data, 64 hex digits; numbers count with 12 digits."""
    text = json.dumps(_canonical(data), sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()


def file_digest(path: str | None) -> str | None:
    """SHA-256 of what is in a file."""
    if path is None:
        return None
    try:
        require_regular(Path(path), "file", MOST_FE_MESH)
        with open(path, "rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except (OSError, InputError):
        return f"missing:{Path(path).name}"


def _canonical(value: Any) -> Any:
    """Numbers with 12 digits, so that 430 mm and 0.43 m are the same."""
    if isinstance(value, dict):
        return {k: _canonical(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [_canonical(v) for v in value]
    if isinstance(value, float):
        return f"{value:.12g}"
    return value


def _history_sections(data: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """Sections with a history in the SI data of a case: drive, and machines of the ports."""
    ports = [*(data.get("inputs") or ()), data.get("output")]
    machines = [port.get("machine") for port in ports if isinstance(port, dict)]
    yield from (section for section in (data.get("drive"), *machines) if isinstance(section, dict))


def _load_sections(data: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """Loads on members in the SI data of a case."""
    yield from (section for section in data.get("loads") or () if isinstance(section, dict))


def _read_histories(data: dict[str, Any]) -> None:
    """Points of all series of kind csv."""
    for section in _load_sections(data):
        if isinstance(section.get("file"), str):
            section["times"], section["forces"], section["moments"] = read_load_series(
                Path(section["file"])
            )
    for section in _history_sections(data):
        if isinstance(section.get("file"), str) and section.get("kind") == "csv":
            what: Followed = "speed" if section.get("law") in ("speed", "controller") else "torque"
            section["times"], section[f"{what}s"] = read_time_series(Path(section["file"]), what)


def resolve_files(data: dict[str, Any], folder: Path) -> None:
    """Paths in SI data of a case become absolute, from ``folder``; tables and histories are
    read."""
    for inside, key in _files(data):
        if isinstance(inside[key], str):
            inside[key] = os.path.abspath(folder / os.path.expanduser(inside[key]))
    for table in flank_tables(data):
        if isinstance(table.get("file"), str):
            table |= read_flank_table(Path(table["file"]))
    _read_histories(data)


def digest_files(data: dict[str, Any]) -> None:
    """Files in dumped data are replaced by what is in them."""
    for inside, key in _files(data):
        if key == "files":  # a pattern
            inside[key] = [file_digest(name) for name in sorted(glob(inside[key], recursive=True))]
        else:
            inside[key] = file_digest(inside[key])


def _files(data: dict[str, Any]) -> Iterator[tuple[dict[str, Any], str]]:
    """Sections that name a file, and the key."""
    named = (*_history_sections(data), *_load_sections(data), *flank_tables(data))
    sections: list[tuple[Any, str]] = [(section, "file") for section in named]
    sections.append((data.get("spectrum"), "file"))
    series = data.get("load_series")
    if isinstance(series, dict):
        sections += [(load_case, "files") for load_case in series.get("design_load_cases") or ()]
    sections += [(data.get("housing"), key) for key in FE_MESH_FILES]
    for stage in data.get("stages", ()):
        for name in ("ring", "carrier"):
            member = stage.get(name)
            body = member.get("fe") if isinstance(member, dict) else None
            sections += [(body, key) for key in FE_MESH_FILES]
    yield from (
        (inside, key) for inside, key in sections if isinstance(inside, dict) and key in inside
    )
