"""Content hashes: what a case says physically, whatever its spelling."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

from flexgear.model.errors import InputError
from flexgear.model.input_file import MOST_FE_MESH, require_regular


def content_hash(data: Any) -> str:
    """SHA-256 of plain data, 64 hex digits; numbers count with 12 digits."""
    text = json.dumps(_canonical(data), sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()


def file_digest(path: str | None) -> str | None:
    """SHA-256 of what is in a file."""
    if path is None:
        return None
    try:
        require_regular(Path(path), "file", MOST_FE_MESH)
        with open(path, "rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except (OSError, InputError):
        return f"missing:{Path(path).name}"


def _canonical(value: Any) -> Any:
    """Numbers with 12 digits, so that 430 mm and 0.43 m are the same."""
    if isinstance(value, dict):
        return {k: _canonical(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [_canonical(v) for v in value]
    if isinstance(value, float):
        return f"{value:.12g}"
    return value
