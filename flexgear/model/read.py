"""From TOML text and overrides to plain data in SI, and how keys name sections and stages.

``to_si`` walks a section and what the user wrote side by side, converts units by the endings of
the keys and remembers how each key was written, so that a later complaint can name it.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Any

import numpy as np

from flexgear.model.errors import InputError, echo
from flexgear.model.gear_mesh import each_planet
from flexgear.model.section import (
    Section,
    accepted_keys,
    is_list,
    quantity_of,
    section_of,
    takes_one,
    usual_key,
)
from flexgear.model.units import ALL_SUFFIXES, Quantity

MOST_NESTED = 32  # lists and sections in one another
MOST_WHOLE = 2**63
UNSET = object()  # in place of a value: the key goes


# how the user wrote the fields: SI path "stage.face_width" -> (where, key, unit, value)
Written = dict[str, tuple[str, str, str, Any]]


def parse_toml(text: str, where: str, key: str = "TOML") -> dict[str, Any]:
    """Parses TOML with ``tomllib.loads``; InputError for invalid text, with the line of a syntax
    error, and for lists nested too deep."""
    deep = InputError(where, key, f"lists are nested more than {MOST_NESTED} deep", "flatten them")
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as fault:
        problem = str(fault).splitlines()[0]
        raise InputError(where, key, problem, "correct the syntax there") from None
    except ValueError:  # Python reads no whole numbers of more than 4 300 digits
        problem = "a whole number has thousands of digits"
        raise InputError(where, key, problem, "correct it") from None
    except RecursionError:
        raise deep from None
    level: list[Any] = [data]
    for _ in range(MOST_NESTED):
        level = [
            inner
            for outer in level
            for inner in (outer.values() if isinstance(outer, dict) else outer)
            if isinstance(inner, (dict, list))
        ]
    if level:
        raise deep
    return data


def nearest(word: str, words: Sequence[str]) -> str:
    """ "did you mean x?" and the accepted words where they are few."""
    close = get_close_matches(word, words, n=1, cutoff=0.6)
    some = ", ".join(words[:12]) + (" …" if len(words) > 12 else "")
    if not close:
        return f"use one of {some}"
    return f"did you mean {close[0]}?" + (f" (one of {some})" if 1 < len(words) <= 6 else "")


def match_key(
    section: type[Section], key: str, where: str, path: str, bare_si: bool = False
) -> tuple[str, str]:
    """Field and unit suffix ("" for none) that a TOML key names; InputError otherwise.

    bare_si: whether quantities may come without a unit, in SI.
    """
    names = sorted(section.model_fields, key=len, reverse=True)
    for name in names:
        quantity = quantity_of(section, name)
        if key == name and (bare_si or quantity is None):
            return name, ""
        if quantity is None:
            continue
        good = ", ".join(f"{name}_{s}" for s in quantity.suffixes)
        if key == name:
            raise InputError(where, path, f"has no unit ({quantity.dimension})", f"write {good}")
        if key.startswith(f"{name}_"):
            suffix = key[len(name) + 1 :]
            if suffix in quantity.suffixes:
                return name, suffix
            if suffix in ALL_SUFFIXES:
                raise InputError(
                    where, path, f"_{suffix} is not a unit of {quantity.dimension}", f"write {good}"
                )
    raise InputError(where, path, "is not a known key", _suggest(section, key))


def _suggest(section: type[Section], key: str) -> str:
    usual = {usual_key(section, name): name for name in section.model_fields}
    close = get_close_matches(key, list(usual), n=1, cutoff=0.6)
    if not close:
        stem = next((key[: -len(s) - 1] for s in ALL_SUFFIXES if key.endswith(f"_{s}")), key)
        names = get_close_matches(stem, list(usual.values()), n=1, cutoff=0.6)
        close = [usual_key(section, names[0])] if names else []
    if close:
        return f"did you mean {close[0]}?"
    return nearest(key, list(usual) if len(usual) < 60 else accepted_keys(section))


def to_si(
    section: type[Section],
    data: Any,
    where: str,
    written: Written,
    path: str = "",
    at: str = "",
    bare_si: bool = False,
) -> dict[str, Any]:
    """Data of one section with field names as keys and SI values.

    path: how the user names the section ("stage.sun."), at: the same with field names; bare_si: see
    ``match_key``.
    """
    if not isinstance(data, Mapping):
        name = path.rstrip(".") or "case"
        raise InputError(where, name, "is not a section", f"write it as [{name}] with keys below")
    out: dict[str, Any] = {}
    for key, value in data.items():
        full = f"{path}{key}"
        name, suffix = match_key(section, str(key), where, full, bare_si)
        if name in out:
            earlier = written[at + name][1]
            raise InputError(where, full, f"is given twice, also as {earlier}", "keep one of them")
        written[at + name] = (where, full, suffix, value)
        inner, quantity = section_of(section, name), quantity_of(section, name)
        single = isinstance(value, Mapping) and takes_one(section, name)
        if inner is not None and is_list(section, name) and not single:
            if not isinstance(value, list):
                raise InputError(where, full, "is not a list", f"write [[{full}]] for each")
            out[name] = tuple(
                to_si(inner, v, where, written, f"{full}[{k}].", f"{at}{name}.{k}.", bare_si)
                for k, v in enumerate(value)
            )
        elif inner is not None:
            if not isinstance(value, Mapping):
                raise _no_section(section, key, full, where)
            out[name] = to_si(inner, value, where, written, f"{full}.", f"{at}{name}.", bare_si)
        elif quantity is not None and suffix:
            out[name] = _numbers(value, quantity, suffix, is_list(section, name), where, full)
        else:
            out[name] = _tuples(value, where, full)
    return out


def _no_section(section: type[Section], key: str, full: str, where: str) -> InputError:
    """For a value at the key of a section; a key beside it that is spelled alike may be meant."""
    plain = [n for n in section.model_fields if section_of(section, n) is None]
    alike = get_close_matches(key, plain, n=1, cutoff=0.8)
    meant = f"did you mean {usual_key(section, alike[0])}? Or " if alike else ""
    remedy = f"{meant}write it as [{full}] with keys below"
    return InputError(where, full, "is not a section", remedy)


def _tuples(value: Any, where: str, key: str) -> Any:
    """Lists as tuples; InputError for whole numbers beyond what arrays can hold."""
    if isinstance(value, list):
        return tuple(_tuples(v, where, key) for v in value)
    if isinstance(value, int) and abs(value) >= MOST_WHOLE:
        raise InputError(where, key, f"{echo(value)} is too large", "correct it")
    return value


def _numbers(value: Any, quantity: Quantity, suffix: str, many: bool, where: str, key: str) -> Any:
    if isinstance(value, list):
        if not many:
            raise InputError(where, key, "is a list", "give one number")
        return tuple(_numbers(v, quantity, suffix, True, where, key) for v in value)
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise InputError(where, key, f"{echo(value)} is not a number", f"give a number in {suffix}")
    try:
        return quantity.to_si(float(value), suffix)
    except OverflowError:
        raise InputError(where, key, f"{echo(value)} is too large", "correct it") from None


@dataclass(frozen=True)
class FieldPath:
    """The field that a dotted key names: names of fields and numbers of list elements on the way to
    it; its section and its name there; unit of the key, "" for none."""

    path: tuple[str | int, ...]
    section: type[Section]
    name: str
    suffix: str

    @property
    def is_element(self) -> bool:
        """Whether the key ends in the number of an element of a list."""
        return isinstance(self.path[-1], int)

    @property
    def is_section(self) -> bool:
        """Whether there are keys below it."""
        return section_of(self.section, self.name) is not None


def field_path(root: type[Section], key: str, where: str) -> FieldPath:
    """Of a key such as "stages.0.face_width_mm" or "stages.0.errors.pin_radial_um.2"; InputError
    where there is no such field. Whole numbers pick an element of a list."""
    section: type[Section] | None = root
    owner, parts, path, name, suffix = root, key.split("."), list[str | int](), "", ""
    for k, part in enumerate(parts):
        seen = ".".join(parts[:k])
        if is_place(part) and path and isinstance(path[-1], str):
            if not is_list(owner, name):
                raise InputError(where, key, f"{seen} is not a list", "cut the number")
            path.append(int(part))
            continue
        if section is None:
            raise InputError(where, key, f"{seen} has no keys below it", "cut it")
        owner = section
        name, suffix = match_key(owner, part, where, ".".join(parts[: k + 1]))
        path.append(name)
        section = section_of(owner, name)
    return FieldPath(tuple(path), owner, name, suffix)


def override_data(
    root: type[Section], key: str, value: object, written: Written
) -> tuple[tuple[str | int, ...], Any]:
    """SI path and value of one override such as "stages.0.face_width_mm" = "400" or 400; for "" or
    None ``UNSET``: the key, section or list element that ``changed`` then takes out."""
    where = "--set"
    field = field_path(root, key, where)
    if value is None or (isinstance(value, str) and not value):
        return field.path, UNSET
    parts, path = key.split("."), field.path
    if field.is_element:
        if field.is_section:
            raise InputError(where, key, "ends in the number of a list element", "name a key of it")
        parts, path = parts[:-1], path[:-1]
    prefix, at = ("".join(f"{p}." for p in names[:-1]) for names in (parts, path))
    raw = _value(value, where, key) if isinstance(value, str) else lists_of(value)
    raw = [raw] if field.is_element else raw
    data = to_si(field.section, {parts[-1]: raw}, where, written, prefix, at)[field.name]
    return field.path, data[0] if field.is_element else data


def lists_of(value: object) -> Any:
    """Values of Python as a TOML file gives them: lists for sequences and arrays, plain numbers."""
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, Mapping):
        return {str(key): lists_of(inner) for key, inner in value.items()}
    return [lists_of(v) for v in value] if isinstance(value, list | tuple | range) else value


def is_place(part: str) -> bool:
    """Whether a part of a key counts elements of a list."""
    return part.isascii() and part.isdigit() and len(part) < 10


def _value(text: str, where: str, key: str) -> Any:
    """The text as a TOML value where it is one, else as a word."""
    try:
        tomllib.loads(f"x = {text}")
    except tomllib.TOMLDecodeError:
        return text
    except (ValueError, RecursionError):
        pass
    return parse_toml(f"x = {text}", where, key)["x"]


def changed(
    data: Any,
    path: Sequence[str | int],
    value: Any,
    where: str,
    key: str,
    name: str = "",
    planets: Any = 1,
) -> Any:
    """Nested SI data with one value at ``path``, or without what is there for ``UNSET``; sections
    on the way are made, list elements are not, but those of planets. name: of the key that holds
    ``data``; planets: of the stage that does."""
    part, *rest = path
    if isinstance(part, int):
        data = each_planet(name, () if data is None else data, planets)
        elements = list(data) if isinstance(data, (list, tuple)) else [data]
        if part >= len(elements):
            problem = f"{name} has {len(elements)} elements"
            raise InputError(where, key, problem, "elements are counted from 0")
        if rest:
            elements[part] = changed(elements[part], rest, value, where, key)
        else:
            elements[part : part + 1] = () if value is UNSET else (value,)
        return tuple(elements)
    if isinstance(data, tuple) and data:
        problem, remedy = f"{name} is a list", f"name one of it: {name}.0.{part}"
        raise InputError(where, key, problem, remedy)
    section = dict(data or {})
    planets = section.get("planets", planets)
    if rest and not (value is UNSET and not section.get(part)):
        section[part] = changed(section.get(part), rest, value, where, key, part, planets)
    elif not rest and value is not UNSET:
        section[part] = value
    elif not rest:
        section.pop(part, None)
    return section


def numbered(key: str, data: Mapping[str, Any], where: str) -> list[str]:
    """Parts of a dotted key with stages by number: stage.planets -> stages, 0, planets.

    data: that of the case, with ``stages``. where: named in an InputError.
    """
    stages = data.get("stages", ())
    if key == "stage":
        raise InputError(where, key, "is a section, not a key", "name a key of it: stage.planets")
    parts = key.split(".")
    if parts[0] == "stage":
        if len(stages) != 1:
            raise InputError(
                where, key, f"there are {len(stages)} stages", "write stages.NAME. or stages.0."
            )
        return ["stages", "0", *parts[1:]]
    if parts[0] == "stages" and len(parts) > 1 and not is_place(parts[1]):
        names = [s.get("name") or f"stage_{k}" for k, s in enumerate(stages, 1)]
        if parts[1] not in names:
            raise InputError(
                where, key, f"no stage is named {echo(parts[1])}", nearest(parts[1], names)
            )
        return ["stages", str(names.index(parts[1])), *parts[2:]]
    return parts


def of_only_stage(fault: InputError) -> InputError:
    """A fault of a file with [stage], whose keys it names as that file does."""
    texts = (fault.key, fault.problem, fault.remedy)
    named = (t.replace("stages[0]", "stage").replace("stages.0", "stage") for t in texts)
    return InputError(fault.where, *named)
