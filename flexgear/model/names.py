"""Names of members, bodies, nodes and gear meshes: text with fields."""

import re
from collections.abc import Sequence
from typing import Annotated, Any, Self

from pydantic import AfterValidator

SIDES = ("left", "right")  # halves of a double-helical stage
GEAR_MESH, SHAFT = "gear mesh", "shaft"  # kinds of excitation
PLANET_PASS, BOLT_PASS = "planet pass", "bolt pass"
_MEMBER_OF = {"shaft": "sun", "output": "sun", "hub": "ring"}  # by part of a body
MOUNT = "mount"  # kind of the nodes of an FE housing with springs to the ground
_NUMBERED = re.compile(rf"(.+?)(?:_({'|'.join(SIDES)}))?_(\d+)")


class _Name(str):
    """Text whose parts are also fields."""

    def __new__(cls, text: str, **fields: Any) -> Self:
        name = super().__new__(cls, text)
        vars(name).update(fields)
        return name


class MemberName(_Name):
    """A member of a stage, "<stage>.<part>"; "<stage>.planet" means all of its planets.

    ``of`` creates a name from fields, ``parse`` from text; part is "" if the text has no dot.
    """

    stage: str
    part: str

    @classmethod
    def of(cls, stage: str, part: str) -> Self:
        """Name of a part of a stage."""
        return cls(f"{stage}.{part}", stage=stage, part=part)

    @classmethod
    def parse(cls, text: str) -> Self:
        """Name from a user's text."""
        stage, _, part = text.partition(".")
        return cls(text, stage=stage, part=part)


Member = Annotated[str, AfterValidator(MemberName.parse)]  # in a section of a case


class SupportName(_Name):
    """A spring between a body and the housing: "<body>", or "<body>_support", "<body>_torsion", of
    one of several "<body>_support_<number from 1>".

    place: node of an FE housing on which it stands, "<body>", "<body>_<number>"; kind: "support" of
    a member, "torsion" for the spring against its rotation, or "" of a bearing.
    """

    place: str
    kind: str

    @classmethod
    def of(cls, body: str, kind: str = "", number: int = 0) -> Self:
        """Name of the support of a body; number: from 1 of several, else 0."""
        which = f"_{number}" if number else ""
        text = f"{body}_{kind}{which}" if kind else body
        return cls(text, place=f"{body}{which}", kind=kind)


class BodyName(_Name):
    """A body: "<stage>.<part>", "<stage>.planet_<number from 1>", "<stage>.ring_<side>", "housing".

    stage: "" for the housing; planet: index from 0, −1 for other bodies; side: half of a
    double-helical ring, or "".
    """

    stage: str
    part: str
    planet: int
    side: str

    @classmethod
    def of(cls, stage: str, part: str, planet: int = -1, side: str = "") -> Self:
        """Name of the body of a part, of one planet, of one half."""
        which = f"_{planet + 1}" if planet >= 0 else f"_{side}" if side else ""
        text = f"{stage}.{part}{which}" if stage else f"{part}{which}"
        return cls(text, stage=stage, part=part, planet=planet, side=side)

    @property
    def member(self) -> MemberName:
        """Member that the body belongs to: the sun of its shaft and of the body behind that, the
        ring of its hub, "<stage>.planet" of each planet."""
        return MemberName.of(self.stage, _MEMBER_OF.get(self.part, self.part))

    @property
    def alike(self) -> Self:
        """Name for all equal bodies: "<stage>.planet" for a planet, this name for other bodies."""
        return self if self.planet < 0 else self.of(self.stage, self.part)

    @classmethod
    def parse(cls, text: str) -> Self:
        """Name from a label of a result."""
        stage, _, last = str(text).rpartition(".")
        part, _, which = last.partition("_")
        if which.isdecimal():
            return cls.of(stage, part, int(which) - 1)
        return cls.of(stage, part, side=which) if which in SIDES else cls.of(stage, last)


class NodeName(_Name):
    """A node of a body: "<kind>_<number>", of one half "<kind>_<side>_<number>", or "<kind>".

    side: half of a double-helical ring, or ""; number: from 1, 0 for a name without number.
    """

    kind: str
    side: str
    number: int

    @classmethod
    def of(cls, kind: str, number: int, digits: int = 1) -> Self:
        """Name of one of several nodes of a kind."""
        return cls(f"{kind}_{number:0{digits}}", kind=kind, side="", number=number)

    @classmethod
    def parse(cls, text: str) -> Self:
        """Name from that of an FE mesh or of a result."""
        match = _NUMBERED.fullmatch(text)
        kind, side, number = match.groups("") if match else (text, "", 0)
        return cls(text, kind=kind, side=side, number=int(number))

    def of_half(self, side: str) -> Self:
        """Name of the node in a body of both halves: "tooth_001" -> "tooth_left_001"."""
        return self.parse(f"{self.kind}_{side}{self.removeprefix(self.kind)}")


