"""Keys of case files with meaning, unit and limits, as rows and as a JSON schema.

Meanings are read from the docstrings of sections, in which "name: " after a full stop, semicolon
or bracket begins the description of a field.
"""

import inspect
import re
from dataclasses import dataclass
from functools import cache
from typing import Any

from flexgear.model.case import Case
from flexgear.model.load_cases import LoadCase
from flexgear.model.section import Section, is_list, quantity_of, section_of, takes_one
from flexgear.model.stage import Stage
from flexgear.model.units import Quantity, unit_name

_NAME = r"[a-z][a-z0-9_]*(?: \([^()]*\))?"  # with a remark: tilt_inertia (about a diameter)
_HEAD = re.compile(rf"(?:^|(?<=[.;)] ))({_NAME}(?:, {_NAME})*): ")
_WORD = re.compile(r"^([a-z][a-z0-9_-]*) {2,}(\S.*)$", re.MULTILINE)


def meaning(section: type[Section], name: str) -> str:
    """Meaning of a field from the docstrings, "" if there is none."""
    description = section.model_fields[name].description
    for cls in _sources(section):
        description = description or _meanings(cls).get(name)
    return description or ""


def prose(section: type[Section]) -> str:
    """The part of a section's docstring that describes the section, without fields."""
    paragraphs = _paragraphs(section)
    return "\n\n".join(p for p in (_before_keys(section, p) for p in paragraphs) if p)


def words(section: type[Section], name: str) -> dict[str, str]:
    """Words that a field accepts, with their meanings, if a docstring lists them."""
    annotation = str(section.model_fields[name].annotation)
    meanings: dict[str, str] = {}
    for cls in reversed(_sources(section)):
        listed = _listed(cls)
        if listed and all(f"'{word}'" in annotation for word in listed):
            meanings |= listed
    return meanings


def _sources(section: type[Section]) -> tuple[type[Section], ...]:
    """The section, its base sections, and the sections in ``same_as``, whose fields it repeats."""
    classes = [c for c in section.__mro__ if issubclass(c, Section) and c is not Section]
    return (*classes, *(other for cls in classes for other in getattr(cls, "same_as", ())))


def _paragraphs(section: type[Section]) -> list[str]:
    return inspect.cleandoc(section.__dict__.get("__doc__") or "").split("\n\n")


def _before_keys(section: type[Section], paragraph: str) -> str:
    """The part of a paragraph before the first field's description."""
    if _is_list(paragraph):
        return ""
    text = " ".join(paragraph.split())
    heads = _heads(section, text)
    return text[: heads[0].start()].strip() if heads else text


def _heads(section: type[Section], text: str) -> list[re.Match[str]]:
    """Matches of "name: " or "one, other: ", which begin the descriptions of fields."""
    fields = section.model_fields
    return [m for m in _HEAD.finditer(text) if _names(m).keys() <= fields.keys()]


def _names(head: re.Match[str]) -> dict[str, str]:
    """Fields in a match of ``_HEAD``, each with its remark in brackets."""
    parts = (re.fullmatch(r"(\w+)(?: \((.*)\))?", p) for p in re.findall(_NAME, head[1]))
    return {p[1]: p[2] or "" for p in parts if p}


@cache
def _meanings(section: type[Section]) -> dict[str, str]:
    """Meanings of fields in the docstring of a section, by field."""
    meanings: dict[str, str] = {}
    for paragraph in _paragraphs(section):
        text = " ".join(paragraph.split())
        heads = _heads(section, text)
        ends = [*(m.start() for m in heads[1:]), len(text)]
        for head, end in zip(heads, ends, strict=False):
            meaning = text[head.end() : end].strip().rstrip(";.,")
            meanings |= {n: f"{meaning} ({r})" if r else meaning for n, r in _names(head).items()}
    return meanings


def _is_list(paragraph: str) -> bool:
    return bool(_WORD.match(paragraph))


@cache
def _listed(section: type[Section]) -> dict[str, str]:
    """Meanings of words in the docstring of a section, by word."""
    meanings: dict[str, str] = {}
    for paragraph in filter(_is_list, _paragraphs(section)):
        word = ""
        for line in paragraph.splitlines():
            begins = _WORD.match(line)
            word = begins[1] if begins else word
            meanings[word] = (
                f"{meanings.get(word, '')} {begins[2] if begins else line.strip()}".strip()
            )
    return meanings


# fields that are set when a file is read
NOT_WRITTEN = {(Case, "source"), (LoadCase, "source"), (LoadCase, "line")}


