"""Pictures and report of a run, drawn by several processes."""

import re
import textwrap
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from flexgear.cli.display import Report
from flexgear.gears.power_flow import PowerFlow
from flexgear.model.case import Case
from flexgear.results.report.tables import case_tables, tables
from flexgear.results.report.wording import stage_line, with_unit, words
from flexgear.results.run_folder import Run, read_folder
from flexgear.solve.headlines import verdicts
from flexgear.studies.early_workers import EarlyWorkers
from flexgear.views import style
from flexgear.views.chart import Chart, Drawing, NotDrawn, planned
from flexgear.views.interactive import panels_of
from flexgear.views.report import Picture, Side, with_note, write_report
from flexgear.views.run_charts import DPI, RUN_CHARTS

TITLE_WIDTH = 85  # characters of a line


def draw(
    content: Run,
    source: Path,
    target: Path,
    report: Report,
    workers: EarlyWorkers,
    interactive: bool = True,
) -> list[str]:
    """Draw the pictures of the run in the folder ``source`` and write the report into ``target``;
    returns notes on omitted pictures."""
    side = drawn_side(content, source, target, report, workers)
    title = content.case.title or content.case.name
    write_report(target / "report.html", title, content.case.name, [side], interactive)
    report("pictures", 1.0)
    return list(side.notes)


def drawn_side(
    content: Run, source: Path, target: Path, report: Report, workers: EarlyWorkers
) -> Side:
    """Draw the pictures; returns their side of the report."""
    report("pictures", 0.0)
    pictures: dict[str, Picture] = {}
    _of_folders[source, target] = drawn = Pictures(content, target)
    try:
        for k, outcome in workers.completed(_picture, (source, target), drawn.names):
            # a picture that failed in another process is drawn here, which raises its error
            pictures[drawn.names[k]] = outcome.value or drawn.picture(drawn.names[k])
            report("pictures", len(pictures) / (len(drawn.names) + 1))
    finally:
        del _of_folders[source, target]
    ordered = [pictures[name] for name in drawn.plan]
    notes = [picture.caption for picture in ordered if picture.file is None][:1]
    if content.rings and not content.fields:
        notes = ["no 3D renders: no FE body is flexible"]
    with_files = [picture for picture in ordered if picture.file is not None]
    case, flow, summary = content.case, content.flow, content.summary
    return Side(
        name=case.title or case.name,
        lead=_lead(case, flow, summary),
        verdicts=verdicts(case, summary),
        tables=[*tables(case, flow, summary), *case_tables(case)],
        pictures=with_files,
        version=str(summary["version"]),
        content_hash=str(summary["content_hash"]),
        notes=notes,
    )


def _lead(case: Case, flow: PowerFlow, summary: Mapping[str, Any]) -> str:
    """Sentences on the case: stages, speeds, torques, analyses."""
    stages = "; ".join(f"{words(s.name).capitalize()}: {stage_line(case, s)}" for s in case.stages)
    ports = ", ".join(
        f"{words(name)} {with_unit(flow.speed[name], 'rad/s')}, {with_unit(torque, 'N m')}"
        for name, torque in flow.torque.items()
        if abs(flow.speed[name]) > 0
    )
    analyses = ["natural modes", "equilibria", "load sharing", "steady running in time"]
    drops = [with_unit(float(depth), "N m") for depth in summary["torque_steps"]]
    if drops:
        analyses.append("torque drops to " + ", ".join(drops))
    return (
        f"{stages}. {with_unit(flow.input_power, 'W')} in; {ports}. Bodies: {summary['variant']}. "
        f"Computed: {', '.join(analyses)}."
    )


@dataclass(frozen=True)
class Pictures:
    """Draws pictures of the run ``content``, by name, into the folder "pictures" of ``target``."""

    content: Run
    target: Path

    @cached_property
    def plan(self) -> dict[str, Chart]:
        """Planned pictures by name, in the order of the report."""
        return planned(self.content, RUN_CHARTS)

    @property
    def names(self) -> list[str]:
        """Names of all pictures, slow ones first."""
        return sorted(self.plan, key=lambda name: not self.plan[name].slow)

    def picture(self, name: str) -> Picture:
        """Draw one picture; an omitted picture has no file, and its caption has the reason."""
        chart = self.plan[name]
        path = self.target / "pictures" / f"{name}{chart.suffix}"
        path.parent.mkdir(parents=True, exist_ok=True)
        picture = Picture(name, chart.section, chart.caption, chart.sentence, path)
        try:
            drawn = chart.draw()
        except NotDrawn as error:
            return replace(picture, caption=str(error), file=None)
        if isinstance(drawn, Drawing):
            drawn.write(path)
            return replace(picture, plots=drawn.plots)
        sentence = with_note(chart.sentence, _title(drawn, chart.caption))
        style.save_figure(drawn, path, dpi=DPI)
        return replace(picture, sentence=sentence, plots=panels_of(drawn))


_of_folders: dict[tuple[Path, Path], Pictures] = {}  # by source and target, in each process


def _picture(folders: tuple[Path, Path], name: str) -> Picture:
    """Draw one picture in any process, which reads the run once. folders: source and target of
    ``draw``."""
    if folders not in _of_folders:
        _of_folders[folders] = Pictures(read_folder(folders[0]), folders[1])
    return _of_folders[folders].picture(name)


def _title(figure: Any, caption: str) -> str:
    """Set the title of a picture: its caption, whose figures stay beside their units, and the note
    that the chart has as title, which is returned, "" without one."""
    title = str(figure.get_suptitle())
    note = "" if title in caption else title
    lines = textwrap.wrap(re.sub(r"(?<=\d) (?=\S)", "\N{NO-BREAK SPACE}", caption), TITLE_WIDTH)
    figure.suptitle("\n".join(filter(None, [*lines, note])), fontsize=9, weight="bold")
    return note
