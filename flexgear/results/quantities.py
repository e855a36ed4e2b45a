"""What declares a variable of a result: dimensions, unit, meaning; names of axes.

The first dimension is that of the samples, "time" for a transient and "position" for a series of
equilibria; it is written here as "sample". Frames and signs are those of docs/conventions.md. Only
variables with an attribute ``missing``, which says when, hold values that are not a number (null in
JSON).
"""

from __future__ import annotations

from typing import NamedTuple


class Quantity(NamedTuple):
    """dims: names of the axes in order; units; meaning in words; missing: when a value is missing,
    that is not a number, empty where none ever is."""

    dims: tuple[str, ...]
    units: str
    meaning: str
    missing: str = ""

    @property
    def attrs(self) -> dict[str, str]:
        """Attributes of a variable."""
        attributes = {MISSING: self.missing} if self.missing else {}
        return {"units": self.units, "long_name": self.meaning, **attributes}


class Coordinate(NamedTuple):
    """units; meaning in words; stage: of an axis whose entries are of stages how that is told:
    "name" by the names of members, which its labels are, else the coordinate that stands beside it.
    """

    units: str
    meaning: str
    stage: str = ""


S = "sample"
MISSING = "missing"  # attribute of variables that may lack values: when they do
UNLOADED = "where the planets together carry less than 3 % of rated, or of the largest of them"
DOFS = ("ux", "uy", "uz", "rx", "ry", "rz")
AXES = ("x", "y", "z")
