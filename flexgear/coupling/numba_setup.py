"""What numba does otherwise here: where it keeps code, and what rests while it compiles."""

from __future__ import annotations

import gc
import os
import warnings
from collections.abc import Sequence
from pathlib import Path

from numba.core import event
from numba.core.errors import NumbaExperimentalFeatureWarning
from numba.core.options import DefaultOptions

from flexgear.coupling.compile_cache import keep_by_content, live_without_room
from flexgear.model.errors import FlexgearWarning
from flexgear.structures.linalg.compiled import has_folder

TOLD = "FLEXGEAR_COMPILES_IN_MEMORY"  # environment variable: a program of the same tree said so
# numba's own name for not counting arrays, not promised for ever
CAN_LEAVE_UNCOUNTED = hasattr(DefaultOptions, "_nrt")


def set_up(folders: Sequence[Path]) -> None:
    """Before the first function below the folders is compiled."""
    live_without_room()
    keep_by_content(folders)
    if not has_folder() and TOLD not in os.environ:
        os.environ[TOLD] = "1"  # worker processes of this one do not say it again
        warnings.warn(
            "compiled loops can be kept nowhere and are compiled for this run alone, which takes "
            "half a minute; let NUMBA_CACHE_DIR name a folder that can be written",
            FlexgearWarning,
            stacklevel=2,
        )
    event.register("numba:compile", _WithoutCollection())
    # numba's word for calling functions by address, which works since 0.49
    warnings.filterwarnings("ignore", category=NumbaExperimentalFeatureWarning)


class _WithoutCollection(event.Listener):
    """Python looks for no garbage while code is compiled: that makes millions of objects, hardly
    any of them garbage, and looking through them took a tenth of the time."""

    def __init__(self) -> None:
        self._depth, self._collects = 0, False

    def on_start(self, event: event.Event) -> None:
        if self._depth == 0:
            self._collects = gc.isenabled()
            gc.disable()
        self._depth += 1

    def on_end(self, event: event.Event) -> None:
        self._depth -= 1
        if self._depth == 0 and self._collects:
            gc.enable()
