"""Conversion of TOML text and overrides to plain data in SI.

``to_si`` converts units by the endings of the keys and records how each key was written, so that
later messages can name it.
"""

import re
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
from flexgear.model.units import ALL_SUFFIXES, Quantity, unit_name

MAX_NESTING = 32  # levels of lists and sections
MAX_INTEGER = 2**63
UNKNOWN = "is not a known key"
UNSET = object()  # value of an override that deletes its key


# how the user wrote each field: SI path "stage.face_width" -> (where, key, unit, value)
Written = dict[str, tuple[str, str, str, Any]]


_TWICE = re.compile(r"Cannot (overwrite a value|[a-z ]+ \(.*?\)( twice)?)")  # Python's words


def parse_toml(text: str, where: str, key: str = "TOML") -> dict[str, Any]:
    """Parse TOML; InputError for invalid text, with the line of a syntax error, and for lists that
    are nested too deeply."""
    problem = f"lists are nested more than {MAX_NESTING} deep"
    too_deep = InputError(where, key, problem, "flatten them")
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as fault:
        problem = _TWICE.sub("a key or section is there already", str(fault).splitlines()[0])
        raise InputError(where, key, problem, "correct the syntax there") from None
    except ValueError:  # Python reads no integers of more than 4 300 digits
        problem = "a whole number has thousands of digits"
        raise InputError(where, key, problem, "correct it") from None
    except RecursionError:
        raise too_deep from None
    level: list[Any] = [data]
    for _ in range(MAX_NESTING):
        level = [
            inner
            for outer in level
            for inner in (outer.values() if isinstance(outer, dict) else outer)
            if isinstance(inner, (dict, list))
        ]
    if level:
        raise too_deep
    return data


def nearest(word: str, words: Sequence[str]) -> str:
    """ "did you mean x?" for the nearest word, else the accepted words, for messages."""
    close = get_close_matches(word, words, n=1, cutoff=0.6)
    some = ", ".join(words[:12]) + (" …" if len(words) > 12 else "")
    if not close:
        return f"use one of {some}"
    return f"did you mean {close[0]}?" + (f" (one of {some})" if 1 < len(words) <= 6 else "")


def match_key(
    section: type[Section], key: str, where: str, path: str, bare_si: bool = False
) -> tuple[str, str]:
    """Field and unit suffix ("" for none) of a TOML key; InputError for an unknown key or unit.
    bare_si: whether keys without a unit are accepted for quantities in SI."""
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
                problem = f"_{suffix} is not a unit of {quantity.dimension}"
                raise InputError(where, path, problem, f"write {good}")
    for pattern, (problem, remedy) in section.absent.items():
        if re.match(pattern, key):
            raise InputError(where, path, problem, remedy)
    raise InputError(where, path, UNKNOWN, _suggest(section, key))


def _suggest(section: type[Section], key: str) -> str:
    """Remedy for an unknown key: the nearest key, with the unit of this one where that is known;
    where no key is near, all of them, required ones first."""
    fields = sorted(section.model_fields.items(), key=lambda item: not item[1].is_required())
    usual = {usual_key(section, name): name for name, _ in fields}
    keys = accepted_keys(section)
    unit = next((s for s in ALL_SUFFIXES if key.endswith(f"_{s}")), "")
    close = get_close_matches(key, keys, n=1, cutoff=0.6)
    if close:
        name, _ = match_key(section, close[0], "", "")
        if key.startswith(f"{name}_"):  # a misspelt unit
            return f"did you mean {close[0]}?"
    else:
        names = get_close_matches(key.removesuffix(f"_{unit}"), usual.values(), n=1, cutoff=0.6)
        if not names:
            return nearest(key, list(usual) if len(usual) < 60 else keys)
        name = names[0]
    same_unit = f"{name}_{unit}"
    return f"did you mean {same_unit if same_unit in keys else usual_key(section, name)}?"


