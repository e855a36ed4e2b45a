"""A context for gmsh, without output, usable in any thread, and always finalised."""

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
_GMSH_LOCK = threading.RLock()  # gmsh has one global state in the process


def meshing_unit(length: float) -> float:
    """Power of two, m, by which a length, m, is 1 to 2.

    gmsh and OpenCASCADE weld points by absolute distances (1e-8, 1e-7). Lengths in this unit make
    the mesh independent of the body's size, and powers of two cause no rounding.
    """
    return 2.0 ** (math.frexp(length)[1] - 1)


@contextmanager
def gmsh_session(name: str) -> Iterator[ModuleType]:
    """Context with a new gmsh model, which is removed at its end. gmsh's errors become
    FlexgearError.

    With ``interruptible=False`` gmsh sets no handler for Ctrl-C, so that it can start in any
    thread. If the caller has initialised gmsh, it stays so.
    """
    gmsh = _load()
    with _GMSH_LOCK, ExitStack() as stack:
        if gmsh.isInitialized():
            stack.callback(gmsh.model.remove)
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
    """Context that restores this process's handlers of SIGTERM, SIGHUP and SIGPIPE at its end.

    gmsh sets them to end the process, even where they were ignored. Python can set handlers in the
    main thread only, the C library in any.
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
    """The module gmsh. FlexgearError where a system library is missing."""
    try:
        import gmsh
    except OSError as error:
        raise FlexgearError(
            f"gmsh cannot start, a system library is missing ({error}): apt-get install "
            "libgl1 libegl1 libglu1-mesa libxcursor1 libxft2 libxinerama1 libgomp1"
        ) from error
    return gmsh
