"""Writing of files and folders so that each appears complete or not at all; values for JSON.

Files are first written to a private staging folder on the same device as the target and then
renamed into place. If the renaming fails, the staging folder is kept and the error names it.

A staging folder contains a lock file that its process holds. The operating system releases the lock
however the process ends, so a folder whose lock can be acquired is stale and may be removed. A
folder without a lock file is being created, or holds finished work that could not be moved; it is
left alone.
"""

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
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from flexgear.files import STOP_SIGNALS
from flexgear.files.locks import LOCK_NAME, acquire, fcntl, if_stale
from flexgear.model.errors import FlexgearError, InputError

SUFFIX = ".partial"
_LOCK = "lock"
_FOLDER_NAME = re.compile(rf"\..*\.[0-9a-f]{{8}}\{SUFFIX}")
_NAME_LENGTH = 32  # characters of the output's name used, so that folder names stay below 255 bytes
_ATTEMPTS = 100  # at creating a staging folder that another process may remove as stale


@contextlib.contextmanager
def private_folder(place: Path, name: str) -> Iterator[Path]:
    """Yield a new locked folder ``.NAME.xxxxxxxx.partial`` in ``place``; remove it after the block.

    The folder is kept if its lock file was removed inside the block. Raises OSError if a folder or
    a file in it cannot be created in ``place``.
    """
    folder, lock = _new_locked_folder(place, name)
    try:
        yield folder
    finally:
        if (folder / _LOCK).exists():
            shutil.rmtree(folder, ignore_errors=True)
        os.close(lock)


def remove_stale(place: Path) -> None:
    """Remove the private folders and locks in ``place`` whose processes have ended."""
    if fcntl is None:
        return
    with contextlib.suppress(OSError):
        for entry in list(os.scandir(place)):
            path = Path(entry.path)
            if _FOLDER_NAME.fullmatch(entry.name) and entry.is_dir(follow_symlinks=False):
                with contextlib.suppress(OSError):
                    path.rmdir()  # empty if the process died before it created the lock file
                if_stale(path / _LOCK, partial(shutil.rmtree, path, ignore_errors=True))
            elif LOCK_NAME.fullmatch(entry.name) and entry.is_file(follow_symlinks=False):
                if_stale(path, path.unlink)


def _new_locked_folder(place: Path, name: str) -> tuple[Path, int]:
    """A new private folder and the descriptor of its lock file. Creation is repeated if another
    process removes the folder as stale before it is locked."""
    for _ in range(_ATTEMPTS):
        folder = place / f".{name[:_NAME_LENGTH]}.{secrets.token_hex(4)}{SUFFIX}"
        folder.mkdir(mode=0o700)
        try:
            lock = os.open(folder / _LOCK, os.O_CREAT | os.O_EXCL | os.O_RDWR, 0o600)
        except FileNotFoundError:
            continue
        except OSError:
            shutil.rmtree(folder, ignore_errors=True)
            raise
        if acquire(lock) and (folder / _LOCK).exists():
            os.write(lock, f"{os.getpid()}\n".encode())
            return folder, lock
        os.close(lock)
    raise OSError(0, f"cannot make a folder in {place}")


PathLike = str | os.PathLike[str]
COMPLETION_MARK = "summary.json"  # removed first and written last: shows that results are complete


@contextlib.contextmanager
def atomic_file(path: PathLike) -> Iterator[Path]:
    """Yield the path of a temporary file, which is renamed to ``path`` when the block ends.

    The temporary file has the suffix of ``path``. If the block fails (full disk, Ctrl-C, a bug), an
    older file at ``path`` remains unchanged and no other file remains. Links are followed. Raises
    FlexgearError for errors of the operating system, InputError if ``path`` is a folder or device.
    """
    target = file_target(path)
    try:
        with _existing(target.parent), private_folder(target.parent, target.name) as stage:
            draft = stage / target.name
            yield draft
            _flush_to_disk(draft)
            _move_into_place(stage, draft, target, lambda: os.replace(draft, target))
    except OSError as error:
        raise FlexgearError(f"cannot write {target}: {reason(error)}") from error


