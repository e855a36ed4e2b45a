"""TOML text of cases in which a comment states the source of every key.

``CaseText`` collects sections and keys of an imported case. ``new_case_text`` fills the template
new_case.toml.j2 with proposed stages, alone or in series.
"""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache
from importlib.resources import files
from typing import Any

import numpy as np
from jinja2 import Environment, StrictUndefined, Template

from flexgear.gears import surroundings as around
from flexgear.gears.sizing import (
    FLANK_LIMIT,
    FORM_FACTOR,
    LOAD_FACTOR,
    MOST_WRAP,
    ROOT_LIMIT,
    Proposal,
)
from flexgear.model.units import RPM

Value = float | int | str | bool | list[float] | list[str]
_EMPTY_SECTIONS = ("[stages.carrier]",)  # written without keys, since a case needs them
_COMMENT_COLUMN = 42
PAIR_STIFFNESS = 14e9  # N/m², c' of a spur tooth pair, N/(mm µm) = 1e9 N/m² (ISO 6336-1)


@dataclass(frozen=True)
class Datum:
    """A number read from a file, and a description of its source for the comment."""

    value: float
    source: str


@dataclass
class Section:
    """One TOML table of a case: its header ("" at the top of the file) and lines of key, value,
    comment. is_comment: whether the whole table is one, for the user to take into the case."""

    case: CaseText
    header: str
    lines: list[tuple[str, Value, str]] = field(default_factory=list)
    is_comment: bool = False

    def put(self, key: str, value: Value, why: str) -> None:
        """Append a key with its value and the comment that states its source."""
        self.lines.append((key, value, why))

    def take(self, key: str, datum: Datum | None) -> bool:
        """Append a key if ``datum`` is not None; returns whether it was appended."""
        if datum is not None:
            self.put(key, datum.value, datum.source)
        return datum is not None

    def take_or_assume(self, key: str, datum: Datum | None, usual: float, why: str) -> float:
        """Append a key with the value of ``datum``, or the assumed value ``usual`` if it is None;
        returns the value."""
        if not self.take(key, datum):
            self.assume(key, usual, why)
        return usual if datum is None else datum.value

    def assume(self, key: str, value: Value, why: str) -> None:
        """Append a key with an assumed value, and list the assumption in the case."""
        self.put(key, value, f"assumed: {why}")
        place = self.header.strip("[]").replace("stages", f"stages.{self.case.stage}", 1)
        self.case.assumed.append(f"{f'{place}.' if place else ''}{key} = {toml(value)}: {why}")

    def is_below(self, other: Section) -> bool:
        """Whether this table is nested in the table of another section."""
        return self.header.lstrip("[").startswith(f"{other.header.strip('[]')}.")

    def holds(self, key: str) -> bool:
        """Whether the table has the key."""
        return any(path == key for path, _, _ in self.lines)

    def text(self) -> str:
        """The section as TOML."""
        rows = [self.header] if self.header else []
        for key, value, why in self.lines:
            line = f"{key} = {toml(value)}"
            rows.append(f"{line:<{_COMMENT_COLUMN}}# {_printable(why)}" if why else line)
        return commented(rows) if self.is_comment else "\n".join(rows) + "\n"


@dataclass
class CaseText:
    """Sections of a case in their order, and one sentence for each assumption or warning. stage:
    name of the stage that is being written."""

    sections: list[Section] = field(default_factory=list)
    assumed: list[str] = field(default_factory=list)
    stage: str = ""

    def section(self, header: str, behind: Section | None = None) -> Section:
        """Insert and return a new section.

        With ``behind`` it follows that section and the sections nested in it. Otherwise it follows
        the last section of its parent table in the current stage, or all sections if there is none.
        """
        section, place = Section(self, header), len(self.sections)
        if behind is not None:
            place = next(k for k, earlier in enumerate(self.sections) if earlier is behind) + 1
            while place < len(self.sections) and self.sections[place].is_below(behind):
                place += 1
            self.sections.insert(place, section)
            return section
        parent = header.strip("[]").rpartition(".")[0]
        for k in range(len(self.sections) - 1, -1, -1):
            before = self.sections[k].header.strip("[]")
            if parent.count(".") and f"{before}.".startswith(f"{parent}."):
                place = k + 1
                break
            if self.sections[k].header == f"[[{before.partition('.')[0]}]]":
                break
        self.sections.insert(place, section)
        return section

    def warn(self, text: str) -> None:
        """Add a sentence about a contradiction in the file and how it was resolved."""
        self.assumed.append(text)

    def text(self) -> str:
        """The sections as TOML."""
        return "\n".join(s.text() for s in self.sections if s.lines or s.header in _EMPTY_SECTIONS)


