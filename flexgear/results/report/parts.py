"""Rows, tables and verdicts of a report, and the sections they stand in."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Any, Literal

from flexgear.results.quantities import Figure
from flexgear.results.report.wording import words

Level = Literal["good", "watch", "bad", "note", "open"]
Value = float | str | None
MARKS: dict[Level, str] = {
    "bad": "outside limits",
    "watch": "look at this",
    "good": "within limits",
    "open": "not assessed",
    "note": "for information",
}

SECTIONS = {  # in the order of the page: heading and what the section answers
    "rating": ("Safety and life", "The weakest parts first, and what is not assessed."),
    "spectrum": ("Load spectrum", "What loads the train, and how long."),
    "rating_gears": (
        "Gears, factor by factor",
        "Load factors of every gear mesh, and what flanks and roots bear, each with its source.",
    ),
    "geometry": (
        "Geometry",
        "Gears, centre distances and what holds them, as the case gives them.",
    ),
    "power": ("Power flow", "Speeds, torques and powers of the members in steady running."),
    "meshes": ("Gear meshes", "Contact ratios, gear-mesh forces and what each tooth pair carries."),
    "face": ("Load along the face", "How evenly teeth carry along the face, and what tilts them."),
    "sharing": (
        "Load sharing",
        "How evenly the planets share the load. K is the largest load of a planet over "
        "the mean of all, at the worst instant; 1 is perfectly even.",
    ),
    "tolerance": ("Tolerance study", "How far random errors of the parts spread the load sharing."),
    "bearings": ("Bearings", "What the planet bearings carry, and their basic rating life."),
    "deflections": ("Deflections", "How far ring, carrier, sun and planets move under load."),
    "dynamics": ("Dynamics", "Steady running and torque drops in time, and their spectra."),
    "modes": ("Natural modes", "Frequencies, what moves in them, and what excites them."),
    "accuracy": ("Accuracy", "How far reduction, time step and equilibrium can be trusted."),
    "case": ("The case", "Every parameter of the run, defaults included."),
}


@dataclass(frozen=True)
class Row:
    """A figure with its name. unit: SI, or one of those ``wording.with_unit`` knows."""

    label: str
    value: Value
    unit: str = ""


@dataclass(frozen=True)
class Table:
    """Rows below one title in a section."""

    section: str
    title: str
    rows: Sequence[Row]


@dataclass(frozen=True)
class Verdict:
    """One answer of the first screen: what about, the figure, a sentence, how it stands.

    level: "good" and "bad" where there is something to hold the figure to, "watch" where an eye is
    needed, "note" where there is no limit, "open" where data of the case are missing; section: of
    the report, where its details are.
    """

    level: Level
    subject: str
    figure: str
    sentence: str
    section: str = ""


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
