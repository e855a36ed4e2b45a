"""A case for a stage that does not exist yet, sized by rules of thumb from a few numbers."""

from __future__ import annotations

import math
import sys
from pathlib import Path
from typing import Annotated

import typer

from flexgear.cli.outputs import with_schema
from flexgear.files.atomic import file_target, write_bytes
from flexgear.files.new_case import new_case_text
from flexgear.gears.sizing import Wanted, propose
from flexgear.model.errors import InputError


def new(
    out: Annotated[Path, typer.Argument(metavar="FILE", help="The case to write.")],
    ratio: Annotated[
        float | None, typer.Option(help="Speed of the sun over that of the carrier.")
    ] = None,
    planets: Annotated[int | None, typer.Option(help="Number of planets.")] = None,
    torque: Annotated[
        float | None, typer.Option("--torque-nm", help="Rated torque of the carrier.")
    ] = None,
    speed: Annotated[
        float | None, typer.Option("--speed-rpm", help="Rated speed of the carrier.")
    ] = None,
    module: Annotated[
        float | None, typer.Option("--module-mm", help="Normal module; follows if left out.")
    ] = None,
    helix: Annotated[float, typer.Option("--helix-deg", help="Helix angle.")] = 0.0,
    double: Annotated[
        bool, typer.Option("--double-helical", help="Two halves of opposite hand.")
    ] = False,
    force: Annotated[bool, typer.Option("--force", help="Replace a file that is there.")] = False,
) -> None:
    """Propose a planetary stage with held ring for a ratio, torque and speed, as a commented case.

    Asks on a terminal for what is left out. Begins the case with its schema where
    flexgear.schema.json (flexgear schema --out) is beside it.
    """
    there = file_target(out)
    if there.exists() and not force:
        raise InputError("new", str(out), "is there already", "choose a new name, or --force")
    wanted = Wanted(
        ratio=_asked("--ratio", "speed of the sun over that of the carrier", ratio, 4.5),
        planets=round(_asked("--planets", "number of planets", planets, 4)),
        torque=_asked("--torque-nm", "rated torque of the carrier, N m", torque, 1e4),
        speed=_asked("--speed-rpm", "rated speed of the carrier, r/min", speed, 100.0)
        * math.pi
        / 30,
        helix=math.radians(helix),
        module=None if module is None else _positive("--module-mm", module) * 1e-3,
        double_helical=double,
    )
    found = propose(wanted)
    write_bytes(out, with_schema(new_case_text(found), there))
    typer.echo(
        f"wrote {out}: {found.sun}/{found.planet}/{found.ring} teeth of module "
        f"{1e3 * found.module:g} mm, ratio {found.ratio:.4g}; next: flexgear check {out}"
    )


def _asked(option: str, about: str, given: float | None, usual: float) -> float:
    """What was given, or the answer to a question."""
    if given is None and not sys.stdin.isatty():
        raise InputError("new", option, "is missing", f"give the {about}")
    return _positive(option, typer.prompt(about, usual, type=float) if given is None else given)


def _positive(option: str, value: float) -> float:
    if not (math.isfinite(value) and value > 0):
        raise InputError("new", option, f"{value:g} is not above 0", "correct it")
    return value
