"""Content hashes: what a case says physically, whatever its spelling."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any


def content_hash(data: Any) -> str:
    """SHA-256 of plain data, 64 hex digits; numbers count with 12 digits."""
    text = json.dumps(_canonical(data), sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()


def file_digest(path: str | None) -> str | None:
    """SHA-256 of what is in a file."""
    if path is None:
        return None
    try:
        return hashlib.sha256(Path(path).read_bytes()).hexdigest()
    except OSError:
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
