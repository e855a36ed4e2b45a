"""Files that a case names: FE meshes of its bodies, tables of flanks, histories of machines and
loads."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from flexgear.model.content import file_digest
from flexgear.model.flank_table import flank_tables, read_flank_table
from flexgear.model.history_files import history_sections, load_sections, read_histories

_OF_BODIES = ("fe_mesh_file", "fe_mesh_mass_file", "fe_mesh_nodes")


def resolve_files(data: dict[str, Any], folder: Path) -> None:
    """Paths in SI data of a case become absolute, from ``folder``; tables and histories are
    read."""
    for inside, key in _files(data):
        if isinstance(inside[key], str):
            inside[key] = os.path.abspath(folder / os.path.expanduser(inside[key]))
    for table in flank_tables(data):
        if isinstance(table.get("file"), str):
            table |= read_flank_table(Path(table["file"]))
    read_histories(data, folder)


def digest_files(data: dict[str, Any]) -> None:
    """Files in dumped data are replaced by what is in them."""
    for inside, key in _files(data):
        inside[key] = file_digest(inside[key])


def _files(data: dict[str, Any]) -> Iterator[tuple[dict[str, Any], str]]:
    """Sections that name a file, and the key."""
    sections: list[tuple[Any, str]] = [(section, "file") for section in history_sections(data)]
    sections += [(section, "file") for section in (*load_sections(data), *flank_tables(data))]
    sections += [(data.get("housing"), key) for key in _OF_BODIES]
    for stage in data.get("stages", ()):
        for name in ("ring", "carrier"):
            member = stage.get(name)
            body = member.get("fe") if isinstance(member, dict) else None
            sections += [(body, key) for key in _OF_BODIES]
    yield from (
        (inside, key) for inside, key in sections if isinstance(inside, dict) and key in inside
    )
