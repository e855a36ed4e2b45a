"""Reduced rings and carriers of a case, made once and shared by all that is solved over it."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import psutil  # type: ignore[import-untyped]

from flexgear.coupling.pace import case_pace
from flexgear.coupling.stage_meshes import bend_each_other
from flexgear.coupling.system import Variant
from flexgear.gears.geometry import stage_geometry
from flexgear.model.case import Case
from flexgear.model.errors import FlexgearError, InputError, echo
from flexgear.model.read import nearest
from flexgear.model.stage_view import StageView
from flexgear.structures.build import carrier_body, ring_body
from flexgear.structures.halves import whole_ring
from flexgear.structures.linalg.threads import single_threaded_blas
from flexgear.structures.reduced import ReducedBody
from flexgear.structures.tooth_influence import root_of_case, tooth_influence, with_rim

Progress = Callable[[str, float], None]
_BYTES = {"quick": 1e9, "standard": 2e9, "fine": 4e9}  # that two generated bodies take to reduce


def silent(stage: str, fraction: float) -> None:
    """Progress that nobody watches."""


class StageBodies(NamedTuple):
    """Reduced FE bodies of a stage, None where the member is lumped or rigid."""

    ring: ReducedBody | None
    carrier: ReducedBody | None

    @property
    def by_part(self) -> dict[str, ReducedBody]:
        """Those that there are."""
        return {part: body for part, body in self._asdict().items() if body is not None}


Bodies = Mapping[str, StageBodies]


def stage_bodies(
    view: StageView,
    progress: Progress = silent,
    limit_hz: float | None = None,
    bends: Variant | None = None,
) -> StageBodies:
    """FE mesh, assembly and reduction of ring and carrier, or both from the cache.

    limit_hz: frequency up to which they are compared with the unreduced bodies; bends: what of the
    stage does, nothing else is made; by default all that can.
    """
    bends = bends or Variant()

    def ring(report: Progress) -> ReducedBody:
        return whole_ring(view, fe_ring(view, report, limit_hz))

    def carrier(report: Progress) -> ReducedBody:
        return carrier_body(view, report, limit_hz)

    makers = {"ring": ring, "carrier": carrier}
    wanted = {p: make for p, make in makers.items() if p in view.fe_parts and getattr(bends, p)}
    roomy = _BYTES[view.solver.fidelity] < psutil.virtual_memory().available
    bodies = _made(wanted, progress, len(wanted) if roomy else 1)
    return StageBodies(bodies.get("ring"), bodies.get("carrier"))


def fe_ring(
    view: StageView, progress: Progress = silent, limit_hz: float | None = None
) -> ReducedBody:
    """The reduced ring, of a double-helical stage its left half, and how its rim bends along the
    face where that counts."""
    return with_rim(view, ring_body(view, progress, limit_hz))


def _made(
    wanted: Mapping[str, Callable[[Progress], ReducedBody]], progress: Progress, at_once: int
) -> dict[str, ReducedBody]:
    """All that is wanted; so many threads of them, as half of the work runs in one thread."""
    stop = threading.Event()

    def watched(stage: str, share: float) -> None:
        if stop.is_set():
            raise FlexgearError("interrupted")
        progress(stage, share)

    with single_threaded_blas(), ThreadPoolExecutor(max(at_once, 1)) as pool:
        waiting = {part: pool.submit(make, named(part, watched)) for part, make in wanted.items()}
        try:
            return {part: future.result() for part, future in waiting.items()}
        except BaseException:
            stop.set()
            pool.shutdown(wait=True, cancel_futures=True)
            raise


def reduced_bodies(
    case: Case, progress: Progress = silent, bends: Mapping[str, Variant] | None = None
) -> dict[str, StageBodies]:
    """Rings and carriers that bend of every flexible stage by its name; influences of teeth go to
    the cache. bends: what does by stage; by default what the case says."""
    bodies, bends = {}, variants_of(case) if bends is None else bends
    for stage_case in case.stages:
        _make_influences(case.view(stage_case.name), named(stage_case.name, progress))
    for name, stage in case.flexible_stages.items():
        report = progress if name == "stage" else named(name, progress)
        bodies[name] = stage_bodies(stage, report, reduction_limit(case, name), bends[name])
    return bodies


def _make_influences(view: StageView, progress: Progress) -> None:
    """Influences of a stage's teeth, where its slices bend each other, and of loads on their roots,
    where these are asked for, into the cache."""
    wanted = {
        "influence of a tooth": (bend_each_other(view), tooth_influence),
        "root of a tooth": (view.gear_mesh.root_stress == "fe", root_of_case),
    }
    for label, (asked, make) in wanted.items():
        for role in ("planet", *stage_geometry(view).gear_meshes) if asked else ():
            progress(f"{role}: {label}", 0.0)
            make(view, role)
            progress(f"{role}: {label}", 1.0)


def reduction_limit(case: Case, stage: str) -> float:
    """Frequency up to which bodies of a flexible stage are compared with unreduced ones, Hz."""
    return case_pace(case).reduction_limit


def named(body: str, progress: Progress) -> Progress:
    """Progress whose stages start with the body's name."""

    def report(stage: str, share: float) -> None:
        progress(stage if stage.startswith(body) else f"{body}: {stage}", share)

    return report


def variants_of(case: Case, rigid: Sequence[str] = ()) -> dict[str, Variant]:
    """Which components of the flexible stages bend: their own choice, less those named rigid.

    rigid: "ring", "carrier", "shaft" of all flexible stages or "stage_1.ring" of one; "all".
    InputError for a name that is none, or where nothing could bend.
    """
    stages = case.flexible_stages
    bending = {name: stage.bending_parts for name, stage in stages.items()}
    parts = dict.fromkeys(part for parts_of_stage in bending.values() for part in parts_of_stage)
    known = [
        *parts,
        *(f"{name}.{part}" for name, parts_of_stage in bending.items() for part in parts_of_stage),
        "all",
    ]
    for name in rigid:
        if not stages:
            raise InputError(
                "--rigid", case.name, "has only lumped members, so nothing of it bends",
                "take it out, or give the ring, carrier or sun an FE body or a shaft",
            )  # fmt: skip
        if name not in known:
            raise InputError(
                "--rigid", echo(name), "is not a component that bends", nearest(name, known)
            )
    return {
        name: Variant(
            **{
                part: getattr(stage, part).flexible
                and not {part, f"{name}.{part}", "all"} & set(rigid)
                for part in bending[name]
            }
        ).of(bending[name])
        for name, stage in stages.items()
    }


def all_rigid(case: Case) -> dict[str, Variant]:
    """Nothing bends."""
    return variants_of(case, ["all"] if case.flexible_stages else [])
