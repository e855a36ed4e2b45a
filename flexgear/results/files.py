"""Result files appear whole or not at all."""

from __future__ import annotations

import contextlib
import json
import os
import secrets
import shutil
import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from flexgear.model.errors import FlexgearError

PathLike = str | os.PathLike[str]


def make_folder(path: PathLike) -> Path:
    """The folder ``path``, made if need be."""
    folder = Path(path)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FlexgearError(f"cannot make the folder {folder}: {reason(error)}") from error
    return folder


def write_bytes(path: PathLike, data: bytes | memoryview) -> Path:
    """Write beside ``path``, flush to the disk, rename onto it; nothing is left if that fails.

    A full disk, a missing right or an interrupt leaves an older file as it was.
    """
    target = Path(path)
    make_folder(target.parent)
    partial = target.with_name(f".{target.name}.{secrets.token_hex(4)}.partial")
    try:
        with open(partial, "xb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        os.replace(partial, target)
    except OSError as error:
        raise FlexgearError(f"cannot write {target}: {reason(error)}") from error
    finally:
        with contextlib.suppress(OSError):
            partial.unlink(missing_ok=True)
    return target


@contextlib.contextmanager
def staged_folder(path: PathLike) -> Iterator[Path]:
    """Yield an empty folder beside ``path``; what is in it moves to ``path`` when the block ends.

    Files of the same name are replaced, others stay. Whatever goes wrong inside (Ctrl-C, a full
    disk), ``path`` stays as it was and nothing is left of the stage.
    """
    target = Path(path)
    if target.exists() and not target.is_dir():
        raise FlexgearError(f"cannot write to {target}: it is a file; name a folder")
    make_folder(target.parent)
    try:
        stage = Path(
            tempfile.mkdtemp(prefix=f".{target.name}.", suffix=".partial", dir=target.parent)
        )
    except OSError as error:
        raise FlexgearError(f"cannot write to {target}: {reason(error)}") from error
    try:
        yield stage
        make_folder(target)
        try:
            for found in sorted(f for f in stage.rglob("*") if f.is_file()):
                place = target / found.relative_to(stage)
                place.parent.mkdir(parents=True, exist_ok=True)
                os.replace(found, place)
        except OSError as error:
            raise FlexgearError(f"cannot write to {target}: {reason(error)}") from error
    finally:
        shutil.rmtree(stage, ignore_errors=True)


def write_json(path: PathLike, data: Mapping[str, Any]) -> Path:
    """``data`` as indented JSON; NaN and infinity are refused, JSON has no word for them."""
    text = json.dumps(data, indent=2, ensure_ascii=False, allow_nan=False)
    return write_bytes(path, (text + "\n").encode())


def reason(error: OSError) -> str:
    """What the system says, with the remedy where there is an obvious one."""
    text = error.strerror or str(error)
    return f"{text}; free some space or choose another folder" if error.errno == 28 else text
