"""Tolerance study: load sharing of many sets of parts with random manufacturing errors.

Samples are solved in batches, here or on Dask. Finished batches are kept on disk until the study's
results are safe, so that an interrupted study goes on where it stopped. A sample depends on the
seed and its number alone: neither batches nor workers change a digit.
"""

from __future__ import annotations

import io
import json
from collections.abc import Sequence
from dataclasses import asdict, fields

import numpy as np
import xarray as xr
from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

from flexgear.model.case import Case
from flexgear.model.errors import FlexgearError
from flexgear.results.dataset_file import provenance
from flexgear.results.tolerance_dataset import tolerance_dataset
from flexgear.solve.bodies import Progress, silent
from flexgear.studies.dask_pool import reach
from flexgear.studies.study_store import StudyStore, stored_or_run, study_folder
from flexgear.studies.tolerance_setup import (
    Batch,
    ToleranceSetup,
    as_stated,
    sampled,
    tolerance_setup,
)

BATCH = 100  # samples solved together
FORMAT = 3  # of the files, and of the numerics behind them; raise it when either changes


def _packed(batch: Batch) -> bytes:
    data = io.BytesIO()
    np.savez(data, **asdict(batch))
    return data.getvalue()


def _unpacked(stored: bytes) -> Batch:
    with np.load(io.BytesIO(stored), allow_pickle=False) as data:
        return Batch(**{f.name: data[f.name] for f in fields(Batch)})


def batch_store(case: Case) -> StudyStore[Batch]:
    """Store of the batches of a case's study, under a key of all that a sample depends on. The
    number of samples is no part of it: a larger study takes over earlier batches."""
    drawn = case.tolerance.model_dump(exclude={"samples", "confidence"})
    content = {"format": FORMAT, "model": case.content_hash(), "tolerance": drawn}
    return StudyStore(study_folder("tolerance", content), _packed, _unpacked)


def _file(numbers: range) -> str:
    """Name of the file of a batch."""
    return f"samples_{numbers.start}_{numbers.stop}.npz"


def tolerance(
    case: Case,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    progress: Progress = silent,
    keep_batches: bool = False,
) -> xr.Dataset:
    """The study that the section ``tolerance`` of a case describes, as one dataset.

    workers: processes (1: this one; None: as many as pay); scheduler: address of a Dask cluster
    instead; keep_batches: leave finished batches on disk until ``forget``. InputError where there
    is nothing to draw or to share, FlexgearError where batches failed.
    """
    if scheduler is not None:
        reach(scheduler)
    store, batches = batch_store(case), batches_of(case.tolerance.samples)
    with threadpool_limits(limits=1):
        setup = tolerance_setup(case, progress)
        stated = as_stated(setup)
        finished = _all(setup, store, batches, workers, scheduler, progress)
    data = _dataset(setup, stated, finished)
    if not keep_batches:
        store.clear()
    return data


def batches_of(samples: int) -> list[range]:
    """Numbers of the samples of every batch."""
    return [range(first, min(first + BATCH, samples)) for first in range(0, samples, BATCH)]


def forget(case: Case) -> None:
    """Remove the finished batches of a study."""
    batch_store(case).clear()


def finished(case: Case) -> int:
    """Samples of a study that an interrupted run has left on disk."""
    store = batch_store(case)
    return sum(
        len(b) for b in batches_of(case.tolerance.samples) if store.get(_file(b)) is not None
    )


def _all(
    setup: ToleranceSetup,
    store: StudyStore[Batch],
    batches: Sequence[range],
    workers: int | None,
    scheduler: str | None,
    progress: Progress,
) -> list[Batch]:
    """Every batch, from the disk where it was finished before."""
    finished, faults = stored_or_run(
        store, [_file(b) for b in batches], sampled, setup, batches, workers=workers,
        scheduler=scheduler, progress=lambda share: progress("samples", share),
    )  # fmt: skip
    if faults:
        first = batches[min(faults)]
        raise FlexgearError(
            f"{len(faults)} of {len(batches)} batches of samples failed; samples {first.start} to "
            f"{first.stop - 1}: {faults[min(faults)]}; the same study goes on with what is missing"
        )
    return [finished[k] for k in range(len(batches))]


def _dataset(setup: ToleranceSetup, stated: Batch, batches: Sequence[Batch]) -> xr.Dataset:
    case, whole = setup.case, _joined(batches)
    labels = {p: [n for e in setup.drawn if e.is_phase == p for n in e.labels] for p in (0, 1)}
    positions = {g.name: g.positions.stop - g.positions.start for g in setup.groups}
    return tolerance_dataset(
        {
            "error_size": whole.sizes,
            "error_phase": whole.phases,
            "load_sharing_max": whole.load_sharing_max,
            "load_sharing_mean": whole.load_sharing_mean,
            "planet_load_factor_max": whole.planet_max,
            "planet_load_factor_mean": whole.planet_mean,
            "load_sharing_as_stated": stated.load_sharing_max[0],
            "k_h_beta": whole.k_h_beta,
            "largest_line_load": whole.line_load,
            "k_h_beta_as_stated": stated.k_h_beta[0],
            "largest_line_load_as_stated": stated.line_load[0],
        },
        sizes=labels[False],
        phases=labels[True],
        gear_meshes=setup.shared,
        confidence=case.tolerance.confidence,
        attrs=provenance(
            case=case.name,
            variant=setup.variant,
            content_hash=case.content_hash(),
            parameters=case.to_dict(),
            seed=case.tolerance.seed,
            positions=json.dumps(positions, ensure_ascii=False),
        ),
    )


def _joined(batches: Sequence[Batch]) -> Batch:
    names = [f.name for f in fields(Batch)]
    return Batch(**{n: np.concatenate([getattr(b, n) for b in batches]) for n in names})
