"""Commands about FE bodies: their meshes and reductions."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Any

import typer

from flexgear.cli import options
from flexgear.cli.display import present, progress, table, warn
from flexgear.files.cache_folder import cache_directory
from flexgear.model.case import Case
from flexgear.model.errors import InputError
from flexgear.model.names import BodyName
from flexgear.results.origin import origin_of_case
from flexgear.solve.bodies import named, reduction_limit, rigid_bodies
from flexgear.solve.result_warnings import reduction_warnings
from flexgear.structures.fe_mesh import FeMesh, Groups, require_format, write_fe_mesh
from flexgear.structures.sources.fe_body import FeBody
from flexgear.structures.sources.of_case import fe_sources

Component = Annotated[
    str,
    typer.Option(
        "--component",
        "-c",
        metavar="ring|planet|carrier|all",
        help="Which component; stage_1.ring in a train with several flexible stages.",
    ),
]


def components(case: Case, name: str) -> dict[str, tuple[BodyName, FeBody]]:
    """FE bodies that the option ``--component`` selects, each with its source, by the names that
    results give them. InputError where it selects none."""
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


def mesh(
    case: options.CaseName,
    component: Component = "all",
    export: Annotated[
        Path | None,
        options.file_option("--export", "Write .vtu, .msh or .inp with the patches."),
    ] = None,
    groups: Annotated[
        bool, typer.Option("--groups", help="List the named groups that a file has, and where.")
    ] = False,
    settings: options.Settings = None,
    force: options.Force = False,
    as_json: options.AsJson = False,
    quiet: options.Quiet = False,
) -> None:
    """Generate (or read) FE meshes of ring, planets and carrier; export one, or list groups."""
    source = options.read_case(case, settings, loaded=False)
    parts = components(source, component)
    if groups and export is not None:
        raise InputError("--export", str(export), "writes no list of groups", "leave --groups out")
    if groups:
        tables = {label: body.groups for label, (_, body) in parts.items()}
        if as_json:
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
    options.claim_file(export, origin_of_case(source), force)
    figures = {}
    with progress(quiet) as report:
        for label, (_, body) in parts.items():
            report(f"{label}: FE mesh", 0.0)
            fe_mesh = body.fe_mesh()
            report(f"{label}: FE mesh", 1.0)
            figures[label] = _figures(fe_mesh)
            if export is not None:
                write_fe_mesh(fe_mesh, export, source.name)
    present(f"{source.name}: FE meshes, {source.solver.fidelity}", figures, as_json)
    if export is not None and not as_json:
        typer.echo(f"\nwrote {export}, lengths in m")


def _families(groups: Groups) -> dict[str, str]:
    """Groups by kind, in words."""
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
    """Every group with its place, m; null where the case leaves a coordinate open."""
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
    """Reduce FE bodies to their interface nodes, with error estimates; kept in a cache."""
    source = options.read_case(case, settings, loaded=False)
    parts, limit = components(source, component), reduction_limit(source)
    with progress(quiet) as report:
        bodies = {
            name: body.reduced(named(label, report), limit) for label, (name, body) in parts.items()
        }
    warn(reduction_warnings(source, bodies, rigid_bodies(source)))
    figures = {
        label: {k: v for k, v in body.report.items() if not isinstance(v, list)}
        for label, body in zip(parts, bodies.values(), strict=True)
    }
    rows = (
        figures
        if as_json
        else {name: _rows_of(body_report) for name, body_report in figures.items()}
    )
    present(f"{source.name}: reductions, {source.solver.fidelity}", rows, as_json)
    if not as_json:
        typer.echo(f"\nkept in {cache_directory()}")


SHOWN = (  # of a reduction: the rest is for programs
    "fe_dofs", "interface_dofs", "fixed_interface_modes", "fixed_interface_frequency_max_hz", "tie",
    "static_error", "static_error_cases", "frequency_error", "frequency_limit_hz",
    "frequency_error_on_these_supports",
)  # fmt: skip


def _rows_of(report: dict[str, Any]) -> dict[str, Any]:
    """What a person looks at: sizes, errors beside the full FE mesh, and the time it took."""
    rows = {key: report[key] for key in SHOWN if key in report}
    return {**rows, "time_s": sum(report.get("seconds", {}).values())}
