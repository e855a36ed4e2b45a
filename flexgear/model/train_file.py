"""From the TOML data of a train and overrides to a Case.

A single stage may be written [stage]; it is the only element of ``stages`` under another name, in
the file, in overrides and in messages. A flexible stage is read by its own loader and may be
changed below ``flexible``: [stages.flexible.ring] or --set stage.flexible.ring.flexible=false.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from flexgear.model.case import Case, validated_case
from flexgear.model.errors import InputError
from flexgear.model.flexible_stage import resolve_files
from flexgear.model.named_stage import LoadStage, refuse_said_twice, take_flexible
from flexgear.model.read import Written, override_data, put, to_si
from flexgear.model.train_keys import aliased, numbered


def train_of(
    raw: dict[str, Any],
    overrides: Mapping[str, str],
    *,
    where: str,
    folder: Path,
    name: str,
    load_stage: LoadStage,
) -> Case:
    """The train of parsed TOML data with overrides carried out.

    folder: for relative paths of flexible stages, which load_stage reads.
    """
    if "stage" not in raw:
        data, written = _data(raw, overrides, where, folder, load_stage)
        return validated_case({"name": name, **data, "source": where}, where, written)
    if "stages" in raw:
        raise InputError(where, "stage", "is given beside [[stages]]", "keep one of the two forms")
    try:
        data, written = _data(_with_list(raw, where), overrides, where, folder, load_stage)
        return validated_case({"name": name, **data, "source": where}, where, written)
    except InputError as fault:
        raise InputError(
            fault.where, aliased(fault.key), aliased(fault.problem), aliased(fault.remedy)
        ) from None


def _with_list(raw: Mapping[str, Any], where: str) -> dict[str, Any]:
    """[stage] as the only element of [[stages]], named "stage"."""
    only = raw["stage"]
    if not isinstance(only, dict):
        raise InputError(
            where, "stage", "is not a section", "write it as [stage], or several as [[stages]]"
        )
    rest = {key: value for key, value in raw.items() if key != "stage"}
    return {**rest, "stages": [{"name": "stage", **only}]}


def _data(
    raw: dict[str, Any],
    overrides: Mapping[str, str],
    where: str,
    folder: Path,
    load_stage: LoadStage,
) -> tuple[dict[str, Any], Written]:
    """Data in SI, flexible stages read, overrides carried out; and how keys were written."""
    written = Written()
    data = to_si(Case, raw, where, written)
    first = [key for key in overrides if key.rpartition(".")[2] == "case"]
    for key in first:  # which case, before what changes in it
        _override(data, key, overrides[key], written)
    flexible = [k for k, s in enumerate(data.get("stages", ())) if {"case", "flexible"} & {*s}]
    for k in flexible:
        refuse_said_twice(written, k)
        take_flexible(data["stages"][k], k, where, folder, load_stage)
    for key, value in overrides.items():
        if key not in first:
            _override(data, key, value, written)
    for k in flexible:
        refuse_said_twice(written, k)
    resolve_files(data, folder)
    return data, written


def _override(data: dict[str, Any], key: str, value: str, written: Written) -> None:
    full = ".".join(numbered(key, data, "--set"))
    path, converted = override_data(Case, full, str(value), written)
    put(data, path, converted, "--set", key)
