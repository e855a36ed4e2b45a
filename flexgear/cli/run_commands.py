"""Commands ``flexgear run``, all analyses of a case, and ``flexgear render``, its pictures."""

import math
from pathlib import Path
from typing import Annotated, Any

import typer
from typer import Argument, Option

from flexgear.cli import options
from flexgear.cli.display import COMPILED, Report, as_json_text, progress, show_verdicts, warn
from flexgear.files.atomic import staged_folder, write_json
from flexgear.model.case import Case
from flexgear.results.dataset_file import save
from flexgear.results.origin import origin_of_case
from flexgear.results.report.parts import Verdict
from flexgear.results.report.wording import with_unit
from flexgear.results.run_folder import FIELDS, Run, complete, read_folder
from flexgear.solve.bodies import reduced_bodies, when_done
from flexgear.solve.headlines import WARNING, verdicts
from flexgear.solve.run import Stopwatch
from flexgear.solve.run import run as run_all
from flexgear.solve.run_transients import compile_loops, loops_await_compilation
from flexgear.studies.early_workers import EarlyWorkers


def run(
    common: options.CaseOptions,
    out: options.OutFolder = None,
    pictures: Annotated[bool, Option(help="Draw pictures and the report.")] = True,
    interactive: options.Interactive = True,
) -> None:
    """Every analysis of a case, with results, summary, pictures and a report in one folder."""
    source = common.read_case()
    folder = Path("results") / source.name if out is None else out
    options.claim_folder(folder, options.RUN, origin_of_case(source, "run"), common.force)
    watch, compiles = Stopwatch(), loops_await_compilation()
    with (
        EarlyWorkers(
            pictures or compiles,
            import_renderer if pictures and source.flexible_stages else bool,
        ) as workers,
        staged_folder(folder, options.earlier(options.RUN)) as stage,
        progress(common.quiet) as report,
    ):
        compiled = workers.ahead(compile_loops, source) if compiles else None
        with watch.stage("bodies"):
            bodies = reduced_bodies(source, report)
        if compiled is not None:
            with watch.stage("compilation"):
                report(COMPILED, 0.0)
                when_done(compiled)  # its failure is no error: loops are then compiled here
                report(COMPILED, 1.0)
        result = run_all(source, report, watch, bodies=bodies, folder=stage)
        notes: list[str] = []
        lost: list[str] = []
        with watch.stage("saving"):
            options.save_or_rescue(lambda target: save_run(result, target, report), stage)
        if pictures:
            with watch.stage("pictures"), options.without_pictures(lost):
                from flexgear.cli.pictures import draw

                notes = draw(result, stage, stage, report, workers, interactive)
        summary = result.with_timing(**watch.seconds).summary
        write_json(stage / "summary.json", summary)
    warn([*summary["warnings"], *notes])
    options.require_pictures(lost, folder)
    if common.as_json:
        typer.echo(as_json_text(summary))
        return
    _show(f"{source.name}: results in {folder}", source, summary)


def _show(title: str, case: Case, summary: dict[str, Any]) -> None:
    """Print the headlines of the report of a run, each with its figure and its sentence."""
    typer.echo(title)
    power = with_unit(summary["power_flow"]["input_power_w"], "W")
    lowest = [m for m in summary["modes"]["lowest"] if m["frequency_hz"] > 0][:3]
    modes = ", ".join(f"{with_unit(m['frequency_hz'], 'Hz')} {m['type']}" for m in lowest)
    core = 1.0 / summary["realtime_factor"] if summary["realtime_factor"] else math.nan
    stepping = f"{with_unit(core, 's')} of one core for 1 s of running"
    show_verdicts([
        Verdict("note", "Power", f"{power} in", ""),
        *(v for v in verdicts(case, summary) if v.subject != WARNING),
        Verdict("note", "Lowest natural modes", modes, ""),
        Verdict("note", "Time stepping", stepping, ""),
    ])  # fmt: skip


def import_renderer() -> None:
    """Import the modules for pictures in a worker; other commands do not need them."""
    from flexgear.cli import pictures  # noqa: F401
    from flexgear.views import render, scenes  # noqa: F401

    render.load_renderer()


def save_run(result: Run, stage: Path, report: Report) -> None:
    """Write datasets, case and summary of a run into a folder."""
    datasets = {**result.datasets, **{f"{FIELDS}{n}": d for n, d in result.fields.items()}}
    for k, (name, data) in enumerate(datasets.items()):
        report("saving", k / len(datasets))
        if not (stage / f"{name}.nc").exists():  # transients are written during their solution
            save(data, stage / f"{name}.nc")
    write_json(stage / "case.json", result.case.to_dict())
    write_json(stage / "summary.json", result.summary)  # without the duration of pictures
    report("saving", 1.0)


def render(
    folder: Annotated[Path, Argument(metavar="DIR", help="Folder of a run.")],
    out: options.OutFolder = None,
    interactive: options.Interactive = True,
    force: options.Force = False,
    quiet: options.Quiet = False,
) -> None:
    """Draw the pictures and the report of an earlier run again."""
    target = folder if out is None else out
    content = read_folder(folder)
    options.claim_folder(target, options.PICTURES, origin_of_case(content.case), force)
    with progress(quiet) as report:
        warn(draw_again(content, folder, target, interactive, report))
    typer.echo(f"drew {content.case.name} into {target}")


def draw_again(
    content: Run, folder: Path, target: Path, interactive: bool, report: Report
) -> list[str]:
    """Draw pictures and report of the run in ``folder`` into ``target``; returns notes on omitted
    pictures."""
    from flexgear.cli.pictures import draw

    with (
        EarlyWorkers(True, import_renderer) as workers,
        complete(folder),
        staged_folder(target, options.earlier(options.PICTURES)) as stage,
    ):
        return draw(content, folder, stage, report, workers, interactive)