def toml(value: Value) -> str:
    """A value as TOML. Floats have all their digits: below 1e-4 and from 1e6 on with an exponent,
    otherwise without a decimal point if they are integers."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, (int, str)):
        return json.dumps(value, ensure_ascii=False) if isinstance(value, str) else str(value)
    if isinstance(value, list):
        return f"[{', '.join(toml(v) for v in value)}]"
    if value and not 1e-4 <= abs(value) < 1e6:
        return str(np.format_float_scientific(value, trim="-", exp_digits=1))
    return str(int(value)) if value == int(value) else repr(float(value))


def commented(lines: list[str]) -> str:
    """Lines as TOML comments; unprintable characters become blanks."""
    return "".join(f"# {_printable(line)}".rstrip() + "\n" for line in lines)


def _printable(text: str) -> str:
    return "".join(c if c.isprintable() else " " for c in text)


_SIDES = {  # of the stage, at which carrier flange, ring bolts and sun shaft are
    "planetary": {"flange": "-z", "bolts": "-z", "shaft": "+z"},
    "star": {"flange": "-z", "bolts": "+z", "shaft": "-z"},
    "solar": {"flange": "-z", "bolts": "+z", "shaft": "+z"},
}


@dataclass(frozen=True)
class Rated:
    """Rated torque (N m) and speed (rad/s) of the driving member of stages in series. The driving
    member is the slow member of the first stage, with at_sun the fast member of the last stage."""

    torque: float
    speed: float
    at_sun: bool = False


def new_case_text(stages: Sequence[Proposal], rated: Rated) -> str:
    """TOML text of a case with stages in series, the slowest first. The fast member of each stage
    is joined to the slow member of the next stage."""
    several = len(stages) > 1
    names = [f"stage_{k}" for k in range(1, len(stages) + 1)] if several else ["stage"]
    sections = [_stage(n, p, several) for n, p in zip(names, stages, strict=True)]
    ratio, inertia = math.prod(p.ratio for p in stages), around.port_inertia(stages[0])
    slow = _port(sections[0], sections[0]["kind"].slow, inertia)
    fast = _port(sections[-1], sections[-1]["kind"].fast, inertia / ratio**2)
    kinds = " and ".join(p.request.arrangement for p in stages).capitalize()
    text = _template().render(
        stages=sections,
        driven=fast if rated.at_sun else slow,
        loaded=slow if rated.at_sun else fast,
        rated=rated,
        ratio=ratio,
        torque=f"{rated.torque:.6g} N m",
        kinds=f"{kinds} stage{'s' * several}",
    )
    return _formatted(text)


def _stage(name: str, p: Proposal, several: bool) -> dict[str, Any]:
    """Template variables of a stage. arm: distance of the roller rows from the middle of the gear,
    m. tooth_error: pitch error of a single tooth, µm. relief: deflection of a spur tooth pair that
    carries all of a gear mesh's tangential force, with c' = ``PAIR_STIFFNESS``, µm."""
    support = around.ring_support(p)
    return {
        "name": name,
        "table": "stages" if several else "stage",
        "proposal": p,
        "kind": p.request.kind,
        "sides": _SIDES[p.request.arrangement],
        "carrier": around.carrier_size(p),
        "support": support,
        "bolted": isinstance(support, around.Bolting),
        "hub": around.ring_hub(p, support.rim),
        "bearing": around.bearing_stiffness(p),
        "arm": 0.25 * p.gear_width,
        "relief": 1e6 * 0.5 * p.pin_force / p.face_width / PAIR_STIFFNESS,
        "tooth_error": min(1.2 * math.sqrt(1e3 * p.module) + 2, 1e3 * p.module),
    }


def _port(stage: dict[str, Any], part: str, inertia: float) -> dict[str, Any]:
    """Template variables of the port at a member; inertia is added to the member, kg m²."""
    return {"member": f"{stage['name']}.{part}", "part": part, "stage": stage, "inertia": inertia}


def _rounded(value: float, digits: int = 3) -> str:
    """A number as TOML with ``digits`` significant digits."""
    return toml(float(f"{value:.{digits}g}"))


@cache
def _template() -> Template:
    environment = Environment(undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    environment.globals.update(
        RPM=RPM, DEGREES=180 / math.pi, TWIST=around.TWIST,
        WRAP=MOST_WRAP, FLANK=FLANK_LIMIT, ROOT=ROOT_LIMIT, FORM=FORM_FACTOR, FACTOR=LOAD_FACTOR,
        n=_rounded, mm=lambda value, digits=4: _rounded(1e3 * value, digits),
    )  # fmt: skip
    return environment.from_string((files(__package__) / "new_case.toml.j2").read_text("utf-8"))


def _formatted(text: str) -> str:
    """The text with aligned comments, and an empty line below the head and above each section."""
    lines: list[str] = []
    for line in filter(str.strip, text.splitlines()):
        key, sign, why = line.partition("  # ")
        begins = line[0] == "[" or (line[0] != "#" and lines[-1][0] == "#")
        above = "\n" if begins else ""
        lines.append(f"{above}{key:<{_COMMENT_COLUMN}}# {why}" if sign else f"{above}{line}")
    return "\n".join(lines) + "\n"
