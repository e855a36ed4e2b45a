"""Numbers and names as a person reads them: 788 kN, 21.3 µm, "sun gear mesh"."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from typing import Any

from flexgear.model.names import PLANET_PASS, SHAFT, ExcitationName, MemberName
from flexgear.model.stage import Stage
from flexgear.model.units import ALL_SUFFIXES, unit_name

# unit -> (at least so large, printed unit, multiply by), the largest first; the last one takes all
_SCALES: dict[str, tuple[tuple[float, str, float], ...]] = {
    "N": ((1e6, "MN", 1e-6), (1e3, "kN", 1e-3), (0, "N", 1)),
    "N m": ((1e6, "MN m", 1e-6), (1e3, "kN m", 1e-3), (0, "N m", 1)),
    "J": ((1e6, "MJ", 1e-6), (1e3, "kJ", 1e-3), (0, "J", 1)),
    "W": ((1e6, "MW", 1e-6), (1e3, "kW", 1e-3), (0, "W", 1)),
    "m": ((10, "m", 1), (1e-3, "mm", 1e3), (0, "µm", 1e6)),
    "rad": ((0, "mrad", 1e3),),
    "angle": ((0, "°", 180 / math.pi),),
    "Pa": ((1e9, "GPa", 1e-9), (0, "MPa", 1e-6)),
    "s": ((1, "s", 1), (1e-3, "ms", 1e3), (0, "µs", 1e6)),
    "Hz": ((1e4, "kHz", 1e-3), (0, "Hz", 1)),
    "N/m": ((1e9, "GN/m", 1e-9), (1e6, "MN/m", 1e-6), (1e3, "kN/m", 1e-3), (0, "N/m", 1)),
    "share": ((0, "%", 100),),
    "rad/s": ((0, "r/min", 30 / math.pi),),
}
NOTHING = 1e-12  # of a unit, rounding
# significant digits where four are too few: dimensions to µm, speeds and frequencies side by side
_DIGITS = {"mm": 6, "°": 5, "r/min": 5, "rad/s": 5, "Hz": 5, "share": 3}
LONGEST, YEAR = 1e6, 8766.0  # h
_EVEN = 0.01  # load factors nearer to one get a digit more
_UNITS = {"deg": "°", "rpm": "r/min", "h": "h", "m3": "m³"}
FACTOR = "factor"  # unit of load factors
_TIMES = {"1": "Once", "2": "Twice"}
_ALWAYS = {"iso": "ISO", "hz": "Hz", "fe": "FE", "id": "name"}


def scale(values: Iterable[float], unit: str) -> tuple[str, float]:
    """Printed unit and factor that suit the largest of values in an SI unit."""
    largest = max((abs(v) for v in values if math.isfinite(v)), default=0.0)
    steps = _SCALES.get(unit, ((0, unit, 1.0),))
    if largest <= NOTHING:
        return steps[min(1, len(steps) - 1)][1:]
    return next((name, by) for least, name, by in steps if largest >= least)


def number(value: float, digits: int = 4) -> str:
    """Significant digits without exponents, with thousands separated; "–" where there is no
    number."""
    if not math.isfinite(value):
        return "–"
    if value == 0 or abs(value) < NOTHING:
        return "0"
    if abs(value) >= 1e7 or abs(value) < 1e-4:
        mantissa, power = f"{value:.2e}".split("e")
        raised = str(int(power)).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
        return f"{mantissa} · 10{raised}"
    places = max(0, digits - 1 - math.floor(math.log10(abs(value))))
    text = f"{value:,.{places}f}".replace(",", "\u202f")
    return text.rstrip("0").rstrip(".") if "." in text else text


def factor(value: float) -> str:
    """A load factor with the digits that its excess over one needs: 1.0002, 1.563."""
    return f"{value:.{4 if abs(value - 1.0) < _EVEN else 3}f}" if math.isfinite(value) else "–"


def life_text(hours: float) -> str:
    """A life as "23.4 h", "58 300 h (6.65 years)" or "over 1 000 000 h": three figures, no number
    beyond any use; "–" where there is none."""
    if math.isnan(hours):
        return "–"
    if hours >= LONGEST:
        return f"over {number(LONGEST)} h"
    years = f" ({number(hours / YEAR, 3)} years)" if hours >= YEAR else ""
    return f"{rounded(hours)} h{years}"


def rounded(value: float) -> str:
    """``number`` with three figures also before the point: 127293.4 -> "127 000"."""
    return number(float(f"{value:.3g}"), 3)


def with_unit(value: float | str | bool | None, unit: str = "") -> str:
    """A figure with its unit: 788275 N -> "788.3 kN"; "–" where there is none."""
    if value is None:
        return "–"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, str):
        return value
    if unit == FACTOR:
        return factor(value)
    if unit == "h":
        return life_text(value)
    if isinstance(value, int) and not unit:
        return f"{value:,}".replace(",", "\u202f")
    printed, by = scale([value], unit)
    return f"{number(value * by, digits_of(unit))} {printed}".rstrip()


def digits_of(unit: str) -> int:
    """Significant digits of figures that are given in this unit."""
    return _DIGITS.get(unit, 4)


def window_words(figures: Mapping[str, Any]) -> str:
    """The part of a run that figures are of, from those of a transient in a summary."""
    start, end = figures["window_s"]
    printed, by = scale([end], "s")
    if figures.get("settled") is False:
        return f"over all {with_unit(end, 's')}, not settled"
    settled = ", settled" if figures.get("settled") else ""
    return f"from {number(start * by, 3)} to {number(end * by, 3)} {printed}{settled}"


def words(name: str) -> str:
    """A name of a figure, case key or body as words: "stage_1.ring" -> "stage 1 ring"; the only
    stage of a case, called "stage", is left out: "stage.ring" -> "ring"."""
    parts = re.split(r"[._\s]+", re.sub(r"^stage[. ](?=\w)", "", name))
    return " ".join(_ALWAYS.get(p.lower(), p) for p in parts if p)


def titled_by_stage(what: str, stage: str) -> str:
    """A title with the name of its stage, without it for the only stage of a case."""
    return what if stage in ("", "stage") else f"{what}, {words(stage)}"


def of_stage(stage: str) -> str:
    """The words " of stage 1"; empty for the only stage of a case, called "stage"."""
    return "" if stage == "stage" else f" of {words(stage)}"


def excitation_words(label: str) -> str:
    """ "stage_1 x 3" -> "Order 3 of the gear mesh of stage 1"."""
    name = ExcitationName.parse(label)
    if name.kind == PLANET_PASS:
        return f"The pass of planets of {words(name.stage)}"
    if name.kind == SHAFT:
        member = words(MemberName.of(name.stage, name.part))
        return f"{_TIMES.get(name.order, f'{name.order} times')} the turn of {member}"
    return f"Order {name.order} of the gear mesh{of_stage(name.stage)}"


def split_unit(key: str) -> tuple[str, str]:
    """Words and printed unit of a key that ends in one: "base_pitch_mm" -> ("base pitch", "mm")."""
    suffixes = [s for s in (*ALL_SUFFIXES, *_UNITS) if key.endswith(f"_{s}")]
    if not suffixes:
        return words(key), ""
    suffix = max(suffixes, key=len)
    return words(key.removesuffix(f"_{suffix}")), _UNITS.get(suffix) or unit_name(suffix)


def stage_line(stage: Stage) -> str:
    """ "planetary, 3 planets, 21/42/105 teeth, normal module 15 mm"."""
    gears = ("sun", "planet", "ring") if stage.kind == "planetary" else ("pinion", "gear")
    teeth = "/".join(str(getattr(stage, gear).teeth) for gear in gears)
    planets = f", {stage.planets} planets" if stage.kind == "planetary" else ""
    module = with_unit(stage.normal_module, "m")
    return f"{stage.kind}{planets}, {teeth} teeth, normal module {module}"
