"""What the paper states, and what is computed for it: one list for tests, captions and the page."""

from __future__ import annotations

import csv
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from tan2023.runs import Runs


@dataclass(frozen=True)
class Published:
    """A number of the paper and how near it has to be met; tolerance is relative or None."""

    value: float
    unit: str
    source: str
    tolerance: float | None
    reason: str


@cache
def reference() -> dict[str, Published]:
    """reference.csv by quantity."""
    path = Path(__file__).parent / "reference.csv"
    with path.open(encoding="utf-8", newline="") as file:
        return {
            row["quantity"]: Published(
                value=float(row["value"]),
                unit=row["unit"],
                source=row["source"],
                tolerance=float(row["tolerance"]) if row["tolerance"] else None,
                reason=row["reason"],
            )
            for row in csv.DictReader(file)
        }


@dataclass(frozen=True)
class Finding:
    """Computed value in words; holds: None where nothing is demanded, only reported."""

    computed: str
    holds: bool | None = None
    why: str = ""


@dataclass(frozen=True)
class Statement:
    """One published statement.

    figures: the paper's figure numbers; published: the statement in our words; tolerance: what
    counts as met; demanded: False where we only say whether the paper is met, which no test asks
    for.
    """

    name: str
    figures: tuple[int, ...]
    published: str
    tolerance: str
    measure: Callable[[Runs], Finding]
    demanded: bool = True


STATEMENTS: list[Statement] = []


def statement(
    *figures: int,
    published: str,
    tolerance: str = "reported",
    demanded: bool = True,
) -> Callable[[Callable[[Runs], Finding]], Callable[[Runs], Finding]]:
    """Enter the decorated measurement into the list."""

    def enter(measure: Callable[[Runs], Finding]) -> Callable[[Runs], Finding]:
        STATEMENTS.append(
            Statement(measure.__name__, figures, published, tolerance, measure, demanded)
        )
        return measure

    return enter


class Findings:
    """Every statement measured once."""

    def __init__(self, runs: Runs) -> None:
        self.runs = runs
        self._found: dict[str, Finding] = {}

    def of(self, one: Statement) -> Finding:
        if one.name not in self._found:
            self._found[one.name] = one.measure(self.runs)
        return self._found[one.name]
