"""Command line: orders work from the layers below and shows what came of it."""

import os
import signal
from collections.abc import Sequence
from types import FrameType

__all__ = ["main"]


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and leave with its exit code."""
    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:  # as a shell's background jobs have
        signal.signal(signal.SIGINT, _leave)  # while libraries are loaded, a second or two
    from flexgear.cli import entry

    entry.main(arguments)


def _leave(number: int, frame: FrameType | None) -> None:
    """Ctrl-C where nothing was begun; an exception within an import could turn into any other."""
    os.write(2, b"flexgear: stopped; nothing half-written was left\n")
    os._exit(1)
