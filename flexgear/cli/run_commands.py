"""The whole job, and its pictures drawn again."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from flexgear.cli.display import Report, as_json_text, modes_kept, progress, table, warn
from flexgear.cli.options import AsJson, CaseName, Quiet, Settings, read_case
from flexgear.cli.outputs import (
    PICTURES,
    RUN,
    Force,
    Interactive,
    OutFolder,
    claim_folder,
    require_pictures,
    save_or_rescue,
    without_pictures,
)
from flexgear.cli.pictures import Sheet, draw
from flexgear.cli.run_folder import FIELDS, Folder, complete, read_folder
from flexgear.files.atomic import staged_folder, write_json
from flexgear.results.dataset import save
from flexgear.results.origin import origin_of_case
from flexgear.solve.bodies import reduced_bodies
from flexgear.solve.run import Run, Stopwatch
from flexgear.solve.run import run as run_all


def run(
    case: CaseName,
    out: OutFolder = None,
    settings: Settings = None,
    pictures: Annotated[bool, typer.Option(help="Draw pictures and the report.")] = True,
    interactive: Interactive = True,
    force: Force = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Every analysis of a case, with results, summary, pictures and a report in one folder."""
    found = read_case(case, settings)
    folder = Path("results") / found.name if out is None else out
    claim_folder(folder, RUN, origin_of_case(found, "run"), force)
    watch = Stopwatch()
    with staged_folder(folder) as stage, progress(quiet) as report:
        with watch.stage("bodies"):
            bodies = reduced_bodies(found, report)
        result = run_all(found, report, watch, bodies=bodies, place=stage)
        content = Folder(found, result.flow, result.datasets, result.fields, result.summary)
        notes: list[str] = []
        lost: list[str] = []
        with watch.stage("saving"):
            save_or_rescue(lambda place: _save(result, place, report), stage)
        if pictures:
            with watch.stage("pictures"), without_pictures(lost):
                notes = draw(content, Sheet(stage, stage), report, interactive)
        summary = result.with_timing(**watch.seconds).summary
        write_json(stage / "summary.json", summary)
    warn([*summary["warnings"], *notes])
    require_pictures(lost, folder)
    if as_json:
        typer.echo(as_json_text(summary))
        return
    table(f"{found.name}: results in {folder}", _told(summary))


def _told(summary: dict[str, Any]) -> dict[str, Any]:
    """What a run says at its end."""
    rows: dict[str, Any] = {"power": f"{summary['power_flow']['input_power_w'] / 1e3:.6g} kW in"}
    if summary["kind"] == "stage":
        steady = summary["steady"]
        rows |= {
            "carrier speed": f"{steady['carrier_speed_rpm_mean']:.4f} rpm",
            "mean ring mesh force": f"{steady['ring_mesh_force_n_mean'] / 1e3:.6g} kN, expected "
            f"{summary['kinematics']['expected_ring_mesh_force_n'] / 1e3:.6g} kN",
            "tooth node 1, peak": {
                k: f"{v:.4g} µm" for k, v in steady["tooth_displacement_peak_um"].items()
            },
            "load sharing": {k: v["mean"] for k, v in steady["load_sharing"].items()},
        }
    lowest = [m for m in summary["modes"]["lowest"] if m["frequency_hz"] > 0][:3]
    rows |= {
        "lowest modes": ", ".join(f"{m['frequency_hz']:.4g} Hz {m['type']}" for m in lowest),
        "largest K, quasi-static": _largest(
            list(_first(summary["load_sharing"]["quasi_static"]).values())
        ),
        "largest K, transient": _largest([_first(summary["load_sharing"]["transient"])]),
    }
    difference = summary["harmonic"].get("largest_difference")
    if difference is not None:
        rows["harmonic against transient"] = f"{100 * difference:.3f} % of the largest force apart"
    rows["modes kept"] = modes_kept(summary["system"])
    if summary["energy_residual"] is not None:
        rows["energy residual"] = f"{100 * summary['energy_residual']:.3f} %"
    rows["faster than real time"] = f"{summary['realtime_factor']:.2f} x"
    return rows


def _first(variants: dict[str, dict[str, Any]]) -> dict[str, Any]:
    """The case as it is, which comes before its variants."""
    return next(iter(variants.values()), {})


def _largest(stages: list[dict[str, Any]]) -> str:
    """Largest momentary load sharing factor over groups of gear meshes by name."""
    found = {
        group: figures["instantaneous"]
        for groups in stages
        for group, figures in groups.items()
        if isinstance(figures, dict) and figures["instantaneous"] is not None
    }
    if not found:
        return "no planets share a load"
    group = max(found, key=lambda g: found[g])
    return f"{found[group]:.4f} ({group})"


def _save(result: Run, stage: Path, report: Report) -> None:
    datasets = {**result.datasets, **{f"{FIELDS}{n}": d for n, d in result.fields.items()}}
    for k, (name, data) in enumerate(datasets.items()):
        report("saving", k / len(datasets))
        if not (stage / f"{name}.nc").exists():  # transients were written as they came
            save(data, stage / f"{name}.nc")
    write_json(stage / "case.json", result.case.to_dict())
    write_json(stage / "summary.json", result.summary)  # without what pictures take
    report("saving", 1.0)


def render(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder of a run.")],
    out: OutFolder = None,
    interactive: Interactive = True,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Draw the pictures and the report of an earlier run again."""
    target = folder if out is None else out
    content = read_folder(folder)
    case = content.case
    claim_folder(target, PICTURES, origin_of_case(case), force)
    notes: list[str] = []
    with (
        complete(folder),
        staged_folder(target) as stage,
        progress(quiet) as report,
    ):
        notes = draw(content, Sheet(folder, stage), report, interactive)
    for note in notes:
        typer.echo(f"flexgear: {note}", err=True)
    typer.echo(f"drew {case.name} into {target}")
