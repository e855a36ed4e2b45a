"""Springs of a case from bearings and couplings of a file; mass and inertia of a carrier.

Bearings of one member act side by side on a rigid shaft. With ratings each is a support of its own;
else with radial stiffness k_i at z_i they are Σ k_i at their centre z_c = Σ k_i z_i/Σ k_i, with the
tilt stiffness Σ k_i (z_i − z_c)² beside their own. What a file calls rigid, or leaves out, gets a
stiffness of the size of the machine: E b is about ten times the stiffness of a gear mesh of face
width b (ISO 6336-1: c_γ ≈ 20 N/(mm µm)).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from flexgear.files.case_text import CaseText, Datum, Section
from flexgear.files.rexs import tables as table
from flexgear.files.rexs.assembly import Assembly, sections_of
from flexgear.files.rexs.document import Component, flag, mark, mean, number, read, text, value
from flexgear.files.rexs.stages import Member, axial_place

_OF_BEARING = (*table.SPRINGS, *table.RATING, *table.THRUST)
_SPRINGS = {row.field: row for row in table.SPRINGS}
_OPERATING = {  # by axis, names since REXS 1.3, and earlier names
    direction: [[f"operating_point_stiffness_{f}_{x}_d_{x}" for f in ("f", "dF")] for x in axes]
    for direction, axes in (("radial", "vw"), ("axial", "u"))
}
_ASSUMED = "assumed: "  # prefix of the source of an assumed stiffness
RIGID = 10.0  # times E b: a hundred gear meshes
UNKNOWN = 0.1  # times E b: about one gear mesh
CLEARANCES = ("operating_radial_bearing_clearance", "radial_bearing_clearance", "radial_clearance",
              "radial_backlash")  # fmt: skip
SIZES = ("inner_diameter", "outer_diameter")


@dataclass(frozen=True)
class Scale:
    """Reference stiffness of a stage: E b (N/m), and a radius (m) for rotational stiffness."""

    stiffness: float
    radius: float

    def limit(self, direction: str) -> float:
        """Stiffness above which a direction counts as rigid, N/m or N m/rad."""
        lever = self.radius**2 if direction in ("tilt", "torsion") else 1.0
        return RIGID * self.stiffness * lever

    def guess(self, direction: str) -> float:
        """Stiffness that is assumed if it is unknown, N/m or N m/rad."""
        return self.limit(direction) * UNKNOWN / RIGID


class SupportWriter:
    """Writes supports and planet bearings of stages into a case."""

    def __init__(self, assembly: Assembly, case: CaseText) -> None:
        self.document, self.assembly, self.case = assembly.document, assembly, case

    def support(self, member: Member, scale: Scale, needs: tuple[str, ...]) -> None:
        """Write the support of a member. needs: directions that must have a stiffness."""
        joints = [*member.bearings, *member.couplings]
        if not joints and not needs:
            return
        torsion = bool(member.couplings) or "torsion" in needs
        directions = ("radial", "axial", "tilt") + (("torsion",) if torsion else ())
        halves = len(member.stage.halves["ring"]) if member.role == "ring" else 1
        if self._stand_apart(member):
            held = {d for d in directions if any(self._stiffness(j, d, scale) for j in joints)}
            missing = tuple(d for d in needs if d not in {*held, "tilt"})
            thrusts = {}
            for joint in joints:
                section = self.case.section(f"[[stages.{member.role}.support]]")
                self.springs(section, [joint], scale, directions, missing, member.z)
                thrusts[joint] = self._rating(section, [joint])
            self._pair(thrusts)
            return
        section = self.case.section(f"[stages.{member.role}.support]")
        self.springs(section, joints, scale, directions, needs, member.z, halves)
        if len(member.bearings) == 1:
            self._rating(section, member.bearings)

    def _stand_apart(self, member: Member) -> bool:
        """Whether each bearing of a member becomes a support of its own; together they resist tilt.

        That needs several bearings at known places, at least one of them with ratings, and no
        coupling to the casing.
        """
        rated = any(read([bearing], table.RATING[0]) for bearing in member.bearings)
        places = {axial_place(self.assembly, bearing) for bearing in member.bearings}
        differ = member.z is not None and None not in places and len(places) > 1
        return rated and differ and not member.couplings

    def planet(
        self, bearings: list[list[Component]], scale: Scale, z: float | None, needs: tuple[str, ...]
    ) -> None:
        """Write the planet bearing of a stage, with the data of the first planet."""
        section = self.case.section("[stages.planet_bearing]")
        first = bearings[0] if bearings else []
        if not first:
            self.case.warn("[stages.planet_bearing]: no bearing of a planet in the file")
        for pair in (p for others in bearings[1:] for p in zip(first, others, strict=False)):
            for row in _OF_BEARING:  # marks equal values as used
                read(pair, row)
            for names in (CLEARANCES, *SIZES):
                number(pair, names, "mm")
            text(pair, "bearing_type")
        self.springs(section, first, scale, ("radial", "axial", "tilt"), needs, z)
        _take_clearance(section, first)
        self._rating(section, first, [twin for others in bearings[1:] for twin in others])

    def springs(
        self,
        section: Section,
        joints: list[Component],
        scale: Scale,
        directions: tuple[str, ...],
        needs: tuple[str, ...],
        z: float | None,
        halves: int = 1,
    ) -> None:
        """Write the stiffness of each direction: the sum over the joints, per half of a ring.

        z: axial position of the member, mm. needs: directions for which a stiffness is assumed if
        the joints have none.
        """
        note = "; half of it for each ring half" * (halves == 2)
        radial: list[tuple[float, float]] = []  # N/m and mm
        for direction in directions:
            of_joints = [(joint, self._stiffness(joint, direction, scale)) for joint in joints]
            data = [datum for _, datum in of_joints if datum is not None]
            total, sources = sum(d.value for d in data), [d.source for d in data]
            if direction == "radial" and z is not None:
                places = [(d.value, axial_place(self.assembly, j)) for j, d in of_joints if d]
                radial = [(k, place - z) for k, place in places if place is not None]
            if direction == "tilt" and (added := self._spread(section, radial)) > 0:
                total += added
                sources.append("distance of the radial springs")
            sources.sort(key=lambda source: not source.startswith(_ASSUMED))
            key = _SPRINGS[direction].key
            if sources and sources[0].startswith(_ASSUMED):
                why = "; ".join(source.removeprefix(_ASSUMED) for source in sources)
                section.assume(key, total / halves, f"{why}{note}")
            elif total > 0:
                section.put(key, total / halves, f"{' + '.join(sources)}{note}")
            elif direction in needs:
                why = "no support in the file; about the stiffness of a gear mesh"
                section.assume(key, scale.guess(direction) / halves, f"{why}{note}")

    def _spread(self, section: Section, radial: list[tuple[float, float]]) -> float:
        """Tilt stiffness of radial springs by their distances, N m/rad.

        radial: stiffness (N/m) and axial position (mm) of radial springs, whose centre is written.
        """
        total = sum(k for k, _ in radial)
        centre = sum(k * z for k, z in radial) / total if total > 0 else 0.0
        if centre and abs(centre) <= 1e3:
            section.put("z_mm", centre, "centre of the radial springs along the axis")
        return sum(k * (z - centre) ** 2 for k, z in radial) * 1e-6

    def _stiffness(self, joint: Component, direction: str, scale: Scale) -> Datum | None:
        """Stiffness of one bearing or coupling; None if it does not act in the direction."""
        datum, limit = read([joint], _SPRINGS[direction]), scale.limit(direction)
        only_stated = direction == "tilt" or (direction == "torsion" and not _is_coupling(joint))
        absorbs = None if only_stated else self._absorbs(joint, direction)
        if datum is not None and datum.value > limit:
            return Datum(limit, f"{datum.source} (rigid in the file)")
        if absorbs is False:
            return None
        stated = datum if datum is not None and datum.value > 0 else None
        if only_stated or stated is not None or (datum is not None and absorbs is None):
            return stated
        if _is_coupling(joint):
            return Datum(limit, f"{_ASSUMED}{joint.label} is rigid")
        point = mean([joint], _OPERATING.get(direction, ()), "N / m", positive=True)
        if point is not None or (absorbs is None and joint.kind == "concept_bearing"):
            return point
        lacks = f"{joint.label} has no {_SPRINGS[direction].names[0]}"
        why = f"{_ASSUMED}{lacks}; about the stiffness of a gear mesh"
        return Datum(scale.guess(direction), why)

    def _absorbs(self, joint: Component, direction: str) -> bool | None:
        """Whether a bearing supports force in a direction; None if the file does not state it."""
        if direction == "radial":
            absorbs = flag([joint], "radial_force_absorption")
            rolling = joint.kind.startswith("rolling")
            return True if absorbs is None and rolling else absorbs
        word = text([joint], "axial_force_absorption")
        if word is None or direction != "axial":
            return None
        if word in ("positive", "negative"):
            self.case.warn(
                f"{joint.label}: supports axial force in one direction, in the case in both"
            )
        return word != "no_direction"

    def _rating(
        self, section: Section, bearings: list[Component], twins: Sequence[Component] = ()
    ) -> Section | None:
        """Write load ratings and number of the bearings of one planet, and their rolling elements
        or else mean diameter, and factors of the equivalent load under thrust if the file has e, X
        and Y, or a contact angle; returns the section of these. twins: bearings of the other
        planets."""
        if read(bearings, table.RATING[0]) is None:
            return None
        for row in table.RATING:
            read(bearings, row)  # marks equal values as used
            data = [d for bearing in bearings if (d := read([bearing], row)) is not None]
            lowest = min(data, key=lambda datum: datum.value, default=None)
            section.take(row.key, lowest)
            if lowest is not None and max(datum.value for datum in data) > lowest.value:
                line = f"{lowest.source}: the lowest of {len(data)} bearings, which share the load"
                self.case.warn(f"{line} evenly in the case")
        type_text = text(bearings, "bearing_type")
        kind = "ball" if type_text is not None and "ball" in type_text else "roller"
        if type_text is None:
            section.assume("rolling", kind, "bearing_type is not in the file")
        else:
            section.put("rolling", kind, f"{bearings[0].label}, bearing_type {type_text}")
        if len(bearings) > 1:
            section.put("count", min(len(bearings), 8), "bearings of one planet")
        if self._elements(section, bearings, twins, type_text):
            return None
        sizes = [number(bearings, size, "mm") for size in SIZES]
        if section.holds(table.RATING[2].key) and None not in sizes:
            section.take("mean_diameter_mm", mean(bearings, SIZES, "mm"))
        factors = [(row.key, read(bearings, row)) for row in table.THRUST]
        if None in (datum for _, datum in factors[:3]):
            factors = self._contact_angle(bearings, type_text or kind)
        if not factors:
            return None
        below = number(bearings, table.RADIAL_BELOW_E, "none")
        if below is not None and below.value != 1.0:
            self.case.warn(f"{below.source}: is {below.value:g}, not 1; thrust does not count in P")
            return None
        thrust = self.case.section(f"[{section.header.strip('[]')}.thrust]", behind=section)
        for key, datum in factors:
            thrust.take(key, datum)
        return thrust

    def _pair(self, thrusts: Mapping[Component, Section | None]) -> None:
        """Write which direction of the shaft's thrust each of two single-row bearings takes; radial
        loads then induce thrust between them. thrusts: sections of thrust by bearing."""
        directed = []
        for bearing, thrust in thrusts.items():
            if thrust is None:
                continue
            word = text([bearing], "axial_force_absorption")
            rows = self.document.parts(bearing, "rolling_bearing_row")
            if word in ("positive", "negative") and len(rows) < 2:
                along = (word == "positive") == (self.assembly.frames.sense(bearing) > 0)
                source = f"{bearing.label}, axial_force_absorption {word}"
                directed.append((thrust, "+z" if along else "-z", source))
        if sorted(direction for _, direction, _ in directed) == ["+z", "-z"]:
            for thrust, direction, source in directed:
                thrust.put("direction", direction, source)

    def _contact_angle(
        self, bearings: list[Component], bearing_type: str
    ) -> list[tuple[str, Datum | None]]:
        """Contact angle and number of rows of one bearing, from which the factors of ISO 281 and
        ISO 76 follow; empty for other bearings, unequal rows, and angles without factors. A
        four-point bearing has the factors of two rows, as in catalogues."""
        rows = self.document.parts(bearings[0], "rolling_bearing_row")
        stated = [number([row], "pressure_angle", "deg") for row in rows]
        angles = [replace(a, value=abs(a.value)) for a in stated if a is not None]
        one = len(bearings) == len({a.value for a in angles}) == 1 and len(angles) == len(rows) <= 2
        if not one or not (20.0 if "ball" in bearing_type else 1.0) <= angles[0].value <= 45.0:
            return []
        count = 2 if "four_point" in bearing_type else len(rows)
        return [
            ("contact_angle_deg", angles[0]),
            ("rows", Datum(count, f"rows of {bearings[0].label}")),
        ]

    def _elements(
        self,
        section: Section,
        bearings: list[Component],
        twins: Sequence[Component],
        bearing_type: str | None,
    ) -> bool:
        """Write the rolling elements of radial bearings without a contact angle to a section nested
        in that of the bearing; returns whether the file states all of them, equal in all rows."""
        document, count = self.document, len(bearings)
        rows = [document.parts(bearing, "rolling_bearing_row") for bearing in (*bearings, *twins)]
        every = [row for of_bearing in rows for row in of_bearing]
        rolling = [part for row in every for part in document.parts(row, "rolling_element")]
        ball = bearing_type == table.RADIAL_BEARINGS[-1]
        data = {row.key: _same(every, row) for row in table.BEARING_ROW}
        data |= {row.key: _same(rolling, row) for row in table.ROLLING_ELEMENT[: 1 if ball else 2]}
        angle, several = number(every, "pressure_angle", "deg"), len(rows[0]) * count > 1
        if several:
            data["spacing_mm"] = self._spacing(bearings, len(rows[0]))
        is_radial = bearing_type in table.RADIAL_BEARINGS and (angle is None or angle.value == 0)
        if not is_radial or None in data.values():
            return False
        elements = self.case.section(f"[{section.header.strip('[]')}.elements]", behind=section)
        for key, datum in data.items():
            elements.take(key, datum)
        if len(rows[0]) > 1:
            elements.put("rows", len(rows[0]), f"rows of {bearings[0].label}")
        _take_clearance(elements, bearings)
        if not ball:
            elements.assume("profile", "logarithmic", "that of ISO/TS 16281")
        mark((*every, *rolling), "rolling elements")
        return True

    def _spacing(self, bearings: list[Component], rows: int) -> Datum | None:
        """Distance of neighbouring rows of one bearing, or of bearings with one row each, mm."""
        if len(bearings) == 1:
            return number(bearings, "distance_between_bearing_rows", "mm")
        places = [axial_place(self.assembly, bearing) for bearing in bearings]
        heights = [place for place in places if place is not None]
        if rows > 1 or len(heights) < len(places) or max(heights) == min(heights):
            return None
        source = f"places of {bearings[0].label} and those beside it"
        return Datum((max(heights) - min(heights)) / (len(heights) - 1), source)

    def carrier_blank(self, member: Member, density: float, arm: float) -> None:
        """Write mass and inertia of a carrier, those of its frame or of its side plates and pins.

        density: kg/m³, of parts without mass in the file; arm: centre distance, m.
        """
        section = self.case.section("[stages.carrier]")
        frames = [c for c in member.stage.carrier if c.kind == "planet_carrier"]
        stated = number(frames, "mass_of_component", "kg")
        section.take("mass_kg", stated)
        plates = [p for frame in frames for p in self.document.parts(frame, "side_plate")]
        solids = []  # mass and inertia of each part
        for plate in plates:
            d, bore, length = (
                value(plate, key, "m") for key in ("outer_diameter", "inner_diameter", "length")
            )
            if d > 0 and length > 0:
                plate.role = "the carrier"
                solids.append(_solid(plate, [(d, bore, length)], 0.0, density))
        if not solids:
            return
        stage = member.stage.component
        for pin in self.document.linked(stage, "planetary_stage", "shaft", "planet_pin"):
            cylinders = [
                (1e-3 * outer, 1e-3 * inner, 1e-3 * piece.length)
                for _, piece in sections_of(self.document, pin)
                for outer, inner in [piece.diameters(piece.start + piece.length / 2)]
            ]
            if cylinders:
                solids.append(_solid(pin, cylinders, arm, density))
        mass, inertia = np.sum(solids, axis=0).tolist()
        why = "derived: side plates and pins of the file"
        if stated is None:
            section.put("mass_kg", mass, why)
        section.put(
            "inertia_kg_m2", inertia if stated is None else inertia * stated.value / mass, why
        )


def _solid(
    part: Component, cylinders: list[tuple[float, float, float]], arm: float, density: float
) -> tuple[float, float]:
    """Mass (kg) and inertia (kg m²) of a part of a carrier about the carrier's axis.

    cylinders: outer and inner diameter and length, m; arm: distance of their axis, m; density:
    kg/m³, if the file does not state the mass of the part.
    """
    d, bore, length = np.array(cylinders).T
    masses = density * np.pi / 4 * (d**2 - bore**2) * length
    inertia = float(masses @ (arm**2 + (d**2 + bore**2) / 8))
    mass, stated = float(masses.sum()), value(part, "mass_of_component", "kg")
    scale = stated / mass if stated > 0 else 1.0
    return scale * mass, scale * inertia


def _same(parts: Sequence[Component], row: table.Row) -> Datum | None:
    """Value of a case's field that all parts have, None where one differs or lacks it."""
    data = [read([part], row) for part in parts]
    values = {None if datum is None else datum.value for datum in data}
    return data[0] if len(values) == 1 else None


def _take_clearance(section: Section, bearings: list[Component]) -> None:
    """Write the radial gap on every side of bearings, half of their diametral clearance."""
    clearance = number(bearings, CLEARANCES, "mm", positive=True)
    if clearance is not None:
        source = f"{clearance.source}, half the diametral clearance"
        section.put("clearance_mm", clearance.value / 2, source)


def _is_coupling(joint: Component) -> bool:
    """Whether a joint is a coupling rather than a bearing."""
    return "bearing" not in joint.kind
