"""Flank modifications: left and right flanks of a file become drive and coast flanks of a case.

The assignment depends on the torque of the stage, on the side of the datum face, and on whether the
gear is internal. Flanks are therefore read with their gears but written after the loads of the
case. The flanks of a planet are named after the gear that they touch under the rated torque, sun or
ring. Modifications that both flanks have are written once for the gear.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from flexgear.files.case_text import CaseText, Datum, Section, Value
from flexgear.files.rexs import tables as table
from flexgear.files.rexs.assembly import Assembly
from flexgear.files.rexs.document import SAME, Component, Document, read, text
from flexgear.files.rexs.stages import RexsStage, is_internal
from flexgear.files.rexs.tables import Modification, Word, outward, tooth_side
from flexgear.gears.paths import tooth_sides


@dataclass(frozen=True, eq=False)
class Row:
    """A key of the case, its value, its source, and whether the value is assumed. Rows are equal
    that have the same key and, to rounding, the same value."""

    key: str
    value: Value
    why: str
    assumed: bool = False

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Row) or self.key != other.key:
            return False
        if isinstance(self.value, float) and isinstance(other.value, float):
            return math.isclose(self.value, other.value, rel_tol=SAME)
        return self.value == other.value


@dataclass(frozen=True)
class Entry:
    """One modification of a flank.

    rows: keys in the section ``name`` below that of the flank, or in the flank's section for "".
    by_face: whether the modification differs between the two ends of the face.
    """

    name: str
    rows: tuple[Row, ...]
    by_face: bool = field(default=False, compare=False)


Flank = dict[str, Entry]  # by the kind of each modification


@dataclass(frozen=True)
class FlankOfGear:
    """Reader of the flanks of one gear. base: diameter of its base circle, mm; tip: diameter of its
    tip circle, None if unknown."""

    document: Document
    warn: Callable[[str], None]
    base: float
    tip: Datum | None

    def entries(self, flank: Component, datum: int) -> Flank:
        """Modifications of a flank by REXS type.

        datum: +1 if the datum face is at the +z end in the axes of modifications, else −1.
        """
        entries: Flank = {}
        ends: dict[str, tuple[Component, Entry]] = {}
        for kind, m in table.MODIFICATIONS.items():
            components = self.document.references(flank, kind)
            if not components:
                continue
            component, count = components[0], len(components)
            if count > 1:
                self.warn(f"{flank.label} has {count} of {kind}: only {component.label} is used")
            rows = self._relief(component, m) if m.section else self._amount(component, m, datum)
            if rows is None:
                lacks = "depth and length" if m.section else "amount"
                self.warn(f"{component.label} has no {lacks} that can be used")
                continue
            entry = Entry(m.section, rows, m.by_face)
            if m.face:
                ends["+z" if m.face * datum > 0 else "-z"] = component, entry
            else:
                _mark(component, m)
                entries[kind] = entry
        end_relief = self._end_relief(ends)
        return entries if end_relief is None else entries | {end_relief.name: end_relief}

    def _amount(self, component: Component, m: Modification, datum: int) -> tuple[Row, ...] | None:
        """The row of a crowning or slope; None without an amount."""
        data = [d for size in m.sizes if (d := read([component], size)) is not None]
        mean = sum(d.value for d in data) / max(len(data), 1)
        if not 0 < abs(mean) <= table.LARGEST:
            return None
        if max(abs(d.value - mean) for d in data) > 1e-6 * abs(mean):
            self.warn(f"{component.label} differs between its ends; the mean is used")
        sign = -datum if m.by_face else 1
        why = data[0].source + ("; its datum face is at the +z end" if sign < 0 else "")
        return (Row(m.sizes[0].key, sign * mean, why),)

    def _relief(self, component: Component, m: Modification) -> tuple[Row, ...] | None:
        """Rows of depth, length and form of a relief; None without depth or length."""
        depth, begin = read([component], m.sizes[0]), self._begin(component, m)
        if depth is None or begin is None or depth.value > table.LARGEST:
            return None
        shape = text([component], "shape_of_relief")
        form = Row("form", shape or "", f"{component.label}, shape_of_relief")
        if shape not in table.FORMS:
            usual = "linear" if shape is None else "parabolic"
            form = Row("form", usual, f"the file says {shape or 'nothing'}", assumed=True)
        return Row(m.sizes[0].key, depth.value, depth.source), begin, form

    def _begin(self, component: Component, m: Modification) -> Row | None:
        """The begin of a relief: its length on the path of contact, or its start diameter."""
        _, along, *circles = m.sizes
        length = read([component], along)
        if length is not None:
            return Row(along.key, length.value, length.source)
        start, tip = read([component], circles[0]) if circles else None, self.tip
        if start is None or start.value <= self.base:
            return None
        if m.section == "root_relief":
            return Row(circles[0].key, start.value, start.source)
        if tip is None or tip.value <= self.base or tip.value == start.value:
            return None
        begin, end = (math.sqrt(d**2 - self.base**2) / 2 for d in (start.value, tip.value))
        return Row(along.key, abs(end - begin), f"from {start.source}")

    def _end_relief(self, ends: dict[str, tuple[Component, Entry]]) -> Entry | None:
        """End relief of one end, or of both ends if they are equal.

        A case has one end relief for each flank, so different reliefs are left out with a warning.
        """
        if not ends:
            return None
        components, (first, *others) = zip(*ends.values(), strict=True)
        labels = [component.label for component in components]
        if others and first != others[0]:
            self.warn(
                f"{' and '.join(labels)} differ and are left out: a flank of a case has one end"
                " relief"
            )
            return None
        for component in components:
            _mark(component, table.MODIFICATIONS[component.kind])
        row = Row("end", "both" if others else next(iter(ends)), "; ".join(labels))
        return Entry(first.name, (*first.rows, row), by_face=not others)


def _mark(component: Component, m: Modification) -> None:
    """Mark a modification as used, with attributes that state what the case's key always means."""
    component.role = (m.section or component.kind).replace("_", " ")
    for name, word in (*m.words.items(), table.ADDITIVE):
        attribute = component.attributes.get(name)
        if attribute is not None and attribute.value == word:
            attribute.used = True


