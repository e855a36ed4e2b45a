"""Content-addressed cache of reduced bodies.

An entry is a folder named by the SHA-256 of everything the body depends on. It is written under a
temporary name and renamed when complete; header and arrays carry checksums, and an entry with a
wrong checksum is deleted and computed again. The recovery array stays on disk as a memory map.
A body that several processes need at once is computed by one of them.
"""

import contextlib
import json
import os
import warnings
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from flexgear.files.atomic import private_folder, remove_stale
from flexgear.files.cache_folder import cache_directory
from flexgear.files.locks import one_at_a_time
from flexgear.model.errors import FlexgearWarning
from flexgear.model.input_file import open_regular, read_kept
from flexgear.structures.cache import FORMAT, remove, sealed, unsealed
from flexgear.structures.reduced import ReducedBody

_ARRAYS = ("positions", "mass", "stiffness", "points", "cells", "recovery", "probe_loads")


def cached(
    key: str,
    compute: Callable[[], ReducedBody],
    directory: Path | None = None,
    waiting: Callable[[float], object] = bool,
) -> ReducedBody:
    """The body stored under key; one that is not stored is computed, stored and read back.

    waiting: called with 0 again and again while another process computes it, and with 1 at the end
    of that. FlexgearWarning where an entry is damaged, and where the new one cannot be written: the
    computed body is returned all the same.
    """
    entry = (directory or cache_directory()) / "reduced" / key
    stored = load(entry)
    if stored is not None:
        return stored
    with one_at_a_time(entry, waiting):
        return (load(entry) if entry.is_dir() else None) or _computed(entry, compute)


def _computed(entry: Path, compute: Callable[[], ReducedBody]) -> ReducedBody:
    """Compute a body, store it and read it back."""
    body = compute()
    try:
        save(body, entry)
    except OSError as error:
        _warn(
            f"cannot keep the reduced {body.name} in {entry.parent}: {error.strerror or error}; "
            "each run computes it again; free some space or set FLEXGEAR_CACHE to another folder"
        )
        return body
    return load(entry) or body


def is_cached(key: str) -> bool:
    """Whether there is an entry under key."""
    return (cache_directory() / "reduced" / key).is_dir()


def save(body: ReducedBody, entry: Path) -> None:
    """Write an entry whole or not at all. Raises OSError where it cannot be written."""
    entry.parent.mkdir(parents=True, exist_ok=True)
    remove_stale(entry.parent)
    with private_folder(entry.parent, "draft") as stage:
        draft = stage / "entry"
        draft.mkdir()
        checksums = {}
        arrays = {name: getattr(body, name) for name in _ARRAYS}
        for name, array in arrays.items():
            with (draft / f"{name}.npy").open("wb") as stream:
                writer = _ChecksumWriter(stream)
                np.save(writer, array)
            checksums[name] = writer.checksum
        header = {
            **_identity(entry),
            "name": body.name,
            "node_names": body.node_names,
            "n_modes": body.n_modes,
            "probe_cases": body.probe_cases,
            "report": body.report,
            "checksums": checksums,
        }
        text = json.dumps(header, indent=1, default=float)
        (draft / "header.json").write_bytes(sealed(text.encode()))
        remove(entry)
        try:
            os.rename(draft, entry)
        except OSError:
            if not entry.is_dir():  # otherwise another process has stored the same body
                raise


def load(entry: Path) -> ReducedBody | None:
    """The body of an entry; None where there is none or, with a FlexgearWarning, it is damaged."""
    try:
        entry.lstat()
    except OSError:
        return None
    try:
        header = json.loads(unsealed(read_kept(entry / "header.json")))
        if any(header[name] != value for name, value in _identity(entry).items()):
            raise ValueError("its header belongs to another body")
        arrays: dict[str, NDArray[Any]] = {}
        for name in header["checksums"]:
            path = entry / f"{name}.npy"
            if _checksum(path) != header["checksums"][name]:
                raise ValueError(f"the checksum of {path.name} is wrong")
            arrays[name] = np.load(path, mmap_mode="r" if name == "recovery" else None)
    except (OSError, ValueError, KeyError) as error:
        why = error.strerror if isinstance(error, OSError) else error
        _warn(f"the stored body {entry} is damaged ({why}); it is computed again")
        with contextlib.suppress(OSError):
            remove(entry)
        return None
    return ReducedBody(
        name=header["name"],
        node_names=tuple(header["node_names"]),
        n_modes=header["n_modes"],
        probe_cases=tuple((node, case) for node, case in header["probe_cases"]),
        report=header["report"],
        rim=None,
        **arrays,
    )


def _identity(entry: Path) -> dict[str, str]:
    """Header fields that an intact entry must have: format and key."""
    return {"format": FORMAT, "key": entry.name}


def _warn(text: str) -> None:
    warnings.warn(text, FlexgearWarning, stacklevel=3)


class _ChecksumWriter:
    """Writer to a binary file that computes the CRC-32 of the data.

    np.save writes to a plain file at C level, where an incomplete write to a full disk goes
    unnoticed.
    """

    def __init__(self, stream: BinaryIO) -> None:
        self._stream, self.checksum = stream, 0

    def write(self, data: bytes) -> int:
        self.checksum = zlib.crc32(data, self.checksum)
        return self._stream.write(data)


def _checksum(path: Path) -> int:
    value = 0
    with open_regular(path) as stream:
        while chunk := stream.read(1 << 22):
            value = zlib.crc32(chunk, value)
    return value
