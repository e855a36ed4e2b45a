"""The commented case file of proposed stages, alone or in series: new_case.toml.j2 filled in."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any

from jinja2 import Environment, StrictUndefined, Template

from flexgear.files.case_text import COLUMN, toml
from flexgear.gears import surroundings as around
from flexgear.gears.sizing import FACTOR, FLANK, FORM, ROOT, Proposal
from flexgear.model.units import RPM

SIDES = {  # side of the carrier's flange, of the ring's bolts, of the sun's shaft
    "planetary": {"flange": "-z", "bolts": "-z", "shaft": "+z"},
    "star": {"flange": "-z", "bolts": "+z", "shaft": "-z"},
    "solar": {"flange": "-z", "bolts": "+z", "shaft": "+z"},
}


@dataclass(frozen=True)
class Rated:
    """Torque (N m) and speed (rad/s) of the driving end of stages in series: the slow member of the
    first, or at_sun the fast member of the last."""

    torque: float
    speed: float
    at_sun: bool = False


def new_case_text(stages: Sequence[Proposal], rated: Rated) -> str:
    """The case of stages in series, the slowest first: the fast member of each is joined to the
    slow one of the next."""
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
    return _laid_out(text)


def _stage(name: str, p: Proposal, several: bool) -> dict[str, Any]:
    """What the template asks of a stage. arm: of rows of rollers from their middle, m; tooth_error:
    of single teeth, µm."""
    support = around.ring_support(p)
    return {
        "name": name,
        "table": "stages" if several else "stage",
        "proposal": p,
        "kind": p.request.kind,
        "sides": SIDES[p.request.arrangement],
        "carrier": around.carrier_size(p),
        "support": support,
        "bolted": isinstance(support, around.Bolting),
        "hub": around.ring_hub(p, support.rim),
        "bearing": around.bearing_stiffness(p),
        "arm": 0.25 * p.gear_width,
        "tooth_error": min(1.2 * math.sqrt(1e3 * p.module) + 2, 1e3 * p.module),
    }


def _port(stage: dict[str, Any], part: str, inertia: float) -> dict[str, Any]:
    """The port at a member of a stage; inertia: of what hangs there, kg m²."""
    return {"member": f"{stage['name']}.{part}", "part": part, "stage": stage, "inertia": inertia}


def _rounded(value: float, digits: int = 3) -> str:
    """A number as TOML with so many digits."""
    return toml(float(f"{value:.{digits}g}"))


@cache
def _template() -> Template:
    environment = Environment(undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    environment.globals.update(
        RPM=RPM, DEGREES=180 / math.pi, TWIST=around.TWIST,
        FLANK=FLANK, ROOT=ROOT, FORM=FORM, FACTOR=FACTOR,
        n=_rounded, mm=lambda value, digits=4: _rounded(1e3 * value, digits),
    )  # fmt: skip
    return environment.from_string((files(__package__) / "new_case.toml.j2").read_text("utf-8"))


def _laid_out(text: str) -> str:
    """Comments behind keys in one column, an empty line below the head and before every section."""
    lines: list[str] = []
    for line in filter(str.strip, text.splitlines()):
        key, sign, why = line.partition("  # ")
        begins = line[0] == "[" or (line[0] != "#" and lines[-1][0] == "#")
        above = "\n" if begins else ""
        lines.append(f"{above}{key:<{COLUMN}}# {why}" if sign else f"{above}{line}")
    return "\n".join(lines) + "\n"
