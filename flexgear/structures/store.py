"""Content-addressed cache of reduced bodies.

An entry is a folder named by the SHA-256 of everything the body depends on. It is written beside
its place and moved there whole; arrays carry checksums, and an entry that fails them is thrown
away and computed again. The recovery array stays on disk as a memory map.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import shutil
import sys
import tempfile
import zlib
from collections.abc import Callable
from dataclasses import asdict, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexgear.model.errors import FlexgearError
from flexgear.structures.reduced import ReducedBody

FORMAT = "5"  # part of every key: raise it when entries or the numerics behind them change
_ARRAYS = ("positions", "mass", "stiffness", "points", "cells", "recovery", "probe_loads")


def cache_directory() -> Path:
    """$FLEXGEAR_CACHE, else flexgear's folder in the platform's cache directory."""
    chosen = os.environ.get("FLEXGEAR_CACHE")
    if chosen:
        return Path(chosen)
    if sys.platform == "win32":
        base = Path(os.environ.get("LOCALAPPDATA", Path.home() / "AppData" / "Local"))
    elif sys.platform == "darwin":
        base = Path.home() / "Library" / "Caches"
    else:
        base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    return base / "flexgear"


def content_key(**content: Any) -> str:
    """SHA-256 of named content: numbers, strings, tuples, dataclasses, arrays."""
    text = json.dumps({"format": FORMAT, **_plain(content)}, sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()


def cached(
    key: str, compute: Callable[[], ReducedBody], directory: Path | None = None
) -> ReducedBody:
    """The body stored under key, else computed, stored and read back."""
    entry = (directory or cache_directory()) / "reduced" / key
    found = load(entry)
    if found is not None:
        return found
    body = compute()
    save(body, entry)
    return load(entry) or body


def save(body: ReducedBody, entry: Path) -> None:
    """Write an entry whole or not at all. Raises FlexgearError where the disk refuses."""
    try:
        entry.parent.mkdir(parents=True, exist_ok=True)
        draft = Path(tempfile.mkdtemp(prefix=".draft-", dir=entry.parent))
    except OSError as error:
        raise FlexgearError(_refused(entry, error)) from None
    try:
        checksums = {}
        for name in _ARRAYS:
            path = draft / f"{name}.npy"
            np.save(path, getattr(body, name))
            checksums[name] = _checksum(path)
        header = {
            "name": body.name,
            "node_names": body.node_names,
            "n_modes": body.n_modes,
            "probe_cases": body.probe_cases,
            "report": body.report,
            "checksums": checksums,
        }
        (draft / "header.json").write_text(json.dumps(header, indent=1, default=float))
        if entry.exists():
            shutil.rmtree(entry, ignore_errors=True)
        with contextlib.suppress(FileExistsError):  # another process was first: same content
            try:
                os.rename(draft, entry)
            except OSError:
                if not entry.exists():
                    raise
    except OSError as error:
        raise FlexgearError(_refused(entry, error)) from None
    finally:
        shutil.rmtree(draft, ignore_errors=True)


def load(entry: Path) -> ReducedBody | None:
    """The body of an entry; None where there is none or it is damaged (then it is removed)."""
    if not entry.is_dir():
        return None
    try:
        header = json.loads((entry / "header.json").read_text())
        arrays: dict[str, NDArray[Any]] = {}
        for name in _ARRAYS:
            path = entry / f"{name}.npy"
            if _checksum(path) != header["checksums"][name]:
                raise ValueError(name)
            arrays[name] = np.load(path, mmap_mode="r" if name == "recovery" else None)
        return ReducedBody(
            name=header["name"],
            node_names=tuple(header["node_names"]),
            n_modes=header["n_modes"],
            probe_cases=tuple((node, case) for node, case in header["probe_cases"]),
            report=header["report"],
            **arrays,
        )
    except (OSError, ValueError, KeyError, TypeError):
        shutil.rmtree(entry, ignore_errors=True)
        return None


def _refused(entry: Path, error: OSError) -> str:
    return (
        f"cannot store a reduced body in {entry.parent}: {error.strerror}; "
        "free space there or set FLEXGEAR_CACHE to another folder"
    )


def _checksum(path: Path) -> int:
    value = 0
    with path.open("rb") as stream:
        while chunk := stream.read(1 << 22):
            value = zlib.crc32(chunk, value)
    return value


def _plain(value: Any) -> Any:
    """JSON-ready form; floats by their exact hexadecimal digits."""
    if is_dataclass(value) and not isinstance(value, type):
        return {"type": type(value).__name__, **_plain(asdict(value))}
    if isinstance(value, dict):
        return {str(k): _plain(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(v) for v in value]
    if isinstance(value, np.ndarray):
        array = np.ascontiguousarray(value)
        digest = hashlib.sha256(array.tobytes()).hexdigest()
        return [str(array.dtype), list(array.shape), digest]
    if isinstance(value, (bool, int, str)) or value is None:
        return value
    if isinstance(value, (float, np.floating)):
        return float(value).hex()
    if isinstance(value, np.integer):
        return int(value)
    raise TypeError(f"cannot hash {type(value).__name__}")
