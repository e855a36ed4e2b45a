"""What a parameter study varies: keys of a case, their values, and the points of the grid.

VALUES is ``1,2,3`` (numbers or words; lists in brackets), ``start:stop:count`` in equal steps, or
``start:stop:count:log`` in equal ratios. A number at the end of a key picks one element of a list:
``stage.errors.pin_tangential_um.0=0:50:6`` moves the pin of the first planet alone.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from flexgear.model.case import Case
from flexgear.model.errors import InputError, echo
from flexgear.model.gear_mesh import PLANET_LISTS
from flexgear.model.read import is_place, match_key, numbered
from flexgear.model.section import Section, is_list, quantity_of, section_of
from flexgear.model.units import Quantity, unit_name
from flexgear.model.upgrade import refuse_earlier_key

WHERE = "sweep"
FORMS = "write 1,2,3 or start:stop:count or start:stop:count:log"
MOST = 100_000  # points of a grid
MOST_VALUES = 10_000


@dataclass(frozen=True)
class Values:
    """texts: as they are set in a case; numbers: the same, or None where they are words."""

    texts: tuple[str, ...]
    numbers: tuple[float, ...] | None
    logarithmic: bool = False


@dataclass(frozen=True)
class SweptKey:
    """key: as written; values; units: as printed, "" for pure numbers and words; name: the key
    without its unit; path: the field with stages by number; element: place in a list, None for the
    whole field; whole: takes integers only; start: the list as the case has it, in the key's unit.
    """

    key: str
    values: Values
    units: str
    name: str
    path: tuple[str, ...]
    element: int | None = None
    whole: bool = False
    start: tuple[float, ...] = ()

    @property
    def ticks(self) -> tuple[float, ...] | tuple[str, ...]:
        """Values as a coordinate: numbers in the key's unit, or words."""
        return self.values.texts if self.values.numbers is None else self.values.numbers

    @property
    def parent(self) -> str:
        """The key without the number of a list element."""
        return self.key if self.element is None else self.key.rpartition(".")[0]


Point = tuple[int, ...]  # number of the value of each key


def parse_setting(text: str) -> tuple[str, Values]:
    """Key and values of ``KEY=VALUES``; InputError with the remedy."""
    key, sign, values = text.partition("=")
    if not sign or not key.strip():
        raise InputError(WHERE, text, "is not KEY=VALUES", f"e.g. stage.planets=3,4,5; {FORMS}")
    return key.strip(), parse_values(key.strip(), values.strip())


def values_of(key: str, values: Values | str | Iterable[object]) -> Values:
    """Values as a command line writes them, or one by one."""
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
    if len(parts) > MOST_VALUES:
        raise InputError(WHERE, key, f"has {len(parts)} values", f"give at most {MOST_VALUES}")
    texts, values = tuple(parts), None
    if plain_numbers:
        texts, values = tuple(_text(n) for n in plain_numbers), tuple(plain_numbers)
    doubled = next((t for k, t in enumerate(texts) if t in texts[:k]), None)
    if doubled is not None:
        raise InputError(WHERE, key, f"{doubled} is given twice", "give every value once")
    return Values(texts, values)


def swept_key(base: Case, key: str, values: Values) -> SweptKey:
    """The key as a field of the case; InputError for unknown keys and values of the wrong kind."""
    words = key.split(".")
    section: type[Section] | None = Case
    refuse_earlier_key(key, WHERE)
    parts = numbered(key, base.model_dump(), WHERE)
    extra = len(parts) - len(words)  # stage.planets is stages.0.planets
    owner: type[Section] = Case
    path, suffix, name = list[str](), "", ""
    for k, part in enumerate(parts):
        seen = ".".join(words[: max(k - extra, 0) + 1])
        if is_place(part) and path:
            path.append(part)
            continue
        if section is None:
            raise InputError(WHERE, key, f"{'.'.join(words[:-1])} has no keys below it", "cut it")
        owner = section
        name, suffix = match_key(section, part, WHERE, seen)
        path.append(name)
        section = section_of(section, name)
    element = int(path[-1]) if is_place(path[-1]) else None
    quantity = quantity_of(owner, name)
    if section is not None:
        raise InputError(WHERE, key, "is a section, not a key", f"name a key of it: {key}.…")
    swept = SweptKey(
        key=key,
        values=values,
        units=unit_name(suffix) if suffix else "",
        name=key.replace(f"{name}_{suffix}", name) if suffix else key,
        path=tuple(path),
        element=element,
        whole=int in _scalars(owner, name) and float not in _scalars(owner, name),
    )
    _require_kind(swept, owner, name, suffix)
    if element is not None:
        return replace(swept, start=_list_of(base, swept, quantity, suffix))
    return _in_brackets(swept) if is_list(owner, name) else swept