@dataclass(frozen=True)
class Key:
    """A key of a section.

    schema: JSON schema of its value in SI. inner: section that it holds, several: a list of
    sections, one_too: or a single one. meaning: description without unit and range.
    """

    name: str
    quantity: Quantity | None
    schema: dict[str, Any]
    required: bool
    inner: type[Section] | None
    several: bool
    one_too: bool
    meaning: str

    @property
    def spellings(self) -> dict[str, str]:
        """Names of the key in a file with their unit suffix ("" for none), the usual one first."""
        if self.quantity is None:
            return {self.name: ""}
        return {f"{self.name}_{s}": s for s in self.quantity.suffixes}

    @property
    def default(self) -> Any:
        """Default in SI; None if there is none that can be written in TOML."""
        return self.schema.get("default")

    def in_unit(self, suffix: str) -> dict[str, Any]:
        """``schema`` with limits and default in a unit."""
        if self.quantity is None:
            return self.schema
        scaled = _scaled(self.schema, self.quantity, suffix)
        assert isinstance(scaled, dict)
        return scaled


@cache
def keys(section: type[Section]) -> tuple[Key, ...]:
    """Keys of a section in the order of its fields."""
    properties = section.model_json_schema(ref_template="{model}")["properties"]
    written = []
    for name, field in section.model_fields.items():
        if (section, name) in NOT_WRITTEN:
            continue
        inner = section_of(section, name)
        key = Key(
            name=name,
            quantity=quantity_of(section, name),
            schema={} if inner else _writable(properties[name]),
            required=field.is_required(),
            inner=inner,
            several=inner is not None and is_list(section, name),
            one_too=takes_one(section, name),
            meaning=meaning(section, name),
        )
        written.append(key)
    return tuple(written)


def sections(root: type[Section] = Case) -> list[type[Section]]:
    """The section and all nested sections, each once, in the order of first use."""
    classes: list[type[Section]] = []
    stack = [root]
    while stack:
        section = stack.pop(0)
        if section not in classes:
            classes.append(section)
            inner = (section_of(section, name) for name in section.model_fields)
            stack = [*filter(None, inner), *stack]
    return classes


def _writable(schema: dict[str, Any]) -> dict[str, Any]:
    """A field's schema without null, which TOML lacks, and without titles and descriptions."""
    choices = [choice for choice in schema.get("anyOf", ()) if choice != {"type": "null"}]
    content = {k: v for k, v in schema.items() if k not in ("title", "description", "anyOf")}
    if content.get("default", 0) in (None, "", []):
        content.pop("default")
    return {
        **content,
        **(choices[0] if len(choices) == 1 else {"anyOf": choices} if choices else {}),
    }


_LIMITS = ("minimum", "maximum", "exclusiveMinimum", "exclusiveMaximum", "default")


def _scaled(schema: Any, quantity: Quantity, suffix: str, key: str = "") -> Any:
    if isinstance(schema, dict):
        return {k: _scaled(v, quantity, suffix, k) for k, v in schema.items()}
    if isinstance(schema, (list, tuple)):
        return [_scaled(v, quantity, suffix, key) for v in schema]
    if key in _LIMITS and isinstance(schema, (int, float)):
        return float(f"{quantity.from_si(schema, suffix):.12g}")
    return schema


Schema = dict[str, Any]
_PART = "-part"  # suffix of sections without required keys, which another case may supply


def json_schema() -> Schema:
    """The schema of a case file."""
    definitions: Schema = {}
    for section in sections():
        if section is not Case:
            needed = [
                {"anyOf": [{"required": [name]} for name in key.spellings]}
                for key in keys(section)
                if key.required
            ]
            definitions[section.__name__] = {
                **_table(section, ""),
                **({"allOf": needed} if needed else {}),
            }
            definitions[section.__name__ + _PART] = _table(section, _PART)
    taken = {"required": ["case"]}
    whole = {"$ref": f"#/definitions/{Stage.__name__}"}
    stage = {
        "allOf": [{"$ref": f"#/definitions/{Stage.__name__}{_PART}"}, {"if": taken, "else": whole}]
    }
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


def _table(section: type[Section], of: str) -> Schema:
    """Schema of a section's keys, none of them required. of: suffix of referenced definitions."""
    properties: Schema = {}
    for key in keys(section):
        properties |= _spelled(key, of)
    return {"type": "object", "properties": properties, "additionalProperties": False}


def _spelled(key: Key, of: str) -> Schema:
    """Schemas of a key by its spellings, one for each unit."""
    if key.inner is None:
        schemas = {}
        for written, suffix in key.spellings.items():
            description = ", ".join(filter(None, (key.meaning, unit_name(suffix))))
            schemas[written] = {**key.in_unit(suffix), "description": description}
        return schemas
    definition: Schema = {"$ref": f"#/definitions/{key.inner.__name__}{of}"}
    if key.several:
        many = {"type": "array", "items": definition, "description": key.meaning}
        definition = {"anyOf": [definition, many]} if key.one_too else many
    return {key.name: definition}
