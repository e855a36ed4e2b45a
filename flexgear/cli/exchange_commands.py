"""Commands for FE meshes and reductions of bodies, and for files of other programs."""

import math
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from typer import Argument, Option

from flexgear.cli import options
from flexgear.cli.display import as_json_text, present, progress, table, warn
from flexgear.cli.entry import without_collection
from flexgear.coupling.pace import case_pace
from flexgear.files.atomic import folder_target, staged_folder, write_bytes
from flexgear.files.cache_folder import cache_directory
from flexgear.files.matrices.body import ReducedMatrices
from flexgear.files.matrices.exchange import FORMATS, write_reduced
from flexgear.files.rexs.from_case import model_of_case, not_written
from flexgear.files.rexs.reading import read_rexs
from flexgear.files.rexs.to_case import Imported, case_of_document
from flexgear.model.case import Case
from flexgear.model.errors import InputError
from flexgear.model.names import BodyName
from flexgear.results.origin import origin_of_case
from flexgear.results.version import version
from flexgear.solve.bodies import named, rigid_bodies
from flexgear.solve.reduction_warnings import reduction_warnings
from flexgear.structures.fe_mesh.fe_mesh import FeMesh
from flexgear.structures.fe_mesh.files import require_format, write_fe_mesh
from flexgear.structures.fe_mesh.groups import Groups
from flexgear.structures.sources.fe_body import FeBody
from flexgear.structures.sources.of_case import fe_sources

Component = Annotated[
    str,
    Option(
        "--component",
        "-c",
        metavar="ring|planet|carrier|all",
        help="Which component; stage_1.ring in a train with several flexible stages.",
    ),
]


def components(case: Case, name: str) -> dict[str, tuple[BodyName, FeBody]]:
    """Names and sources of the FE bodies that the option ``--component`` selects, by their label in
    results. InputError if there are none."""
    options.require_flexible(case)
    chosen = {
        body.part if body.stage == "stage" else str(body): (body, source)
        for view in case.flexible_stages.values()
        for body, source in fe_sources(view).items()
        if name in ("all", body.part, body)
    }
    if not chosen:
        raise InputError(
            "--component", name, "is not a component", "name ring, planet, carrier or all"
        )
    return chosen


def fe_meshes(
    common: options.CaseOptions,
    component: Component = "all",
    export: Annotated[
        Path | None,
        options.file_option("Write .vtu, .msh or .inp with the patches."),
    ] = None,
    groups: Annotated[
        bool,
        Option("--groups", help="List the named groups that a mesh file needs, with positions."),
    ] = False,
) -> None:
    """Generate (or read) FE meshes of ring, planets and carrier; export one, or list groups."""
    source = common.read_case(loaded=False)
    parts = components(source, component)
    if groups and export is not None:
        raise InputError("--export", str(export), "writes no list of groups", "leave --groups out")
    if groups:
        tables = {label: body.groups for label, (_, body) in parts.items()}
        if common.as_json:
            present("", {name: _groups(g) for name, g in tables.items()}, True)
            return
        typer.echo(f"{source.name}: named groups of FE meshes")
        for name, group in tables.items():
            typer.echo("")
            table(name, _families(group))
        return
    if export is not None and len(parts) != 1:
        first = next(iter(parts))
        raise InputError("--export", str(export), "takes one component", f"add --component {first}")
    if export is not None:
        require_format(export)
    options.claim_file(export, origin_of_case(source), common.force)
    figures = {}
    with progress(common.quiet) as report:
        for label, (_, body) in parts.items():
            report(f"{label}: FE mesh", 0.0)
            fe_mesh = body.fe_mesh()
            report(f"{label}: FE mesh", 1.0)
            figures[label] = _figures(fe_mesh)
            if export is not None:
                write_fe_mesh(fe_mesh, export, source.name)
    present(f"{source.name}: FE meshes, {source.solver.fidelity}", figures, common.as_json)
    if export is not None and not common.as_json:
        typer.echo(f"\nwrote {export}, lengths in m")


def _families(groups: Groups) -> dict[str, str]:
    """Groups of a mesh by kind: meaning and position in words, by name."""
    rows = {}
    for f in groups.families:
        if not f.names:
            continue
        name = f"{f.names[0]} … {f.names[-1]}" if f.names[1:] else f.names[0]
        first = groups.point(f.places[0])
        at = f", {'the first ' if f.names[1:] else ''}at {first}" if first else ""
        side = f", on the {'+' if f.side > 0 else '-'}z side" if f.side else ""
        rows[name] = f"{'needed' if f.needed else 'may be there'}: {f.meaning}{at}{side}"
    return rows


def _groups(groups: Groups) -> dict[str, Any]:
    """Every group with its position, m; None for a coordinate that the case does not determine."""
    return {
        name: {
            "needed": f.needed,
            "meaning": f.meaning,
            "centre_m": [float(x) if math.isfinite(x) else None for x in place],
            "side": {1: "+z", -1: "-z", 0: None}[f.side],
        }
        for f in groups.families
        for name, place in zip(f.names, f.places, strict=True)
    }


def _figures(fe_mesh: FeMesh) -> dict[str, Any]:
    return {
        "vertices": len(fe_mesh.points),
        "cells": len(fe_mesh.cells),
        "kind": fe_mesh.kind,
        "dofs": fe_mesh.quadratic_dofs,
        "quality": float(fe_mesh.quality()),
        "volume_m3": float(fe_mesh.volume()),
        "patches": len(fe_mesh.facets),
    }


