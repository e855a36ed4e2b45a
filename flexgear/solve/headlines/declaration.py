"""A headline: a figure that answers for the gearbox, declared once.

The first screen of the report, the end of ``flexgear run`` and ``headlines`` in ``summary.json``
come from these declarations.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from flexgear.gears.power_flow import PowerFlow
from flexgear.model.case import Case
from flexgear.results.report.parts import Level
from flexgear.results.report.sharing import Sharing, sharings


@dataclass(frozen=True)
class Findings:
    """Input of headlines: the case, its power flow and the summary of its run."""

    case: Case
    flow: PowerFlow
    summary: Mapping[str, Any]

    @cached_property
    def sharings(self) -> dict[str, Sharing]:
        """Load sharing of the stages whose planets share a load, by stage."""
        return {s.stage: s for s in sharings(self.summary["load_sharing"])}


@dataclass(frozen=True)
class Answer:
    """The figure of one stage, or of the whole train.

    stage: name, "" for the train; value: in the unit of the headline, None where there is none;
    figure: the value as a person reads it; allowable: what the value is held to, in the same unit,
    None where there is nothing; window: part of the run that the value is of.
    """

    level: Level
    stage: str
    value: float | None
    figure: str
    sentence: str
    allowable: float | None = None
    window: str = ""


@dataclass(frozen=True)
class Headline:
    """name: in ``summary.json``; section: of the report, where its details are; answers: of every
    stage; allowable: where the limit comes from, "" where the figure has none; is_least: whether
    the value is bad below its limit, as a life is, not above it."""

    name: str
    title: str
    unit: str
    meaning: str
    section: str
    answers: Callable[[Findings], Iterable[Answer]]
    allowable: str = ""
    is_least: bool = False

    def use(self, value: float | None, allowable: float | None) -> float:
        """Utilisation of the allowable, 1 at the limit; 0 where value or allowable is missing."""
        if not value or not allowable:
            return 0.0
        return allowable / value if self.is_least else value / allowable
