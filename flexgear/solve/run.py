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

from flexgear.coupling.pace import too_coarse
from flexgear.files.atomic import plain
from flexgear.gears.implausible import implausible
from flexgear.gears.power_flow import PowerFlow
from flexgear.model.case import Case
from flexgear.model.names import BodyName
from flexgear.results.face_load import cycle_figures, edge_warnings, face_figures
from flexgear.results.settling import window_of
from flexgear.results.stage_figures import flow_summary
from flexgear.results.summary import (
    build_summary,
    finite,
    modes_summary,
    sharing_summary_of,
)
from flexgear.results.version import version
from flexgear.solve.angles import lead_speed, one_turn, stage_motions
from flexgear.solve.bodies import Bodies, Progress, rigid_bodies, silent
from flexgear.solve.campbell import campbell
from flexgear.solve.deformed import bending_bodies, deformed, mode_shapes
from flexgear.solve.headlines import headlines
from flexgear.solve.linear import harmonic_data, harmonic_figures, train_harmonic, why_not_linear
from flexgear.solve.model import Model, assemble
from flexgear.solve.modes import modes, usual_limit
from flexgear.solve.resonance import resonance_figures
from flexgear.solve.result_warnings import (
    large_motions,
    largest_motions,
    motion_histories,
    neglected,
    reduction_warnings,
)
from flexgear.solve.run_transients import (
    bodies_summary,
    dataset_name,
    drop_name,
    residual_of_run,
    stages_summary,
    transient_summary,
    transients,
    unsettled_lines,
)
from flexgear.solve.static import (
    gear_mesh_cycles,
    shared_stages,
    sharing_attrs,
    sliced_stages,
    stages_sharing,
    static,
)
from flexgear.solve.transient import cut_short
from flexgear.structures.linalg.dense import single_threaded_blas

WORKERS = 2
POSITIONS = 24  # equilibria over one gear-mesh cycle of the slowest stage
TURN = 120  # equilibria over one turn of the lead where rings bend


