"""Loops compiled by numba: how, and where their machine code is kept for the next program.

All of it lies in one folder of flexgear's cache, named by the SHA-256 of all sources that anything
is compiled from, so that an edit of any of them compiles anew. Where that folder cannot be written
(read-only containers, a full disk) loops are compiled for the program alone.

Wrappers for callers that never come take a good part of the compilation. Arrays are counted by
every function that takes or slices them unless it is told not to: work arrays outlive the loops
that use them, and counting took a third of a time step. Such functions must not make arrays.

Where numba's own switch NUMBA_DISABLE_JIT is set, as it is by commands that look at a train in one
position only, loops run as they are and numba, which takes as long to load as all the rest, is not
imported.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import tempfile
import threading
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from flexgear.files.cache_folder import cache_directory
from flexgear.model.errors import FlexgearWarning

UNCOMPILED = os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0")
SOURCES = (  # of what is compiled, and of the named tuples and constants that it takes
    "compiled.py",
    "analysis/kernels",
    "coupling/kernels",
    "coupling/laws",
    "coupling/pair_data.py",
    "structures/linalg",
)
ROOM = 2**26  # bytes that the machine code of all loops takes at most
MOST_FOLDERS = 4  # of earlier sources that are kept: of other versions, and of edits
_SETTING = threading.RLock()
WARNED = "FLEXGEAR_COMPILES_IN_MEMORY"  # environment variable: a program of the same tree warned

# a division by zero is not looked for, as in NumPy: looking costs a branch each
UNCOUNTED: dict[str, Any] = {"no_cfunc_wrapper": True, "error_model": "numpy"}
if not UNCOMPILED:
    import numba
    from numba.core.errors import NumbaExperimentalFeatureWarning
    from numba.core.options import DefaultOptions

    if hasattr(DefaultOptions, "_nrt"):  # not to count arrays; a name not promised for ever
        UNCOUNTED["_nrt"] = False
    # numba's word for calling functions by address, which works since 0.49
    warnings.filterwarnings("ignore", category=NumbaExperimentalFeatureWarning)
INNER = {**UNCOUNTED, "no_cpython_wrapper": True}
FAST = {"reassoc", "contract", "nsz"}  # sums may be taken in another order: they are vectorised
ZERO = np.int64(0)  # to pass on: every literal number would compile the function called anew
# becomes a part of its caller, and is neither compiled nor kept by itself
PART = {"inline": "always", "cache": False}


def njit(**options: Any) -> Callable[[Callable[..., Any]], Any]:
    """numba's decorator of that name, whose code is kept; or one that leaves functions alone."""
    if UNCOMPILED:
        return lambda function: function
    return cached(numba.njit, **options)


def cached(decorator: Callable[..., Any], *signature: Any, **options: Any) -> Callable[..., Any]:
    """A decorator of numba's whose code is kept in ``code_folder``."""

    def decorate(function: Callable[..., Any]) -> Any:
        folder = code_folder() if options.get("cache", True) else None
        with _numba_keeps_in(folder):
            return decorator(*signature, **{**options, "cache": folder is not None})(function)

    return decorate


@cache
def code_folder() -> Path | None:
    """Where code is kept, below numba's NUMBA_CACHE_DIR or in flexgear's cache; None, with a
    FlexgearWarning, where nothing can be written there."""
    folders = Path(numba.config.CACHE_DIR or cache_directory() / "compiled")
    folder = folders / fingerprint()
    try:
        if not folder.is_dir():
            folder.mkdir(parents=True)
            _remove_old(folders, folder)
        with tempfile.TemporaryFile(dir=folder) as probe:
            _reserve(probe.fileno(), ROOM)
    except OSError:
        _warn_once()
        return None
    return folder


def fingerprint() -> str:
    """SHA-256 of all sources that anything is compiled from, and of how much it is optimised."""
    root, digest = Path(__file__).parent, hashlib.sha256(f"{numba.config.OPT}\n".encode())
    for source in SOURCES:
        path = root / source
        for file in sorted(path.rglob("*.py")) if path.is_dir() else [path]:
            digest.update(f"{file.relative_to(root).as_posix()}\n".encode())
            digest.update(file.read_bytes())
    return digest.hexdigest()


def _reserve(file: int, size: int) -> None:
    """Room for so many bytes; OSError where the disk or a limit does not give it."""
    if hasattr(os, "posix_fallocate"):
        os.posix_fallocate(file, 0, size)
    else:
        os.truncate(file, size)


def _remove_old(folders: Path, current: Path) -> None:
    others = [f for f in folders.iterdir() if len(f.name) == len(current.name) and f != current]
    for folder in sorted(others, key=lambda f: f.stat().st_mtime)[:-MOST_FOLDERS]:
        shutil.rmtree(folder, ignore_errors=True)


@contextmanager
def _numba_keeps_in(folder: Path | None) -> Iterator[None]:
    """Functions decorated inside are kept in a folder; those of other packages are not. One thread
    at a time: the setting is numba's own for all of them."""
    with _SETTING:
        before = numba.config.CACHE_DIR
        numba.config.CACHE_DIR = before if folder is None else str(folder)
        try:
            yield
        finally:
            numba.config.CACHE_DIR = before


def _warn_once() -> None:
    if WARNED not in os.environ:
        os.environ[WARNED] = "1"  # worker processes of this one do not say it again
        warnings.warn(
            "compiled loops can be kept nowhere and are compiled for this run alone, which takes "
            "half a minute; let FLEXGEAR_CACHE name a folder that can be written",
            FlexgearWarning,
            stacklevel=2,
        )


def as_read(data: Any) -> Any:
    """Arrays in (nested) named tuples as the loops read them: where these are not compiled, records
    whose fields are attributes."""
    if not UNCOMPILED:
        return data
    if isinstance(data, tuple):
        return type(data)(*map(as_read, data))
    return data.view(np.recarray) if data.dtype.names else data
