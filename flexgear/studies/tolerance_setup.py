"""A case made ready for many sets of errors: system, positions and gear meshes, made once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from flexgear.analysis.equilibrium import Equilibrium
from flexgear.analysis.error_sets import (
    ErrorSets,
    ErrorStudy,
    GapSets,
    error_study,
    gear_mesh_forces,
)
from flexgear.analysis.line_loads import line_loads
from flexgear.arrays import Array
from flexgear.coupling.gear_meshes import GearMeshLabel
from flexgear.coupling.pair_data import PairData
from flexgear.coupling.system import System
from flexgear.gears.power_flow import power_flow
from flexgear.gears.slices import factor_along
from flexgear.model.case import Case
from flexgear.model.errors import InputError
from flexgear.model.faults import require_sound
from flexgear.model.names import GearMeshName, GroupName
from flexgear.model.tolerance import SizeDistribution
from flexgear.results.labelled_dataset import groups_of
from flexgear.results.load_sharing import load_sharing, planet_load_factors
from flexgear.solve.angles import lead_speed, one_turn, stage_motions
from flexgear.solve.bodies import Progress, reduced_bodies, silent
from flexgear.solve.face_load import along_face, largest_line_load, sections
from flexgear.solve.model import Model, assemble, rated_rotations
from flexgear.studies.modify import UNIT, gap_factors
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


@dataclass(frozen=True)
class Group:
    """Gear meshes that share a load: their places among all, their positions, their mean force."""

    name: GroupName
    places: NDArray[np.int64]
    positions: slice
    rated: float


@dataclass(frozen=True)
class ToleranceSetup:
    """All that a batch of samples needs; it is pickled for other processes.

    names (G,) of gear meshes, both flanks as one; sign (M, G): +1 of the flank that carries rated
    torque, −1 of the other; pairs: pair data of a case that has every error; variant: what bends;
    ground (2, B, K, T, n): factors of ``GapSets``, of the B drawn modifications.
    """

    case: Case
    drawn: tuple[DrawnError, ...]
    paths: StagePaths
    labels: tuple[GearMeshLabel, ...]
    pairs: PairData
    study: ErrorStudy
    names: tuple[GearMeshName, ...]
    sign: Array
    groups: tuple[Group, ...]
    variant: str
    ground: Array

    @property
    def shared(self) -> tuple[GearMeshName, ...]:
        """Gear meshes that share their load, group by group."""
        return tuple(self.names[m] for g in self.groups for m in g.places)


@dataclass(frozen=True)
class Batch:
    """What samples gave, first axis j. sizes (m) and phases (rad) of drawn errors; largest and
    mean K of the groups over the positions, (J, groups); the same of planets' load factors, (J, G)
    in the order of ``shared``. Where tooth pairs have slices the largest K_Hβ and line load (N/m)
    of the groups' gear meshes, (J, groups), else (J, 0)."""

    sizes: Array
    phases: Array
    load_sharing_max: Array
    load_sharing_mean: Array
    planet_max: Array
    planet_mean: Array
    k_h_beta: Array
    line_load: Array


def tolerance_setup(case: Case, progress: Progress = silent) -> ToleranceSetup:
    """Reduced bodies (from the cache where known), system, positions; InputError where nothing is
    drawn or nobody shares a load."""
    require_sound(case, "a tolerance study")
    drawn = drawn_errors(case)
    seeds = [0] * len(case.stages)
    every = with_sample(case, sample_values(drawn, 0, [0]), 0, seeds)
    turns = _turns(case)
    put = assemble(every, bodies=reduced_bodies(every, progress))
    system = put.system
    input_angles, slices = _positions(case, system, turns)
    names, sign, rated = put.gear_meshes.names, put.gear_meshes.sign, put.rated
    groups = tuple(
        Group(name, at, slices[name.stage], float(rated[at].mean()))
        for name, at in groups_of(names).items()
        if name.stage in slices
    )
    return ToleranceSetup(
        case=case,
        drawn=drawn,
        paths=paths_of(case),
        labels=system.gear_meshes,
        pairs=system.pairs,
        study=error_study(put.modal, input_angles, system.rated_torque),
        names=names,
        sign=sign,
        groups=groups,
        variant=put.variant,
        ground=_ground(put, drawn),
    )


def sampled(setup: ToleranceSetup, numbers: Sequence[int]) -> Batch:
    """Equilibria of the samples of these numbers over all positions."""
    seed = setup.case.tolerance.seed
    values = sample_values(setup.drawn, seed, numbers)
    names = [stage.name for stage in setup.case.stages]
    seeds = list(zip(*(pitch_seeds(name, seed, numbers) for name in names), strict=True))
    return _solved(setup, values, seeds)


def as_stated(setup: ToleranceSetup) -> Batch:
    """The same for the errors that the case itself states."""
    case = setup.case
    errors = [s.errors for s in case.stages]
    return _solved(setup, nominal(case, setup.drawn), [[e.seed for e in errors]])


