"""``flexgear compare`` for trains: analyses and variants side by side, or two trains."""

from __future__ import annotations

from typing import Any

import typer

from flexgear.cli.display import present, progress, warn
from flexgear.model.case import Case
from flexgear.studies.reduction_warnings import train_warnings
from flexgear.studies.train_compare import against, compare_sharing, contexts, is_still
from flexgear.studies.train_model import train_bodies, train_variants

COLUMNS = {"instantaneous": "K", "hu-2023": "Hu 2023", "ren-2021": "Ren 2021"}


def compare_train(train: Case, cycles: int | None, as_json: bool, quiet: bool) -> None:
    """Load sharing by analysis and variant, with and without errors."""
    with progress(quiet) as report:
        bodies = train_bodies(train, report)
        warn(train_warnings(train, bodies, train_variants(train)))
        found = contexts(train, report, bodies)
        figures = compare_sharing(found, cycles=cycles, progress=report)
    if as_json:
        present("", figures, True)
        return
    typer.echo(f"{train.name}: load sharing of the planets at rated torque")
    groups = list(dict.fromkeys(g for rows in figures.values() for g in rows))
    if not groups:
        typer.echo("  no stage has planets that share a load")
        return
    width = max(len(x) for x in figures) + 2
    for group in groups:
        first = next(rows[group] for rows in figures.values() if group in rows)
        assumed = first["iec_61400_4"]
        said = "" if assumed is None else f"   (IEC 61400-4 assumes {assumed:g})"
        typer.echo(f"\n{group} gear meshes{said}")
        typer.echo("  " + " " * width + "".join(f"{c:>12}" for c in COLUMNS.values()))
        for name, rows in figures.items():
            if group in rows:
                values = "".join(_cell(rows[group][d]) for d in COLUMNS)
                typer.echo(f"  {name:<{width}}{values}")
    typer.echo(
        "\nK: largest N F/ΣF at any instant; Hu 2023, Ren 2021: by maxima of gear-mesh cycles"
    )
    still = [label for label, context in found.items() if is_still(context)]
    if still:
        typer.echo(
            f"{'; '.join(still)}: rolls in one equilibrium, so that a transient adds nothing"
        )


def _cell(value: float | None) -> str:
    return f"{'–':>12}" if value is None else f"{value:12.4f}"


def compare_trains(train: Case, reference: Case, as_json: bool) -> None:
    """Two trains side by side: mean forces, speeds, lives of planet bearings."""
    figures: dict[str, dict[str, Any]] = against(train, reference)
    present(f"{train.name} against {reference.name}", figures, as_json)
