"""Child processes that can be interrupted, however the tests themselves were started."""

import signal


def hear_interrupts() -> None:
    """For ``preexec_fn``: children of a shell's background job ignore SIGINT otherwise."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
