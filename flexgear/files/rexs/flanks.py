"""Modified flanks of gears: the left and right flank of a file become drive and coast flank.

Which is which follows from the torque of the stage, from the side that the datum face is on, and
from the gear being internal or not; so flanks are read with their gears, and written when the case
has its loads. A planet's are called by the mate that they meet under the rated torque, sun and
ring. What both flanks lack stands once, for both.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from flexgear.files.case_text import CaseText, Section, Value
from flexgear.files.rexs import tables as table
from flexgear.files.rexs.assembly import Assembly
from flexgear.files.rexs.document import SAME, Component, Datum, Document, number, text
from flexgear.files.rexs.stages import RexsStage, is_internal
from flexgear.files.rexs.tables import Word, outward, tooth_side, word_of
from flexgear.gears.paths import tooth_sides


@dataclass(frozen=True)
class Row:
    """A key, its value, where it is from, and whether it is assumed."""

    key: str
    value: Value
    why: str
    assumed: bool = False


@dataclass(frozen=True)
class Entry:
    """One modification. rows: of the section ``name`` below the flank's, "" for its own; by_face:
    whether it differs between the faces."""

    name: str
    rows: tuple[Row, ...]
    by_face: bool = False

    def says(self, other: Entry | None) -> bool:
        """Whether another one is the same, to rounding."""
        if other is None or self.name != other.name:
            return False
        mine, its = ({row.key: row.value for row in e.rows} for e in (self, other))
        return mine.keys() == its.keys() and all(_same(value, its[k]) for k, value in mine.items())


class Ground:
    """Reads flanks of one gear; base: diameter of its base circle, mm; tip: of its tips."""

    def __init__(
        self, document: Document, warn: Callable[[str], None], base: float, tip: Datum | None
    ) -> None:
        self.document, self.warn, self.base, self.tip = document, warn, base, tip

    def of(self, flank: Component, datum: int) -> dict[str, Entry]:
        """Modifications of a flank by the REXS name of their kind.

        datum: +1 where the datum face is at the end that z of a modification counts to.
        """
        entries = {
            **{kind: self._crowning(flank, kind) for kind in table.CROWNINGS},
            **{kind: self._slope(flank, kind, datum) for kind in table.SLOPES},
            **{kind: self._relief(flank, kind) for kind in table.RELIEFS},
            table.END_RELIEF: self._end_relief(flank, datum),
        }
        return {kind: entry for kind, entry in entries.items() if entry is not None}

    def _one(self, flank: Component, kind: str) -> Component | None:
        """The flank's modification of a kind; of several the first."""
        components = self.document.references(flank, kind)
        if len(components) > 1:
            self.warn(
                f"{flank.label} has {len(components)} of {kind}: {components[0].label} alone here"
            )
        return components[0] if components else None

    def _crowning(self, flank: Component, kind: str) -> Entry | None:
        component = self._one(flank, kind)
        if component is None:
            return None
        key, ends = table.CROWNINGS[kind]
        amounts = [d for d in (number([component], end, "mm") for end in ends) if d is not None]
        mean = sum(d.value for d in amounts) / max(len(amounts), 1)
        if not self._usable(component, mean):
            return None
        if max(abs(d.value - mean) for d in amounts) > 1e-6 * abs(mean):
            self.warn(f"{component.label} differs between its ends; the mean here")
        return self._entry(component, kind, "", [Row(key, 1e3 * mean, amounts[0].source)])

    def _slope(self, flank: Component, kind: str, datum: int) -> Entry | None:
        component = self._one(flank, kind)
        amount = None if component is None else number([component], kind, "mm")
        if component is None or not self._usable(
            component, None if amount is None else amount.value
        ):
            return None
        assert amount is not None
        key, by_face = table.SLOPES[kind]
        value, turn = 1e3 * amount.value, -datum if by_face else 1
        why = amount.source + ("; its datum face is at the +z end" if turn < 0 else "")
        return self._entry(component, kind, "", [Row(key, turn * value, why)], by_face)

    def _usable(self, component: Component, amount: float | None) -> bool:
        """Whether there is an amount; none at all is no modification."""
        if amount is not None and 0 < abs(amount) <= table.LARGEST:
            return True
        self.warn(f"{component.label} has no amount that can be used")
        return False

    def _relief(self, flank: Component, kind: str) -> Entry | None:
        component = self._one(flank, kind)
        if component is None:
            return None
        amount, begin = number([component], f"{kind}_depth", "mm"), self._begin(component, kind)
        if amount is None or begin is None or not 0 < amount.value <= table.LARGEST:
            self.warn(f"{component.label} has no depth and length that can be used")
            return None
        depth = Row("amount_um", 1e3 * amount.value, amount.source)
        return self._entry(component, kind, kind, [depth, begin, _form(component)])

    def _begin(self, component: Component, kind: str) -> Row | None:
        """Where a relief begins: its length on the path of contact, or its circle."""
        length = number([component], f"{kind}_datum_length", "mm")
        if length is not None:
            return Row("length_mm", length.value, length.source) if length.value > 0 else None
        start = number([component], f"{kind}_datum_diameter", "mm")
        if start is None or start.value <= self.base:
            return None
        if kind == "root_relief":
            return Row("start_diameter_mm", start.value, start.source)
        if self.tip is None or self.tip.value <= self.base:
            return None
        ends = [math.sqrt(d**2 - self.base**2) / 2 for d in (start.value, self.tip.value)]
        along = abs(ends[1] - ends[0])
        return Row("length_mm", along, f"from {start.source}") if along > 0 else None

    def _end_relief(self, flank: Component, datum: int) -> Entry | None:
        """Of one end, or of both where they are alike: a case has one for a flank."""
        ends: dict[int, Entry] = {}
        ones = [self._one(flank, f"{table.END_RELIEF}_{face}") for face in table.FACES]
        for component, face, side in zip(ones, table.FACES, (datum, -datum), strict=True):
            rows = None if component is None else _end(component, face)
            if component is not None and rows is None:
                self.warn(f"{component.label} has no depth and length that can be used")
            elif rows is not None:
                ends[side] = Entry(table.END_RELIEF, rows, by_face=True)
        if not ends:
            return None
        first, *others = ends.values()
        there = [component for component in ones if component is not None]
        if others and not first.says(others[0]):
            labels = " and ".join(component.label for component in there)
            self.warn(f"{labels} differ and are left out: a flank of a case has one end relief")
            return None
        end = "both" if others else "+z" if 1 in ends else "-z"
        for component in there:
            component.role = "end relief"
        rows = (*first.rows, Row("end", end, "; ".join(component.label for component in there)))
        return Entry(table.END_RELIEF, rows, by_face=not others)

    def _entry(
        self, component: Component, kind: str, name: str, rows: list[Row], by_face: bool = False
    ) -> Entry:
        component.role = kind.replace("_", " ")
        for attribute in component.attributes.values():
            attribute.used |= attribute.value in table.AS_HERE.get(attribute.id, ())
        return Entry(name, tuple(rows), by_face)


