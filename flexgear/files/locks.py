"""Locks on files between processes.

The operating system releases a lock however its process ends, so none outlives its holder.
"""

import contextlib
import os
import re
import time
from collections.abc import Callable, Iterator
from pathlib import Path

try:
    import fcntl
except ImportError:  # Windows, where nothing is locked, and stale staging folders stay
    fcntl = None  # type: ignore[assignment]

LOCK_NAME = re.compile(r"\.[0-9a-f]{64}\.lock")  # of an entry of the cache
_LOOK_UP = 0.2  # s between two attempts at a lock


@contextlib.contextmanager
def one_at_a_time(product: Path, waiting: Callable[[float], object]) -> Iterator[None]:
    """Run the block while no other process or thread runs such a block for the same product, so
    that what several need at once is made once: look for it again in the block.

    waiting: called with 0 several times a second meanwhile, where it may raise, and with 1 after
    that. The block runs at once where there are no locks, or where ``.NAME.lock`` cannot be created
    beside the product.
    """
    file = product.with_name(f".{product.name}.lock")
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        lock = os.open(file, os.O_CREAT | os.O_RDWR, 0o600)
    except OSError:
        yield
        return
    try:
        if not acquire(lock):
            waiting(0.0)
            while not acquire(lock):
                time.sleep(_LOOK_UP)
                waiting(0.0)
            waiting(1.0)
        try:
            yield
        finally:
            with contextlib.suppress(OSError):
                file.unlink()  # processes that wait have the file open
            # releases the lock of forked processes, too, which have the file open
            if fcntl is not None:
                with contextlib.suppress(OSError):
                    fcntl.flock(lock, fcntl.LOCK_UN)
    finally:
        os.close(lock)


def acquire(file: int) -> bool:
    """Lock a file; False if another process holds the lock, True on file systems without locks."""
    if fcntl is None:
        return True
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        return True
    return True


def if_stale(file: Path, remove: Callable[[], object]) -> None:
    """Lock a file and call ``remove``. Nothing is done where another process holds the lock, the
    file does not exist, or the file system has no locks."""
    with contextlib.suppress(OSError):  # BlockingIOError from a lock that is held
        lock = os.open(file, os.O_RDWR)
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            remove()
        finally:
            os.close(lock)
