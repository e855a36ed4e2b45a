"""One published figure or statement beside the computed one: what every paper's package lists.

A package `validation/<paper>/` offers `statements.rows() -> Iterable[Row]` and
`pictures.drawn() -> Iterable[Drawn]`; both are called once a session (validation/ledger.py) and
shown on one page (validation/page.py). What is printed stands in its reference.csv.
"""

import csv
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

PRINT = "print"
INDEPENDENT = "independent code"
CLOSED_FORM = "closed form"
FLEXGEAR = "flexgear, another way"
STORED = "own stored figures"
AGAINST = {  # what a computed figure stands beside, as the page explains it
    PRINT: "figures and statements of papers, in tables of validation/ that nothing here writes",
    INDEPENDENT: "equations of papers written down without flexgear, CalculiX, plane FE contact",
    CLOSED_FORM: "what equilibrium or geometry demands of any gearbox",
    FLEXGEAR: "flexgear with finer divisions, other solvers or other bodies: a check of itself",
    STORED: "what flexgear gave when the row was stored: a guard against changes unseen, no proof",
}


@dataclass(frozen=True)
class Row:
    """One line of the page.

    paper: the package's name; where: table, figure or equation; published and computed: text with
    units; tolerance: what counts as met, in words; holds: None where nothing is demanded, only
    reported; why: the reason for the tolerance, or for a difference; against: what the computed
    figure is compared with, of ``AGAINST``, "" where nothing stands beside it.
    """

    paper: str
    where: str
    quantity: str
    published: str
    computed: str
    tolerance: str
    holds: bool | None
    why: str = ""
    against: str = PRINT

    def __post_init__(self) -> None:
        if self.against not in {*AGAINST, ""}:
            raise ValueError(f"{self.quantity}: compared with {self.against!r}, of none known")
        if self.holds is not None and not self.against:
            raise ValueError(f"{self.quantity}: demanded, but compared with nothing")
        if self.holds is not None:  # comparisons of numpy give its own bool, which JSON refuses
            object.__setattr__(self, "holds", bool(self.holds))

    @property
    def verdict(self) -> str:
        """met, not met or reported."""
        return {True: "met", False: "not met", None: "reported"}[self.holds]


@dataclass(frozen=True)
class Picture:
    """A drawn picture: file name in the paper's folder, title, what to know about the drawing."""

    file: str
    title: str
    note: str = ""


Drawn = tuple[Figure, Picture]


@dataclass(frozen=True)
class Published:
    """A line of reference.csv: the printed text and its value, relative tolerance or None.

    ``half_digit``: half the last printed digit is accepted, too, where it is the wider bound.
    """

    where: str
    quantity: str
    text: str
    value: float
    unit: str
    tolerance: float | None
    half_digit: bool
    reason: str


@cache
def reference(paper: str) -> dict[str, Published]:
    """reference.csv of a paper by quantity.

    Columns: where, quantity, value, unit, tolerance (relative, "" for a reported value; a trailing
    "h" accepts half the last printed digit, too), reason.
    """
    file = Path(__file__).with_name(paper) / "reference.csv"
    with file.open(encoding="utf-8", newline="") as stream:
        lines = [_published(line) for line in csv.DictReader(stream)]
    by_quantity = {line.quantity: line for line in lines}
    if len(by_quantity) != len(lines):
        raise ValueError(f"{file}: a quantity stands twice")
    return by_quantity


def published(paper: str, where: str) -> list[Published]:
    """Lines of reference.csv from one place of a paper."""
    return [line for line in reference(paper).values() if line.where == where]


def _published(line: dict[str, str]) -> Published:
    tolerance = line["tolerance"]
    half = tolerance.endswith("h")
    number = tolerance.removesuffix("h")
    return Published(
        where=line["where"],
        quantity=line["quantity"],
        text=line["value"],
        value=float(line["value"]),
        unit=line["unit"],
        tolerance=float(number) if number else None,
        half_digit=half,
        reason=line["reason"],
    )


def last_digit(text: str) -> float:
    """Value of the last printed digit: "1930.3" -> 0.1, "38.2e3" -> 100, "5" -> 1."""
    mantissa, _, exponent = text.strip().lower().partition("e")
    decimals = len(mantissa.partition(".")[2])
    return float(10.0 ** (int(exponent or 0) - decimals))


def is_within(computed: float, published: Published) -> bool | None:
    """Within the relative tolerance or, where accepted, half the last printed digit."""
    if published.tolerance is None:
        return None
    accepted = published.tolerance * abs(published.value)
    if published.half_digit:
        accepted = max(accepted, 0.5 * last_digit(published.text))
    return bool(abs(computed - published.value) <= accepted * (1 + 1e-9))


def tolerance_text(published: Published) -> str:
    """ "0.05 %", "0.05 % or half the last digit", "exact" or "reported"."""
    if published.tolerance is None:
        return "reported"
    relative = f"{100 * published.tolerance:g} %" if published.tolerance else ""
    half = "half the last printed digit" if published.half_digit else ""
    return " or ".join(t for t in (relative, half) if t) or "exact"


def compared(
    paper: str, published: Published, computed: float, digits: int = 6, why: str = ""
) -> Row:
    """Row of a computed number against a printed one."""
    unit = "" if published.unit == "1" else f" {published.unit}"
    off = ""
    if published.value:
        off = f" ({100 * (computed / published.value - 1):+.3g} %)"
    return Row(
        paper=paper,
        where=published.where,
        quantity=published.quantity,
        published=f"{published.text}{unit}",
        computed=f"{number(computed, digits)}{unit}{off}",
        tolerance=tolerance_text(published),
        holds=is_within(computed, published),
        why=". ".join(t for t in (published.reason, why) if t),
    )


def number(value: float, digits: int = 6) -> str:
    """``value`` to ``digits`` significant digits; noise around zero is 0."""
    return "0" if abs(value) < 1e-12 else np.format_float_positional(
        value, precision=digits, unique=False, fractional=False, trim="-"
    )  # fmt: skip


def explained(row: Row, why: str) -> Row:
    """``row`` with a further reason."""
    return replace(row, why=". ".join(t for t in (row.why, why) if t))


def gathered(paper: str, *sections: Callable[[], Iterable[Row]]) -> list[Row]:
    """Rows of all sections; a section that breaks down gives one row that is not met."""
    lines: list[Row] = []
    for section in sections:
        try:
            lines += section()
        except Exception as error:  # the other sections' rows must still be shown
            name = section.__name__.replace("_", " ")
            text = f"{type(error).__name__}: {error}"
            lines.append(Row(paper, "", name, "", "not computed", "computed", False, text))
    return lines


def failures(rows: Iterable[Row]) -> str:
    """Text of all demanded rows that do not hold, "" if none."""
    return "\n".join(
        f"{r.paper}, {r.where}, {r.quantity}: {r.published} against {r.computed} ({r.tolerance})"
        f" {r.why}"
        for r in rows
        if r.holds is False
    )
