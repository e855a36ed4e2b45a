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
    yield from (one for one in (data.get("drive"), *machines) if isinstance(one, dict))


def load_sections(data: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """Loads on members in the SI data of a case."""
    yield from (one for one in data.get("loads") or () if isinstance(one, dict))


def read_histories(data: dict[str, Any], folder: Path) -> None:
    """Points of all series of kind csv; their files become absolute, from ``folder``."""
    for one in (*history_sections(data), *load_sections(data)):
        if isinstance(one.get("file"), str):
            one["file"] = os.path.abspath(folder / os.path.expanduser(one["file"]))
    for one in load_sections(data):
        if isinstance(one.get("file"), str):
            one["times"], one["forces"], one["moments"] = read_load_series(Path(one["file"]))
    for one in history_sections(data):
        if isinstance(one.get("file"), str) and one.get("kind") == "csv":
            what: Followed = "speed" if one.get("law") in ("speed", "controller") else "torque"
            one["times"], one[f"{what}s"] = read_time_series(Path(one["file"]), what)
