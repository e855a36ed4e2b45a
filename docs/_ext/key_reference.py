"""Writes the page of all keys of a case from the model, before Sphinx reads its sources."""

from pathlib import Path

from sphinx.application import Sphinx

from flexgear.model.case import Case
from flexgear.model.schema import Key, keys, prose, sections, words
from flexgear.model.section import Section, section_of
from flexgear.model.units import unit_name

HEAD = """# Keys of a case

Made from the model. A key is written with one of its units, `face_width_mm = 430` or
`face_width_m = 0.43`; ranges and defaults are in the first one. What has no default and is not
needed follows from the case.
"""
LIMITS = (("minimum", "≥"), ("exclusiveMinimum", ">"), ("maximum", "≤"), ("exclusiveMaximum", "<"))


def page() -> str:
    """The whole page in MyST."""
    places = _places()
    return HEAD + "".join(_section(s, places[s]) for s in sections())


def _places() -> dict[type[Section], list[str]]:
    """Where each section stands in a case."""
    places: dict[type[Section], list[str]] = {Case: []}
    rest: list[tuple[type[Section], str]] = [(Case, "")]
    while rest:
        section, path = rest.pop(0)
        for name in section.model_fields:
            inner = section_of(section, name)
            if inner is None:
                continue
            at = f"{path}.{name}".lstrip(".")
            places.setdefault(inner, []).append(at)
            rest.append((inner, at))
    return places


def _section(section: type[Section], places: list[str]) -> str:
    title = "The case" if section is Case else section.__name__
    lines = [f"\n({_anchor(section)})=\n## {title}\n"]
    if places:
        lines.append("At " + ", ".join(f"`{p}`" for p in places) + ".\n")
    lines.append(prose(section).replace("``", "`").replace("<", r"\<") + "\n")
    lines.append("| key | default | range | meaning |\n|---|---|---|---|")
    lines += [_row(section, key) for key in keys(section)]
    return "\n".join(lines) + "\n"


def _row(section: type[Section], key: Key) -> str:
    spellings = list(key.spellings.items())
    name, unit = spellings[0]
    more = ", ".join(f"`_{s}`" for _, s in spellings[1:])
    written = f"`{name}`" + (f" {more}" if more else "")
    schema = key.in_unit(unit)
    meaning = key.meaning + (f" ({unit_name(unit)})" if unit_name(unit) else "")
    choices = "".join(f"; *{word}*: {text}" for word, text in words(section, key.name).items())
    cells = [written, _default(key, schema), _range(key, schema), meaning + choices]
    return "| " + " | ".join(c.replace("|", r"\|").replace("``", "`") for c in cells) + " |"


def _default(key: Key, schema: dict) -> str:
    if key.required:
        return "needed"
    return f"`{_value(schema['default'])}`" if "default" in schema else ""


def _value(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(map(_value, value)) + "]"
    return (
        f"{value:g}"
        if isinstance(value, float)
        else f'"{value}"'
        if isinstance(value, str)
        else str(value)
    )


def _range(key: Key, schema: dict) -> str:
    if key.inner is not None:
        kind = "section or list of them" if key.one_too else "list" if key.several else "section"
        return f"{kind} [{key.inner.__name__}](#{_anchor(key.inner)})"
    if "enum" in schema:
        return ", ".join(f'`"{word}"`' for word in schema["enum"])
    if "const" in schema:
        return f'`"{schema["const"]}"`'
    kind = {"boolean": "`true`, `false`", "string": "text", "array": "list", "integer": "whole"}
    ends = ", ".join(f"{sign} {schema[name]:.6g}" for name, sign in LIMITS if name in schema)
    return " ".join(filter(None, [kind.get(schema.get("type", ""), ""), ends]))


def _anchor(section: type[Section]) -> str:
    return f"key-{section.__name__.lower()}"


def _write(app: Sphinx) -> None:
    out = Path(app.srcdir, "_generated", "keys.md")
    out.parent.mkdir(exist_ok=True)
    text = page()
    if not out.exists() or out.read_text() != text:
        out.write_text(text)


def setup(app: Sphinx) -> dict:
    """Before sources are looked for."""
    app.connect("config-inited", lambda app, _: _write(app))
    return {"parallel_read_safe": True}
