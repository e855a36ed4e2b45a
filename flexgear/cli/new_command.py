"""``flexgear new``: a case of new stages, sized by rules of thumb from a few numbers."""

import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, TypeVar

import typer
from typer import Argument, Option

from flexgear.cli import options
from flexgear.files.atomic import write_bytes
from flexgear.files.case_text import Rated
from flexgear.gears.sizing import ARRANGEMENTS, Proposal, StageRequest
from flexgear.model.errors import InputError
from flexgear.model.read import nearest
from flexgear.model.units import RPM
from flexgear.studies.proposal import proposed_case

T = TypeVar("T")


@dataclass(frozen=True)
class NewStages:
    """Options of ``flexgear new``: the file and the data of the stages."""

    out: Annotated[Path, Argument(metavar="FILE", help="The case to write.")]
    ratio: Annotated[
        str | None, Option(metavar="X[,X]", help="Ratio of each stage, the slowest first.")
    ] = None
    planets: Annotated[
        str | None, Option(metavar="N[,N]", help="Planets of each stage, or of all.")
    ] = None
    torque: Annotated[
        float | None, Option("--torque-nm", help="Rated torque of the slow end, driven.")
    ] = None
    speed: Annotated[float | None, Option("--speed-rpm", help="Rated speed of the slow end.")] = (
        None
    )
    sun_torque: Annotated[
        float | None, Option("--sun-torque-nm", help="Rated torque of the last sun instead.")
    ] = None
    sun_speed: Annotated[
        float | None, Option("--sun-speed-rpm", help="Rated speed of the last sun instead.")
    ] = None
    arrangement: Annotated[
        str, Option(metavar="NAME[,NAME]", help="planetary, star (carrier held), solar (sun held).")
    ] = "planetary"
    module: Annotated[
        str | None,
        Option("--module-mm", metavar="M[,M]", help="Normal module; follows if left out."),
    ] = None
    helix: Annotated[
        str | None,
        Option(
            "--helix-deg",
            metavar="DEG[,DEG]",
            help="Helix angle; 0 if left out, of two halves 25.",
        ),
    ] = None
    double: Annotated[bool, Option("--double-helical", help="Two halves of opposite hand.")] = False
    force: options.ForceNew = False

    def requests(self) -> list[StageRequest]:
        """Requests of the stages without torques and speeds; asks on a terminal for missing ratios
        and numbers of planets."""
        about = "speed of the fast over that of the slow member"
        ratios = _asked_list("--ratio", about, self.ratio, "4.5")
        helix = self.helix or ("25" if self.double else "0")
        modules = None if self.module is None else _list("--module-mm", self.module)
        columns: dict[str, list[Any]] = {
            "--arrangement": [_kind(word) for word in self.arrangement.split(",")],
            "--planets": [
                *map(_whole, _asked_list("--planets", "number of planets", self.planets, "4"))
            ],
            "--module-mm": [None] if modules is None else [1e-3 * m for m in modules],
            "--helix-deg": [*map(math.radians, _list("--helix-deg", helix, least=0.0))],
        }
        by_stage = (_each(key, column, len(ratios)) for key, column in columns.items())
        return [
            StageRequest(ratio, n, math.nan, math.nan, angle, module, self.double, kind)
            for ratio, kind, n, module, angle in zip(ratios, *by_stage, strict=True)
        ]

    def rated(self, kinds: Sequence[str]) -> Rated:
        """Rated torque and speed of the slow end, or of the sun of the last stage. InputError for
        options of both ends."""
        at_sun = self.sun_torque is not None or self.sun_speed is not None
        if at_sun and not (self.torque is None and self.speed is None):
            key = "--speed-rpm" if self.torque is None else "--torque-nm"
            other = "--sun-speed-rpm" if self.sun_torque is None else "--sun-torque-nm"
            problem = f"is of the slow end, and {other} of the sun"
            raise InputError("new", key, problem, "give torque and speed of one end")
        if at_sun and kinds[-1] == "solar":
            remedy = "give torque and speed of the slow end"
            raise InputError("new", "--sun-torque-nm", "is that of a held sun", remedy)
        member, flag = ("last sun", "sun-") if at_sun else (ARRANGEMENTS[kinds[0]].slow, "")
        torque = self.sun_torque if at_sun else self.torque
        speed = self.sun_speed if at_sun else self.speed
        torque = _asked(f"--{flag}torque-nm", f"rated torque of the {member}, N m", torque, 1e4)
        speed = _asked(f"--{flag}speed-rpm", f"rated speed of the {member}, r/min", speed, 100.0)
        return Rated(torque, speed / RPM, at_sun)