def _end(component: Component, face: str) -> tuple[Row, ...] | None:
    """Depth, length and form of an end relief."""
    depth = number([component], f"end_relief_depth_{face}", "mm")
    length = number([component], f"end_relief_length_{face}", "mm")
    if (
        depth is None
        or length is None
        or not (0 < depth.value <= table.LARGEST and length.value > 0)
    ):
        return None
    amount = Row("amount_um", 1e3 * depth.value, depth.source)
    return amount, Row("length_mm", length.value, length.source), _form(component)


def _same(a: Value, b: Value) -> bool:
    if isinstance(a, float | int) and isinstance(b, float | int):
        return math.isclose(a, b, rel_tol=SAME)
    return a == b


def _form(component: Component) -> Row:
    shape = text([component], "shape_of_relief")
    if shape in table.FORMS:
        return Row("form", shape, f"{component.label}, shape_of_relief")
    form = "linear" if shape is None else "parabolic"
    return Row("form", form, f"the file says {shape or 'nothing'}", assumed=True)


Flanks = dict[Word, dict[str, Entry]]  # by the kind of each modification


def _alike(first: dict[str, Entry], other: dict[str, Entry]) -> bool:
    """Whether two flanks have the same modifications."""
    return first.keys() == other.keys() and all(first[k].says(other[k]) for k in first)


