"""Compiled code is kept for the content of all that was compiled into it.

Numba keeps a function's machine code as long as the file that holds the function stays the same.
What is compiled into it from other files, functions and constants, may have changed meanwhile, and
so may the fields of named tuples that it is called with. Here its stamp holds all of these: its own
file, the files of compiled functions that this one imports, and so on; constants in them; and the
fields of all named tuples. Laws are called by address and are in no stamp but their own.
"""

from __future__ import annotations

import ast
import hashlib
import pickle
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numba.core import caching

PLAIN = (bool, int, float, str, bytes, np.generic)


def live_without_room() -> None:
    """From now on, code that cannot be kept (full disk, limits) or read is compiled again next time
    instead of ending the program, where numba still has the place for it. Code is not to be read
    that was kept for classes which are no more, as after an upgrade in place."""
    if hasattr(caching.Cache, "_guard_against_spurious_io_errors"):
        caching.Cache._guard_against_spurious_io_errors = _forgiven
    if _load_index is not None:
        caching.IndexDataCacheFile._load_index = _readable_index


@contextmanager
def _forgiven(_: caching.Cache) -> Iterator[None]:
    with suppress(OSError):
        yield


_load_index = getattr(caching.IndexDataCacheFile, "_load_index", None)


def _readable_index(file: caching.IndexDataCacheFile) -> Any:
    """What is kept, by signature; nothing where it is there but cannot be read."""
    try:
        return _load_index(file)  # type: ignore[misc]
    except (AttributeError, ImportError, EOFError, pickle.UnpicklingError):
        return {}


def keep_by_content(folders: Sequence[Path]) -> None:
    """From now on, functions of files below the folders are kept for the content of all that is
    compiled into them, at the place that numba chooses.

    Without numba's list of such places, which is not promised for ever, numba's own rule holds.
    """
    places = getattr(caching.CacheImpl, "_locator_classes", None)
    if places is not None:
        places.insert(0, _locator(list(places), [f.resolve() for f in folders]))


def _locator(places: Sequence[Any], folders: Sequence[Path]) -> Any:
    """Finds a place by the first of ``places`` that has one, as numba does, and stamps it."""
    fields = tuple_fields(path for f in folders for path in sorted(f.rglob("*.py")))

    class ByContent:
        @classmethod
        def from_function(cls, function: Callable[..., Any], file: str) -> Any:
            if not any(Path(file).resolve().is_relative_to(folder) for folder in folders):
                return None
            tried = (place.from_function(function, file) for place in places)
            found = next((one for one in tried if one is not None), None)
            if found is not None:
                stamp = _hashed([fields, _content(file), *_taken(function.__globals__)])
                found.get_source_stamp = lambda: stamp
            return found

    return ByContent


def tuple_fields(files: Iterable[Path]) -> str:
    """Names and fields of all named tuples in the files."""
    found = []
    for path in files:
        text = path.read_text(encoding="utf-8")
        for node in ast.walk(ast.parse(text)) if "(NamedTuple)" in text else ():
            if isinstance(node, ast.ClassDef) and "NamedTuple" in map(ast.unparse, node.bases):
                own = [ast.unparse(x.target) for x in node.body if isinstance(x, ast.AnnAssign)]
                found.append(f"{node.name}: {', '.join(own)}")
    return "; ".join(found)


def is_plain(value: object) -> bool:
    """Whether it is a constant whose text says all of it, or a collection of such."""
    if isinstance(value, Mapping):
        return all(is_plain(x) for pair in value.items() for x in pair)
    if isinstance(value, (tuple, list, set, frozenset)):
        return all(map(is_plain, value))
    return value is None or isinstance(value, PLAIN)


def _taken(names: Mapping[str, Any]) -> Iterator[str]:
    """What a module has at hand for its functions: constants, and what compiled functions of other
    modules are made of."""
    modules = set()
    for name, value in sorted(names.items()):
        if hasattr(value, "py_func") and value.py_func.__module__ != names["__name__"]:
            modules.add(value.py_func.__module__)
        elif not name.startswith("__") and is_plain(value):
            yield f"{name} = {_text(value)}"
    yield from map(_of_module, sorted(modules))


@cache
def _of_module(name: str) -> str:
    """The same of a module that is there as a whole."""
    names = vars(sys.modules[name])
    return _hashed([_content(names["__file__"]), *_taken(names)])


@cache
def _content(file: str) -> str:
    return hashlib.sha256(Path(file).read_bytes()).hexdigest() if Path(file).exists() else ""


def _text(value: Any) -> str:
    if isinstance(value, (set, frozenset)):
        return f"{{{', '.join(sorted(map(_text, value)))}}}"
    if isinstance(value, Mapping):
        return _text([(key, _text(one)) for key, one in value.items()])
    if isinstance(value, (tuple, list)):
        return f"({', '.join(map(_text, value))})"
    return repr(value)


def _hashed(parts: Iterable[str]) -> str:
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()