def new(stages: NewStages) -> None:
    """Propose planetary stages for a ratio, torque and speed, as a commented case.

    A ratio is the speed of the fast over that of the slow member: sun over carrier of a planetary
    stage, sun over ring of a star, ring over carrier of a solar one. Several make a chain: each
    stage's fast member drives the next one's slow member, or is driven by it. Missing options are
    asked for on a terminal.
    """
    out = stages.out
    options.require_new(out, "new", stages.force)
    requests = stages.requests()
    text, proposals = proposed_case(requests, stages.rated([r.arrangement for r in requests]))
    write_bytes(out, options.with_schema(text, out))
    summary = "; ".join(map(_proposal_text, proposals))
    typer.echo(f"wrote {out}: {summary}; next: flexgear check {out}")


def _proposal_text(p: Proposal) -> str:
    """Tooth numbers, module and ratio of a stage in words."""
    teeth = "/".join(str(p.gear_set.gears[role].teeth) for role in ("sun", "planet", "ring"))
    kind = "" if p.request.arrangement == "planetary" else f"{p.request.arrangement} of "
    return f"{kind}{teeth} teeth of module {1e3 * p.module:g} mm, ratio {p.ratio:.5g}"


def _kind(word: str) -> str:
    """The name of an arrangement; InputError unless it is one of ``ARRANGEMENTS``."""
    name = word.strip()
    if name not in ARRANGEMENTS:
        remedy = nearest(name, list(ARRANGEMENTS))
        raise InputError("new", "--arrangement", f"{name!r} is unknown", remedy)
    return name


def _each(option: str, values: Sequence[T], stages: int) -> list[T]:
    """A value for each stage, repeated if there is only one; InputError for another number."""
    if len(values) == 1:
        return [*values] * stages
    if len(values) != stages:
        problem = f"{len(values)} values for {stages} ratios"
        raise InputError("new", option, problem, "give one for each stage, or one for all")
    return [*values]


def _list(option: str, text: str, least: float = math.nan) -> list[float]:
    """Numbers separated by commas; InputError unless each is positive or at least ``least``."""
    try:
        values = [float(word) for word in text.split(",")]
    except ValueError:
        raise InputError("new", option, f"{text!r} is no number", "e.g. 4.2 or 4.2,5.1") from None
    return [value if value >= least else _positive(option, value) for value in values]


def _asked_list(option: str, about: str, written: str | None, usual: str) -> list[float]:
    """Numbers of an option, or of the answer to a question that is repeated until it is valid."""

    def read(text: str) -> list[float]:
        try:
            return _list(option, text)
        except InputError as fault:
            raise typer.BadParameter(fault.problem) from None

    if written is None and _on_terminal(option, about):
        answer: list[float] = typer.prompt(about, usual, value_proc=read)
        return answer
    return _list(option, str(written))


def _asked(option: str, about: str, value: float | None, usual: float) -> float:
    """The value of an option, or the answer to a question on the terminal."""
    if value is None and _on_terminal(option, about):
        value = typer.prompt(about, usual, type=float)
    assert value is not None
    return _positive(option, value)


def _on_terminal(option: str, about: str) -> bool:
    """True on a terminal; else InputError, as the option is missing."""
    if not sys.stdin.isatty():
        raise InputError("new", option, "is missing", f"give the {about}")
    return True


def _positive(option: str, value: float) -> float:
    if not (math.isfinite(value) and value > 0):
        remedy = "give its size; both signs in a case turn the sense" if value < 0 else "correct it"
        raise InputError("new", option, f"{value:g} is no number above 0", remedy)
    return value


def _whole(planets: float) -> int:
    if planets % 1:
        raise InputError("new", "--planets", f"{planets:g} is no whole number", "e.g. 4")
    return int(planets)
