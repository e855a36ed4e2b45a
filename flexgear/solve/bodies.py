"""Reduced rings and carriers of a case, made once and shared by all that is solved over it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

from flexgear.coupling.pace import case_pace
from flexgear.coupling.system import Variant
from flexgear.model.case import Case
from flexgear.model.errors import InputError, echo
from flexgear.model.read import nearest
from flexgear.model.stage_view import StageView
from flexgear.structures.build import carrier_body, ring_body
from flexgear.structures.reduced import ReducedBody

Progress = Callable[[str, float], None]
PARTS = ("ring", "carrier", "shaft")


def silent(stage: str, fraction: float) -> None:
    """Progress that nobody watches."""


class StageBodies(NamedTuple):
    """The two reduced bodies of a flexible stage."""

    ring: ReducedBody
    carrier: ReducedBody


Bodies = Mapping[str, StageBodies]


def stage_bodies(
    stage: StageView, progress: Progress = silent, limit_hz: float | None = None
) -> StageBodies:
    """FE mesh, assembly and reduction of ring and carrier, or both from the cache.

    limit_hz: frequency up to which they are compared with the unreduced bodies.
    """
    return StageBodies(
        ring_body(stage, named("ring", progress), limit_hz),
        carrier_body(stage, named("carrier", progress), limit_hz),
    )


def reduced_bodies(case: Case, progress: Progress = silent) -> dict[str, StageBodies]:
    """Ring and carrier of every flexible stage by its name."""
    found = {}
    for name, stage in case.flexible_stages.items():
        report = progress if case.is_short else named(name, progress)
        found[name] = stage_bodies(stage, report, reduction_limit(case, name))
    return found


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
    known = [*PARTS, *(f"{s}.{part}" for s in case.flexible_stages for part in PARTS), "all"]
    for name in rigid:
        if not case.flexible_stages:
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
                for part in PARTS
            }
        )
        for name, stage in case.flexible_stages.items()
    }


def all_rigid(case: Case) -> dict[str, Variant]:
    """Nothing bends."""
    return variants_of(case, ["all"] if case.flexible_stages else [])
