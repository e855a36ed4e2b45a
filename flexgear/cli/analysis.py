"""Options, model and output that commands for one analysis of a case share."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from typing import Any

import xarray as xr

from flexgear.cli import options
from flexgear.cli.display import Report, progress, show, warn
from flexgear.model.case import Case
from flexgear.results.dataset_file import save as save_dataset
from flexgear.results.origin import origin_of_case
from flexgear.solve.bodies import reduced_bodies, rigid_bodies
from flexgear.solve.model import Model, assemble
from flexgear.solve.reduction_warnings import reduction_warnings


@dataclass(frozen=True)
class Analysis(options.CaseOptions):
    """Options of an analysis of one case."""

    rigid: options.Rigid = None
    out: options.OutFile = None

    def read(self, *, loaded: bool = True, pictured: bool = False) -> tuple[Case, tuple[str, ...]]:
        """The case and its rigid parts. InputError if the dataset, or a picture beside it, would
        replace another file."""
        case = self.read_case(loaded=loaded)
        parts = options.rigid_parts(self.rigid, case)
        options.claim_file(self.out, origin_of_case(case), self.force)
        # a picture beside an earlier dataset belongs to it and may be replaced with it
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
            yield assembled(case, parts, report), report

    def save(self, data: xr.Dataset, chart: Callable[[xr.Dataset], Any] | None = None) -> None:
        """Write the dataset, and its picture beside it, if ``--out`` names a file."""
        if self.out is None:
            return
        options.save_or_rescue(partial(save_dataset, data), self.out)
        if chart is not None:
            from flexgear.views.style import save_figure

            save_figure(chart(data), self.out.with_suffix(".png"), dpi=150)

    def show(self, figures: Any, words: Callable[[], None]) -> None:
        """Print figures as JSON, or by ``words`` with the path of the dataset."""
        show(figures, words, self.as_json, self.out)


def assembled(case: Case, rigid: tuple[str, ...], report: Report) -> Model:
    """The coupled model of a case; rigid: parts of its flexible stages to make rigid."""
    variant = rigid_bodies(case, rigid)
    model = assemble(case, bodies=reduced_bodies(case, report, variant), variant=variant)
    warn(reduction_warnings(case, model.bodies, variant))
    return model
