"""Keys of a parameter study, their values, and the points of the grid.

VALUES is ``1,2,3`` (numbers or words; lists in brackets, in whose place a number is a list of one
element), ``start:stop:count`` in equal steps, or ``start:stop:count:log`` in equal ratios. A number
at the end of a key selects an element of a list: ``stage.errors.pin_tangential_um.0=0:50:6`` moves
only the pin of the first planet.
"""

import itertools
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from flexgear.model.case import Case
from flexgear.model.errors import InputError, echo
from flexgear.model.load import whole_key
from flexgear.model.read import FieldPath, changed, field_path, is_index, of_only_stage
from flexgear.model.section import is_list, takes
from flexgear.model.units import unit_name
from flexgear.model.validation_errors import with_places

WHERE = "sweep"
FORMS = "write 1,2,3 or start:stop:count or start:stop:count:log"
MAX_POINTS = 100_000  # of a grid
MAX_VALUES = 10_000  # of a key


@dataclass(frozen=True)
class Values:
    """Values of a key. texts: as in a case file; numbers: the same as numbers, None for words."""

    texts: tuple[str, ...]
    numbers: tuple[float, ...] | None
    logarithmic: bool = False


@dataclass(frozen=True)
class SweptKey:
    """A swept key. key: as written; units: as printed, "" for pure numbers and words; name: the key
    without its unit; path: of the field or list element in the case, with stages by number."""

    key: str
    values: Values
    units: str
    name: str
    path: tuple[str | int, ...]

    @property
    def ticks(self) -> tuple[float, ...] | tuple[str, ...]:
        """Values as a coordinate: numbers in the key's unit, or words."""
        return self.values.texts if self.values.numbers is None else self.values.numbers


def parse_setting(text: str) -> tuple[str, Values]:
    """Key and values of ``KEY=VALUES``; InputError with the remedy."""
    key, sign, values = text.partition("=")
    if not sign or not key.strip():
        raise InputError(WHERE, text, "is not KEY=VALUES", f"e.g. stage.planets=3,4,5; {FORMS}")
    return key.strip(), parse_values(key.strip(), values.strip())


def values_of(key: str, values: Values | str | Iterable[object]) -> Values:
    """Values from text of the command line, or from single values."""
    if isinstance(values, Values):
        return values
    return parse_values(key, values if isinstance(values, str) else ",".join(map(str, values)))


def parse_values(key: str, text: str) -> Values:
    """Values of ``1,2,3``, ``start:stop:count`` or ``start:stop:count:log``."""
    parts = _split(text)
    if any(not p for p in parts):
        raise InputError(WHERE, key, "has an empty value", FORMS)
    if len(parts) == 1 and ":" in text and not text.startswith(("[", '"')):
        return _range(key, text)
    numbers = [_number(p) for p in parts]
    plain_numbers = [n for n in numbers if n is not None]
    if plain_numbers and len(plain_numbers) < len(parts):
        word = next(p for p, n in zip(parts, numbers, strict=True) if n is None)
        raise InputError(WHERE, key, f"{echo(word)} is not a number as the others are", FORMS)
    if len(parts) > MAX_VALUES:
        raise InputError(WHERE, key, f"has {len(parts)} values", f"give at most {MAX_VALUES}")
    texts, values = tuple(parts), None
    if plain_numbers:
        texts, values = tuple(_text(n) for n in plain_numbers), tuple(plain_numbers)
    doubled = next((t for k, t in enumerate(texts) if t in texts[:k]), None)
    if doubled is not None:
        raise InputError(WHERE, key, f"{doubled} is given twice", "give every value once")
    return Values(texts, values)


def swept_key(base: Case, key: str, values: Values) -> SweptKey:
    """The key with its field of the case; InputError for an unknown key or unsuitable values."""
    data = base.model_dump()
    try:
        full = whole_key(key, data, WHERE)
        field = field_path(Case, full, WHERE)
        if field.is_element:  # raises InputError unless the case has this element
            changed(data, field.path, 0.0, WHERE, key)
    except InputError as error:
        fault = with_places(Case, error)
        raise fault if key.startswith("stages") else of_only_stage(fault) from None
    if field.is_section:
        raise InputError(WHERE, key, "is a section, not a key", f"name a key of it: {key}.…")
    name, suffix = field.name, field.suffix
    several = is_list(field.section, name) and not field.is_element
    _require_kind(key, values, field, several)
    if several and values.numbers is not None:  # a number is a list of one element
        values = replace(values, texts=tuple(f"[{t}]" for t in values.texts))
    return SweptKey(
        key=key,
        values=values,
        units=unit_name(suffix) if suffix else "",
        name=key.replace(f"{name}_{suffix}", name) if suffix else key,
        path=field.path,
    )


