"""Rating under load bins: equilibria of every bin, then safety, damage and life of all parts.

Bins are solved independently, in this process, in others or on a cluster, and stored until the
rating is written, so that a stopped rating continues with the next bin. The rest is in closed form.

Every bin is solved for several trains: with the worst helix slopes of the accuracy grade, or with
random deviations. The helix slope deviations of gears 1 and 2 add up (ISO 6336-1) to

    f_ma = √(f_Hβ1² + f_Hβ2²),

of either sign. A planet whose gear meshes with sun and ring have f_ma of one sign can tilt and
follow both, one with opposite signs cannot. So all four combinations are solved, and the errors
that the case states. Each gear mesh takes the load factors of the train in which they are worst,
the bearings of a stage the forces of the train with the largest force.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from flexgear.arrays import Array
from flexgear.gears.geometry import stage_geometry
from flexgear.gears.load_bins import LoadBin, case_in_bin, idle_loads
from flexgear.gears.power_flow import power_flow
from flexgear.gears.rating.damage import PartLife, system_reliability
from flexgear.gears.rating.load_factors import SLOPE_SIGNS, misalignment, tolerance
from flexgear.gears.rating.pair import gear_pair
from flexgear.gears.tooth_faults import NOT_ASSESSED
from flexgear.model.case import Case
from flexgear.model.errors import FlexgearError, InputError
from flexgear.model.names import GroupName, MemberName
from flexgear.model.stage_view import StageView
from flexgear.results.rating import NOT_COVERED, RatedPart, Rating
from flexgear.solve.bin_loads import BinLoads, GroupLoads, SpectrumTrain, loads_in_bin
from flexgear.solve.bodies import Progress, reduced_bodies, silent
from flexgear.solve.load_series import load_bins
from flexgear.studies.dask_pool import reach
from flexgear.studies.job_pool import StudyStore, stored_or_run
from flexgear.studies.rating_bearings import rate_bearings
from flexgear.studies.rating_gears import pairs_of, rate_gears
from flexgear.studies.tolerance_samples import drawn_errors, pitch_seeds, sample_values, with_sample

FORMAT = 9  # of the files, and of the numerics behind them; raise it when either changes
CLOSED_FORM = "flanks, roots and bearings"  # label of progress
NO_SPECTRUM = "no load case has a duration, so that there is neither"


def rate(
    case: Case,
    bins: Sequence[LoadBin] = (),
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    progress: Progress = silent,
    keep_bins: bool = False,
) -> Rating:
    """Safety, damage and life of all flanks, roots and bearings of a case under its load cases.

    bins: result of ``bins_of``, if known already. workers, scheduler: as of ``run_jobs``;
    keep_bins: leave solved bins on disk until ``forget``. A case without load cases is rated at
    rated load. InputError for impossible load cases, FlexgearError where a bin has no equilibrium.
    """
    if scheduler is not None:
        reach(scheduler)
    bins = tuple(bins) or bins_of(case, progress)
    cases, pairs = deviated_cases(case), pairs_of(case)
    trains = [SpectrumTrain(each, bins) for each in cases]
    of_trains = []
    for train in trains:
        of_trains.append(_solved(train, workers, scheduler, progress))
        variant, samples = train.model.variant, train.samples
        train.release()
    loads = [worst_of(of_bin) for of_bin in zip(*of_trains, strict=True)]
    progress(CLOSED_FORM, 0.0)
    flows = [power_flow(case_in_bin(case, b)) for b in bins]
    gear_meshes, parts, missing = rate_gears(pairs, trains, flows, loads)
    progress(CLOSED_FORM, 0.5)
    parts = (*parts, *rate_bearings(case, bins, flows, loads))
    progress(CLOSED_FORM, 1.0)
    open_parts = {p.alike: p.missing for p in parts if p.missing}
    rating = Rating(
        case=case,
        variant=variant,
        bins=bins,
        gear_meshes=gear_meshes,
        parts=parts,
        reliability=_reliability(parts, sum(b.hours for b in bins)),
        not_assessed={
            **missing,
            **open_parts,
            **idle_loads(case, [(load.member, load.first) for b in bins for load in b.loads]),
            **({} if any(b.hours for b in bins) else {"damage and life": NO_SPECTRUM}),
            **_yield_unknown(bins, parts),
            **({"faults": NOT_ASSESSED} if case.faults else {}),
            **NOT_COVERED,
        },
        positions={stage: len(s.angles) for stage, s in samples.items()},
        halving=max(
            (
                (group.halving, str(name), load_bin.name)
                for load_bin, of_bin in zip(bins, loads, strict=True)
                for name, group in of_bin.groups.items()
            ),
            default=(0.0, "", ""),
        ),
        closure=max(x.closure for x in loads),
    )
    if not keep_bins:
        forget(case)
    return rating


def _reliability(parts: Sequence[RatedPart], hours: float) -> float | None:
    """Probability that no part fails within the hours of the bins, with a typical Weibull
    distribution for each kind of part; None where no part has a life."""
    lives = [
        PartLife.typical(part.rolling or part.kind, part.life)
        for part in parts
        for _ in range(part.count)
        if math.isfinite(part.life) and part.life > 0.0
    ]
    if any(part.life == 0.0 for part in parts):
        return 0.0
    return system_reliability(lives, hours) if lives else None


def bins_of(case: Case, progress: Progress = silent) -> tuple[LoadBin, ...]:
    """Load bins of a case; rated load without duration where it states none."""
    if case.load_cases or case.load_series is not None:
        return load_bins(case, progress)
    flow = power_flow(case)
    torque = {port.member: flow.torque[port.member] for port in case.ports}
    return (LoadBin("rated load", 0.0, torque, dict(flow.speed), case.loads, source=case.source),)


def _yield_unknown(bins: Sequence[LoadBin], parts: Sequence[RatedPart]) -> dict[str, str]:
    """Note that gears without a yield strength have roots under extreme loads; empty otherwise."""
    roots = [
        p.factors[b]
        for b, x in enumerate(bins)
        if x.extreme
        for p in parts
        if "S_F" in p.factors[b]
    ]
    unknown = any("S_0.2" not in sheet for sheet in roots)
    return {"yield of roots": "rating.yield_strength_mpa of gears is missing"} if unknown else {}


def _solved(
    train: SpectrumTrain, workers: int | None, scheduler: str | None, progress: Progress
) -> list[BinLoads]:
    """Loads of every bin, stored or solved now."""
    bins, store = train.bins, bin_store(train.case)
    files = [f"bin_{k}.pickle" for k in range(len(bins))]
    reduced_bodies(train.case, progress)  # fills the cache that all processes read
    progress("load bins", 0.0)
    first = next((k for k, file in enumerate(files) if store.get(file) is None), None)
    if first is not None:  # solved first, as it compiles loops and assembles the train for all
        store.put(files[first], loads_in_bin(train, bins[first]))
    finished, faults = stored_or_run(
        store, files, loads_in_bin, train, bins, workers=workers, scheduler=scheduler,
        progress=lambda share: progress("load bins", share),
    )  # fmt: skip
    if faults:
        k = min(faults)
        where = f"{bins[k].name} ({bins[k].source})"
        raise FlexgearError(f"{len(faults)} of {len(bins)} load bins failed; {where}: {faults[k]}")
    return [finished[k] for k in range(len(bins))]


def bin_store(case: Case) -> StudyStore[BinLoads]:
    """Store of the solved bins of a case, under a key of all that they depend on."""
    return StudyStore.of("rating", format=FORMAT, case=case.content_hash())


def finished(case: Case) -> int:
    """Bins that an interrupted rating has left on disk."""
    folders = [bin_store(each).folder for each in deviated_cases(case)]
    return sum(len(list(folder.glob("bin_*.pickle"))) for folder in folders)


def forget(case: Case) -> None:
    """Remove the finished bins of a rating."""
    for each in deviated_cases(case):
        bin_store(each).clear()


def deviated_cases(case: Case) -> tuple[Case, ...]:
    """The cases to be solved: one for each set of manufacturing deviations, all without the faults
    of the case. InputError for a missing accuracy grade, or where no error is drawn."""
    case = case.with_(faults=())
    if case.rating.deviations == "stated":
        return (case,)
    if case.rating.deviations == "drawn":
        numbers, seed = range(case.rating.deviation_samples), case.tolerance.seed
        values = sample_values(drawn_errors(case), seed, numbers)
        seeds = [pitch_seeds(stage.name, seed, numbers) for stage in case.stages]
        return tuple(with_sample(case, values, j, [s[j] for s in seeds]) for j in numbers)
    slopes = {stage.name: _slopes(case.view(stage.name)) for stage in case.stages}
    if not any(slopes.values()):
        problem = "is 'worst', and no stage has load along the face, which slopes act on"
        remedy = 'set gear_mesh.model = "face_load", or leave deviations out'
        raise InputError(case.source, "rating.deviations", problem, remedy)
    return (case, *(_sloped(case, slopes, of_flanks) for of_flanks in SLOPE_SIGNS))


def _slopes(view: StageView) -> dict[str, float]:
    """f_ma of gear meshes "sun" and "ring", m; empty for stages without load along the face."""
    geometry = stage_geometry(view)
    if view.gear_mesh.model != "face_load" or geometry.overridden:
        return {}
    slopes = {}
    for role in geometry.gear_meshes:
        pair = gear_pair(view, geometry, role)
        slope = misalignment(pair)
        if slope is None:
            gear = next(g for g in pair.gears.values() if tolerance(pair, g, "helix") is None)
            key = f"{gear.name}.rating.accuracy_grade"
            raise view.refuse(key, "is missing", 'give it, or rating.deviations = "stated"')
        slopes[role] = slope
    return slopes


def _sloped(case: Case, slopes: dict[str, dict[str, float]], signs: dict[str, float]) -> Case:
    """The case with helix slopes ±f_ma added to the flanks of its planets; signs: by role."""
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
    """Worst loads of one bin over all trains."""
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
    """Forces (p, 6) on the supports of a stage, by support."""
    supports = loads.supports.items()
    return {name: force for name, force in supports if MemberName.parse(name).stage == stage}


def _largest(loads: BinLoads, stage: str) -> tuple[float, float]:
    """Largest radial force of a stage's supports, N, and largest moment, N m. The force has four
    digits: flank deviations hardly change it, and the moment decides between equal forces."""
    forces = list(_of_stage(loads, stage).values())
    radial, moment = (
        max((float(np.hypot(f[:, k], f[:, k + 1]).max()) for f in forces), default=0.0)
        for k in (0, 3)
    )
    return float(f"{radial:.4g}"), moment
