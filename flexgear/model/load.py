"""Reading cases: a TOML file or a bundled name becomes a ``Case``."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from flexgear.model.bundled import bundled_cases, bundled_text
from flexgear.model.case import Case, case_of_stage
from flexgear.model.errors import InputError, echo
from flexgear.model.flexible_stage import FlexibleStage, resolve_files, validated_stage
from flexgear.model.input_file import read_text
from flexgear.model.read import Written, nearest, override_data, parse_toml, put, to_si
from flexgear.model.train_file import train_of

__all__ = ["Case", "FlexibleStage", "load_case", "load_stage"]
KINDS = ["stage", "train"]


def load_case(source: str | Path, overrides: Mapping[str, str] | None = None) -> Case:
    """Read a TOML file or a bundled case by name; overrides are keyed like the TOML keys.

    kind = "stage" (if left out) is the short form of one flexible stage, kind = "train" the long
    one. overrides: {"stage.planets": "4", "stage.face_width_mm": "400"}; they win over the file.
    Raises InputError with one line for anything that is wrong.
    """
    raw, where, folder, name = _read(source)
    if _kind(raw, where) == "train":
        return train_of(
            raw, overrides or {}, where=where, folder=folder, name=name, load_stage=load_stage
        )
    return case_of_stage(_stage_of(raw, overrides or {}, where, folder, name))


def load_stage(source: str | Path, overrides: Mapping[str, str] | None = None) -> FlexibleStage:
    """The flexible stage of a file in the short form; InputError for a train."""
    raw, where, folder, name = _read(source)
    if _kind(raw, where) == "train":
        raise InputError(where, "kind", "is a train, not a flexible stage", "name a flexible stage")
    return _stage_of(raw, overrides or {}, where, folder, name)


def _read(source: str | Path) -> tuple[dict[str, Any], str, Path, str]:
    """Data of a file, how to name it in messages, folder for relative paths, name of the case."""
    text, where, folder, name = _find(source)
    where = where.encode(errors="backslashreplace").decode()  # a file name may be no UTF-8
    return parse_toml(text, where), where, folder, name


def _stage_of(
    raw: dict[str, Any], overrides: Mapping[str, str], where: str, folder: Path, name: str
) -> FlexibleStage:
    raw = {key: value for key, value in raw.items() if key != "kind"}
    written = Written()
    data = to_si(FlexibleStage, raw, where, written)
    for key, value in overrides.items():
        path, converted = override_data(FlexibleStage, key, str(value), written)
        put(data, path, converted, "--set", key)
    data["source"] = where
    data.setdefault("name", name)
    resolve_files(data, folder)
    return validated_stage(data, where, written)


def _kind(raw: Mapping[str, Any], where: str) -> str:
    """What the file describes."""
    kind = raw.get("kind", "stage")
    if kind not in KINDS:
        raise InputError(where, "kind", f"{echo(kind)} is unknown", nearest(str(kind), KINDS))
    if "kind" not in raw and "stages" in raw:
        raise InputError(
            where, "kind", "is missing in a file with [[stages]]", 'write kind = "train" at the top'
        )
    return str(kind)


def _find(source: str | Path) -> tuple[str, str, Path, str]:
    """Text, how to name it in messages, folder for relative paths, name of the case."""
    path = Path(source)
    if path.suffix or len(path.parts) != 1 or os.path.isfile(path):
        return read_text(path), str(source), path.parent, path.stem
    if str(source) in bundled_cases():  # which a folder of that name does not hide
        return bundled_text(str(source)), str(source), Path(), str(source)
    if os.path.exists(path):
        return read_text(path), str(source), path.parent, path.stem
    hint = nearest(str(source), bundled_cases())
    raise InputError(
        str(source), "case", "is neither a file nor a bundled case", f"give a .toml file, or {hint}"
    )
