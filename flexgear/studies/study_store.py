"""Finished parts of a study on disk, so that an interrupted study goes on where it stopped.

A folder of the cache named by the content of the study holds one file a part, which is there whole
or not at all. It is removed when the study's results are safe.
"""

from __future__ import annotations

import contextlib
import shutil
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, TypeVar

from flexgear.files.atomic import write_bytes
from flexgear.files.cache_folder import cache_directory
from flexgear.model.content import content_hash
from flexgear.model.errors import FlexgearError, FlexgearWarning
from flexgear.model.input_file import read_kept
from flexgear.results.version import version
from flexgear.structures.cache import sealed, unsealed

T = TypeVar("T")


@dataclass(frozen=True)
class StudyStore(Generic[T]):
    """Parts of one study by the names of their files. pack, unpack: a part as bytes, and back."""

    folder: Path
    pack: Callable[[T], bytes]
    unpack: Callable[[bytes], T]

    def get(self, name: str) -> T | None:
        """A stored part; None where there is none, or it is damaged or cannot be read."""
        try:
            return self.unpack(unsealed(read_kept(self.folder / name)))
        except (OSError, ValueError):
            return None

    def put(self, name: str, part: T) -> None:
        """Keep a part. FlexgearWarning where the disk refuses: the study itself goes on."""
        try:
            write_bytes(self.folder / name, sealed(self.pack(part)))
        except FlexgearError as error:
            text = f"cannot keep what is done, so a stopped study would start anew: {error}"
            warnings.warn(text, FlexgearWarning, stacklevel=2)

    def clear(self) -> None:
        """Forget the study."""
        shutil.rmtree(self.folder, ignore_errors=True)
        with contextlib.suppress(OSError):  # others' studies are still there
            self.folder.parent.rmdir()


def study_folder(kind: str, content: dict[str, Any]) -> Path:
    """Where parts of a study are kept; content: all that every one of them depends on."""
    return cache_directory() / kind / content_hash({"version": version(), **content})
