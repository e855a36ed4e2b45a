"""What is ground off one REXS flank, as a case gives it.

REXS leaves the signs of slopes to the standards. Here, as for a case (``gears.modifications``),

    profile_slope   C_Hα > 0: more is missing at the tip than at the root
    helix_slope     C_Hβ > 0: more is missing at the non-datum face than at the datum face
    profile_twist   S_α > 0: the profile slope is larger at the non-datum face

and amounts are those at the ends of the active profile and of the face.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from flexgear.files.case_text import Value
from flexgear.files.rexs.document import SAME, Component, Datum, Document, number, text
from flexgear.files.rexs.flank_sides import FACES
from flexgear.model.flank_table import LARGEST as LARGEST_M

LARGEST = 1e3 * LARGEST_M  # mm, of an amount
RELIEFS = ("tip_relief", "root_relief")
CROWNINGS = {  # REXS component: key of a case, amounts at both ends
    "profile_crowning": (
        "profile_crowning_um",
        ("profile_crowning_at_tip", "profile_crowning_at_root"),
    ),
    "helix_crowning": (
        "lead_crowning_um",
        ("helix_crowning_amount_datum_face", "helix_crowning_amount_non_datum_face"),
    ),
}
SLOPES = {  # REXS component and its attribute: key of a case, whether its sign hangs on the face
    "profile_slope": ("profile_slope_um", False),
    "helix_slope": ("helix_slope_um", True),
    "profile_twist": ("twist_um", True),
}
FORMS = ("linear", "parabolic")
END_RELIEF = "end_relief"
AS_HERE = {  # what a case means anyway; other values are listed
    "shape_of_profile_crowning": ("parabolic",),
    "shape_of_helix_crowning": ("parabolic",),
    "helix_evaluation_reference": ("facewidth",),
    "is_additive_modification": ("true",),
}


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
        return mine.keys() == its.keys() and all(_same(mine[k], its[k]) for k in mine)


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
            **{kind: self._crowning(flank, kind) for kind in CROWNINGS},
            **{kind: self._slope(flank, kind, datum) for kind in SLOPES},
            **{kind: self._relief(flank, kind) for kind in RELIEFS},
            END_RELIEF: self._end_relief(flank, datum),
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
        key, ends = CROWNINGS[kind]
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
        key, by_face = SLOPES[kind]
        value, turn = 1e3 * amount.value, -datum if by_face else 1
        why = amount.source + ("; its datum face is at the +z end" if turn < 0 else "")
        return self._entry(component, kind, "", [Row(key, turn * value, why)], by_face)

    def _usable(self, component: Component, amount: float | None) -> bool:
        """Whether there is an amount; none at all is no modification."""
        if amount is not None and 0 < abs(amount) <= LARGEST:
            return True
        self.warn(f"{component.label} has no amount that can be used")
        return False

    def _relief(self, flank: Component, kind: str) -> Entry | None:
        component = self._one(flank, kind)
        if component is None:
            return None
        amount, begin = number([component], f"{kind}_depth", "mm"), self._begin(component, kind)
        if amount is None or begin is None or not 0 < amount.value <= LARGEST:
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
        ones = [self._one(flank, f"{END_RELIEF}_{face}") for face in FACES]
        for component, face, side in zip(ones, FACES, (datum, -datum), strict=True):
            rows = None if component is None else _end(component, face)
            if component is not None and rows is None:
                self.warn(f"{component.label} has no depth and length that can be used")
            elif rows is not None:
                ends[side] = Entry(END_RELIEF, rows, by_face=True)
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
        return Entry(END_RELIEF, rows, by_face=not others)

    def _entry(
        self, component: Component, kind: str, name: str, rows: list[Row], by_face: bool = False
    ) -> Entry:
        component.role = kind.replace("_", " ")
        for attribute in component.attributes.values():
            attribute.used |= attribute.value in AS_HERE.get(attribute.id, ())
        return Entry(name, tuple(rows), by_face)


def _end(component: Component, face: str) -> tuple[Row, ...] | None:
    """Depth, length and form of an end relief."""
    depth = number([component], f"end_relief_depth_{face}", "mm")
    length = number([component], f"end_relief_length_{face}", "mm")
    if depth is None or length is None or not (0 < depth.value <= LARGEST and length.value > 0):
        return None
    amount = Row("amount_um", 1e3 * depth.value, depth.source)
    return amount, Row("length_mm", length.value, length.source), _form(component)


def _same(a: Value, b: Value) -> bool:
    if isinstance(a, float | int) and isinstance(b, float | int):
        return math.isclose(a, b, rel_tol=SAME)
    return a == b


def _form(component: Component) -> Row:
    shape = text([component], "shape_of_relief")
    if shape in FORMS:
        return Row("form", shape, f"{component.label}, shape_of_relief")
    form = "linear" if shape is None else "parabolic"
    return Row("form", form, f"the file says {shape or 'nothing'}", assumed=True)
