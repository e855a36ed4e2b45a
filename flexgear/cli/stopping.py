"""What happens at the signals that stop a run. Imports nothing that takes a while to load."""

from __future__ import annotations

import signal

from flexgear.files import STOPPING

TYPE_CHECKING = False  # as in typing, which takes longer to load than all the rest here
if TYPE_CHECKING:
    from collections.abc import Callable
    from types import FrameType

STOPPED = "stopped; nothing half-written was left"


def on_stop(handler: Callable[[int, FrameType | None], None] | signal.Handlers) -> None:
    """Set what happens at the signals that stop a run; those that are ignored, as under nohup or
    in a shell's background, stay so."""
    for name in STOPPING:
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, handler)
