"""Finished batches of a tolerance study on disk."""

from __future__ import annotations

import io
from dataclasses import asdict, dataclass, fields

import numpy as np

from flexgear.model.case import Case
from flexgear.studies.study_store import StudyStore, study_store
from flexgear.studies.tolerance_setup import Batch

FORMAT = 3  # of the files, and of the numerics behind them; raise it when either changes


@dataclass(frozen=True)
class BatchStore:
    """Batches of one study by their sample numbers."""

    parts: StudyStore

    def get(self, numbers: range) -> Batch | None:
        """A finished batch; None where there is none or it is damaged."""
        stored = self.parts.get(_name(numbers))
        if stored is None:
            return None
        with np.load(io.BytesIO(stored), allow_pickle=False) as data:
            return Batch(**{f.name: data[f.name] for f in fields(Batch)})

    def put(self, numbers: range, batch: Batch) -> None:
        """Keep a batch. FlexgearWarning where the disk refuses."""
        data = io.BytesIO()
        np.savez(data, **asdict(batch))
        self.parts.put(_name(numbers), data.getvalue())

    def clear(self) -> None:
        """Forget the study."""
        self.parts.clear()


def batch_store(case: Case) -> BatchStore:
    """Store of the batches of a case's study, under a key of all that a sample depends on. The
    number of samples is no part of it: a larger study takes over earlier batches."""
    drawn = case.tolerance.model_dump(exclude={"samples", "confidence"})
    content = {"format": FORMAT, "model": case.content_hash(), "tolerance": drawn}
    return BatchStore(study_store("tolerance", content))


def _name(numbers: range) -> str:
    return f"samples_{numbers.start}_{numbers.stop}.npz"
