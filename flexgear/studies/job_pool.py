"""Many independent runs: in this process where they are short, else on others or a cluster.

Processes of this machine are started and ended by loky, which talks to them through pipes: nothing
listens. Every worker is a pool of one, so that a lost worker blames the one run it had begun. That
run is begun again; a run that takes three workers with it is given up. Workers do not hear Ctrl-C,
which ends this process's work and thereby theirs; they also end when this process does, however it
does.

Finished parts of a study are kept on disk, so that an interrupted study goes on where it stopped: a
folder of the cache named by the content of the study holds one file a part, which is there whole or
not at all. It is removed when the study's results are safe.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import pickle
import shutil
import time
import warnings
from collections import Counter, deque
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from contextlib import closing
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, Generic, TypeVar

from loky.process_executor import BrokenProcessPool, ProcessPoolExecutor
from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

from flexgear.files.atomic import write_bytes
from flexgear.files.cache_folder import cache_directory
from flexgear.model.content import content_hash
from flexgear.model.errors import FlexgearError, FlexgearWarning
from flexgear.model.input_file import read_kept
from flexgear.results.version import version
from flexgear.structures.cache import sealed, unsealed
from flexgear.studies.early_workers import (
    DIED,
    Outcome,
    deaf_children,
    end_with,
    on_one_thread,
    outcome_of,
    processors,
    unpickled,
)

S = TypeVar("S")
J = TypeVar("J")
R = TypeVar("R")

LOST = 3  # workers that a run may lose
STARTING = 3.0  # s that workers have to save before it pays to start them


def run_jobs(
    function: Callable[[S, J], R],
    shared: S,
    jobs: Sequence[J],
    *,
    workers: int | None = None,
    scheduler: str | None = None,
) -> Generator[tuple[int, Outcome[R]], None, None]:
    """Number of every job and outcome of function(shared, job), as they are done.

    workers: processes of this machine (1: this one alone; None: as many as there are processors,
    but none beside this one while the last job shows that starting them takes longer);
    scheduler: address of a Dask cluster instead. Linear algebra runs on one thread everywhere, so
    that results do not depend on where. All three must be picklable, of modules that workers can
    import. Closing the iterator, or an exception in it such as Ctrl-C, stops all workers at once;
    take it in ``contextlib.closing``.
    """
    local_jobs = 0  # jobs done in this process
    if scheduler is None and jobs and workers in (None, 1):
        with threadpool_limits(limits=1):
            for local_jobs, job in enumerate(jobs, 1):
                began = time.perf_counter()
                outcome = outcome_of(function, shared, job)
                taken = time.perf_counter() - began
                yield local_jobs - 1, outcome
                # the first one loads what all need: the second one shows how long they take
                loading = local_jobs == 1 and taken < STARTING
                saved = taken * (len(jobs) - local_jobs) * (1 - 1 / processors())
                if workers is None and not loading and saved >= STARTING:
                    break
    if local_jobs == len(jobs):
        return
    if scheduler is not None:
        from flexgear.studies import dask_pool  # loaded where it is needed

        rest = dask_pool.completed(function, shared, jobs[local_jobs:], scheduler)
    else:
        rest = completed(function, shared, jobs[local_jobs:], workers or processors())
    with closing(rest):
        for k, outcome in rest:
            yield local_jobs + k, outcome


def completed(
    function: Callable[[S, J], R], shared: S, jobs: Sequence[J], workers: int
) -> Generator[tuple[int, Outcome[R]], None, None]:
    """Number and outcome of every job as it is done, function(shared, job) in some worker.

    workers: processes, at most. Everything must be picklable, of modules that workers can import.
    Closing the iterator, or an exception in it, ends all workers.
    """
    waiting, losses = deque(range(len(jobs))), Counter[int]()
    with _Workers(pickle.dumps((function, shared))) as pool:
        running: dict[Future[Outcome[Any]], tuple[ProcessPoolExecutor, int]] = {}
        idle = [pool.start() for _ in range(min(workers, len(jobs)))]
        while waiting or running:
            while waiting and idle:
                k = waiting.popleft()
                future, worker = pool.begin(idle.pop(), pickle.dumps(jobs[k]))
                running[future] = worker, k
            for future in wait(running, return_when=FIRST_COMPLETED).done:
                worker, k = running.pop(future)
                idle.append(worker)
                outcome = _outcome(future)
                losses[k] += outcome is None
                if outcome is None and losses[k] < LOST:
                    waiting.append(k)
                else:
                    yield k, outcome or Outcome(None, DIED)


def _outcome(future: Future[Outcome[Any]]) -> Outcome[Any] | None:
    """Outcome of a run, which may be its error; None if its worker process died."""
    try:
        return future.result()
    except BrokenProcessPool:
        return None
    except Exception as error:  # on the way there or back
        text = " ".join(str(error).split())
        return Outcome(None, f"its result could not be sent ({type(error).__name__}: {text})")


class _Workers:
    """Pools of one process each, which know what all runs share; they end with the block."""

    def __init__(self, common: bytes) -> None:
        self._common = common
        self._pools: list[ProcessPoolExecutor] = []
        self._theirs, self._ours = multiprocessing.Pipe(duplex=False)

    def __enter__(self) -> _Workers:
        # workers that have grown are replaced by loky between two runs; nothing to worry about
        warnings.filterwarnings("ignore", category=UserWarning, module="loky")
        return self

    def __exit__(self, *_: object) -> None:
        for pool in self._pools:
            pool.shutdown(kill_workers=True)
        self._ours.close()
        self._theirs.close()

    def start(self) -> ProcessPoolExecutor:
        """A worker; its process starts with its first run."""
        arguments = (self._common, self._theirs)
        self._pools.append(ProcessPoolExecutor(1, initializer=_prepare, initargs=arguments))
        return self._pools[-1]

    def begin(
        self, worker: ProcessPoolExecutor, job: bytes
    ) -> tuple[Future[Outcome[Any]], ProcessPoolExecutor]:
        """A run begun on a worker, or on another in its place where it was lost meanwhile."""
        with deaf_children():
            while True:
                try:
                    return worker.submit(_run, job), worker
                except BrokenProcessPool:
                    self._pools.remove(worker)
                    worker.shutdown()
                    worker = self.start()


# --- on a worker ---------------------------------------------------------------------------------

_common = b""  # function and what all runs share, a pickle


def _prepare(common: bytes, parent: Connection) -> None:
    """At a worker's start. parent: a pipe that has an end when the parent has."""
    global _common
    _common = common
    end_with(parent)


