"""Rows of tables from figures of a summary, by their declarations."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from itertools import groupby
from typing import Any

from flexgear.results.figure import Figure
from flexgear.results.report.parts import Row
from flexgear.results.report.wording import words

PRINTED = {
    "µm": ("m", 1e-6),
    "MPa": ("Pa", 1e6),
    "N/µm": ("N/m", 1e6),
    "1/min": ("r/min", 1.0),
    "1": ("", 1.0),
}


def row(figure: Figure, value: Any, name: str = "") -> Row:
    """The row of one figure; name: in place of angle brackets in its path."""
    unit, by = PRINTED.get(figure.unit, (figure.unit, 1.0))
    label = figure.label.format(name=words(name))
    return Row(label, value if value is None else by * value, figure.printed or unit)


def rows(figures: Iterable[Figure], section: Mapping[str, Any]) -> Iterator[Row]:
    """Rows of those figures of a section that have a label, in the order of their declaration, of
    several names name by name."""
    for first, group in groupby((f for f in figures if f.label), key=lambda f: f.names[0]):
        if first in section:
            yield from _rows([(f, f.names[1:]) for f in group], section[first])


def _rows(figures: list[tuple[Figure, list[str]]], value: Any, name: str = "") -> Iterator[Row]:
    (figure, keys), *_ = figures
    if not keys:
        yield row(figure, value, name)
    elif keys[0].startswith("<"):
        for inner_name, inner in value.items():
            yield from _rows([(f, rest[1:]) for f, rest in figures], inner, inner_name)
    else:
        for f, rest in figures:
            if rest[0] in value:
                yield from _rows([(f, rest[1:])], value[rest[0]], name)