def to_si(
    section: type[Section],
    data: Any,
    where: str,
    written: Written,
    path: str = "",
    at: str = "",
    bare_si: bool = False,
) -> dict[str, Any]:
    """Data of a section with field names as keys and SI values.

    path: prefix of the section's keys as the user writes them ("stage.sun."); at: the same prefix
    with field names; bare_si: see ``match_key``.
    """
    if not isinstance(data, Mapping):
        name = path.rstrip(".") or "case"
        remedy = f"write it as {table_header(name)} with keys below"
        raise InputError(where, name, "is not a section", remedy)
    converted: dict[str, Any] = {}
    for key, value in data.items():
        full = f"{path}{key}"
        try:
            name, suffix = match_key(section, str(key), where, full, bare_si)
        except InputError as fault:
            missing = _missing_words(section, data) if isinstance(value, str) else []
            if len(missing) != 1 or fault.problem != UNKNOWN or "did you mean" in fault.remedy:
                raise
            problem = f"{UNKNOWN}, and {missing[0]} is missing"
            raise InputError(where, full, problem, f"did you mean {missing[0]}?") from None
        if name in converted:
            earlier = written[at + name][1]
            raise InputError(where, full, f"is given twice, also as {earlier}", "keep one of them")
        written[at + name] = (where, full, suffix, value)
        inner, quantity = section_of(section, name), quantity_of(section, name)
        single = isinstance(value, Mapping) and takes_one(section, name)
        if inner is not None and is_list(section, name) and not single:
            if not isinstance(value, list):
                remedy = f"write {table_header(full, is_list=True)} for each"
                raise InputError(where, full, "is not a list", remedy)
            converted[name] = tuple(
                to_si(inner, v, where, written, f"{full}[{k}].", f"{at}{name}.{k}.", bare_si)
                for k, v in enumerate(value)
            )
        elif inner is not None:
            if not isinstance(value, Mapping):
                raise _not_a_section(section, key, full, where)
            inner_at = f"{at}{name}."
            converted[name] = to_si(inner, value, where, written, f"{full}.", inner_at, bare_si)
        elif quantity is not None and suffix:
            several = is_list(section, name)
            converted[name] = _numbers(value, quantity, suffix, several, where, full)
        else:
            converted[name] = tuples_of(value, where, full)
    return converted


def _missing_words(section: type[Section], data: Mapping[str, Any]) -> list[str]:
    """Required keys of a section for text values that its data do not have."""
    fields = section.model_fields.items()
    return [n for n, f in fields if f.is_required() and f.annotation is str and n not in data]


def _not_a_section(section: type[Section], key: str, full: str, where: str) -> InputError:
    """InputError for a value at the key of a section; it suggests a similar key with a value."""
    names = [n for n in section.model_fields if section_of(section, n) is None]
    similar = get_close_matches(key, names, n=1, cutoff=0.8)
    suggestion = f"did you mean {usual_key(section, similar[0])}? Or " if similar else ""
    remedy = f"{suggestion}write it as {table_header(full)} with keys below"
    return InputError(where, full, "is not a section", remedy)


def table_header(path: str, is_list: bool = False) -> str:
    """Header by which TOML begins the table, or each table of a list, at the path of a key: for
    "stages[2].sun" "[stages.sun] below [[stages]] number 3"."""
    name, element = re.sub(r"\[\d+\]", "", path), re.search(r"\[(\d+)\]$", path)
    header = f"[[{name}]]" if is_list or element else f"[{name}]"
    if element:
        header += f" number {int(element[1]) + 1}"
    outer = re.match(r".*\](?=.)", path)
    return f"{header} below {table_header(outer[0])}" if outer else header


def tuples_of(value: Any, where: str, key: str) -> Any:
    """A value with tuples in place of lists, at every depth; InputError for an integer that is too
    large for arrays."""
    if isinstance(value, list):
        return tuple(tuples_of(v, where, key) for v in value)
    if isinstance(value, dict):
        return {name: tuples_of(v, where, key) for name, v in value.items()}
    if isinstance(value, int) and abs(value) >= MAX_INTEGER:
        raise InputError(where, key, f"{echo(value)} is too large", "correct it")
    return value


def _numbers(
    value: Any, quantity: Quantity, suffix: str, several: bool, where: str, key: str
) -> Any:
    """A number, or nested tuples of numbers if the field is a list (several), in SI."""
    if isinstance(value, list):
        if not several:
            raise InputError(where, key, "is a list", "give one number")
        return tuple(_numbers(v, quantity, suffix, True, where, key) for v in value)
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        remedy = f"give a number in {unit_name(suffix) or 'SI units'}"
        raise InputError(where, key, f"{echo(value)} is not a number", remedy)
    try:
        return quantity.to_si(float(value), suffix)
    except OverflowError:
        raise InputError(where, key, f"{echo(value)} is too large", "correct it") from None


@dataclass(frozen=True)
class FieldPath:
    """A field by its dotted key. path: names of fields and indices of list elements. section, name:
    section and name of the field. suffix: unit of the key, "" for none."""

    path: tuple[str | int, ...]
    section: type[Section]
    name: str
    suffix: str

    @property
    def is_element(self) -> bool:
        """Whether the key ends in the index of a list element."""
        return isinstance(self.path[-1], int)

    @property
    def is_section(self) -> bool:
        """Whether the field is a section."""
        return section_of(self.section, self.name) is not None


