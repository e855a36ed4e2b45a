"""Modified flanks: tip, root and end relief, crowning of profile and helix.

Both flanks of a gear have the same keys here; where a file has others on its right flank than on
its left one, those of the left are taken and a line says so. Helix and profile slopes, twist and
topographies stay in the list of what a case does not hold: REXS leaves their signs to the datum
face, which few files state.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from flexgear.files.rexs.case_text import CaseText, Section
from flexgear.files.rexs.document import Component, Datum, Document, number, text

LARGEST = 1.0  # mm, of an amount: what ``model.modifications`` takes
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
FACES = ("datum_face", "non_datum_face")
FORMS = ("linear", "parabolic")


class FlankReader:
    """Writes the modifications of one gear; base: diameter of its base circle, mm; tip: of its
    tips."""

    def __init__(self, document: Document, case: CaseText, base: float, tip: Datum | None) -> None:
        self.document, self.case, self.base, self.tip = document, case, base, tip

    def write(self, section: Section, flanks: Sequence[Component]) -> None:
        """What both flanks lack, into sections below that of the gear."""
        where = section.header
        both = self.case.section(f"{where[:-1]}.modifications]")
        for kind, (key, ends) in CROWNINGS.items():
            found = self._of_flanks(where, flanks, kind)
            amounts = [d for d in (number(found, end, "mm") for end in ends) if d is not None]
            if not amounts:
                continue
            mean = sum(d.value for d in amounts) / len(amounts)
            if not 0 < abs(mean) <= LARGEST:
                self.case.warn(f"{where}: {found[0].label} has no amount that can be used")
                continue
            self._use(found, kind)
            if max(abs(d.value - mean) for d in amounts) > 1e-6 * abs(mean):
                self.case.warn(f"{where}: {found[0].label} differs between its ends; the mean here")
            both.put(key, 1e3 * mean, amounts[0].source)
        for kind in RELIEFS:
            self._relief(where, self._of_flanks(where, flanks, kind), kind)
        self._end_relief(where, flanks)

    def _of_flanks(self, where: str, flanks: Sequence[Component], kind: str) -> list[Component]:
        """Modifications of a kind, one of each flank that has it, the left one's first."""
        own = [self.document.references(flank, kind) for flank in flanks]
        found = [one for several in own for one in several]
        if found and len(found) < len(flanks):
            self.case.warn(f"{where}: {found[0].label} is of one flank; both have it here")
        elif any(_amounts(one) != _amounts(found[0]) for one in found[1:]):
            self.case.warn(f"{where}: flanks differ; both have {found[0].label} here")
        return found

    def _use(self, found: Sequence[Component], kind: str) -> None:
        for one in found:
            one.role = kind.replace("_", " ")

    def _relief(self, where: str, found: Sequence[Component], kind: str) -> None:
        if not found:
            return
        amount = number(found, f"{kind}_depth", "mm")
        begin = self._begin(found, kind)
        if amount is None or begin is None or not 0 < amount.value <= LARGEST:
            self.case.warn(f"{where}: {found[0].label} has no depth and length that can be used")
            return
        self._use(found, kind)
        section = self.case.section(f"{where[:-1]}.modifications.{kind}]")
        section.put("amount_um", 1e3 * amount.value, amount.source)
        section.put(*begin)
        self._form(section, found)

    def _begin(self, found: Sequence[Component], kind: str) -> tuple[str, float, str] | None:
        """Where a relief begins: its length on the path of contact, or its circle."""
        length = number(found, f"{kind}_datum_length", "mm")
        if length is not None:
            return ("length_mm", length.value, length.source) if length.value > 0 else None
        start = number(found, f"{kind}_datum_diameter", "mm")
        if start is None or start.value <= self.base:
            return None
        if kind == "root_relief":
            return "start_diameter_mm", start.value, start.source
        if self.tip is None or self.tip.value <= self.base:
            return None
        ends = [math.sqrt(d**2 - self.base**2) / 2 for d in (start.value, self.tip.value)]
        along = abs(ends[1] - ends[0])
        return ("length_mm", along, f"from {start.source}") if along > 0 else None

    def _form(self, section: Section, found: Sequence[Component]) -> None:
        said = text(list(found), "shape_of_relief")
        if said in FORMS:
            section.put("form", said, f"{found[0].label}, shape_of_relief")
        else:
            form = "linear" if said is None else "parabolic"
            self.case.assume(section, "form", form, f"the file says {said or 'nothing'}")

    def _end_relief(self, where: str, flanks: Sequence[Component]) -> None:
        """Of both ends where they are alike; of one end nothing says which it is."""
        found = {face: self._of_flanks(where, flanks, f"end_relief_{face}") for face in FACES}
        if not any(found.values()):
            return
        sizes = {face: _end(own, face) for face, own in found.items() if own}
        first = next(iter(sizes.values()))
        if len(sizes) < len(FACES) or None in sizes.values() or not _alike(sizes):
            label = next(own for own in found.values() if own)[0].label
            self.case.warn(f"{where}: {label} is left out: only equal end reliefs of both ends")
            return
        assert first is not None
        for face, own in found.items():
            self._use(own, f"end_relief_{face}")
        section = self.case.section(f"{where[:-1]}.modifications.end_relief]")
        section.put("amount_um", 1e3 * first[0].value, first[0].source)
        section.put("length_mm", first[1].value, first[1].source)
        self._form(section, [one for own in found.values() for one in own])


def _end(found: Sequence[Component], face: str) -> tuple[Datum, Datum] | None:
    """Depth and length of an end relief."""
    depth = number(found, f"end_relief_depth_{face}", "mm")
    length = number(found, f"end_relief_length_{face}", "mm")
    if depth is None or length is None or not (0 < depth.value <= LARGEST and length.value > 0):
        return None
    return depth, length


def _alike(sizes: Mapping[str, tuple[Datum, Datum] | None]) -> bool:
    values = [tuple(d.value for d in size) for size in sizes.values() if size is not None]
    return all(
        math.isclose(a, b, rel_tol=1e-9)
        for size in values[1:]
        for a, b in zip(size, values[0], strict=True)
    )


def _amounts(component: Component) -> dict[str, object]:
    return {name: attribute.value for name, attribute in component.attributes.items()}