def reduce(
    case: options.CaseName,
    component: Component = "all",
    settings: options.Settings = None,
    as_json: options.AsJson = False,
    quiet: options.Quiet = False,
) -> None:
    """Reduce FE bodies to their interface nodes, with error estimates; results are cached."""
    source = options.read_case(case, settings, loaded=False)
    parts, pace = components(source, component), case_pace(source)
    with progress(quiet) as report:
        bodies = {
            name: body.reduced(named(label, report), pace.reduction_limit_of(name))
            for label, (name, body) in parts.items()
        }
    warn(reduction_warnings(source, bodies, rigid_bodies(source)))
    figures = {}
    for label, body in zip(parts, bodies.values(), strict=True):
        figures[label] = {k: v for k, v in body.report.items() if not isinstance(v, list)}
        if not as_json:
            seconds = sum(body.report.get("seconds", {}).values())
            printed = {k: v for k, v in figures[label].items() if k in PRINTED}
            figures[label] = {**printed, "time_s": seconds}
    present(f"{source.name}: reductions, {source.solver.fidelity}", figures, as_json)
    if not as_json:
        typer.echo(f"\nstored in {cache_directory()}")


PRINTED = (  # figures of a reduction; the others are only in --json
    "fe_dofs", "interface_dofs", "fixed_interface_modes", "fixed_interface_frequency_max_hz", "tie",
    "static_error", "static_error_cases", "frequency_error", "frequency_limit_hz",
    "frequency_error_on_these_supports",
)  # fmt: skip


def import_rexs(
    file: Annotated[
        str, Argument(metavar="FILE", help="A gearbox in REXS: .rexs, .rexsj or .rexsz.")
    ],
    out: Annotated[Path | None, options.file_option("The case; FILE's name with .toml.")] = None,
    load_case: Annotated[
        int | None, Option(metavar="ID", help="The first one if left out.")
    ] = None,
    force: options.ForceNew = False,
    as_json: options.AsJson = False,
) -> None:
    """Make a commented case of a REXS file; each key states its source."""
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
    rexs: Annotated[Path | None, options.file_option("Gears, loads, results as REXS.")] = None,
    reduced: Annotated[
        Path | None,
        options.folder_option("Reduced FE bodies: stiffness, mass, table of nodes."),
    ] = None,
    form: Annotated[
        str, Option("--format", metavar="op4|mtx|npz", help="Of the reduced matrices.")
    ] = "op4",
    component: Component = "all",
    recovery: Annotated[
        bool, Option("--recovery", help="Also the recovery at the vertices of the FE meshes.")
    ] = False,
    settings: options.Settings = None,
    force: Annotated[bool, Option("--force", help="Replace what is there.")] = False,
    quiet: options.Quiet = False,
) -> None:
    """Write a case for other programs: as a gearbox in REXS 2.0, as reduced matrices."""
    if rexs is None and reduced is None:
        raise InputError(
            "export", "--rexs", "is missing", "name the output: --rexs box.rexs, --reduced DIR"
        )
    source = options.read_case(case, settings, loaded=False)
    if rexs is not None:
        _write_rexs(source, rexs, force)
    if reduced is not None:
        _write_reduced(source, reduced, form, component, recovery, force, quiet)


def _write_rexs(case: Case, rexs: Path, force: bool) -> None:
    if rexs.suffix.lower() != ".rexs":
        raise InputError("--rexs", str(rexs), "does not end in .rexs", "use this suffix")
    options.require_new(rexs, "--rexs", force)
    write_bytes(rexs, model_of_case(case).xml(version()))
    left = not_written(case)
    typer.echo(f"wrote {rexs}" + (f"; not in the file: {', '.join(left)}" if left else ""))


def _write_reduced(
    case: Case, folder: Path, form: str, component: str, recovery: bool, force: bool, quiet: bool
) -> None:
    """Write the matrices of the selected bodies; an error leaves the folder as it was."""
    if form not in FORMATS:
        raise InputError("--format", form, "is unknown", f"choose {', '.join(FORMATS)}")
    target = folder_target(folder)
    parts, pace = components(case, component), case_pace(case)
    existing = [f for label in parts for f in sorted(target.glob(f"{label}[._]*"))]
    if existing and not force:
        raise InputError(
            "--reduced", str(existing[0]), "is there already", "name another folder, or --force"
        )
    written: list[str] = []
    with staged_folder(folder) as stage, progress(quiet) as report:
        for label, (name, source) in parts.items():
            body = source.reduced(named(label, report), pace.reduction_limit_of(name))
            matrices = ReducedMatrices(
                label,
                body.node_names,
                body.positions,
                body.stiffness,
                body.mass,
                body.recovery[:].astype(np.float64) if recovery else None,
                body.points if recovery else None,
            )
            written += [path.name for path in write_reduced(matrices, stage, form)]
    typer.echo(f"wrote {', '.join(written)} to {folder}; N, m, kg")


def _summary(imported: Imported, target: Path) -> str:
    """Assumptions and losses of an import, in lines."""
    lines = ["assumed, or corrected:", *(f"  {line}" for line in imported.assumed)]
    lines = lines if imported.assumed else ["nothing was assumed"]
    if imported.left_out:
        count = len(imported.left_out)
        lines += ["", f"not imported: {count} lines, listed at the end of the case"]
    return "\n".join([*lines, "", f"wrote {target}; look at it, then: flexgear check {target}"])
