"""A case as TOML in which every key says where it comes from."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from flexgear.files.rexs.document import Datum

Value = float | int | str | bool | list[float] | list[str]
_KEPT = ("[stages.carrier]",)  # sections that a case needs though nothing stands in them
COLUMN = 42  # of the comments


@dataclass
class Section:
    """One table of TOML: its header, "" for the top of the file, and its keys."""

    header: str
    lines: list[tuple[str, Value, str]] = field(default_factory=list)

    def put(self, key: str, value: Value, why: str) -> None:
        """Append a key with its value and the reason for it."""
        self.lines.append((key, value, why))

    def take(self, key: str, datum: Datum | None) -> bool:
        """Append a key that a file gives; returns whether it does."""
        if datum is not None:
            self.put(key, datum.value, datum.source)
        return datum is not None

    def is_below(self, other: Section) -> bool:
        """Whether its table is one inside the other's."""
        return self.header.startswith(f"{other.header[:-1]}.")

    def holds(self, key: str) -> bool:
        """Whether the table has the key."""
        return any(path == key for path, _, _ in self.lines)

    def share(self, part: float, keys: Iterable[str], why: str) -> None:
        """Multiply the values of these keys, and add why to their reasons."""
        names = {*keys}
        self.lines = [
            (key, float(value) * part, f"{old}; {why}") if key in names else (key, value, old)  # type: ignore[arg-type]
            for key, value, old in self.lines
        ]

    def text(self) -> str:
        """The section as TOML."""
        rows = [self.header] if self.header else []
        for key, value, why in self.lines:
            line = f"{key} = {toml(value)}"
            rows.append(f"{line:<{COLUMN}}# {why}" if why else line)
        return "\n".join(rows) + "\n"


@dataclass
class CaseText:
    """Sections in their order, and what was assumed or needs an eye: each in one sentence.

    stage: name of the one that is being written.
    """

    sections: list[Section] = field(default_factory=list)
    assumed: list[str] = field(default_factory=list)
    stage: str = ""

    def section(self, header: str, behind: Section | None = None) -> Section:
        """A new section: behind another one and those below that, or behind those of the table it
        belongs to, if the last stage has such."""
        section, place = Section(header), len(self.sections)
        if behind is not None:
            place = next(k for k, earlier in enumerate(self.sections) if earlier is behind) + 1
            while place < len(self.sections) and self.sections[place].is_below(behind):
                place += 1
            self.sections.insert(place, section)
            return section
        parent = header.rpartition(".")[0]
        for k in range(len(self.sections) - 1, -1, -1):
            before = self.sections[k].header
            if parent.count(".") and (before == f"{parent}]" or before.startswith(f"{parent}.")):
                place = k + 1
                break
            if before.startswith("[["):
                break
        self.sections.insert(place, section)
        return section

    def assume(self, section: Section, key: str, value: Value, why: str) -> None:
        """Append a key that the file does not give, and list the assumption."""
        section.put(key, value, f"assumed: {why}")
        place = section.header.strip("[]").replace("stages", f"stages.{self.stage}", 1)
        self.assumed.append(f"{f'{place}.' if place else ''}{key} = {toml(value)}: {why}")

    def warn(self, text: str) -> None:
        """List something of the file that does not fit, and what was done about it."""
        self.assumed.append(text)

    def text(self) -> str:
        """The TOML without what stands above and below it."""
        return "\n".join(s.text() for s in self.sections if s.lines or s.header in _KEPT)


def toml(value: Value) -> str:
    """A value as TOML; floats with all their digits, large and small ones with an exponent, others
    that are whole without a point."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, (int, str)):
        return json.dumps(value, ensure_ascii=False) if isinstance(value, str) else str(value)
    if isinstance(value, list):
        return f"[{', '.join(toml(v) for v in value)}]"
    if value and not 1e-4 <= abs(value) < 1e6:
        return str(np.format_float_scientific(value, trim="-", exp_digits=1))
    return str(int(value)) if value == int(value) else repr(float(value))


def commented(lines: list[str]) -> str:
    """Lines as comments; what cannot be printed is left out."""
    printable = ("".join(c if c.isprintable() else " " for c in line) for line in lines)
    return "".join(f"# {line}".rstrip() + "\n" for line in printable)
