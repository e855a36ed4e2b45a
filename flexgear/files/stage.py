"""A private folder beside an output in which it is made ready, and those that dead processes left.

A stage is locked as long as its process lives: the system takes the lock away however the process
ends, so a stage that can be locked is stale. One without a lock file is just being made, or holds
finished work that could not be moved; it is left alone.
"""

from __future__ import annotations

import contextlib
import os
import re
import secrets
import shutil
from collections.abc import Iterator
from pathlib import Path

try:
    import fcntl
except ImportError:  # Windows: stages that were left there stay
    fcntl = None  # type: ignore[assignment]

SUFFIX = ".partial"
_LOCK = "lock"
_STAGE = re.compile(rf"\..*\.[0-9a-f]{{8}}\{SUFFIX}")
_NAME_SHOWN = 32  # characters of an output's name in that of its stage: together below 255 bytes
_ATTEMPTS = 100  # to make a stage while others tidy up


@contextlib.contextmanager
def private_folder(place: Path, name: str) -> Iterator[Path]:
    """Yield a new folder ``.NAME.xxxxxxxx.partial`` in ``place``, which goes with the block.

    OSError where ``place`` refuses a folder or a file in it.
    """
    folder, lock = _locked(place, name)
    try:
        yield folder
    finally:
        if (folder / _LOCK).exists():  # else what is in it is kept
            shutil.rmtree(folder, ignore_errors=True)
        os.close(lock)


def keep(folder: Path) -> None:
    """Leave a private folder with what is in it, for good."""
    (folder / _LOCK).unlink(missing_ok=True)


def remove_stale(place: Path) -> None:
    """Remove the private folders in ``place`` whose processes are no more."""
    if fcntl is None:
        return
    with contextlib.suppress(OSError):
        for entry in list(os.scandir(place)):
            if _STAGE.fullmatch(entry.name) and entry.is_dir(follow_symlinks=False):
                _remove_if_stale(Path(entry.path))


def _locked(place: Path, name: str) -> tuple[Path, int]:
    """A new private folder and its lock; another process may take it for a stale one meanwhile."""
    for _ in range(_ATTEMPTS):
        folder = place / f".{name[:_NAME_SHOWN]}.{secrets.token_hex(4)}{SUFFIX}"
        folder.mkdir(mode=0o700)
        try:
            lock = os.open(folder / _LOCK, os.O_CREAT | os.O_EXCL | os.O_RDWR, 0o600)
        except FileNotFoundError:
            continue
        except OSError:
            shutil.rmtree(folder, ignore_errors=True)
            raise
        if _lock(lock) and (folder / _LOCK).exists():
            os.write(lock, f"{os.getpid()}\n".encode())
            return folder, lock
        os.close(lock)
    raise OSError(0, f"cannot make a folder in {place}")


def _lock(file: int) -> bool:
    """Whether the lock is ours; file systems without locks give it to anyone who makes a file."""
    if fcntl is None:
        return True
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        return True
    return True


def _remove_if_stale(folder: Path) -> None:
    try:
        lock = os.open(folder / _LOCK, os.O_RDWR)
    except FileNotFoundError:
        with contextlib.suppress(OSError):
            folder.rmdir()  # empty: its process died between two lines
        return
    except OSError:  # somebody else's
        return
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        shutil.rmtree(folder, ignore_errors=True)
    except OSError:  # its process lives, or nobody can tell
        pass
    finally:
        os.close(lock)
