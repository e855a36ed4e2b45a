"""Reduced FE bodies of a case, shared by all its analyses."""

import threading
from collections.abc import Collection, Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, wait
from contextlib import contextmanager
from typing import TypeVar

import psutil  # type: ignore[import-untyped]

from flexgear.coupling.connections import has_coupled_slices
from flexgear.coupling.pace import case_pace
from flexgear.gears.geometry import stage_geometry
from flexgear.model.case import Case
from flexgear.model.errors import FlexgearError, InputError, echo
from flexgear.model.names import BodyName
from flexgear.model.read import nearest
from flexgear.model.sensor import require_places
from flexgear.model.stage_view import StageView
from flexgear.structures.linalg.dense import single_threaded_blas
from flexgear.structures.reduced import Progress, ReducedBody, silent
from flexgear.structures.sources.of_case import fe_sources
from flexgear.structures.tooth_influence.of_case import tooth_influence
from flexgear.structures.tooth_influence.roots import root_of_case

_BYTES = {"quick": 1e9, "standard": 2e9, "fine": 4e9}  # for the reduction of two generated bodies
LOOK_UP = 0.2  # s between two looks for signals while threads work
Bodies = Mapping[BodyName, ReducedBody]
T = TypeVar("T")


def stage_bodies(
    view: StageView, progress: Progress = silent, rigid: Collection[BodyName] = ()
) -> dict[BodyName, ReducedBody]:
    """The reduced FE bodies of a stage by name, meshed and reduced or read from the cache. rigid:
    bodies that are left out."""
    pace = case_pace(view.case)
    sources = {name: s for name, s in fe_sources(view).items() if name not in rigid}
    enough_memory = _BYTES[view.case.solver.fidelity] < psutil.virtual_memory().available
    threads = len(sources) if enough_memory else 1  # half of the work of a body is single-threaded
    with single_threaded_blas(), stoppable_pool(max(threads, 1), progress) as (pool, report):
        futures = {
            name: pool.submit(
                lambda s, progress, limit: s.whole(s.reduced(progress, limit)),
                source,
                named(name.part, report),
                pace.reduction_limit_of(name),
            )
            for name, source in sources.items()
        }
        return {name: when_done(future).result() for name, future in futures.items()}


def when_done(future: Future[T]) -> Future[T]:
    """Wait until a future is done, and return it. Python handles signals in the main thread, but a
    signal that another thread receives does not end its wait; so it waits in short steps."""
    while not future.done():
        wait([future], LOOK_UP)
    return future


@contextmanager
def stoppable_pool(
    workers: int, progress: Progress
) -> Iterator[tuple[ThreadPoolExecutor, Progress]]:
    """A pool of threads, and a progress function for their work, which raises FlexgearError after
    an exception in the context: so all threads end soon."""
    stop = threading.Event()

    def report(stage: str, share: float) -> None:
        if stop.is_set():
            raise FlexgearError("interrupted")
        progress(stage, share)

    with ThreadPoolExecutor(workers) as pool:
        try:
            yield pool, report
        except BaseException:
            stop.set()
            pool.shutdown(wait=True, cancel_futures=True)
            raise


def reduced_bodies(
    case: Case, progress: Progress = silent, rigid: Collection[BodyName] | None = None
) -> dict[BodyName, ReducedBody]:
    """All flexible FE bodies of a case by name; also computes the influences of its teeth, which
    are stored in the cache. rigid: rigid bodies, those of the case if left out."""
    bodies = dict[BodyName, ReducedBody]()
    rigid = rigid_bodies(case) if rigid is None else rigid
    require_places(case, rigid)
    for stage_case in case.stages:
        _make_influences(case.view(stage_case.name), named(stage_case.name, progress))
    for name, stage in case.flexible_stages.items():
        report = progress if name == "stage" else named(name, progress)
        bodies |= stage_bodies(stage, report, rigid)
    return bodies


def _make_influences(view: StageView, progress: Progress) -> None:
    """Compute, for the cache, influences of a stage's teeth if its slices are coupled, and of loads
    on their roots if root stress by FE is required."""
    influences = {
        "influence of a tooth": (has_coupled_slices(view), tooth_influence),
        "root of a tooth": (view.gear_mesh.root_stress == "fe", root_of_case),
    }
    for label, (applies, make) in influences.items():
        for role in ("planet", *stage_geometry(view).gear_meshes) if applies else ():
            progress(f"{role}: {label}", 0.0)
            make(view, role)
            progress(f"{role}: {label}", 1.0)


def named(body: str, progress: Progress) -> Progress:
    """A progress function whose stages begin with the name of a body or stage."""

    def report(stage: str, share: float) -> None:
        progress(stage if stage.startswith(body) else f"{body}: {stage}", share)

    return report


def titled(title: str, progress: Progress) -> Progress:
    """A progress function that reports ``title`` instead of the stages of the work."""
    return lambda _, share: progress(title, share)


def rigid_bodies(case: Case, names: Sequence[str] = ()) -> frozenset[BodyName]:
    """Rigid ones of the flexible bodies: those that the case states, and those named.

    names: "ring", "carrier", "planet", "shaft" of all stages or "stage_1.ring" of one; "all".
    InputError for an unknown name, or in a case without flexible bodies.
    """
    bodies = case.flexible_bodies
    choices = [*dict.fromkeys(body.part for body in bodies), *bodies, "all"]
    for name in names:
        if not bodies:
            problem = "has only lumped members, so nothing is flexible"
            remedy = "take it out, or give the ring, carrier or sun an FE body or a shaft"
            raise InputError("--rigid", case.name, problem, remedy)
        if name not in choices:
            raise InputError(
                "--rigid", echo(name), "is not a flexible component", nearest(name, choices)
            )
    return frozenset(
        body
        for body, section in bodies.items()
        if not section.flexible or {body, body.part, "all"} & {*names}
    )
