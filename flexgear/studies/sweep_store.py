"""Finished points of a sweep on disk. A point that failed is not kept: it is tried again."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass

import xarray as xr

from flexgear.model.case import Case
from flexgear.studies.measure import MeasuredValues
from flexgear.studies.study_store import StudyStore, study_store

FORMAT = 3  # of the files, and of the numerics behind them; raise it when either changes


@dataclass(frozen=True)
class PointStore:
    """Points of one sweep by their cases."""

    parts: StudyStore

    def get(self, case: Case) -> MeasuredValues | None:
        """What was found at a point; None where nothing was kept or it is damaged."""
        stored = self.parts.get(_name(case))
        if stored is None:
            return None
        plain = json.loads(stored)
        return {name: xr.DataArray.from_dict(array) for name, array in plain.items()}

    def put(self, case: Case, figures: MeasuredValues) -> None:
        """Keep a point. FlexgearWarning where the disk refuses."""
        plain = {name: array.to_dict() for name, array in figures.items()}
        self.parts.put(_name(case), json.dumps(plain).encode())

    def clear(self) -> None:
        """Forget the sweep."""
        self.parts.clear()


def point_store(base: Case, keys: Sequence[str], measures: Sequence[str], modes: int) -> PointStore:
    """Where the points of a sweep are kept: by all that they depend on beside their own cases."""
    content = {
        "format": FORMAT,
        "model": base.content_hash(),
        "keys": list(keys),
        "measures": list(measures),
        "modes": modes,
    }
    return PointStore(study_store("sweep", content))


def _name(case: Case) -> str:
    return f"{case.content_hash()}.json"
