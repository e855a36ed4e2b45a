"""Modified flanks of gears: the left and right flank of a file become drive and coast flank.

Which is which follows from the torque of the stage, from the side that the datum face is on, and
from the gear being internal or not (``flank_sides``); so flanks are read with their gears, and
written when the case has its loads. A planet's are called by the mate that they meet under the
rated torque, sun and ring. What both flanks lack stands once, for both.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from flexgear.files.case_text import CaseText, Section
from flexgear.files.rexs.assembly import Assembly
from flexgear.files.rexs.document import Component, Datum, Document, text
from flexgear.files.rexs.flank_sides import (
    DATUM,
    ORIENTATIONS,
    WORDS,
    Word,
    outward,
    tooth_side,
    word_of,
)
from flexgear.files.rexs.ground import SLOPES, Entry, Ground
from flexgear.files.rexs.stages import RexsStage, is_internal
from flexgear.gears.flanks import tooth_sides

LOADED = "loaded_tooth_flank"
_SIGNS = {
    "profile_slope": "positive where more is missing at the tip",
    "helix_slope": "positive where more is missing at the non-datum face",
    "profile_twist": "positive where the profile slope is larger at the non-datum face",
}
Flanks = dict[Word, dict[str, Entry]]  # by the kind of each modification


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
        left, right = (self.entries[word] for word in WORDS)
        return left.keys() != right.keys() or not all(left[k].says(right[k]) for k in left)

    def word(self, name: str, forward: bool) -> Word:
        """The flank of the file that is this one of the case."""
        side = tooth_sides(self.kind, forward)[self.role, name]
        return word_of(side, is_internal(self.gear), self.datum)


class FlankReader:
    """Reads flanks of all gears, and writes them when it is known which of them carry."""

    def __init__(self, document: Document, assembly: Assembly, case: CaseText) -> None:
        self.document, self.assembly, self.case = document, assembly, case
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
        (``gears.flanks.tooth_sides``), where the case has a torque."""
        senses = {stage: self._sense(stage, carries.get(stage)) for stage in self._stages()}
        kinds = {
            kind
            for of_gear in self.gears_read
            for flank in of_gear.entries.values()
            for kind in flank
        }
        for kind in SLOPES:
            if kind in kinds:
                self.case.warn(f"{kind}: taken as {_SIGNS[kind]}, over the whole flank")
        for of_gear in self.gears_read:
            self._write(of_gear, senses[of_gear.stage])

    def _stages(self) -> list[str]:
        return list(dict.fromkeys(of_gear.stage for of_gear in self.gears_read))

    def _datum(self, gear: Component) -> tuple[int, bool]:
        """Side of the datum face, +1 at the +z end, and whether that is assumed."""
        frame = self.assembly.frames.of(gear)
        along = -1 if frame is not None and frame.axes[0, 0] < 0 else 1
        orientation = ORIENTATIONS.get(text([gear], DATUM) or "")
        return along * (-1 if orientation is None else orientation), orientation is None

    def _flanks(self, gear: Component, ground: Ground, datum: int) -> Flanks:
        flanks: Flanks = {word: {} for word in WORDS}
        for relation in self.document.related("flank"):
            if relation.of("gear") == gear.id:
                relation.used = True
                for word in WORDS:
                    flank = self.document.at(relation, word)
                    if flank is not None:
                        flanks[word] = ground.of(flank, datum)
        return flanks

    def _compare(self, first: GearFlanks, other: GearFlanks) -> None:
        """Say where gears of one role differ; their datum faces may be on different sides."""
        for word in WORDS:
            side = tooth_side(word, is_internal(other.gear), other.datum)
            mine = first.entries[word_of(side, is_internal(first.gear), first.datum)]
            its = other.entries[word]
            if mine.keys() != its.keys() or not all(mine[k].says(its[k]) for k in mine):
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
            loaded_flank = text([data], LOADED)
            if loaded_flank in WORDS:
                name = role if of_gear.role == "planet" else "drive"
                sense = of_gear.word(name, True) == loaded_flank
                self._loaded.setdefault(of_gear.stage, {}).setdefault(sense, data.label)

    def _sense(self, stage: str, torque: bool | None) -> bool:
        """Which flanks of a stage carry: by its torque, else as the file says, else assumed."""
        loaded_flanks = self._loaded.get(stage, {})
        if torque is not None:
            if (not torque) in loaded_flanks:
                self.case.warn(
                    f"{loaded_flanks[not torque]}, {LOADED}: not the flank that the torques load;"
                    " they count"
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
                f"{of_gear.gear.label}: no {DATUM}; its datum face is taken as the one against its"
                " u axis (negative)"
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
