"""Text of numbers with units and of names for readers: 788 kN, 21.3 µm, "sun gear mesh"."""

import math
import re
from collections.abc import Iterable, Mapping
from typing import Any

from flexgear.model.case import Case
from flexgear.model.names import BOLT_PASS, PLANET_PASS, SHAFT, ExcitationName, MemberName
from flexgear.model.stage import Stage
from flexgear.model.units import ALL_SUFFIXES, unit_name

# unit -> (smallest value, printed unit, factor), in decreasing order
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
    "m/s2": ((0, "m/s²", 1),),
    "strain": ((0, "µm/m", 1e6),),
}
ZERO = 1e-12  # in SI, below which values are printed as 0
# significant digits other than four: for dimensions to 1 µm, and for similar speeds and frequencies
_DIGITS = {"mm": 6, "°": 5, "r/min": 5, "rad/s": 5, "Hz": 5, "share": 3}
MAX_LIFE, YEAR = 1e6, 8766.0  # h
_EVEN = 0.01  # excess of load factors over one below which they have a digit more
_UNITS = {"deg": "°", "rpm": "r/min", "h": "h", "m3": "m³"}
FACTOR = "factor"  # unit of load factors
_TIMES = {"1": "Once", "2": "Twice"}
_ALWAYS = {"iso": "ISO", "hz": "Hz", "fe": "FE", "id": "name"}


def scale(values: Iterable[float], unit: str) -> tuple[str, float]:
    """Printed unit for the largest of some values in an SI unit, the smallest one if all are zero,
    and the factor to it."""
    largest = max((abs(v) for v in values if math.isfinite(v)), default=0.0)
    steps = _SCALES.get(unit, ((0, unit, 1.0),))
    if largest <= ZERO:
        return steps[-1][1:]
    return next((name, by) for least, name, by in steps if largest >= least)


def signal_scale(values: Iterable[float], unit: str) -> tuple[str, float]:
    """``scale`` of a sensor's signal, whose unit 1 is that of strain."""
    return scale(values, "strain" if unit == "1" else unit)


def number(value: float, digits: int = 4) -> str:
    """Text of a number to so many significant digits: "12 340", "−0.5", "1.20 · 10⁻⁶"; "–" for an
    infinite or missing one."""
    if not math.isfinite(value):
        return "–"
    if value == 0 or abs(value) < ZERO:
        return "0"
    if value < 0:
        return f"−{number(-value, digits)}"
    if value >= 1e7 or value < 1e-4:
        mantissa, power = f"{value:.2e}".split("e")
        raised = str(int(power)).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
        return f"{mantissa} · 10{raised}"
    places = max(0, digits - 1 - math.floor(math.log10(value)))
    text = f"{value:,.{places}f}".replace(",", "\u202f")
    return text.rstrip("0").rstrip(".") if "." in text else text


def factor(value: float) -> str:
    """Text of a load factor, with an additional digit near one: 1.0002, 1.563."""
    text = f"{value:.{4 if abs(value - 1.0) < _EVEN else 3}f}" if math.isfinite(value) else "–"
    return text.replace("-", "−")


def signed(value: float, places: int) -> str:
    """Text of a number with its sign and decimal places: "+2.50", "−0.31"."""
    return f"{value:+.{places}f}".replace("-", "−")


def life_text(hours: float) -> str:
    """Text of a life with three digits: "23.4 h", "58 300 h (6.65 years)", "over 1 000 000 h"."""
    if math.isnan(hours):
        return "–"
    if hours >= MAX_LIFE:
        return f"over {number(MAX_LIFE)} h"
    years = f" ({number(hours / YEAR, 3)} years)" if hours >= YEAR else ""
    return f"{rounded(hours)} h{years}"


def rounded(value: float) -> str:
    """``number`` rounded to three significant digits: 127293.4 -> "127 000"."""
    return number(float(f"{value:.3g}"), 3)


