"""Which pictures the run of a train gets; how they are drawn is the views' business."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from flexgear.cli.display import Report
from flexgear.gears.power_flow import PowerFlow
from flexgear.gears.stage_flow import StageFlow
from flexgear.model.case import Case
from flexgear.results.pieces import between
from flexgear.results.version import version
from flexgear.studies.train_transient import settled
from flexgear.views import mode_charts, style, train_charts
from flexgear.views.report import write_report

MOST_SHOWN = 4000  # samples of a transient in a picture
CYCLES_SHOWN = 12  # gear-mesh cycles of a stage in its close-up


@dataclass(frozen=True)
class TrainFolder:
    """What a run of a train left: datasets by name, the summary; and its power flow."""

    train: Case
    flow: PowerFlow
    datasets: Mapping[str, xr.Dataset]
    summary: Mapping[str, Any]


Draw = Callable[[], Any]


def draw_train(content: TrainFolder, folder: Path, report: Report) -> None:
    """Draw everything into ``folder`` and write the report."""
    plan = _plan(content)
    shown: list[tuple[str | Path, str]] = []
    for k, (name, (caption, make)) in enumerate(plan.items()):
        report("pictures", k / len(plan))
        path = folder / "pictures" / f"{name}.png"
        path.parent.mkdir(parents=True, exist_ok=True)
        style.save_figure(make(), path, dpi=150)
        shown.append((path, caption))
    report("pictures", 1.0)
    write_report(
        folder / "report.html",
        content.train.title or content.train.name,
        content.summary,
        shown,
        content.train.to_dict(),
        version(),
        content.train.content_hash(),
        [],
    )


def _plan(content: TrainFolder) -> dict[str, tuple[str, Draw]]:
    """Figures by file name: caption and how to make them."""
    data = content.datasets
    plan: dict[str, tuple[str, Draw]] = {
        "power_flow": (
            "Speeds, torques and powers of the members",
            partial(train_charts.power_flow_chart, content.flow),
        ),
        "modes": (
            "Natural modes by type and energy",
            partial(mode_charts.modes_chart, data["modes"]),
        ),
        "campbell": (
            "Frequencies over speed and the orders of the gear meshes",
            partial(mode_charts.campbell_chart, data["campbell"]),
        ),
    }
    for name, found in data.items():
        if name.startswith("sharing_") and not name.endswith(("_without_errors", "_rigid")):
            shared = str(found.attrs["stage"]).replace("_", " ")
            plan[name] = (
                f"Load sharing of {shared}, quasi-static, over one turn",
                partial(train_charts.sharing_chart, found),
            )
    rest = settled(data["transient"])
    whole = _thinned(rest)
    for stage in content.flow.stages:
        if stage.gear_mesh_frequency:
            plan[f"transient_forces_{stage.name}"] = (
                f"Gear-mesh forces of {stage.name.replace('_', ' ')} in the transient, "
                f"its last {CYCLES_SHOWN} gear-mesh cycles",
                partial(train_charts.gear_mesh_forces, _close_up(rest, stage)),
            )
    if rest.sizes.get("group", 0):
        plan["transient_sharing"] = (
            "Load sharing in the transient after start-up",
            partial(train_charts.sharing_chart, whole),
        )
    plan["transient_displacements"] = (
        "Displacement of central members in the transient",
        partial(train_charts.displacements_chart, whole),
    )
    return plan


def _thinned(data: xr.Dataset) -> xr.Dataset:
    """As many samples as a picture can show, in memory."""
    return data.isel(time=slice(None, None, max(1, data.sizes["time"] // MOST_SHOWN))).load()


def _close_up(data: xr.Dataset, stage: StageFlow) -> xr.Dataset:
    """One stage in its last gear-mesh cycles, in memory."""
    own = np.flatnonzero(data["stage"].to_numpy() == stage.name)
    end = float(data["time"][-1])
    near = between(data, end - CYCLES_SHOWN / stage.gear_mesh_frequency)
    return near.isel(gear_mesh=own).load()
