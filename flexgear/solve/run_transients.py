"""The transients of the whole job: in threads, while other analyses of the case go on.

Runs of different variants share nothing but constant data; the compiled time step and products of
matrices let go of the interpreter lock. The other analyses count as one of those that work at a
time: three threads on two cores take longer than two.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from flexgear.model.case import Case
from flexgear.model.errors import FlexgearError
from flexgear.results.sinks import DatasetSink
from flexgear.solve.bodies import Progress
from flexgear.solve.linear import why_not_linear
from flexgear.solve.long_run import TimedRun, shelved
from flexgear.solve.model import Model
from flexgear.solve.run_figures import depth_name, drop_figures
from flexgear.solve.transient import compile_transient, constant_drive, simulate, torque_drop

Runs = dict[str, TimedRun]
Drops = dict[tuple[float, str], TimedRun]


class Ended(NamedTuple):
    """Runs by variant; torque drops by torque and variant, and their figures by the name of the
    depth and variant."""

    runs: Runs
    drops: Drops
    torque_steps: dict[str, dict[str, Any]]


@contextmanager
def transients(
    models: Mapping[str, Model], progress: Progress, workers: int, place: Path | None
) -> Iterator[Callable[[], Ended]]:
    """Begin a transient of each variant in which anything moves, and the torque drops of those with
    errors, ``workers`` at a time, the caller being one until it waits; yields what waits for all.

    place: see ``shelved``. They end when the block fails, or they do.
    """
    stop = threading.Event()

    def watched(stage: str, share: float) -> None:
        if stop.is_set():
            raise FlexgearError("interrupted")
        progress(stage, share)

    jobs = _jobs(models, watched)
    first = next(iter(models.values()))
    at_work = threading.Semaphore(max(1, workers - 1))
    with ThreadPoolExecutor(max_workers=workers) as pool:
        try:
            compiled = pool.submit(compile_transient, first, energy=_has_drops(first))
            waiting = {
                key: pool.submit(_begun, compiled, at_work, place, name, job)
                for key, (name, job) in jobs.items()
            }
            yield partial(_done, first.case, waiting, at_work)
        except BaseException:
            stop.set()
            at_work.release()
            pool.shutdown(wait=True, cancel_futures=True)
            raise


def _done(
    case: Case, waiting: Mapping[Any, Future[TimedRun]], at_work: threading.Semaphore
) -> Ended:
    """Figures of a torque drop are taken while later runs still go on."""
    at_work.release()
    runs, drops, figures = Runs(), Drops(), dict[str, dict[str, Any]]()
    for key, future in waiting.items():
        if isinstance(key, str):
            runs[key] = future.result()
        else:
            torque, label = key
            drops[key] = future.result()
            figures.setdefault(depth_name(torque), {})[label] = drop_figures(case, drops[key])
    return Ended(runs, drops, figures)


Job = Callable[[DatasetSink | None], TimedRun]


def _begun(
    compiled: Future[None],
    at_work: threading.Semaphore,
    place: Path | None,
    name: str,
    job: Job,
) -> TimedRun:
    """A run, once the loops of all of them are compiled and one more may work."""
    compiled.result()
    with at_work:
        return shelved(place, name, job)


def _has_drops(model: Model) -> bool:
    return bool(model.case.drive.steps.torques)


def _jobs(models: Mapping[str, Model], progress: Progress) -> dict[Any, tuple[str, Job]]:
    """Files and runs, the longest first, so that no thread is idle for long at the end: steady
    running of every variant, then torque drops, those of the case as it is first."""
    jobs: dict[Any, tuple[str, Job]] = {}
    as_it_is = next(iter(models))
    for label, model in models.items():
        if label == as_it_is or not is_static(model):
            flexible = label == as_it_is and bool(model.case.flexible_stages)
            job = partial(
                _steady, model, progress=progress, label=f"transient, {label}",
                energy=flexible and not _has_drops(model),
            )  # fmt: skip
            jobs[label] = (dataset_name("transient", model), job)
    for label, model in models.items():
        for torque in () if model.ideal else model.case.drive.steps.torques:
            job = partial(
                _drop, model, torque, energy=label == as_it_is, progress=progress,
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


def _steady(model: Model, sink: DatasetSink | None, **options: Any) -> TimedRun:
    """Steady running: the drive at its rated torque, whatever its history."""
    return simulate(model, drive=constant_drive(), sink=sink, **options)


def _drop(model: Model, torque: float, sink: DatasetSink | None, **options: Any) -> TimedRun:
    return torque_drop(model, torque, sink=sink, **options)
