"""Commands about cases: check one, list, print or copy the bundled ones."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

import typer

from flexgear.cli.check_sections import derived
from flexgear.cli.display import present, table
from flexgear.cli.options import AsJson, CaseName, Settings, read_case
from flexgear.cli.outputs import file_option
from flexgear.files.atomic import file_target, write_bytes
from flexgear.model.bundled import bundled_cases, bundled_text
from flexgear.model.errors import InputError
from flexgear.model.load import load_case

RPM = 60 / (2 * math.pi)


def register(app: typer.Typer) -> None:
    """Add the commands of this module."""
    app.command()(check)
    app.command()(cases)


def check(case: CaseName, settings: Settings = None, as_json: AsJson = False) -> None:
    """Validate a case and print what follows from it: geometry, speeds, torques, forces."""
    found = read_case(case, settings, loaded=False)
    present(f"{found.name}: {found.title or 'valid'}", derived(found), as_json)


def cases(
    name: Annotated[str | None, typer.Argument(metavar="[NAME]", help="A bundled case.")] = None,
    copy: Annotated[Path | None, file_option("--copy", "Write the case to a new file.")] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace a file that is there.")] = False,
) -> None:
    """List the bundled cases, print one, or copy it to a file that you edit."""
    names = bundled_cases()
    if name is None:
        if copy is not None:
            raise InputError("--copy", str(copy), "needs a case", f"name one of {', '.join(names)}")
        table("bundled cases", {n: load_case(n).title for n in names})
        return
    if name not in names:
        raise InputError("cases", name, "is not bundled", f"name one of {', '.join(names)}")
    if copy is None:
        typer.echo(bundled_text(name), nl=False)
        return
    if file_target(copy).exists() and not force:
        raise InputError("--copy", str(copy), "is there already", "choose a new name, or --force")
    write_bytes(copy, bundled_text(name).encode())
    typer.echo(f"wrote {copy}; edit it, then: flexgear check {copy}")
