"""Headlines of a run: the figures and verdicts on the first screen of its report, worst first."""

import math
from collections.abc import Callable, Mapping
from dataclasses import asdict
from typing import Any, get_args

from flexgear.gears.power_flow import PowerFlow
from flexgear.model.case import Case
from flexgear.results.report.parts import Level, Verdict
from flexgear.results.report.wording import words
from flexgear.solve.headlines.declaration import Answer, Findings, Headline
from flexgear.solve.headlines.loads import (
    DEFLECTIONS,
    FACE_LOAD,
    LARGEST_FORCE,
    LOAD_SHARING,
    NEGLECTED,
    RESONANCE,
    TRANSMISSION_ERROR,
)
from flexgear.solve.headlines.ratings import BEARING_LIFE, FAULTS, FLANK_PRESSURE, ROOT_STRESS
from flexgear.solve.headlines.solution import SOLUTION

HEADLINES: tuple[Headline, ...] = (
    LARGEST_FORCE, LOAD_SHARING, ROOT_STRESS, FLANK_PRESSURE, BEARING_LIFE, RESONANCE, DEFLECTIONS,
    FACE_LOAD, TRANSMISSION_ERROR, NEGLECTED, FAULTS, SOLUTION,
)  # fmt: skip
_WORST = ("bad", "watch")  # levels that come before all others
WARNING = "Warning"


def headlines(case: Case, flow: PowerFlow, summary: Mapping[str, Any]) -> list[dict[str, Any]]:
    """All answers of all headlines, worst first, as dictionaries of ``summary.json``."""
    findings = Findings(case, flow, summary)
    every = [(h, answer) for h in HEADLINES for answer in h.answers(findings)]
    every.sort(key=lambda pair: _rank(*pair))  # equal ranks stay in the order of HEADLINES
    return [{"name": h.name, "unit": h.unit, **asdict(answer)} for h, answer in every]


def rows_schema() -> dict[str, Any]:
    """JSON schema of ``headlines``."""
    kinds: dict[str, Any] = {
        "name": {"enum": [h.name for h in HEADLINES]},
        "unit": {"enum": sorted({h.unit for h in HEADLINES})},
        "level": {"enum": list(get_args(Level))},
        **{key: {"type": "string"} for key in ("stage", "figure", "sentence", "window")},
        **{key: {"type": ["number", "null"]} for key in ("value", "allowable")},
    }
    row = {"type": "object", "properties": kinds, "required": list(kinds)}
    return {"type": "array", "items": row | {"additionalProperties": False}}


def _rank(headline: Headline, answer: Answer) -> tuple[int, float]:
    worst = answer.level in _WORST
    use = headline.use(answer.value, answer.allowable) if worst else 0.0
    return _level_rank(answer.level), -use


def _level_rank(level: Level) -> int:
    return _WORST.index(level) if level in _WORST else len(_WORST)


def verdicts(case: Case, summary: Mapping[str, Any]) -> list[Verdict]:
    """One verdict for each headline: that of the worst stage, with the figures of other stages in
    its sentence; warnings that are part of no headline follow those that need attention."""
    declared = {h.name: h for h in HEADLINES}
    by_name: dict[str, list[Mapping[str, Any]]] = {}
    for row in summary["headlines"]:
        # each check of the solution outside its limits has its own verdict
        alone = row["name"] == SOLUTION.name and row["level"] != "good"
        name = f"{row['name']} {row['figure']}" if alone else row["name"]
        by_name.setdefault(name, []).append(row)
    lines = [
        _verdict(declared[answers[0]["name"]], answers, len(case.stages) > 1)
        for answers in by_name.values()
    ]
    sentences = [row["sentence"] for row in summary["headlines"]]
    warnings = [text for text in summary["warnings"] if not any(text in s for s in sentences)]
    lines += [Verdict("watch", WARNING, "", text) for text in warnings]
    return sorted(lines, key=lambda line: _level_rank(line.level))


def _verdict(headline: Headline, rows: list[Mapping[str, Any]], several_stages: bool) -> Verdict:
    same_level = len({row["level"] for row in rows}) == 1
    worst, *others = sorted(rows, key=_severity(headline, rows)) if same_level else rows
    stage = words(worst["stage"]) if several_stages and worst["stage"] else ""
    others_text = "".join(f" {words(r['stage']).capitalize()}: {r['figure']}." for r in others)
    return Verdict(
        worst["level"],
        f"{headline.title}{f', {stage}' if stage else ''}",
        worst["figure"],
        f"{worst['sentence']}{others_text}",
        headline.section,
    )


def _severity(
    headline: Headline, rows: list[Mapping[str, Any]]
) -> Callable[[Mapping[str, Any]], float]:
    """Sort key of answers, worst first: by utilisation if all have an allowable, else by value."""
    have_allowable = all(row["allowable"] for row in rows)

    def key(row: Mapping[str, Any]) -> float:
        value = row["value"]
        if value is None:
            return math.inf
        if have_allowable:
            return -headline.use(value, row["allowable"])
        return float(value) if headline.is_least else -float(value)

    return key
