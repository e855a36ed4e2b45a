"""Declaration of pictures of a run, and their subjects: the run, a stage, an FE ring, a flank …"""

import itertools
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from flexgear.gears.paths import GearFlank, modified_flanks, stage_paths
from flexgear.model.errors import FlexgearError
from flexgear.results.report.wording import of_stage, window_words, with_unit
from flexgear.results.run_folder import Run, StageOfRun, prefix_of
from flexgear.results.settling import window_of
from flexgear.results.time_figures import displacement_summary
from flexgear.results.tooth_pattern import loaded_flanks

MODIFICATION_POINTS = 101  # along each axis, at which flanks of a gear are compared


class NotDrawn(FlexgearError):
    """Reason why a picture is omitted."""


class Drawing(NamedTuple):
    """A picture that is no matplotlib figure. write: function that writes it to a path; plots:
    plotly panels that replace it on a screen."""

    write: Callable[[Path], object]
    plots: Sequence[Mapping[str, Any]]


class Subject(NamedTuple):
    """Subject of one picture. words: values of the placeholders in names and captions; of:
    arguments of the drawing function."""

    words: Mapping[str, str]
    of: tuple[Any, ...] = ()


Subjects = Callable[[Run], Iterable[Subject]]


@dataclass(frozen=True)
class Chart:
    """One kind of picture of a run.

    name: of the file, without suffix; section, caption, sentence: place in the report and content
    in words; draw: function of the dataset ``data``, if one is named, and the arguments of the
    subject, which returns a figure or a ``Drawing``; variable: of the dataset, needed for the
    picture; slow: drawn before the others and shown after them; suffix: of the file. name, caption
    and data may have placeholders for the words of a subject.
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

    def sources(self, run: Run, words: Mapping[str, str]) -> tuple[Any, ...] | None:
        """The dataset to draw, () if none is named; None if the run has no such picture."""
        if not self.data:
            return ()
        data = run.datasets.get(self.data.format(**words))
        return None if data is None or (self.variable and self.variable not in data) else (data,)


def planned(run: Run, charts: Iterable[tuple[Subjects, Sequence[Chart]]]) -> dict[str, Chart]:
    """Pictures of a run by file name, those that take long last: one chart for each subject, such
    as a stage, with its name, caption and data filled in, so that ``draw`` takes no arguments."""
    plan: dict[str, Chart] = {}
    for subjects, subject_charts in charts:
        for subject, chart in itertools.product(subjects(run), subject_charts):
            sources = chart.sources(run, subject.words)
            if sources is not None:
                name, caption = (x.format(**subject.words) for x in (chart.name, chart.caption))
                draw = partial(chart.draw, *sources, *subject.of)
                plan[name] = replace(chart, name=name, caption=caption, draw=draw)
    return dict(sorted(plan.items(), key=lambda item: item[1].slow))


def having(subjects: Subjects, condition: Callable[..., object]) -> Subjects:
    """Function of a run that yields the subjects whose arguments fulfil a condition."""
    return lambda run: (subject for subject in subjects(run) if condition(*subject.of))


def runs(run: Run) -> Iterator[Subject]:
    """The run itself, for charts that draw only a dataset."""
    yield Subject({"window": _window(run)})


def runs_that_move(run: Run) -> Iterator[Subject]:
    """The run itself, if a central member leaves its axis in the transient. For a single dataset,
    which has no summary, all samples are searched."""
    if "transient" in run.summary:
        largest = run.summary["transient"]["displacement_um_max"]
    else:
        largest = displacement_summary(run.datasets["transient"])
    if any(largest.values()):
        yield from runs(run)


def trains(run: Run) -> Iterator[Subject]:
    """The train, with its power flow."""
    yield Subject({}, (run.flow,))


def bearing_lives(run: Run) -> Iterator[Subject]:
    """Lives of the bearings of all stages by stage and name, if the summary has any."""
    stages, key = run.summary["stages"].items(), "bearing_life_h"
    lives = {stage: section[key] for stage, section in stages if key in section}
    if lives:
        yield Subject({}, (lives,))


def stages(run: Run) -> Iterator[Subject]:
    """Every stage; in titles {hz} stands for its gear-mesh frequency, Hz."""
    for stage in run.flow.stages:
        hz = f"{stage.gear_mesh_frequency:.5g}"
        yield Subject({**_words(run, stage.name), "hz": hz}, (StageOfRun(run, stage.name),))


def flanks(run: Run) -> Iterator[Subject]:
    """Modified flanks, each with the title of its stage; one for equal flanks of a gear."""
    for stage in run.case.stages:
        view, words = run.case.view(stage.name), _words(run, stage.name)
        paths = stage_paths(view, run.flow.stage(stage.name).gear_mesh_forces)
        alike: dict[tuple[str, ...], list[GearFlank]] = {}
        for flank in modified_flanks(view, paths):
            surface = (repr(x.tolist()) for x in flank.surface(MODIFICATION_POINTS))
            alike.setdefault((flank.part, *surface), []).append(flank)
        for first, *others in alike.values():
            flank = replace(first, name=" and ".join(f.name for f in (first, *others)))
            more = {"part": flank.part, "flank": flank.name.replace(" ", "_"), "flanks": flank.name}
            yield Subject(words | more, (flank, words["Stage"]))


def tooth_sets(run: Run) -> Iterator[Subject]:
    """Groups of loaded gear meshes whose pairs have slices."""
    equilibria = run.datasets["equilibrium"]
    if "gear_mesh_misalignment_by_cause" not in equilibria:
        return
    for group in loaded_flanks(equilibria):
        teeth = group.part.replace(" ", "_")
        more = {"teeth": teeth, "teeth_words": group.replace("_", " ")}
        yield Subject(_words(run, group.stage) | more, (group,))


def rings(run: Run) -> Iterator[Subject]:
    """FE rings; words prefix: of file names, ring: of captions."""
    for ring in run.rings:
        words, prefix = _words(run, ring.name), prefix_of(ring.name)
        title = f"{words['Stage']}: " if prefix else ""
        title += "left half: " if ring.view.stage.double_helical else ""
        title = title[:1].upper() + title[1:]
        yield Subject(words | {"prefix": prefix, "ring": title}, (ring,))


def torque_drops(run: Run) -> Iterator[Subject]:
    """FE rings in every torque drop: ring and torque after the drop."""
    for subject in rings(run):
        for depth in run.summary["torque_steps"]:
            more = {"depth": depth, "torque": with_unit(float(depth), "N m")}
            yield Subject({**subject.words, **more}, (*subject.of, depth))


def fields(run: Run) -> Iterator[Subject]:
    """Displacement fields of FE bodies: title of the body, field, number of fields of the run."""
    for body, field in run.fields.items():
        title = body.part.capitalize() + of_stage(body.stage)
        words = {"prefix": prefix_of(body.stage), "body": body.part, "Body": title}
        words["deformed"] = title.lower()
        yield Subject(words, (title, field, len(run.fields)))


def _words(run: Run, stage: str) -> dict[str, str]:
    """Words for the placeholders of charts of a stage."""
    plain = stage.replace("_", " ")
    return {
        "stage": stage,
        "Stage": plain.capitalize(),
        "plain": plain,
        "of": of_stage(stage),
        "window": _window(run),
        "windows": _windows(run),
    }


def _window(run: Run, name: str = "transient") -> str:
    """Window of a transient in words; empty without this transient."""
    transient = run.datasets.get(name)
    return "" if transient is None else window_words(window_of(transient).figures)


def _windows(run: Run) -> str:
    """Window of the transient in words, and that with rigid bodies where it is another."""
    first, rigid = _window(run), _window(run, "transient_rigid")
    return first if rigid in ("", first) else f"{first}; rigid bodies {rigid}"
