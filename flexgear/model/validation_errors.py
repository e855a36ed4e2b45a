"""Conversion of pydantic's validation errors to InputError: file, key, problem, remedy."""

import re
from itertools import takewhile
from typing import Any, Literal, get_args, get_origin

from pydantic import ValidationError

from flexgear.model.errors import InputError, echo
from flexgear.model.read import UNKNOWN, Written, lists_of, nearest, table_header
from flexgear.model.section import (
    Missing,
    Refusal,
    Section,
    accepted_keys,
    is_list,
    limits_of,
    location,
    quantity_of,
    section_of,
    takes_one,
    usual_key,
)
from flexgear.model.units import Quantity, unit_name

_TYPES = {
    "int_type": "a whole number",
    "int_from_float": "a whole number",
    "float_type": "a number",
    "bool_type": "true or false",
    "string_type": 'text in quotes ("…")',
    "tuple_type": "a list",
    "finite_number": "a finite number",
    "model_type": "a section with keys",
}
MOST_PLACES = 4  # number of sections that a message names
_LIMITS = ("greater_than_equal", "greater_than", "less_than_equal", "less_than")


def input_error(
    root: type[Section], fault: ValidationError, where: str, written: Written
) -> InputError:
    """The InputError for all missing keys of a ValidationError, or else for its first error."""
    missing = [line for line in fault.errors() if _is_missing(line)]
    if len(missing) > 1:
        return _all_missing(root, missing, where)
    first = (missing or fault.errors())[0]
    loc: list[Any] = list(location(first))
    too_few = first["type"] == "missing" and isinstance(loc[-1], int)
    if too_few:  # elements of a list of fixed length
        *loc, length = loc
    spelled, owner, quantity = _spelled(root, loc)
    path = ".".join(str(p) for p in loc)
    where, key, suffix, _ = written.get(path, (where, spelled, "", None))
    kind, context = first["type"], first.get("ctx", {})
    cause = context.get("error")
    if isinstance(cause, Refusal):
        parts = _below(loc, cause.key)
        path = ".".join(str(p) for p in parts)
        where, key, _, _ = written.get(path, (where, _spelled(root, parts)[0], "", None))
        remedy = cause.remedy or f"add {_addition(root, key)}"
        return InputError(where, key, cause.problem, remedy)
    if too_few:
        indices = [line["loc"][-1] for line in fault.errors() if line["type"] == "missing"]
        count = 1 + max(map(int, indices))
        return InputError(where, key, f"has {length} of {count} numbers", f"give {count} numbers")
    if kind == "missing":
        return InputError(where, key, "is missing", f"add {_addition(root, key)}")
    if kind in _LIMITS:
        return _out_of_range(first, owner, loc, quantity, suffix, where, key)
    if kind == "literal_error":
        words = [w.strip(" '") for w in context["expected"].replace(" or ", ", ").split(",")]
        word = lists_of(first["input"])
        remedy = nearest(str(word), [*filter(None, words)])
        return InputError(where, key, f"{echo(word)} is unknown", remedy)
    if kind == "extra_forbidden":
        remedy = nearest(str(loc[-1]), list(owner.model_fields))
        return InputError(where, key, "is not a known key", remedy)
    if kind in ("too_short", "too_long"):
        length = context["actual_length"]
        limits = {"at least": context.get("min_length"), "at most": context.get("max_length")}
        word, limit = next((w, n) for w, n in limits.items() if n is not None)
        problem = f"has {length} elements" if length else "is empty"
        return InputError(where, key, problem, f"give {word} {limit if limit > 1 else 'one'}")
    if kind == "string_pattern_mismatch":
        remedy = "begin with a letter; letters, digits, - and _ may follow"
        return InputError(where, key, f"{echo(first['input'])} is not a valid name", remedy)
    expected = _TYPES.get(kind)
    if expected:
        problem = f"{echo(lists_of(first['input']))} is not {expected}"
        return InputError(where, key, problem, f"give {expected}")
    return InputError(where, key, first["msg"], "correct it")


def _is_missing(line: Any) -> bool:
    required = line["type"] == "missing" and isinstance(line["loc"][-1], str)
    return required or isinstance(line.get("ctx", {}).get("error"), Missing)


def _all_missing(root: type[Section], lines: list[Any], where: str) -> InputError:
    """The InputError for several missing keys."""
    keys: dict[str, None] = {}
    remedies: dict[str, None] = {}
    for line in lines:
        loc: list[Any] = list(location(line))
        cause = line.get("ctx", {}).get("error")
        keys[_spelled(root, _below(loc, cause.key) if cause else loc)[0]] = None
        remedies[(cause and cause.remedy) or "add them"] = None
    if len(keys) == 1:
        key = next(iter(keys))
        return InputError(where, key, "is missing", f"add {_addition(root, key)}")
    remedy = next(iter(remedies)) if len(remedies) == 1 else "add them"
    return InputError(where, ", ".join(keys), "are missing", remedy)


