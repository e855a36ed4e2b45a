"""Options of numba for compiled loops, and the folder in which their machine code is cached.

The folder in flexgear's cache is named by the SHA-256 of all sources from which loops are compiled,
so that an edit of any of them compiles all loops anew. Where the folder cannot be written
(read-only containers, a full disk), loops are compiled in memory by every process.

Wrappers for callers that do not occur take a good part of the compilation and are left out. numba
counts references to arrays in every function that takes or slices them, which took a third of a
time step. The loops here go without: work arrays outlive the loops that use them. Such functions
must not make arrays.

Where numba's switch NUMBA_DISABLE_JIT is set, as it is by commands that solve a train in one
position only, loops run uncompiled. numba is not imported then: that takes as long as all other
imports.
"""

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
SOURCES = (  # compiled functions, and the named tuples and constants that they use
    "compiled.py",
    "analysis/kernels",
    "coupling/kernels",
    "coupling/laws",
    "coupling/pair_data.py",
    "structures/linalg",
)
MAX_CODE_SIZE = 2**26  # bytes of the machine code of all loops
MAX_OLD_FOLDERS = 4  # of other versions and of edited sources
_SETTING = threading.RLock()
WARNED = "FLEXGEAR_COMPILES_IN_MEMORY"  # environment variable: this process or its parent warned

# error_model "numpy": a check for division by zero costs a branch at each division
UNCOUNTED: dict[str, Any] = {"no_cfunc_wrapper": True, "error_model": "numpy"}
if not UNCOMPILED:
    import numba
    from numba.core.errors import NumbaExperimentalFeatureWarning
    from numba.core.options import DefaultOptions

    if hasattr(DefaultOptions, "_nrt"):  # no reference counts; a private option of numba
        UNCOUNTED["_nrt"] = False
    # numba warns of calls by address as experimental; they work since 0.49
    warnings.filterwarnings("ignore", category=NumbaExperimentalFeatureWarning)
INNER = {**UNCOUNTED, "no_cpython_wrapper": True}  # called by compiled functions only
FAST = {"reassoc", "contract", "nsz"}  # permits another order of summation, which vectorises sums
ZERO = np.int64(0)  # as an argument: each literal number would compile the called function anew
PART = {"inline": "always", "cache": False}  # inlined in its caller, not compiled by itself


def njit(**options: Any) -> Callable[[Callable[..., Any]], Any]:
    """``numba.njit`` with its code in ``code_folder``; without numba functions stay as they are."""
    if UNCOMPILED:
        return lambda function: function
    return cached(numba.njit, **options)


def cached(decorator: Callable[..., Any], *signature: Any, **options: Any) -> Callable[..., Any]:
    """A decorator of numba with its code in ``code_folder``."""

    def decorate(function: Callable[..., Any]) -> Any:
        folder = code_folder() if options.get("cache", True) else None
        with _numba_cache_in(folder):
            return decorator(*signature, **{**options, "cache": folder is not None})(function)

    return decorate


@cache
def code_folder() -> Path | None:
    """Folder of the compiled code, below NUMBA_CACHE_DIR or in flexgear's cache; None, with a
    FlexgearWarning, where it cannot be written."""
    folders = Path(numba.config.CACHE_DIR or cache_directory() / "compiled")
    folder = folders / fingerprint()
    try:
        if not folder.is_dir():
            folder.mkdir(parents=True)
            _remove_old(folders, folder)
        with tempfile.TemporaryFile(dir=folder) as probe:
            _reserve(probe.fileno(), MAX_CODE_SIZE)
    except OSError:
        _warn_once()
        return None
    return folder


def awaits_compilation(function: Any) -> bool:
    """Whether a compiled function has not been compiled yet, and its code can be cached."""
    folder = None if UNCOMPILED else function.stats.cache_path
    return folder is not None and not any(Path(folder).glob(f"*.{function.__name__}-*.nbi"))


@contextmanager
def compilation_times() -> Iterator[list[float]]:
    """Context with a list, which gets the time, s, of the compilations during it at its end."""
    times: list[float] = []
    if UNCOMPILED:
        yield times
        return
    from numba.core.event import install_timer

    with install_timer("numba:compile", times.append):
        yield times


def fingerprint() -> str:
    """SHA-256 of all ``SOURCES`` and of numba's level of optimisation."""
    root, digest = Path(__file__).parent, hashlib.sha256(f"{numba.config.OPT}\n".encode())
    for source in SOURCES:
        path = root / source
        for file in sorted(path.rglob("*.py")) if path.is_dir() else [path]:
            digest.update(f"{file.relative_to(root).as_posix()}\n".encode())
            digest.update(file.read_bytes())
    return digest.hexdigest()


def _reserve(file: int, size: int) -> None:
    """Allocate ``size`` bytes for a file; OSError where the disk is full or a limit is exceeded."""
    if hasattr(os, "posix_fallocate"):
        os.posix_fallocate(file, 0, size)
    else:
        os.truncate(file, size)


def _remove_old(folders: Path, current: Path) -> None:
    others = [f for f in folders.iterdir() if len(f.name) == len(current.name) and f != current]
    for folder in sorted(others, key=lambda f: f.stat().st_mtime)[:-MAX_OLD_FOLDERS]:
        shutil.rmtree(folder, ignore_errors=True)


@contextmanager
def _numba_cache_in(folder: Path | None) -> Iterator[None]:
    """Set numba's cache folder, a global setting, for functions decorated in the context."""
    with _SETTING:
        before = numba.config.CACHE_DIR
        numba.config.CACHE_DIR = before if folder is None else str(folder)
        try:
            yield
        finally:
            numba.config.CACHE_DIR = before


def _warn_once() -> None:
    if WARNED not in os.environ:
        os.environ[WARNED] = "1"  # worker processes inherit it and do not repeat the warning
        warnings.warn(
            "compiled loops cannot be cached and are compiled for this run alone, which takes "
            "half a minute; set FLEXGEAR_CACHE to a folder that can be written",
            FlexgearWarning,
            stacklevel=2,
        )


def as_read(data: Any) -> Any:
    """Arrays in named tuples for the loops: uncompiled ones need records with attributes."""
    if not UNCOMPILED:
        return data
    if isinstance(data, tuple):
        return type(data)(*map(as_read, data))
    return data.view(np.recarray) if data.dtype.names else data
