"""Influences in the cache, by content."""

from __future__ import annotations

import io
import warnings
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from flexgear.files.atomic import write_bytes
from flexgear.model.errors import FlexgearError, FlexgearWarning
from flexgear.structures.cache import cache_directory, sealed, unsealed
from flexgear.structures.store import content_key
from flexgear.structures.tooth_influence.influence import ToothInfluence

FORMAT = 3  # part of every key: raise it when the numerics change
_ARRAYS = ("roll", "z", "depth", "own", "neighbour")


def kept(content: Mapping[str, Any], compute: Callable[[], ToothInfluence]) -> ToothInfluence:
    """The influence that was kept for this content, else computed and kept.

    FlexgearWarning where the disk refuses to keep it; it is used all the same.
    """
    key = content_key(influence=FORMAT, **content)
    file = cache_directory() / "influence" / key / "tooth.npz"
    try:
        return _read(unsealed(file.read_bytes()))
    except (OSError, ValueError, KeyError):  # none there, or a damaged one: made again
        pass
    made = compute()
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        write_bytes(file, sealed(_written(made)))
    except (OSError, FlexgearError) as error:
        text = f"cannot keep the influence of a tooth, it is made again next time: {error}"
        warnings.warn(text, FlexgearWarning, stacklevel=2)
    return made


def _written(influence: ToothInfluence) -> bytes:
    stream = io.BytesIO()
    arrays = {name: getattr(influence, name) for name in _ARRAYS}
    numbers = np.array([influence.slope, influence.young, influence.poisson])
    np.savez(stream, numbers=numbers, **{k: v for k, v in arrays.items() if v is not None})
    return stream.getvalue()


def _read(data: bytes) -> ToothInfluence:
    with np.load(io.BytesIO(data)) as found:
        slope, young, poisson = (float(value) for value in found["numbers"])
        arrays: dict[str, Any] = {name: found.get(name) for name in _ARRAYS}
    return ToothInfluence(**arrays, slope=slope, young=young, poisson=poisson)
