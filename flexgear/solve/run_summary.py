"""Summary of a run from its analyses: sections, warnings and headlines."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from flexgear.coupling.pace import timed_drops, too_coarse
from flexgear.files.atomic import plain
from flexgear.gears.implausible import implausible
from flexgear.model.case import Case
from flexgear.model.machine import machines_of
from flexgear.results.face_load import edge_warnings
from flexgear.results.quantities import values
from flexgear.results.report.wording import words
from flexgear.results.settling import sensor_levels, settled, window_of
from flexgear.results.sinks import between, ranges_of
from flexgear.results.stage_figures import STAGE_FIGURES, StageRun, flow_summary
from flexgear.results.summary import build_summary, modes_summary, sharing_summary_of
from flexgear.results.time_figures import (
    RIM,
    STEADY,
    TRANSIENT,
    SteadyRun,
    energy_balance,
    largest_residual,
    rim_stress,
)
from flexgear.results.version import version
from flexgear.solve.angles import stage_motions
from flexgear.solve.bodies import rigid_bodies
from flexgear.solve.headlines import headlines
from flexgear.solve.long_run import TimedRun
from flexgear.solve.model import Model
from flexgear.solve.reduction_warnings import reduction_warnings
from flexgear.solve.resonance import resonance_figures
from flexgear.solve.result_warnings import largest_motions, motion_histories, neglected
from flexgear.solve.run_transients import Transients
from flexgear.solve.static import UNLOADED, sharing_attrs
from flexgear.solve.transient import cut_short, train_histories


@dataclass(frozen=True)
class Analyses:
    """Results of all analyses of a run. models: by variant, that of the case first; window:
    positions of the equilibria in words; datasets: by file name; transients: all transients;
    face_load: figures of flanks by variant; seconds: wall times by stage of the work."""

    models: Mapping[str, Model]
    window: str
    datasets: Mapping[str, xr.Dataset]
    transients: Transients
    face_load: Mapping[str, Any]
    seconds: Mapping[str, float]

    @property
    def first(self) -> Model:
        """The model of the case itself."""
        return next(iter(self.models.values()))


def run_summary(analyses: Analyses) -> dict[str, Any]:
    """``summary.json`` of a run."""
    model, datasets, runs = analyses.first, analyses.datasets, analyses.transients.runs
    case, equilibria, transient = model.case, datasets["equilibrium"], runs[model.variant]
    summary = build_summary(
        case=case.name,
        result="run",
        version=version(),
        content_hash=case.content_hash(),
        variant=model.variant,
        errors_given=model.has_errors,
        equilibrium_window=analyses.window,
        system={
            "bodies": len(model.system.bodies),
            "coordinates": model.system.size,
            **{n: x if math.isfinite(x) else None for n, x in model.modal.figures.items()},
        },
        power_flow=flow_summary(model.flow),
        stages=stages_summary(model, equilibria),
        modes=modes_summary(datasets["modes"]),
        resonance=resonance_figures(case, datasets["campbell"], datasets["modes"]),
        load_sharing=_load_sharing(analyses),
        transient=transient_summary(transient),
        motion_um_max=motion_summary(equilibria, transient.data),
        torque_steps=analyses.transients.torque_steps,
        energy_residual=_energy_residual(model, analyses.transients),
        solver=model.pace.summary,
        equilibrium_closure_max=equilibria.attrs["closure_max"],
        warnings=_warnings(analyses),
        timing_s=analyses.seconds,
        realtime_factor=transient.realtime_factor,  # by CPU time, as several runs are concurrent
        **({"face_load": analyses.face_load} if analyses.face_load else {}),
        **({"sensors": sensor_levels(settled(transient.data))} if case.sensors else {}),
        **_of_flexible_stages(analyses),
    )
    summary["neglected"] = neglected(case, model.flow, summary)
    summary["headlines"] = plain(headlines(case, model.flow, summary))
    return summary


def stages_summary(model: Model, equilibria: xr.Dataset) -> dict[str, dict[str, Any]]:
    """``STAGE_FIGURES`` of every stage; equilibria: dataset for the loads of bearings."""
    least, figures = UNLOADED * float(np.abs(model.rated).max()), {}
    for motion in stage_motions(model.case, model.flow):
        view, flow = model.case.view(motion.name), model.flow.stage(motion.name)
        run = StageRun(view, flow, equilibria, motion.cycle.gear_meshes, least)
        figures[motion.name] = values(STAGE_FIGURES, run)
    return figures


def _load_sharing(analyses: Analyses) -> dict[str, Any]:
    """Load sharing: quasi-static by variant and stage, and in transients by variant."""
    by_variant: dict[str, dict[str, Any]] = {name: {} for name in analyses.models}
    for name, data in analyses.datasets.items():
        if name.startswith("sharing_"):
            figures = {**sharing_attrs(data), **sharing_summary_of(data)}
            by_variant[data.attrs["variant"]][str(data.attrs["stage"])] = figures
    in_time = {
        name: {**sharing_summary_of(timed.data), **window_of(timed.data).figures}
        for name, timed in analyses.transients.runs.items()
    }
    return {"quasi_static": by_variant, "transient": in_time}


def transient_summary(run: TimedRun) -> dict[str, Any]:
    """``TRANSIENT`` of a run over its settled window."""
    ranges = ranges_of(settled(run.data), train_histories)
    head = {"duration_s": run.simulated, **window_of(run.data).figures}
    return {**head, "steps": int(run.data.attrs["steps"]), **values(TRANSIENT, ranges)}


def motion_summary(equilibria: xr.Dataset, transient: xr.Dataset) -> dict[str, float]:
    """Largest displacement of every body, of ring teeth in equilibria only, µm."""
    ranges = ranges_of(transient[["body_displacement"]], motion_histories)
    motions, others = map(largest_motions, (motion_histories(equilibria), ranges.largest))
    return {name: 1e6 * max(size, others.get(name, size)) for name, size in motions.items()}


def _energy_residual(model: Model, transients: Transients) -> float | None:
    """Largest residual of the energy balance in torque drops, from the drop to the end of fine
    steps; without torque drops in steady running. None where the balance was not tracked."""
    start, duration, _ = timed_drops(model.case).times
    end = start + duration + model.pace.settling
    balanced = [
        between(timed.data, start, end)
        for (_, label), timed in transients.drops.items()
        if label == model.variant
    ]
    steady = transients.runs[model.variant].data
    balanced = balanced or ([steady] if "energy_kinetic" in steady else [])
    residuals = [largest_residual(ranges_of(data, energy_balance)) for data in balanced]
    return max(residuals, default=None)


def _warnings(analyses: Analyses) -> list[str]:
    """Warnings that are not part of a headline."""
    model = analyses.first
    case = model.case
    return [
        *implausible(case, model.flow),
        *too_coarse(model.pace, case.solver),
        *cut_short(case, model.flow),
        *edge_warnings(analyses.face_load.get(model.variant, {})),
        *reduction_warnings(case, model.bodies, rigid_bodies(case)),
        *_unsettled(analyses.transients.runs),
        *_rated_machines(case),
    ]


def _rated_machines(case: Case) -> list[str]:
    """A line for machines with histories, which a run replaces by rated torque and speed."""
    machines = zip(case.ports, machines_of(case), strict=True)
    ports = [port.member for port, m in machines if m is not None and m.kind != "constant"]
    if not ports:
        return []
    return [
        f"machine of {' and '.join(map(words, ports))}: this run keeps it at its rated torque and "
        "speed; flexgear simulate follows its history"
    ]


def _unsettled(runs: Mapping[str, TimedRun]) -> list[str]:
    """A line for transients that have not settled, whose figures are those of the whole run."""
    windows = {name: window_of(timed.data) for name, timed in runs.items()}
    unsettled = {name: w for name, w in windows.items() if w.settled is False}
    if not unsettled:
        return []
    names, window = ", ".join(unsettled), next(iter(unsettled.values()))
    return [
        f"transient, {names}: not settled within {window.end:.4g} s ({window.sentence}); largest "
        "values are over the whole run; give a longer solver.duration_s, or more damping"
    ]


def _of_flexible_stages(analyses: Analyses) -> dict[str, Any]:
    """Sections of cases with flexible stages: reductions, and steady running of FE rings."""
    model, models, datasets = analyses.first, analyses.models, analyses.datasets
    if not model.case.flexible_stages:
        return {}
    runs = {n: x.data for n, x in analyses.transients.runs.items() if not models[n].ideal}
    compared = {name: settled(data) for name, data in runs.items()}
    ideal, equilibria = datasets["equilibrium_without_errors"], datasets["equilibrium"]
    return {
        "reduction": {
            name: {k: v for k, v in body.report.items() if isinstance(v, int | float | str | None)}
            for name, body in model.bodies.items()
        },
        "steady": {
            stage: {
                **values(STEADY, SteadyRun(stage, compared, ideal)),
                **values(RIM, rim_stress(equilibria, stage)),
            }
            for stage in model.case.fe_ring_stages
        },
    }
