"""Files and folders that appear whole or not at all, and results in a form that JSON can hold.

What is written is made ready in a private folder, the stage, on the target's own device and renamed
into place. What cannot be renamed in the end is not thrown away: it stays where it is, and the
message says where.

A stage is locked as long as its process lives: the system takes the lock away however the process
ends, so a stage that can be locked is stale. One without a lock file is just being made, or holds
finished work that could not be moved; it is left alone.
"""

from __future__ import annotations

import contextlib
import errno
import json
import os
import re
import secrets
import shutil
import signal
import stat
import threading
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from flexgear.files import STOPPING
from flexgear.model.errors import FlexgearError, InputError

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
    """Leave a private folder with its content permanently."""
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


PathLike = str | os.PathLike[str]
SEAL = "summary.json"  # says that a folder of results is whole: first to go, last to come


@contextlib.contextmanager
def atomic_file(path: PathLike) -> Iterator[Path]:
    """Yield a name with the suffix of ``path``; what is there moves to ``path`` in the end.

    Whatever goes wrong inside (full disk, Ctrl-C, a bug), an older file stays as it was and nothing
    else is left. Errors of the operating system become a one-line `FlexgearError`. A link is
    followed; InputError for a folder or a device.
    """
    target = file_target(path)
    try:
        with _made(target.parent), private_folder(target.parent, target.name) as stage:
            draft = stage / target.name
            yield draft
            _to_disk(draft)
            _finish(stage, draft, target, lambda: os.replace(draft, target))
    except OSError as error:
        raise FlexgearError(f"cannot write {target}: {reason(error)}") from error


def write_bytes(path: PathLike, data: bytes | memoryview) -> Path:
    """``data`` as a file, which is there whole or not at all."""
    with atomic_file(path) as draft, draft.open("wb") as file:
        file.write(data)
    return Path(path)


def write_json(path: PathLike, data: Mapping[str, Any]) -> Path:
    """``data`` as indented JSON; NaN and infinity are refused, JSON has no word for them."""
    text = json.dumps(data, indent=2, ensure_ascii=False, allow_nan=False)
    odd_names_too = "backslashreplace"  # of files, and as JSON writes them
    return write_bytes(path, (text + "\n").encode(errors=odd_names_too))


@contextlib.contextmanager
def staged_folder(
    path: PathLike, outdated: Callable[[Path], Iterable[Path]] = lambda folder: ()
) -> Iterator[Path]:
    """Yield an empty folder; what is in it moves to the folder ``path`` when the block ends.

    Files of the same name are replaced, and so are those that ``outdated`` names in ``path``; the
    rest stays. Whatever goes wrong inside (Ctrl-C, a full disk) or while files move, ``path`` stays
    as it was and nothing is left of the stage. A process that is killed while files move leaves
    ``path`` without the file ``SEAL``, so that two sets of results never pass for one. That the
    device takes files and renames them is tried first. A folder that exists is staged within
    itself: it may be the root of a mounted device.
    """
    target = folder_target(path)
    place = target if target.is_dir() else target.parent
    _tidy(target)
    with contextlib.ExitStack() as stack:
        try:
            stack.enter_context(_made(place))
            stage = stack.enter_context(private_folder(place, target.name))
            _try_rename(stage)
            files = stage / "files"
            files.mkdir()
        except OSError as error:
            raise FlexgearError(f"cannot write to {target}: {reason(error)}") from error
        yield files
        _finish(stage, files, target, lambda: _move(files, target, stage / "replaced", outdated))


def try_file(path: PathLike) -> None:
    """FlexgearError, or InputError, if the file ``path`` could not be written now."""
    target = file_target(path)
    _tidy(target)
    try:
        with _made(target.parent, for_good=False), private_folder(target.parent, target.name) as s:
            _try_rename(s)
    except OSError as error:
        raise FlexgearError(f"cannot write {target}: {reason(error)}") from error


def file_target(path: PathLike) -> Path:
    """The file that ``path`` means, links followed; InputError if it can be none."""
    mode = _mode(path)
    if mode is not None and not stat.S_ISREG(mode):
        what = "a folder" if stat.S_ISDIR(mode) else "a device or pipe"
        raise InputError("output", str(path), f"is {what}", "name a file")
    target = Path(os.path.realpath(path))
    if not str(path) or str(path).endswith(("/", os.sep)) or not target.name:
        raise InputError("output", str(path) or '""', "names no file", "name a file")
    return target


def folder_target(path: PathLike) -> Path:
    """The folder that ``path`` means, links followed; InputError if it can be none."""
    mode = _mode(path)
    if not str(path) or (mode is not None and not stat.S_ISDIR(mode)):
        what = "is a file" if str(path) else "names no folder"
        raise InputError("output", str(path) or '""', what, "name a folder")
    return Path(os.path.realpath(path))


