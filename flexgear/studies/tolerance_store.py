"""Finished batches of a tolerance study on disk, so that an interrupted study goes on.

A folder of the cache named by the content of the study holds one file a batch, which is there whole
or not at all. It is removed when the study's results are safe.
"""

from __future__ import annotations

import contextlib
import io
import shutil
import zipfile
from dataclasses import asdict, dataclass, fields
from pathlib import Path

import numpy as np

from flexgear.model.content import content_hash
from flexgear.model.stage_case import Case
from flexgear.model.train import Train
from flexgear.results.files import write_bytes
from flexgear.results.version import version
from flexgear.structures.store import cache_directory
from flexgear.studies.tolerance_setup import Batch

FORMAT = 1  # of the files, and of the numerics behind them; raise it when either changes


def study_key(model: Case | Train) -> str:
    """What samples of a study depend on, 64 hex digits; not how many there are."""
    return content_hash(
        {
            "format": FORMAT,
            "version": version(),
            "model": model.content_hash(),
            "tolerance": model.tolerance.model_dump(exclude={"samples", "confidence"}),
        }
    )


@dataclass(frozen=True)
class BatchStore:
    """Batches of one study by their sample numbers."""

    folder: Path

    def get(self, numbers: range) -> Batch | None:
        """A finished batch; None where there is none or it cannot be read."""
        try:
            with np.load(self._file(numbers), allow_pickle=False) as data:
                return Batch(**{f.name: data[f.name] for f in fields(Batch)})
        except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
            return None

    def put(self, numbers: range, batch: Batch) -> None:
        """Keep a batch. Raises FlexgearError where the disk refuses."""
        data = io.BytesIO()
        np.savez(data, **asdict(batch))
        write_bytes(self._file(numbers), data.getvalue())

    def clear(self) -> None:
        """Forget the study."""
        shutil.rmtree(self.folder, ignore_errors=True)
        with contextlib.suppress(OSError):  # others' studies are still there
            self.folder.parent.rmdir()

    def _file(self, numbers: range) -> Path:
        return self.folder / f"samples_{numbers.start}_{numbers.stop}.npz"


def batch_store(model: Case | Train) -> BatchStore:
    """Where the batches of the study of a model are kept."""
    return BatchStore(cache_directory() / "tolerance" / study_key(model))
