"""Commands that read what other programs write, and write what they read."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated

import typer

from flexgear.cli.display import as_json_text
from flexgear.cli.options import AsJson, CaseName, Settings, read_case
from flexgear.cli.outputs import file_option
from flexgear.files.atomic import file_target, write_bytes
from flexgear.files.rexs.from_case import model_of_case, not_written
from flexgear.files.rexs.reading import read_rexs
from flexgear.files.rexs.to_case import Imported, case_of_document
from flexgear.model.errors import InputError
from flexgear.results.version import version


def register(app: typer.Typer) -> None:
    """Add the commands of this module."""
    app.command("import")(import_rexs)
    app.command()(export)


def import_rexs(
    file: Annotated[
        str, typer.Argument(metavar="FILE", help="A gearbox in REXS: .rexs, .rexsj or .rexsz.")
    ],
    out: Annotated[Path | None, file_option("--out", "The case; FILE's name with .toml.")] = None,
    load_case: Annotated[
        int | None, typer.Option("--load-case", metavar="ID", help="The first one if left out.")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace a file that is there.")] = False,
    as_json: AsJson = False,
) -> None:
    """Make a commented case of a REXS file; each key says where it comes from."""
    target = Path(f"{Path(file).stem}.toml") if out is None else out
    _require_new(target, "--out", force)
    made = case_of_document(read_rexs(file), file, load_case)
    write_bytes(target, made.text.encode())
    if as_json:
        found = {"case": str(target), "assumed": made.assumed, "left_out": made.left_out}
        typer.echo(as_json_text(found))
        return
    typer.echo(_summary(made, target))


def export(
    case: CaseName,
    rexs: Annotated[Path | None, file_option("--rexs", "Write gears, loads, results.")] = None,
    settings: Settings = None,
    force: Annotated[bool, typer.Option("--force", help="Replace what is there.")] = False,
) -> None:
    """Write a case for other programs: as a gearbox in REXS 2.0."""
    if rexs is None:
        raise InputError("export", "--rexs", "is missing", "say what to write: --rexs box.rexs")
    found = read_case(case, settings, loaded=False)
    if rexs.suffix.lower() != ".rexs":
        raise InputError("--rexs", str(rexs), "does not end in .rexs", "name it so")
    _require_new(rexs, "--rexs", force)
    date = datetime.now(UTC).isoformat(timespec="seconds")
    write_bytes(rexs, model_of_case(found).xml("flexgear", version(), date))
    left = not_written(found)
    typer.echo(f"wrote {rexs}" + (f"; REXS does not hold: {', '.join(left)}" if left else ""))


def _require_new(path: Path, option: str, force: bool) -> None:
    if file_target(path).exists() and not force:
        raise InputError(option, str(path), "is there already", "choose a new name, or --force")


def _summary(made: Imported, target: Path) -> str:
    lines = ["assumed, or put right:", *(f"  {line}" for line in made.assumed)]
    lines = lines if made.assumed else ["nothing was assumed"]
    count = len(made.left_out)
    if count:
        lines += ["", f"not carried over: {count} lines, listed at the end of the case"]
    return "\n".join([*lines, "", f"wrote {target}; look at it, then: flexgear check {target}"])
