"""Every key of a case as it is written in TOML, made from the model itself.

``keys`` says what a section takes: for the key reference of the manual and for the JSON schema
(``json_schema``) that editors complete and check case files with.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from flexgear.model.case import Case
from flexgear.model.meaning import meaning
from flexgear.model.section import Section, is_list, quantity_of, section_of, takes_one
from flexgear.model.units import Quantity

NOT_WRITTEN = {(Case, "source")}  # fields that reading a file sets


@dataclass(frozen=True)
class Key:
    """One field of a section, in the words of a case file.

    schema: JSON schema of its value in SI. inner: the section that it holds; several: a list of
    them, or one where one_too. meaning: without unit and range.
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
        """Key as it is written and its unit's suffix ("" for none), the usual one first."""
        if self.quantity is None:
            return {self.name: ""}
        return {f"{self.name}_{s}": s for s in self.quantity.suffixes}

    @property
    def default(self) -> Any:
        """In SI; None where the key has none that can be written."""
        return self.schema.get("default")

    def in_unit(self, suffix: str) -> dict[str, Any]:
        """``schema`` with limits and default in a unit."""
        if self.quantity is None:
            return self.schema
        scaled = _scaled(self.schema, self.quantity, suffix)
        assert isinstance(scaled, dict)
        return scaled


def keys(section: type[Section]) -> Iterator[Key]:
    """Keys of a section in the order of its fields."""
    properties = section.model_json_schema(ref_template="{model}")["properties"]
    for name, field in section.model_fields.items():
        if (section, name) in NOT_WRITTEN:
            continue
        inner = section_of(section, name)
        yield Key(
            name=name,
            quantity=quantity_of(section, name),
            schema={} if inner else _writable(properties[name]),
            required=field.is_required(),
            inner=inner,
            several=inner is not None and is_list(section, name),
            one_too=takes_one(section, name),
            meaning=meaning(section, name),
        )


def sections(root: type[Section] = Case) -> list[type[Section]]:
    """The section and all below it, each once, in the order in which they are met."""
    classes: list[type[Section]] = []
    rest = [root]
    while rest:
        annotation = rest.pop(0)
        if annotation in classes:
            continue
        classes.append(annotation)
        rest = [
            inner for name in annotation.model_fields if (inner := section_of(annotation, name))
        ] + rest
    return classes


def _writable(schema: dict[str, Any]) -> dict[str, Any]:
    """A field's schema without what TOML cannot write (null) and what is said elsewhere."""
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