@dataclass(frozen=True)
class GearFlanks:
    """Flanks of the gears of one role.

    section: section of the gear. gear: the first gear of the role. assumed: whether the position of
    its datum face is assumed. flanks, words: modifications and REXS names ("left", "right") by side
    of the tooth, +1 towards +θ, the left flank first.
    """

    stage: str
    kind: str
    role: str
    section: Section
    gear: Component
    assumed: bool
    flanks: dict[int, Flank]
    words: dict[int, Word]

    @property
    def differ(self) -> bool:
        """Whether left and right flank differ."""
        left, right = self.flanks.values()
        return left != right

    def side(self, name: str, forward: bool) -> int:
        """Side of the tooth of a flank, +1 towards +θ, −1 towards −θ.

        name: "drive" or "coast", of planets "sun" or "ring". forward: see ``tooth_sides``.
        """
        return tooth_sides(self.kind, forward)[self.role, name]


class FlankReader:
    """Reads the flanks of all gears; writes them when the loaded flanks are known."""

    def __init__(self, assembly: Assembly, case: CaseText) -> None:
        self.document, self.assembly, self.case = assembly.document, assembly, case
        self.gears_read: list[GearFlanks] = []
        self._loaded: dict[str, dict[bool, str]] = {}  # sources by stage and ``forward``

    def read(
        self, section: Section, stage: RexsStage, role: str, base: float, tip: Datum | None
    ) -> None:
        """Read the flanks of the gears of a role.

        base, tip: diameters of base and tip circle, mm. Since all planets and halves of a case have
        equal flanks, those of the first gear are used.
        """
        where = f"{self.case.stage}.{role}"
        first: GearFlanks | None = None

        def warn(message: str) -> None:  # other gears get the warning that they differ
            if first is None:
                self.case.warn(f"{where}: {message}")

        reader = FlankOfGear(self.document, warn, base, tip)
        for half, gears in enumerate(stage.halves[role]):
            left_half = -1 if len(stage.halves[role]) == 2 and half == 0 else 1
            for gear in gears:
                datum, assumed = self._datum(gear)
                words = {tooth_side(w, is_internal(gear), datum): w for w in table.WORDS}
                flanks: dict[int, Flank] = {side: {} for side in words}
                for side, word in words.items():
                    for flank in self.document.linked(gear, "gear", word, "flank"):
                        flanks[side] = reader.entries(flank, outward(datum, left_half))
                gear_flanks = GearFlanks(
                    self.case.stage, stage.kind, role, section, gear, assumed, flanks, words
                )
                first = first or gear_flanks
                if first.flanks != flanks:
                    self.case.warn(
                        f"{gear.label}: its modified flanks are not those of {first.gear.label},"
                        " which are used for all"
                    )
                self._record_loaded_flank(stage, gear_flanks)
        if first is not None and any(first.flanks.values()):
            self.gears_read.append(first)

    def has(self, stage: str) -> bool:
        """Whether a stage has modified flanks."""
        return any(of_gear.stage == stage for of_gear in self.gears_read)

    def write(self, carries: Mapping[str, bool]) -> None:
        """Write all flanks into the case.

        carries: by stage, whether the torques of the case load the flanks of ``forward``
        (``gears.paths.tooth_sides``); stages without torque are missing.
        """
        stages = dict.fromkeys(of_gear.stage for of_gear in self.gears_read)
        forward = {stage: self._forward(stage, carries.get(stage)) for stage in stages}
        flanks = [flank for of_gear in self.gears_read for flank in of_gear.flanks.values()]
        for kind, m in table.MODIFICATIONS.items():
            if m.positive and any(kind in flank for flank in flanks):
                self.case.warn(f"{kind}: taken as positive {m.positive}, over the whole flank")
        for of_gear in self.gears_read:
            self._write(of_gear, forward[of_gear.stage])

    def _datum(self, gear: Component) -> tuple[int, bool]:
        """Side of a gear's datum face, +1 at the +z end, and whether that is assumed."""
        frame = self.assembly.frames.of(gear)
        sense = -1 if frame is not None and frame.axes[0, 0] < 0 else 1
        orientation = table.ORIENTATIONS.get(text([gear], table.DATUM) or "")
        return sense * (-1 if orientation is None else orientation), orientation is None

    def _record_loaded_flank(self, stage: RexsStage, of_gear: GearFlanks) -> None:
        """Record the loaded flank that the file states for a gear in its gear meshes."""
        gear_meshes = {m.stage.id: r for r, of_role in stage.gear_meshes.items() for m in of_role}
        kind = "stage_gear_data"
        for _, (pair, gear, data) in self.document.each(kind, "stage", "gear", kind):
            role = gear_meshes.get(pair.id)
            if role is None or gear is not of_gear.gear:
                continue
            loaded_flank = text([data], table.LOADED)
            if loaded_flank in table.WORDS:
                name = role if of_gear.role == "planet" else "drive"
                forward = of_gear.words[of_gear.side(name, True)] == loaded_flank
                self._loaded.setdefault(of_gear.stage, {}).setdefault(forward, data.label)

    def _forward(self, stage: str, of_torque: bool | None) -> bool:
        """Direction of the forces of a stage as in ``tooth_sides``.

        It follows from the torque; without torque from the loaded flanks in the file; without these
        it is assumed.
        """
        loaded_flanks = self._loaded.get(stage, {})
        if of_torque is not None:
            if (not of_torque) in loaded_flanks:
                self.case.warn(
                    f"{loaded_flanks[not of_torque]}, {table.LOADED}: not the flank that the"
                    " torques load; the torques are used"
                )
            return of_torque
        if len(loaded_flanks) == 1:
            return next(iter(loaded_flanks))
        if any(of_gear.differ for of_gear in self.gears_read if of_gear.stage == stage):
            self.case.warn(
                f"{stage}: no torque determines the loaded flanks; they are assumed to be those"
                " loaded when the carrier (of a parallel stage the gear) drives about +u"
            )
        return True

    def _write(self, of_gear: GearFlanks, forward: bool) -> None:
        self.case.stage = of_gear.stage
        left, right = of_gear.flanks.values()
        entries = [*left.values(), *right.values()]
        if of_gear.assumed and (of_gear.differ or any(e.by_face for e in entries)):
            self.case.warn(
                f"{of_gear.gear.label}: no {table.DATUM}; its datum face is assumed to be that at"
                " the negative end of its u axis"
            )
        alike = {kind: entry for kind, entry in left.items() if entry == right.get(kind)}
        parts = [("", alike, "")]
        for name in ("sun", "ring") if of_gear.role == "planet" else ("drive", "coast"):
            side = of_gear.side(name, forward)
            rest = {k: entry for k, entry in of_gear.flanks[side].items() if k not in alike}
            parts.append((f".{name}", rest, f"; {of_gear.words[side]} flank"))
        for name, of_flank, which in parts:
            section = self._section(of_gear, name)
            for entry in of_flank.values():
                nested = self._section(of_gear, f"{name}.{entry.name}") if entry.name else section
                for row in entry.rows:
                    if row.assumed:
                        nested.assume(row.key, row.value, row.why)
                    else:
                        nested.put(row.key, row.value, row.why + which)

    def _section(self, of_gear: GearFlanks, name: str) -> Section:
        header = f"{of_gear.section.header[:-1]}.modifications{name}]"
        return self.case.section(header, of_gear.section)
