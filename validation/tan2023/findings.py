"""What the paper states, and how each statement is measured: the list that becomes rows."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import rows

from tan2023.runs import Runs

reference = partial(rows.reference, "tan2023")  # reference.csv by quantity


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
    name: str = "",
) -> Callable[[Callable[[Runs], Finding]], Callable[[Runs], Finding]]:
    """Enter the decorated measurement into the list; name: its own if left out."""

    def enter(measure: Callable[[Runs], Finding]) -> Callable[[Runs], Finding]:
        called = name or measure.__name__
        STATEMENTS.append(Statement(called, figures, published, tolerance, measure, demanded))
        return measure

    return enter
