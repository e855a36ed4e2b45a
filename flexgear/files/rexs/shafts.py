"""The shaft of a sun: sections of a file that become a beam of the case.

The beam of a case consists of cylinders from the middle of the sun to its spline at one end. Its
end is where the path to the rest of the train leaves the shaft: at a coupling, a part of the next
member, or the load. A bearing acts at the gear or, if the sun is a port and the bearing is nearer
to the end, on the body behind the spline.
"""

from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from math import pi

from flexgear.files.case_text import CaseText, Section
from flexgear.files.rexs.assembly import Assembly, ShaftSection, sections_of
from flexgear.files.rexs.document import Component, Document, mark, mean, value
from flexgear.files.rexs.stages import Member, axial_place
from flexgear.files.rexs.supports import Scale, SupportWriter
from flexgear.files.rexs.tables import MATERIAL, PORT_BODY, SHAFT_SECTION, SPRINGS

_MIN_LENGTH = 0.1  # mm, of a cylinder, and of a gap between sections
_CYLINDERS = 4  # that replace a cone
_TILT = ("bending_stiffness", "N m / rad")
_DIRECTIONS = tuple(row.field for row in SPRINGS)


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
        tilts = self.coupling is not None and not value(self.coupling, *_TILT)
        needs = (*(() if supported else ("radial",)), *(("tilt",) if tilts else ()))
        supports.springs(section, self.bearings, scale, _DIRECTIONS[:3], needs, self.ends[1])


def support_positions(assembly: Assembly, body: Sequence[Member]) -> set[float]:
    """Axial positions (mm, to 0.1 mm) of the bearings of a body and of suns among planets."""
    positions = [m.z for m in body if m.role == "sun" and len(m.stage.halves["planet"][0]) >= 3]
    positions += [axial_place(assembly, bearing) for m in body for bearing in m.bearings]
    return {round(z, 1) for z in positions if z is not None}


def sun_shafts(
    assembly: Assembly,
    members: Sequence[Member],
    joined: Iterable[tuple[Member, Member]],
    held: Container[Member],
    loads: Mapping[Member, Component],
) -> dict[Member, SunShaft]:
    """Shafts of suns, each up to the casing (of a held sun), the next member, or the load. Suns
    with several neighbours have none."""
    shafts = {}
    for sun in (m for m in members if m.role == "sun" and m.anchor is not None):
        others = [a if b is sun else b for a, b in joined if sun in (a, b)]
        z = others[0].z if others else None
        target = others[0].anchor if others else loads.get(sun)
        if sun in held:
            of_body = assembly.members(sun.body)
            target, z = next(c for c in of_body if c.kind == "gear_casing"), None
        shaft = None if len(others) > 1 else _sun_shaft(assembly, sun, target, z)
        if shaft is not None:
            shafts[sun] = shaft
    return shafts


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