def write_bytes(path: PathLike, data: bytes | memoryview) -> Path:
    """Write ``data`` to a file atomically; returns its path."""
    with atomic_file(path) as draft, draft.open("wb") as file:
        file.write(data)
    return Path(path)


def write_json(path: PathLike, data: Mapping[str, Any]) -> Path:
    """Write ``data`` as indented JSON; ValueError for NaN and infinity, which JSON cannot hold."""
    text = json.dumps(data, indent=2, ensure_ascii=False, allow_nan=False)
    # names of files may hold bytes that are no UTF-8
    return write_bytes(path, (text + "\n").encode(errors="backslashreplace"))


@contextlib.contextmanager
def staged_folder(
    path: PathLike, outdated: Callable[[Path], Iterable[Path]] = lambda folder: ()
) -> Iterator[Path]:
    """Yield an empty folder, whose files are moved to the folder ``path`` when the block ends.

    Files of the same name in ``path`` are replaced, files that ``outdated(path)`` returns are
    removed, and all others remain. If the block or the moving fails, ``path`` remains unchanged. A
    process that is killed while it moves files leaves ``path`` without the file COMPLETION_MARK, so
    that a mixture of two sets of results is recognised. Writing and renaming on the device are
    tested before the block runs. The staging folder of an existing folder is created inside it,
    because the folder may be the root of a mounted device.
    """
    target = folder_target(path)
    place = target if target.is_dir() else target.parent
    _remove_stale_of(target)
    with contextlib.ExitStack() as stack:
        try:
            stack.enter_context(_existing(place))
            stage = stack.enter_context(private_folder(place, target.name))
            _try_rename(stage)
            files = stage / "files"
            files.mkdir()
        except OSError as error:
            raise FlexgearError(f"cannot write to {target}: {reason(error)}") from error
        yield files
        replaced = stage / "replaced"
        _move_into_place(stage, files, target, lambda: _move(files, target, replaced, outdated))


def try_file(path: PathLike) -> None:
    """Raise FlexgearError or InputError if the file ``path`` cannot be written at present."""
    target = file_target(path)
    folder = target.parent
    _remove_stale_of(target)
    try:
        with _existing(folder, permanent=False), private_folder(folder, target.name) as stage:
            _try_rename(stage)
    except OSError as error:
        raise FlexgearError(f"cannot write {target}: {reason(error)}") from error


def file_target(path: PathLike) -> Path:
    """The path of an output file with links resolved; InputError if it cannot be a file."""
    mode = _mode(path)
    if mode is not None and not stat.S_ISREG(mode):
        what = "a folder" if stat.S_ISDIR(mode) else "a device or pipe"
        raise InputError("output", str(path), f"is {what}", "name a file")
    target = Path(os.path.realpath(path))
    if not str(path) or str(path).endswith(("/", os.sep)) or not target.name:
        raise InputError("output", str(path) or '""', "names no file", "name a file")
    return target


def folder_target(path: PathLike) -> Path:
    """The path of an output folder with links resolved; InputError if it cannot be a folder."""
    mode = _mode(path)
    if not str(path) or (mode is not None and not stat.S_ISDIR(mode)):
        what = "is a file" if str(path) else "names no folder"
        raise InputError("output", str(path) or '""', what, "name a folder")
    return Path(os.path.realpath(path))


def _mode(path: PathLike) -> int | None:
    """The st_mode of a file or folder, None if it does not exist; InputError for a wrong path."""
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
def _existing(folder: Path, permanent: bool = True) -> Iterator[None]:
    """Create ``folder`` and its parents for the block; remove those created here if it fails.
    permanent: whether they remain after a block that succeeds."""
    created = [p for p in (folder, *folder.parents) if not p.exists()]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        yield
        if permanent:
            created = []
    finally:
        with contextlib.suppress(OSError):  # a folder with finished work is not empty
            for each in created:
                each.rmdir()


