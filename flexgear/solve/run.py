"""The whole job over one case: modes, equilibria, load sharing, transients, torque drops.

Transients run in threads beside all other analyses.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, replace
from operator import attrgetter
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from flexgear.gears.power_flow import PowerFlow
from flexgear.model.case import Case
from flexgear.model.names import BodyName
from flexgear.results.face_load import cycle_figures, face_figures
from flexgear.solve.angles import lead_speed, one_turn, stage_motions
from flexgear.solve.bodies import Bodies, Progress, silent
from flexgear.solve.campbell import campbell
from flexgear.solve.deformed import bending_bodies, deformed, mode_shapes
from flexgear.solve.linear import harmonic_data, train_harmonic, why_not_linear
from flexgear.solve.model import Model, assemble
from flexgear.solve.modes import modes, usual_limit
from flexgear.solve.run_summary import Analyses, run_summary
from flexgear.solve.run_transients import dataset_name, drop_name, transients
from flexgear.solve.static import (
    gear_mesh_cycles,
    shared_stages,
    sliced_stages,
    stages_sharing,
    static,
)
from flexgear.structures.linalg.dense import single_threaded_blas

WORKERS = 2
POSITIONS = 24  # equilibria over one gear-mesh cycle of the slowest stage
TURN = 120  # equilibria over one turn of the lead where rings bend


@dataclass(frozen=True)
class Run:
    """Results of a run: datasets by file name (without suffix), displacement fields by body,
    figures, the power flow."""

    case: Case
    flow: PowerFlow
    datasets: Mapping[str, xr.Dataset]
    fields: Mapping[BodyName, xr.Dataset]
    summary: dict[str, Any]

    def with_timing(self, **seconds: float) -> Run:
        """A copy with further wall times in the summary."""
        summary = {**self.summary, "timing_s": {**self.summary["timing_s"], **seconds}}
        return replace(self, summary=summary)


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


def models_of(
    case: Case, progress: Progress = silent, bodies: Bodies | None = None
) -> dict[str, Model]:
    """The case as it is, with rigid bodies in place of those that bend, and without errors."""
    model = assemble(case, progress=progress, bodies=bodies)
    models = {model.variant: model}
    if case.flexible_stages and model.variant != "rigid":
        models["rigid"] = assemble(case, bodies=model.bodies, variant=case.flexible_bodies)
    with single_threaded_blas(), ThreadPoolExecutor(WORKERS) as pool:
        list(pool.map(attrgetter("modal"), models.values()))  # made once, before threads share it
    if model.has_errors:
        clean = model.without_errors()
        models[clean.variant] = clean
    return models


def _fields(model: Model, ideal: Model) -> dict[BodyName, xr.Dataset]:
    """Fields of every flexible FE body, of planets the first: deformed without errors, and its
    shapes in the natural modes."""
    names = [name for name in bending_bodies(model) if name.planet <= 0]
    modes = model.natural_modes(model.pace.band) if names else None
    return {
        name: deformed(ideal, name).merge(mode_shapes(model, name, modes), combine_attrs="override")
        for name in names
        if modes is not None
    }


def run(
    case: Case,
    progress: Progress = silent,
    watch: Stopwatch | None = None,
    *,
    bodies: Bodies | None = None,
    workers: int = WORKERS,
    folder: Path | None = None,
) -> Run:
    """Every analysis of a case, with and without errors, flexible and rigid, and the figures.

    folder: gets the transients as they come, so that none is in memory as a whole.
    """
    watch = watch or Stopwatch()
    with watch.stage("coupled_systems"):
        models = models_of(case, progress, bodies)
    first = next(iter(models.values()))
    ideal = first.without_errors() if case.flexible_stages else first
    datasets: dict[str, xr.Dataset] = {}
    with single_threaded_blas(), transients(models, progress, workers, folder) as ended:
        with watch.stage("modes"):
            progress("modes", 0.0)
            limit = usual_limit(first)
            datasets["modes"] = modes(first, limit_hz=limit)
            progress("modes", 0.5)
            datasets["campbell"] = campbell(first, limit_hz=limit)
            progress("modes", 1.0)
        with watch.stage("equilibria"):
            results, fields = _equilibria(models, ideal, progress)
            datasets |= results
            cycles, face_load = _face_load(models, datasets, progress)
            datasets |= cycles
        with watch.stage("load_sharing"):
            datasets |= _sharing(models, progress)
        with watch.stage("transients"):  # what of them goes on after all else
            done = ended()
    runs, drops = done.runs, done.drops
    datasets |= {dataset_name("transient", models[n]): timed.data for n, timed in runs.items()}
    datasets |= {drop_name(torque, models[n]): timed.data for (torque, n), timed in drops.items()}
    if why_not_linear(first.system) is None:
        with watch.stage("harmonic"):
            transient = runs[first.variant].data
            datasets["harmonic"] = harmonic_data(first, train_harmonic(first), transient)
    watch.seconds |= {f"transient_{label}": timed.wall for label, timed in runs.items()}
    summary = run_summary(Analyses(models, datasets, done, face_load, watch.seconds))
    return Run(case, first.flow, datasets, fields, summary)


def _equilibria(
    models: Mapping[str, Model], ideal: Model, progress: Progress
) -> tuple[dict[str, xr.Dataset], dict[BodyName, xr.Dataset]]:
    """Equilibria over a turn of the case as it is; of flexible stages also without errors, with the
    fields of their bodies, and with rigid bodies where pairs have slices."""
    first, fields = next(iter(models.values())), dict[BodyName, xr.Dataset]()
    datasets = {"equilibrium": static(first, _positions(first), progress=progress)}
    if first.case.flexible_stages:
        datasets["equilibrium_without_errors"] = static(ideal, _positions(first), progress=progress)
        fields = _fields(first, ideal)
    if "rigid" in models and sliced_stages(first):
        rigid = models["rigid"]
        datasets["equilibrium_rigid"] = static(rigid, _positions(rigid), progress=progress)
    return datasets, fields


def _face_load(
    models: Mapping[str, Model], datasets: Mapping[str, xr.Dataset], progress: Progress
) -> tuple[dict[str, xr.Dataset], dict[str, Any]]:
    """Gear-mesh cycles of stages with load along the face, and figures of every flank by variant;
    empty where no stage has it."""
    cycles, figures = {}, {}
    for label, model in models.items():
        equilibria = datasets.get(dataset_name("equilibrium", model))
        if model.ideal or equilibria is None or not sliced_stages(model):
            continue
        figures_of_variant = figures[label] = face_figures(equilibria)
        for stage in sliced_stages(model):
            data = gear_mesh_cycles(model, stage, progress)
            cycles[dataset_name(f"gear_mesh_cycles_{stage}", model)] = data
            for flank, flank_figures in cycle_figures(data).items():
                figures_of_variant.setdefault(flank, {}).update(flank_figures)
    return cycles, figures


def _positions(model: Model) -> NDArray[np.float64]:
    """Angles of the reference member over one gear-mesh cycle of the slowest stage, over a whole
    turn of carrier against ring where rings are flexible; one angle for a train that does not
    turn."""
    motions = stage_motions(model.case, model.flow)
    turning = [m for m in motions if m.theta]
    rings = [m for m in turning if m.name in model.case.fe_ring_stages]
    if rings:
        turn = max(m.turn_period for m in rings) * abs(lead_speed(model.case, model.flow))
        return np.linspace(0, turn, TURN, endpoint=False)
    if not turning:
        return np.zeros(1)
    slowest = max(turning, key=lambda m: m.turn_period / m.cycle.per_turn)
    return one_turn(slowest, lead_speed(model.case, model.flow), POSITIONS, 1)


def _sharing(variants: Mapping[str, Model], progress: Progress) -> dict[str, xr.Dataset]:
    """Quasi-static load sharing by stage and variant."""
    datasets = {}
    for model in variants.values():
        for stage in shared_stages(model):
            data = stages_sharing(model, stage, progress=progress)
            datasets[dataset_name(f"sharing_{stage}", model)] = data
    return datasets
