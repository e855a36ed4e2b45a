"""Declaration of headlines: figures of a run with verdicts.

The first screen of the report, the last lines of ``flexgear run`` and ``headlines`` in
``summary.json`` are made from these declarations.
"""

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
    """The figure of a headline for one stage, or for the whole train.

    level: verdict; stage: name, "" for the train; value: in the unit of the headline, or None;
    figure: the value in words; sentence: explanation; allowable: limit of the value in the same
    unit, or None; window: part of the run to which the value refers.
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
    """A headline. name: in ``summary.json``; title: in reports; unit: of the value; meaning:
    description of the value; section: of the report with its details; answers: function that gives
    the answers of all stages; allowable: source of the limit, "" without limit; is_least: whether
    the limit is a lower one, as for a life."""

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
