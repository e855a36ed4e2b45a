"""The case for scripts and notebooks, with methods that assemble, run and rate it."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from pydantic import ValidationError

from flexgear.face.notebook import Progress, html_table, progress_or_bars
from flexgear.model import case, load
from flexgear.model.arguments import checked
from flexgear.model.content import resolve_files
from flexgear.model.errors import InputError, echo
from flexgear.model.names import BodyName
from flexgear.model.read import Written, lists_of, match_key, to_si
from flexgear.model.validation_errors import input_error
from flexgear.results.report.wording import stage_line

if TYPE_CHECKING:
    from flexgear.face.model import Model
    from flexgear.face.runs import Rating
    from flexgear.results.run_folder import Run
    from flexgear.structures.reduced import ReducedBody


class Case(case.Case):
    """A whole gearbox, frozen, in SI.

    ``load_case`` reads a file; ``Case(material={...}, stage={...}, ...)`` takes the keys of a file,
    several stages as ``stages=[{...}, {...}]``, with their units (``face_width_mm=40``) or without
    in SI (``face_width=0.04``), and parts of other cases (``material=other.material``). InputError
    names what is wrong.
    """

    def __init__(self, *unnamed: object, **fields: object) -> None:
        where, written = "flexgear.Case()", Written()
        if unnamed:
            problem, remedy = (
                "comes without a key",
                "give material=…, stage=…; load_case reads files",
            )
            raise InputError(where, echo(unnamed[0]), problem, remedy)
        for key in fields:
            if key != "stage":
                match_key(case.Case, key, where, key, bare_si=True)
        stated = {key: lists_of(value) for key, value in fields.items() if value is not None}
        data = to_si(case.Case, load.with_list(stated, where), where, written, bare_si=True)
        resolve_files(data, Path())
        try:
            super().__init__(**{"source": where, **data})
        except ValidationError as fault:
            raise input_error(case.Case, fault, where, written) from None

    @classmethod
    def of(cls, plain: case.Case) -> Case:
        """The case with the methods of this class."""
        return cls.model_construct(plain.model_fields_set, **dict(plain))

    @checked
    def with_(self, **changes: object) -> Case:
        """A copy with SI values changed, validated again.

        Keys are field paths without units, joined by "." or "__"; stages by number or name, or
        "stage" if there is one, whose keys need no "stage.":
        ``with_(planets=4)``, ``with_(**{"stages.two.face_width": 0.1})``.
        """
        return Case.of(super().with_(**changes))

    @checked
    def assemble(
        self,
        rigid: str | Sequence[str] = (),
        *,
        bodies: Mapping[str, ReducedBody] | None = None,
        progress: Progress | None = None,
    ) -> Model:
        """The coupled model, with FE bodies meshed and reduced or read from the cache.

        rigid: bodies that are rigid: "ring", "carrier", "planet", "shaft" of all flexible stages,
        "stage_1.ring", or "all". bodies: reduced bodies by name in the place of all flexible ones,
        {"stage.ring": body}. progress: called with a stage of the work and the share of it that is
        done; notebooks show bars without it. InputError for a case that cannot work: gears that do
        not mesh, bodies that cannot be meshed, members without support.
        """
        from flexgear.face.model import assembled

        parts = (rigid,) if isinstance(rigid, str) else tuple(rigid)
        named = None if bodies is None else {BodyName.parse(n): b for n, b in bodies.items()}
        return assembled(self, parts, bodies=named, progress=progress_or_bars(progress))

    @checked
    def run(
        self,
        out: str | Path | None = None,
        *,
        force: bool = False,
        progress: Progress | None = None,
    ) -> Run:
        """All analyses with and without errors, flexible and rigid, as ``flexgear run``.

        out: folder for datasets, ``case.json`` and ``summary.json``, from which ``report`` makes
        pictures and a page; force: replace files there that are not from a run of this case.
        """
        from flexgear.face.runs import run_case

        return run_case(self, out, force, progress_or_bars(progress))

    @checked
    def rate(
        self,
        out: str | Path | None = None,
        *,
        force: bool = False,
        workers: int | None = None,
        progress: Progress | None = None,
    ) -> Rating:
        """Safety, damage and life of flanks, roots and bearings under the case's load cases, as
        ``flexgear rate``.

        out: folder for figures, dataset, table and page; force: replace files there that are not
        from a rating of this case; workers: number of processes that share the load cases, chosen
        by their number if left out. Ratings for which the case lacks data are listed as not
        assessed. InputError for load cases that contradict the train.
        """
        from flexgear.face.runs import rate_case

        return rate_case(self, out, force, workers, progress_or_bars(progress))

    def _repr_html_(self) -> str:
        stages = {stage.name: stage_line(self, stage) for stage in self.stages}
        ports = ", ".join(port.member for port in self.ports)
        return html_table({"case": self.title or self.name, **stages, "ports": ports})


def load_case(
    source: str | Path | case.Case,
    overrides: Mapping[str, object] | None = None,
    **keys: object,
) -> Case:
    """A case from a TOML file, a bundled case by name, or another case, with keys changed.

    keys, overrides: values by the keys of the file, with their units, which replace those of the
    file; None removes a key. "__" stands for "."; keys of a case's only stage also without its
    name: ``load_case("wind-5mw", planets=5, solver__fidelity="quick")``. InputError, in one line,
    for anything that is wrong.
    """
    dotted = {key.replace("__", "."): key for key in keys}
    changes = {**(overrides or {}), **{key: keys[name] for key, name in dotted.items()}}
    try:
        return Case.of(load.load_case(source, changes))
    except InputError as fault:
        keywords = [key for key in dotted if f".{fault.key}".endswith(f".{key}")]
        if fault.where != "--set" or not keywords:
            raise
        path = re.compile(rf"\w+(\.\w+)*\.{re.escape(fault.key.rpartition('.')[2])}\b")
        remedy = path.sub(lambda x: x[0].replace(".", "__"), fault.remedy)
        raise InputError(fault.where, dotted[keywords[0]], fault.problem, remedy) from None
