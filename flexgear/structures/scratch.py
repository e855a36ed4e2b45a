"""Large arrays on disk."""

from __future__ import annotations

import os
import tempfile

import numpy as np
from numpy.typing import NDArray

from flexgear.model.errors import FlexgearError


def scratch_array(shape: tuple[int, ...]) -> NDArray[np.float64]:
    """An empty array in a file of the temporary folder, which goes with the array.

    What memory is left keeps of it is the system's affair. All room is taken at once: a disk that
    fills up later could not be told from a crash. Raises FlexgearError where there is no room.
    """
    size = 8 * int(np.prod(shape))
    with tempfile.TemporaryFile(prefix="flexgear-") as file:
        try:
            os.posix_fallocate(file.fileno(), 0, size)
        except OSError as error:
            raise FlexgearError(
                f"{tempfile.gettempdir()} has no room for {size / 1e9:.1f} GB of constraint modes "
                f"({error.strerror}): let TMPDIR name a folder that has"
            ) from error
        return np.asarray(np.memmap(file, dtype=float, mode="r+", shape=shape))
