"""JSON schema (draft 7) of a case file, made from the model: for editors, taplo, Even Better TOML.

It knows every key with its units, ranges and words, in the long and in the short form. Relations
between keys are left to ``flexgear check``. What a section must have is asked for but in a stage
that takes the rest from another case.
"""

from __future__ import annotations

from typing import Any

from flexgear.model.case import Case
from flexgear.model.keys import Key, keys, sections
from flexgear.model.section import Section, section_of
from flexgear.model.short_form import ALIASES
from flexgear.model.stage import Stage
from flexgear.model.units import unit_name

Schema = dict[str, Any]
_PART = "-part"  # a section that may lack what another case says


def json_schema() -> Schema:
    """The schema of a case file."""
    definitions: Schema = {}
    for section in sections():
        if section is not Case:
            definitions[section.__name__] = _whole(section)
            definitions[section.__name__ + _PART] = _table(section, _PART)
    taken = {"required": ["case"]}
    whole = {"$ref": f"#/definitions/{Stage.__name__}"}
    stage = {"allOf": [_part(Stage), {"if": taken, "else": whole}]}
    definitions["stage"] = stage
    long = _table(Case, "")["properties"]
    short = _short_sections()
    long["stages"] = {**long["stages"], "items": {"$ref": "#/definitions/stage"}}
    drive = short.pop("drive")["properties"]
    definitions["TorqueHistory"]["properties"] |= drive  # refused in the long form, below
    return {
        "$schema": "http://json-schema.org/draft-07/schema#",
        "title": "Case of flexgear",
        "type": "object",
        "properties": {
            **long,
            "stage": {"$ref": "#/definitions/stage", "description": "The only stage."},
            **short,
        },
        "additionalProperties": False,
        "required": ["material"],
        "allOf": [
            {"oneOf": [{"required": ["stage"]}, {"required": ["stages"]}]},
            {"if": _LONG, "then": _none_of(short, drive), "else": _complete(short)},
        ],
        "definitions": definitions,
    }


_LONG = {
    "anyOf": [
        {"properties": {"kind": {"const": "train"}}, "required": ["kind"]},
        {"required": ["stages"]},
    ]
}


def _none_of(short: Schema, drive: Schema) -> Schema:
    """A case in the long form has no keys of the short one."""
    forbidden: Schema = dict.fromkeys(short, False)
    return {"properties": {**forbidden, "drive": {"properties": dict.fromkeys(drive, False)}}}


def _complete(short: Schema) -> Schema:
    """Sections of the short form have all that they need, unless the stage is of another case."""
    taken = {"properties": {"stage": {"required": ["case"]}}, "required": ["stage"]}
    whole = {
        name: {"$ref": inner["$ref"].removesuffix(_PART)}
        for name, inner in short.items()
        if "$ref" in inner
    }
    return {"if": taken, "else": {"properties": whole}}


def _short_sections() -> Schema:
    """Sections of the short form: each key of ``ALIASES`` as what it stands for."""
    found: Schema = {}
    for short, long in ALIASES[:-1]:
        section: type[Section] = Case
        way = [part for part in long.split(".") if part != "0"]
        for part in way[:-1]:
            inner = section_of(section, part)
            assert inner is not None
            section = inner
        key = next(one for one in keys(section) if one.name == way[-1])
        first, _, second = short.partition(".")
        if not second:
            found[first] = _spelled(key, _PART)[key.name]
            continue
        empty = {"type": "object", "properties": {}, "additionalProperties": False}
        inside = found.setdefault(first, empty)["properties"]
        for written, schema in _spelled(key, _PART).items():
            inside[second + written.removeprefix(key.name)] = schema
    return found


def _part(section: type[Section]) -> Schema:
    return {"$ref": f"#/definitions/{section.__name__}{_PART}"}


def _whole(section: type[Section]) -> Schema:
    """A section with all that it must have."""
    needed = [
        {"anyOf": [{"required": [name]} for name in key.spellings]}
        for key in keys(section)
        if key.required
    ]
    return {**_table(section, ""), **({"allOf": needed} if needed else {})}


def _table(section: type[Section], of: str) -> Schema:
    """A section's keys, none of them necessary. of: which definitions it refers to."""
    properties: Schema = {}
    for key in keys(section):
        properties |= _spelled(key, of)
    return {"type": "object", "properties": properties, "additionalProperties": False}


def _spelled(key: Key, of: str) -> Schema:
    """Key as it may be written, and the schema of its value."""
    if key.inner is None:
        return {
            written: {**key.in_unit(unit), "description": _described(key, unit)}
            for written, unit in key.spellings.items()
        }
    one: Schema = {"$ref": f"#/definitions/{key.inner.__name__}{of}"}
    if key.several:
        many = {"type": "array", "items": one, "description": key.meaning}
        one = {"anyOf": [one, many]} if key.one_too else many
    return {key.name: one}


def _described(key: Key, suffix: str) -> str:
    unit = unit_name(suffix)
    return f"{key.meaning}, {unit}" if unit else key.meaning