def with_unit(value: float | str | bool | None, unit: str = "") -> str:
    """Text of a value with its unit: 788275 N -> "788.3 kN"; "–" for None."""
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
        return f"{value:,}".replace(",", "\u202f").replace("-", "−")
    printed, by = scale([value], unit)
    by = 0.0 if abs(value) <= ZERO else by
    return f"{number(value * by, digits_of(unit))} {printed}".rstrip()


def digits_of(unit: str) -> int:
    """Number of significant digits of values in a unit."""
    return _DIGITS.get(unit, 4)


# motions in which a run begins
EQUILIBRIUM = "in equilibrium"
STEADY = "in the steady motion to first order"
CONTINUED = "at the end of another transient"


def window_words(figures: Mapping[str, Any]) -> str:
    """Text of the time window of a transient's figures in a summary."""
    start, end = figures["window_s"]
    printed, by = scale([end], "s")
    begins = f", begun {STEADY}" if figures.get("begins") == STEADY else ""
    if figures.get("settled") is False:
        return f"over all {with_unit(end, 's')}{begins}, not settled"
    settled = ", settled" if figures.get("settled") else ""
    return f"from {number(start * by, 3)} to {number(end * by, 3)} {printed}{begins}{settled}"


def words(name: str) -> str:
    """The words of the name of a figure, key or body: "stage_1.ring" -> "stage 1 ring". The only
    stage of a case, "stage", is left out: "stage.ring" -> "ring"."""
    parts = re.split(r"[._\s]+", re.sub(r"^stage[. ](?=\w)", "", name))
    return " ".join(_ALWAYS.get(p.lower(), p) for p in parts if p)


def titled_by_stage(what: str, stage: str) -> str:
    """A title followed by the name of its stage unless that is the only stage of a case."""
    return what if stage in ("", "stage") else f"{what}, {words(stage)}"


def of_stage(stage: str) -> str:
    """Text such as " of stage 1"; "" for the only stage of a case."""
    return "" if stage == "stage" else f" of {words(stage)}"


def excitation_words(label: str) -> str:
    """Description of an excitation: "stage_1 x 3" -> "Order 3 of the gear mesh of stage 1"."""
    name = ExcitationName.parse(label)
    if name.kind == PLANET_PASS:
        return f"The pass of planets of {words(name.stage)}"
    if name.kind == BOLT_PASS:
        return f"The pass of {name.order} bolts by planets{of_stage(name.stage)}"
    if name.kind == SHAFT:
        member = words(MemberName.of(name.stage, name.part))
        return f"{_TIMES.get(name.order, f'{name.order} times')} the turn of {member}"
    return f"Order {name.order} of the gear mesh{of_stage(name.stage)}"


def split_unit(key: str) -> tuple[str, str]:
    """Words and printed unit of a key: "base_pitch_mm" -> ("base pitch", "mm")."""
    suffixes = [s for s in (*ALL_SUFFIXES, *_UNITS) if key.endswith(f"_{s}")]
    if not suffixes:
        return words(key), ""
    suffix = max(suffixes, key=len)
    return words(key.removesuffix(f"_{suffix}")), _UNITS.get(suffix) or unit_name(suffix)


def module_text(module: float) -> str:
    """Text of a module in mm, also below 1 mm; module: m."""
    return f"{number(1e3 * module)} mm"


def stage_line(case: Case, stage: Stage) -> str:
    """Text such as "planetary, 3 planets, carrier held, 21/42/105 teeth, normal module 15 mm"."""
    gears = ("sun", "planet", "ring") if stage.kind == "planetary" else ("pinion", "gear")
    teeth = "/".join(str(getattr(stage, gear).teeth) for gear in gears)
    planets = ", 1 planet" if stage.planets == 1 else f", {stage.planets} planets"
    planets = planets if stage.kind == "planetary" else ""
    held = "".join(f", {m.part} held" for m in case.held_members() if m.stage == stage.name)
    module = module_text(stage.normal_module)
    halves = ", double-helical" if stage.double_helical else ""
    return f"{stage.kind}{planets}{held}, {teeth} teeth, normal module {module}{halves}"
