"""A figure of ``summary.json``, declared once: value, key, unit, meaning, and row in the report."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import Any, Literal, NamedTuple

import numpy as np

ALWAYS: Literal["always"] = "always"
WITH_SECTION: Literal["with its section"] = "with its section"
ABSENT: Any = {}  # value of a figure that is not there


class Bars(NamedTuple):
    """A picture of a figure as bars, by stage and name. section: of the report, where it stands;
    label: of its axis, without unit; caption; sentence: what it shows."""

    section: str
    label: str
    caption: str
    sentence: str


class Figure(NamedTuple):
    """path: keys with dots below those of its section, angle brackets for names of the case; unit:
    "" where it is no number; needed: always, where the section that its path begins with is there,
    or not; of: the value of the path's first key, with all that is below it, of what the section is
    of: ABSENT where there is none, None where it has no number; label: of its rows in tables,
    {name} for angle brackets, "" where they leave it out; printed: unit in tables, where the unit
    does not say; bars: its picture, if it has one.
    """

    path: str
    unit: str
    meaning: str
    needed: Literal["", "always", "with its section"] = ""
    of: Callable[[Any], Any] | None = None
    label: str = ""
    printed: str = ""
    bars: Bars | None = None

    @property
    def names(self) -> list[str]:
        """Names on the way to it."""
        return self.path.split(".")


def number(value: Any) -> float | None:
    """A number, None where there is none."""
    return float(value) if np.isfinite(value) else None


def below(section: str, figures: Iterable[Figure]) -> Iterator[Figure]:
    """Figures with their whole paths."""
    return (f._replace(path=f"{section}.{f.path}") for f in figures)


def values(figures: Iterable[Figure], subject: Any) -> dict[str, Any]:
    """A section of a summary: the figures of a subject by their keys."""
    figures_of = ((f.names[0], f.of(subject), f.needed) for f in figures if f.of is not None)
    return {name: value for name, value, needed in figures_of if needed or value != ABSENT}
