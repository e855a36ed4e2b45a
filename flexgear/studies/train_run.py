"""The whole job over one train: modes, equilibria, load sharing, transients, harmonic check."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from flexgear.coupling.pace import too_coarse
from flexgear.gears.bearing_life import planet_bearing_life_hours
from flexgear.gears.power_flow import PowerFlow
from flexgear.model.case import Case
from flexgear.model.errors import FlexgearError
from flexgear.results.pieces import ranges_of
from flexgear.results.sinks import DatasetSink
from flexgear.results.summary import RPM, finite
from flexgear.results.train_summary import (
    distance_summary,
    force_ranges,
    modes_summary,
    sharing_summary_of,
    train_summary,
)
from flexgear.results.version import version
from flexgear.studies.long_run import TimedRun, shelved
from flexgear.studies.reduction_warnings import train_warnings
from flexgear.studies.stage_bodies import Progress, silent
from flexgear.studies.stage_run import Stopwatch
from flexgear.studies.train_angles import lead_speed, one_turn, stage_motions
from flexgear.studies.train_compare import contexts, is_still
from flexgear.studies.train_dataset import TrainContext
from flexgear.studies.train_harmonic import harmonic_data, harmonic_figures, train_harmonic
from flexgear.studies.train_linear import why_not_linear
from flexgear.studies.train_model import Bodies, train_bodies, train_variants
from flexgear.studies.train_modes import train_campbell, train_modes, usual_limit
from flexgear.studies.train_sharing import shared_stages, sharing_attrs, train_sharing
from flexgear.studies.train_static import train_equilibria
from flexgear.studies.train_transient import (
    compile_transient,
    cut_short,
    simulate_train,
    train_histories,
)

WORKERS = 2
POSITIONS = 24  # equilibria over one gear-mesh cycle of the slowest stage


@dataclass(frozen=True)
class TrainResults:
    """What a run leaves: datasets by file name (without suffix), figures, the power flow."""

    train: Case
    flow: PowerFlow
    datasets: Mapping[str, xr.Dataset]
    summary: dict[str, Any]

    def with_timing(self, **seconds: float) -> TrainResults:
        """A copy with further wall times in the summary."""
        summary = {**self.summary, "timing_s": {**self.summary["timing_s"], **seconds}}
        return TrainResults(self.train, self.flow, self.datasets, summary)


def run_train(
    train: Case,
    progress: Progress = silent,
    watch: Stopwatch | None = None,
    *,
    bodies: Bodies | None = None,
    workers: int = WORKERS,
    place: Path | None = None,
) -> TrainResults:
    """Every analysis of a train, with and without errors, flexible and rigid, and the figures.

    place: a folder that gets the transients as they come, so that none is in memory as a whole.
    """
    watch = watch or Stopwatch()
    reduced = train_bodies(train, progress) if bodies is None else bodies
    with watch.stage("coupled_systems"):
        variants = contexts(train, progress, reduced)
    first = next(iter(variants.values()))
    datasets: dict[str, xr.Dataset] = {}
    with watch.stage("modes"):
        progress("modes", 0.0)
        limit = usual_limit(first)
        datasets["modes"] = train_modes(first, limit_hz=limit)
        progress("modes", 0.5)
        datasets["campbell"] = train_campbell(first, limit_hz=limit)
        progress("modes", 1.0)
    with watch.stage("equilibria"):
        datasets["equilibrium"] = train_equilibria(first, _positions(first), progress=progress)
    with watch.stage("load_sharing"):
        sharing = _sharing(variants, progress)
    datasets |= sharing
    with watch.stage("transients"):
        runs = _transients(variants, progress, workers, place)
    datasets |= {_name("transient", label): run.data for label, run in runs.items()}
    own = next(iter(runs.values()))
    harmonic: dict[str, Any] = {"reason": why_not_linear(first.system)}
    if harmonic["reason"] is None:
        with watch.stage("harmonic"):
            data = harmonic_data(first, train_harmonic(first), own.data)
        datasets["harmonic"] = data
        harmonic = {**harmonic_figures(data), "load_sharing": sharing_summary_of(data)}
    watch.seconds |= {f"transient_{label}": run.wall for label, run in runs.items()}
    summary = train_summary(
        case=train.name,
        kind=train.kind,
        result="run",
        version=version(),
        content_hash=train.content_hash(),
        variant=first.variant,
        system={
            "bodies": len(first.system.bodies),
            "coordinates": first.system.size,
            **finite(first.modal.figures),
        },
        power_flow=flow_summary(first.flow),
        stages=stages_summary(first),
        modes=modes_summary(datasets["modes"]),
        load_sharing={
            "quasi_static": {n: _shared(sharing, n) for n in variants},
            "transient": {n: sharing_summary_of(run.data) for n, run in runs.items()},
        },
        transient=_transient_summary(own),
        harmonic=harmonic,
        solver=first.pace.summary,
        equilibrium_closure_max=datasets["equilibrium"].attrs["closure_max"],
        warnings=[
            *too_coarse(first.pace, train.solver),
            *cut_short(train, first.flow),
            *train_warnings(train, reduced, train_variants(train)),
        ],
        timing_s=watch.seconds,
        realtime_factor=own.realtime_factor,
    )
    return TrainResults(train, first.flow, datasets, summary)


def _positions(context: TrainContext) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Lead angles over one gear-mesh cycle of the slowest stage; one of a train at rest."""
    motions = stage_motions(context.train, context.flow)
    turning = [m for m in motions if m.theta]
    if not turning:
        return np.zeros(1)
    slowest = max(turning, key=lambda m: m.turn_period / m.cycle.per_turn)
    return one_turn(slowest, lead_speed(context.train, context.flow), POSITIONS, 1)


