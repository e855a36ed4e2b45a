"""The whole job over one case: equilibria, a steady revolution and torque drops, every variant.

Runs of different variants share nothing but constant data and go side by side in threads; the
compiled time step lets go of the interpreter lock.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from flexgear.coupling.modal import ModalSystem
from flexgear.coupling.pace import stage_pace, timed_drops, too_coarse
from flexgear.coupling.system import Variant
from flexgear.gears.bearing_life import planet_bearing_life_hours
from flexgear.gears.geometry import stage_geometry
from flexgear.gears.power_flow import power_flow
from flexgear.model.errors import FlexgearError
from flexgear.model.flexible_stage import FlexibleStage
from flexgear.results.energy_balance import energy_account, largest_residual
from flexgear.results.pieces import between, ranges_of
from flexgear.results.sinks import DatasetSink
from flexgear.results.summary import (
    RPM,
    build_summary,
    finite,
    steady_summary,
    torque_step_summary,
)
from flexgear.results.version import version
from flexgear.studies.long_run import TimedRun, shelved
from flexgear.studies.reduction_warnings import stage_warnings
from flexgear.studies.single_runs import (
    constant_drive,
    deformed,
    equilibria,
    revolution_time,
    simulate,
    torque_step,
)
from flexgear.studies.stage_bodies import (
    Progress,
    StageBodies,
    silent,
    stage_modal,
    variant_of,
    without_errors,
)

POSITIONS = 120  # equilibria over one revolution
WORKERS = 2


@dataclass(frozen=True)
class StageRun:
    """What a run leaves: datasets by file name (without suffix), fields by body, figures."""

    case: FlexibleStage
    datasets: Mapping[str, xr.Dataset]
    fields: Mapping[str, xr.Dataset]
    summary: dict[str, Any]

    def with_timing(self, **seconds: float) -> StageRun:
        """A copy with further wall times in the summary."""
        summary = {**self.summary, "timing_s": {**self.summary["timing_s"], **seconds}}
        return StageRun(self.case, self.datasets, self.fields, summary)


class Stopwatch:
    """Wall times by stage, s; several spans of one stage add up."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Time the block."""
        start = time.perf_counter()
        try:
            yield
        finally:
            self.seconds[name] = self.seconds.get(name, 0.0) + time.perf_counter() - start


def depth_name(torque: float) -> str:
    """Name of a torque drop by the torque it drops to: "0.4e6" for 4e5 N·m, "1200" for 1200."""
    return f"{torque / 1e6:g}e6" if abs(torque) >= 1e5 else f"{torque:g}"


def run_stage(
    case: FlexibleStage,
    bodies: StageBodies,
    progress: Progress = silent,
    watch: Stopwatch | None = None,
    workers: int = WORKERS,
    place: Path | None = None,
) -> StageRun:
    """Steady revolution and torque drops of the flexible and the rigid variant, and the figures.

    place: a folder that gets the transients as they come, so that none is in memory as a whole.
    """
    watch = watch or Stopwatch()
    variants = {v.label: v for v in (variant_of(case), Variant(False, False, False))}
    first = next(iter(variants))
    with watch.stage("coupled_systems"):
        modal: dict[str, ModalSystem] = {}
        for k, (name, variant) in enumerate(variants.items()):
            progress("coupled systems", k / len(variants))
            modal[name] = stage_modal(case, bodies, variant)
        perfect = without_errors(case, bodies, modal[first])
        progress("coupled systems", 1.0)
    datasets: dict[str, xr.Dataset] = {}
    with watch.stage("equilibria"):
        angles = np.linspace(0, 2 * np.pi, POSITIONS, endpoint=False)
        found, datasets[f"equilibrium_{first}"] = equilibria(
            case, modal[first], angles, progress=progress
        )
        ideal, datasets[f"equilibrium_{first}_without_errors"] = equilibria(
            case, perfect, angles, progress=progress
        )
        fields = deformed(bodies, ideal)
    with watch.stage("transients"):
        runs = _transients(case, modal, first, progress, workers, place)
    datasets |= {name: run.data for name, run in runs.items()}
    watch.seconds |= {f"transient_{name}": run.wall for name, run in runs.items()}
    steady = {name: datasets[f"steady_{name}"] for name in variants}
    pace = stage_pace(case)
    drops = {
        depth_name(torque): {
            name: torque_step_summary(datasets[f"torque_step_{depth_name(torque)}_{name}"])
            for name in variants
        }
        for torque in case.drive.steps.torques
    }
    summary = build_summary(
        case=case.name,
        result="run",
        version=version(),
        content_hash=case.content_hash(),
        fe={n: {"dofs": b.report["fe_dofs"]} for n, b in _bodies(bodies)},
        reduction={n: _reduction(b.report) for n, b in _bodies(bodies)},
        second_reduction={name: finite(m.figures) for name, m in modal.items()},
        kinematics=kinematics(case),
        steady={
            **steady_summary(
                steady[first], datasets[f"equilibrium_{first}_without_errors"], steady
            ),
            "equilibrium_closure_max": float(np.max(found.closure)),
            "inertia_kg_m2": {"drive": case.inertia.drive, "output": case.inertia.output},
        },
        torque_steps=drops,
        energy_residual=_largest_residual(case, datasets, first),
        warnings=[*too_coarse(pace, case.solver), *stage_warnings(case, bodies.both)],
        timing_s=watch.seconds,
        solver=pace.summary,
        # of one core, as several runs go side by side
        realtime_factor=runs[f"steady_{first}"].simulated / runs[f"steady_{first}"].core,
    )
    return StageRun(case, datasets, fields, summary)


