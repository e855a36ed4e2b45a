"""Commands about ring and carrier: FE meshes and reductions."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Any

import typer

from flexgear.cli.display import present, progress, table, warn
from flexgear.cli.options import (
    AsJson,
    CaseName,
    Quiet,
    Settings,
    read_case,
    require_flexible,
)
from flexgear.cli.outputs import Force, claim_file, file_option
from flexgear.files.cache_folder import cache_directory
from flexgear.model.case import Case
from flexgear.model.errors import InputError
from flexgear.model.names import BodyName
from flexgear.results.origin import origin_of_case
from flexgear.solve.bodies import named, reduction_limit, rigid_bodies
from flexgear.solve.reduction_warnings import reduction_warnings
from flexgear.structures.fe_mesh import FeMesh, Groups, require_format, write_fe_mesh
from flexgear.structures.sources.of_case import fe_sources

Component = Annotated[
    str,
    typer.Option(
        "--component",
        "-c",
        metavar="ring|carrier|both",
        help="Which component; stage_1.ring in a train with several flexible stages.",
    ),
]


def components(case: Case, name: str) -> dict[BodyName, str]:
    """FE bodies that ``--component`` means, and how results call them; InputError where there are
    none."""
    require_flexible(case)
    chosen = {
        body: body.part if body.stage == "stage" else str(body)
        for view in case.flexible_stages.values()
        for body in view.fe_bodies
        if name in ("both", body.part, body)
    }
    if not chosen:
        raise InputError("--component", name, "is not a component", "name ring, carrier or both")
    return chosen


def mesh(
    case: CaseName,
    component: Component = "both",
    export: Annotated[
        Path | None,
        file_option("--export", "Write .vtu, .msh or .inp with the patches."),
    ] = None,
    groups: Annotated[
        bool, typer.Option("--groups", help="List the named groups that a file has, and where.")
    ] = False,
    settings: Settings = None,
    force: Force = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Generate (or read) the FE meshes of ring and carrier; export one, or list their groups."""
    source = read_case(case, settings, loaded=False)
    parts, stages = components(source, component), source.flexible_stages
    if groups and export is not None:
        raise InputError("--export", str(export), "writes no list of groups", "leave --groups out")
    if groups:
        tables = {label: fe_sources(stages[p.stage])[p].groups for p, label in parts.items()}
        if as_json:
            present("", {name: _groups(g) for name, g in tables.items()}, True)
            return
        typer.echo(f"{source.name}: named groups of FE meshes")
        for name, group in tables.items():
            typer.echo("")
            table(name, _families(group))
        return
    if export is not None and len(parts) != 1:
        first = next(iter(parts.values()))
        raise InputError("--export", str(export), "takes one component", f"add --component {first}")
    if export is not None:
        require_format(export)
    claim_file(export, origin_of_case(source), force)
    figures = {}
    with progress(quiet) as report:
        for part, label in parts.items():
            report(f"{label}: FE mesh", 0.0)
            fe_mesh = fe_sources(stages[part.stage])[part].fe_mesh()
            report(f"{label}: FE mesh", 1.0)
            figures[label] = _figures(fe_mesh)
            if export is not None:
                write_fe_mesh(fe_mesh, export, source.name)
    present(f"{source.name}: FE meshes, {_fidelity(source)}", figures, as_json)
    if export is not None and not as_json:
        typer.echo(f"\nwrote {export}, lengths in m")


def _fidelity(case: Case) -> str:
    """Of the FE meshes of its flexible stages."""
    return ", ".join(dict.fromkeys(s.solver.fidelity for s in case.flexible_stages.values()))


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
    case: CaseName,
    component: Component = "both",
    settings: Settings = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Reduce ring and carrier to their interface nodes, with error estimates; kept in a cache."""
    source = read_case(case, settings, loaded=False)
    parts, bodies = components(source, component), {}
    with progress(quiet) as report:
        for part, label in parts.items():
            stage, limit = source.flexible_stages[part.stage], reduction_limit(source, part.stage)
            bodies[part] = fe_sources(stage)[part].reduced(named(label, report), limit)
    warn(reduction_warnings(source, bodies, rigid_bodies(source)))
    figures = {
        label: {k: v for k, v in bodies[part].report.items() if not isinstance(v, list)}
        for part, label in parts.items()
    }
    rows = (
        figures
        if as_json
        else {name: _rows_of(body_report) for name, body_report in figures.items()}
    )
    present(f"{source.name}: reductions, {_fidelity(source)}", rows, as_json)
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
