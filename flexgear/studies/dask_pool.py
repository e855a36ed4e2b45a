"""Many runs on Dask: workers of this machine, or those of a cluster by the scheduler's address.

Runs of one study share one object, which is sent out once. A worker that is lost costs the runs it
had begun, which others begin again; a run that takes three workers with it is given up.

Dask lives in a process of its own, which has its own session and no terminal. Ctrl-C therefore
reaches this process alone; it ends the other one and its workers at once, and no thread, log line
or traceback of theirs is left here. They also end when this process does, however it does. Orders
go there and outcomes come back as pickles that only this process and the workers open.
"""

from __future__ import annotations

import contextlib
import json
import os
import pickle
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Generator, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, BinaryIO, TypeVar

from flexgear.model.errors import FlexgearError, InputError
from flexgear.results.version import version
from flexgear.studies.outcome import ALL_DIED, DIED, Outcome, on_one_thread, processors

if TYPE_CHECKING:
    from distributed import Client

S = TypeVar("S")
J = TypeVar("J")
R = TypeVar("R")
Answer = tuple[str, int, Any]  # what it is, number of the job, its outcome or a text

ANSWER = 10.0  # s in which a scheduler has to answer
ARRIVAL = 60.0  # s in which it has to have a worker
ENDING = 5.0  # s that processes have for ending before they are killed
LOST = 3  # workers that a run may lose
SERVE = """
import json, sys
sys.path[:] = json.loads(sys.argv[1])
from flexgear.studies.dask_pool import serve
serve()
"""


@dataclass(frozen=True)
class Order:
    """What Dask's process is to do; common and jobs are pickles."""

    common: bytes
    jobs: tuple[bytes, ...]
    version: str
    workers: int
    scheduler: str | None
    scratch: str


def completed(
    function: Callable[[S, J], R],
    shared: S,
    jobs: Sequence[J],
    *,
    workers: int | None = None,
    scheduler: str | None = None,
) -> Generator[tuple[int, Outcome[R]], None, None]:
    """Number and outcome of every job as it is done, function(shared, job) in some process.

    workers: processes of this machine (None: as many as there are processors); scheduler: address
    of a Dask scheduler whose workers are taken instead, with the same version of flexgear.
    Everything must be picklable, of modules that workers can import. InputError where the
    scheduler does not answer, FlexgearError where it has no worker. Closing the iterator, or an
    exception in it, ends all processes.
    """
    if not jobs:
        return
    left = set(range(len(jobs)))
    with contextlib.closing(_answers((function, shared), jobs, workers, scheduler)) as answers:
        for kind, k, found in answers:
            yield k, pickle.loads(found) if kind == "outcome" else Outcome(None, found)
            left.discard(k)
    for k in sorted(left):
        yield k, Outcome(None, ALL_DIED)


def reach(scheduler: str) -> None:
    """InputError or FlexgearError where a cluster cannot be used, before long work for it."""
    for _ in _answers(None, (), None, scheduler):
        pass


def _answers(
    common: Any, jobs: Sequence[Any], workers: int | None, scheduler: str | None
) -> Generator[Answer, None, None]:
    """Answers about jobs, from a process that ends with the iterator."""
    with _scratch() as scratch, _process() as process:
        assert process.stdin is not None
        assert process.stdout is not None
        order = Order(
            common=pickle.dumps(common),
            jobs=tuple(pickle.dumps(job) for job in jobs),
            version=version(),
            workers=min(workers or processors(), len(jobs)),
            scheduler=scheduler,
            scratch=scratch,
        )
        try:
            pickle.dump(order, process.stdin)
            process.stdin.flush()  # and stays open: its end is the end of this process
            while True:
                kind, k, found = pickle.load(process.stdout)
                if kind == "done":
                    return
                if k < 0:
                    raise _refusal(kind, found, scheduler)
                yield kind, k, found
        except (EOFError, BrokenPipeError, pickle.UnpicklingError):  # it died
            return


def _refusal(kind: str, text: str, scheduler: str | None) -> FlexgearError:
    """Why there are no workers."""
    if kind == "absent":
        return InputError(
            "--scheduler", f"{scheduler}", "no Dask scheduler answers there",
            "start one with `dask scheduler`, and workers with `dask worker ADDRESS`",
        )  # fmt: skip
    if kind == "idle":
        return FlexgearError(
            f"the scheduler at {scheduler} has no workers; start `dask worker {scheduler}`"
        )
    return FlexgearError(f"Dask could not start ({text})")


@contextlib.contextmanager
def _scratch() -> Iterator[str]:
    """A folder for Dask's own files."""
    folder = tempfile.mkdtemp(prefix="flexgear-")
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


