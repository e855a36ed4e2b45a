"""Arrays that a file holds as base64 of little-endian numbers."""

from __future__ import annotations

import base64
import binascii

import numpy as np

_TYPES = {"int32": "<i4", "float32": "<f4", "float64": "<f8"}


def decoded(code: str, text: str) -> tuple[str, ...] | None:
    """The numbers as text; None for what cannot be decoded."""
    try:
        data = base64.b64decode("".join(text.split()), validate=True)
        return tuple(repr(v) for v in np.frombuffer(data, dtype=_TYPES[code]).tolist())
    except (KeyError, ValueError, binascii.Error):
        return None