def kinematics(case: FlexibleStage) -> dict[str, float]:
    """Speeds, frequency, contact ratios, expected forces of a case; life of rated bearings."""
    alone, geometry = case.as_case(), stage_geometry(case.view())
    flow = power_flow(alone)
    motion, lives = flow.stages[0], planet_bearing_life_hours(alone, flow)
    found = {
        "carrier_speed_rpm": motion.carrier_speed * RPM,
        "sun_speed_rpm": motion.sun_speed * RPM,
        "gear_mesh_frequency_hz": motion.gear_mesh_frequency,
        "contact_ratio_ring": geometry.ring_mesh.total_contact_ratio,
        "contact_ratio_sun": geometry.sun_mesh.total_contact_ratio,
        "expected_ring_mesh_force_n": motion.ring_gear_mesh_force,
        "planet_bearing_force_n": motion.planet_bearing_force,
    }
    if lives:
        found["planet_bearing_life_h"] = lives[motion.name]
    return found


def _bodies(bodies: StageBodies) -> list[tuple[str, Any]]:
    return [("ring", bodies.ring), ("carrier", bodies.carrier)]


def _reduction(report: Mapping[str, Any]) -> dict[str, Any]:
    """Figures of a reduction: what was kept, error estimates, and the tie."""
    return {k: v for k, v in report.items() if isinstance(v, (int, float, str)) and k != "fe_dofs"}


def _transients(
    case: FlexibleStage,
    modal: Mapping[str, ModalSystem],
    first: str,
    progress: Progress,
    workers: int,
    place: Path | None,
) -> dict[str, TimedRun]:
    """All transients, the longest first, ``workers`` at a time."""
    stop = threading.Event()

    def watched(stage: str, share: float) -> None:
        if stop.is_set():
            raise FlexgearError("interrupted")
        progress(stage, share)

    jobs: dict[str, Callable[[DatasetSink | None], TimedRun]] = {}
    turn, rated = revolution_time(case), constant_drive(case)
    for name, system in sorted(modal.items(), key=lambda item: item[0] != first):
        for torque in case.drive.steps.torques:
            label = f"torque_step_{depth_name(torque)}_{name}"
            jobs[label] = lambda sink, s=system, t=torque, n=name, at=label: torque_step(  # type: ignore[misc]
                case,
                s,
                t,
                energy=n == first,
                progress=watched,
                label=at.replace("_", " "),
                sink=sink,
            )
        account = name == first and not case.drive.steps.torques
        jobs[f"steady_{name}"] = lambda sink, s=system, n=name, e=account: simulate(  # type: ignore[misc]
            case, s, drive=rated, duration=turn, energy=e, progress=watched,
            label=f"steady {n}", sink=sink,
        )  # fmt: skip
    _compile(case, modal[first])
    with ThreadPoolExecutor(max_workers=workers) as pool:
        waiting: dict[str, Future[TimedRun]] = {
            n: pool.submit(shelved, place, n, job) for n, job in jobs.items()
        }
        try:
            return {name: future.result() for name, future in waiting.items()}
        except BaseException:
            stop.set()
            pool.shutdown(wait=True, cancel_futures=True)
            raise


def _compile(case: FlexibleStage, modal: ModalSystem) -> None:
    """A run of a few steps, so that compilation does not count as simulation."""
    step = stage_pace(case).time_step
    for energy in (False, True):
        simulate(case, modal, duration=3 * step, output_interval=step, energy=energy)


def _largest_residual(case: FlexibleStage, datasets: Mapping[str, xr.Dataset], first: str) -> float:
    """Largest energy residual over the torque drops, counted from the drop while steps are fine.

    Without torque drops it is that of the steady revolution.
    """
    start, duration, _ = timed_drops(case).times
    end = start + duration + stage_pace(case).settling
    balanced = [
        between(datasets[f"torque_step_{depth_name(torque)}_{first}"], start, end)
        for torque in case.drive.steps.torques
    ]
    balanced = balanced or [datasets[f"steady_{first}"]]
    return max(largest_residual(ranges_of(data, energy_account)) for data in balanced)
