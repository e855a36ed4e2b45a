"""Many runs on Dask: workers of this machine, or those of a cluster by the scheduler's address.

Runs of one study share one object, which is sent out once. A worker that is lost costs the runs it
had begun, which others begin again; a run that takes three workers with it is given up. Workers run
their linear algebra on one thread, so that results do not depend on how many there are.
"""

from __future__ import annotations

import logging
import signal
import tempfile
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from multiprocessing import resource_tracker
from typing import TYPE_CHECKING, Any, TypeVar

from flexgear.model.errors import FlexgearError, InputError
from flexgear.results.version import version
from flexgear.studies.job_pool import DIED, Done, Outcome, _on_one_thread, processors

if TYPE_CHECKING:
    from distributed import Client

S = TypeVar("S")
J = TypeVar("J")
R = TypeVar("R")

STARTING = 8.0  # s of work left below which starting workers does not pay
ANSWER = 10.0  # s in which a scheduler has to answer
ARRIVAL = 60.0  # s in which it has to have a worker
LOST = 3  # workers that a run may lose


def completed(
    function: Callable[[S, J], R],
    shared: S,
    jobs: Sequence[J],
    *,
    workers: int | None = None,
    scheduler: str | None = None,
) -> Iterator[tuple[int, Outcome[R]]]:
    """Number and outcome of every job as it is done, function(shared, job) in some process.

    workers: processes of this machine (None: as many as there are processors); scheduler: address
    of a Dask scheduler whose workers are taken instead, with the same version of flexgear.
    Everything must be picklable. InputError where the scheduler does not answer, FlexgearError
    where it has no worker.
    """
    from distributed import as_completed

    if not jobs:
        return
    count = min(workers or processors(), len(jobs))
    with _client(count, scheduler) as client:
        # a task of its own, which can be done again, where data that was sent can be lost
        common = client.submit(_same, shared, pure=False)
        futures = {
            client.submit(_run, function, common, job, version(), pure=False): k
            for k, job in enumerate(jobs)
        }
        for future in as_completed(list(futures)):
            yield futures[future], _outcome_of(future)
            future.release()


def run_on(
    scheduler: str, function: Callable[[J], R], jobs: Sequence[J], done: Done = lambda count: None
) -> list[Outcome[R]]:
    """function(job) of every job on the workers of a cluster, in the order of the jobs.

    As ``job_pool.run_jobs``; done is called with the number of jobs that are done.
    """
    found = {}
    for k, outcome in completed(_call, function, jobs, scheduler=scheduler):
        found[k] = outcome
        done(len(found))
    return [found[k] for k in range(len(jobs))]


def reach(scheduler: str) -> None:
    """InputError or FlexgearError where a cluster cannot be used, before long work for it."""
    with _quiet(), _remote(scheduler):
        pass


def _call(function: Callable[[J], R], job: J) -> R:
    return function(job)


def _run(function: Callable[[S, J], R], shared: S, job: J, wanted: str) -> Outcome[R]:
    """One job on a worker."""
    if version() != wanted:
        return Outcome(None, f"the worker has flexgear {version()}, not {wanted}: install that")
    return _on_one_thread(_Shared(function, shared), job)


class _Shared:
    """The function of a job alone."""

    def __init__(self, function: Callable[[Any, Any], Any], shared: Any) -> None:
        self.function, self.shared = function, shared

    def __call__(self, job: Any) -> Any:
        return self.function(self.shared, job)


def _same(shared: S) -> S:
    return shared


def _outcome_of(future: Any) -> Outcome[Any]:
    """The outcome of a job, whatever became of its workers."""
    from distributed import CancelledError, KilledWorker

    try:
        found: Outcome[Any] = future.result()
        return found
    except KilledWorker:
        return Outcome(None, DIED)
    except CancelledError:
        return Outcome(None, "the scheduler was lost")
    except Exception as error:  # on the way there or back
        text = " ".join(str(error).split())
        return Outcome(None, f"Dask could not run it ({type(error).__name__}: {text})")


@contextmanager
def _client(workers: int, scheduler: str | None) -> Iterator[Client]:
    """A client of the cluster at an address, or of one of our own, which ends with the block."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # large tasks, busy ports: nothing a user can act on
        with _quiet(), _remote(scheduler) if scheduler else _local(workers) as client:
            yield client


@contextmanager
def _local(workers: int) -> Iterator[Client]:
    import dask
    from distributed import Client, LocalCluster

    options = {
        "distributed.scheduler.allowed-failures": LOST - 1,
        "distributed.scheduler.worker-saturation": 1.0,  # a lost worker then blames one run only
    }
    with ExitStack() as open_ones:
        scratch = open_ones.enter_context(
            tempfile.TemporaryDirectory(prefix="flexgear-", ignore_cleanup_errors=True)
        )
        open_ones.enter_context(dask.config.set(options))
        with _no_ctrl_c():
            cluster = LocalCluster(
                n_workers=workers, threads_per_worker=1, processes=True, dashboard_address=None,
                memory_limit=0, silence_logs=logging.CRITICAL, local_directory=scratch,
            )  # fmt: skip
            open_ones.enter_context(cluster)
        yield open_ones.enter_context(Client(cluster))


@contextmanager
def _no_ctrl_c() -> Iterator[None]:
    """Threads and processes that begin in the block, and theirs, never see Ctrl-C.

    A terminal sends it to all; only this process is to act on it, and it ends the others.
    """
    if not hasattr(signal, "pthread_sigmask"):  # Windows
        yield
        return
    resource_tracker.ensure_running()  # by starting in the block it would end it
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextmanager
def _remote(address: str) -> Iterator[Client]:
    from distributed import Client

    try:
        client = Client(address, timeout=ANSWER)
    except (OSError, TimeoutError, ValueError) as error:
        raise InputError(
            "--scheduler", address, "no Dask scheduler answers there",
            "start one with `dask scheduler`, and workers with `dask worker ADDRESS`",
        ) from error  # fmt: skip
    with client:
        try:
            client.wait_for_workers(1, timeout=ARRIVAL)
        except TimeoutError as error:
            raise FlexgearError(
                f"the scheduler at {address} has no workers; start `dask worker {address}`"
            ) from error
        yield client


@contextmanager
def _quiet() -> Iterator[None]:
    """No log of Dask's on the terminal: what matters comes back as outcomes."""
    logger = logging.getLogger("distributed")
    level = logger.level
    logger.setLevel(logging.CRITICAL)
    try:
        yield
    finally:
        logger.setLevel(level)
