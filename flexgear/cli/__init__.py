"""Command line: calls the layers below and prints their results.

Nothing heavy is imported here: a signal that comes before ``main`` begins ends in a traceback.
"""

from __future__ import annotations

import os
import signal

from flexgear.files import STOPPING

TYPE_CHECKING = False  # as in typing, which takes longer to load than all the rest here
if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from types import FrameType

__all__ = ["main"]
STOPPED = "stopped; nothing half-written was left"
# What libraries read when they are imported. Matrices are small: threads of one product wait for
# one another, and both processors have other work.
SETTINGS = {
    "OPENBLAS_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
    "VECLIB_MAXIMUM_THREADS": "1",
}


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and leave with its exit code."""
    on_stop(_leave)  # while libraries are loaded, a second or two
    for name, value in SETTINGS.items():
        os.environ.setdefault(name, value)
    from flexgear.cli import entry

    entry.main(arguments)


def _leave(number: int, frame: FrameType | None) -> None:
    """Exit at once, before any work has begun; an exception raised within an import could turn into
    any other one."""
    os.write(2, f"flexgear: {STOPPED}\n".encode())
    os._exit(1)


def on_stop(handler: Callable[[int, FrameType | None], None] | signal.Handlers) -> None:
    """Set what happens at the signals that stop a run; those that are ignored, as under nohup or
    in a shell's background, stay so."""
    for name in STOPPING:
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, handler)
