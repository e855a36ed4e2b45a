"""Commands about cases: check one, list, print or copy the bundled ones, their JSON schema."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from flexgear.cli.check_sections import Sections, derived, with_reasons
from flexgear.cli.display import as_json_text, present, table, warn
from flexgear.cli.options import AsJson, CaseName, Settings, read_case
from flexgear.cli.outputs import (
    CHECK,
    Force,
    claim_folder,
    earlier,
    file_option,
    folder_named,
    with_schema,
)
from flexgear.files.atomic import file_target, staged_folder, write_bytes, write_json
from flexgear.gears.implausible import implausible
from flexgear.gears.power_flow import power_flow
from flexgear.model.bundled import bundled_cases, bundled_text
from flexgear.model.case import Case
from flexgear.model.errors import InputError
from flexgear.model.input_file import MOST_CASE, read_bytes, read_text
from flexgear.model.load import load_case
from flexgear.model.schema import json_schema
from flexgear.model.upgrade import upgraded
from flexgear.results.origin import origin_of_case


def check(
    case: CaseName,
    settings: Settings = None,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", metavar="DIR", parser=folder_named,
            help="Folder for the same as summary.json, and a picture of every modified flank.",
        ),
    ] = None,
    force: Force = False,
    as_json: AsJson = False,
) -> None:  # fmt: skip
    """Validate a case and print what follows from it: geometry, speeds, torques, forces.

    What can hardly be meant, as colliding planets or stress beyond any steel, is a line each.
    """
    source = read_case(case, settings, loaded=False)
    if out is not None:
        claim_folder(out, CHECK, origin_of_case(source, "check"), force)
    figures, doubts = derived(source), implausible(source, power_flow(source))
    if out is not None:
        _write(out, source, figures, doubts)
    if as_json:
        typer.echo(as_json_text({**figures, "warnings": doubts}))
    else:
        present(f"{source.name}: {source.title or 'valid'}", with_reasons(figures))
    warn(doubts)


def _write(folder: Path, case: Case, figures: Sections, doubts: Sequence[str]) -> None:
    """Figures and pictures of modified flanks, in place of earlier ones."""
    from flexgear.results.run_folder import Folder
    from flexgear.views.chart import flanks, planned
    from flexgear.views.run_charts import FLANK
    from flexgear.views.style import save_figure

    plan = planned(Folder(case, power_flow(case), {}, {}, {}), [(flanks, [FLANK])])
    head = {"result": "check", "case": case.name, "content_hash": case.content_hash()}
    with staged_folder(folder, earlier(CHECK)) as stage:
        content = {**head, "figures": figures, "warnings": list(doubts)}
        write_json(stage / "summary.json", content)
        for name, picture in plan.items():
            save_figure(picture.draw(), stage / f"{name}.png")


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
    write_bytes(copy, with_schema(bundled_text(name), copy))
    typer.echo(f"wrote {copy}; edit it, then: flexgear check {copy}")


def upgrade(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="A case of an earlier version.")],
    out: Annotated[Path | None, file_option("--out", "Leave FILE alone, write this one.")] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace a file that is there.")] = False,
) -> None:
    """Write a case file of an earlier version in the form of this one, with its comments.

    FILE is replaced, and what it was is kept beside it with .orig after its name.
    """
    text = read_text(file)
    present = upgraded(text, str(file))
    if present == text:
        typer.echo(f"{file} has the present form already")
        return
    written = out or file.with_name(f"{file.name}.orig")
    if file_target(written).exists() and not force:
        raise InputError("upgrade", str(written), "is there already", "move it away, or --force")
    write_bytes(written, (text if out is None else present).encode())
    if out is None:
        write_bytes(file, present.encode())
    original = f"; what it was is {written}" if out is None else ""
    typer.echo(f"wrote {out or file}{original}")
    load_case(out or file)


def schema(
    summary: Annotated[bool, typer.Option("--summary", help="Of summary.json of a run.")] = False,
    out: Annotated[Path | None, file_option("--out", "Write it to a file.")] = None,
) -> None:
    """JSON schema of case files: keys, units, ranges and meanings, for editors of TOML; or of the
    summary.json of a run.

    An editor that knows taplo (Even Better TOML in VS Code) completes, explains and checks the keys
    of a case that begins with the line "#:schema ./flexgear.schema.json".
    """
    content = _summary_schema() if summary else json_schema()
    text = json.dumps(content, indent=1, ensure_ascii=False) + "\n"
    if out is None:
        typer.echo(text, nl=False)
        return
    there = file_target(out)
    if there.exists() and content["title"].encode() not in read_bytes(there, "--out", MOST_CASE):
        kind = "summaries" if summary else "cases"
        problem = f"is there and no schema of {kind}"
        raise InputError("--out", str(out), problem, "choose a new name")
    write_bytes(out, text.encode())
    if summary:
        typer.echo(f"wrote {out}")
        return
    typer.echo(f"wrote {out}; begin cases beside it with the line: #:schema ./{out.name}")


def _summary_schema() -> dict[str, Any]:
    from flexgear.results import summary_keys
    from flexgear.solve.headlines import rows_schema

    return summary_keys.json_schema({"headlines": rows_schema()})
