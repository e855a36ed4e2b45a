"""What an earlier run left in a folder, read again."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import xarray as xr
from pydantic import ValidationError

from flexgear.cli.pictures import Folder
from flexgear.gears.power_flow import power_flow
from flexgear.model.case import case_of_dict
from flexgear.model.errors import FlexgearError, InputError
from flexgear.model.input_file import MEGABYTE, read_text
from flexgear.results.dataset import load
from flexgear.results.dataset_file import open_lazily
from flexgear.results.summary import lacking

FIELDS = "deformed_"  # how datasets of displacement fields begin
_MOST = 256 * MEGABYTE  # of a case with a long torque series
_AT_ONCE = 32 * MEGABYTE  # of a dataset that is read whole; of larger ones what a picture wants


def read_folder(folder: Path) -> Folder:
    """Case, datasets and summary of a run; InputError where it is none, or damaged."""
    summary, case = _json(folder, "summary.json"), _json(folder, "case.json")
    lost = lacking(summary)
    if lost:
        raise _damaged(folder, "summary.json", f"{lost[0]} is missing")
    try:
        data = {f.stem: _dataset(f) for f in sorted(folder.glob("*.nc"))}
        whole = case_of_dict(tuples_of(case))
        flow = power_flow(whole)
    except ValidationError as error:
        raise _damaged(folder, "case.json", str(error).splitlines()[0]) from None
    except FlexgearError as error:
        raise _damaged(folder, "its files", str(error)) from None
    return Folder(
        whole,
        flow,
        {n: d for n, d in data.items() if not n.startswith(FIELDS)},
        {n.removeprefix(FIELDS): d for n, d in data.items() if n.startswith(FIELDS)},
        summary,
    )


def _dataset(file: Path) -> xr.Dataset:
    return load(file) if file.stat().st_size <= _AT_ONCE else open_lazily(file)


@contextmanager
def complete(folder: Path) -> Iterator[None]:
    """InputError where the block misses a dataset of the run in ``folder``, or a variable."""
    try:
        yield
    except (KeyError, StopIteration) as error:
        raise _damaged(folder, "its datasets", f"{error or 'one'} is missing") from error


def tuples_of(value: Any) -> Any:
    """Lists of JSON as the tuples that frozen parameters hold."""
    if isinstance(value, dict):
        return {k: tuples_of(v) for k, v in value.items()}
    return tuple(tuples_of(v) for v in value) if isinstance(value, list) else value


def _json(folder: Path, name: str) -> dict[str, Any]:
    if not (folder / name).exists():
        problem = f"holds no finished run: {name} is missing"
        raise InputError("render", str(folder), problem, "name the folder of a run")
    try:
        content = json.loads(read_text(folder / name, "results of a run", _MOST))
    except (ValueError, RecursionError) as error:
        raise _damaged(folder, name, str(error)) from None
    if not isinstance(content, dict):
        raise _damaged(folder, name, "no keys")
    return content


def _damaged(folder: Path, name: str, problem: str) -> InputError:
    said = f"cannot be read, {name}: {problem}"
    return InputError("render", str(folder), said, "run the case again")