class GroupName(_Name):
    """Gear meshes of all planets of a stage, of one kind and side: "<stage> <kind>[ <side>]".

    kind: "ring", "sun", or "pinion" of a parallel stage; side: half of a double-helical stage, or
    ""; part: kind and side, such as "sun left".
    """

    stage: str
    kind: str
    side: str
    part: str

    @property
    def role(self) -> str:
        """Role of the gear that meshes with planets, "ring" or "sun"; that of a pinion is "sun"."""
        return "sun" if self.kind == "pinion" else self.kind

    @classmethod
    def of(cls, stage: str, kind: str, side: str = "") -> Self:
        """Name of a group of a stage."""
        part = f"{kind} {side}" if side else kind
        return cls(f"{stage} {part}", stage=stage, kind=kind, side=side, part=part)

    @classmethod
    def parse(cls, text: str) -> Self:
        """Name from a label of a result."""
        return cls.of(*str(text).split(" "))


class GearMeshName(_Name):
    """A gear mesh of one planet with ring or sun: "<group> <planet from 1>", or of a pinion with
    its gear: "<stage> pinion 1"; group: gear meshes that share the load."""

    group: GroupName
    stage: str
    kind: str
    side: str
    planet: int

    @classmethod
    def of(cls, stage: str, kind: str, side: str, planet: int) -> Self:
        """Name of the gear mesh of one planet."""
        group = GroupName.of(stage, kind, side)
        return cls(f"{group} {planet}", **vars(group), group=group, planet=planet)

    @classmethod
    def parse(cls, text: str) -> Self:
        """Name from a label of a result."""
        group, _, planet = str(text).rpartition(" ")
        of = GroupName.parse(group)
        return cls.of(of.stage, of.kind, of.side, int(planet))

    @staticmethod
    def joined(names: Sequence["GearMeshName"]) -> str:
        """Label of gear meshes of one group: "<group> <planet>, <planet>"."""
        planets = sorted(name.planet for name in names)
        return f"{names[0].group} {', '.join(map(str, planets))}"


class FlankName(_Name):
    """One flank of a gear mesh: "<group> <planet> <sense>"; sense: "drive" or "coast"."""

    group: GroupName
    sense: str

    @classmethod
    def parse(cls, text: str) -> Self:
        """Name from a label of a result."""
        group, _, sense = str(text).rsplit(" ", 2)
        return cls(text, group=GroupName.parse(group), sense=sense)


class ExcitationName(_Name):
    """An excitation of a train, "<cause> x <order>".

    The cause is "<stage>" for its gear meshes, "<stage>.<part>" for the rotation of a member,
    "<stage> planet pass" for the planets passing a point of the ring, or "<stage> bolt pass" for
    planets passing the bolts of an FE ring. kind: GEAR_MESH, SHAFT, PLANET_PASS or BOLT_PASS;
    part: of a shaft, else ""; order: multiple of the cause's frequency, of bolts their number.
    """

    kind: str
    stage: str
    part: str
    order: str

    @classmethod
    def of(cls, kind: str, stage: str, order: float, part: str = "") -> Self:
        """Name of an order of a cause."""
        cause = f"{stage}.{part}" if part else stage
        text = f"{cause}{f' {kind}' if kind in (PLANET_PASS, BOLT_PASS) else ''} x {order:g}"
        return cls(text, kind=kind, stage=stage, part=part, order=f"{order:g}")

    @classmethod
    def parse(cls, text: str) -> Self:
        """Name from a label of a result: "stage_1 x 3", "stage_1.sun x 1"."""
        cause, _, order = str(text).rpartition(" x ")
        member = MemberName.parse(cause)
        passing = (kind for kind in (PLANET_PASS, BOLT_PASS) if cause.endswith(f" {kind}"))
        kind = SHAFT if member.part else next(passing, GEAR_MESH)
        stage = member.stage.removesuffix(f" {kind}")
        return cls(text, kind=kind, stage=stage, part=member.part, order=order)
