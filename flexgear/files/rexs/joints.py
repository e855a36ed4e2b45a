"""Joints between the members of one body: shafts of suns, beams, springs of couplings.

Neighbours along the axis are joined. A shaft of one diameter between them becomes a beam. Otherwise
the joint has the torsional stiffness of shaft sections and couplings in series, and in the other
directions the stiffness that the couplings state.
"""

from collections.abc import Iterator, Mapping
from itertools import pairwise

from flexgear.files.case_text import CaseText, Section
from flexgear.files.rexs.assembly import Assembly
from flexgear.files.rexs.document import Component, read, value
from flexgear.files.rexs.ports import Port
from flexgear.files.rexs.shafts import (
    Piece,
    SunShaft,
    pieces_between,
    sun_shafts,
    support_positions,
)
from flexgear.files.rexs.stages import Member
from flexgear.files.rexs.supports import Scale
from flexgear.files.rexs.tables import SPRINGS

_TILT = SPRINGS[2]
_MIN_BEAM_LENGTH = 1.0  # mm

Pair = tuple[Member, Member]


class Joints:
    """Joints of a train.

    pairs: joined members. held: members that do not rotate, with reasons. shafts: shafts of suns.
    beams: shafts of one diameter between two members. left_out: descriptions of what is not
    carried over.
    """

    def __init__(
        self, assembly: Assembly, members: list[Member], held: Mapping[Member, str]
    ) -> None:
        self.assembly, self.held = assembly, held
        self.pairs = list(self._neighbours(members))
        self.shafts: dict[Member, SunShaft] = {}
        self.beams: dict[Pair, Piece] = {}
        self.left_out: list[str] = []

    def find_shafts(self, case: CaseText, members: list[Member], ports: list[Port]) -> None:
        """Find the shafts of suns with their bearings, and the beams."""
        loads = {port.member: port.loads[0] for port in ports}
        self.shafts |= sun_shafts(self.assembly, members, self.pairs, self.held, loads)
        for shaft in self.shafts.values():
            shaft.take_bearings(self.assembly, case, shaft.member in loads)
            self.left_out += shaft.left_out
        for pair in self.written:
            pieces = self._pieces(pair)
            sizes = {(piece.outer_diameter, piece.inner_diameter) for piece in pieces}
            length, labels = sum(p.length for p in pieces), [p.source for p in pieces]
            if len(sizes) == 1 and length >= _MIN_BEAM_LENGTH:
                self.beams[pair] = Piece(length, *sizes.pop(), " + ".join(labels))
            elif pieces:
                line = f"{labels[0]} to {labels[-1]}: bending between {pair[0].name} and "
                self.left_out.append(f"{line}{pair[1].name}, whose joint has one diameter or none")

    @property
    def has_flexible_shafts(self) -> bool:
        """Whether the case has a flexible shaft."""
        return bool(self.shafts or self.beams)

    @property
    def written(self) -> list[Pair]:
        """Pairs that become joints: all but those of two held members."""
        return [p for p in self.pairs if not (p[0] in self.held and p[1] in self.held)]

    def body(self, member: Member) -> list[Member]:
        """Members of a member's body, in the order of their joints."""
        joined = dict.fromkeys(m for pair in self.pairs for m in pair)
        return [m for m in joined if m.body == member.body] or [member]

    def is_carried(self, member: Member) -> bool:
        """Whether bearings support a member, or the casing supports the spline of its shaft."""
        shaft = self.shafts.get(member)
        at_end = shaft is not None and (bool(shaft.bearings) or member in self.held)
        return at_end or bool(member.bearings)

    def is_held_against_tilt(self, member: Member) -> bool:
        """Whether supports at two positions prevent tilt of a member.

        Supports are bearings, and the planets around a sun; all joints of the body must transmit
        bending moments.
        """
        body = self.body(member)
        pairs = [pair for pair in self.written if pair[0] in body]
        stiff = bool(pairs) and all(map(self._transmits_moment, pairs))
        return stiff and len(support_positions(self.assembly, body)) > 1

    def write(self, case: CaseText, scales: Mapping[str, Scale]) -> None:
        """Write every joint of the train into a case. scales: stiffness limits by stage."""
        for pair in self.written:
            scale, section = scales[pair[0].stage_name], case.section("[[joints]]")
            for key, member in zip(("first", "second"), pair, strict=True):
                assert member.anchor is not None
                section.put(key, member.name, member.anchor.label)
            beam = self.beams.get(pair)
            if beam is not None:
                beam.put(section)
                continue
            stiffness, couplings = self.assembly.torsion(*self._ends(pair))
            limit = scale.limit("torsion")
            labels = ["shaft sections between them", *(c.label for c in couplings)]
            if stiffness < limit:
                section.put("torsion_nm_per_rad", stiffness, ", ".join(labels))
            else:
                why = f"rigid in the file ({', '.join(labels[1:]) or 'same body'})"
                section.assume("torsion_nm_per_rad", limit, why)
            self._write_springs(section, couplings, scale, self._sun(pair) is not None)

    def _write_springs(
        self, section: Section, couplings: list[Component], scale: Scale, sun: bool
    ) -> None:
        """Write radial, axial and tilt stiffness: that of the couplings in series, if all state it.

        sun: whether the shaft of a sun ends at the joint, which then needs stiffness in all
        directions.
        """
        for row in SPRINGS[:3]:
            data = [datum for c in couplings if (datum := read([c], row)) is not None]
            limit = scale.limit(row.field)
            if data and len(data) == len(couplings) and all(datum.value > 0 for datum in data):
                lowest = min(datum.value for datum in data)
                total = lowest / sum(lowest / datum.value for datum in data)
                section.put(row.key, min(total, limit), " and ".join(d.source for d in data))
            elif sun and not data:
                section.assume(row.key, limit, "rigid behind the sun's shaft")
            elif row.field == "axial":
                why = "one body along the axis; its bending is not carried over"
                section.assume(row.key, limit, why)

    def _neighbours(self, members: list[Member]) -> Iterator[Pair]:
        """Pairs of members of the same body that are neighbours along the axis."""
        for body in dict.fromkeys(m.body for m in members):
            of_body = [m for m in members if m.body == body]
            if body is not None and body not in self.assembly.casings:
                if all(m.z is not None for m in of_body):
                    of_body.sort(key=lambda m: m.z or 0.0)
                yield from pairwise(of_body)

    def _sun(self, pair: Pair) -> Member | None:
        """The member of a pair that is a sun on a shaft, None if neither is."""
        return next((m for m in pair if m in self.shafts), None)

    def _ends(self, pair: Pair) -> tuple[Component, Component, int]:
        """Components at both ends of a pair, a sun on a shaft first, and the number of links that
        belong to the sun's shaft."""
        sun = self._sun(pair)
        first, second = pair if sun in (None, pair[0]) else pair[::-1]
        assert first.anchor is not None and second.anchor is not None
        return first.anchor, second.anchor, 0 if sun is None else 2

    def _pieces(self, pair: Pair) -> list[Piece]:
        """Cylinders between two members; none if a coupling between them is flexible."""
        first, second, beyond = self._ends(pair)
        path = self.assembly.path(first, second)[max(beyond - 1, 0) :]
        if any(link.compliance for link, _ in path[1 if beyond else 0 :]):
            return []
        document = self.assembly.document
        return [
            piece
            for (before, k), (after, m) in pairwise(path)
            for piece in pieces_between(
                document, document.components[before.ends[k]], before.at[k], after.at[1 - m]
            )
        ]

    def _transmits_moment(self, pair: Pair) -> bool:
        """Whether a joint, including the spline of a sun's shaft, transmits bending moments."""
        if pair in self.beams:
            return True
        shaft = self.shafts.get(self._sun(pair) or pair[0])
        if shaft is None:
            return False
        joints = [*self.assembly.torsion(*self._ends(pair))[1], shaft.coupling]
        return all(value(c, _TILT.names[0], _TILT.unit) > 0 for c in joints if c is not None)
