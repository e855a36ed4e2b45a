"""``flexgear compare``: flexible and rigid variants, load sharing by analysis, cases and runs."""

import itertools
import math
import os
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from typer import Argument, Option

from flexgear.cli import options
from flexgear.cli.display import columns, present, progress, warn
from flexgear.cli.pictures import drawn_side
from flexgear.cli.run_commands import import_renderer
from flexgear.coupling.system import variant_label
from flexgear.model.case import Case
from flexgear.model.errors import InputError
from flexgear.results.origin import Origin
from flexgear.results.rating import Rating
from flexgear.results.report.sharing import DEFINITION
from flexgear.results.report.study_tables import equal_parts
from flexgear.results.report.wording import factor, number, scale, titled_by_stage, with_unit
from flexgear.results.run_folder import complete, read_folder
from flexgear.results.stage_part import displacement_of, has_pairs, stage_part, tooth_loads
from flexgear.results.time_figures import sharing_summary
from flexgear.solve.angles import lead_angles
from flexgear.solve.bodies import reduced_bodies
from flexgear.solve.model import assemble
from flexgear.solve.reduction_warnings import reduction_warnings
from flexgear.solve.result_warnings import beyond_all_planets, pulling_teeth
from flexgear.solve.run import models_of
from flexgear.solve.run_transients import is_static
from flexgear.solve.static import static
from flexgear.studies.compare import against as side_by_side
from flexgear.studies.compare import compare_sharing, lives
from flexgear.studies.early_workers import EarlyWorkers
from flexgear.studies.rating import rate
from flexgear.views.report import write_report

COLUMNS = {"instantaneous": "K", "mean-based": "mean-based", "cycle-based": "cycle-based"}
POSITIONS = 40  # carrier angles of a comparison of variants


@dataclass(frozen=True)
class Comparison(options.CaseOptions):
    """Options of a comparison."""

    other: Annotated[
        str | None, Argument(metavar="[B]", help="With folders of two runs: both in one report.")
    ] = None
    positions: Annotated[
        int | None, Option(min=1, help="Carrier angles in a period of the planets; 40.")
    ] = None
    cycles: Annotated[
        int | None, Option(min=1, help="Load sharing by analysis over so many gear-mesh cycles.")
    ] = None
    against: Annotated[
        str | None, Option(metavar="CASE", help="Another case: forces, bearing life.")
    ] = None
    life: Annotated[
        bool, Option("--life", help="With --against: safety and life under load cases.")
    ] = False
    out: Annotated[Path | None, options.file_option("The report of two runs (.html).")] = None
    interactive: options.Interactive = True

    def refuse_unused(self) -> None:
        """InputError for an option that the chosen kind of comparison does not use."""
        angles = {"--positions": self.positions, "--cycles": self.cycles}
        page = {"--out": self.out, "--no-interactive": not self.interactive}
        if self.other is not None:
            options.refuse_beside("folders of two runs", angles | {
                "--against": self.against, "--life": self.life, "--set": self.settings,
                "--json": self.as_json,
            })  # fmt: skip
            return
        options.refuse_without("folders of two runs", page)
        if self.against is not None:
            options.refuse_beside("--against", angles)
            return
        options.refuse_without("--against", {"--life": self.life})
        if self.cycles is not None:
            options.refuse_beside("--cycles", {"--positions": self.positions})


def compare(comparison: Comparison) -> None:
    """Flexible and rigid variants side by side; of a train its load sharing by every analysis; the
    folders of two runs in one report."""
    comparison.refuse_unused()
    if comparison.other is not None:
        compare_runs(comparison, comparison.other)
        return
    source = comparison.read_case()
    if comparison.against is not None:
        _against(source, options.read_case(comparison.against, None), comparison)
        return
    if comparison.positions is not None:
        options.require_flexible(source, "--positions")
    if comparison.cycles is None and source.fe_ring_stages:
        _variants(source, comparison)
    else:
        _sharing(source, comparison)