@dataclass(frozen=True)
class GearFlanks:
    """Flanks of the gears of one role. section: the gear's; datum: side of the first gear's datum
    face, +1 at its +z end; assumed: whether the file does not say it."""

    stage: str
    kind: str
    role: str
    section: Section
    gear: Component
    datum: int
    assumed: bool
    entries: Flanks

    @property
    def differ(self) -> bool:
        """Whether left and right flank are not the same."""
        return not _alike(self.entries["left"], self.entries["right"])

    def word(self, name: str, forward: bool) -> Word:
        """The flank of the file that is this one of the case."""
        side = tooth_sides(self.kind, forward)[self.role, name]
        return word_of(side, is_internal(self.gear), self.datum)


class FlankReader:
    """Reads flanks of all gears, and writes them when it is known which of them carry."""

    def __init__(self, assembly: Assembly, case: CaseText) -> None:
        self.document, self.assembly, self.case = assembly.document, assembly, case
        self.gears_read: list[GearFlanks] = []
        self._loaded: dict[str, dict[bool, str]] = {}  # what the file says, and where

    def read(
        self, section: Section, stage: RexsStage, role: str, base: float, tip: Datum | None
    ) -> None:
        """Flanks of the gears of a role; base: diameter of the base circle, mm; tip: of the tips.

        Those of the first gear count for all: planets and halves of a case are alike.
        """
        where = f"{self.case.stage}.{role}"
        first: GearFlanks | None = None

        def warn(message: str) -> None:  # once: of other gears it is said that they differ
            if first is None:
                self.case.warn(f"{where}: {message}")

        ground = Ground(self.document, warn, base, tip)
        for half, gears in enumerate(stage.halves[role]):
            left_half = -1 if len(stage.halves[role]) == 2 and half == 0 else 1
            for gear in gears:
                datum, assumed = self._datum(gear)
                flanks = self._flanks(gear, ground, outward(datum, left_half))
                gear_flanks = GearFlanks(
                    self.case.stage, stage.kind, role, section, gear, datum, assumed, flanks
                )
                first = first or gear_flanks
                self._compare(first, gear_flanks)
                self._remember(stage, gear_flanks)
        if first is not None and any(first.entries.values()):
            self.gears_read.append(first)

    def has(self, stage: str) -> bool:
        """Whether a stage that was read has modified flanks."""
        return any(of_gear.stage == stage for of_gear in self.gears_read)

    def write(self, carries: Mapping[str, bool]) -> None:
        """All flanks. carries: by stage whether its forces are those of ``forward``
        (``gears.paths.tooth_sides``), where the case has a torque."""
        stages = dict.fromkeys(of_gear.stage for of_gear in self.gears_read)
        senses = {stage: self._sense(stage, carries.get(stage)) for stage in stages}
        kinds = {
            kind
            for of_gear in self.gears_read
            for flank in of_gear.entries.values()
            for kind in flank
        }
        for kind in table.SLOPES:
            if kind in kinds:
                self.case.warn(f"{kind}: taken as {table.SIGNS[kind]}, over the whole flank")
        for of_gear in self.gears_read:
            self._write(of_gear, senses[of_gear.stage])

    def _datum(self, gear: Component) -> tuple[int, bool]:
        """Side of the datum face, +1 at the +z end, and whether that is assumed."""
        frame = self.assembly.frames.of(gear)
        along = -1 if frame is not None and frame.axes[0, 0] < 0 else 1
        orientation = table.ORIENTATIONS.get(text([gear], table.DATUM) or "")
        return along * (-1 if orientation is None else orientation), orientation is None

    def _flanks(self, gear: Component, ground: Ground, datum: int) -> Flanks:
        flanks: Flanks = {word: {} for word in table.WORDS}
        for word in table.WORDS:
            for flank in self.document.linked(gear, "gear", word, "flank"):
                flanks[word] = ground.of(flank, datum)
        return flanks

    def _compare(self, first: GearFlanks, other: GearFlanks) -> None:
        """Say where gears of one role differ; their datum faces may be on different sides."""
        for word in table.WORDS:
            side = tooth_side(word, is_internal(other.gear), other.datum)
            mine = first.entries[word_of(side, is_internal(first.gear), first.datum)]
            if not _alike(mine, other.entries[word]):
                self.case.warn(
                    f"{other.gear.label}: its modified flanks are not those of {first.gear.label},"
                    " which all have here"
                )
                return

    def _remember(self, stage: RexsStage, of_gear: GearFlanks) -> None:
        """What the file says of the loaded flank of a gear in its gear meshes."""
        meshes = {mesh.stage.id: role for role, every in stage.meshes.items() for mesh in every}
        for relation in self.document.related("stage_gear_data"):
            data = self.document.at(relation, "stage_gear_data")
            role = meshes.get(relation.of("stage") or -1)
            if data is None or role is None or relation.of("gear") != of_gear.gear.id:
                continue
            loaded_flank = text([data], table.LOADED)
            if loaded_flank in table.WORDS:
                name = role if of_gear.role == "planet" else "drive"
                sense = of_gear.word(name, True) == loaded_flank
                self._loaded.setdefault(of_gear.stage, {}).setdefault(sense, data.label)

    def _sense(self, stage: str, torque: bool | None) -> bool:
        """Which flanks of a stage carry: by its torque, else as the file says, else assumed."""
        loaded_flanks = self._loaded.get(stage, {})
        if torque is not None:
            if (not torque) in loaded_flanks:
                self.case.warn(
                    f"{loaded_flanks[not torque]}, {table.LOADED}: not the flank that the torques"
                    " load; they count"
                )
            return torque
        if len(loaded_flanks) == 1:
            return next(iter(loaded_flanks))
        if any(of_gear.differ for of_gear in self.gears_read if of_gear.stage == stage):
            self.case.warn(
                f"{stage}: no torque says which flanks carry; those are taken that do where its"
                " carrier (of a parallel stage its gear) drives about +u"
            )
        return True

    def _write(self, of_gear: GearFlanks, forward: bool) -> None:
        self.case.stage = of_gear.stage
        entries = [e for flank in of_gear.entries.values() for e in flank.values()]
        if of_gear.assumed and (of_gear.differ or any(e.by_face for e in entries)):
            self.case.warn(
                f"{of_gear.gear.label}: no {table.DATUM}; its datum face is taken as the one"
                " against its u axis (negative)"
            )
        names = ("sun", "ring") if of_gear.role == "planet" else ("drive", "coast")
        words: dict[str, Word] = {name: of_gear.word(name, forward) for name in names}
        whole = self._section(of_gear, "")
        for kind, entry in of_gear.entries["left"].items():
            if entry.says(of_gear.entries["right"].get(kind)):
                self._put(of_gear, whole, "", entry)
        for name, word in words.items():
            other = of_gear.entries["left" if word == "right" else "right"]
            single = {k: e for k, e in of_gear.entries[word].items() if not e.says(other.get(k))}
            section = self._section(of_gear, f".{name}")
            for entry in single.values():
                self._put(of_gear, section, f".{name}", entry, f"; {word} flank")

    def _section(self, of_gear: GearFlanks, name: str) -> Section:
        header = f"{of_gear.section.header[:-1]}.modifications{name}]"
        return self.case.section(header, of_gear.section)

    def _put(
        self, of_gear: GearFlanks, section: Section, flank: str, entry: Entry, which: str = ""
    ) -> None:
        if entry.name:
            section = self._section(of_gear, f"{flank}.{entry.name}")
        for row in entry.rows:
            if row.assumed:
                self.case.assume(section, row.key, row.value, row.why)
            else:
                section.put(row.key, row.value, row.why + which)
