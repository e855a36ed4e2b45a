"""Keys of one gear: teeth, profile shift, tip and root, blank, modified flanks.

REXS states diameters and the basic rack of the tool; a case has coefficients of the normal module:

    external   d_a = d + 2 m_n (h_a + x),   d_f = d − 2 m_n (h_f − x)
    internal   d_a = d − 2 m_n (h_a + x),   d_f = d + 2 m_n (h_f − x)

with x of ISO 21771 (the ring's tooth number is negative, so that x > 0 makes every tooth thicker).
The length on the path of contact of a relief that starts at the diameter d_s is
√(r_a² − r_b²) − √(r_s² − r_b²).
"""

import math
from collections.abc import Sequence

from flexgear.files.case_text import CaseText, Datum, Section
from flexgear.files.rexs import tables as table
from flexgear.files.rexs.assembly import Assembly, sections_of
from flexgear.files.rexs.document import Component, mark, number, read, text, value
from flexgear.files.rexs.flanks import FlankReader
from flexgear.files.rexs.stages import RexsStage
from flexgear.gears.tooth import Rack, reference_radius, transverse_angle
from flexgear.model.errors import echo
from flexgear.model.member import Gear
from flexgear.model.section import limits_of

TOOLS = ("rack_shaped_tool", "cutter_wheel_tool")
SETTINGS = "cylindrical_gear_manufacturing_settings"
_PROFILE = {  # attributes of a tool by coefficient of the tooth
    "dedendum": ("addendum_coefficient_reference_profile", "addendum_reference_profile"),
    "root_fillet": ("tip_corner_radius_factor_reference_profile", "tip_radius_factor",
                    "tip_corner_radius_reference_profile", "tip_radius"),
}  # fmt: skip
_TOLERANCE = 1e-9  # of positions on a shaft, mm
_STEEL_OF_WORD = {word: steel for steel, word in table.STEELS.items()}


