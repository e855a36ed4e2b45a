"""Loading of cases: TOML files, bundled cases, overrides, and stages taken from other cases."""

import os
from collections.abc import Callable, Mapping
from contextvars import ContextVar
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

from flexgear.model.case import Case, validated_case
from flexgear.model.content import resolve_files, tables_in
from flexgear.model.errors import InputError, echo
from flexgear.model.input_file import read_text
from flexgear.model.load_cases import take_spectrum
from flexgear.model.names import MemberName
from flexgear.model.read import (
    UNKNOWN,
    Written,
    changed,
    match_key,
    nearest,
    numbered,
    of_each_stage,
    of_only_stage,
    override_data,
    parse_toml,
    stage_names,
    to_si,
)
from flexgear.model.section import accepted_keys, usual_key
from flexgear.model.stage import Stage
from flexgear.model.upgrade import refuse_earlier_file, refuse_earlier_key
from flexgear.model.validation_errors import with_places

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


_open_files: ContextVar[tuple[str, ...]] = ContextVar("cases being loaded", default=())
LoadCase = Callable[[str | Path], Case]
_PORT_KEYS = ("inertia", "mass", "tilt_inertia", "bearing", "brake_exponent")


def take_stages(data: dict[str, Any], where: str, folder: Path, load_case: LoadCase) -> None:
    """Replace each stage of ``data`` (SI) that names a case by the only stage of that case.

    Other keys of the stage override those of the named case. Ports at the same members get
    inertias, bearings and brake exponent of its ports.
    """
    for k, stage in enumerate(data.get("stages", ())):
        if not isinstance(stage, dict) or "case" not in stage:
            continue
        source, key = stage["case"], (where, f"stages[{k}].case")
        if not isinstance(source, str) or not source.isprintable():
            raise InputError(*key, f"{echo(source)} is not text", "name a bundled case or a file")
        path = folder / os.path.expanduser(source)
        is_path = path.suffix == ".toml" or os.path.isfile(path)
        named_case = _named_case(path if is_path else source, load_case, key)
        if len(named_case.stages) != 1:
            problem = f"{source} has {len(named_case.stages)} stages"
            raise InputError(*key, problem, "name a case with one stage")
        values = named_case.stages[0].model_dump(mode="python", exclude_unset=True)
        name = stage.get("name") or f"stage_{k + 1}"
        base = {"material": named_case.material.model_dump(mode="python"), **values, "name": name}
        merged = _merged(base, stage)
        stage.clear()
        stage.update(merged)
        _take_ports(data, named_case, name)


def _named_case(source: Path | str, load_case: LoadCase, key: tuple[str, str]) -> Case:
    """The case that a stage names; InputError for circular references."""
    file = os.path.realpath(source) if isinstance(source, Path) else source
    if file in _open_files.get():
        problem = f"{source} takes its stage from itself in the end"
        raise InputError(*key, problem, "name a case that contains its stages")
    token = _open_files.set((*_open_files.get(), file))
    try:
        return load_case(source)
    finally:
        _open_files.reset(token)


def _take_ports(data: dict[str, Any], named_case: Case, name: str) -> None:
    """Copy inertias, bearings and brake exponent from the ports of a named case to those of
    ``data`` at the stage ``name``."""
    ports = [*data.get("inputs", ()), *([data["output"]] if "output" in data else [])]
    for port in ports:
        member = MemberName.parse(str(port.get("member", "")))
        counterpart = MemberName.of(named_case.stages[0].name, member.part)
        source = named_case.port_at(counterpart) if member.stage == name else None
        if source is None:
            continue
        values = source.model_dump(mode="python", exclude_none=True)
        of_port = {key: values[key] for key in _PORT_KEYS if key in values}
        if port is not data.get("output"):
            of_port.pop("brake_exponent", None)
        port.update({key: value for key, value in of_port.items() if key not in port})


