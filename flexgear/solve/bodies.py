"""Reduced FE bodies of a case, made once and shared by all that is solved over it."""

from __future__ import annotations

import threading
from collections.abc import Collection, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager

import psutil  # type: ignore[import-untyped]

from flexgear.coupling.connections import has_coupled_slices
from flexgear.coupling.pace import case_pace
from flexgear.gears.geometry import stage_geometry
from flexgear.model.case import Case
from flexgear.model.errors import FlexgearError, InputError, echo
from flexgear.model.names import BodyName
from flexgear.model.read import nearest
from flexgear.model.stage_view import StageView
from flexgear.structures.linalg.dense import single_threaded_blas
from flexgear.structures.reduced import Progress, ReducedBody, silent
from flexgear.structures.sources.of_case import fe_sources
from flexgear.structures.tooth_influence.of_case import tooth_influence
from flexgear.structures.tooth_influence.roots import root_of_case

_BYTES = {"quick": 1e9, "standard": 2e9, "fine": 4e9}  # that two generated bodies take to reduce
Bodies = Mapping[BodyName, ReducedBody]


def stage_bodies(
    view: StageView,
    progress: Progress = silent,
    limit_hz: float | None = None,
    rigid: Collection[BodyName] = (),
) -> dict[BodyName, ReducedBody]:
    """FE mesh, assembly and reduction of all FE bodies of a stage, or all from the cache.

    limit_hz: frequency up to which they are compared with the unreduced bodies; rigid: bodies that
    are not made.
    """
    sources = {name: s for name, s in fe_sources(view).items() if name not in rigid}
    roomy = _BYTES[view.case.solver.fidelity] < psutil.virtual_memory().available
    at_once = len(sources) if roomy else 1  # each in a thread: half of the work runs in one
    with single_threaded_blas(), stoppable_pool(max(at_once, 1), progress) as (pool, watched):
        waiting = {
            name: pool.submit(
                lambda s, report: s.whole(s.reduced(report, limit_hz)),
                source,
                named(name.part, watched),
            )
            for name, source in sources.items()
        }
        return {name: future.result() for name, future in waiting.items()}


@contextmanager
def stoppable_pool(
    workers: int, progress: Progress
) -> Iterator[tuple[ThreadPoolExecutor, Progress]]:
    """Threads, and the progress that work in them reports: it ends when the block fails."""
    stop = threading.Event()

    def watched(stage: str, share: float) -> None:
        if stop.is_set():
            raise FlexgearError("interrupted")
        progress(stage, share)

    with ThreadPoolExecutor(workers) as pool:
        try:
            yield pool, watched
        except BaseException:
            stop.set()
            pool.shutdown(wait=True, cancel_futures=True)
            raise


def reduced_bodies(
    case: Case, progress: Progress = silent, rigid: Collection[BodyName] | None = None
) -> dict[BodyName, ReducedBody]:
    """All flexible FE bodies; influences of teeth go to the cache.

    rigid: rigid bodies; those of the case by default.
    """
    bodies = dict[BodyName, ReducedBody]()
    rigid = rigid_bodies(case) if rigid is None else rigid
    for stage_case in case.stages:
        _make_influences(case.view(stage_case.name), named(stage_case.name, progress))
    for name, stage in case.flexible_stages.items():
        report = progress if name == "stage" else named(name, progress)
        bodies |= stage_bodies(stage, report, reduction_limit(case), rigid)
    return bodies


def _make_influences(view: StageView, progress: Progress) -> None:
    """Influences of a stage's teeth, where its slices bend each other, and of loads on their roots,
    where these are asked for, into the cache."""
    influences = {
        "influence of a tooth": (has_coupled_slices(view), tooth_influence),
        "root of a tooth": (view.gear_mesh.root_stress == "fe", root_of_case),
    }
    for label, (applies, make) in influences.items():
        for role in ("planet", *stage_geometry(view).gear_meshes) if applies else ():
            progress(f"{role}: {label}", 0.0)
            make(view, role)
            progress(f"{role}: {label}", 1.0)


def reduction_limit(case: Case) -> float:
    """Frequency up to which reduced bodies are compared with unreduced ones, Hz."""
    return case_pace(case).reduction_limit


def named(body: str, progress: Progress) -> Progress:
    """Progress whose stages start with the body's name."""

    def report(stage: str, share: float) -> None:
        progress(stage if stage.startswith(body) else f"{body}: {stage}", share)

    return report


def rigid_bodies(case: Case, names: Sequence[str] = ()) -> frozenset[BodyName]:
    """Bodies that do not bend of those that may: what the case says, and those named.

    names: "ring", "carrier", "shaft" of all stages or "stage_1.ring" of one; "all". InputError for
    a name that is none, or where nothing could bend.
    """
    bodies = case.flexible_bodies
    choices = [*dict.fromkeys(body.part for body in bodies), *bodies, "all"]
    for name in names:
        if not bodies:
            raise InputError(
                "--rigid", case.name, "has only lumped members, so nothing is flexible",
                "take it out, or give the ring, carrier or sun an FE body or a shaft",
            )  # fmt: skip
        if name not in choices:
            raise InputError(
                "--rigid", echo(name), "is not a flexible component", nearest(name, choices)
            )
    return frozenset(
        body
        for body, section in bodies.items()
        if not section.flexible or {body, body.part, "all"} & {*names}
    )
