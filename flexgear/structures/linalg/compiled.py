"""numba's decorators for functions whose machine code is kept for the next program, where there is
a folder for it: beside the package, the user's cache, or where NUMBA_CACHE_DIR says. Where none can
be written (read-only containers, users without a home) they are compiled for this program alone.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numba

Decorated = Callable[[Callable[..., Any]], Any]


def njit(**options: Any) -> Decorated:
    """``numba.njit`` whose code is kept where it can be."""
    return kept(numba.njit, **options)


def kept(decorator: Callable[..., Decorated], *signature: Any, **options: Any) -> Decorated:
    """A decorator of numba's with its option ``cache``, or without it where no folder will do."""

    def decorate(function: Callable[..., Any]) -> Any:
        try:
            return decorator(*signature, **{"cache": True, **options})(function)
        except RuntimeError:  # what numba says of a function that it finds no folder for
            return decorator(*signature, **{**options, "cache": False})(function)

    return decorate


@cache
def has_folder() -> bool:
    """Whether there is a folder in which code can be kept."""
    try:
        numba.njit(cache=True)(_nothing)
    except RuntimeError:
        return False
    return True


def _nothing() -> None:
    """A function to be kept."""