def _against(case: Case, reference: Case, comparison: Comparison) -> None:
    """Forces and bearing life of two cases, or their safety and life under load cases."""
    title = f"{case.name} against {reference.name}"
    if not comparison.life:
        present(title, side_by_side(case, reference), comparison.as_json)
        return
    with progress(comparison.quiet) as report:
        first, second = (rate(x, progress=report) for x in (case, reference))
    figures: dict[str, Any] = lives(first, second)
    if not comparison.as_json:
        figures = {"life": lines_of(first, second)}
        for one, other in ((first, second), (second, first)):
            if reasons := one.not_assessed.items() - other.not_assessed.items():
                figures[f"not assessed in {one.case.name}"] = dict(sorted(reasons))
    present(title, figures, comparison.as_json)


def lines_of(*ratings: Rating) -> dict[str, str]:
    """Each set of equal parts of two trains in words, by the weakest part of each train: "3 planets
    alike; load reserve 1.07 against 0.986, life 2e5 h against 1e5 h"."""
    lines, sides = {}, [{n: p for n, p in x.equal.items() if not p[0].missing} for x in ratings]
    for name in sides[0] | sides[1]:
        sets = [equal_parts(x, p[name]) for x, p in zip(ratings, sides, strict=True) if name in p]
        weakest = [p[name][0] if name in p else None for p in sides]
        texts = (
            [t.removesuffix("; ") for t in dict.fromkeys(sets) if t],
            ["–" if part is None else number(part.reserve, 3) for part in weakest],
            ["–" if part is None else with_unit(part.life, "h") for part in weakest],
        )
        alike, reserves, spans = (" against ".join(text) for text in texts)
        alike = f"{alike}; " if alike else ""
        lines[name] = f"{alike}load reserve {reserves}, life {spans}"
    return lines


def _variants(case: Case, comparison: Comparison) -> None:
    """Print figures of equilibria for every choice of flexible parts, the same in all stages."""
    (stage, inside), *_ = case.fe_ring_stages.items()
    period = inside.stage.planet_period
    angles = np.linspace(0, period, comparison.positions or POSITIONS, endpoint=False)
    figures: dict[str, dict[str, Any]] = {}
    with progress(comparison.quiet) as report:
        bodies = reduced_bodies(case, report, rigid=())
        warn(reduction_warnings(case, bodies, rigid=()))
        parts = list(dict.fromkeys(body.part for body in inside.flexible_bodies))
        choices = list(itertools.product((True, False), repeat=len(parts)))
        for k, choice in enumerate(choices):
            report("variants", k / len(choices))
            flexible = dict(zip(parts, choice, strict=True))
            rigid = [body for body in case.flexible_bodies if not flexible.get(body.part, True)]
            model = assemble(case, bodies=bodies, variant=rigid)
            data = static(model, lead_angles(case, model.flow, angles, stage))
            part = stage_part(data, stage)
            figures[variant_label(inside.flexible_bodies, rigid)] = {
                "load_sharing": sharing_summary(data, stage),
                "ring_tooth_load_n_max": (
                    float(tooth_loads(part, "ring").max()) if has_pairs(part) else None
                ),
                "tooth_displacement_um_max": 1e6 * float(np.abs(part["tooth_displacement"]).max()),
                "sun_wind_up_mrad_mean": 1e3
                * float(displacement_of(part, "sun").sel(dof="rz").mean()),
            }
        report("variants", 1.0)
    if comparison.as_json:
        present("", figures, True)
        return
    typer.echo(
        f"{titled_by_stage(case.name, stage)}: equilibria at rated torque over "
        f"{math.degrees(period):g} deg of the carrier"
    )
    loads = [row["ring_tooth_load_n_max"] for row in figures.values()]
    unit, by = scale([load for load in loads if load is not None], "N")
    head = (
        "flexible bodies",
        "K mean",
        "K max",
        f"tooth load {unit}",
        "ring tooth µm",
        "sun turns mrad",
    )
    rows = (
        (
            {"flexible": "all", "rigid": "none"}.get(label, label),
            *("–" if k is None else f"{k:.4f}" for k in sharing),
            "–" if load is None else number(by * load),
            number(row["tooth_displacement_um_max"]),
            number(row["sun_wind_up_mrad_mean"]),
        )
        for (label, row), load in zip(figures.items(), loads, strict=True)
        for sharing in [(row["load_sharing"]["mean"], row["load_sharing"]["max"])]
    )
    columns([head, *rows], "<>")


