"""Independent jobs on an existing Dask cluster, by the address of its scheduler.

The object that all jobs of a study share is sent once. Jobs that a lost worker had begun are begun
again by other workers. Transport and credentials are those of the user's Dask: for an address
``tls://...`` its configuration names certificate, key and authority (``distributed.comm.tls``).
This process only connects to the scheduler and accepts no connections.
"""

from __future__ import annotations

import contextlib
import logging
import pickle
import re
from collections.abc import Callable, Generator, Iterator, Sequence
from typing import TYPE_CHECKING, Any, TypeVar

from flexgear.model.errors import FlexgearError, InputError
from flexgear.results.version import version
from flexgear.studies.early_workers import DIED, Outcome, on_one_thread, unpickled

if TYPE_CHECKING:
    from distributed import Client

S = TypeVar("S")
J = TypeVar("J")
R = TypeVar("R")

CONNECT_TIMEOUT = 10.0  # s
WORKER_TIMEOUT = 60.0  # s in which the scheduler must have a worker


def completed(
    function: Callable[[S, J], R], shared: S, jobs: Sequence[J], scheduler: str
) -> Generator[tuple[int, Outcome[R]], None, None]:
    """Number and outcome of function(shared, job) for every job, in the order of completion.

    scheduler: address of a Dask scheduler whose workers have the same version of flexgear.
    Arguments and results must be picklable, of modules that workers can import. InputError where
    the scheduler does not answer, FlexgearError where it has no worker. An exception, or closing
    the iterator, cancels jobs that have not begun.
    """
    from distributed import as_completed

    with _client(scheduler) as client:
        # a task, which Dask repeats if its worker is lost; scattered data would be lost with it
        common = client.submit(bytes, pickle.dumps((function, shared)), pure=False)
        futures = {
            client.submit(_run, common, pickle.dumps(job), version(), pure=False): k
            for k, job in enumerate(jobs)
        }
        for future in as_completed(list(futures), loop=client.loop):
            yield futures[future], _outcome(future)
            future.release()


def reach(scheduler: str) -> None:
    """InputError or FlexgearError if a cluster cannot be used; called before the preparation of a
    study."""
    with _client(scheduler):
        pass


@contextlib.contextmanager
def _client(address: str) -> Iterator[Client]:
    """A client connected to a scheduler that has workers."""
    from distributed import Client

    if not re.search(r":\d+$", address):
        raise InputError("--scheduler", address, "names no port", "e.g. tcp://host:8786")
    _require_certificates(address)
    with _silent():
        try:
            # not the default client, which xarray would use for locks even if it never connected
            client = Client(address, timeout=CONNECT_TIMEOUT, set_as_default=False)
        except (OSError, TimeoutError, ValueError, TypeError, AssertionError) as error:
            # AssertionError: a busy machine did not start the event loop of Dask in time
            problem = f"no Dask scheduler answers there ({_error_text(error)})"
            remedy = "start one and its workers as docs/howto/cluster.md says"
            raise InputError("--scheduler", address, problem, remedy) from None
        with client:
            try:
                client.wait_for_workers(1, timeout=WORKER_TIMEOUT)
            except TimeoutError:
                raise FlexgearError(
                    f"the scheduler at {address} has no workers; start some as "
                    "docs/howto/cluster.md says"
                ) from None
            yield client


def _require_certificates(address: str) -> None:
    """InputError where Dask's configuration has no certificates for a tls:// address."""
    from distributed.security import Security

    if not address.startswith("tls://"):
        return
    try:
        context = Security().get_connection_args("client").get("ssl_context")
        why = "names no certificates"
    except (OSError, ValueError, TypeError) as error:  # ssl's errors are OSErrors
        context, why = None, f"names certificates that cannot be read ({_error_text(error)})"
    if context is None:
        raise InputError(
            "--scheduler", address, f"Dask's configuration {why}",
            "set distributed.comm.tls.ca-file, .client.cert and .client.key, see "
            "docs/howto/cluster.md",
        )  # fmt: skip


@contextlib.contextmanager
def _silent() -> Iterator[None]:
    """Context without log lines of Dask, whose failures are in the outcomes."""
    names = [n for n in logging.root.manager.loggerDict if n.split(".")[0] == "distributed"]
    levels = {name: logging.getLogger(name).level for name in names}
    for name in names:
        logging.getLogger(name).setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        for name, level in levels.items():
            logging.getLogger(name).setLevel(level)


def _outcome(future: Any) -> Outcome[Any]:
    """Outcome of a job; of a failed one with the reason."""
    from distributed import CancelledError, KilledWorker

    try:
        outcome: Outcome[Any] = pickle.loads(future.result())
        return outcome
    except KilledWorker:
        return Outcome(None, DIED)
    except CancelledError:
        return Outcome(None, "the scheduler was lost")
    except Exception as error:  # in sending the job or its result
        return Outcome(None, f"Dask could not run it ({_error_text(error)})")


def _error_text(error: Exception) -> str:
    return f"{type(error).__name__}: {' '.join(str(error).split())}"


# --- on a worker ---------------------------------------------------------------------------------


def _run(common: bytes, job: bytes, expected: str) -> bytes:
    """Run one job on a worker."""
    if version() != expected:
        message = f"the worker has flexgear {version()}, not {expected}: install that"
        return pickle.dumps(Outcome(None, message))
    function, shared = unpickled(common)
    return pickle.dumps(on_one_thread(function, shared, pickle.loads(job)))
