"""Arguments and options that commands share, and the case they name."""

from __future__ import annotations

from typing import Annotated

import typer

from flexgear.coupling.build import require_workable
from flexgear.model.case import Case
from flexgear.model.errors import InputError
from flexgear.model.load import load_case

CaseName = Annotated[
    str, typer.Argument(metavar="CASE", help="A TOML file, or the name of a bundled case.")
]
Settings = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help="Change a key of the case; KEY= takes it out. Repeatable.",
    ),
]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON, for programs.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="No progress, only the outcome.")]
Rigid = Annotated[
    list[str] | None,
    typer.Option("--rigid", metavar="PART", help="Make ring, planet, carrier, shaft or all rigid."),
]
Workers = Annotated[
    int | None,
    typer.Option("--workers", min=1, metavar="N", help="Processes; as many as pay if left out."),
]
Scheduler = Annotated[
    str | None,
    typer.Option(
        "--scheduler", metavar="ADDRESS", help="A Dask cluster instead, e.g. tls://host:8786."
    ),
]


def settings_of(settings: list[str] | None) -> dict[str, str]:
    """Keys and values of ``--set``."""
    overrides = {}
    for setting in settings or []:
        key, sign, value = setting.partition("=")
        if any("\ud800" <= letter <= "\udfff" for letter in setting):
            raise InputError("--set", setting, "is not UTF-8 text", "give plain text")
        if not sign or not key.strip():
            raise InputError("--set", setting, "is not KEY=VALUE", "e.g. --set stage.planets=4")
        overrides[key.strip()] = value.strip()
    return overrides


def read_case(name: str, settings: list[str] | None, *, loaded: bool = True) -> Case:
    """The case with ``--set`` carried out; what cannot work is said now.

    loaded: whether it is needed for more than its modes, so that free vibration will not do.
    """
    case = load_case(name, settings_of(settings))
    if loaded:
        case.require_load()
    require_workable(case)
    return case


def require_flexible(case: Case, option: str = "") -> None:
    """InputError for a case of lumped members alone, which have no FE mesh.

    option: what was given that only bodies that bend can have.
    """
    if not case.flexible_stages:
        raise InputError(
            option or case.source,
            case.name if option else "stages",
            "has only lumped members, so nothing of it bends",
            "take it out, or build a flexible stage into the train (stages.case)"
            if option
            else "name a case with a flexible stage",
        )


def rigid_parts(names: list[str] | None, case: Case) -> tuple[str, ...]:
    """Components named by ``--rigid``."""
    from flexgear.solve.bodies import rigid_bodies

    parts = tuple(n.strip() for text in names or [] for n in text.split(","))
    rigid_bodies(case, parts)
    return tuple(dict.fromkeys(parts))