def _remove_stale_of(target: Path) -> None:
    """Remove the staging folders that ended processes left in and beside ``target``."""
    remove_stale(target.parent)
    if target.is_dir():
        remove_stale(target)


def _try_rename(stage: Path) -> None:
    """Raise OSError if a file in the staging folder cannot be renamed to a path beside it."""
    inside, beside = stage / "tried", stage.with_suffix(".tried")
    inside.write_bytes(b"flexgear\n")
    _flush_to_disk(inside)
    try:
        os.replace(inside, beside)
    finally:
        beside.unlink(missing_ok=True)
        inside.unlink(missing_ok=True)


def _flush_to_disk(path: Path) -> None:
    with open(path, "r+b") as file:
        os.fsync(file.fileno())


def _move_into_place(stage: Path, work: Path, target: Path, move: Callable[[], None]) -> None:
    """Move finished work to ``target`` by ``move``. If that fails, the staging folder is kept
    permanently and FlexgearError names the work in it."""
    try:
        with _deferred_signals():
            move()
    except OSError as error:
        (stage / _LOCK).unlink(missing_ok=True)
        raise FlexgearError(
            f"cannot write to {target}: {reason(error)}; the finished work is kept as {work}"
        ) from error


def _move(
    files: Path, target: Path, replaced: Path, outdated: Callable[[Path], Iterable[Path]]
) -> None:
    """Move all files of the folder ``files`` to ``target``, by one rename if it does not exist.

    Replaced and outdated files are moved to the folder ``replaced`` first, and are moved back if
    any file cannot be moved.
    """
    if not target.exists():
        os.rename(files, target)
        return
    new = [f.relative_to(files) for f in files.rglob("*") if f.is_file()]
    old = {f.relative_to(target) for f in outdated(target)}
    old |= {name for name in new if (target / name).is_file()}
    last = sorted(old, key=_writing_order, reverse=True)
    steps = [(target / name, replaced / name) for name in last]
    steps += [(files / name, target / name) for name in sorted(new, key=_writing_order)]
    done: list[tuple[Path, Path]] = []
    try:
        for source, place in steps:
            place.parent.mkdir(parents=True, exist_ok=True)
            os.replace(source, place)
            done.append((source, place))
    except OSError:
        for source, place in reversed(done):
            with contextlib.suppress(OSError):  # the staging folder, which is kept, has the file
                os.replace(place, source)
        raise
    for folder in {target / name.parent for name in old} - {target}:
        with contextlib.suppress(OSError):  # not empty
            folder.rmdir()


def _writing_order(name: Path) -> tuple[bool, str]:
    """Sort key of files in the order of their writing, COMPLETION_MARK last."""
    return name == Path(COMPLETION_MARK), str(name)


@contextlib.contextmanager
def _deferred_signals() -> Iterator[None]:
    """Defer the signals that stop a run until the block, which is short, has ended."""
    received: list[int] = []
    handlers = {}
    if threading.current_thread() is threading.main_thread():
        for number in (getattr(signal, n) for n in STOP_SIGNALS if hasattr(signal, n)):
            if callable(signal.getsignal(number)):
                handlers[number] = signal.signal(number, lambda n, _: received.append(n))
    try:
        yield
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)
        for number in received:
            signal.raise_signal(number)


def reason(error: OSError) -> str:
    """The operating system's message, with a remedy if the disk is full."""
    text = error.strerror or str(error)
    full = error.errno in (errno.ENOSPC, getattr(errno, "EDQUOT", errno.ENOSPC))
    return f"{text}; free some space or choose another folder" if full else text


def plain(value: Any) -> Any:
    """A value as JSON can hold it: numpy and xarray values as lists and Python numbers. Raises
    FlexgearError for a value of another type."""
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
    raise FlexgearError(f"JSON cannot hold a {type(value).__name__}")
