"""Reading cases: a TOML file or a bundled name becomes a flexible stage or a train."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from flexgear.model.bundled import bundled_cases, bundled_text
from flexgear.model.case import Case
from flexgear.model.errors import InputError, echo
from flexgear.model.flexible_stage import FlexibleStage, resolve_files, validated_case
from flexgear.model.input_file import read_text
from flexgear.model.read import Written, nearest, override_data, parse_toml, put, to_si
from flexgear.model.train_file import train_of

__all__ = ["Case", "FlexibleStage", "load_case", "load_stage"]
KINDS = ["stage", "train"]


def load_case(
    source: str | Path, overrides: Mapping[str, str] | None = None
) -> FlexibleStage | Case:
    """Read a TOML file or a bundled case by name; overrides are keyed like the TOML keys.

    The key ``kind`` decides: "stage" (if left out) is a flexible stage, "train" a Case.
    overrides: {"stage.planets": "4", "stage.face_width_mm": "400"}; they win over the file.
    Raises InputError with one line for anything that is wrong.
    """
    text, where, folder, name = _find(source)
    where = where.encode(errors="backslashreplace").decode()  # a file name may be no UTF-8
    raw = parse_toml(text, where)
    if _kind(raw, where) == "train":
        return train_of(
            raw, overrides or {}, where=where, folder=folder, name=name, load_stage=load_stage
        )
    raw.pop("kind", None)
    return _stage_of(raw, overrides or {}, where, folder, name)


def load_stage(source: str | Path, overrides: Mapping[str, str] | None = None) -> FlexibleStage:
    """As ``load_case`` for what works on flexible stages only; InputError for a train."""
    case = load_case(source, overrides)
    if isinstance(case, Case):
        raise InputError(
            case.source, "kind", "is a train, not a flexible stage", "name a flexible stage"
        )
    return case


def _stage_of(
    raw: dict[str, Any], overrides: Mapping[str, str], where: str, folder: Path, name: str
) -> FlexibleStage:
    written = Written()
    data = to_si(FlexibleStage, raw, where, written)
    for key, value in overrides.items():
        path, converted = override_data(FlexibleStage, key, str(value), written)
        put(data, path, converted, "--set", key)
    data["source"] = where
    data.setdefault("name", name)
    resolve_files(data, folder)
    return validated_case(data, where, written)


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