@contextlib.contextmanager
def _process() -> Iterator[subprocess.Popen[bytes]]:
    """Dask's process, in a session of its own; it and its workers end with the block."""
    process = subprocess.Popen(
        [sys.executable, "-P", "-c", SERVE, json.dumps(sys.path)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    try:
        yield process
    finally:
        with _deaf():
            _end(process)


def _end(process: subprocess.Popen[bytes]) -> None:
    """End a process and its workers. SIGTERM spares Python's resource tracker, which removes what
    they leave; SIGKILL where that is not enough."""
    _signal(process, "SIGTERM")
    try:
        process.wait(ENDING)
    except subprocess.TimeoutExpired:
        _signal(process, "SIGKILL")
        process.wait()
    for pipe in (process.stdin, process.stdout):
        with contextlib.suppress(OSError):  # what was not sent does not matter any more
            if pipe is not None:
                pipe.close()


def _signal(process: subprocess.Popen[bytes], name: str) -> None:
    """To the whole session; not after ``wait``, when its number may be another's."""
    if not hasattr(os, "killpg"):  # Windows: workers end when they miss their parent
        process.terminate()
        return
    with contextlib.suppress(ProcessLookupError, PermissionError):  # all of it has ended
        os.killpg(process.pid, getattr(signal, name))


@contextlib.contextmanager
def _deaf() -> Iterator[None]:
    """A second Ctrl-C does not stop the cleaning up after the first."""
    if threading.current_thread() is not threading.main_thread():  # signals go to the main thread
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before or signal.SIG_DFL)


# --- in Dask's process ---------------------------------------------------------------------------


def serve() -> None:
    """Do the order that comes by stdin and answer on stdout."""
    orders, answers = (os.fdopen(os.dup(fd), mode) for fd, mode in ((0, "rb"), (1, "wb")))
    with open(os.devnull, "r+b") as nowhere:  # for workers, and for what anybody prints
        os.dup2(nowhere.fileno(), 0)
        os.dup2(nowhere.fileno(), 1)
    order: Order = pickle.load(orders)
    watch = threading.Thread(target=_end_with_parent, args=(orders, order.scratch), daemon=True)
    watch.start()
    for answer in _served(order):
        pickle.dump(answer, answers)
        answers.flush()
    watch.join()


def _end_with_parent(orders: BinaryIO, scratch: str) -> None:
    """When the other end of the pipe is closed, whatever became of the process there."""
    with contextlib.suppress(OSError):
        os.read(orders.fileno(), 1)
    shutil.rmtree(scratch, ignore_errors=True)
    if hasattr(os, "killpg") and os.getpgrp() == os.getpid():
        os.killpg(os.getpid(), signal.SIGTERM)
    os._exit(1)


def _served(order: Order) -> Iterator[Answer]:
    """Answers to an order as they come."""
    from distributed import as_completed

    try:
        client = _remote(order.scheduler) if order.scheduler else _local(order)
    except _Refused as refused:
        yield str(refused), -1, ""
        return
    except Exception as error:
        yield "fault", -1, f"{type(error).__name__}: {' '.join(str(error).split())}"
        return
    # a task of its own, which can be done again, where data that was sent can be lost
    common = client.submit(_same, order.common, pure=False)
    futures = {
        client.submit(_run, common, job, order.version, pure=False): k
        for k, job in enumerate(order.jobs)
    }
    for future in as_completed(list(futures)):
        kind, found = _found(future)
        yield kind, futures[future], found
        future.release()
    yield "done", -1, ""


class _Refused(Exception):
    """A cluster that cannot be used; its text is the kind of answer."""


def _local(order: Order) -> Client:
    """Workers of this machine."""
    import dask
    from distributed import Client, LocalCluster

    dask.config.set(
        {
            "distributed.scheduler.allowed-failures": LOST - 1,
            "distributed.scheduler.worker-saturation": 1.0,  # a lost worker blames one run only
        }
    )
    cluster = LocalCluster(
        n_workers=order.workers, threads_per_worker=1, processes=True, dashboard_address=None,
        memory_limit=0, local_directory=order.scratch,
    )  # fmt: skip
    return Client(cluster)


def _remote(address: str) -> Client:
    """A cluster of others."""
    from distributed import Client

    try:
        client = Client(address, timeout=ANSWER)
    except (OSError, TimeoutError, ValueError) as error:
        raise _Refused("absent") from error
    try:
        client.wait_for_workers(1, timeout=ARRIVAL)
    except TimeoutError as error:
        raise _Refused("idle") from error
    return client


def _found(future: Any) -> tuple[str, Any]:
    """What became of a job, whatever became of its workers."""
    from distributed import CancelledError, KilledWorker

    try:
        return "outcome", future.result()
    except KilledWorker:
        return "lost", DIED
    except CancelledError:
        return "lost", "the scheduler was lost"
    except Exception as error:  # on the way there or back
        text = " ".join(str(error).split())
        return "lost", f"Dask could not run it ({type(error).__name__}: {text})"


# --- on a worker ---------------------------------------------------------------------------------


def _same(common: bytes) -> bytes:
    return common


def _run(common: bytes, job: bytes, wanted: str) -> bytes:
    """One job on a worker."""
    if version() != wanted:
        said = f"the worker has flexgear {version()}, not {wanted}: install that"
        return pickle.dumps(Outcome(None, said))
    function, shared = pickle.loads(common)
    return pickle.dumps(on_one_thread(function, shared, pickle.loads(job)))