def _addition(root: type[Section], key: str) -> str:
    """Text that adds a missing key: "planets = …", "[stage.sun]" for a section, or with the words
    that the key takes."""
    parts = [part.partition("[")[0] for part in key.split(".")]
    owner: type[Section] | None = root
    for part in parts[:-1]:
        owner = section_of(owner, part) if owner and part in owner.model_fields else None
    name = parts[-1]
    if owner is not None and name in owner.model_fields:
        annotation = owner.model_fields[name].annotation
        if get_origin(annotation) is Literal:
            return f"{name} = …, one of {', '.join(map(str, get_args(annotation)))}"
    if owner is None or name not in owner.model_fields or section_of(owner, name) is None:
        return f"{name} = …"
    return table_header(key, is_list(owner, name) and not takes_one(owner, name))


def _spelled(root: type[Section], loc: list[Any]) -> tuple[str, type[Section], Quantity | None]:
    """A location as a user writes it, with usual units; section and quantity of its last field."""
    text, owner, inner, quantity = "", root, root, None
    for part in loc:
        if isinstance(part, int):
            text += f"[{part}]"
            continue
        owner, has_field = inner, part in inner.model_fields
        text += ("." if text else "") + (usual_key(owner, part) if has_field else part)
        if has_field:
            quantity, inner = quantity_of(owner, part), section_of(owner, part) or owner
    return text, owner, quantity


def _below(loc: list[Any], key: str) -> list[Any]:
    """Location of a dotted key of the section at ``loc``; integers are indices of lists."""
    return [*loc, *(int(p) if p.isdigit() else p for p in key.split("."))]


def _out_of_range(
    first: Any,
    owner: type[Section],
    loc: list[Any],
    quantity: Quantity | None,
    suffix: str,
    where: str,
    key: str,
) -> InputError:
    name = next(p for p in reversed(loc) if isinstance(p, str))
    low, high = limits_of(owner, name)
    value = float(first["input"])
    excluded = " without this end" if value in (low, high) else ""
    if quantity is None or not suffix:
        problem = f"{value:.6g} is outside {_range_text(low, high, '')}{excluded}"
        return InputError(where, key, problem, f"correct it{' (SI)' if quantity else ''}")
    unit = unit_name(suffix)
    in_unit = quantity.from_si(value, suffix)
    limits = [None if x is None else quantity.from_si(x, suffix) for x in (low, high)]
    remedy = "check value and unit"
    for other in quantity.suffixes:
        si = quantity.to_si(in_unit, other)
        if other != suffix and (low is None or si >= low) and (high is None or si <= high):
            remedy = f"check the unit: {name}_{other} = {in_unit:.6g}?"
            break
    problem = f"{in_unit:.6g} {unit} is outside {_range_text(limits[0], limits[1], unit)}{excluded}"
    return InputError(where, key, problem, remedy)


def _range_text(low: float | None, high: float | None, unit: str) -> str:
    left = "-∞" if low is None else f"{low:.4g}"
    right = "∞" if high is None else f"{high:.4g}"
    return f"{left} … {right} {unit}".rstrip()


def _places(section: type[Section], key: str, path: str = "") -> list[str]:
    """Full keys by which all sections below a section accept a TOML key, "stages[0].sun.teeth"."""
    places = [f"{path}{key}"] if path and key in accepted_keys(section) else []
    for name in section.model_fields:
        if inner := section_of(section, name):
            element = "[0]" * (is_list(section, name) and not takes_one(section, name))
            places += _places(inner, key, f"{path}{name}{element}.")
    return places


def with_places(root: type[Section], fault: InputError) -> InputError:
    """The InputError, whose remedy names the nearest section that knows the key, if its own does
    not and another one does; of an element of a list other than ``stages`` only one within it."""
    *at, key = re.sub(r"\[\d+\]|\.\d+(?=\.)", "[0]", fault.key).split(".")

    def distance(place: str) -> int:
        names = place.split(".")[:-1]
        common = takewhile(lambda pair: pair[0] == pair[1], zip(names, at, strict=False))
        return len(names) - 2 * len(list(common))

    places = sorted(_places(root, key), key=distance) if fault.problem == UNKNOWN else []
    if at and at[0].endswith("[0]") and at[0] != "stages[0]":
        places = [place for place in places if place.startswith(f"{at[0]}.")]
    if not places:
        return fault
    stage = re.match(r"stages(\[\d+\]|\.\d+)", fault.key)
    some = ", ".join(places[:MOST_PLACES]).replace("stages[0]", stage[0] if stage else "stages[0]")
    some = some.replace("[0]", ".0") if fault.where in ("--set", "sweep") else some
    similar = f"{fault.remedy} Or " if fault.remedy.startswith("did you mean") else ""
    remedy = f"{similar}write {some}" + " …" * (len(places) > MOST_PLACES)
    return InputError(fault.where, fault.key, fault.problem, remedy)
