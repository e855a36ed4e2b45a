"""``flexgear modify``: flank modifications for an even load along the face, or little noise."""

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer
from typer import Option

from flexgear.cli import options
from flexgear.cli.analysis import assembled
from flexgear.cli.display import columns, progress, show
from flexgear.model.case import Case
from flexgear.model.errors import InputError
from flexgear.results.origin import origin_of_case
from flexgear.results.report.wording import words
from flexgear.studies.modify import (
    LEAST_GAIN,
    TRIALS,
    Aim,
    Proposal,
    propose_modifications,
    require_slices,
)
from flexgear.views.face_load_charts import before_and_after
from flexgear.views.style import PICTURES, save_figure

COLUMNS = (  # of the table of flanks: heading, figure, decimals
    ("K_Hβ", "k_h_beta", 3),
    ("largest line load, N/mm", "largest_line_load_n_per_mm", 0),
    ("transmission error peak to peak, µm", "transmission_error_peak_to_peak_um", 2),
)
AIMS: tuple[Aim, ...] = ("line-load", "transmission-error")


@dataclass(frozen=True)
class Modification(options.CaseOptions):
    """Options of a proposal of flank modifications."""

    stage: Annotated[str | None, Option(help="Stage; the first planetary one.")] = None
    aim: Annotated[
        str, Option("--for", help="Quantity to minimise: line-load or transmission-error.")
    ] = "line-load"
    torque_share: Annotated[
        list[float] | None, Option(help="Share of rated torque; repeatable, the worst counts.")
    ] = None
    relief: Annotated[bool, Option("--relief", help="Tip relief of the planets, too.")] = False
    trials: Annotated[int, Option(min=2, help="Series of equilibria for each amount.")] = TRIALS
    picture: Annotated[
        Path | None, Option(help="Load along the face before and after (.png, .svg, .pdf).")
    ] = None
    rigid: options.Rigid = None

    @property
    def known_aim(self) -> Aim:
        """The aim; InputError unless it is one of ``AIMS``."""
        aim = next((a for a in AIMS if a == self.aim), None)
        if aim is None:
            remedy = f"use {' or '.join(AIMS)}"
            raise InputError("modify", "--for", f"{self.aim!r} is unknown", remedy)
        return aim

    @property
    def shares(self) -> tuple[float, ...]:
        """Shares of the rated torque; InputError for impossible ones."""
        shares = tuple(self.torque_share or (1.0,))
        if not all(0.0 < share <= 10.0 for share in shares):
            problem = "is not above 0 and at most 10"
            raise InputError("modify", "--torque-share", problem, "e.g. 1.0")
        return shares


def modify(modification: Modification) -> None:
    """Propose helix slope and crowning of the planets' flanks under load, as keys to copy."""
    source, picture = modification.read_case(), modification.picture
    parts = options.rigid_parts(modification.rigid, source)
    name = _stage(source, modification.stage)
    aim, shares = modification.known_aim, modification.shares
    if picture is not None and picture.suffix.lower().lstrip(".") not in PICTURES:
        problem = f"{picture} has no suffix of a picture"
        raise InputError("modify", "--picture", problem, f"use .{', .'.join(PICTURES)}")
    options.claim_file(picture, origin_of_case(source), modification.force)
    require_slices(source, name)  # before the reduction of bodies
    with progress(modification.quiet) as report:
        model = assembled(source, parts, report)
        proposal = propose_modifications(
            model, name, shares=shares, aim=aim, relief=modification.relief,
            trials=modification.trials, progress=report,
        )  # fmt: skip
    if picture is not None:
        options.save_or_rescue(partial(save_figure, before_and_after(*proposal.data)), picture)
    words = partial(_show, proposal, keys_to_copy(source, name, proposal))
    show(_figures(proposal), words, modification.as_json)


def _show(proposal: Proposal, keys: str) -> None:
    """Print the figures of every flank before and after, and the keys of the proposal."""
    for share, flanks in proposal.before.items():
        typer.echo(f"\nbefore → after, at {100 * share:g} % of the rated torque")
        rows = [("gear mesh", *(heading for heading, _, _ in COLUMNS))]
        for flank, old in flanks.items():
            new = proposal.after[share][flank]
            ends = (f"{old[k]:.{d}f} → {new[k]:.{d}f}" for _, k, d in COLUMNS)
            rows.append((words(flank), *ends))
        columns(rows)
    if proposal.before == proposal.after:
        typer.echo(f"\nno change gains {100 * LEAST_GAIN:g} %: the flanks stay as they are")
    typer.echo(f"\nkeys to copy ({proposal.trials} series of equilibria):\n\n{keys}")


def keys_to_copy(case: Case, stage: str, proposal: Proposal) -> str:
    """The proposal as TOML sections below a stage."""
    table = "stage" if [s.name for s in case.stages] == ["stage"] else "stages"
    sections: dict[str, list[str]] = {}
    for key, amount in proposal.amounts.items():
        section, _, name = key.rpartition(".")
        sections.setdefault(section, []).append(f"{name}_um = {amount * 1e6:.4g}")
        if name == "amount":
            relief = proposal.reliefs[section]
            begins = {n: getattr(relief, n) for n in ("length", "start_diameter")}
            sections[section] += [
                *(f"{n}_mm = {1e3 * x:.6g}" for n, x in begins.items() if x is not None),
                f'form = "{relief.form}"',
            ]
    lines = [] if table == "stage" else [f"# below the [[stages]] named {stage!r}"]
    for section, entries in sections.items():
        lines += [f"[{table}.{section}]", *entries, ""]
    return "\n".join(lines)


def _figures(proposal: Proposal) -> dict[str, Any]:
    return {
        "amounts_um": {key: 1e6 * amount for key, amount in proposal.amounts.items()},
        "before": {f"{share:g}": figure for share, figure in proposal.before.items()},
        "after": {f"{share:g}": figure for share, figure in proposal.after.items()},
        "trials": proposal.trials,
    }


def _stage(case: Case, name: str | None) -> str:
    """The named stage, or the first planetary one; InputError for an unknown name."""
    names = [s.name for s in case.stages]
    if name is None:
        return next((s.name for s in case.stages if s.kind != "parallel"), names[0])
    if name not in names:
        raise InputError(
            "modify", "--stage", f"{name!r} is not a stage", f"name one of {', '.join(names)}"
        )
    return name