def field_path(root: type[Section], key: str, where: str) -> FieldPath:
    """The field of a key such as "stages.0.face_width_mm" or "stages.0.errors.pin_radial_um.2".
    Integers are indices of list elements. Raises InputError if there is no such field."""
    section: type[Section] | None = root
    owner, parts, path, name, suffix = root, key.split("."), list[str | int](), "", ""
    for k, part in enumerate(parts):
        prefix = ".".join(parts[:k])
        if is_index(part) and path and isinstance(path[-1], str):
            if not is_list(owner, name):
                raise InputError(where, key, f"{prefix} is not a list", "delete the number")
            path.append(int(part))
            continue
        if section is None:
            raise InputError(where, key, f"{prefix} has no keys below it", f"end it at {prefix}")
        owner = section
        name, suffix = match_key(owner, part, where, ".".join(parts[: k + 1]))
        path.append(name)
        section = section_of(owner, name)
    return FieldPath(tuple(path), owner, name, suffix)


def override_data(
    root: type[Section], key: str, value: object, written: Written
) -> tuple[tuple[str | int, ...], Any]:
    """SI path and value of an override such as "stages.0.face_width_mm" = "400" or 400. The value
    is ``UNSET`` for "" or None, for which ``changed`` deletes key, section or list element."""
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
    """A Python value as parsed TOML: lists for sequences and arrays, Python numbers, dictionaries
    of the keys that are set for sections."""
    if isinstance(value, Section):
        value = value.model_dump(mode="python", exclude_unset=True)
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, Mapping):
        return {str(key): lists_of(inner) for key, inner in value.items()}
    return [lists_of(v) for v in value] if isinstance(value, list | tuple | range) else value


def is_index(part: str) -> bool:
    """Whether a part of a key is the index of a list element."""
    return part.isascii() and part.isdigit() and len(part) < 10


def _value(text: str, where: str, key: str) -> Any:
    """The text parsed as a TOML value, or unchanged if it is not valid TOML."""
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
    """Nested SI data with the value at ``path`` changed, or deleted for ``UNSET``.

    Missing sections are created, missing list elements only in lists of planets. name: key of
    ``data``; planets: number of planets of its stage.
    """
    part, *rest = path
    if isinstance(part, int):
        data = each_planet(name, () if data is None else data, planets)
        elements = list(data) if isinstance(data, (list, tuple)) else [data]
        if part >= len(elements):
            problem = f"{name} has {len(elements)} elements"
            raise InputError(where, key, problem, "elements count from 0")
        if rest:
            elements[part] = changed(elements[part], rest, value, where, key)
        else:
            elements[part : part + 1] = () if value is UNSET else (value,)
        return tuple(elements)
    if isinstance(data, tuple) and data:
        element = key.replace(f"{name}.", f"{name}.0.", 1)
        problem, remedy = f"{name} is a list", f"name an element, such as {element}"
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


def stage_names(data: Mapping[str, Any]) -> list[str]:
    """Names of the stages in the data of a case."""
    return [str(s.get("name") or f"stage_{k}") for k, s in enumerate(data.get("stages", ()), 1)]


def of_each_stage(data: Mapping[str, Any], key: str) -> str:
    """Remedy for a key that does not name its stage: "write one.planets or two.planets"."""
    return f"write {' or '.join(f'{name}.{key}' for name in stage_names(data)[:3] or ['stages.0'])}"


def numbered(key: str, data: Mapping[str, Any], where: str) -> list[str]:
    """Parts of a dotted key with stages by number: stage.planets -> stages, 0, planets. data: data
    of the case, with ``stages``. where: source of the key for InputError."""
    stages = data.get("stages", ())
    if key == "stage":
        raise InputError(where, key, "is a section, not a key", "name a key of it: stage.planets")
    parts = key.split(".")
    if parts[0] == "stage":
        if len(stages) != 1:
            problem = f"there are {len(stages)} stages"
            raise InputError(where, key, problem, of_each_stage(data, ".".join(parts[1:])))
        return ["stages", "0", *parts[1:]]
    if parts[0] == "stages" and len(parts) > 1 and not is_index(parts[1]):
        names = stage_names(data)
        if parts[1] not in names:
            problem = f"no stage is named {echo(parts[1])}"
            raise InputError(where, key, problem, nearest(parts[1], names))
        return ["stages", str(names.index(parts[1])), *parts[2:]]
    return parts


_ONLY_STAGE = {
    "stages[0]": "stage", "stages.0": "stage", " below [[stages]] number 1": "",
    "[stages.": "[stage.",
}  # fmt: skip


def of_only_stage(fault: InputError) -> InputError:
    """The InputError with "stage" for "stages[0]", for files with [stage]."""
    texts = [fault.key, fault.problem, fault.remedy]
    for old, new in _ONLY_STAGE.items():
        texts = [text.replace(old, new) for text in texts]
    return InputError(fault.where, *texts)
