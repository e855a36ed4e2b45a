"""Cases from TOML files and bundled ones, with settings and stages of other cases."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from contextvars import ContextVar
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

from flexgear.model.case import Case, validated_case
from flexgear.model.content import resolve_files
from flexgear.model.errors import InputError, echo
from flexgear.model.input_file import read_text
from flexgear.model.load_cases import take_spectrum
from flexgear.model.names import MemberName
from flexgear.model.read import (
    Written,
    changed,
    match_key,
    nearest,
    numbered,
    of_only_stage,
    override_data,
    parse_toml,
    to_si,
)
from flexgear.model.section import accepted_keys
from flexgear.model.stage import Stage
from flexgear.model.upgrade import refuse_earlier_file, refuse_earlier_key

_FOLDER = "cases"


@cache
def bundled_cases() -> tuple[str, ...]:
    """Names of the bundled cases."""
    folder = files("flexgear.model").joinpath(_FOLDER)
    names = (entry.name for entry in folder.iterdir())
    return tuple(sorted(name[:-5] for name in names if name.endswith(".toml")))


def bundled_text(name: str) -> str:
    """TOML text of a bundled case, for a user to copy and edit."""
    return files("flexgear.model").joinpath(_FOLDER, f"{name}.toml").read_text(encoding="utf-8")


_open_files: ContextVar[tuple[str, ...]] = ContextVar("cases that stages name", default=())
LoadCase = Callable[[str | Path], Case]
_OF_PORTS = ("inertia", "mass", "tilt_inertia", "bearing", "brake_exponent")


def take_stages(data: dict[str, Any], where: str, folder: Path, load_case: LoadCase) -> None:
    """Replace each stage of ``data`` (SI) that names a case by the only stage of that case, changed
    by the keys beside the name. Inertias, bearings and brake of its ports go to the ports at the
    same members."""
    for k, stage in enumerate(data.get("stages", ())):
        if not isinstance(stage, dict) or "case" not in stage:
            continue
        word = stage["case"]
        if not isinstance(word, str) or not word.isprintable():
            remedy = "name a bundled case or a file"
            raise InputError(where, f"stages[{k}].case", f"{echo(word)} is not text", remedy)
        path = folder / os.path.expanduser(word)
        taken = _taken(path if path.suffix == ".toml" or os.path.isfile(path) else word, load_case,
                       (where, f"stages[{k}].case"))  # fmt: skip
        if len(taken.stages) != 1:
            problem = f"{word} has {len(taken.stages)} stages"
            raise InputError(where, f"stages[{k}].case", problem, "name a case with one stage")
        values = taken.stages[0].model_dump(mode="python", exclude_unset=True)
        name = stage.get("name") or f"stage_{k + 1}"
        base = {"material": taken.material.model_dump(mode="python"), **values, "name": name}
        merged = _merged(base, stage)
        stage.clear()
        stage.update(merged)
        _take_ports(data, taken, name)


def _taken(named: Path | str, load_case: LoadCase, key: tuple[str, str]) -> Case:
    """The case that a stage names; InputError for one whose stages lead back to it."""
    file = os.path.realpath(named) if isinstance(named, Path) else named
    if file in _open_files.get():
        problem = f"{named} takes its stage from itself in the end"
        raise InputError(*key, problem, "name a case that has its stages in it")
    token = _open_files.set((*_open_files.get(), file))
    try:
        return load_case(named)
    finally:
        _open_files.reset(token)


def _take_ports(data: dict[str, Any], taken: Case, name: str) -> None:
    """Give the ports of ``data`` the inertias, bearings and brake that the named case has there."""
    ports = [*data.get("inputs", ()), *([data["output"]] if "output" in data else [])]
    for port in ports:
        at = MemberName.parse(str(port.get("member", "")))
        counterpart = MemberName.of(taken.stages[0].name, at.part)
        theirs = taken.port_at(counterpart) if at.stage == name else None
        if theirs is None:
            continue
        values = theirs.model_dump(mode="python", exclude_none=True)
        of_port = {key: values[key] for key in _OF_PORTS if key in values}
        if port is not data.get("output"):
            of_port.pop("brake_exponent", None)
        port.update({key: value for key, value in of_port.items() if key not in port})


def _merged(base: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """Nested data with values of ``changes`` in place of those of ``base``."""
    out = dict(base)
    for key, value in changes.items():
        inside = out.get(key)
        deep = isinstance(value, dict) and isinstance(inside, dict)
        out[key] = _merged(inside, value) if deep else value  # type: ignore[arg-type]
    return out


def load_case(source: str | Path | Case, overrides: Mapping[str, object] | None = None) -> Case:
    """Read a TOML file or a bundled case by name; overrides are keyed like the TOML keys.

    source: a case is taken as it is, but for the overrides.

    A single stage may be written [stage]; it is the only element of ``stages`` under another name,
    in the file, in overrides and in messages. Files of earlier forms are refused (``upgrade``).
    overrides: {"stage.planets": 4, "stage.face_width_mm": "400"}, values of Python or texts of
    TOML; they win over the file, and None takes a key out. Keys of the only stage may come without
    "stage.".
    Raises InputError with one line for anything that is wrong.
    """
    if isinstance(source, Case):
        return _overridden(source, overrides or {})
    text, where, folder, name = _find(source)
    where = where.encode(errors="backslashreplace").decode()  # a file name may be no UTF-8
    return case_of_toml(parse_toml(text, where), where, name, folder, overrides)


def _overridden(case: Case, overrides: Mapping[str, object]) -> Case:
    data, written = case.model_dump(mode="python", exclude_unset=True), Written()
    try:
        for key, value in overrides.items():
            data = _override(data, key, value, written)
        return validated_case(data, case.source, written)
    except InputError as fault:
        raise (of_only_stage(fault) if case.stages[0].name == "stage" else fault) from None


def case_of_toml(
    raw: Mapping[str, Any],
    where: str,
    name: str,
    folder: Path | None = None,
    overrides: Mapping[str, object] | None = None,
) -> Case:
    """The case of parsed TOML data. where: named in messages; folder: of the files it names."""
    folder = folder or Path()
    refuse_earlier_file(raw, where)
    try:
        return _case(with_list(raw, where), overrides or {}, where, folder, name)
    except InputError as fault:
        raise (of_only_stage(fault) if "stage" in raw else fault) from None


def _case(
    raw: Mapping[str, Any], overrides: Mapping[str, object], where: str, folder: Path, name: str
) -> Case:
    """The case of TOML data under its long keys, with overrides carried out."""
    written = Written()
    data = to_si(Case, raw, where, written)
    named = [key for key in overrides if key.rpartition(".")[2] == "case"]
    for key in named:  # which stage, before what changes in it
        data = _override(data, key, overrides[key], written)
    take_stages(data, where, folder, load_case)
    for key, value in overrides.items():
        if key not in named:
            data = _override(data, key, value, written)
    resolve_files(data, folder)
    take_spectrum(data, written)
    return validated_case({"name": name, **data, "source": where}, where, written)


def _override(data: dict[str, Any], key: str, value: object, written: Written) -> dict[str, Any]:
    path, converted = override_data(Case, whole_key(key, data, "--set"), value, written)
    overridden: dict[str, Any] = changed(data, path, converted, "--set", key)
    return overridden


def whole_key(key: str, data: Mapping[str, Any], where: str) -> str:
    """A key of a setting with stages by number; one of the case's only stage may come without
    "stage.". InputError if it is neither that nor a key of the case."""
    refuse_earlier_key(key, where)
    first, stages = key.partition(".")[0], data.get("stages", ())
    if first in ("stage", "stages"):
        return ".".join(numbered(key, data, where))
    try:
        match_key(Case, first, where, key)
    except InputError as of_case:
        try:
            match_key(Stage, first, where, key)
        except InputError as of_stage:
            faults = [f for f in (of_case, of_stage) if f.problem != "is not a known key"]
            keys = [*accepted_keys(Stage), *accepted_keys(Case)]
            unknown = InputError(where, key, "is not a known key", nearest(first, keys))
            raise (faults or [unknown])[0] from None
        if len(stages) != 1:
            remedy = f"write stages.NAME.{key} or stages.0.{key}"
            raise InputError(where, key, "is a key of a stage", remedy) from None
        return f"stages.0.{key}"
    return key


def with_list(raw: Mapping[str, Any], where: str) -> Mapping[str, Any]:
    """The data with [stage] as the only element of [[stages]], named "stage"."""
    if "stage" not in raw:
        return raw
    only = raw["stage"]
    if "stages" in raw:
        raise InputError(where, "stage", "is given beside [[stages]]", "keep one of the two forms")
    if not isinstance(only, dict):
        raise InputError(
            where, "stage", "is not a section", "write it as [stage], or several as [[stages]]"
        )
    rest = {key: value for key, value in raw.items() if key != "stage"}
    return {**rest, "stages": [{"name": "stage", **only}]}


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
