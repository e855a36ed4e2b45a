"""Command line: calls the layers below and prints their results.

This module imports little, as a signal before the start of ``main`` ends in a traceback.
"""

from __future__ import annotations

import os
import signal

from flexgear.files import STOP_SIGNALS

TYPE_CHECKING = False  # as in typing, whose import takes longer than the rest of this module
if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from types import FrameType

__all__ = ["main"]
STOPPED = "stopped; nothing half-written was left"
# Read by libraries when they are imported. Matrices are small, so that threads of one product would
# mostly wait for each other.
SETTINGS = {
    "OPENBLAS_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
    "VECLIB_MAXIMUM_THREADS": "1",
}


def main(arguments: Sequence[str] | None = None) -> None:
    """Run a command line and exit with its code."""
    on_stop(_leave)  # while libraries are imported, a second or two
    for name, value in SETTINGS.items():
        os.environ.setdefault(name, value)
    from flexgear.cli import entry

    entry.main(arguments)


def _leave(number: int, frame: FrameType | None) -> None:
    """Exit at once, before any work: an import could turn an exception into a different one."""
    os.write(2, f"flexgear: {STOPPED}\n".encode())
    os._exit(1)


def on_stop(handler: Callable[[int, FrameType | None], None] | signal.Handlers) -> None:
    """Set the handler of the signals that stop a run; ignored signals, as under nohup or in the
    background of a shell, stay ignored."""
    for name in STOP_SIGNALS:
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, handler)
