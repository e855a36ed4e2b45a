"""Transients of the whole job, in threads while other analyses go on, and figures of a run.

Runs of different variants share nothing but constant data; the compiled time step and products of
matrices let go of the interpreter lock. The other analyses count as one of those that work at a
time: three threads on two cores take longer than two.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Future
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from flexgear.coupling.pace import timed_drops
from flexgear.model.case import Case
from flexgear.results.quantities import values
from flexgear.results.sinks import between
from flexgear.results.time_figures import STAGE_DROP, StageDrop, drop_summary
from flexgear.solve.bodies import Progress, stoppable_pool
from flexgear.solve.linear import why_not_linear
from flexgear.solve.long_run import TimedRun, shelved
from flexgear.solve.model import Model
from flexgear.solve.transient import RATED_DRIVE, compile_transient, simulate, torque_drop


def depth_name(torque: float) -> str:
    """Name of a torque drop by the torque it drops to: "0.4e6" for 4e5 N·m, "1200" for 1200."""
    return f"{torque / 1e6:g}e6" if abs(torque) >= 1e5 else f"{torque:g}"


def drop_figures(case: Case, timed: TimedRun) -> dict[str, Any]:
    """Figures of a transient with a torque drop, from the moment at which the torque falls."""
    start, duration, after = timed_drops(case).times
    data = between(timed.data, start)  # what comes before lets the train settle
    return {
        **drop_summary(data),
        "window_s": [start, start + duration + after],
        **{s: values(STAGE_DROP, StageDrop(data, s)) for s in case.fe_ring_stages},
    }


class Ended(NamedTuple):
    """Runs by variant; torque drops by torque and variant, and their figures by the name of the
    depth and variant."""

    runs: dict[str, TimedRun]
    drops: dict[tuple[float, str], TimedRun]
    torque_steps: dict[str, dict[str, Any]]


Job = Callable[[], TimedRun]


@contextmanager
def transients(
    models: Mapping[str, Model], progress: Progress, workers: int, folder: Path | None
) -> Iterator[Callable[[], Ended]]:
    """Begin a transient of each variant in which anything moves, and the torque drops of those with
    errors, ``workers`` at a time, the caller being one of them; yields what waits for all.

    folder: see ``shelved``. They end when the block fails, or they do.
    """
    first = next(iter(models.values()))
    with stoppable_pool(max(1, workers - 1), progress) as (pool, watched):
        compiled = pool.submit(compile_transient, first, energy=_has_drops(first))

        def begun(name: str, job: Callable[..., TimedRun]) -> TimedRun:
            compiled.result()
            return shelved(folder, name, job)

        jobs = {key: partial(begun, *job) for key, job in _jobs(models, watched).items()}
        waiting = {
            key: (pool.submit(job), job if workers > 1 else None) for key, job in jobs.items()
        }
        yield partial(_ended, first.case, waiting)


def _ended(case: Case, waiting: Mapping[Any, tuple[Future[TimedRun], Job | None]]) -> Ended:
    """All runs. Threads take them from the front; the caller does, from the back, those that none
    has begun, if it has their jobs."""
    done = {}
    for key, (future, job) in reversed([*waiting.items()]):
        if job is not None and future.cancel():
            done[key] = _with_figures(case, key, job())
    ended = Ended({}, {}, {})
    for key, (future, _) in waiting.items():
        run, figures = done.get(key) or _with_figures(case, key, future.result())
        if isinstance(key, str):
            ended.runs[key] = run
        else:
            torque, label = key
            ended.drops[key] = run
            ended.torque_steps.setdefault(depth_name(torque), {})[label] = figures
    return ended


def _with_figures(case: Case, key: Any, run: TimedRun) -> tuple[TimedRun, dict[str, Any]]:
    """A run and, of a torque drop, its figures."""
    return run, {} if isinstance(key, str) else drop_figures(case, run)


def _has_drops(model: Model) -> bool:
    return bool(model.case.drive.steps.torques)


def _jobs(
    models: Mapping[str, Model], progress: Progress
) -> dict[Any, tuple[str, Callable[..., TimedRun]]]:
    """Files and runs, the longest first, so that no thread is idle for long at the end: steady
    running of every variant with the drive at its rated torque, whatever its history, then torque
    drops, those of the case as it is first."""
    jobs: dict[Any, tuple[str, Callable[..., TimedRun]]] = {}
    as_it_is = next(iter(models))
    for label, model in models.items():
        if label == as_it_is or not is_static(model):
            flexible = label == as_it_is and bool(model.case.flexible_stages)
            job = partial(
                simulate, model, drive=RATED_DRIVE, progress=progress, label=f"transient, {label}",
                energy=flexible and not _has_drops(model),
            )  # fmt: skip
            jobs[label] = (dataset_name("transient", model), job)
    for label, model in models.items():
        for torque in () if model.ideal else model.case.drive.steps.torques:
            job = partial(
                torque_drop, model, torque, energy=label == as_it_is, progress=progress,
                label=f"torque drop to {depth_name(torque)}, {label}",
            )  # fmt: skip
            jobs[torque, label] = (drop_name(torque, model), job)
    return jobs


def is_static(model: Model) -> bool:
    """Whether the train rolls in one equilibrium: linear, none turning, no errors, no histories."""
    system = model.system
    return (
        why_not_linear(system) is None
        and not model.has_errors
        and not np.any(system.pairs.load_angle >= 0)
        and not np.any(system.pairs.load_history >= 0)
    )


def dataset_name(what: str, model: Model) -> str:
    """File name of a dataset: "transient", "transient_rigid", "transient_without_errors"."""
    if model.ideal:
        return f"{what}_without_errors"
    return f"{what}_rigid" if model.variant == "rigid" else what


def drop_name(torque: float, model: Model) -> str:
    """File name of a torque drop."""
    return dataset_name(f"torque_step_{depth_name(torque)}", model)
