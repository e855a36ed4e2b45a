"""Files that a user names: regular ones of a bounded size, read without ever waiting."""

from __future__ import annotations

import errno
import os
import stat
from pathlib import Path
from typing import BinaryIO

from flexgear.model.errors import InputError

MEGABYTE = 1 << 20
MOST_CASE = 4 * MEGABYTE  # of TOML or JSON
MOST_SERIES = 64 * MEGABYTE  # of a CSV file, millions of rows
MOST_FE_MESH = 4096 * MEGABYTE
MOST_REXS = 256 * MEGABYTE  # unpacked; gearboxes with load distributions take some 32
MOST_MATRICES = 2048 * MEGABYTE


def require_regular(path: Path, what: str, most: int) -> None:
    """InputError if ``path`` is no regular file, or has more than ``most`` bytes.

    Pipes and devices would keep a reader waiting, or feed it for ever.
    """
    try:
        status = os.stat(path)
    except FileNotFoundError:
        raise InputError(str(path), what, "there is no such file", "check the path") from None
    except OSError as fault:
        raise InputError(str(path), what, fault.strerror or "unreadable", "check it") from None
    except ValueError as fault:  # a zero byte in the name
        raise InputError(str(path), what, str(fault), "check the path") from None
    if stat.S_ISDIR(status.st_mode):
        raise InputError(str(path), what, "is a folder", "name a file in it")
    if not stat.S_ISREG(status.st_mode):
        raise InputError(str(path), what, "is a device or pipe", "name a file")
    if status.st_size > most:
        _too_large(path, what, most)


def open_regular(path: str | os.PathLike[str]) -> BinaryIO:
    """A regular file opened for reading; OSError for a pipe or device, without waiting for it."""
    handle = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    try:
        if not stat.S_ISREG(os.fstat(handle).st_mode):
            raise OSError(errno.EINVAL, "is a device or pipe", os.fspath(path))
        return open(handle, "rb")
    except BaseException:
        os.close(handle)
        raise


def read_kept(path: str | os.PathLike[str]) -> bytes:
    """What a cache holds; OSError also for a pipe or device in its place."""
    with open_regular(path) as file:
        return file.read()


def read_bytes(path: Path, what: str, most: int) -> bytes:
    """The content of a regular file of at most ``most`` bytes; InputError where there is none."""
    require_regular(path, what, most)
    try:
        with open_regular(path) as file:
            content = file.read(most + 1)  # it may grow meanwhile
    except OSError as fault:
        raise InputError(str(path), what, fault.strerror or "unreadable", "check it") from None
    if len(content) > most:
        _too_large(path, what, most)
    return content


def read_text(path: Path, what: str = "case file", most: int = MOST_CASE) -> str:
    """The text of a regular file; InputError also if it is no UTF-8. A byte order mark goes."""
    try:
        return read_bytes(path, what, most).decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError(str(path), what, "is not UTF-8 text", "save it as plain text") from None


def _too_large(path: Path, what: str, most: int) -> None:
    raise InputError(
        str(path), what, f"is larger than {most // MEGABYTE} MB", "check that it is the right file"
    )
