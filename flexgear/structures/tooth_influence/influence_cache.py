"""Influences in the cache, by content."""

from __future__ import annotations

import io
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from flexgear.files.atomic import write_bytes
from flexgear.files.cache_folder import cache_directory
from flexgear.model.errors import FlexgearError, FlexgearWarning
from flexgear.model.input_file import read_kept
from flexgear.structures.cache import sealed, unsealed
from flexgear.structures.store import content_key
from flexgear.structures.tooth_influence.edge_layer import EdgeLayer
from flexgear.structures.tooth_influence.influence import ToothInfluence
from flexgear.structures.tooth_influence.root_stress import RootInfluence

Arrays = Mapping[str, NDArray[np.float64]]
T = TypeVar("T")
_ARRAYS = ("roll", "z", "depth", "own", "neighbour")
_OF_ROOT = ("stress", "points", "cut", "cut_points")
_OF_EDGE = ("place", "middle", "end")
_OF_FLANK = ("roll", "z", "depth")


@dataclass(frozen=True)
class Form(Generic[T]):
    """How a kind of result is cached: its file, a version that is raised when the numerics change
    (part of every key), and functions to its arrays and back (ValueError or KeyError where arrays
    are missing)."""

    file: str
    version: int
    arrays: Callable[[T], Arrays]
    result: Callable[[Arrays], T]


def cached(content: Mapping[str, Any], compute: Callable[[], T], form: Form[T]) -> T:
    """What was kept for this content, else computed and kept.

    FlexgearWarning where the disk refuses to keep it; it is used all the same.
    """
    key = content_key(influence=form.version, **content)
    file = cache_directory() / "influence" / key / f"{form.file}.npz"
    try:
        with np.load(io.BytesIO(unsealed(read_kept(file)))) as arrays:
            return form.result(dict(arrays))
    except (OSError, ValueError, KeyError):  # none there, or a damaged one: made again
        pass
    influence = compute()
    stream = io.BytesIO()
    np.savez(stream, **form.arrays(influence))  # type: ignore[arg-type]
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        write_bytes(file, sealed(stream.getvalue()))
    except (OSError, FlexgearError) as error:
        text = f"cannot keep the influence of a tooth, it is made again next time: {error}"
        warnings.warn(text, FlexgearWarning, stacklevel=2)
    return influence


def _numbers(influence: ToothInfluence) -> NDArray[np.float64]:
    return np.array([influence.slope, influence.young, influence.poisson])


def _of_tooth(influence: ToothInfluence) -> Arrays:
    arrays = {name: getattr(influence, name) for name in _ARRAYS}
    return {"numbers": _numbers(influence), **{k: v for k, v in arrays.items() if v is not None}}


def _tooth(arrays: Arrays) -> ToothInfluence:
    slope, young, poisson = (float(value) for value in arrays["numbers"])
    values: dict[str, Any] = {name: arrays.get(name) for name in _ARRAYS}
    return ToothInfluence(**values, slope=slope, young=young, poisson=poisson)


def _of_root(influence: RootInfluence) -> Arrays:
    flank = {name: getattr(influence.flank, name) for name in _OF_FLANK}
    arrays = {name: getattr(influence, name) for name in _OF_ROOT}
    return {"numbers": _numbers(influence.flank), **flank, **arrays}


def _root(arrays: Arrays) -> RootInfluence:
    none = np.zeros((arrays["stress"].shape[-1], 0))
    return RootInfluence(flank=_tooth({**arrays, "own": none}), **{n: arrays[n] for n in _OF_ROOT})


def _of_edge(layer: EdgeLayer) -> Arrays:
    return {name: getattr(layer, name) for name in _OF_EDGE}


def _edge(arrays: Arrays) -> EdgeLayer:
    return EdgeLayer(**{name: arrays[name] for name in _OF_EDGE})


TOOTH = Form("tooth", 4, _of_tooth, _tooth)
ROOT = Form("root", 1, _of_root, _root)
EDGE = Form("edge", 1, _of_edge, _edge)
