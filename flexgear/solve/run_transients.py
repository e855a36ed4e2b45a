"""Transients of a run, computed in threads during its other analyses.

Transients of different variants share constant data only; the compiled time step and matrix
products release the interpreter lock. The thread of the other analyses counts as one of the
workers: three threads on two cores would take longer than two.
"""

from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Future
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from flexgear.analysis.kernels.step import advance
from flexgear.compiled import awaits_compilation
from flexgear.coupling.pace import timed_drops
from flexgear.model.case import Case
from flexgear.results.quantities import values
from flexgear.results.sinks import between
from flexgear.results.time_figures import STAGE_DROP, StageDrop, drop_summary
from flexgear.solve.bodies import Progress, stoppable_pool, titled, when_done
from flexgear.solve.linear import why_not_linear
from flexgear.solve.long_run import TimedRun, shelved
from flexgear.solve.model import Model, assemble
from flexgear.solve.static import static
from flexgear.solve.transient import RATED_DRIVE, compile_transient, simulate, torque_drop


def depth_name(torque: float) -> str:
    """Name of a torque drop by its final torque, N·m: "0.4e6" for 4e5, "1200" for 1200."""
    return f"{torque / 1e6:g}e6" if abs(torque) >= 1e5 else f"{torque:g}"


def drop_figures(case: Case, timed: TimedRun) -> dict[str, Any]:
    """Figures of a transient with a torque drop, from the start of the drop."""
    start, duration, after = timed_drops(case).times
    data = between(timed.data, start)  # before it the train settles
    return {
        **drop_summary(data),
        "window_s": [start, start + duration + after],
        **{s: values(STAGE_DROP, StageDrop(data, s)) for s in case.fe_ring_stages},
    }


class Transients(NamedTuple):
    """Transients of a run: steady running by variant; torque drops by torque, N·m, and variant; and
    their figures by name of the final torque and variant."""

    runs: dict[str, TimedRun]
    drops: dict[tuple[float, str], TimedRun]
    torque_steps: dict[str, dict[str, Any]]


Job = Callable[[], TimedRun]


def loops_await_compilation() -> bool:
    """Whether the loops of transients still have to be compiled, into a cache that is writable."""
    return awaits_compilation(advance)


def compile_loops(case: Case) -> None:
    """Compile the loops of equilibria, modes and transients into the cache. Flexible bodies are
    made rigid, so that no FE mesh is needed; the loops are the same."""
    model = assemble(case, ["all"] if case.flexible_bodies else [])
    model.natural_modes(model.pace.band)
    static(model, np.zeros(1))
    compile_transient(model, energy=True)


@contextmanager
def transients(
    models: Mapping[str, Model], progress: Progress, workers: int, folder: Path | None
) -> Iterator[Callable[[], Transients]]:
    """Start the transients of all variants that are not static, and the torque drops of those with
    errors, in ``workers`` threads including that of the caller. Yields a function that waits for
    all of them and returns the results.

    folder: see ``shelved``. An exception in the context also stops the transients.
    """
    first = next(iter(models.values()))
    with stoppable_pool(max(1, workers - 1), progress) as (pool, report):
        drops = bool(first.case.drive.steps.torques)
        compiled = pool.submit(compile_transient, first, energy=drops)

        def start(name: str, job: Callable[..., TimedRun]) -> TimedRun:
            when_done(compiled).result()
            return shelved(folder, name, job)

        futures = {}
        for key, name, job in _jobs(models, report):
            begin = partial(start, name, job)
            futures[key] = pool.submit(begin), begin if workers > 1 else None
        yield partial(_finished, first.case, futures)


def _finished(case: Case, futures: Mapping[Any, tuple[Future[TimedRun], Job | None]]) -> Transients:
    """All transients. The calling thread does jobs that no thread has started, from the last to the
    first, where it has them; the other threads begin with the first."""
    done = {}
    for key, (future, job) in reversed([*futures.items()]):
        if job is not None and future.cancel():
            done[key] = _with_figures(case, key, job())
    finished = Transients({}, {}, {})
    for key, (future, _) in futures.items():
        run, figures = done.get(key) or _with_figures(case, key, when_done(future).result())
        if isinstance(key, str):
            finished.runs[key] = run
        else:
            torque, label = key
            finished.drops[key] = run
            finished.torque_steps.setdefault(depth_name(torque), {})[label] = figures
    return finished


def _with_figures(case: Case, key: Any, run: TimedRun) -> tuple[TimedRun, dict[str, Any]]:
    """A run and, for a torque drop, its figures."""
    return run, {} if isinstance(key, str) else drop_figures(case, run)


def _jobs(
    models: Mapping[str, Model], progress: Progress
) -> Iterator[tuple[Any, str, Callable[..., TimedRun]]]:
    """Key, file name and function of each transient: torque drops, then steady running of every
    variant at rated torque."""
    first = next(iter(models))
    for label, model in models.items():
        for torque in () if model.ideal else model.case.drive.steps.torques:
            title = f"torque drop to {depth_name(torque)}, {label}"
            job = partial(
                torque_drop, model, torque, energy=label == first, progress=titled(title, progress)
            )
            yield (torque, label), drop_name(torque, model), job
    for label, model in models.items():
        if label == first or not is_static(model):
            flexible = label == first and bool(model.case.flexible_stages)
            job = partial(
                simulate, model, drive=RATED_DRIVE,
                energy=flexible and not model.case.drive.steps.torques,
                progress=titled(f"transient, {label}", progress),
            )  # fmt: skip
            yield label, dataset_name("transient", model), job


def is_static(model: Model) -> bool:
    """Whether the forces of the train are constant in steady running: a linear train without
    errors, turning loads and load histories."""
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