class GearReader:
    """Reads gears of a document into sections of a case."""

    def __init__(self, assembly: Assembly, case: CaseText) -> None:
        self.document, self.assembly, self.case = assembly.document, assembly, case
        self.modified = FlankReader(assembly, case)

    def flanks(self, gears: list[Component]) -> list[Component]:
        """Flanks of gears, of each gear the left one first."""
        components = [
            flank
            for gear in gears
            for side in ("left", "right")
            for flank in self.document.linked(gear, "gear", side, "flank")
        ]
        mark(components, "flanks")
        return components

    def tools(self, gears: list[Component]) -> list[Component]:
        """Tools and manufacturing settings of gears and their flanks."""
        components = []
        for part in [*gears, *self.flanks(gears)]:
            components += self.document.references(part, *TOOLS)
            for role in ("tool", "manufacturing_settings"):
                used = self.document.linked(part, "workpiece", role, "manufacturing_step")
                components += [c for c in used if c.kind in (*TOOLS, SETTINGS)]
        mark(components, "a tool")
        return components

    def shift(self, gears: list[Component], rack: Rack) -> Datum | None:
        """Profile shift coefficient in the file."""
        names = ("addendum_modification_coefficient", "addendum_modification",
                 "generated_addendum_modification_coefficient",
                 "addendum_modification_coefficient_after_finishing")  # fmt: skip
        return _over_module(self.flanks(gears), names, rack)

    def write(
        self, section: Section, stage: RexsStage, role: str, rack: Rack, teeth: int, shift: float
    ) -> None:
        """Write tip, root, fillet, tool, mass and blank to the gear's section; read its flanks.

        The section contains teeth and profile shift already.
        """
        gears = stage.gears(role)
        internal = section.header.endswith("ring]")
        tools, out = self.tools(gears), -1.0 if internal else 1.0
        reference = 2 * reference_radius(teeth, rack)
        circles = [number(gears, f"{end}_diameter", "mm") for end in ("tip", "root")]
        # internal gears may have a minus sign
        tip, root = (circle and Datum(abs(circle.value), circle.source) for circle in circles)
        heights = [
            circle
            and Datum(
                sign * ((circle.value - reference) / 2 / rack.normal_module - out * shift),
                f"from {circle.source}",
            )
            for circle, sign in ((tip, out), (root, -out))
        ]
        self._coefficient(section, "addendum", heights[0], tools, rack)
        dedendum = self._coefficient(section, "dedendum", heights[1], tools, rack)
        self._coefficient(section, "root_fillet", None, tools, rack)
        self._tool(section, tools, gears, root is not None)
        self._mass(section, gears, internal)
        root_circle = reference - out * 2 * rack.normal_module * (dedendum - shift)
        self._blank(section, gears, internal, root_circle)
        self._rating(section, gears)
        self.modified.read(section, stage, role, base_diameter(teeth, rack), tip)

    def _tool(
        self, section: Section, tools: list[Component], gears: list[Component], has_root: bool
    ) -> None:
        """Write the data of the tool in the file to a section nested in the gear's."""
        tool_section = self.case.section(f"{section.header[:-1]}.tool]", section)
        cutters = [tool for tool in tools if tool.kind == "cutter_wheel_tool"]
        teeth, shift = table.CUTTER
        number_of_teeth = read(cutters, teeth)
        if number_of_teeth is not None:
            tool_section.put(teeth.key, round(number_of_teeth.value), number_of_teeth.source)
            tool_section.take(shift.key, read(cutters, shift))
            if not has_root:
                tool_section.take("tip_diameter_mm", number(cutters, "tip_diameter", "mm"))
        amount, angle = table.PROTUBERANCE
        limit = 0.0
        if tool_section.take(amount.key, protuberance := read(tools, amount)):
            tool_section.take(angle.key, read(tools, angle))
            limit = 0.0 if protuberance is None else protuberance.value
        allowance = number(tools, "machining_allowance", "mm")
        allowance = allowance or number(self.flanks(gears), "grinding_allowance", "mm")
        if allowance is not None and 0 < allowance.value <= limit:
            tool_section.put("grinding_allowance_mm", allowance.value, allowance.source)
        elif allowance is not None and allowance.value > 0:
            self.case.warn(
                f"{section.header}: {allowance.source} is more than the protuberance and is left"
                " out, as if the root were ground, too"
            )

    def _coefficient(
        self, section: Section, key: str, datum: Datum | None, tools: list[Component], rack: Rack
    ) -> float:
        """Write a coefficient of the tooth, that of the tool's profile if ``datum`` is not valid,
        assumed if the file has no valid value; returns it."""
        if datum is None or not _within(key, datum.value):
            of_tool = _over_module(tools, _PROFILE.get(key, ()), rack)
            if of_tool is not None:
                datum = Datum(of_tool.value, f"{of_tool.source} of the tool")
        if datum is not None and _within(key, datum.value):
            section.put(key, datum.value, datum.source)
            return datum.value
        why = "ISO 53 profile A"
        if datum is not None:
            low, high = limits_of(Gear, key)
            why += f"; {datum.source} would make it {datum.value:.4g}"
            why += f", which is not between {low:g} and {high:g}"
        usual = float(Gear.model_fields[key].default)
        section.assume(key, usual, why)
        return usual

    def _rating(self, section: Section, gears: list[Component]) -> None:
        """Write steel, strengths, hardness, roughness and accuracy to a section nested in the
        gear's; of R_z and R_a only the first."""
        rating = self.case.section(f"{section.header[:-1]}.rating]", section)
        materials = [m for gear in gears for m in self.document.references(gear, "material")]
        words = [(name, word) for name in table.STEEL if (word := text(materials, name))]
        name, word = words[0] if words else ("", "")
        if word in _STEEL_OF_WORD:
            rating.put("steel", _STEEL_OF_WORD[word], f"{materials[0].label}, {name}")
        elif word:
            self.case.warn(f"{section.header}: {echo(word)} is no steel that a case can rate")
        for row in table.GEAR_STRENGTH:
            rating.take(row.key, read(materials, row))
        for rows in table.ROUGHNESS.values():
            any(rating.take(row.key, read(gears, row)) for row in rows)
        accuracy = number(gears, table.ACCURACY, "none")
        if accuracy is not None:
            rating.put("accuracy_grade", round(accuracy.value), accuracy.source)
        rating.take(table.PITCH_DEVIATION.key, read(gears, table.PITCH_DEVIATION))

    def _mass(self, section: Section, gears: list[Component], internal: bool) -> None:
        """Write the mass of the gear, of both halves together, but of one half of a ring."""
        datum = number(gears, "mass_of_component", "kg", positive=True)
        halves = 1 if internal else len(gears) // len({*map(self.assembly.body, gears)})
        if datum is not None:
            section.put("mass_kg", datum.value * halves, datum.source)

    def _blank(self, section: Section, gears: list[Component], internal: bool, root: float) -> None:
        """Write the bore or rim, from the gear, its gear_body, or its shaft.

        root: root diameter, mm.
        """
        bodies = [b for gear in gears for b in self.document.parts(gear, "gear_body")]
        mark(bodies, "a blank")
        if not internal:
            bore = number([*gears, *bodies], "inner_diameter", "mm")
            bore = bore or self._shaft_diameter(gears[0], "inner")
            if bore is not None and 0 < bore.value < root:
                section.put("bore_diameter_mm", bore.value, f"{bore.source}; for mass and inertia")
            return
        rim = number(bodies, "gear_body_rim_thickness", "mm")
        if rim is None:
            outer = number(bodies, "outer_diameter", "mm")
            outer = outer or self._shaft_diameter(gears[0], "outer")
            if outer is not None and outer.value > root:
                rim = Datum((outer.value - root) / 2, f"{outer.source}, less the root circle, / 2")
        if rim is not None and rim.value > 0:
            section.put("rim_thickness_mm", rim.value, f"{rim.source}; for mass and inertia")

    def _shaft_diameter(self, gear: Component, side: str) -> Datum | None:
        """Diameter of the shaft at the position of a gear, mm. side: "outer" or "inner"."""
        shaft = self.assembly.frames.shaft(gear)
        u = value(gear, "u_coordinate_on_shaft", "mm")
        for part, section in [] if shaft is None else sections_of(self.document, shaft):
            if section.start - _TOLERANCE <= u < section.start + section.length:
                diameters = dict(zip(("outer", "inner"), section.diameters(u), strict=True))
                return Datum(diameters[side], f"{part.label}, {side} diameter")
        return None


def base_diameter(teeth: float, rack: Rack) -> float:
    """Base diameter d_b = z m_n cos α_t / cos β, in the unit of the module."""
    return 2 * reference_radius(teeth, rack) * math.cos(transverse_angle(rack))


def _over_module(components: Sequence[Component], names: Sequence[str], rack: Rack) -> Datum | None:
    """The first of these attributes that a component has; lengths are divided by the module."""
    for name in names:
        is_length = table.SCHEMA_UNITS.get(name) == "mm"
        datum = number(components, name, "mm" if is_length else "none")
        if datum is not None and is_length:
            return Datum(datum.value / rack.normal_module, f"{datum.source} / normal module")
        if datum is not None:
            return datum
    return None


def _within(key: str, value: float) -> bool:
    """Whether a coefficient is within the limits of the case's key."""
    low, high = limits_of(Gear, key)
    return low is not None and high is not None and low <= value <= high
