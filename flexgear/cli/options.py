"""Arguments and options that commands share, and the case they name."""

from __future__ import annotations

from typing import Annotated

import typer

from flexgear.coupling.workable import require_workable
from flexgear.model.case import Case
from flexgear.model.errors import InputError
from flexgear.model.flexible_stage import FlexibleStage
from flexgear.model.load import load_case

CaseName = Annotated[
    str, typer.Argument(metavar="CASE", help="A TOML file, or the name of a bundled case.")
]
Settings = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="Change a key of the case; repeatable."),
]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON, for programs.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="No progress, only the outcome.")]
Rigid = Annotated[
    list[str] | None,
    typer.Option("--rigid", metavar="PART", help="Make ring, carrier, shaft or all rigid."),
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
PARTS = ("ring", "carrier", "shaft")


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


def read_case(
    name: str, settings: list[str] | None, *, loaded: bool = True
) -> FlexibleStage | Case:
    """The flexible stage or train with ``--set`` carried out; what cannot work is said now.

    loaded: whether it is needed for more than its modes, so that free vibration will not do.
    """
    case = load_case(name, settings_of(settings))
    if loaded and isinstance(case, Case):
        case.require_load()
    require_workable(case)
    return case


def read_stage(name: str, settings: list[str] | None) -> FlexibleStage:
    """A flexible stage; InputError for a train, whose members are lumped."""
    case = read_case(name, settings)
    if isinstance(case, Case):
        raise InputError(
            case.source,
            "kind",
            "is a train, whose ring and carrier are lumped",
            "name a flexible stage, or the one that the train is built with",
        )
    return case


def rigid_parts(names: list[str] | None) -> tuple[str, ...]:
    """Components named by ``--rigid``."""
    parts: list[str] = []
    for name in (n.strip() for given in names or [] for n in given.split(",")):
        if name == "all":
            parts += PARTS
        elif name in PARTS:
            parts.append(name)
        else:
            raise InputError(
                "--rigid", name, "is not a component", "name ring, carrier, shaft or all"
            )
    return tuple(dict.fromkeys(parts))


def refuse_for_stages(case: FlexibleStage, **given: object) -> None:
    """InputError if an option that only trains have was given for a flexible stage."""
    for option, value in given.items():
        if value:
            raise InputError(
                f"--{option.replace('_', '-')}",
                case.name,
                "is a flexible stage; this option is for trains",
                'take it out, or name a case with kind = "train"',
            )


def refuse_for_trains(train: Case, **given: object) -> None:
    """InputError if an option that only flexible stages have was given for a lumped train."""
    for option, value in given.items():
        if value:
            raise InputError(
                f"--{option.replace('_', '-')}",
                train.name,
                "has only lumped members, so nothing of it bends",
                "take it out, or build a flexible stage into the train (stages.case)",
            )
