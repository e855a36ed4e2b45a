"""Arguments and options that commands share, and the case they name."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from flexgear.gears.contact import gear_mesh_paths
from flexgear.gears.geometry import stage_geometry
from flexgear.model.case import Case, load_case
from flexgear.model.errors import InputError

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
OutFolder = Annotated[Path | None, typer.Option("--out", metavar="DIR", help="Folder for results.")]
PARTS = ("ring", "carrier", "shaft")


def read_case(name: str, settings: list[str] | None) -> Case:
    """The case with ``--set`` carried out; its gears assemble."""
    overrides = {}
    for setting in settings or []:
        key, sign, value = setting.partition("=")
        if not sign or not key.strip():
            raise InputError("--set", setting, "is not KEY=VALUE", "e.g. --set stage.planets=4")
        overrides[key.strip()] = value.strip()
    case = load_case(name, overrides)
    # what cannot work is said now, with the name of the file, not after minutes of meshing
    stage_geometry(case.stage, case.source)
    gear_mesh_paths(case)
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
