"""Parameter studies: measures of a case over the values of one key, or a grid of several.

Every point is a separate case. A failed point has missing values and a message in the dataset; the
sweep fails only if all points do. Finished points are stored until the results of the sweep are
written, so that an interrupted sweep continues with the next point.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from flexgear.coupling.build import require_workable
from flexgear.model.arguments import Count
from flexgear.model.case import Case
from flexgear.model.errors import FlexgearError, InputError
from flexgear.model.load import load_case
from flexgear.results.dataset_file import provenance
from flexgear.results.quantities import MISSING
from flexgear.solve.bodies import Progress, named, silent, stage_bodies
from flexgear.studies.dask_pool import reach
from flexgear.studies.early_workers import Outcome
from flexgear.studies.job_pool import StudyStore, stored_or_run
from flexgear.studies.measures import MeasuredValues, chosen_measures, measured
from flexgear.studies.sweep_keys import WHERE, SweptKey, Values, points, swept_key, values_of

FORMAT = 4  # of the files, and of the numerics behind them; raise it when either changes


def _file(case: Case) -> str:
    """Name of the file that stores a point."""
    return f"{case.content_hash()}.pickle"


@dataclass(frozen=True)
class Sweep:
    """A sweep to be run. base: the case before the swept keys are set; grid: keys and texts of
    every point; cases: its case, or the error of its keys; measures: names; modes: number of modes
    to list."""

    base: Case
    keys: tuple[SweptKey, ...]
    grid: Sequence[Mapping[str, str]]
    cases: tuple[Case | InputError, ...]
    measures: tuple[str, ...]
    modes: int

    @property
    def store(self) -> StudyStore[MeasuredValues]:
        """Store of finished points, under a key of all inputs that the points share."""
        return StudyStore.of(
            "sweep", format=FORMAT, model=self.base.content_hash(), modes=self.modes,
            keys=[k.key for k in self.keys], measures=list(self.measures),
        )  # fmt: skip

    @property
    def workable(self) -> list[Case]:
        """Cases of the points whose keys are valid."""
        return [case for case in self.cases if not isinstance(case, InputError)]


def sweep(
    source: str | Path | Case,
    keys: Mapping[str, Values | str | Iterable[object]],
    *,
    settings: Mapping[str, object] | None = None,
    measures: Sequence[str] = (),
    modes: Count = 10,
    workers: Count | None = None,
    scheduler: str | None = None,
    progress: Progress = silent,
) -> xr.Dataset:
    """Measures of a case over all values of ``keys`` as one dataset.

    source: a case, a TOML file or the name of a bundled case. keys: values by key of the case with
    its unit, e.g. {"stage.face_width_mm": [30, 40]}, or as text of the command line, "0:50:6".
    settings: further keys to change. measures: names; if empty, the usual measures of the case.
    modes: number of natural modes to list. workers: number of processes (1: this process; None:
    chosen by the length of the study); scheduler: address of a Dask cluster instead. The variable
    ``message`` of the dataset has the reason why a point failed. InputError for invalid keys,
    values or measures, FlexgearError where every point fails.
    """
    plan = planned(source, keys, settings=settings, measures=measures, modes=modes)
    return run_sweep(plan, workers=workers, scheduler=scheduler, progress=progress)


def planned(
    source: str | Path | Case,
    keys: Mapping[str, Values | str | Iterable[object]],
    *,
    settings: Mapping[str, object] | None = None,
    measures: Sequence[str] = (),
    modes: int = 10,
) -> Sweep:
    """A sweep to be run; arguments as of ``sweep``."""
    if not keys:
        raise InputError(WHERE, "KEY=VALUES", "is missing", "e.g. stage.planets=3,4,5")
    base = load_case(source, settings)
    swept = tuple(swept_key(base, key, values_of(key, values)) for key, values in keys.items())
    grid = points(swept)
    chosen = chosen_measures(base, measures)
    for key in swept:
        if key.key in (settings or {}):
            raise InputError(WHERE, key.key, "is also given by --set", "keep one of them")
    cases = tuple(_case(source, {**(settings or {}), **point}) for point in grid)
    _require_one_workable(cases)
    return Sweep(base, swept, grid, cases, chosen, modes)


def run_sweep(
    plan: Sweep,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    progress: Progress = silent,
    keep_points: bool = False,
) -> xr.Dataset:
    """All points of a sweep as one dataset.

    workers, scheduler: as of ``sweep``; workers of a cluster need the same cache of bodies.
    keep_points: leave finished points on disk until ``plan.store.clear()``. Dimensions are the
    keys, then those of the measures. FlexgearError where every point fails.
    """
    if scheduler is not None:
        reach(scheduler)
    bodies, broken = _prepared(plan.workable, progress)
    outcomes = [Outcome[MeasuredValues](None, _fault(case, broken)) for case in plan.cases]
    left = {k: plan.cases[k] for k, outcome in enumerate(outcomes) if not outcome.message}
    jobs = [case for case in left.values() if isinstance(case, Case)]
    values, messages = stored_or_run(
        plan.store, [_file(case) for case in jobs], measured,
        (plan.base, plan.measures, plan.modes), jobs, workers=workers, scheduler=scheduler,
        progress=lambda share: progress("points", share),
    )  # fmt: skip
    for job, k in enumerate(left):
        outcomes[k] = Outcome(values.get(job), messages.get(job, ""))
    if all(o.value is None for o in outcomes):
        sets = ", ".join(f"{key} = {text}" for key, text in plan.grid[0].items())
        first = f"{sets}: {outcomes[0].message}"
        start = f"all {len(plan.grid)} points failed; the first, " if len(plan.grid) > 1 else ""
        raise FlexgearError(start + first)
    data = collected(plan.keys, outcomes)
    data.attrs = provenance(
        plan.base,
        "sweep of " + " and ".join(k.key for k in plan.keys),
        measures=", ".join(plan.measures),
        points=len(plan.grid),
        failed=sum(o.value is None for o in outcomes),
        reductions=bodies,
    )
    if not keep_points:
        plan.store.clear()
    return data


def finished(plan: Sweep) -> int:
    """Number of points that an interrupted run has left on disk."""
    store = plan.store
    return sum(store.get(_file(case)) is not None for case in plan.workable)


GAPS = "where the point failed or has fewer of them, and where its own value is missing"


def collected(keys: Sequence[SweptKey], outcomes: Sequence[Outcome[MeasuredValues]]) -> xr.Dataset:
    """Dataset over the grid; missing values where a point failed or has fewer modes, planets or
    stages than others."""
    coords: dict[str, Any] = {key.key: _coordinate(key) for key in keys}
    shape = tuple(len(key.ticks) for key in keys)
    dims = tuple(coords)
    patterns: dict[str, xr.DataArray] = {}
    inner: dict[str, xr.DataArray] = {}
    ticks: dict[str, dict[Any, None]] = {}  # of inner axes, in the order of first appearance
    for outcome in outcomes:
        for name, array in (outcome.value or {}).items():
            patterns.setdefault(name, array)
            for dim in map(str, array.dims):
                inner.setdefault(dim, array[dim])
                ticks.setdefault(dim, {}).update(dict.fromkeys(array[dim].to_numpy().tolist()))
    variables: dict[str, Any] = {}
    for name, pattern in patterns.items():
        words = pattern.dtype.kind in "UO"
        gap = "" if words else np.nan
        labels = {str(dim): list(ticks[str(dim)]) for dim in pattern.dims}
        nothing = pattern[dict.fromkeys(labels, slice(0))] if labels else xr.DataArray(gap)
        arrays = [(outcome.value or {}).get(name, nothing) for outcome in outcomes]
        aligned = [array.reindex(labels, fill_value=gap).to_numpy() for array in arrays]
        values = np.reshape(np.array(aligned), (*shape, *map(len, labels.values())))
        about = pattern.attrs if words else {**pattern.attrs, MISSING: GAPS}
        variables[name] = ((*dims, *labels), values if words else values.astype(float), about)
    messages = np.reshape([outcome.message for outcome in outcomes], shape)
    about = {"units": "", "long_name": "why the point failed; empty where it did not"}
    variables["message"] = (dims, messages.astype(str), about)
    for dim, axis in inner.items():
        coords[dim] = xr.Variable(dim, list(ticks[dim]), axis.attrs)
        if len(ticks[dim]) == axis.size:
            coords |= {str(n): c for n, c in axis.coords.items() if n != dim and c.dims == (dim,)}
    return xr.Dataset(variables, coords)


def failures(data: xr.Dataset, name: str = "message") -> list[tuple[str, str]]:
    """Failed points of a sweep, as text, with their messages; for the name "warning" points with
    warnings."""
    out: list[tuple[str, str]] = []
    if name not in data:
        return out
    for point in np.argwhere(data[name].to_numpy() != ""):
        failure = data[name][tuple(point)]
        ticks = {dim: failure[dim].item() for dim in data[name].dims}
        texts = (f"{d} = {f'{v:g}' if isinstance(v, float) else v}" for d, v in ticks.items())
        out.append((", ".join(texts), str(failure.item())))
    return out


def _case(source: str | Path | Case, settings: Mapping[str, object]) -> Case | InputError:
    """The case of a point, or the error of its keys."""
    try:
        return load_case(source, settings)
    except InputError as fault:
        where = WHERE if fault.where == "--set" else fault.where
        return InputError(where, fault.key, fault.problem, fault.remedy)


def _require_one_workable(cases: Sequence[Case | InputError]) -> None:
    """InputError of the first point if no point of the grid can be computed.

    It spares the meshing of flexible bodies for nothing. Lumped trains are checked when they are
    solved, as some measures need no supports.
    """
    faults = []
    for case in cases:
        try:
            if isinstance(case, InputError):
                raise case
            if case.flexible_stages:
                require_workable(case)
            return
        except InputError as fault:
            faults.append(fault)
    raise faults[0]


def _prepared(cases: Sequence[Case], progress: Progress) -> tuple[int, dict[str, str]]:
    """Reduce the FE bodies of all points, one set after the other, so that each is reduced once,
    with all processors, and workers read it from the cache.

    Returns the number of distinct sets and the messages of failed ones by ``bodies_hash``.
    """
    stages = {
        stage.bodies_hash(): stage for case in cases for stage in case.flexible_stages.values()
    }
    different, broken = set(), dict[str, str]()
    for k, (key, stage) in enumerate(stages.items(), 1):
        which = f"bodies {k} of {len(stages)}" if len(stages) > 1 else ""
        try:
            bodies = stage_bodies(stage, named(which, progress))
        except FlexgearError as error:
            broken[key] = " ".join(str(error).split())
            continue
        different.add(tuple(zlib.crc32(p.stiffness.tobytes()) for p in bodies.values()))
    return len(different), broken


def _fault(case: Case | InputError, broken: Mapping[str, str]) -> str:
    """Reason why a point is not computed; empty for a point that is."""
    if isinstance(case, InputError):
        return str(case)
    keys = (stage.bodies_hash() for stage in case.flexible_stages.values())
    return next((broken[key] for key in keys if key in broken), "")


def _coordinate(key: SweptKey) -> xr.Variable:
    """Values of a swept key as a coordinate of the dataset."""
    about = {"units": key.units, "long_name": key.name, "logarithmic": int(key.values.logarithmic)}
    return xr.Variable((key.key,), list(key.ticks), about)
