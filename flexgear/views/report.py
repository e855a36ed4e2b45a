"""One self-contained HTML page of a run: summary, pictures, parameters, version, hash."""

from __future__ import annotations

import base64
import os
from collections.abc import Mapping, Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any

from jinja2 import Environment

from flexgear.files.atomic import atomic_file
from flexgear.model.errors import FlexgearError

MEDIA = {".png": "image/png", ".svg": "image/svg+xml", ".gif": "image/gif", ".mp4": "video/mp4"}
UNITS = {  # endings of summary keys, longest first
    "_rpm_mean": "r/min",
    "_rpm_min": "r/min",
    "_rpm": "r/min",
    "_hz": "Hz",
    "_n_mean": "N",
    "_n_min": "N",
    "_n": "N",
    "_um": "µm",
    "_s": "s",
}


def unit_of(key: str) -> str:
    """Unit that the key's own name, or a parent's, carries ("" if none)."""
    for part in reversed(key.split(" › ")):
        for ending, unit in UNITS.items():
            if part.endswith(ending):
                return unit
    return ""


def text_of(value: Any) -> str:
    """A number to four digits, a list in one line, anything else as it is."""
    if isinstance(value, bool) or value is None:
        return {True: "yes", False: "no", None: "–"}[value]
    if isinstance(value, int):
        return f"{value:,}".replace(",", "\u202f")
    if isinstance(value, float):
        return f"{value:.4g}" if abs(value) < 1e4 else f"{value:,.0f}".replace(",", "\u202f")
    if isinstance(value, Sequence) and not isinstance(value, str):
        return ", ".join(text_of(v) for v in value)
    return str(value)


def rows_of(value: Any, key: str = "") -> list[tuple[str, str, str]]:
    """Flatten nested mappings into (key path, value, unit) rows."""
    if isinstance(value, Mapping):
        rows = []
        for name, inner in value.items():
            rows += rows_of(inner, f"{key} › {name}" if key else str(name))
        return rows
    return [(key, text_of(value), unit_of(key))]


def sections(summary: Mapping[str, Any]) -> list[tuple[str, list[tuple[str, str, str]]]]:
    """Tables by top-level key; single values come first under "run"."""
    single = [(k, text_of(v), unit_of(k)) for k, v in summary.items() if not isinstance(v, Mapping)]
    tables = [("run", single)] if single else []
    for name, inner in summary.items():
        if isinstance(inner, Mapping):
            rows = [(k, v, u or unit_of(name)) for k, v, u in rows_of(inner)]
            tables.append((name.replace("_", " "), rows))
    return tables


def embedded(path: Path) -> str:
    """A picture as a data URI."""
    kind = MEDIA.get(path.suffix.lower())
    if kind is None:
        raise FlexgearError(f"cannot put {path} into the report: only {', '.join(MEDIA)}")
    try:
        data = path.read_bytes()
    except OSError as error:
        raise FlexgearError(f"cannot read picture {path}: {error.strerror}") from error
    return f"data:{kind};base64,{base64.b64encode(data).decode('ascii')}"


def write_report(
    path: str | os.PathLike[str],
    title: str,
    summary: Mapping[str, Any],
    pictures: Sequence[tuple[str | os.PathLike[str], str]],
    parameters: Mapping[str, Any] | str,
    version: str,
    content_hash: str,
    notes: Sequence[str] = (),
) -> Path:
    """Write the page atomically and return its path.

    ``summary``: nested mapping as in summary.json. ``pictures``: (file, caption) in order.
    ``parameters``: the case as TOML text, or a nested mapping. Everything is embedded.
    """
    target = Path(path)
    source = (files("flexgear.views") / "templates" / "report.html.j2").read_text("utf-8")
    figures = [
        (embedded(Path(file)), caption, Path(file).suffix == ".mp4") for file, caption in pictures
    ]
    page = (
        Environment(autoescape=True, trim_blocks=True, lstrip_blocks=True)
        .from_string(source)
        .render(
            title=title,
            case=summary.get("case", ""),
            tables=sections(summary),
            figures=figures,
            parameters=None if isinstance(parameters, str) else rows_of(parameters),
            parameter_text=parameters if isinstance(parameters, str) else None,
            version=version,
            content_hash=content_hash,
            notes=list(notes),
        )
    )
    with atomic_file(target) as temporary:
        temporary.write_text(page, encoding="utf-8", errors="backslashreplace")
    return target
