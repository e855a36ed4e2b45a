"""How keys name the stages of a case: by number, by name, or ``stage`` where there is one."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from flexgear.model.errors import InputError, echo
from flexgear.model.read import is_place, nearest


def numbered(key: str, data: Mapping[str, Any], where: str) -> list[str]:
    """Parts of a dotted key with stages by number: stage.planets -> stages, 0, planets.

    data: that of the case, with ``stages``. where: named in an InputError.
    """
    stages = data.get("stages", ())
    if key == "stage":
        raise InputError(where, key, "is a section, not a key", "name a key of it: stage.planets")
    parts = key.split(".")
    if parts[0] == "stage":
        if len(stages) != 1:
            raise InputError(
                where, key, f"there are {len(stages)} stages", "write stages.NAME. or stages.0."
            )
        return ["stages", "0", *parts[1:]]
    if parts[0] == "stages" and len(parts) > 1 and not is_place(parts[1]):
        names = [s.get("name") or f"stage_{k}" for k, s in enumerate(stages, 1)]
        if parts[1] not in names:
            raise InputError(
                where, key, f"no stage is named {echo(parts[1])}", nearest(parts[1], names)
            )
        return ["stages", str(names.index(parts[1])), *parts[2:]]
    return parts


def aliased(text: str) -> str:
    """The only stage of a case as [stage] names it."""
    return text.replace("stages[0]", "stage").replace("stages.0", "stage")


def of_only_stage(fault: InputError) -> InputError:
    """A fault of a file with [stage], whose keys it names as that file does."""
    return InputError(
        fault.where, aliased(fault.key), aliased(fault.problem), aliased(fault.remedy)
    )
