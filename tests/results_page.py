"""What ``docs/results.md`` says, for tests that hold it to results."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from pathlib import Path

_PAGE = (Path(__file__).parents[1] / "docs" / "results.md").read_text(encoding="utf-8")
SECTIONS = {text.partition("\n")[0]: text for text in _PAGE.split("\n## ")}


def rows_of(text: str) -> dict[str, str]:
    """Rows of tables by the name that each begins with."""
    return {line.split("`")[1]: line for line in text.splitlines() if line.startswith("| `")}


def undocumented(summary: Mapping) -> list[str]:
    """Dotted keys of a summary that no row of the page names."""
    known = [_pattern(row) for row in rows_of(SECTIONS["`summary.json`"])]
    return [
        ".".join(path)
        for path in _paths(summary)
        if not any(pattern.fullmatch("\n".join(path)) for pattern in known)
    ]


def _paths(value: object, path: tuple[str, ...] = ()) -> Iterator[tuple[str, ...]]:
    """Names on the way to everything that is no mapping; of what is empty, nothing."""
    if not isinstance(value, Mapping):
        yield path
        return
    for key, inner in value.items():
        yield from _paths(inner, (*path, key))


def _pattern(row: str) -> re.Pattern[str]:
    """Of the names on the way, one a line: "[<stage>.]" may be missing; a figure may have parts."""
    text = re.escape(row.replace("[<stage>.]", "?").replace(".", "\n"))
    text = text.replace(re.escape("?"), r"(?:[^\n]+\n)?")
    text = text.replace("<figure>", r".+").replace("<key>", r".+")
    return re.compile(re.sub(r"<\w+>", r"[^\n]+", text), re.DOTALL)
