"""Version of the installed package."""

from __future__ import annotations

from functools import cache
from importlib.metadata import PackageNotFoundError
from importlib.metadata import version as installed_version


@cache
def version() -> str:
    """Version as installed, "0+unknown" from a source tree that is not."""
    try:
        return installed_version("flexgear")
    except PackageNotFoundError:
        return "0+unknown"