def _name(what: str, label: str) -> str:
    """File name of a dataset: "transient", "transient_rigid", "transient_without_errors"."""
    if label.endswith("without errors"):
        return f"{what}_without_errors"
    return f"{what}_rigid" if label == "rigid" else what


def _sharing(variants: Mapping[str, TrainContext], progress: Progress) -> dict[str, xr.Dataset]:
    """Quasi-static load sharing by stage and variant."""
    found = {}
    for label, context in variants.items():
        for stage in shared_stages(context):
            data = train_sharing(context, stage, progress=progress)
            found[_name(f"sharing_{stage}", label)] = data
    return found


def _shared(sharing: Mapping[str, xr.Dataset], label: str) -> dict[str, Any]:
    """Figures of one variant's quasi-static load sharing by stage."""
    return {
        str(data.attrs["stage"]): {**sharing_attrs(data), **sharing_summary_of(data)}
        for data in sharing.values()
        if data.attrs["variant"] == label
    }


def _transients(
    variants: Mapping[str, TrainContext], progress: Progress, workers: int, place: Path | None
) -> dict[str, TimedRun]:
    """A transient of each variant in which anything moves, ``workers`` at a time."""
    stop = threading.Event()

    def watched(stage: str, share: float) -> None:
        if stop.is_set():
            raise FlexgearError("interrupted")
        progress(stage, share)

    compile_transient(next(iter(variants.values())))
    jobs: dict[str, Callable[[DatasetSink | None], TimedRun]] = {
        label: lambda sink, c=context, n=label: simulate_train(  # type: ignore[misc]
            c, progress=watched, label=f"transient, {n}", sink=sink
        )
        for label, context in variants.items()
        if label == next(iter(variants)) or not is_still(context)
    }
    with ThreadPoolExecutor(max_workers=workers) as pool:
        waiting: dict[str, Future[TimedRun]] = {
            n: pool.submit(shelved, place, _name("transient", n), job) for n, job in jobs.items()
        }
        try:
            return {label: future.result() for label, future in waiting.items()}
        except BaseException:
            stop.set()
            pool.shutdown(wait=True, cancel_futures=True)
            raise


def _transient_summary(run: TimedRun) -> dict[str, Any]:
    rest = ranges_of(run.data, train_histories)
    forces = (part["gear_mesh_force"] for part in (rest.least, rest.mean, rest.largest))
    return {
        "duration_s": run.simulated,
        "settle_s": float(run.data.attrs["settle_s"]),
        "steps": int(run.data.attrs["steps"]),
        "gear_mesh_force": force_ranges(*forces),
        "displacement_um_max": distance_summary(rest.largest["axis_distance"]),
    }


def flow_summary(flow: PowerFlow) -> dict[str, Any]:
    """Speeds, torques from outside and powers of all members."""
    members = {
        name: {
            "speed_rpm": speed * RPM,
            "torque_on_stage_nm": flow.branch_torque[name],
            "power_into_stage_w": flow.branch_power[name],
            **({"outside_torque_nm": flow.torque[name]} if name in flow.torque else {}),
        }
        for name, speed in flow.speed.items()
    }
    return {
        "mobility": flow.mobility,
        "input_power_w": flow.input_power,
        "circulating_power_w": flow.circulating_power,
        "members": members,
    }


def stages_summary(context: TrainContext) -> dict[str, dict[str, Any]]:
    """Frequencies, mean forces and error cycles of the stages."""
    flow, train = context.flow, context.train
    motions, lives = stage_motions(train, flow), planet_bearing_life_hours(train, flow)
    out: dict[str, dict[str, Any]] = {}
    for stage, motion in zip(train.stages, motions, strict=True):
        own = flow.stage(stage.name)
        out[stage.name] = {
            "kind": stage.kind,
            "gear_mesh_frequency_hz": own.gear_mesh_frequency,
            "rolling_power_w": own.stage_power,
            "sun_gear_mesh_force_n": abs(own.sun_gear_mesh_force),
            "error_cycle_gear_meshes": motion.cycle.gear_meshes,
        }
        if stage.kind == "planetary":
            out[stage.name] |= {
                "ring_gear_mesh_force_n": abs(own.ring_gear_mesh_force),
                "planet_bearing_force_n": own.planet_bearing_force,
                "planet_speed_in_carrier_rpm": own.planet_relative_speed * RPM,
            }
        if math.isfinite(lives.get(stage.name, math.inf)):
            out[stage.name]["planet_bearing_life_h"] = lives[stage.name]
    return out
