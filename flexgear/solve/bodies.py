"""Reduced rings and carriers of a case, made once and shared by all that is solved over it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

from flexgear.coupling.pace import case_pace
from flexgear.coupling.stage_meshes import bend_each_other
from flexgear.coupling.system import Variant
from flexgear.gears.geometry import stage_geometry
from flexgear.model.case import Case
from flexgear.model.errors import InputError, echo
from flexgear.model.read import nearest
from flexgear.model.stage_view import StageView
from flexgear.structures.build import carrier_body, ring_body
from flexgear.structures.halves import whole_ring
from flexgear.structures.reduced import ReducedBody
from flexgear.structures.tooth_influence import root_of_case, tooth_influence, with_rim

Progress = Callable[[str, float], None]


def silent(stage: str, fraction: float) -> None:
    """Progress that nobody watches."""


class StageBodies(NamedTuple):
    """Reduced FE bodies of a stage, None where the member is lumped."""

    ring: ReducedBody | None
    carrier: ReducedBody | None

    @property
    def by_part(self) -> dict[str, ReducedBody]:
        """Those that there are."""
        return {part: body for part, body in self._asdict().items() if body is not None}


Bodies = Mapping[str, StageBodies]


def stage_bodies(
    view: StageView, progress: Progress = silent, limit_hz: float | None = None
) -> StageBodies:
    """FE mesh, assembly and reduction of ring and carrier, or both from the cache.

    limit_hz: frequency up to which they are compared with the unreduced bodies.
    """
    found: dict[str, ReducedBody | None] = dict.fromkeys(StageBodies._fields)
    for part, reduce in (("ring", ring_body), ("carrier", carrier_body)):
        if part in view.fe_parts:
            found[part] = reduce(view, named(part, progress), limit_hz)
    if found["ring"] is not None:
        found["ring"] = whole_ring(view, with_rim(view, found["ring"]))
    return StageBodies(**found)


def reduced_bodies(case: Case, progress: Progress = silent) -> dict[str, StageBodies]:
    """Ring and carrier of every flexible stage by its name; influences of teeth go to the cache."""
    found = {}
    for own in case.stages:
        _make_influences(case.view(own.name), named(own.name, progress))
    for name, stage in case.flexible_stages.items():
        report = progress if case.is_short else named(name, progress)
        found[name] = stage_bodies(stage, report, reduction_limit(case, name))
    return found


def _make_influences(view: StageView, progress: Progress) -> None:
    """Influences of a stage's teeth, where its slices bend each other, and of loads on their roots,
    where these are asked for, into the cache."""
    wanted = {
        "influence of a tooth": (bend_each_other(view), tooth_influence),
        "root of a tooth": (view.gear_mesh.root_stress == "fe", root_of_case),
    }
    for said, (asked, make) in wanted.items():
        for role in ("planet", *stage_geometry(view).gear_meshes) if asked else ():
            progress(f"{role}: {said}", 0.0)
            make(view, role)
            progress(f"{role}: {said}", 1.0)


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
    parts = dict.fromkeys(part for own in bending.values() for part in own)
    known = [*parts, *(f"{name}.{part}" for name, own in bending.items() for part in own), "all"]
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
