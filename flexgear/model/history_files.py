"""CSV files that the machines and the loads of a case name."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from flexgear.model.time_series import Followed, read_load_series, read_time_series


def history_sections(data: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """Sections with a history in the SI data of a case: drive, and machines of the ports."""
    ports = [*(data.get("inputs") or ()), data.get("output")]
    machines = [port.get("machine") for port in ports if isinstance(port, dict)]
    yield from (section for section in (data.get("drive"), *machines) if isinstance(section, dict))


def load_sections(data: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """Loads on members in the SI data of a case."""
    yield from (section for section in data.get("loads") or () if isinstance(section, dict))


def read_histories(data: dict[str, Any], folder: Path) -> None:
    """Points of all series of kind csv; their files become absolute, from ``folder``."""
    for section in (*history_sections(data), *load_sections(data)):
        if isinstance(section.get("file"), str):
            section["file"] = os.path.abspath(folder / os.path.expanduser(section["file"]))
    for section in load_sections(data):
        if isinstance(section.get("file"), str):
            section["times"], section["forces"], section["moments"] = read_load_series(
                Path(section["file"])
            )
    for section in history_sections(data):
        if isinstance(section.get("file"), str) and section.get("kind") == "csv":
            what: Followed = "speed" if section.get("law") in ("speed", "controller") else "torque"
            section["times"], section[f"{what}s"] = read_time_series(Path(section["file"]), what)
