"""Manufacturing deviations of a rating: trains of the accuracy grade's worst slopes, or drawn ones.

The flanks of a gear mesh of gears 1 and 2 may run apart along the face by

    f_ma = √(f_Hβ1² + f_Hβ2²),

as ISO 6336-1 adds them up, with either sign. A planet that has both signs alike towards sun and
ring can lean after them, one with opposite signs cannot: the worst case is that of all four, and of
the case as it states its errors. Each gear mesh takes its load factors from the train where they
are worst, the bearings of a stage from that with the largest force.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from flexgear.arrays import Array
from flexgear.gears.geometry import stage_geometry
from flexgear.gears.rating.load_factors import helix_deviation
from flexgear.gears.rating.pair import gear_pair
from flexgear.model.case import Case
from flexgear.model.names import GroupName, MemberName
from flexgear.model.stage_view import StageView
from flexgear.solve.bin_loads import BinLoads, GroupLoads
from flexgear.studies.tolerance_samples import (
    drawn_errors,
    pitch_seeds,
    sample_values,
    with_sample,
)


def deviated_cases(case: Case) -> tuple[Case, ...]:
    """The case with every set of deviations by which it is to be rated. InputError for a grade that
    is missing, or nothing to draw."""
    if case.rating.deviations == "stated":
        return (case,)
    if case.rating.deviations == "drawn":
        numbers, seed = range(case.rating.deviation_samples), case.tolerance.seed
        values = sample_values(drawn_errors(case), seed, numbers)
        seeds = [pitch_seeds(stage.name, seed, numbers) for stage in case.stages]
        return tuple(with_sample(case, values, j, [s[j] for s in seeds]) for j in numbers)
    slopes = {stage.name: _slopes(case.view(stage.name)) for stage in case.stages}
    signs = [{"sun": s, "ring": r} for s, r in itertools.product((1.0, -1.0), repeat=2)]
    return (case, *(_sloped(case, slopes, of_flanks) for of_flanks in signs))


def _slopes(view: StageView) -> dict[str, float]:
    """f_ma of gear meshes "sun" and "ring", m; of stages with load along the face."""
    geometry = stage_geometry(view)
    if view.gear_mesh.model != "face_load" or geometry.overridden:
        return {}
    slopes = {}
    for role in geometry.gear_meshes:
        pair = gear_pair(view, geometry, role)
        squares = []
        for gear in pair.gears.values():
            deviation = helix_deviation(pair, gear)
            if deviation is None:
                key = f"{gear.name}.rating.accuracy_grade"
                raise view.refuse(key, "is missing", 'give it, or rating.deviations = "stated"')
            squares.append(deviation**2)
        slopes[role] = math.sqrt(sum(squares))
    return slopes


def _sloped(case: Case, slopes: dict[str, dict[str, float]], signs: dict[str, float]) -> Case:
    """Planets' flanks that run off by f_ma beside what the case states."""
    stages = []
    for stage in case.stages:
        update: dict[str, Any] = {}
        for role, slope in slopes[stage.name].items():
            key = f"planet_{role}_helix_slope"
            stated = np.array(stage.errors.of_planets(key, stage.planets))
            update[key] = tuple((stated + signs[role] * slope).tolist())
        errors = stage.errors.model_copy(update=update)
        stages.append(stage.model_copy(update={"errors": errors}))
    return case.model_copy(update={"stages": tuple(stages)})


def worst_of(deviated: Sequence[BinLoads]) -> BinLoads:
    """Loads of one bin of all trains."""
    groups: dict[GroupName, GroupLoads] = {}
    for k, loads in enumerate(deviated):
        for name, group in loads.groups.items():
            worst = groups.get(name, group)
            share = max(worst.largest_share, group.largest_share)
            if name not in groups or group.largest_line_load > worst.largest_line_load:
                worst = replace(group, deviated=k)
            groups[name] = replace(worst, largest_share=share)
    supports, angles = dict[str, Array](), dict[str, Array]()
    for stage in deviated[0].carrier_angle:
        worst_train = max(deviated, key=lambda loads: _largest(loads, stage))
        supports |= _of_stage(worst_train, stage)
        angles[stage] = worst_train.carrier_angle[stage]
    return BinLoads(groups, supports, angles, max(loads.closure for loads in deviated))


def _of_stage(loads: BinLoads, stage: str) -> dict[str, Array]:
    names = loads.supports.items()
    return {name: force for name, force in names if MemberName.parse(name).stage == stage}


def _largest(loads: BinLoads, stage: str) -> float:
    forces = _of_stage(loads, stage).values()
    return max((float(np.hypot(f[:, 0], f[:, 1]).max()) for f in forces), default=0.0)