def _merged(base: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """Nested data of ``base`` with the values of ``changes``."""
    merged = dict(base)
    for key, value in changes.items():
        inner = merged.get(key)
        nested = isinstance(value, dict) and isinstance(inner, dict)
        merged[key] = _merged(inner, value) if nested else value  # type: ignore[arg-type]
    return merged


def load_case(source: str | Path | Case, overrides: Mapping[str, object] | None = None) -> Case:
    """Read a case from a TOML file, or a bundled case by name, and apply overrides.

    source: path, name, or a case, to which only the overrides are applied. overrides: values by
    TOML key, such as {"stage.planets": 4, "stage.face_width_mm": "400"}, as Python values or TOML
    text; None deletes a key. A single stage may be written [stage], in the file, in overrides and
    in messages; keys of it need no "stage.". Raises InputError for wrong input, including files of
    earlier versions (``upgrade``).
    """
    if isinstance(source, Case):
        return _overridden(source, overrides or {})
    text, where, folder, name = _find(source)
    where = where.encode(errors="backslashreplace").decode()  # a file name may be no UTF-8
    return case_of_toml(parse_toml(text, where), where, name, folder, overrides)


def _overridden(case: Case, overrides: Mapping[str, object]) -> Case:
    data, written = case.model_dump(mode="python", exclude_unset=True), Written()
    earlier = tables_in(data)
    try:
        for key, value in overrides.items():
            data = _override(data, key, value, written)
        resolve_files(data, Path(), earlier)
        return validated_case(data, case.source, written)
    except InputError as error:
        fault = with_places(Case, error)
        raise (of_only_stage(fault) if case.stages[0].name == "stage" else fault) from None


def case_of_toml(
    raw: Mapping[str, Any],
    where: str,
    name: str,
    folder: Path | None = None,
    overrides: Mapping[str, object] | None = None,
) -> Case:
    """The case of parsed TOML data. where: source named in messages; folder: base of relative paths
    in the data."""
    folder = folder or Path()
    refuse_earlier_file(raw, where)
    try:
        overrides = overrides or {}
        written = Written()
        data = to_si(Case, with_list(raw, where), where, written)
        named = [key for key in overrides if key.rpartition(".")[2] == "case"]
        for key in named:  # the case of a stage comes before changes of its keys
            data = _override(data, key, overrides[key], written)
        take_stages(data, where, folder, load_case)
        for key, value in overrides.items():
            if key not in named:
                data = _override(data, key, value, written)
        resolve_files(data, folder)
        take_spectrum(data, written)
        return validated_case({"name": name, **data, "source": where}, where, written)
    except InputError as error:
        fault = with_places(Case, error)
        raise (of_only_stage(fault) if "stage" in raw else fault) from None


def _override(data: dict[str, Any], key: str, value: object, written: Written) -> dict[str, Any]:
    path, converted = override_data(Case, whole_key(key, data, "--set"), value, written)
    overridden: dict[str, Any] = changed(data, path, converted, "--set", key)
    return overridden


def whole_key(key: str, data: Mapping[str, Any], where: str) -> str:
    """The full key of an override, with stages by number. Keys of the only stage may come without
    "stage.", those of a named one without "stages.". Raises InputError for an unknown key."""
    refuse_earlier_key(key, where)
    first, stages = key.partition(".")[0], data.get("stages", ())
    if first in stage_names(data) and first not in ("stage", *Case.model_fields):
        key, first = f"stages.{key}", "stages"
    if first in ("stage", "stages"):
        return ".".join(numbered(key, data, where))
    try:
        match_key(Case, first, where, key)
    except InputError as of_case:
        try:
            match_key(Stage, first, where, key)
        except InputError as of_stage:
            faults = [f for f in (of_case, of_stage) if f.problem != UNKNOWN]
            names = [*stage_names(data), *accepted_keys(Stage), *accepted_keys(Case)]
            remedy = nearest(first, names)
            if not remedy.startswith("did you mean"):
                usual = [
                    usual_key(section, n) for section in (Stage, Case) for n in section.model_fields
                ]
                remedy = nearest(first, usual)
            unknown = InputError(where, key, UNKNOWN, remedy)
            raise (faults or [unknown])[0] from None
        if len(stages) != 1:
            remedy = of_each_stage(data, key)
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
        problem = "is not a section"
        raise InputError(where, "stage", problem, "write it as [stage], or several as [[stages]]")
    rest = {key: value for key, value in raw.items() if key != "stage"}
    return {**rest, "stages": [{"name": "stage", **only}]}


def _find(source: str | Path) -> tuple[str, str, Path, str]:
    """Text of a case, its source for messages, folder for relative paths, name of the case."""
    path = Path(source)
    if path.suffix or len(path.parts) != 1 or os.path.isfile(path):
        return read_text(path), str(source), path.parent, path.stem
    if str(source) in bundled_cases():  # takes precedence over a folder of that name
        return bundled_text(str(source)), str(source), Path(), str(source)
    if os.path.exists(path):
        return read_text(path), str(source), path.parent, path.stem
    hint = nearest(str(source), bundled_cases())
    problem = "is neither a file nor a bundled case"
    raise InputError(str(source), "case", problem, f"give a .toml file, or {hint}")
