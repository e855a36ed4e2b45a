"""The whole job over a train, and its pictures drawn again."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import typer

from flexgear.cli.display import Report, as_json_text, modes_kept, progress, table, warn
from flexgear.cli.outputs import require_pictures, save_or_rescue, without_pictures
from flexgear.cli.train_pictures import TrainFolder, draw_train
from flexgear.files.atomic import staged_folder, write_json
from flexgear.model.case import Case
from flexgear.results.dataset import save
from flexgear.studies.stage_run import Stopwatch
from flexgear.studies.train_model import train_bodies
from flexgear.studies.train_run import TrainResults, run_train


def run_whole_train(train: Case, folder: Path, pictures: bool, as_json: bool, quiet: bool) -> None:
    """Run everything, write results, summary, pictures and report into ``folder``."""
    watch = Stopwatch()
    lost: list[str] = []
    with staged_folder(folder) as stage, progress(quiet) as report:
        with watch.stage("bodies"):
            bodies = train_bodies(train, report)
        result = run_train(train, report, watch, bodies=bodies, place=stage)
        with watch.stage("saving"):
            save_or_rescue(lambda place: _save(result, place, report), stage)
        if pictures:
            with watch.stage("pictures"), without_pictures(lost):
                content = TrainFolder(train, result.flow, result.datasets, result.summary)
                draw_train(content, stage, report)
        summary = result.with_timing(**watch.seconds).summary
        write_json(stage / "summary.json", summary)
    warn(summary["warnings"])
    require_pictures(lost, folder)
    if as_json:
        typer.echo(as_json_text(summary))
        return
    table(f"{train.name}: results in {folder}", _told(summary))


def _told(summary: dict[str, Any]) -> dict[str, Any]:
    """What a run says at its end."""
    lowest = [m for m in summary["modes"]["lowest"] if m["frequency_hz"] > 0][:3]
    rows: dict[str, Any] = {
        "power": f"{summary['power_flow']['input_power_w'] / 1e3:.6g} kW in",
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
    rows["faster than real time"] = f"{summary['realtime_factor']:.2f} x"
    return rows


def _first(variants: dict[str, dict[str, Any]]) -> dict[str, Any]:
    """The train as it is, which comes before its variants."""
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


def _save(result: TrainResults, stage: Path, report: Report) -> None:
    for k, (name, data) in enumerate(result.datasets.items()):
        report("saving", k / len(result.datasets))
        if not (stage / f"{name}.nc").exists():  # transients were written as they came
            save(data, stage / f"{name}.nc")
    write_json(stage / "case.json", result.train.to_dict())
    report("saving", 1.0)
