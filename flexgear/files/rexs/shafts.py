"""Joints between the members of one body: shafts of suns, beams, springs of couplings.

Neighbours along the axis are joined. A shaft of one diameter between them becomes a beam. Otherwise
the joint has the torsional stiffness of shaft sections and couplings in series, and in the other
directions the stiffness that the couplings state.

The shaft of a sun consists of cylinders from the middle of the sun to its spline at one end. Its
end is where the path to the rest of the train leaves the shaft: at a coupling, a part of the next
member, or the load. A bearing acts at the gear or, if the sun is a port and the bearing is nearer
to the end, on the body behind the spline.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from math import pi

from flexgear.files.case_text import CaseText, Section
from flexgear.files.rexs.assembly import Assembly, ShaftSection, sections_of
from flexgear.files.rexs.document import Component, Document, mark, mean, read, value
from flexgear.files.rexs.stages import Member, axial_place
from flexgear.files.rexs.supports import Scale, SupportWriter
from flexgear.files.rexs.tables import MATERIAL, PORT_BODY, SHAFT_SECTION, SPRINGS

_MIN_LENGTH = 0.1  # mm, of a cylinder, and of a gap between sections
_CYLINDERS = 4  # that replace a cone
_MIN_BEAM_LENGTH = 1.0  # mm
_TILT = SPRINGS[2]
_DIRECTIONS = tuple(row.field for row in SPRINGS)

Pair = tuple[Member, Member]


@dataclass(frozen=True)
class Piece:
    """A cylinder of a shaft: its sizes, mm, and the source of its data."""

    length: float
    outer_diameter: float
    inner_diameter: float
    source: str

    def put(self, section: Section) -> None:
        """Write the sizes to a section of a sun's shaft, or a joint."""
        for row in SHAFT_SECTION:
            section.put(row.key, getattr(self, row.field), self.source)


