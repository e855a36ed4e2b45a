"""Reading of the results of a run from its folder."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import xarray as xr
from pydantic import ValidationError

from flexgear.gears.power_flow import PowerFlow, StageFlow, power_flow
from flexgear.model.case import Case
from flexgear.model.errors import FlexgearError, InputError
from flexgear.model.input_file import MEGABYTE, read_text
from flexgear.model.names import BodyName
from flexgear.model.read import tuples_of
from flexgear.model.section import location
from flexgear.model.stage_view import StageView
from flexgear.results.dataset_file import reopened
from flexgear.results.settling import settled
from flexgear.results.stage_figures import root_extremes
from flexgear.results.stage_part import stage_part
from flexgear.results.summary import VERSION, missing_keys

FIELDS = "deformed_"  # prefix of datasets of displacement fields
_MAX_BYTES = 256 * MEGABYTE  # of a case with a long torque series


def transient_file(path: Path) -> Path:
    """The file of a transient: ``path``, or the file of steady running in the folder of a run;
    InputError if there is none."""
    file = path / "transient.nc" if path.is_dir() else path
    if not file.exists():
        remedy = "name a transient, or the folder of a run"
        raise InputError(str(file), "dataset", "there is no such file", remedy)
    return file


@dataclass(frozen=True)
class Run:
    """Results of a run: case, power flow, datasets by file name (without suffix), displacement
    fields by body, summary."""

    case: Case
    flow: PowerFlow
    datasets: Mapping[str, xr.Dataset]
    fields: Mapping[BodyName, xr.Dataset]
    summary: dict[str, Any]

    @property
    def rings(self) -> list[StageOfRun]:
        """The stages with an FE ring."""
        return [StageOfRun(self, stage) for stage in self.case.fe_ring_stages]

    def with_timing(self, **seconds: float) -> Run:
        """A copy with further wall times in the summary, s."""
        summary = {**self.summary, "timing_s": {**self.summary["timing_s"], **seconds}}
        return replace(self, summary=summary)


@dataclass(frozen=True)
class StageOfRun:
    """A stage of a run; steady, equilibria: results of a stage with an FE ring."""

    run: Run
    name: str

    @property
    def view(self) -> StageView:
        """The stage of the case."""
        return self.run.case.view(self.name)

    @property
    def flow(self) -> StageFlow:
        """Speeds, torques and forces of the stage."""
        return self.run.flow.stage(self.name)

    @property
    def is_shared(self) -> bool:
        """Whether the planets share a load."""
        shared = self.run.datasets["transient"]["group_stage"].to_numpy()
        return self.flow.kind == "planetary" and self.name in shared

    @property
    def has_roots(self) -> bool:
        """Whether root stresses of its teeth were computed."""
        return bool(root_extremes(self.run.datasets["equilibrium"], self.name))

    def runs(self, start: str) -> dict[str, xr.Dataset]:
        """Datasets whose names begin with ``start``, by variant, first that of the case."""
        datasets = {
            label: self.run.datasets[f"{start}{end}"]
            for label, end in ((self.run.summary["variant"], ""), ("rigid", "_rigid"))
            if f"{start}{end}" in self.run.datasets
        }
        return {label: stage_part(data, self.name) for label, data in datasets.items()}

    @cached_property
    def steady(self) -> dict[str, xr.Dataset]:
        """Settled parts of the transients at rated torque, by variant."""
        return {label: settled(data) for label, data in self.runs("transient").items()}

    @cached_property
    def equilibria(self) -> xr.Dataset:
        """Equilibria over one revolution without manufacturing errors."""
        return stage_part(self.run.datasets["equilibrium_without_errors"], self.name)


def prefix_of(stage: str) -> str:
    """Prefix of names of a stage's pictures: its name, unless it is the only one."""
    return "" if stage == "stage" else f"{stage}_"


def read_folder(folder: Path) -> Run:
    """Read case, datasets and summary of a run; InputError if they are missing or damaged."""
    summary, case = _json(folder, "summary.json"), _json(folder, "case.json")
    version = summary.get("version")
    if version is not None and summary.get("schema_version") != VERSION:
        problem = f"are of flexgear {version}, which this version cannot read"
        raise InputError(str(folder), "results", problem, "run its case again")
    if keys := missing_keys(summary):
        raise _damaged(folder, "summary.json", f"{keys[0]} is missing")
    try:
        data = {f.stem: reopened(f) for f in sorted(folder.glob("*.nc"))}
        validated = Case.model_validate(tuples_of(case, str(folder / "case.json"), "case"))
        flow = power_flow(validated)
    except ValidationError as error:
        key = ".".join(map(str, location(error.errors()[0]))) or "a key"
        raise _damaged(folder, "case.json", f"{key} is not as in this version's cases") from None
    except FlexgearError as error:
        raise _damaged(folder, "its files", str(error)) from None
    of_fields = [name for name in data if name.startswith(FIELDS)]
    fields = {BodyName.parse(name.removeprefix(FIELDS)): data.pop(name) for name in of_fields}
    return Run(validated, flow, data, fields, summary)


@contextmanager
def complete(folder: Path) -> Iterator[None]:
    """Context that raises InputError if results of the run in ``folder`` are missing or wrong."""
    try:
        yield
    except (KeyError, StopIteration) as error:
        raise _damaged(folder, "its datasets", f"{error or 'one'} is missing") from error
    except (TypeError, AttributeError, ValueError, IndexError, ArithmeticError) as error:
        problem = f"values are not those of a run ({str(error).partition(chr(10))[0]})"
        raise _damaged(folder, "summary.json or its datasets", problem) from error


def _json(folder: Path, name: str) -> dict[str, Any]:
    if not (folder / name).exists():
        problem = f"are not those of a finished run: {name} is missing"
        raise InputError(str(folder), "results", problem, "name the folder of a run")
    try:
        content = json.loads(read_text(folder / name, "results of a run", _MAX_BYTES))
    except (ValueError, RecursionError) as error:
        raise _damaged(folder, name, str(error)) from None
    if not isinstance(content, dict):
        raise _damaged(folder, name, "no keys")
    return content


def _damaged(folder: Path, name: str, problem: str) -> InputError:
    problem = f"cannot be read, {name}: {problem}"
    return InputError(str(folder), "results", problem, "run the case again")