def points(keys: Sequence[SweptKey]) -> list[dict[str, str]]:
    """Keys and texts, as for ``--set``, of all points of the grid, the last key running fastest;
    InputError for keys of one field."""
    for k, key in enumerate(keys):
        for other in keys[:k]:
            short, long = sorted((key.path, other.path), key=len)
            if long[: len(short)] == short:
                raise InputError(
                    WHERE, key.key, f"sets the same value as {other.key}", "sweep one of them"
                )
    count = math.prod(len(k.values.texts) for k in keys)
    if count > MAX_POINTS:
        raise InputError(
            WHERE, keys[-1].key, f"the grid has {count} points", f"at most {MAX_POINTS}"
        )
    names = [key.key for key in keys]
    grid = itertools.product(*(key.values.texts for key in keys))
    return [dict(zip(names, texts, strict=True)) for texts in grid]


def _range(key: str, text: str) -> Values:
    parts = [p.strip() for p in text.split(":")]
    logarithmic = len(parts) == 4 and parts[3] == "log"
    if len(parts) != 3 and not logarithmic:
        raise InputError(WHERE, key, f"{echo(text)} is no range", FORMS)
    ends = [_number(p) for p in parts[:2]]
    for part, end in zip(parts, ends, strict=False):
        if end is None:
            raise InputError(WHERE, key, f"{echo(part)} in {echo(text)} is not a number", FORMS)
    start, stop = (float(e) for e in ends if e is not None)
    if not is_index(parts[2]) or not 2 <= int(parts[2]) <= MAX_VALUES:
        problem = f"the count of {echo(text)} is {parts[2] or 'missing'}"
        raise InputError(WHERE, key, problem, f"give a whole number from 2 to {MAX_VALUES}")
    if start == stop:
        raise InputError(WHERE, key, f"{echo(text)} starts where it stops", "give one value alone")
    if logarithmic and min(start, stop) <= 0:
        raise InputError(
            WHERE, key, f"{echo(text)} in equal ratios needs positive ends", "leave :log out"
        )
    space = np.geomspace if logarithmic else np.linspace
    numbers = tuple(float(v) for v in space(start, stop, int(parts[2])))
    return Values(tuple(_text(v) for v in numbers), numbers, logarithmic)


def _split(text: str) -> list[str]:
    """Parts of a text between the commas outside brackets and quotes."""
    parts, depth, quoted = [""], 0, False
    for letter in text:
        quoted ^= letter == '"'
        depth += (letter in "[{") - (letter in "]}")
        if letter == "," and depth == 0 and not quoted:
            parts.append("")
        else:
            parts[-1] += letter
    return [p.strip() for p in parts]


def _number(text: str) -> float | None:
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def _text(value: float) -> str:
    """A number as TOML: whole ones without a point, so that integer keys take them."""
    return str(int(value)) if value == int(value) and abs(value) < 1e15 else repr(float(value))


def _require_kind(key: str, values: Values, field: FieldPath, several: bool) -> None:
    """InputError where values do not fit the type of the key: numbers, integers or words.

    several: whether the key takes lists.
    """
    numbers, integer = values.numbers, takes(field.section, field.name, int)
    real = takes(field.section, field.name, float)
    if numbers is None and (integer or real) and not several:
        unit = f" in {unit_name(field.suffix)}" if field.suffix else ""
        problem = f"{echo(values.texts[0])} is not a number"
        raise InputError(WHERE, key, problem, f"give numbers{unit}; {FORMS}")
    if numbers is not None and integer and not real:
        broken = next((v for v in numbers if v != int(v)), None)
        if broken is not None:
            problem = f"takes whole numbers, {broken:g} is none"
            remedy = "choose the count so that the steps are whole, or list the values"
            raise InputError(WHERE, key, problem, remedy)
    if numbers is not None and not (integer or real):
        problem = f"takes words, not the number {values.texts[0]}"
        raise InputError(WHERE, key, problem, "list the words: KEY=word,other")
