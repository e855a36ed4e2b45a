"""All analyses of a case: modes, equilibria, load sharing, transients, torque drops.

Transients run in threads, concurrently with the other analyses.
"""

import math
import time
from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from itertools import count
from operator import attrgetter
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from flexgear.arrays import Array
from flexgear.model.case import Case
from flexgear.model.names import BodyName
from flexgear.results.face_load import cycle_figures, face_figures
from flexgear.results.run_folder import Run
from flexgear.solve.angles import lead_speed, one_turn, stage_motions
from flexgear.solve.bodies import Bodies, Progress, silent, when_done
from flexgear.solve.campbell import campbell
from flexgear.solve.deformed import bending_bodies, deformed, mode_shapes
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
TURN = 120  # least number of equilibria over one turn of a stage


class Stopwatch:
    """Wall times by stage of the work, s; times of the same stage are added."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Measure the time of the context."""
        start = time.perf_counter()
        try:
            yield
        finally:
            self.seconds[name] = self.seconds.get(name, 0.0) + time.perf_counter() - start


def models_of(
    case: Case, progress: Progress = silent, bodies: Bodies | None = None
) -> dict[str, Model]:
    """Models of a case by variant: the case itself, with rigid instead of flexible bodies if it has
    any, and without errors if it has any."""
    model = assemble(case, progress=progress, bodies=bodies)
    models = {model.variant: model}
    if case.flexible_stages and model.variant != "rigid":
        models["rigid"] = assemble(case, bodies=model.bodies, variant=case.flexible_bodies)
    progress("train in modes", 0.0)
    with single_threaded_blas(), ThreadPoolExecutor(WORKERS) as pool:
        for future in [pool.submit(attrgetter("modal"), model) for model in models.values()]:
            when_done(future).result()  # computed before threads share it
    progress("train in modes", 1.0)
    if model.has_errors:
        clean = model.without_errors()
        models[clean.variant] = clean
    return models


def _fields(model: Model, ideal: Model) -> dict[BodyName, xr.Dataset]:
    """Fields of every flexible FE body (of planets the first): deformation in equilibrium without
    errors, and shapes in natural modes."""
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
    """All analyses of a case, with and without errors, flexible and rigid, and their summary.

    watch: gets wall times; bodies: reduced bodies; workers: number of threads; folder: where
    transients are written during the run, so that they are not held in memory.
    """
    watch = watch or Stopwatch()
    with watch.stage("coupled_systems"):
        models = models_of(case, progress, bodies)
    first = next(iter(models.values()))
    ideal = first.without_errors() if case.flexible_stages else first
    window, angles = _positions(first)
    datasets: dict[str, xr.Dataset] = {}
    with single_threaded_blas(), transients(models, progress, workers, folder) as finished:
        with watch.stage("modes"):
            progress("modes", 0.0)
            limit = usual_limit(first)
            datasets["modes"] = modes(first, limit_hz=limit)
            progress("modes", 0.5)
            datasets["campbell"] = campbell(first, limit_hz=limit)
            progress("modes", 1.0)
        with watch.stage("equilibria"):
            results, fields = _equilibria(models, ideal, angles, progress)
            datasets |= results
            cycles, face_load = _face_load(models, datasets, progress)
            datasets |= cycles
        with watch.stage("load_sharing"):
            datasets |= _sharing(models, progress)
        with watch.stage("transients"):  # time after all other analyses
            done = finished()
    runs, drops = done.runs, done.drops
    datasets |= {dataset_name("transient", models[n]): timed.data for n, timed in runs.items()}
    datasets |= {drop_name(torque, models[n]): timed.data for (torque, n), timed in drops.items()}
    watch.seconds |= {f"transient_{label}": timed.wall for label, timed in runs.items()}
    summary = run_summary(Analyses(models, window, datasets, done, face_load, watch.seconds))
    return Run(case, first.flow, datasets, fields, summary)


def _equilibria(
    models: Mapping[str, Model], ideal: Model, angles: Array, progress: Progress
) -> tuple[dict[str, xr.Dataset], dict[BodyName, xr.Dataset]]:
    """Equilibria of the case at angles (p,) of the reference member, rad. With flexible stages also
    those without errors, with fields of bodies, and with rigid bodies if pairs have slices."""
    first, fields = next(iter(models.values())), dict[BodyName, xr.Dataset]()
    datasets = {"equilibrium": static(first, angles, progress=progress)}
    if first.case.flexible_stages:
        datasets["equilibrium_without_errors"] = static(ideal, angles, progress=progress)
        fields = _fields(first, ideal)
    if "rigid" in models and sliced_stages(first):
        datasets["equilibrium_rigid"] = static(models["rigid"], angles, progress=progress)
    return datasets, fields


def _face_load(
    models: Mapping[str, Model], datasets: Mapping[str, xr.Dataset], progress: Progress
) -> tuple[dict[str, xr.Dataset], dict[str, Any]]:
    """Gear-mesh cycles of stages with load along the face, and figures of every flank by variant;
    empty without such stages."""
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


def _positions(model: Model) -> tuple[str, Array]:
    """Positions of the equilibria in words, and as angles of the reference member, rad.

    Over one turn of the slowest stage whose forces do not repeat with its gear mesh (weight and
    loads of fixed direction, errors of gears, bolts of an FE ring); their number keeps
    ``POSITIONS`` phases of the gear mesh. Else over one gear-mesh cycle of the slowest stage; zero
    for a train that does not turn.
    """
    lead = lead_speed(model.case, model.flow)
    turning = [m for m in stage_motions(model.case, model.flow) if m.theta]
    uneven = [m for m in turning if m.cycle.gear_meshes > 1]
    if uneven:
        slowest = max(uneven, key=attrgetter("turn_period"))
        teeth = slowest.cycle.per_turn
        number = next(n for n in count(TURN) if n >= POSITIONS * math.gcd(n, teeth))
        angles = np.linspace(0, slowest.turn_period * abs(lead), number, endpoint=False)
        parallel = model.case.stage(slowest.name).kind == "parallel"
        member = "gear" if parallel else "carrier against the ring"
        of_stage = f" of {slowest.name}" if len(model.case.stages) > 1 else ""
        return f"one turn of the {member}{of_stage}", angles
    if not turning:
        return "one position", np.zeros(1)
    slowest = max(turning, key=lambda m: m.turn_period / m.cycle.per_turn)
    return "one gear-mesh cycle of the slowest stage", one_turn(slowest, lead, POSITIONS, 1)


def _sharing(variants: Mapping[str, Model], progress: Progress) -> dict[str, xr.Dataset]:
    """Quasi-static load sharing by stage and variant."""
    datasets = {}
    for model in variants.values():
        for stage in shared_stages(model):
            data = stages_sharing(model, stage, progress=progress)
            datasets[dataset_name(f"sharing_{stage}", model)] = data
    return datasets
