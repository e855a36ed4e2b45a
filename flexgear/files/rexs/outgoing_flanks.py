"""Flanks of gears as REXS components: left and right flank with the tool and what they lack.

The datum face of every gear is that at its −z end, against its u axis.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from flexgear.files.rexs.flank_sides import FACES, WORDS, Word, outward, word_of
from flexgear.files.rexs.ground import CROWNINGS, END_RELIEF
from flexgear.files.rexs.writing import Outgoing, Written
from flexgear.gears.flanks import tooth_sides
from flexgear.gears.geometry import stage_geometry
from flexgear.gears.radii import gears_by_role
from flexgear.gears.tool import RackTool
from flexgear.model.modifications import EndRelief, FlankModifications, Relief
from flexgear.model.stage_view import StageView

MM = 1e3
DATUM_SIDE, ORIENTATION = -1, "negative"


class FlanksOut:
    """Adds flanks of one stage's gears. forward: whether its forces are so (``tooth_sides``)."""

    def __init__(self, model: Outgoing, view: StageView, forward: bool) -> None:
        self.model, self.view = model, view
        sides = tooth_sides(view.stage.kind, forward)
        self.words: dict[tuple[str, str], Word] = {
            key: word_of(side, key[0] == "ring", DATUM_SIDE) for key, side in sides.items()
        }

    def loaded(self, role: str, mate: str) -> Word:
        """The flank of the gear of a role that carries in the gear mesh of ``mate``."""
        part = self.view.part(role)
        return self.words[part, mate if part == "planet" else "drive"]

    def add(self, number: int, role: str, half: int) -> None:
        """Both flanks of a gear. half: −1 for the left one of a double helix."""
        gear, part = gears_by_role(self.view.stage)[role], self.view.part(role)
        flanks = {
            word: self.model.add(
                "cylindrical_gear_flank",
                normal_pressure_angle=math.degrees(self.view.stage.pressure_angle),
                addendum_modification_coefficient=gear.profile_shift,
            )
            for word in WORDS
        }
        self.model.relate("flank", gear=number, left=flanks["left"], right=flanks["right"])
        tool = self._tool(role)
        allowance: dict[str, Written | None] = {}
        if gear.tool.grinding_allowance:
            allowance["machining_allowance"] = MM * gear.tool.grinding_allowance
        settings = self.model.add("cylindrical_gear_manufacturing_settings", "", **allowance)
        names = {word: name for (of, name), word in self.words.items() if of == part}
        for word, flank in flanks.items():
            self.model.relate(
                "manufacturing_step", 1, workpiece=flank, tool=tool, manufacturing_settings=settings
            )
            modifications = gear.modifications.of(names[word])
            for component in self._ground(modifications, outward(DATUM_SIDE, half)):
                self.model.relate("reference", origin=flank, referenced=component)

    def _tool(self, role: str) -> int:
        """The rack or cutter of a gear."""
        gear, module = gears_by_role(self.view.stage)[role], self.view.stage.normal_module
        tool = stage_geometry(self.view).gears[role].tool
        sizes: dict[str, Written | None] = {
            "tip_corner_radius_factor_reference_profile": tool.tip_radius / module
        }
        if gear.tool.protuberance:
            sizes["protuberance_amount"] = MM * gear.tool.protuberance
            sizes["protuberance_angle"] = math.degrees(gear.tool.protuberance_angle)
        if isinstance(tool, RackTool):
            sizes["addendum_coefficient_reference_profile"] = gear.dedendum
            return self.model.add("rack_shaped_tool", "", **sizes)
        return self.model.add(
            "cutter_wheel_tool",
            "",
            number_of_teeth=round(tool.teeth),
            addendum_modification_coefficient=gear.tool.profile_shift,
            tip_diameter=2 * MM * tool.tip_circle,
            **sizes,
        )

    def _ground(self, modifications: FlankModifications, datum: int) -> Iterator[int]:
        """What one flank lacks; datum: +1 where z of a modification counts to the datum face."""
        for kind, (key, ends) in CROWNINGS.items():
            crowned = getattr(modifications, key.removesuffix("_um"))
            if crowned is not None:
                amounts = dict.fromkeys(ends, MM * crowned)
                yield self.model.add(kind, **amounts, **{f"shape_of_{kind}": "parabolic"})
        yield from self._slopes(modifications, datum)
        for kind, relief in (
            ("tip", modifications.tip_relief),
            ("root", modifications.root_relief),
        ):
            if relief is not None:
                yield self._relief(f"{kind}_relief", relief)
        end = modifications.end_relief
        for face, side in zip(FACES, (datum, -datum), strict=True):
            if end is not None and end.end in ("both", "+z" if side > 0 else "-z"):
                yield self._end_relief(face, end)

    def _slopes(self, modifications: FlankModifications, datum: int) -> Iterator[int]:
        """Signs as in ``ground``: positive towards the tip, and towards the non-datum face."""
        if modifications.profile_slope is not None:
            yield self.model.add("profile_slope", profile_slope=MM * modifications.profile_slope)
        if modifications.helix_slope is not None:
            yield self.model.add(
                "helix_slope",
                helix_slope=-datum * MM * modifications.helix_slope,
                helix_evaluation_reference="facewidth",
            )
        if modifications.twist is not None:
            yield self.model.add("profile_twist", profile_twist=-datum * MM * modifications.twist)

    def _relief(self, kind: str, relief: Relief) -> int:
        length, start = relief.length, relief.start_diameter
        sizes: dict[str, Written | None] = {
            f"{kind}_depth": MM * relief.amount,
            f"{kind}_datum_length": None if length is None else MM * length,
            f"{kind}_datum_diameter": None if start is None else MM * start,
        }
        return self.model.add(kind, "", shape_of_relief=relief.form, **sizes)

    def _end_relief(self, face: str, relief: EndRelief) -> int:
        kind = f"{END_RELIEF}_{face}"
        sizes: dict[str, Written | None] = {
            f"{END_RELIEF}_depth_{face}": MM * relief.amount,
            f"{END_RELIEF}_length_{face}": MM * relief.length,
        }
        return self.model.add(kind, "", shape_of_relief=relief.form, **sizes)
