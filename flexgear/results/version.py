"""Version of the installed package."""

from functools import cache
from importlib.metadata import PackageNotFoundError
from importlib.metadata import version as installed_version


@cache
def version() -> str:
    """Installed version, "0+unknown" for a source tree that is not installed."""
    try:
        return installed_version("flexgear")
    except PackageNotFoundError:
        return "0+unknown"
