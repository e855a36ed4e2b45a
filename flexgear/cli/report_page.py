"""What ``report.html`` says of a run: its side of the page."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from flexgear.gears.power_flow import PowerFlow
from flexgear.model.case import Case
from flexgear.results.report.case_rows import case_tables
from flexgear.results.report.tables import tables
from flexgear.results.report.wording import stage_line, with_unit, words
from flexgear.solve.headlines import verdicts
from flexgear.views.report import Picture, Side


def side_of(
    case: Case,
    flow: PowerFlow,
    summary: Mapping[str, Any],
    pictures: Iterable[Picture],
    notes: Iterable[str] = (),
) -> Side:
    """All that the page says of one run."""
    return Side(
        name=case.title or case.name,
        lead=lead(case, flow, summary),
        verdicts=verdicts(case, flow, summary),
        tables=[*tables(case, flow, summary), *case_tables(case)],
        pictures=list(pictures),
        version=str(summary["version"]),
        content_hash=str(summary["content_hash"]),
        notes=list(notes),
    )


def lead(case: Case, flow: PowerFlow, summary: Mapping[str, Any]) -> str:
    """What was computed, on which machine."""
    stages = "; ".join(f"{words(s.name).capitalize()}: {stage_line(s)}" for s in case.stages)
    ports = ", ".join(
        f"{words(name)} {with_unit(abs(flow.speed[name]), 'rad/s')}, "
        f"{with_unit(abs(torque), 'N m')}"
        for name, torque in flow.torque.items()
        if abs(flow.speed[name]) > 0
    )
    did = ["natural modes", "equilibria", "load sharing", "steady running in time"]
    drops = [with_unit(float(depth), "N m") for depth in summary["torque_steps"]]
    if drops:
        did.append("torque drops to " + ", ".join(drops))
    return (
        f"{stages}. {with_unit(flow.input_power, 'W')} in; {ports}. Bodies: {summary['variant']}. "
        f"Computed: {', '.join(did)}."
    )