@dataclass(frozen=True, eq=False)
class SunShaft:
    """The shaft of a sun.

    pieces: cylinders, beginning at the gear. ends: positions of gear and end along the gear unit's
    u axis, mm. coupling: coupling at the end, None if the next body is rigidly connected. outside:
    length of the sections that are not in the beam, mm. gap: length without sections between the
    end of the beam and the end of the path, mm. bearings: bearings that act at the end.
    """

    member: Member
    shaft: Component
    pieces: tuple[Piece, ...]
    ends: tuple[float, float]
    coupling: Component | None
    outside: float
    gap: float
    bearings: list[Component] = field(default_factory=list)

    def take_bearings(self, assembly: Assembly, case: CaseText, port: bool) -> None:
        """Assign the bearings of the sun to the gear or the end of the shaft.

        If the sun is a port, bearings nearer to the end act there. The couplings of the sun become
        the spline. A warning is added for each bearing that is not at the point where it acts.
        """
        member, (gear, end) = self.member, self.ends
        half = sum(value(g, "face_width", "mm") for g in member.stage.gears(member.role)) / 2
        member.couplings.clear()
        for bearing in tuple(member.bearings):
            place = axial_place(assembly, bearing)
            if place is None:
                continue
            distance, limit, where = abs(place - gear), half, "gear"
            if port and abs(place - end) < distance:
                member.bearings.remove(bearing)
                self.bearings.append(bearing)
                distance, limit, where = abs(place - end), _MIN_LENGTH, "end of the shaft"
            if distance > limit:
                case.warn(
                    f"{bearing.label}: {distance:.4g} mm from the {where} of {member.name}, where "
                    "it acts by a rigid arm in the case"
                )

    @property
    def left_out(self) -> list[str]:
        """Descriptions of sections that are not in the case, or missing in the file."""
        shaft, sun, lines = self.shaft.label, self.member.name, []
        if self.outside > _MIN_LENGTH:
            lines.append(
                f"{shaft}: mass and bending of {self.outside:.4g} mm of its sections, which are not"
                f" between the middle of {sun} and the end of its beam"
            )
        if self.gap > _MIN_LENGTH:
            lines.append(f"{shaft}: has no sections in {self.gap:.4g} mm behind the beam of {sun}")
        return lines

    def write(self, supports: SupportWriter, scale: Scale) -> None:
        """Write the section [stages.sun.shaft] and the sections nested in it."""
        (gear, end), case = self.ends, supports.case
        section = case.section("[stages.sun.shaft]")
        where = "the next part" if self.coupling is None else self.coupling.label
        side = "+z" if end > gear else "-z"
        section.put("direction", side, f"{self.shaft.label}, from the gear to {where}")
        for piece in self.pieces:
            section = case.section("[[stages.sun.shaft.sections]]")
            piece.put(section)
        spline = case.section("[stages.sun.shaft.spline]")
        if self.coupling is not None:
            joints, needs = [self.coupling], ("radial", "torsion")
            supports.springs(spline, joints, scale, _DIRECTIONS, needs, None)
            return
        for row in SPRINGS:
            why = "rigid: no coupling at the end of the shaft"
            spline.assume(row.key, scale.limit(row.field), why)

    def write_port_body(self, section: Section, masses: list[Component]) -> None:
        """Write mass and inertia of the body behind the spline of a port.

        They are those of additional masses, or else of a short steel cylinder.
        """
        d = 1e-3 * self.pieces[-1].outer_diameter
        stub = MATERIAL[2].usual * pi / 4 * d**3
        sizes = {"mass": stub, "tilt_inertia": stub * d**2 * 7 / 48, "inertia": stub * d**2 / 8}
        for row in PORT_BODY:
            data = [x for mass in masses if (x := mean([mass], row.names, row.unit)) is not None]
            total = sum(datum.value for datum in data)
            mark(masses, f"behind the shaft of {self.member.name}")
            if total > 0.0:
                section.put(row.key, total, " + ".join(datum.source for datum in data))
            else:
                why = "not in the file; a cylinder of steel as long and wide as the shaft's end"
                section.assume(row.key, sizes[row.field], why)

    def write_bearings(self, port: Section, supports: SupportWriter, scale: Scale) -> None:
        """Write the bearing of the body behind the spline of a port.

        Radial stiffness is assumed if nothing else supports the body, tilt stiffness if the spline
        transmits no bending moment.
        """
        section = supports.case.section(f"[{port.header.strip('[]')}.bearing]", behind=port)
        supported = self.bearings or len(support_positions(supports.assembly, [self.member])) > 1
        tilts = self.coupling is not None and not value(self.coupling, _TILT.names[0], _TILT.unit)
        needs = (*(() if supported else ("radial",)), *(("tilt",) if tilts else ()))
        supports.springs(section, self.bearings, scale, _DIRECTIONS[:3], needs, self.ends[1])


def support_positions(assembly: Assembly, body: Sequence[Member]) -> set[float]:
    """Axial positions (mm, to 0.1 mm) of the bearings of a body and of suns among planets."""
    positions = [m.z for m in body if m.role == "sun" and len(m.stage.halves["planet"][0]) >= 3]
    positions += [axial_place(assembly, bearing) for m in body for bearing in m.bearings]
    return {round(z, 1) for z in positions if z is not None}


def _sun_shaft(
    assembly: Assembly, member: Member, target: Component | None, target_z: float | None
) -> SunShaft | None:
    """The shaft of a sun up to ``target``, whose axial position is target_z (mm). Returns None if
    the file has no sections of the shaft."""
    assert member.anchor is not None
    path = [] if target is None else assembly.path(member.anchor, target)
    if len(path) < 2:
        return None
    (first, k), (last, m) = path[:2]
    shaft, beyond = (assembly.document.components[link.ends[n]] for link, n in path[:2])
    if shaft.kind != "shaft":
        return None
    coupling = None if last.coupling is None else assembly.document.components[last.coupling]
    gear, end = first.at[k], last.at[1 - m]
    if gear is None or len(member.stage.gears(member.role)) > 1:
        gear = _along(assembly, shaft, member.z)
    for z in (axial_place(assembly, coupling or beyond), target_z):
        end = _along(assembly, shaft, z) if end is None else end
    sections = [(part.label, section) for part, section in sections_of(assembly.document, shaft)]
    if gear is None or not sections:
        return None
    if end is None:
        edges = [u for _, s in sections for u in (s.start, s.start + s.length)]
        end = max(edges, key=lambda u: abs(u - gear))
    half = value(member.anchor, "face_width", "mm") / 2
    pieces = tuple(_pieces(sections, gear, end, half))
    if not pieces:
        return None
    reach = sum(piece.length for piece in pieces)
    gap = abs(end - gear) - reach
    end = gear + (reach if end > gear else -reach)
    z = member.z or 0.0
    ends = z, z + assembly.frames.sense(shaft) * (end - gear)
    outside = sum(section.length for _, section in sections) - reach
    return SunShaft(member, shaft, pieces, ends, coupling, outside, gap)


