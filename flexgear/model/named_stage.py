"""A stage that a case takes from another case: ``case = "wind-5mw"`` and what changes in it."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from contextvars import ContextVar
from pathlib import Path
from typing import Any

from flexgear.model.case import Case
from flexgear.model.errors import InputError, echo
from flexgear.model.names import MemberName

_open_files: ContextVar[tuple[str, ...]] = ContextVar("cases that stages name", default=())
LoadCase = Callable[[str | Path], Case]
_OF_PORTS = ("inertia", "mass", "tilt_inertia", "bearing", "brake_exponent")


def take_stages(data: dict[str, Any], where: str, folder: Path, load_case: LoadCase) -> None:
    """Stages of ``data`` (SI) that name a case become that case's only stage, changed by what is
    said beside; its ports' inertias, bearings and brake go to ports at the same members."""
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
    """What hangs on the ports of the case that was named hangs on those at the same members."""
    ports = [*data.get("inputs", ()), *([data["output"]] if "output" in data else [])]
    for port in ports:
        at = MemberName.parse(str(port.get("member", "")))
        there = MemberName.of(taken.stages[0].name, at.part)
        theirs = taken.port_at(there) if at.stage == name else None
        if theirs is None:
            continue
        values = theirs.model_dump(mode="python", exclude_none=True)
        of_port = {key: values[key] for key in _OF_PORTS if key in values}
        if port is not data.get("output"):
            of_port.pop("brake_exponent", None)
        port.update({key: value for key, value in of_port.items() if key not in port})


def _merged(base: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """Nested data with values replaced."""
    out = dict(base)
    for key, value in changes.items():
        inside = out.get(key)
        deep = isinstance(value, dict) and isinstance(inside, dict)
        out[key] = _merged(inside, value) if deep else value  # type: ignore[arg-type]
    return out
