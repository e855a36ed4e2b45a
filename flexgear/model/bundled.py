"""Cases that come with the package."""

from __future__ import annotations

from functools import cache
from importlib.resources import files

_FOLDER = "cases"


@cache
def bundled_cases() -> tuple[str, ...]:
    """Names of the bundled cases."""
    folder = files("flexgear.model").joinpath(_FOLDER)
    names = (entry.name for entry in folder.iterdir())
    return tuple(sorted(name[:-5] for name in names if name.endswith(".toml")))


def bundled_text(name: str) -> str:
    """TOML text of a bundled case, for a user to copy and edit."""
    return files("flexgear.model").joinpath(_FOLDER, f"{name}.toml").read_text(encoding="utf-8")
