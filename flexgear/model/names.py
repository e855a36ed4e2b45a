"""Names of members and bodies: text to the user, fields to the program."""

from __future__ import annotations

from typing import Annotated, Self

from pydantic import AfterValidator

SIDES = ("left", "right")  # halves of a double-helical stage


class MemberName(str):
    """A member of a stage, "<stage>.<part>"; "<stage>.planet" stands for all of its planets.

    ``of`` makes it from its fields, ``parse`` from text, whose part is "" where it has no dot.
    """

    stage: str
    part: str

    @classmethod
    def of(cls, stage: str, part: str) -> Self:
        """The part of a stage."""
        return cls._with(f"{stage}.{part}", stage, part)

    @classmethod
    def parse(cls, text: str) -> Self:
        """What a user wrote."""
        stage, _, part = text.partition(".")
        return cls._with(text, stage, part)

    @classmethod
    def _with(cls, text: str, stage: str, part: str) -> Self:
        name = cls(text)
        name.stage, name.part = stage, part
        return name


Member = Annotated[str, AfterValidator(MemberName.parse)]  # in a section of a case


class SupportName(str):
    """A spring between a body and the housing: "<place>", or "<place>_support", "<place>_torsion".

    place: node of an FE housing on which it stands; kind: "support" of a lumped member, "torsion",
    what resists its rotation, or "" of a bearing.
    """

    place: str
    kind: str

    @classmethod
    def of(cls, place: str, kind: str = "") -> Self:
        """At a place of the housing."""
        name = cls(f"{place}_{kind}" if kind else place)
        name.place, name.kind = place, kind
        return name


class BodyName(str):
    """A body: "<stage>.<part>", "<stage>.planet_<number from 1>", "<stage>.ring_<side>", "housing".

    stage: "" of the housing; planet: from 0, −1 of other bodies; side: half of a double-helical
    ring, or "".
    """

    stage: str
    part: str
    planet: int
    side: str

    @classmethod
    def of(cls, stage: str, part: str, planet: int = -1, side: str = "") -> Self:
        """The body of a part, of one planet, of one half."""
        which = f"_{planet + 1}" if planet >= 0 else f"_{side}" if side else ""
        name = cls(f"{stage}.{part}{which}" if stage else f"{part}{which}")
        name.stage, name.part, name.planet, name.side = stage, part, planet, side
        return name

    @classmethod
    def parse(cls, text: str) -> Self:
        """A label of a result."""
        stage, _, last = str(text).rpartition(".")
        part, _, which = last.partition("_")
        if which.isdecimal():
            return cls.of(stage, part, int(which) - 1)
        return cls.of(stage, part, side=which) if which in SIDES else cls.of(stage, last)
