"""From drawn manufacturing errors to the errors of all gear meshes of a system.

Geometry and stiffness of the gear meshes are those of the case; only errors are made anew.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from flexgear.analysis.error_sets import ErrorSets
from flexgear.coupling.gear_meshes import GearMeshLabel
from flexgear.coupling.pair_data import PairData
from flexgear.gears.contact import GearMeshPath
from flexgear.gears.errors import PairErrors, stage_errors
from flexgear.gears.gear_mesh_kind import GearMeshKind
from flexgear.gears.paths import PathKey, stage_paths
from flexgear.gears.power_flow import power_flow
from flexgear.model.case import Case

StagePaths = tuple[Mapping[PathKey, GearMeshPath], ...]


def paths_of(case: Case) -> StagePaths:
    """Paths of contact of every stage."""
    flows = power_flow(case).stages
    return tuple(stage_paths(case.view(flow.name), flow.gear_mesh_forces) for flow in flows)


def errors_of(case: Case, paths: StagePaths) -> list[Mapping[PathKey, PairErrors]]:
    """Errors of every stage by kind and side."""
    stages = zip(case.stages, paths, strict=True)
    return [stage_errors(case.view(stage.name), paths_of_stage) for stage, paths_of_stage in stages]


def error_sets(
    cases: Sequence[Case],
    paths: StagePaths,
    gear_meshes: Sequence[GearMeshLabel],
    base: PairData,
) -> ErrorSets:
    """Errors of all cases in the places of ``base``, pair data of such a case.

    All must have errors of bodies at the same places as the case that base was made from.
    """
    count = len(cases)

    def empty(like: np.ndarray) -> np.ndarray:
        return np.zeros((count, *like.shape))

    sets = ErrorSets(
        amplitude=empty(base.error_amplitude),
        phase=empty(base.error_phase),
        offset=empty(base.error_offset),
        slope=empty(base.error_slope),
        gear=empty(base.error_gear),
        planet=empty(base.error_planet),
        runout_amplitude=empty(base.runout_amplitude),
        runout_phase=empty(base.runout_phase),
    )
    groups: dict[tuple[int, GearMeshKind, str], tuple[list[int], list[int]]] = {}
    for m, label in enumerate(gear_meshes):
        places, planets = groups.setdefault((label.stage, label.kind, label.side), ([], []))
        places.append(m)
        planets.append(label.planet)
    for j, case in enumerate(cases):
        errors = errors_of(case, paths)
        for (stage, kind, side), (places, planets) in groups.items():
            _enter(sets, j, places, planets, errors[stage][kind, side])
    return sets


def _enter(sets: ErrorSets, j: int, places: list[int], planets: list[int], e: PairErrors) -> None:
    """Errors of one kind of gear mesh into the places of set j."""
    sets.amplitude[j, places] = e.harmonic_amplitude[planets]
    sets.phase[j, places] = e.harmonic_phase[planets]
    sets.offset[j, places] = e.offset[planets]
    sets.slope[j, places] = e.slope[planets]
    sets.gear[j, places, : len(e.gear_tooth)] = e.gear_tooth
    sets.planet[j, places, : e.planet_tooth.shape[1]] = e.planet_tooth[planets]
    terms = e.runout_amplitude.shape[1]
    sets.runout_amplitude[j, places, :terms] = e.runout_amplitude[planets]
    sets.runout_phase[j, places, :terms] = e.runout_phase[planets]