def points(keys: Sequence[SweptKey]) -> list[Point]:
    """All points of the grid, the last key running fastest; InputError for keys that clash."""
    for k, key in enumerate(keys):
        for other in keys[:k]:
            _require_apart(key, other)
    count = math.prod(len(k.values.texts) for k in keys)
    if count > MOST:
        raise InputError(WHERE, keys[-1].key, f"the grid has {count} points", f"at most {MOST}")
    return list(itertools.product(*(range(len(k.values.texts)) for k in keys)))


def overrides_at(keys: Sequence[SweptKey], point: Point) -> dict[str, str]:
    """Keys and texts, as for ``--set``, that make the case of one point."""
    out: dict[str, str] = {}
    lists: dict[str, list[float]] = {}
    for key, k in zip(keys, point, strict=True):
        if key.element is None:
            out[key.key] = key.values.texts[k]
            continue
        assert key.values.numbers is not None
        lists.setdefault(key.parent, list(key.start))[key.element] = key.values.numbers[k]
    return out | {k: "[" + ", ".join(_text(v) for v in row) + "]" for k, row in lists.items()}


def label_of(keys: Sequence[SweptKey], point: Point) -> str:
    """A point in words: "stage.planets = 4, stage.face_width_mm = 30"."""
    return ", ".join(f"{k.key} = {k.values.texts[i]}" for k, i in zip(keys, point, strict=True))


def _require_apart(key: SweptKey, other: SweptKey) -> None:
    short, long = sorted((key.path, other.path), key=len)
    if long[: len(short)] == short:
        raise InputError(WHERE, key.key, f"says the same as {other.key}", "sweep one of them")
    if key.element is None or other.element is None or key.path[:-1] != other.path[:-1]:
        return
    if key.parent != other.parent:
        raise InputError(WHERE, key.key, f"and {other.key} differ in unit", "use one unit")


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
    if not is_place(parts[2]) or not 2 <= int(parts[2]) <= MOST_VALUES:
        problem = f"{echo(text)} is an empty range: its count is {parts[2] or 'missing'}"
        raise InputError(WHERE, key, problem, f"give a whole number from 2 to {MOST_VALUES}")
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
    """Parts between commas that are not inside brackets or quotes."""
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


def _scalars(section: type[Section], name: str) -> set[Any]:
    """Plain types inside a field's annotation."""
    types, todo = set[Any](), [section.model_fields[name].annotation]
    while todo:
        each = todo.pop()
        types.add(each)
        todo += list(getattr(each, "__args__", ()))
    return types


def _require_kind(key: SweptKey, section: type[Section], name: str, suffix: str) -> None:
    """InputError where values do not fit the key's type: numbers, whole numbers or words."""
    takes, numbers = _scalars(section, name), key.values.numbers
    numeric = bool(takes & {int, float})
    if numbers is None and numeric and (key.element is not None or not is_list(section, name)):
        unit = f" in {unit_name(suffix)}" if suffix else ""
        raise InputError(
            WHERE,
            key.key,
            f"{echo(key.values.texts[0])} is not a number",
            f"give numbers{unit}; {FORMS}",
        )
    if numbers is not None and key.whole:
        broken = next((v for v in numbers if v != int(v)), None)
        if broken is not None:
            raise InputError(
                WHERE, key.key, f"takes whole numbers, {broken:g} is none",
                "choose the count so that the steps are whole, or list the values",
            )  # fmt: skip
    if numbers is not None and not numeric:
        raise InputError(
            WHERE, key.key, f"takes words, not the number {key.values.texts[0]}",
            "list the words: KEY=word,other",
        )  # fmt: skip


def _in_brackets(key: SweptKey) -> SweptKey:
    """The key with every number written as a list of one, for a key that takes a list."""
    if key.values.numbers is None:
        return key
    texts = tuple(f"[{t}]" for t in key.values.texts)
    return replace(key, values=replace(key.values, texts=texts))


def _list_of(
    base: Case, key: SweptKey, quantity: Quantity | None, suffix: str
) -> tuple[float, ...]:
    """The list in the key's unit; where the case leaves it out, as long as there are planets."""
    owners: list[Any] = [base]
    for part in key.path[:-2]:
        inner = owners[-1]
        owners.append(inner[int(part)] if is_place(part) else getattr(inner, part))
    planets = next((o.planets for o in owners if hasattr(o, "planets")), 0)
    name = key.path[-2]
    values = getattr(owners[-1], name)
    if values is None and name == "planet_positions":
        values = owners[-1].planet_angles
    if not isinstance(values, tuple):
        raise InputError(WHERE, key.key, f"{key.parent} is not a list", "cut the number")
    if not values:
        values = (0.0,) * planets
    if len(values) == 1 and name in PLANET_LISTS:  # one for all planets
        values = values * planets
    if key.element is None or key.element >= len(values):
        raise InputError(
            WHERE, key.key, f"{key.parent} has {len(values)} elements", "they are counted from 0"
        )
    return tuple(quantity.from_si(v, suffix) if quantity else v for v in values)