@dataclass(frozen=True)
class Run:
    """What a run leaves: datasets by file name (without suffix), displacement fields by body,
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
    """Of every body that bends, of planets the first: deformed without errors, and its shapes in
    the natural modes."""
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
    place: Path | None = None,
) -> Run:
    """Every analysis of a case, with and without errors, flexible and rigid, and the figures.

    place: a folder that gets the transients as they come, so that none is in memory as a whole.
    """
    watch = watch or Stopwatch()
    with watch.stage("coupled_systems"):
        models = models_of(case, progress, bodies)
    first = next(iter(models.values()))
    ideal = first.without_errors() if case.flexible_stages else first
    datasets: dict[str, xr.Dataset] = {}
    with single_threaded_blas(), transients(models, progress, workers, place) as ended:
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
            sharing = _sharing(models, progress)
        datasets |= sharing
        with watch.stage("transients"):  # what of them goes on after all else
            runs, drops, torque_steps = ended()
    datasets |= {dataset_name("transient", models[n]): timed.data for n, timed in runs.items()}
    datasets |= {drop_name(torque, models[n]): timed.data for (torque, n), timed in drops.items()}
    first_run = next(iter(runs.values()))
    harmonic: dict[str, Any] = {"reason": why_not_linear(first.system)}
    if harmonic["reason"] is None:
        with watch.stage("harmonic"):
            data = harmonic_data(first, train_harmonic(first), first_run.data)
            datasets["harmonic"], harmonic = data, harmonic_figures(data)
    watch.seconds |= {f"transient_{label}": timed.wall for label, timed in runs.items()}
    motions = _motions(datasets["equilibrium"], first_run.data)
    summary = build_summary(
        case=case.name,
        result="run",
        version=version(),
        content_hash=case.content_hash(),
        variant=first.variant,
        errors_given=first.has_errors,
        equilibrium_window=_positions_words(first),
        system=_system(first),
        power_flow=flow_summary(first.flow),
        stages=stages_summary(first, datasets["equilibrium"]),
        modes=modes_summary(datasets["modes"]),
        resonance=resonance_figures(case, datasets["campbell"], datasets["modes"]),
        load_sharing={
            "quasi_static": {n: _shared(sharing, n) for n in models},
            "transient": {
                n: {**sharing_summary_of(timed.data), **window_of(timed.data).figures}
                for n, timed in runs.items()
            },
        },
        transient=transient_summary(first_run),
        motion_um_max={name: 1e6 * size for name, size in motions.items()},
        harmonic=harmonic,
        torque_steps=torque_steps,
        energy_residual=residual_of_run(first, runs, drops),
        solver=first.pace.summary,
        equilibrium_closure_max=datasets["equilibrium"].attrs["closure_max"],
        warnings=[
            *_warnings(first, face_load),
            *unsettled_lines(runs),
            *large_motions(case, motions),
        ],
        timing_s=watch.seconds,
        # of one core, as several runs go side by side
        realtime_factor=first_run.realtime_factor,
        **({"face_load": face_load} if face_load else {}),
        **bodies_summary(models, datasets, runs),
    )
    beside = neglected(case, first.flow, summary)
    warnings = [*summary["warnings"], *(effect["sentence"] for effect in beside)]
    summary |= {"neglected": beside, "warnings": warnings}
    summary["headlines"] = plain(headlines(case, first.flow, summary))
    return Run(case, first.flow, datasets, fields, summary)


def _system(model: Model) -> dict[str, Any]:
    """Size of the coupled system and of what is kept of it."""
    return {
        "bodies": len(model.system.bodies),
        "coordinates": model.system.size,
        **finite(model.modal.figures),
    }


def _warnings(model: Model, face_load: Mapping[str, Any]) -> list[str]:
    """What a reader of the results should know; face_load: figures of flanks by variant."""
    case = model.case
    return [
        *implausible(case, model.flow),
        *too_coarse(model.pace, case.solver),
        *cut_short(case, model.flow),
        *edge_warnings(face_load.get(model.variant, {})),
        *reduction_warnings(case, model.bodies, rigid_bodies(case)),
    ]


def _motions(equilibria: xr.Dataset, transient: xr.Dataset) -> dict[str, float]:
    """Largest displacement by body, m: over the equilibria and the transient, of ring teeth over
    the equilibria alone."""
    motions = largest_motions(motion_histories(equilibria))
    in_time = largest_motions(
        motion_histories(transient.drop_vars("tooth_displacement", errors="ignore"))
    )
    return motions | {name: max(size, motions[name]) for name, size in in_time.items()}


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
    """Lead angles over one gear-mesh cycle of the slowest stage, where rings bend over a whole turn
    of carrier against ring; one of a train at rest."""
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


def _positions_words(model: Model) -> str:
    """What the equilibria of a run cover, as a sentence says it."""
    turning = [m for m in stage_motions(model.case, model.flow) if m.theta]
    if any(m.name in model.case.fe_ring_stages for m in turning):
        return "one turn of the carrier against the ring"
    return "one gear-mesh cycle of the slowest stage" if turning else "one position"


def _sharing(variants: Mapping[str, Model], progress: Progress) -> dict[str, xr.Dataset]:
    """Quasi-static load sharing by stage and variant."""
    datasets = {}
    for model in variants.values():
        for stage in shared_stages(model):
            data = stages_sharing(model, stage, progress=progress)
            datasets[dataset_name(f"sharing_{stage}", model)] = data
    return datasets


def _shared(sharing: Mapping[str, xr.Dataset], label: str) -> dict[str, Any]:
    """Figures of one variant's quasi-static load sharing by stage."""
    return {
        str(data.attrs["stage"]): {**sharing_attrs(data), **sharing_summary_of(data)}
        for data in sharing.values()
        if data.attrs["variant"] == label
    }