def sets_of(setup: ToleranceSetup, values: Values, seeds: Sequence[Sequence[int]]) -> ErrorSets:
    """Errors of samples and gaps of their flanks; seeds: of the pitch deviations, by sample."""
    cases = [
        with_sample(setup.case, values, j, seeds_of_sample)
        for j, seeds_of_sample in enumerate(seeds)
    ]
    sets = error_sets(cases, setup.paths, setup.labels, setup.pairs)
    if not setup.ground.size:
        return sets
    return replace(sets, gaps=GapSets(_amounts(setup, values), setup.ground))


def _solved(setup: ToleranceSetup, values: Values, seeds: Sequence[Sequence[int]]) -> Batch:
    sets = sets_of(setup, values, seeds)
    along = np.full((2, len(sets), len(setup.groups)), np.nan)

    def look(j: int, equilibrium: Equilibrium) -> None:
        along[:, j] = _along_face(setup, equilibrium)

    sliced = bool(setup.pairs.slices.any())
    forces = gear_mesh_forces(setup.study, sets, look=look if sliced else None)
    force = _both_flanks(forces, setup.sign)
    along = along if sliced else along[:, :, :0]
    factor, share = [], []
    for g in setup.groups:
        forces_of_planets = force[:, g.positions][:, :, g.places]
        factor.append(load_sharing(forces_of_planets, g.rated))
        share.append(
            np.ascontiguousarray(planet_load_factors(forces_of_planets, g.rated).swapaxes(1, 2))
        )
    # a sample without an equilibrium somewhere is no number, not the largest of the others
    return Batch(
        sizes=_columns(setup.drawn, values, len(sets), phases=False),
        phases=_columns(setup.drawn, values, len(sets), phases=True),
        load_sharing_max=np.column_stack([k.max(axis=1) for k in factor]),
        load_sharing_mean=np.column_stack([k.mean(axis=1) for k in factor]),
        planet_max=np.column_stack([k.max(axis=-1) for k in share]),
        planet_mean=np.column_stack([k.mean(axis=-1) for k in share]),
        k_h_beta=along[0],
        line_load=along[1],
    )


def _ground(put: Model, drawn: Sequence[DrawnError]) -> Array:
    """``GapSets.factors`` of the drawn modifications, in their order."""
    amounts = []
    for error in drawn:
        if error.ground is None:
            continue
        key, base = error.ground.key, error.ground.base
        assert isinstance(error.distribution, SizeDistribution)
        most = max(UNIT, *(abs(end - base) for end in error.distribution.usual))
        key = f"stages.{error.stage}.{key}"
        amounts.append(gap_factors(put, key, error.ground.with_amount, base, most))
    return np.stack(amounts, axis=1) if amounts else np.zeros(0)


def _amounts(setup: ToleranceSetup, values: Values) -> Array:
    """What samples have more than the case of every drawn modification, (J, M, B) m."""
    amounts = []
    for error in setup.drawn:
        if error.ground is None:
            continue
        stage = setup.case.stage_index(error.stage)
        more = values[error.stage, error.key] - error.ground.base
        planet = [label.planet if error.planets else 0 for label in setup.labels]
        of_stage = np.array([label.stage == stage for label in setup.labels])
        amounts.append(more[:, planet] * of_stage)
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


def _both_flanks(force: Array, sign: Array) -> Array:
    """Gear-mesh forces (J, p, G) from those of every flank (p, M, J), N.

    Added up in a fixed order: the last digit must not depend on how many samples there are.
    """
    force_by_flank = np.zeros((force.shape[2], force.shape[0], sign.shape[1]))
    for m, g in zip(*np.nonzero(sign), strict=True):
        force_by_flank[:, :, g] += sign[m, g] * force[:, m].T
    return force_by_flank


def _columns(drawn: Sequence[DrawnError], values: Values, count: int, phases: bool) -> Array:
    columns = [values[e.stage, e.key] for e in drawn if e.is_phase == phases]
    return np.hstack(columns) if columns else np.zeros((count, 0))


def _turns(case: Case) -> dict[str, Array]:
    """Rotations (rad) of the reference member over one turn of the carrier, by stage that shares a
    load."""
    per = case.tolerance.positions_per_gear_mesh
    flow = power_flow(case)
    lead = lead_speed(case, flow)
    turns = {
        s.name: one_turn(m, lead, per, m.cycle.per_turn)
        for s, m in zip(case.stages, stage_motions(case, flow), strict=True)
        if s.planets > 1 and m.theta != 0
    }
    if not turns:
        raise InputError(
            case.source,
            "planets",
            "there is no stage whose planets share a load",
            "take a case with two planets or more",
        )
    return turns


def _positions(
    case: Case, system: System, turns: dict[str, Array]
) -> tuple[Array, dict[str, slice]]:
    """Independent rotations (p, F) over all turns, and whose they are."""
    parts, slices, at = [], {}, 0
    for stage, turn in turns.items():
        parts.append(rated_rotations(system, turn))
        slices[stage] = slice(at, at + len(turn))
        at += len(turn)
    return np.vstack(parts), slices