def pieces_between(
    document: Document, shaft: Component, a: float | None, b: float | None
) -> list[Piece]:
    """Cylinders between the positions a and b on a shaft; none if its sections have a gap there."""
    if shaft.kind != "shaft" or a is None or b is None:
        return []
    sections = [(part.label, section) for part, section in sections_of(document, shaft)]
    pieces = list(_pieces(sections, a, b, 0.0))
    return pieces if abs(sum(p.length for p in pieces) - abs(b - a)) < _MIN_LENGTH else []


def _along(assembly: Assembly, shaft: Component, z: float | None) -> float | None:
    """Coordinate u on a shaft of a position along the gear unit's u axis, mm."""
    origin = axial_place(assembly, shaft)
    return None if z is None or origin is None else (z - origin) * assembly.frames.sense(shaft)


def _pieces(
    sections: list[tuple[str, ShaftSection]], begin: float, end: float, half: float
) -> Iterator[Piece]:
    """Cylinders from ``begin`` to ``end`` on a shaft, up to the first gap in its sections. A gap of
    up to ``half`` at the begin, half the face width of the gear there, is bridged."""
    forward, at = end > begin, begin
    ordered = sorted(sections, key=lambda pair: pair[1].start, reverse=not forward)
    for label, section in ordered:
        low, high = section.start, section.start + section.length
        near, far = (low, min(high, end)) if forward else (high, max(low, end))
        gap = near - at if forward else at - near
        if gap > max(_MIN_LENGTH, half if at == begin else 0.0):
            return
        if (far - at if forward else at - far) < _MIN_LENGTH:
            continue
        cone = section.outer[0] != section.outer[1] or section.inner[0] != section.inner[1]
        count = _CYLINDERS if cone else 1
        note = f", {count} cylinders in place of a cone" if cone else ""
        for n in range(count):
            middle = at + (far - at) * (n + 0.5) / count
            outer, inner = section.diameters(min(max(middle, low), high))
            if outer <= inner:
                return
            yield Piece(abs(far - at) / count, outer, inner, f"{label}{note}")
        at = far


class Joints:
    """Joints of a train.

    pairs: joined members. held: members that do not rotate, with reasons. shafts: shafts of suns.
    beams: shafts of one diameter between two members. left_out: descriptions of what is not
    carried over.
    """

    def __init__(
        self, assembly: Assembly, members: list[Member], held: Mapping[Member, str]
    ) -> None:
        self.assembly, self.members, self.held = assembly, members, held
        self.pairs = list(self._neighbours(members))
        self.shafts: dict[Member, SunShaft] = {}
        self.beams: dict[Pair, Piece] = {}
        self.left_out: list[str] = []

    def find_shafts(self, case: CaseText, loads: Mapping[Member, Component]) -> None:
        """Find the shafts of suns with their bearings, and the beams. loads: at ports."""
        for sun in (m for m in self.members if m.role == "sun" and m.anchor is not None):
            shaft = self._shaft(sun, loads)
            if shaft is not None:
                self.shafts[sun] = shaft
                shaft.take_bearings(self.assembly, case, sun in loads)
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

    def _shaft(self, sun: Member, loads: Mapping[Member, Component]) -> SunShaft | None:
        """Shaft of a sun up to the casing, if it is held, the next member, or the load. A sun with
        several neighbours has none."""
        others = [a if b is sun else b for a, b in self.pairs if sun in (a, b)]
        if len(others) > 1:
            return None
        if sun in self.held:
            of_body = self.assembly.members(sun.body)
            casing = next(c for c in of_body if c.kind == "gear_casing")
            return _sun_shaft(self.assembly, sun, casing, None)
        target = others[0].anchor if others else loads.get(sun)
        return _sun_shaft(self.assembly, sun, target, others[0].z if others else None)

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
