"""A Document from the data of a .rexsj file."""

from __future__ import annotations

from typing import Any

from flexgear.files.rexs.checked import Checked
from flexgear.files.rexs.coded import decoded
from flexgear.files.rexs.document import Attribute, Component, Document, LoadCase, Relation
from flexgear.model.errors import InputError, echo

_KNOWN = ("version", "applicationId", "applicationVersion", "applicationLanguage", "date",
          "relations", "components", "load_spectrum", "accumulation")  # fmt: skip


def document_of_json(data: Any, where: str) -> Document:
    """The model of parsed JSON. InputError for what is no REXS model."""
    model = data.get("model") if isinstance(data, dict) else None
    if not isinstance(model, dict):
        raise InputError(where, "model", "is missing", 'a .rexsj file begins with {"model": {…')
    checked = Checked(where)
    checked.other += [f'"{key}"' for key in model if key not in _KNOWN]
    for part in _list(model, "components", where):
        attributes = [_attribute(a, where) for a in _list(part, "attributes", where)]
        checked.component(
            Component(
                checked.whole(part.get("id"), "component id"),
                str(part.get("type", "")),
                str(part.get("name", "") or ""),
                {a.id: a for a in attributes},
            )
        )
    for part in _list(model, "relations", where):
        refs = [
            (str(ref.get("role", "")), checked.whole(ref.get("id"), "ref id"))
            for ref in _list(part, "refs", where)
        ]
        checked.relation(
            Relation(
                checked.whole(part.get("id"), "relation id"),
                str(part.get("type", "")),
                checked.whole(part.get("order", 0), "relation order"),
                tuple(refs),
            )
        )
    for spectrum in _list(model, "load_spectrum", where):
        number = checked.whole(spectrum.get("id", 1), "load_spectrum id")
        for case in _list(spectrum, "load_cases", where):
            key = checked.whole(case.get("id", 1), "load_case id")
            attributes_of = _attributes_of(case, f"load case {key}", checked)
            checked.load_case(LoadCase(number, key, attributes_of))
        for total in _list(spectrum, "accumulation", where):
            checked.accumulation(_attributes_of(total, "", checked))
    for total in _list(model, "accumulation", where):
        checked.accumulation(_attributes_of(total, "", checked))
    program = (model.get("applicationId"), model.get("applicationVersion"))
    application = echo(" ".join(str(s) for s in program if s))[1:-1]
    return checked.document(str(model.get("version", "")), application)


def _list(data: dict[str, Any], key: str, where: str) -> list[dict[str, Any]]:
    """A list of objects, one object as such a list, nothing for a key that is missing."""
    listed = data.get(key)
    items = listed if isinstance(listed, list) else [] if listed is None else [listed]
    if not all(isinstance(item, dict) for item in items):
        raise InputError(where, key, "is not a list of objects", "is this a REXS file?")
    return items


def _attributes_of(
    data: dict[str, Any], text: str, checked: Checked
) -> list[tuple[int, Attribute]]:
    return [
        (checked.whole(part.get("id"), "component id"), _attribute(a, checked.where, text))
        for part in _list(data, "components", checked.where)
        for a in _list(part, "attributes", checked.where)
    ]


def _attribute(data: dict[str, Any], where: str, load_case: str = "") -> Attribute:
    values = [v for key, v in data.items() if key not in ("id", "unit")]
    return Attribute(
        str(data.get("id", "")),
        str(data.get("unit", "") or ""),
        _value(values[0] if values else ""),
        load_case,
    )


def _value(value: Any) -> str | tuple[str, ...] | None:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, (int, float, str)):
        return str(value) if isinstance(value, str) else repr(value)
    if isinstance(value, list) and not any(isinstance(x, (list, dict)) for x in value):
        return tuple(str(x) for x in value)
    if isinstance(value, dict) and {"code", "value"} <= value.keys():
        return decoded(str(value["code"]), str(value["value"]))
    return None if value is not None else ""
