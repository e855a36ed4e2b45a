"""gmsh as a context: quiet, off the main thread too, and always finalised."""

from __future__ import annotations

import ctypes
import math
import os
import signal
import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from types import ModuleType

from flexgear.model.errors import FlexgearError

_SIGACTION = 512  # bytes: more than struct sigaction has on any system
_ONE_AT_A_TIME = threading.RLock()  # gmsh keeps one global state in the process


def meshing_unit(length: float) -> float:
    """Power of two in which a length, m, is 1 to 2.

    gmsh and OpenCASCADE weld points by absolute distances (1e-8, 1e-7). In such a unit bodies of
    every size are treated alike, and powers of two leave no rounding.
    """
    return 2.0 ** (math.frexp(length)[1] - 1)


@contextmanager
def gmsh_session(name: str) -> Iterator[ModuleType]:
    """A fresh gmsh model; finalised whatever happens. gmsh errors become FlexgearError.

    ``interruptible=False`` leaves the signal handlers alone, so this works in any thread and
    Ctrl-C stays Python's. An already running gmsh of the caller is left running.
    """
    gmsh = _load()
    with _ONE_AT_A_TIME, ExitStack() as stack:
        if gmsh.isInitialized():
            stack.callback(lambda: gmsh.model.remove())
        else:
            with _python_signals():
                gmsh.initialize(argv=[], readConfigFiles=False, interruptible=False)
            stack.callback(gmsh.finalize)
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("General.NumThreads", 1)
        gmsh.model.add(name)
        try:
            yield gmsh
        except Exception as error:
            if type(error) is not Exception:  # gmsh raises nothing more specific
                raise
            raise FlexgearError(f"gmsh could not make the FE mesh of {name}: {error}") from error


@contextmanager
def _python_signals() -> Iterator[None]:
    """Context after which signal handlers of this process are unchanged, in any thread.

    gmsh makes SIGTERM, SIGHUP and SIGPIPE kill it, even where they were ignored. Python sets
    handlers in the main thread only, the C library in any.
    """
    if os.name != "posix":
        yield
        return
    library = ctypes.CDLL(None)
    numbers = (signal.SIGTERM, signal.SIGHUP, signal.SIGPIPE)
    before = {n: ctypes.create_string_buffer(_SIGACTION) for n in numbers}
    for number, action in before.items():
        library.sigaction(int(number), None, action)
    try:
        yield
    finally:
        for number, action in before.items():
            library.sigaction(int(number), action, None)


def _load() -> ModuleType:
    try:
        import gmsh
    except OSError as error:
        raise FlexgearError(
            f"gmsh cannot start, a system library is missing ({error}): apt-get install "
            "libgl1 libegl1 libglu1-mesa libxcursor1 libxft2 libxinerama1 libgomp1"
        ) from error
    return gmsh
