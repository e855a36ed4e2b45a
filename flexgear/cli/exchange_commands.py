"""Commands that read what other programs write, and write what they read."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from flexgear.cli import options
from flexgear.cli.body_commands import Component, components
from flexgear.cli.display import as_json_text, progress
from flexgear.cli.entry import without_collection
from flexgear.files.atomic import folder_target, staged_folder, write_bytes
from flexgear.files.matrices.body import ReducedMatrices
from flexgear.files.matrices.exchange import FORMATS, write_reduced
from flexgear.files.rexs.from_case import model_of_case, not_written
from flexgear.files.rexs.reading import read_rexs
from flexgear.files.rexs.to_case import Imported, case_of_document
from flexgear.model.case import Case
from flexgear.model.errors import InputError
from flexgear.results.version import version
from flexgear.solve.bodies import named, reduction_limit


def import_rexs(
    file: Annotated[
        str, typer.Argument(metavar="FILE", help="A gearbox in REXS: .rexs, .rexsj or .rexsz.")
    ],
    out: Annotated[
        Path | None, options.file_option("--out", "The case; FILE's name with .toml.")
    ] = None,
    load_case: Annotated[
        int | None, typer.Option("--load-case", metavar="ID", help="The first one if left out.")
    ] = None,
    force: options.ForceNew = False,
    as_json: options.AsJson = False,
) -> None:
    """Make a commented case of a REXS file; each key says where it comes from."""
    target = Path(f"{Path(file).stem}.toml") if out is None else out
    options.require_new(target, "--out", force)
    with without_collection():
        imported = case_of_document(read_rexs(file), file, load_case)
    write_bytes(target, options.with_schema(imported.text, target))
    if as_json:
        content = {"case": str(target), "assumed": imported.assumed, "left_out": imported.left_out}
        typer.echo(as_json_text(content))
        return
    typer.echo(_summary(imported, target))


def export(
    case: options.CaseName,
    rexs: Annotated[
        Path | None, options.file_option("--rexs", "Gears, loads, results as REXS.")
    ] = None,
    reduced: Annotated[
        Path | None,
        typer.Option(
            "--reduced",
            metavar="DIR",
            help="Reduced FE bodies: stiffness, mass, table of nodes.",
            parser=options.folder_named,
        ),
    ] = None,
    form: Annotated[
        str, typer.Option("--format", metavar="op4|mtx|npz", help="Of the reduced matrices.")
    ] = "op4",
    component: Component = "all",
    recovery: Annotated[
        bool, typer.Option("--recovery", help="The way back to the FE mesh's vertices, too.")
    ] = False,
    settings: options.Settings = None,
    force: Annotated[bool, typer.Option("--force", help="Replace what is there.")] = False,
    quiet: options.Quiet = False,
) -> None:
    """Write a case for other programs: as a gearbox in REXS 2.0, as reduced matrices."""
    if rexs is None and reduced is None:
        raise InputError(
            "export", "--rexs", "is missing", "say what to write: --rexs box.rexs, --reduced DIR"
        )
    source = options.read_case(case, settings, loaded=False)
    if rexs is not None:
        _write_rexs(source, rexs, force)
    if reduced is not None:
        _write_reduced(source, reduced, form, component, recovery, force, quiet)


def _write_rexs(case: Case, rexs: Path, force: bool) -> None:
    if rexs.suffix.lower() != ".rexs":
        raise InputError("--rexs", str(rexs), "does not end in .rexs", "name it so")
    options.require_new(rexs, "--rexs", force)
    date = datetime.now(UTC).isoformat(timespec="seconds")
    write_bytes(rexs, model_of_case(case).xml("flexgear", version(), date))
    left = not_written(case)
    typer.echo(f"wrote {rexs}" + (f"; REXS does not hold: {', '.join(left)}" if left else ""))


def _write_reduced(
    case: Case, folder: Path, form: str, component: str, recovery: bool, force: bool, quiet: bool
) -> None:
    """Matrices of the bodies that are asked for, all of them or none."""
    if form not in FORMATS:
        raise InputError("--format", form, "is unknown", f"choose {', '.join(FORMATS)}")
    target = folder_target(folder)
    parts = components(case, component)
    there = [f for label in parts for f in sorted(target.glob(f"{label}[._]*"))]
    if there and not force:
        raise InputError(
            "--reduced", str(there[0]), "is there already", "name another folder, or --force"
        )
    written: list[str] = []
    with staged_folder(folder) as stage, progress(quiet) as report:
        for label, (_, source) in parts.items():
            body = source.reduced(named(label, report), reduction_limit(case))
            matrices = ReducedMatrices(
                label,
                body.node_names,
                body.positions,
                body.stiffness,
                body.mass,
                body.recovery.astype(np.float64) if recovery else None,
                body.points if recovery else None,
            )
            written += [path.name for path in write_reduced(matrices, stage, form)]
    typer.echo(f"wrote {', '.join(written)} to {folder}; N, m, kg")


def _summary(imported: Imported, target: Path) -> str:
    lines = ["assumed, or put right:", *(f"  {line}" for line in imported.assumed)]
    lines = lines if imported.assumed else ["nothing was assumed"]
    count = len(imported.left_out)
    if count:
        lines += ["", f"not carried over: {count} lines, listed at the end of the case"]
    return "\n".join([*lines, "", f"wrote {target}; look at it, then: flexgear check {target}"])
