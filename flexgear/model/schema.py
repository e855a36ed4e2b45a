"""JSON schema (draft 7) of a case file, made from the model: for editors, taplo, Even Better TOML.

It knows every key with its units, ranges and words. Relations between keys are left to ``flexgear
check``. What a section must have is asked for but in a stage that takes the rest from another case.
"""

from __future__ import annotations

from typing import Any

from flexgear.model.case import Case
from flexgear.model.keys import Key, keys, sections
from flexgear.model.section import Section
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
    properties = _table(Case, "")["properties"]
    properties["stages"] = {**properties["stages"], "items": {"$ref": "#/definitions/stage"}}
    return {
        "$schema": "http://json-schema.org/draft-07/schema#",
        "title": "Case of flexgear",
        "type": "object",
        "properties": {
            **properties,
            "stage": {"$ref": "#/definitions/stage", "description": "The only stage."},
        },
        "additionalProperties": False,
        "required": ["material"],
        "oneOf": [{"required": ["stage"]}, {"required": ["stages"]}],
        "definitions": definitions,
    }


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
    definition: Schema = {"$ref": f"#/definitions/{key.inner.__name__}{of}"}
    if key.several:
        many = {"type": "array", "items": definition, "description": key.meaning}
        definition = {"anyOf": [definition, many]} if key.one_too else many
    return {key.name: definition}


def _described(key: Key, suffix: str) -> str:
    unit = unit_name(suffix)
    return f"{key.meaning}, {unit}" if unit else key.meaning
