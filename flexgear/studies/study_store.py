"""Finished parts of a study on disk, so that an interrupted study goes on where it stopped.

A folder of the cache named by the content of the study holds one file a part, which is there whole
or not at all. It is removed when the study's results are safe.
"""

from __future__ import annotations

import contextlib
import shutil
import warnings
from collections.abc import Callable, Sequence
from contextlib import closing
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
from flexgear.studies.job_pool import run_jobs

S = TypeVar("S")
J = TypeVar("J")
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


def stored_or_run(
    store: StudyStore[T],
    files: Sequence[str],
    function: Callable[[S, J], T],
    shared: S,
    jobs: Sequence[J],
    *,
    workers: int | None,
    scheduler: str | None,
    progress: Callable[[float], None],
) -> tuple[dict[int, T], dict[int, str]]:
    """Parts of a study by the numbers of their jobs, from the disk where they were finished before,
    else function(shared, job), which then is kept; messages of those that failed. progress: is told
    the share that is done; workers, scheduler: as of ``run_jobs``."""
    finished = {k: part for k, file in enumerate(files) if (part := store.get(file)) is not None}
    left, faults = [k for k in range(len(files)) if k not in finished], dict[int, str]()
    progress(len(finished) / max(len(files), 1))
    runs = run_jobs(function, shared, [jobs[k] for k in left], workers=workers, scheduler=scheduler)
    with closing(runs):
        for at, outcome in runs:
            if outcome.value is None:
                faults[left[at]] = outcome.message
                continue
            finished[left[at]] = outcome.value
            store.put(files[left[at]], outcome.value)
            progress(len(finished) / len(files))
    return finished, faults


def study_folder(kind: str, content: dict[str, Any]) -> Path:
    """Where parts of a study are kept; content: all that every one of them depends on."""
    return cache_directory() / kind / content_hash({"version": version(), **content})
