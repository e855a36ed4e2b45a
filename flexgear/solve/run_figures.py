"""Figures of a run, as ``summary.json`` has them: powers, stages, transients, torque drops."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import xarray as xr

from flexgear.coupling.pace import timed_drops
from flexgear.model.case import Case
from flexgear.results.energy_balance import energy_account, largest_residual
from flexgear.results.figure import values
from flexgear.results.pieces import between, ranges_of
from flexgear.results.settling import settled, window_of
from flexgear.results.stage_figures import KINEMATICS, STAGE_FIGURES, StageRun
from flexgear.results.summary import finite
from flexgear.results.time_figures import (
    RIM,
    STAGE_DROP,
    STEADY,
    TRANSIENT,
    StageDrop,
    SteadyRun,
    drop_summary,
    rim_stress,
)
from flexgear.solve.angles import stage_motions
from flexgear.solve.long_run import TimedRun
from flexgear.solve.model import Model
from flexgear.solve.static import UNLOADED
from flexgear.solve.transient import train_histories


def depth_name(torque: float) -> str:
    """Name of a torque drop by the torque it drops to: "0.4e6" for 4e5 N·m, "1200" for 1200."""
    return f"{torque / 1e6:g}e6" if abs(torque) >= 1e5 else f"{torque:g}"


def stages_summary(model: Model, equilibria: xr.Dataset) -> dict[str, dict[str, Any]]:
    """``STAGE_FIGURES`` of every stage. equilibria: from whose positions loads of bearings are."""
    return {s.view.name: values(STAGE_FIGURES, s) for s in _stage_runs(model, equilibria)}


def _stage_runs(model: Model, equilibria: xr.Dataset) -> Iterator[StageRun]:
    least = UNLOADED * float(np.abs(model.rated).max())
    for motion in stage_motions(model.case, model.flow):
        view, flow = model.case.view(motion.name), model.flow.stage(motion.name)
        yield StageRun(view, flow, equilibria, motion.cycle.gear_meshes, least)


def transient_summary(run: TimedRun) -> dict[str, Any]:
    """``TRANSIENT`` of a run, in its window."""
    rest = ranges_of(settled(run.data), train_histories)
    head = {"duration_s": run.simulated, **window_of(run.data).figures}
    return {**head, "steps": int(run.data.attrs["steps"]), **values(TRANSIENT, rest)}


def unsettled_lines(runs: Mapping[str, TimedRun]) -> list[str]:
    """A line for transients that have not settled; their figures are of the whole run."""
    windows = {name: window_of(timed.data) for name, timed in runs.items()}
    unsettled = {name: w for name, w in windows.items() if w.settled is False}
    if not unsettled:
        return []
    names, window = ", ".join(unsettled), next(iter(unsettled.values()))
    return [
        f"transient, {names}: not settled within {window.end:.4g} s ({window.sentence}); largest "
        "values are over the whole run; give a longer solver.duration_s, or more damping"
    ]


def bodies_summary(
    models: Mapping[str, Model],
    datasets: Mapping[str, xr.Dataset],
    runs: Mapping[str, TimedRun],
) -> dict[str, Any]:
    """What only flexible stages have: FE meshes, reductions, steady running of rings."""
    first = next(iter(models.values()))
    case = first.case
    if not case.flexible_stages:
        return {}
    reports = {name: body.report for name, body in first.bodies.items()}
    compared = {n: settled(x.data) for n, x in runs.items() if not models[n].ideal}
    inertias = {port.member: case.port_inertia(port.member) for port in case.ports}
    steady = {
        stage: {
            **values(STEADY, SteadyRun(stage, compared, datasets["equilibrium_without_errors"])),
            **window_of(next(iter(runs.values())).data).figures,
            "equilibrium_closure_max": datasets["equilibrium"].attrs["closure_max"],
            **values(RIM, rim_stress(datasets["equilibrium"], stage)),
            "inertia_kg_m2": inertias,
        }
        for stage in case.fe_ring_stages
    }
    return {
        "fe": {name: {"dofs": report["fe_dofs"]} for name, report in reports.items()},
        "reduction": {name: _reduction(report) for name, report in reports.items()},
        "second_reduction": {n: finite(m.modal.figures) for n, m in models.items() if not m.ideal},
        "kinematics": kinematics(first),
        "steady": steady,
    }


def kinematics(model: Model) -> dict[str, dict[str, float]]:
    """``KINEMATICS`` of every flexible stage."""
    stages = {s.view.name: s for s in _stage_runs(model, xr.Dataset())}
    return {name: values(KINEMATICS, stages[name]) for name in model.case.flexible_stages}


def _reduction(report: Mapping[str, Any]) -> dict[str, Any]:
    """Figures of a reduction: what was kept, error estimates (None without), and the tie."""
    plain = (int, float, str, type(None))
    return {k: v for k, v in report.items() if isinstance(v, plain) and k != "fe_dofs"}


def drop_figures(case: Case, timed: TimedRun) -> dict[str, Any]:
    """Figures of a transient with a torque drop, from the moment at which the torque falls."""
    start, duration, after = timed_drops(case).times
    data = between(timed.data, start)  # what comes before lets the train settle
    return {
        **drop_summary(data),
        "window_s": [start, start + duration + after],
        **{s: values(STAGE_DROP, StageDrop(data, s)) for s in case.fe_ring_stages},
    }


def residual_of_run(
    first: Model, runs: Mapping[str, TimedRun], drops: Mapping[tuple[float, str], TimedRun]
) -> float | None:
    """Largest energy residual over the torque drops, counted from the drop while steps are fine.

    Without torque drops it is that of the steady revolution; None where no account was kept.
    """
    start, duration, _ = timed_drops(first.case).times
    end = start + duration + first.pace.settling
    balanced = [
        between(timed.data, start, end)
        for (_, label), timed in drops.items()
        if label == first.variant
    ]
    dataset = runs[first.variant].data
    balanced = balanced or ([dataset] if "energy_kinetic" in dataset else [])
    residuals = [largest_residual(ranges_of(data, energy_account)) for data in balanced]
    return max(residuals, default=None)
