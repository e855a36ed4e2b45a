"""A command that solves one case: its options, its model, and how its results come out."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from typing import Any

import xarray as xr

from flexgear.cli import options
from flexgear.cli.display import Report, progress, show, warn
from flexgear.model.case import Case
from flexgear.results.dataset_file import save
from flexgear.results.origin import origin_of_case
from flexgear.solve.bodies import reduced_bodies, rigid_bodies
from flexgear.solve.model import Model, assemble
from flexgear.solve.result_warnings import reduction_warnings


@dataclass(frozen=True)
class Analysis(options.CaseOptions):
    """Options of an analysis of one case."""

    rigid: options.Rigid = None
    out: options.OutFile = None

    def read(self, *, loaded: bool = True, pictured: bool = False) -> tuple[Case, tuple[str, ...]]:
        """The case and its rigid parts; that dataset and picture may be written is checked."""
        case = self.read_case(loaded=loaded)
        parts = options.rigid_parts(self.rigid, case)
        options.claim_file(self.out, origin_of_case(case), self.force)
        # a picture that stands beside an earlier dataset is of that
        if pictured and self.out is not None and not self.out.exists():
            options.claim_file(self.out.with_suffix(".png"), origin_of_case(case), self.force)
        return case, parts

    @contextmanager
    def model(
        self, *, loaded: bool = True, pictured: bool = False
    ) -> Iterator[tuple[Model, Report]]:
        """Assemble the coupled model of the case and show a progress bar while the block runs;
        yields the model and the function that moves the bar."""
        case, parts = self.read(loaded=loaded, pictured=pictured)
        with progress(self.quiet) as report:
            yield put_together(case, parts, report), report

    def keep(self, data: xr.Dataset, chart: Callable[[xr.Dataset], Any] | None = None) -> None:
        """Write the dataset, with its picture beside it, if a file was named."""
        if self.out is None:
            return
        options.save_or_rescue(partial(save, data), self.out)
        if chart is not None:
            from flexgear.views.style import save_figure

            save_figure(chart(data), self.out.with_suffix(".png"), dpi=150)

    def show(self, figures: Any, words: Callable[[], None]) -> None:
        """Print figures as JSON, or by ``words`` and where the dataset is."""
        show(figures, words, self.as_json, self.out)


def put_together(case: Case, rigid: tuple[str, ...], report: Report) -> Model:
    """The coupled model of a case with these parts of its flexible stages rigid."""
    variant = rigid_bodies(case, rigid)
    model = assemble(case, bodies=reduced_bodies(case, report, variant), variant=variant)
    warn(reduction_warnings(case, model.bodies, variant))
    return model
