"""How a picture of a run is declared, and its subjects: the run, a stage, an FE ring, a flank …"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from flexgear.gears.paths import modified_flanks, stage_paths
from flexgear.gears.power_flow import StageFlow
from flexgear.model.errors import FlexgearError
from flexgear.model.stage_view import StageView
from flexgear.results.quantities import Figure
from flexgear.results.report.wording import of_stage, window_words, with_unit
from flexgear.results.run_folder import Folder, prefix_of
from flexgear.results.settling import window_of
from flexgear.results.stage_figures import root_extremes
from flexgear.results.tooth_pattern import carrying_sets


class NotDrawn(FlexgearError):
    """Why a picture is left out, in words."""


class Drawing(NamedTuple):
    """A picture that is more than a figure. write: its file; plots: plotly panels that replace it
    on a screen."""

    write: Callable[[Path], object]
    plots: Sequence[Mapping[str, Any]]


class Subject(NamedTuple):
    """Subject of one picture. words: replace braces in names and captions; of: arguments of its
    drawing function."""

    words: Mapping[str, str]
    of: tuple[Any, ...] = ()


Subjects = Callable[[Folder], Iterable[Subject]]


@dataclass(frozen=True)
class Chart:
    """One kind of picture of a run.

    name: of the file, without suffix; section, caption, sentence: its place in the report and what
    it shows, in name, caption and data with the words of a subject in braces; draw: makes a figure
    or a ``Drawing`` of the dataset ``data``, if it is named, and of what the subject is of;
    variable: of the dataset, without which there is no picture; slow: is begun before the others
    and stands after them; suffix: of the file.
    """

    name: str
    section: str
    caption: str
    sentence: str
    draw: Callable[..., Any]
    data: str = ""
    variable: str = ""
    slow: bool = False
    suffix: str = ".png"

    def sources(self, run: Folder, words: Mapping[str, str]) -> tuple[Any, ...] | None:
        """The dataset that is drawn, empty where none is named; None where there is no picture."""
        if not self.data:
            return ()
        data = run.datasets.get(self.data.format(**words))
        return None if data is None or (self.variable and self.variable not in data) else (data,)


class Planned(NamedTuple):
    """A picture that a run has, with what its chart draws."""

    chart: Chart
    caption: str
    arguments: tuple[Any, ...]

    def draw(self) -> Any:
        """The picture, drawn: a matplotlib figure, or what saves a rendered scene as a file."""
        return self.chart.draw(*self.arguments)


def planned(run: Folder, charts: Iterable[tuple[Subjects, Sequence[Chart]]]) -> dict[str, Planned]:
    """Pictures of a run by file name: of every subject those of its charts, slow ones last."""
    plan: dict[str, Planned] = {}
    for subjects, of_each in charts:
        for subject, chart in itertools.product(subjects(run), of_each):
            sources = chart.sources(run, subject.words)
            if sources is not None:
                name, caption = (x.format(**subject.words) for x in (chart.name, chart.caption))
                plan[name] = Planned(chart, caption, (*sources, *subject.of))
    return dict(sorted(plan.items(), key=lambda item: item[1].chart.slow))


def having(subjects: Subjects, condition: Callable[..., object]) -> Subjects:
    """Subjects whose data fulfil a condition."""
    return lambda run: (subject for subject in subjects(run) if condition(*subject.of))


def runs(run: Folder) -> Iterator[Subject]:
    """The run itself; draws take nothing but a dataset."""
    yield Subject({"window": _window(run)})


def trains(run: Folder) -> Iterator[Subject]:
    """The train, by its power flow."""
    yield Subject({}, (run.flow,))


def figures(figure: Figure, run: Folder) -> Iterator[Subject]:
    """A figure of stages in the summary, by stage, if any has it."""
    stages = run.summary["stages"].items()
    key = figure.names[0]
    by_stage = {stage: section[key] for stage, section in stages if key in section}
    if by_stage:
        yield Subject({}, (by_stage,))


@dataclass(frozen=True)
class StageOfRun:
    """A stage of a run as charts take it: run and name, with what follows from both."""

    run: Folder
    name: str

    @property
    def view(self) -> StageView:
        """The stage of the case."""
        return self.run.case.view(self.name)

    @property
    def flow(self) -> StageFlow:
        """Speeds, torques and forces of the stage."""
        return self.run.flow.stage(self.name)

    @property
    def is_shared(self) -> bool:
        """Whether its planets share a load."""
        shared = self.run.datasets["transient"]["group_stage"].to_numpy()
        return self.flow.kind == "planetary" and self.name in shared

    @property
    def has_roots(self) -> bool:
        """Whether there is stress in the roots of its teeth."""
        return bool(root_extremes(self.run.datasets["equilibrium"], self.name))


def stages(run: Folder) -> Iterator[Subject]:
    """Every stage; hz: how often its gears mesh."""
    for stage in run.flow.stages:
        hz = f"{stage.gear_mesh_frequency:.5g}"
        yield Subject({**_words(run, stage.name), "hz": hz}, (StageOfRun(run, stage.name),))


def flanks(run: Folder) -> Iterator[Subject]:
    """Modified flanks, and the title of their stage."""
    for stage in run.case.stages:
        view, words = run.case.view(stage.name), _words(run, stage.name)
        paths = stage_paths(view, run.flow.stage(stage.name).gear_mesh_forces)
        for flank in modified_flanks(view, paths):
            more = {"part": flank.part, "flank": flank.name}
            yield Subject(words | more, (flank, words["Stage"]))


def tooth_sets(run: Folder) -> Iterator[Subject]:
    """Gear meshes that carry and whose pairs have slices: stage, kind and side."""
    equilibria = run.datasets["equilibrium"]
    if "gear_mesh_misalignment_by_cause" not in equilibria:
        return
    for stage in run.case.stages:
        for kind, side in carrying_sets(equilibria, stage.name):
            teeth = f"{kind}_{side}".rstrip("_")
            more = {"teeth": teeth, "teeth_words": f"{stage.name}_{teeth}".replace("_", " ")}
            yield Subject(_words(run, stage.name) | more, (stage.name, kind, side))


def rings(run: Folder) -> Iterator[Subject]:
    """FE rings; prefix: of names, ring: of captions."""
    for ring in run.rings:
        words, half = _words(run, ring.name), ring.stage.stage.double_helical
        title = f"{words['Stage']}: " if ring.prefix else ""
        title += "left half: " if half else ""
        yield Subject(words | {"prefix": ring.prefix, "ring": title}, (ring,))


def torque_drops(run: Folder) -> Iterator[Subject]:
    """FE rings in every torque drop: ring and depth."""
    for subject in rings(run):
        for depth in run.summary["torque_steps"]:
            more = {"depth": depth, "torque": with_unit(float(depth), "N m")}
            yield Subject({**subject.words, **more}, (*subject.of, depth))


def fields(run: Folder) -> Iterator[Subject]:
    """Displacement fields of FE bodies: body, field, and among how many."""
    for body, field in run.fields.items():
        title = body.part.capitalize() + of_stage(body.stage)
        words = {"prefix": prefix_of(body.stage), "body": body.part, "Body": title}
        words["deformed"] = title.lower()
        yield Subject(words, (title, field, len(run.fields)))


def _words(run: Folder, stage: str) -> dict[str, str]:
    plain = stage.replace("_", " ")
    return {
        "stage": stage,
        "Stage": plain.capitalize(),
        "plain": plain,
        "of": of_stage(stage),
        "window": _window(run),
    }


def _window(run: Folder) -> str:
    """Part of the transient that figures are of; empty of a case without a run."""
    transient = run.datasets.get("transient")
    return "" if transient is None else window_words(window_of(transient).figures)
