"""A stage together with the keys of its case that concern it."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, TypeVar

from flexgear.model.bodies import Carrier, FeMeshSource, Material, Shaft
from flexgear.model.content import content_hash, digest_files
from flexgear.model.errors import InputError
from flexgear.model.names import BodyName, SupportName
from flexgear.model.ring import Ring

if TYPE_CHECKING:
    from flexgear.model.bearings import Bearing
    from flexgear.model.case import Case
    from flexgear.model.gear_mesh import GearMesh
    from flexgear.model.member import RingGear
    from flexgear.model.stage import Stage


@dataclass(frozen=True)
class BearingPlace:
    """A bearing of a case, and what it supports.

    key: of its section as messages write it; part: member or "planet" whose shaft or bore it is on,
    "sun" also behind a shaft's spline, "ring" of a hub; springs: their names in results, of all
    planets' bearings or of both halves of a ring; labels: of each in summaries, without the stage.
    """

    key: str
    bearing: Bearing
    part: str
    springs: tuple[SupportName, ...]
    labels: tuple[str, ...]

    @property
    def label(self) -> str:
        """Label of the first spring, without the number of a planet."""
        return "planet_bearing" if self.part == "planet" else self.labels[0]

    @property
    def direction(self) -> str | None:
        """Direction of the thrust that it takes as one of a pair of single rows."""
        return None if self.bearing.thrust is None else self.bearing.thrust.direction


T = TypeVar("T")
_PARALLEL_PARTS = {"sun": "pinion", "planet": "gear"}


@dataclass(frozen=True)
class StageView:
    """A stage and its case."""

    case: Case
    stage: Stage

    def __repr__(self) -> str:
        return f"<{self.name} of {self.case!r}>"

    @property
    def name(self) -> str:
        """Name of the stage."""
        return self.stage.name

    @property
    def material(self) -> Material:
        """Material of the stage's bodies."""
        return self.stage.material or self.case.material

    @property
    def ring_gear(self) -> RingGear:
        """The ring of a planetary stage, lumped or FE; AttributeError if there is none."""
        return _required(self.stage.ring, "ring")

    @property
    def ring(self) -> Ring:
        """The ring's FE body; AttributeError if the ring is lumped."""
        return _required(self.stage.ring.fe if self.stage.ring else None, "FE ring")

    @property
    def carrier(self) -> Carrier:
        """The carrier's FE body; AttributeError if the carrier is lumped."""
        return _required(self.stage.carrier.fe if self.stage.carrier else None, "FE carrier")

    @property
    def shaft(self) -> Shaft:
        """The sun's shaft; AttributeError if there is none."""
        return _required(self.stage.sun.shaft if self.stage.sun else None, "sun shaft")

    @property
    def fe_bodies(self) -> dict[BodyName, FeMeshSource]:
        """Sections of the stage's FE bodies by name; "<stage>.planet" is that of all planets."""
        parts = ("ring", "planet", "carrier", "sun", "pinion", "gear")
        sections = {part: getattr(getattr(self.stage, part), "fe", None) for part in parts}
        return {BodyName.of(self.name, part): fe for part, fe in sections.items() if fe}

    @property
    def flexible_bodies(self) -> dict[BodyName, FeMeshSource | Shaft]:
        """Sections of the stage's FE bodies and of the sun's shaft, by name."""
        shaft = self.stage.sun and self.stage.sun.shaft
        return self.fe_bodies | ({BodyName.of(self.name, "shaft"): shaft} if shaft else {})

    @property
    def bearings(self) -> tuple[BearingPlace, ...]:
        """Bearings of its planets and members, and of the body behind its sun's spline.

        Those without rating data are left out if they carry no force, or support a held member.
        """
        places, numbers = list[BearingPlace](), range(1, self.stage.planets + 1)
        for key, bearing in self.stage.bearings.items():
            part, _, below = key.partition(".")
            is_support = below.startswith("support")
            is_idle = not bearing.matrix[:3, :3].any() or (is_support and self.is_held(part))
            if is_support and is_idle and bearing.rolling is None:
                continue
            labels = [key.replace(".", "_")]
            if is_support:
                springs = self.support_names(part, below)
                labels = [s.partition(".")[2] if s.kind else f"{part}_support" for s in springs]
            elif part == "planet_bearing":
                part, labels = "planet", [f"planet_bearing_{k}" for k in numbers]
                springs = [SupportName.of(f"{self.name}.{label}") for label in labels]
            else:  # seats of a carrier, and the hub of a ring
                at = "hub" if part == "ring" else below.replace("bearing", part)
                springs = [SupportName.of(f"{self.name}.{at}")]
            places.append(BearingPlace(self.key(key), bearing, part, tuple(springs), tuple(labels)))
        port = self.case.port_at(f"{self.name}.sun")
        if port is not None and port.bearing is not None:
            number = self.case.ports.index(port)
            driven = port is self.case.output
            key, label = ("output", "output") if driven else (f"inputs.{number}", "input")
            spring = SupportName.of(f"{self.name}.output")
            places.append(
                BearingPlace(
                    f"{key}.bearing", port.bearing, "sun", (spring,), (f"{label}_bearing",)
                )
            )
        return tuple(places)

    def mate(self, place: BearingPlace) -> BearingPlace | None:
        """Bearing of the same member that takes the thrust in the other direction."""
        others = [p for p in self.bearings if p.part == place.part and p.direction]
        return next((p for p in others if place.direction not in (None, p.direction)), None)

    def support_names(self, part: str, key: str) -> list[SupportName]:
        """Names of a support of all bodies of a member; key: "support", "support.0" …"""
        number = int(key.removeprefix("support").strip(".") or -1) + 1
        if self.stage.form(part) == "beam":
            return [SupportName.of(f"{self.name}.{part}", "support" if number else "", number)]
        bodies = self.stage.body_names(part)
        return [SupportName.of(body, "support", number) for body in bodies]

    def is_held(self, part: str) -> bool:
        """Whether a member is held."""
        return f"{self.name}.{part}" in self.case.held_members()

    def fe_tie(self, role: str) -> Literal["root", "flank"] | None:
        """Surface to which contact nodes of "ring" or "planet" are tied; None for lumped gears and
        for rigid FE bodies, whose FE model has no compliance of teeth."""
        body = getattr(getattr(self.stage, role), "fe", None)
        tie: Literal["root", "flank"] | None = body.tie if body and body.flexible else None
        return tie

    def with_rigid(self, parts: Collection[str]) -> StageView:
        """The stage with the FE bodies of some members made rigid."""
        changes = {f"stages.{self.name}.{part}.fe.flexible": False for part in parts}
        return self.with_(**changes) if changes else self

    @property
    def gear_mesh(self) -> GearMesh:
        """Options of the stage's gear meshes."""
        return self.stage.gear_mesh

    def bodies_hash(self) -> str:
        """SHA-256, 64 hex digits, of the keys on which the stage's FE bodies depend: geometry,
        ``fe``, material, solver."""
        data: dict[str, Any] = {"stage": self.stage.dump_geometry()}
        data |= {body.part: {"fe": fe.model_dump()} for body, fe in self.fe_bodies.items()}
        digest_files(data)
        data |= {"material": self.material.model_dump(), "solver": self.case.solver.model_dump()}
        return content_hash(data)

    def with_(self, **changes: Any) -> StageView:
        """The stage in a copy of the case with SI values changed (``Case.with_``)."""
        return self.case.with_(**changes).view(self.name)

    def key(self, name: str = "") -> str:
        """A key of the stage in messages: "stages.stage_2.planets", for "" the stage itself."""
        return stage_key(self.name, name)

    def part(self, role: str) -> str:
        """Part of the stage in the role "sun", "planet" or "ring": pinion or gear if parallel."""
        return _PARALLEL_PARTS.get(role, role) if self.stage.kind == "parallel" else role

    def refuse(self, name: str, problem: str, remedy: str) -> InputError:
        """InputError for a key of the stage."""
        return InputError(self.case.source, self.key(name), problem, remedy)


def _required(part: T | None, what: str) -> T:
    if part is None:
        raise AttributeError(f"the stage has no {what}")
    return part


def stage_key(name: str, key: str) -> str:
    """A key of a stage in the form of --set, "stages.stage_2.planets"; for "" the stage itself."""
    is_only = name in ("", "stage")  # written [stage]
    return f"{'stage' if is_only else f'stages.{name}'}.{key}".rstrip(".")


@contextmanager
def inside(case: Case, stage: Stage) -> Iterator[None]:
    """Context that replaces "stage." in the keys of InputErrors about FE bodies by the stage's
    name."""
    try:
        yield
    except InputError as fault:
        name = stage_key(stage.name, "") + "."
        key, remedy = (re.sub(r"(?<![\w.])stage\.", name, t) for t in (fault.key, fault.remedy))
        raise InputError(case.source, key, fault.problem, remedy) from None
