"""Damaged archives."""

from __future__ import annotations

import lzma
import zipfile
import zlib

DAMAGED = (  # what reading a damaged zip, or an array in one, may raise; bz2 raises OSError
    zipfile.BadZipFile, zlib.error, lzma.LZMAError, OSError, EOFError, ValueError, RuntimeError,
    NotImplementedError, OverflowError,
)  # fmt: skip
