"""The cache on disk: where it is, what is in it, how it is emptied.

It holds reduced bodies (`store`), influences of teeth (`tooth_influence`), finished parts of
studies that were interrupted and the machine code of loops (`flexgear.compiled`). Each entry has a
folder named by the SHA-256 of all that it depends on. Whatever else lies there is not flexgear's,
or is just being made, and stays.
"""

from __future__ import annotations

import hashlib
import re
import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from flexgear.files.atomic import remove_stale
from flexgear.files.cache_folder import cache_directory

KINDS = {
    "reduced": "reduced bodies",
    "influence": "influences of loaded teeth",
    "sweep": "interrupted sweeps",
    "tolerance": "interrupted tolerance studies",
    "compiled": "compiled loops",
}
_ENTRY = re.compile(r"[0-9a-f]{64}")


@dataclass(frozen=True)
class Entry:
    """A folder of the cache. kind: a key of KINDS; size: bytes of its files."""

    kind: str
    path: Path
    size: int


def entries() -> list[Entry]:
    """All that flexgear keeps, by kind. Raises OSError where the cache cannot be read."""
    return [Entry(kind, path, _size(path)) for kind in KINDS for path in _paths(kind)]


def clear() -> list[Entry]:
    """Remove all entries and return them. Raises OSError where one cannot be removed."""
    listed = entries()
    for entry in listed:
        remove(entry.path)
    for folder in (*(cache_directory() / kind for kind in KINDS), cache_directory()):
        remove_stale(folder)
        if folder.is_dir() and not any(folder.iterdir()):
            folder.rmdir()
    return listed


def remove(path: Path) -> None:
    """Remove a folder with all in it, a file or a link."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)


def sealed(data: bytes) -> bytes:
    """Data behind a line with its SHA-256."""
    return hashlib.sha256(data).hexdigest().encode() + b"\n" + data


def unsealed(data: bytes) -> bytes:
    """The data that ``sealed`` was made of; ValueError if any bit has changed since."""
    seal, _, rest = data.partition(b"\n")
    if seal.decode() != hashlib.sha256(rest).hexdigest():
        raise ValueError("its checksum is wrong")
    return rest


def _paths(kind: str) -> Iterator[Path]:
    folder = cache_directory() / kind
    if folder.is_dir():
        yield from sorted(path for path in folder.iterdir() if _ENTRY.fullmatch(path.name))


def _size(path: Path) -> int:
    files = [path, *path.rglob("*")]
    return sum(f.lstat().st_size for f in files if f.is_symlink() or f.is_file())
