"""Tolerance study: load sharing of many sets of parts with random manufacturing errors.

The case is assembled once for all sets of errors. Samples are solved in batches, by processes of
this machine or on a Dask cluster. Finished batches are stored until the results are written, so
that an interrupted study continues with the next batch. A sample depends only on the seed and its
number, not on batches or workers.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

from flexgear.analysis.equilibrium import Equilibrium
from flexgear.analysis.error_sets import ErrorSets, GapSets, gear_mesh_forces
from flexgear.analysis.line_loads import line_loads
from flexgear.arrays import Array
from flexgear.coupling.modal import ModalSystem
from flexgear.coupling.system import System
from flexgear.gears.power_flow import power_flow
from flexgear.gears.slices import factor_along
from flexgear.model.case import Case
from flexgear.model.errors import FlexgearError, InputError
from flexgear.model.faults import require_sound
from flexgear.model.names import GearMeshName, GroupName
from flexgear.model.tolerance import SizeDistribution
from flexgear.results.dataset_file import provenance
from flexgear.results.labelled_dataset import groups_of
from flexgear.results.load_sharing import load_sharing, planet_load_factors
from flexgear.results.tolerance_dataset import SPREADS, tolerance_dataset
from flexgear.solve.angles import lead_speed, one_turn, stage_motions
from flexgear.solve.bodies import Progress, reduced_bodies, silent
from flexgear.solve.face_load import along_face, largest_line_load, sections
from flexgear.solve.model import Model, assemble, rated_rotations
from flexgear.studies.dask_pool import reach
from flexgear.studies.flank_amounts import UNIT, gap_coefficients
from flexgear.studies.job_pool import StudyStore, stored_or_run
from flexgear.studies.tolerance_samples import (
    DrawnError,
    StagePaths,
    Values,
    drawn_errors,
    error_sets,
    nominal,
    paths_of,
    pitch_seeds,
    sample_values,
    with_sample,
)

Batch = dict[str, Array]  # values of samples by variable of the dataset


@dataclass(frozen=True)
class Group:
    """Gear meshes that share a load. places: indices among all gear meshes; positions: range of the
    positions over a turn of their stage; rated: mean force at rated torque, N."""

    name: GroupName
    places: NDArray[np.int64]
    positions: slice
    rated: float


@dataclass(frozen=True)
class ToleranceSetup:
    """Input of every batch of samples; picklable for other processes.

    names: (G,) gear meshes, both flanks as one; sign: (M, G) of a flank in its gear mesh, +1 of the
    flank loaded by rated torque, −1 of the other one; modal: the train with all drawn errors;
    input_angles (p, F): positions, rad; variant: label of the flexible bodies; gap_factors:
    (2, B, K, T, n) factors of ``GapSets`` for the B drawn modifications.
    """

    case: Case
    drawn: tuple[DrawnError, ...]
    paths: StagePaths
    modal: ModalSystem
    input_angles: Array
    names: tuple[GearMeshName, ...]
    sign: Array
    groups: tuple[Group, ...]
    variant: str
    gap_factors: Array

    @property
    def shared(self) -> tuple[GearMeshName, ...]:
        """Gear meshes that share their load, group by group."""
        return tuple(self.names[m] for g in self.groups for m in g.places)


def tolerance_setup(case: Case, progress: Progress = silent) -> ToleranceSetup:
    """Input of the batches of a study, with the assembled case; InputError where no error is drawn
    or no planets share a load."""
    require_sound(case, "a tolerance study")
    turns = _turns(case)
    drawn = drawn_errors(case)
    seeds = [0] * len(case.stages)
    with_all_errors = with_sample(case, sample_values(drawn, 0, [0]), 0, seeds)
    model = assemble(with_all_errors, bodies=reduced_bodies(with_all_errors, progress))
    system = model.system
    input_angles, slices = _positions(system, turns)
    names, sign, rated = model.gear_meshes.names, model.gear_meshes.sign, model.rated
    groups = tuple(
        Group(name, at, slices[name.stage], float(rated[at].mean()))
        for name, at in groups_of(names).items()
        if name.stage in slices
    )
    return ToleranceSetup(
        case=case,
        drawn=drawn,
        paths=paths_of(case),
        modal=model.modal,
        input_angles=input_angles,
        names=names,
        sign=sign,
        groups=groups,
        variant=model.variant,
        gap_factors=_gap_factors(model, drawn),
    )


def sampled(setup: ToleranceSetup, numbers: Sequence[int]) -> Batch:
    """Batch of the samples with these numbers, solved at all positions."""
    seed = setup.case.tolerance.seed
    values = sample_values(setup.drawn, seed, numbers)
    names = [stage.name for stage in setup.case.stages]
    seeds = list(zip(*(pitch_seeds(name, seed, numbers) for name in names), strict=True))
    return _solved(setup, values, seeds)


def as_stated(setup: ToleranceSetup) -> Batch:
    """Batch of one sample with the errors that the case states."""
    case = setup.case
    errors = [s.errors for s in case.stages]
    return _solved(setup, nominal(case, setup.drawn), [[e.seed for e in errors]])


def sets_of(setup: ToleranceSetup, values: Values, seeds: Sequence[Sequence[int]]) -> ErrorSets:
    """Errors and flank gaps of samples; seeds: of the pitch deviations, by sample and stage."""
    cases = [with_sample(setup.case, values, j, of_sample) for j, of_sample in enumerate(seeds)]
    system = setup.modal.system
    sets = error_sets(cases, setup.paths, system.gear_meshes, system.pairs)
    if not setup.gap_factors.size:
        return sets
    return replace(sets, gaps=GapSets(_amounts(setup, values), setup.gap_factors))


def _solved(setup: ToleranceSetup, values: Values, seeds: Sequence[Sequence[int]]) -> Batch:
    """Batch of J samples, by the first axis of every array: sizes (m) and phases (rad) of drawn
    errors; largest and mean K over the positions by group, (J, groups); the same of the load
    factors of planets, (J, G) in the order of ``shared``; largest K_Hβ and line load (N/m) by
    group, (J, groups), or (J, 0) where tooth pairs have no slices."""
    sets = sets_of(setup, values, seeds)
    along = np.full((2, len(sets), len(setup.groups)), np.nan)

    def store_face_loads(j: int, equilibrium: Equilibrium) -> None:
        along[:, j] = _along_face(setup, equilibrium)

    modal = setup.modal
    sliced = bool(modal.system.pairs.slices.any())
    look = store_face_loads if sliced else None
    forces = gear_mesh_forces(modal, setup.input_angles, modal.system.rated_torque, sets, look)
    # in a fixed order, so that rounding does not depend on the number of samples
    sign = setup.sign
    force = np.zeros((forces.shape[2], forces.shape[0], sign.shape[1]))
    for m, g in zip(*np.nonzero(sign), strict=True):
        force[:, :, g] += sign[m, g] * forces[:, m].T
    along = along if sliced else along[:, :, :0]
    factor, share = [], []
    for g in setup.groups:
        forces_of_planets = force[:, g.positions][:, :, g.places]
        factor.append(load_sharing(forces_of_planets, g.rated))
        share.append(
            np.ascontiguousarray(planet_load_factors(forces_of_planets, g.rated).swapaxes(1, 2))
        )
    # NaN at one position makes the maximum NaN: a sample needs an equilibrium at every position
    return {
        "error_size": _columns(setup.drawn, values, len(sets), phases=False),
        "error_phase": _columns(setup.drawn, values, len(sets), phases=True),
        "load_sharing_max": np.column_stack([k.max(axis=1) for k in factor]),
        "load_sharing_mean": np.column_stack([k.mean(axis=1) for k in factor]),
        "planet_load_factor_max": np.column_stack([k.max(axis=-1) for k in share]),
        "planet_load_factor_mean": np.column_stack([k.mean(axis=-1) for k in share]),
        "k_h_beta": along[0],
        "largest_line_load": along[1],
    }


def _gap_factors(model: Model, drawn: Sequence[DrawnError]) -> Array:
    """``GapSets.factors`` of the drawn modifications; empty without such modifications."""
    amounts = []
    for error in drawn:
        if error.flank is None:
            continue
        assert isinstance(error.distribution, SizeDistribution)
        largest = max(abs(end - error.flank.base) for end in error.distribution.usual)
        amounts.append(gap_coefficients(model, error.flank, max(UNIT, largest)))
    return np.stack(amounts, axis=1) if amounts else np.zeros(0)


def _amounts(setup: ToleranceSetup, values: Values) -> Array:
    """Increase (J, M, B), m, of each drawn modification over its amount in the case."""
    amounts, labels = [], setup.modal.system.gear_meshes
    for error in setup.drawn:
        if error.flank is None:
            continue
        stage = setup.case.stage_index(error.stage)
        increase = values[error.stage, error.key] - error.flank.base
        planet = [label.planet if error.planets else 0 for label in labels]
        of_stage = np.array([label.stage == stage for label in labels])
        amounts.append(increase[:, planet] * of_stage)
    return np.stack(amounts, axis=2)


def _along_face(setup: ToleranceSetup, equilibrium: Equilibrium) -> tuple[list[float], list[float]]:
    """Largest K_Hβ and line load (N/m) of the gear meshes of every group over its positions."""
    lines, pairs = line_loads(equilibrium), equilibrium.modal.system.pairs
    if lines is None:
        return [], []
    largest, along = largest_line_load(pairs, lines), along_face(pairs, lines)
    share = 0.5 * sections(pairs) / pairs.half_face
    factors, loads = [], []
    for g in setup.groups:
        flanks = np.flatnonzero(setup.sign[:, g.places].any(axis=1))
        loads.append(float(largest[g.positions][:, flanks].max()))
        means = zip(along[g.positions][:, flanks].mean(axis=0), share[flanks], strict=True)
        factors.append(max(factor_along(mean, load) for mean, load in means if mean.max() > 0))
    return factors, loads


def _columns(drawn: Sequence[DrawnError], values: Values, count: int, phases: bool) -> Array:
    """Drawn phases, or sizes, of so many samples, a column for each value."""
    columns = [values[e.stage, e.key] for e in drawn if e.is_phase == phases]
    return np.hstack(columns) if columns else np.zeros((count, 0))


def _turns(case: Case) -> dict[str, Array]:
    """Rotations (rad) of the reference member over one turn of the carrier, by stage with planets
    that share a load."""
    per_gear_mesh = case.tolerance.positions_per_gear_mesh
    flow = power_flow(case)
    speed = lead_speed(case, flow)
    turns = {
        s.name: one_turn(m, speed, per_gear_mesh, m.cycle.per_turn)
        for s, m in zip(case.stages, stage_motions(case, flow), strict=True)
        if s.planets > 1 and m.theta != 0 and any(flow.stage(s.name).gear_mesh_forces.values())
    }
    if not turns:
        problem = "there is no stage whose planets share a load and turn"
        remedy = "take a case with two planets or more, at a speed and torque that are not zero"
        raise InputError(case.source, "planets", problem, remedy)
    return turns


def _positions(system: System, turns: dict[str, Array]) -> tuple[Array, dict[str, slice]]:
    """Independent rotations (p, F) over the turns of all stages, and the range of each stage."""
    parts, slices, at = [], {}, 0
    for stage, turn in turns.items():
        parts.append(rated_rotations(system, turn))
        slices[stage] = slice(at, at + len(turn))
        at += len(turn)
    return np.vstack(parts), slices


BATCH = 100  # samples solved together
FORMAT = 7  # of the files, and of the numerics behind them; raise it when either changes


def batch_store(case: Case) -> StudyStore[Batch]:
    """Store of finished batches, under a key of all inputs of a sample. The number of samples is
    not among them, so a larger study uses the batches of a smaller one."""
    drawn = case.tolerance.model_dump(exclude={"samples", "confidence"})
    model = case.content_hash()
    return StudyStore.of("tolerance", format=FORMAT, model=model, tolerance=drawn)


def _file(numbers: range) -> str:
    """Name of the file that stores a batch."""
    return f"samples_{numbers.start}_{numbers.stop}.pickle"


def tolerance(
    case: Case,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    progress: Progress = silent,
    keep_batches: bool = False,
) -> xr.Dataset:
    """Dataset of the study that the section ``tolerance`` of a case describes.

    workers: number of processes (1: this process; None: chosen by the length of the study);
    scheduler: address of a Dask cluster instead; keep_batches: leave finished batches on disk, in
    ``batch_store``. InputError where no error is drawn or no planets share a load, FlexgearError
    where batches failed.
    """
    if scheduler is not None:
        reach(scheduler)
    with threadpool_limits(limits=1):
        setup = tolerance_setup(case, progress)
        stated = as_stated(setup)
        batches = batches_of(setup.case.tolerance.samples)
        solved, faults = stored_or_run(
            batch_store(setup.case), [_file(b) for b in batches], sampled, setup, batches,
            workers=workers, scheduler=scheduler, progress=lambda share: progress("samples", share),
        )  # fmt: skip
        if faults:
            first = batches[min(faults)]
            raise FlexgearError(
                f"{len(faults)} of {len(batches)} batches of samples failed; samples "
                f"{first.start} to {first.stop - 1}: {faults[min(faults)]}; the same study goes on "
                "with what is missing"
            )
    data = _dataset(setup, stated, [solved[k] for k in range(len(batches))])
    if not keep_batches:
        batch_store(case).clear()
    return data


def batches_of(samples: int) -> list[range]:
    """Numbers of the samples of every batch."""
    return [range(first, min(first + BATCH, samples)) for first in range(0, samples, BATCH)]


def finished(case: Case) -> int:
    """Samples of a study that an interrupted run has left on disk."""
    store, batches = batch_store(case), batches_of(case.tolerance.samples)
    return sum(len(batch) for batch in batches if store.get(_file(batch)) is not None)


def _dataset(setup: ToleranceSetup, stated: Batch, batches: Sequence[Batch]) -> xr.Dataset:
    """Dataset of all batches, with the figures of the errors that the case states."""
    case = setup.case
    samples = {name: np.concatenate([batch[name] for batch in batches]) for name in stated}
    labels = {p: [n for e in setup.drawn if e.is_phase == p for n in e.labels] for p in (0, 1)}
    positions = {g.name: g.positions.stop - g.positions.start for g in setup.groups}
    return tolerance_dataset(
        samples | {f"{name}_as_stated": stated[s.variable][0] for name, s in SPREADS.items()},
        sizes=labels[False],
        phases=labels[True],
        gear_meshes=setup.shared,
        confidence=case.tolerance.confidence,
        attrs=provenance(
            case,
            setup.variant,
            seed=case.tolerance.seed,
            positions=json.dumps(positions, ensure_ascii=False),
        ),
    )