def _mode(path: PathLike) -> int | None:
    """Kind of an existing file or folder; None without one."""
    try:
        return os.stat(path).st_mode
    except FileNotFoundError:
        return None
    except NotADirectoryError:
        problem = "cannot write it: cannot make the folder, a part of the path is a file"
        raise InputError("output", str(path), problem, "name another place") from None
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else str(error)
        raise InputError("output", str(path), str(reason), "name another place") from None


@contextlib.contextmanager
def _made(folder: Path, for_good: bool = True) -> Iterator[None]:
    """``folder`` and its parents exist in the block; those made here are removed if it fails.

    for_good: keep them after a block that succeeds; else they are removed in any case.
    """
    missing = [p for p in (folder, *folder.parents) if not p.exists()]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        yield
        if for_good:
            missing = []
    finally:
        with contextlib.suppress(OSError):  # finished work may lie there
            for folder_made in missing:
                folder_made.rmdir()


def _tidy(target: Path) -> None:
    """Remove what dead processes left in and beside ``target``."""
    remove_stale(target.parent)
    if target.is_dir():
        remove_stale(target)


def _try_rename(stage: Path) -> None:
    """OSError where a file of the stage cannot be renamed to a place beside the stage."""
    inside, beside = stage / "tried", stage.with_suffix(".tried")
    inside.write_bytes(b"flexgear\n")
    _to_disk(inside)
    try:
        os.replace(inside, beside)
    finally:
        beside.unlink(missing_ok=True)
        inside.unlink(missing_ok=True)


def _to_disk(path: Path) -> None:
    with open(path, "r+b") as file:
        os.fsync(file.fileno())


def _finish(stage: Path, work: Path, target: Path, move: Callable[[], None]) -> None:
    """Move finished work into place; where that fails it stays where it is, and the error names the
    place."""
    try:
        with _undisturbed():
            move()
    except OSError as error:
        keep(stage)
        raise FlexgearError(
            f"cannot write to {target}: {reason(error)}; the finished work is kept as {work}"
        ) from error


def _move(
    files: Path, target: Path, attic: Path, outdated: Callable[[Path], Iterable[Path]]
) -> None:
    """Move everything in ``files`` to ``target``, by one rename if that does not exist; replaced
    files go to ``attic`` first, and come back where a file cannot be moved."""
    if not target.exists():
        os.rename(files, target)
        return
    new = [f.relative_to(files) for f in files.rglob("*") if f.is_file()]
    old = {f.relative_to(target) for f in outdated(target)}
    old |= {name for name in new if (target / name).is_file()}
    steps = [(target / name, attic / name) for name in sorted(old, key=_sealed, reverse=True)]
    steps += [(files / name, target / name) for name in sorted(new, key=_sealed)]
    done: list[tuple[Path, Path]] = []
    try:
        for source, place in steps:
            place.parent.mkdir(parents=True, exist_ok=True)
            os.replace(source, place)
            done.append((source, place))
    except OSError:
        for source, place in reversed(done):
            with contextlib.suppress(OSError):  # what is left is in the stage, which stays
                os.replace(place, source)
        raise
    for folder in {target / name.parent for name in old} - {target}:
        with contextlib.suppress(OSError):  # not empty
            folder.rmdir()


def _sealed(name: Path) -> tuple[bool, str]:
    """Order in which files come: the seal last."""
    return name == Path(SEAL), str(name)


@contextlib.contextmanager
def _undisturbed() -> Iterator[None]:
    """Signals that stop a run are heard after the block, which takes no time."""
    heard: list[int] = []
    before = {}
    if threading.current_thread() is threading.main_thread():
        for number in (getattr(signal, n) for n in STOPPING if hasattr(signal, n)):
            if callable(signal.getsignal(number)):
                before[number] = signal.signal(number, lambda n, _: heard.append(n))
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
        for number in heard:
            signal.raise_signal(number)


def reason(error: OSError) -> str:
    """Message of the system, with the remedy where there is an obvious one."""
    text = error.strerror or str(error)
    full = error.errno in (errno.ENOSPC, getattr(errno, "EDQUOT", errno.ENOSPC))
    return f"{text}; free some space or choose another folder" if full else text


def plain(value: Any) -> Any:
    """Mappings, lists, text and Python numbers only, from numpy and xarray values."""
    if isinstance(value, Mapping):
        return {str(k): plain(v) for k, v in value.items()}
    if hasattr(value, "to_numpy"):
        value = value.to_numpy()
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, (list, tuple)):
        return [plain(v) for v in value]
    if value is None or isinstance(value, (str, bool, int, float)):
        return value
    raise FlexgearError(f"a summary cannot hold a {type(value).__name__}")
