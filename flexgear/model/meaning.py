"""What keys of a case mean: sentences "name: text" in the docstrings of their sections.

A docstring says of its fields "count: rollers of a row; rows, length: …", and of the words that a
field takes "csv   as ramp, …", one a line. The key reference and the JSON schema are made of that.
"""

from __future__ import annotations

import inspect
import re
from functools import cache

from flexgear.model.section import Section

_NAME = r"[a-z][a-z0-9_]*(?: \([^()]*\))?"  # with a remark: tilt_inertia (about a diameter)
_HEAD = re.compile(rf"(?:^|(?<=[.;)] ))({_NAME}(?:, {_NAME})*): ")
_WORD = re.compile(r"^([a-z][a-z0-9_-]*) {2,}(\S.*)$", re.MULTILINE)


def meaning(section: type[Section], name: str) -> str:
    """What a field means, "" where nobody says."""
    description = section.model_fields[name].description
    for cls in _sources(section):
        description = description or _meanings(cls).get(name)
    return description or ""


def prose(section: type[Section]) -> str:
    """What a section's docstring says of it as a whole."""
    paragraphs = _paragraphs(section)
    return "\n\n".join(p for p in (_before_keys(section, p) for p in paragraphs) if p)


def words(section: type[Section], name: str) -> dict[str, str]:
    """Words that a field takes, with what they mean where a docstring lists them."""
    annotation = str(section.model_fields[name].annotation)
    meanings: dict[str, str] = {}
    for cls in reversed(_sources(section)):
        listed = _listed(cls)
        if listed and all(f"'{word}'" in annotation for word in listed):
            meanings |= listed
    return meanings


def _sources(section: type[Section]) -> tuple[type[Section], ...]:
    """The section, those it inherits from, and those whose fields it repeats (``same_as``)."""
    classes = [c for c in section.__mro__ if issubclass(c, Section) and c is not Section]
    return (*classes, *(other for cls in classes for other in getattr(cls, "same_as", ())))


def _paragraphs(section: type[Section]) -> list[str]:
    return inspect.cleandoc(section.__dict__.get("__doc__") or "").split("\n\n")


def _before_keys(section: type[Section], paragraph: str) -> str:
    """What a paragraph says before it says of the first field."""
    if _is_list(paragraph):
        return ""
    text = " ".join(paragraph.split())
    heads = _heads(section, text)
    return text[: heads[0].start()].strip() if heads else text


def _heads(section: type[Section], text: str) -> list[re.Match[str]]:
    """Beginnings "name: " or "one, other: " of what is said of fields."""
    fields = section.model_fields
    return [m for m in _HEAD.finditer(text) if _names(m).keys() <= fields.keys()]


def _names(head: re.Match[str]) -> dict[str, str]:
    """Fields that a head names, with the remark behind each."""
    parts = (re.fullmatch(r"(\w+)(?: \((.*)\))?", p) for p in re.findall(_NAME, head[1]))
    return {p[1]: p[2] or "" for p in parts if p}


@cache
def _meanings(section: type[Section]) -> dict[str, str]:
    """Field and what the section's own docstring says of it."""
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
    """Words with their meanings that the section's own docstring lists."""
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