def _sharing(case: Case, comparison: Comparison) -> None:
    """Print load sharing by analysis and variant, with and without errors."""
    with progress(comparison.quiet) as report:
        models = models_of(case, report)
        first_model = next(iter(models.values()))
        warn(reduction_warnings(case, first_model.bodies, first_model.system.rigid_bodies))
        figures = compare_sharing(models, cycles=comparison.cycles, progress=report)
    largest = dict[str, float]()
    for group, row in itertools.chain(*(rows.items() for rows in figures.values())):
        largest[group] = max(largest.get(group, 0.0), row["instantaneous"] or 0.0)
    warn(pulling_teeth(case, beyond_all_planets(case, largest)))
    if comparison.as_json:
        present("", figures, True)
        return
    typer.echo(f"{case.name}: load sharing of the planets")
    groups = list(dict.fromkeys(g for rows in figures.values() for g in rows))
    if not groups:
        typer.echo("  no stage has planets that share a load")
        return
    for group in groups:
        of_group = {name: rows[group] for name, rows in figures.items() if group in rows}
        assumed = next(iter(of_group.values()))["iec_61400_4"]
        assumption = "" if assumed is None else f"   (IEC 61400-4 assumes {assumed:g})"
        typer.echo(f"\n{group} gear meshes{assumption}")
        rows = [
            (name, *("–" if row[d] is None else factor(row[d]) for d in COLUMNS))
            for name, row in of_group.items()
        ]
        columns([("", *COLUMNS.values()), *rows], "<>")
    typer.echo(f"\n{DEFINITION}")
    typer.echo(
        "mean-based, cycle-based: from the largest loads of gear-mesh cycles (docs/results.md)"
    )
    static = [label for label, context in models.items() if is_static(context)]
    if static:
        typer.echo(f"{'; '.join(static)}: rolls in one equilibrium, so there is no transient")


PAGE = Path("comparison.html")


def compare_runs(comparison: Comparison, second: str) -> None:
    """Write the report of two folders of runs."""
    first = comparison.case
    folders = [_folder(name) for name in (first, second)]
    runs = [read_folder(folder) for folder in folders]
    target = PAGE if comparison.out is None else comparison.out
    if target.suffix != ".html":
        raise InputError("--out", str(target), "is no page", "name a file that ends in .html")
    names = " against ".join(run.case.name for run in runs)
    options.claim_file(target, Origin(names), comparison.force)
    with (
        EarlyWorkers(True, import_renderer) as workers,
        tempfile.TemporaryDirectory(prefix="flexgear-") as scratch,
    ):
        sides = []
        for k, (run, folder) in enumerate(zip(runs, folders, strict=True)):
            with complete(folder), progress(comparison.quiet) as report:
                sides.append(drawn_side(run, folder, Path(scratch, str(k)), report, workers))
        with complete(Path(f"{first}, {second}")):
            of_one_case = runs[0].case.name == runs[1].case.name
            title = f"{runs[0].case.name}: {_folder_names(folders)}" if of_one_case else names
            write_report(target, title, names, sides, comparison.interactive)
    typer.echo(f"compared {first} (A) with {second} (B) in {target}")


def _folder_names(folders: Sequence[Path]) -> str:
    """Two folders as "run1 against run2", by paths relative to the folder that holds both."""
    paths = [folder.resolve() for folder in folders]
    common = Path(os.path.commonpath(paths))
    return " against ".join(str(p.relative_to(common)) if p != common else p.name for p in paths)


def _folder(name: str) -> Path:
    """Path of an existing folder; InputError for any other name."""
    if not Path(name).is_dir():
        problem = "is no folder of a run"
        remedy = "name two folders that `flexgear run` wrote, or a case alone"
        raise InputError("compare", name, problem, remedy)
    return Path(name)