def _run(job: bytes) -> Outcome[Any]:
    function, shared = unpickled(_common)
    return on_one_thread(function, shared, pickle.loads(job))


T = TypeVar("T")


@dataclass(frozen=True)
class StudyStore(Generic[T]):
    """Parts of one study by the names of their files. pack, unpack: a part as bytes, and back."""

    folder: Path
    pack: Callable[[T], bytes]
    unpack: Callable[[bytes], T]

    def get(self, name: str) -> T | None:
        """A stored part; None where there is none, or it is damaged or cannot be read."""
        try:
            return self.unpack(unsealed(read_kept(self.folder / name)))
        except (OSError, ValueError):
            return None

    def put(self, name: str, part: T) -> None:
        """Keep a part. FlexgearWarning where the disk refuses: the study itself goes on."""
        try:
            write_bytes(self.folder / name, sealed(self.pack(part)))
        except FlexgearError as error:
            text = f"cannot keep what is done, so a stopped study would start anew: {error}"
            warnings.warn(text, FlexgearWarning, stacklevel=2)

    def clear(self) -> None:
        """Forget the study."""
        shutil.rmtree(self.folder, ignore_errors=True)
        with contextlib.suppress(OSError):  # others' studies are still there
            self.folder.parent.rmdir()


def stored_or_run(
    store: StudyStore[T],
    files: Sequence[str],
    function: Callable[[S, J], T],
    shared: S,
    jobs: Sequence[J],
    *,
    workers: int | None,
    scheduler: str | None,
    progress: Callable[[float], None],
) -> tuple[dict[int, T], dict[int, str]]:
    """Parts of a study by the numbers of their jobs, from the disk where they were finished before,
    else function(shared, job), which then is kept; messages of those that failed. progress: is told
    the share that is done; workers, scheduler: as of ``run_jobs``."""
    finished = {k: part for k, file in enumerate(files) if (part := store.get(file)) is not None}
    left, faults = [k for k in range(len(files)) if k not in finished], dict[int, str]()
    progress(len(finished) / max(len(files), 1))
    runs = run_jobs(function, shared, [jobs[k] for k in left], workers=workers, scheduler=scheduler)
    with closing(runs):
        for at, outcome in runs:
            if outcome.value is None:
                faults[left[at]] = outcome.message
                continue
            finished[left[at]] = outcome.value
            store.put(files[left[at]], outcome.value)
            progress(len(finished) / len(files))
    return finished, faults


def study_folder(kind: str, content: dict[str, Any]) -> Path:
    """Where parts of a study are kept; content: all that every one of them depends on."""
    return cache_directory() / kind / content_hash({"version": version(), **content})
