"""A stage with all that its case says of it."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

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
        """That of the first spring, without the number of a planet."""
        return "planet_bearing" if self.part == "planet" else self.labels[0]


_PARALLEL_WORDS = {"sun": "pinion", "planet": "gear"}


@dataclass(frozen=True)
class StageView:
    """One stage of a case: its gears and members, and the keys of the case that concern it."""

    case: Case
    stage: Stage

    @property
    def name(self) -> str:
        """Name of the stage."""
        return self.stage.name

    @property
    def material(self) -> Material:
        """Material of all its bodies."""
        return self.stage.material or self.case.material

    @property
    def ring_gear(self) -> RingGear:
        """The ring of a planetary stage, lumped or FE; AttributeError where there is none."""
        part: RingGear = _there(self.stage.ring, "ring")
        return part

    @property
    def ring(self) -> Ring:
        """The ring's FE body; AttributeError where it is lumped."""
        part: Ring = _there(self.stage.ring and self.stage.ring.fe, "FE ring")
        return part

    @property
    def carrier(self) -> Carrier:
        """The carrier's FE body; AttributeError where it is lumped."""
        part: Carrier = _there(self.stage.carrier and self.stage.carrier.fe, "FE carrier")
        return part

    @property
    def shaft(self) -> Shaft:
        """The sun's shaft; AttributeError where there is none."""
        part: Shaft = _there(self.stage.sun and self.stage.sun.shaft, "sun shaft")
        return part

    @property
    def fe_bodies(self) -> dict[BodyName, FeMeshSource]:
        """Sections of its FE bodies; "<stage>.planet" is that of all planets."""
        parts = ("ring", "planet", "carrier", "sun", "pinion", "gear")
        sections = {part: getattr(getattr(self.stage, part), "fe", None) for part in parts}
        return {BodyName.of(self.name, part): fe for part, fe in sections.items() if fe}

    @property
    def flexible_bodies(self) -> dict[BodyName, FeMeshSource | Shaft]:
        """Sections of bodies that may be flexible: its FE bodies, and the shaft of its sun."""
        shaft = self.stage.sun and self.stage.sun.shaft
        return self.fe_bodies | ({BodyName.of(self.name, "shaft"): shaft} if shaft else {})

    @property
    def bearings(self) -> tuple[BearingPlace, ...]:
        """Bearings of its planets and members, and of the body behind its sun's spline; supports
        only of what turns, if they carry force, or with rating data."""
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
            key = "output" if port is self.case.output else f"inputs.{number}"
            spring = SupportName.of(f"{self.name}.output")
            places.append(
                BearingPlace(f"{key}.bearing", port.bearing, "sun", (spring,), ("output_bearing",))
            )
        return tuple(places)

    def support_names(self, part: str, key: str) -> list[SupportName]:
        """Names of a support of all bodies of a member; key: "support", "support.0" …"""
        number = int(key.removeprefix("support").strip(".") or -1) + 1
        if self.stage.form(part) == "beam":
            return [SupportName.of(f"{self.name}.{part}", "support" if number else "", number)]
        bodies = self.stage.body_names(part)
        return [SupportName.of(body, "support", number) for body in bodies]

    def is_held(self, part: str) -> bool:
        """Whether a member does not turn."""
        return f"{self.name}.{part}" in self.case.held_members()

    def fe_tie(self, role: str) -> Literal["root", "flank"] | None:
        """Where the contact nodes of "ring" or "planet" are tied to a flexible FE body; None for
        other gears and for rigid bodies, which have no part of the teeth's compliance."""
        body = getattr(getattr(self.stage, role), "fe", None)
        tie: Literal["root", "flank"] | None = body.tie if body and body.flexible else None
        return tie

    def with_rigid(self, parts: Collection[str]) -> StageView:
        """The same stage with the FE bodies of some members rigid."""
        changes = {f"stages.{self.name}.{part}.fe.flexible": False for part in parts}
        return self.with_(**changes) if changes else self

    @property
    def gear_mesh(self) -> GearMesh:
        """Options of its gear meshes."""
        return self.stage.gear_mesh

    def bodies_hash(self) -> str:
        """SHA-256, 64 hex digits, of the keys that its FE bodies depend on (stage geometry, ``fe``,
        material, solver)."""
        data: dict[str, Any] = {"stage": self.stage.dump_geometry()}
        data |= {body.part: {"fe": fe.model_dump()} for body, fe in self.fe_bodies.items()}
        digest_files(data)
        data |= {"material": self.material.model_dump(), "solver": self.case.solver.model_dump()}
        return content_hash(data)

    def with_(self, **changes: Any) -> StageView:
        """The same stage of the case with these SI values changed (``Case.with_``)."""
        return self.case.with_(**changes).view(self.name)

    def key(self, name: str = "") -> str:
        """A key of the stage as messages write it: "stages.stage_2.planets"; the stage itself for
        ""."""
        return stage_key(self.name, name)

    def part(self, role: str) -> str:
        """ "sun", "planet" and "ring" as the stage calls them: pinion and gear if parallel."""
        return _PARALLEL_WORDS.get(role, role) if self.stage.kind == "parallel" else role

    def refuse(self, name: str, problem: str, remedy: str) -> InputError:
        """InputError for a key of the stage, named as the case file writes it."""
        return InputError(self.case.source, self.key(name), problem, remedy)


def _there(part: Any, what: str) -> Any:
    if part is None:
        raise AttributeError(f"the stage has no {what}")
    return part


def stage_key(name: str, key: str) -> str:
    """A key of a stage in the form of --set: "stages.stage_2.planets"; the stage itself for ""."""
    alone = name in ("", "stage")  # written [stage]
    return f"{'stage' if alone else f'stages.{name}'}.{key}".rstrip(".")


@contextmanager
def inside(case: Case, stage: Stage) -> Iterator[None]:
    """Context in which an InputError about FE bodies, with keys "stage.ring.fe", names the
    stage."""
    try:
        yield
    except InputError as fault:
        name = stage_key(stage.name, "") + "."
        key, remedy = (re.sub(r"(?<![\w.])stage\.", name, t) for t in (fault.key, fault.remedy))
        raise InputError(case.source, key, fault.problem, remedy) from None
