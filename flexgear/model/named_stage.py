"""A flexible stage within the data of a train: which case it is and what changes in it."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from flexgear.model.errors import InputError, echo
from flexgear.model.flexible_stage import FlexibleStage, resolve_files
from flexgear.model.gear_errors import GearErrors
from flexgear.model.read import Written
from flexgear.model.train_stage import FROM_FLEXIBLE

LoadStage = Callable[[str | Path], FlexibleStage]

# keys of a train's stage that its own case says, and where: ("planets", "stage.planets")
_SAID = {
    **{key: f"stage.{key}" for key in FROM_FLEXIBLE},
    "gear_mesh": "gear_mesh",
    "planet_bearing": "bearings.planet",
    "carrier": "carrier",
    **{f"errors.{key}": f"errors.{key}" for key in GearErrors.model_fields},
}
_FOREIGN = (
    "kind", "pinion", "gear", "position", "double_helical", "half_gap", "ring_pressure_angle",
    "sun_pressure_angle",
)  # fmt: skip


def refuse_said_twice(written: Written, k: int) -> None:
    """InputError if keys that stage k takes from its own case were given in the train."""
    for key, home in [*_SAID.items(), *((key, "") for key in _FOREIGN)]:
        path = f"stages.{k}.{key}"
        given = next((f for p, f in written.fields.items() if f"{p}.".startswith(f"{path}.")), None)
        if given is None or (key == "kind" and given[3] == "planetary"):
            continue
        at, spelled = given[:2]
        if home:
            raise InputError(
                at, spelled, "is given for a flexible stage, which has it from its own case",
                f"take it out, or change stages.{k}.flexible.{home}",
            )  # fmt: skip
        raise InputError(at, spelled, "has no meaning in a flexible stage", "take it out")


def refuse_taken(data: Mapping[str, Any], path: Sequence[str | int], where: str, key: str) -> None:
    """InputError if ``path`` changes what a flexible stage of a train takes from its own case."""
    if len(path) < 3 or path[0] != "stages" or not isinstance(path[1], int):
        return
    stages = data["stages"]
    if path[1] >= len(stages) or stages[path[1]].get("flexible") is None:
        return
    inside = ".".join(str(p) for p in path[2:])
    home = next((h for k, h in _SAID.items() if f"{inside}.".startswith(f"{k}.")), None)
    if home is not None:
        raise InputError(
            where, key, "is what a flexible stage has from its own case",
            f"change stages.{path[1]}.flexible.{home}",
        )  # fmt: skip


def take_flexible(
    stage: dict[str, Any], k: int, where: str, folder: Path, load_stage: LoadStage
) -> None:
    """Read the case that stage k names into ``flexible``; what is there already changes it."""
    word = stage.get("case")
    if not isinstance(word, str):
        problem = "is missing" if word is None else f"{echo(word)} is not text"
        raise InputError(where, f"stages[{k}].case", problem, "name a bundled case or a file")
    path = folder / os.path.expanduser(word)
    case = load_stage(path if path.suffix == ".toml" or os.path.isfile(path) else word)
    stage["flexible"] = _merged(case.model_dump(mode="python"), stage.get("flexible", {}))
    resolve_files(stage["flexible"], folder)


def _merged(base: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """Nested data with values replaced."""
    out = dict(base)
    for key, value in changes.items():
        inside = out.get(key)
        deep = isinstance(value, dict) and isinstance(inside, dict)
        out[key] = _merged(inside, value) if deep else value  # type: ignore[arg-type]
    return out
