"""Independent jobs: in this process if they are short, else in other processes or on a cluster.

Processes of this machine are started and ended by loky, which communicates through pipes, so that
no port is open. Every worker is a pool of one process: when a process dies, the job that it had
begun is known and is begun again, at most three times. Workers ignore Ctrl-C, which ends the work
of this process, and end when this process ends for any reason.

Finished parts of a study are stored, so that an interrupted study continues with the next part. A
folder of the cache, named by the content of the study, holds a pickle of each part, written as a
whole. It is removed after the results of the study are written.
"""

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
from typing import Any, Generic, Self, TypeVar

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
    block_interrupts_in_children,
    end_with_parent,
    on_one_thread,
    outcome_of,
    processors,
    unpickled,
)

S = TypeVar("S")
J = TypeVar("J")
R = TypeVar("R")

MAX_LOSSES = 3  # workers that die with a job before it fails
STARTING = 3.0  # s that workers must save, as their start takes so long


def run_jobs(
    function: Callable[[S, J], R],
    shared: S,
    jobs: Sequence[J],
    *,
    workers: int | None = None,
    scheduler: str | None = None,
) -> Generator[tuple[int, Outcome[R]], None, None]:
    """Number and outcome of function(shared, job) for every job, in the order of completion.

    workers: number of processes of this machine (1: only this process; None: this process until
    the duration of a job shows that others would save time, then one for each processor);
    scheduler: address of a Dask cluster instead. Linear algebra runs on one thread everywhere, so
    that results do not depend on the process. Arguments and results must be picklable, of modules
    that workers can import. An exception such as Ctrl-C, or closing the iterator, stops all workers
    at once, so use it in ``contextlib.closing``.
    """
    local_jobs = 0  # done in this process
    if scheduler is None and jobs and workers in (None, 1):
        with threadpool_limits(limits=1):
            for local_jobs, job in enumerate(jobs, 1):
                began = time.perf_counter()
                outcome = outcome_of(function, shared, job)
                taken = time.perf_counter() - began
                yield local_jobs - 1, outcome
                # the first job also loads modules and data, so the second shows the duration
                loading = local_jobs == 1 and taken < STARTING
                saved = taken * (len(jobs) - local_jobs) * (1 - 1 / processors())
                if workers is None and not loading and saved >= STARTING:
                    break
    if local_jobs == len(jobs):
        return
    if scheduler is not None:
        from flexgear.studies import dask_pool

        rest = dask_pool.completed(function, shared, jobs[local_jobs:], scheduler)
    else:
        rest = completed(function, shared, jobs[local_jobs:], workers or processors())
    with closing(rest):
        for k, outcome in rest:
            yield local_jobs + k, outcome


def completed(
    function: Callable[[S, J], R], shared: S, jobs: Sequence[J], workers: int
) -> Generator[tuple[int, Outcome[R]], None, None]:
    """Number and outcome of function(shared, job) for every job, in the order of completion.

    workers: largest number of processes of this machine. Arguments and results must be picklable,
    of modules that workers can import. An exception, or closing the iterator, ends all workers.
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
                if outcome is None and losses[k] < MAX_LOSSES:
                    waiting.append(k)
                else:
                    yield k, outcome or Outcome(None, DIED)


def _outcome(future: Future[Outcome[Any]]) -> Outcome[Any] | None:
    """Outcome of a job; None if its worker died."""
    try:
        return future.result()
    except BrokenProcessPool:
        return None
    except Exception as error:  # in sending the job or its result
        text = " ".join(str(error).split())
        return Outcome(None, f"its result could not be sent ({type(error).__name__}: {text})")


class _Workers:
    """Context of pools of one process each, which end with the block. common: pickled function and
    shared object of all jobs."""

    def __init__(self, common: bytes) -> None:
        self._common = common
        self._pools: list[ProcessPoolExecutor] = []
        self._child_end, self._parent_end = multiprocessing.Pipe(duplex=False)

    def __enter__(self) -> Self:
        # loky warns when it replaces a worker whose memory has grown, which costs no job
        warnings.filterwarnings("ignore", category=UserWarning, module="loky")
        return self

    def __exit__(self, *_: object) -> None:
        for pool in self._pools:
            pool.shutdown(kill_workers=True)
        self._parent_end.close()
        self._child_end.close()

    def start(self) -> ProcessPoolExecutor:
        """A new worker, whose process starts with its first job."""
        arguments = (self._common, self._child_end)
        self._pools.append(ProcessPoolExecutor(1, initializer=_start_worker, initargs=arguments))
        return self._pools[-1]

    def begin(
        self, worker: ProcessPoolExecutor, job: bytes
    ) -> tuple[Future[Outcome[Any]], ProcessPoolExecutor]:
        """Submit a pickled job to a worker, or to a new one if it has died; future and worker."""
        with block_interrupts_in_children():
            while True:
                try:
                    return worker.submit(_run, job), worker
                except BrokenProcessPool:
                    self._pools.remove(worker)
                    worker.shutdown()
                    worker = self.start()


# --- on a worker ---------------------------------------------------------------------------------

_common = b""  # pickled function and shared object of all jobs


def _start_worker(common: bytes, child_end: Connection) -> None:
    """Set a new worker up; child_end: of the pipe that closes when the parent ends."""
    global _common
    _common = common
    end_with_parent(child_end)


def _run(job: bytes) -> Outcome[Any]:
    """Outcome of a pickled job."""
    function, shared = unpickled(_common)
    return on_one_thread(function, shared, pickle.loads(job))


T = TypeVar("T")


@dataclass(frozen=True)
class StudyStore(Generic[T]):
    """Stored parts of one study by file name."""

    folder: Path

    @classmethod
    def of(cls, kind: str, **content: Any) -> Self:
        """Store of a study of a kind (``structures.cache``); content: all inputs that its parts
        share."""
        return cls(cache_directory() / kind / content_hash({"version": version(), **content}))

    def get(self, name: str) -> T | None:
        """The stored part; None if it is missing, damaged, or not readable by these libraries."""
        try:
            part: T = pickle.loads(unsealed(read_kept(self.folder / name)))
        except Exception:  # unpickling raises any
            return None
        return part

    def put(self, name: str, part: T) -> None:
        """Store a part; FlexgearWarning if it cannot be written, as the study can continue."""
        try:
            write_bytes(self.folder / name, sealed(pickle.dumps(part)))
        except FlexgearError as error:
            text = f"cannot store finished parts, so a stopped study would start anew: {error}"
            warnings.warn(text, FlexgearWarning, stacklevel=2)

    def clear(self) -> None:
        """Remove all stored parts."""
        shutil.rmtree(self.folder, ignore_errors=True)
        with contextlib.suppress(OSError):  # not empty: it has other studies of this kind
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
    """Parts of a study by number of their job, stored ones or else function(shared, job), which is
    then stored; and messages of failed jobs by number.

    progress: called with the finished share, 0 … 1; workers, scheduler: as of ``run_jobs``.
    """
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
