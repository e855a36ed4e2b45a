"""The cache on disk: its entries, their keys, and how it is emptied.

It holds reduced bodies (`store`), influences of teeth (`tooth_influence`), finished parts of
studies that were interrupted and the machine code of loops (`flexgear.compiled`). Each entry is a
folder named by the SHA-256 of all that it depends on. Files and folders with other names belong to
other programs or are being written; they are neither listed nor removed.
"""

import hashlib
import io
import json
import re
import shutil
import warnings
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass, fields, is_dataclass
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from flexgear.files.atomic import remove_stale, write_bytes
from flexgear.files.cache_folder import cache_directory
from flexgear.files.locks import one_at_a_time
from flexgear.model.errors import FlexgearError, FlexgearWarning
from flexgear.model.input_file import read_kept

T = TypeVar("T")

KINDS = {
    "reduced": "reduced bodies",
    "influence": "influences of loaded teeth",
    "sweep": "interrupted sweeps",
    "tolerance": "interrupted tolerance studies",
    "rating": "interrupted ratings",
    "compiled": "compiled loops",
}
FORMAT = "17"  # part of every key: raise it when entries or the numerics behind them change
_ENTRY = re.compile(r"[0-9a-f]{64}")


@dataclass(frozen=True)
class Entry:
    """A folder of the cache. kind: a key of KINDS; size: bytes of its files."""

    kind: str
    path: Path
    size: int


def entries() -> list[Entry]:
    """All entries of the cache, by kind. Raises OSError where the cache cannot be read."""
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


def content_key(**content: Any) -> str:
    """SHA-256 of named content (numbers, strings, tuples, dataclasses, arrays) and ``FORMAT``."""
    text = json.dumps({"format": FORMAT, **_plain(content)}, sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()


def cached_arrays(
    kind: type[T], version: int, content: Mapping[str, Any], compute: Callable[[], T]
) -> T:
    """An influence of teeth, read from the cache or computed and stored there.

    kind: dataclass of arrays and numbers, fields that are None are not stored; version: raised when
    its numerics or fields change; content: all that it depends on. FlexgearWarning where it cannot
    be written: it is returned all the same.
    """
    key = content_key(influence=version, **content)
    file = cache_directory() / "influence" / key / f"{kind.__name__}.npz"
    if (stored := _stored(kind, file)) is not None:
        return stored
    with one_at_a_time(file.parent, bool):
        return _stored(kind, file) or _computed(file, compute)


def _stored(kind: type[T], file: Path) -> T | None:
    """What is stored in a file; None where there is none or it is damaged."""
    try:
        with np.load(io.BytesIO(unsealed(read_kept(file)))) as arrays:
            return kind(**{name: array[()] for name, array in arrays.items()})
    except (OSError, ValueError, TypeError):
        return None


def _computed(file: Path, compute: Callable[[], T]) -> T:
    """Compute an influence of teeth and store it in a file, which other processes then read."""
    result = compute()
    values = {f.name: getattr(result, f.name) for f in fields(result)}  # type: ignore[arg-type]
    stream = io.BytesIO()
    np.savez(stream, **{name: value for name, value in values.items() if value is not None})
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        write_bytes(file, sealed(stream.getvalue()))
    except (OSError, FlexgearError) as error:
        text = f"cannot keep the influence of a tooth, the next run computes it again: {error}"
        warnings.warn(text, FlexgearWarning, stacklevel=3)
    return result


def sealed(data: bytes) -> bytes:
    """A line with the SHA-256 of data, followed by the data."""
    return hashlib.sha256(data).hexdigest().encode() + b"\n" + data


def unsealed(data: bytes) -> bytes:
    """The data in the result of ``sealed``; ValueError if any bit of them has changed."""
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
