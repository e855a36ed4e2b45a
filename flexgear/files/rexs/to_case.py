"""Import of a REXS model as a commented case.

Members are lumped, or suns on shafts. A comment at every key of the case states its component and
attribute, or why its value is assumed. Content of the file that is not in the case is listed at the
end.
"""

import math
import re
import tomllib
from collections import Counter, defaultdict
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from flexgear.files.case_text import CaseText, Section, commented
from flexgear.files.rexs.assembly import BEARINGS, Assembly
from flexgear.files.rexs.document import Component, Document, flag, mark, number, read, value
from flexgear.files.rexs.gears import GearReader
from flexgear.files.rexs.ports import PortWriter
from flexgear.files.rexs.shafts import Joints
from flexgear.files.rexs.spectrum import write_load_cases
from flexgear.files.rexs.stage_keys import StageWriter
from flexgear.files.rexs.stages import (
    Member,
    RexsStage,
    assign_bearings,
    is_helical,
    members_of,
    stages_of,
)
from flexgear.files.rexs.supports import Scale, SupportWriter
from flexgear.files.rexs.tables import GRAVITY, MATERIAL, OIL, VISCOSITIES
from flexgear.gears.power_flow import power_flow
from flexgear.gears.tooth import PlainRack, reference_radius
from flexgear.model.errors import InputError, echo
from flexgear.model.load import case_of_toml

_FRAME_ATTRIBUTES = ("reference_component_for_position", "support_vector", "u_axis_vector")
_MAX_IDS = 8  # of components in a line; others are only counted


def left_out(document: Document) -> list[str]:
    """Descriptions of components, attributes and relations that were not carried over. Positions
    and axes of components that were carried over count as used."""
    for component in document.components.values():
        # the w axis of a gear also states the angle of its teeth, which a case computes
        of_frame = [*_FRAME_ATTRIBUTES, *([] if "gear" in component.kind else ["w_axis_vector"])]
        for name in component.attributes.keys() & of_frame if component.role else ():
            component.attributes[name].used = True
    groups: dict[tuple[str, str, bool], list[str]] = defaultdict(list)
    for component in document.components.values():
        unused = [a.id for a in component.attributes.values() if not a.used]
        unused += [
            f"{name} (of the model; that of the load case is used)"
            for name, attribute in component.of_model.items()
            if component.attributes[name] is not attribute
        ]
        none = not component.role and not any(a.used for a in component.attributes.values())
        if unused or not component.role:
            names = ", ".join(sorted(unused)) or "no attributes"
            groups[component.kind, names, none].append(str(component.id))
    lines = []
    for (kind, names, none), ids in groups.items():
        more = f" and {len(ids) - _MAX_IDS} more" if len(ids) > _MAX_IDS else ""
        numbers = ", ".join(ids[:_MAX_IDS]) + more
        lines.append(f"{kind} {numbers}: {'not carried over; ' if none else ''}{names}")
    relations = Counter(r.kind for r in document.relations if not r.used)
    lines += [f"{count} relations of type {kind}" for kind, count in relations.items()]
    return lines + list(document.other)


_GRAVITY = 9.80665


@dataclass(frozen=True)
class Imported:
    """Text of a case, its assumptions and warnings, and descriptions of what is not in it."""

    text: str
    assumed: tuple[str, ...]
    left_out: tuple[str, ...]


def case_of_document(document: Document, where: str, load_case: int | None = None) -> Imported:
    """Convert a REXS model to a case; InputError if it has no stage that a case can represent.
    where: name of the file. load_case: id of the load case, None for the first one."""
    return _Conversion(document, where, load_case).run()


class _Conversion:
    """Conversion of one document. lost: descriptions of what is not carried over."""

    def __init__(self, document: Document, where: str, load_case: int | None) -> None:
        self.document, self.where = document, where
        self.case = CaseText()
        self.lost: list[str] = []
        cases = document.load_cases
        chosen = next((c for c in cases if load_case in (None, c.id)), None)
        if chosen is None and load_case is not None:
            numbers = ", ".join(str(c.id) for c in cases) or "none"
            problem = f"{load_case} is not in the file"
            raise InputError(where, "load case", problem, f"there are: {numbers}")
        document.take_load_case(chosen)
        self.assembly = Assembly(document)
        self.material: dict[str, float] = {}
        self.supports = SupportWriter(self.assembly, self.case)
        self.scales: dict[str, Scale] = {}  # by stage

    def run(self) -> Imported:
        """Write all sections of the case."""
        stages, refused = stages_of(self.assembly)
        self.lost += refused
        if not stages:
            why = refused[0] if refused else "it has no cylindrical or planetary stage with gears"
            raise InputError(self.where, "stages", f"none can be carried over: {why}",
                             "name a model with cylindrical gears")  # fmt: skip
        named = dict(zip(_names(stages), stages, strict=True))
        self.members = members = members_of(named, self.assembly)
        self.lost += assign_bearings(self.assembly, members)
        top = self.case.section("")
        self._material([gear for stage in stages for gear in stage.all_gears])
        ports = PortWriter(self.assembly, self.case, members, self.where)
        self.held = self._held(ports)
        self.joints = Joints(self.assembly, members, self.held)
        loads = {port.member: port.loads[0] for port in ports.ports}
        self.joints.find_shafts(self.case, loads)
        self.lost += self.joints.left_out
        ports.shafts = self.joints.shafts
        for gear in (gear for stage in stages for gear in stage.all_gears):
            if not self.assembly.frames.is_parallel(gear):
                self.case.warn(f"{gear.label}: its axis is not parallel to the gear unit's u axis")
        gears = GearReader(self.assembly, self.case)
        racks = self._stages(gears, named)
        self._top(top, racks)
        self.joints.write(self.case, self.scales)
        damping = self.case.section("[damping]")
        damping.assume("kind", "modal", "damping is not in REXS")
        damping.assume("ratio", 0.02, "usual for roller bearings and bolted housings")
        try:
            ports.write()
        except InputError as fault:  # the case is written all the same, for the user to correct
            key, message = fault.key, f"{fault.problem} -- {fault.remedy}"
            self.case.warn(f"the case cannot run before this is corrected: {key}: {message}")
        for member, shaft in self.joints.shafts.items():
            if member in ports.sections:
                scale = self.scales[member.stage_name]
                shaft.write_bearings(ports.sections[member], self.supports, scale)
        gears.modified.write(self._carries(named))
        written = write_load_cases(ports)
        self._lubricant()
        self.lost += [
            f"load case {other.id} (spectrum {other.spectrum}), {len(other.attributes)} attributes:"
            f" --load-case {other.id} imports it instead of the first"
            for other in self.document.load_cases
            if other is not self.document.load_case and other.id not in written
        ]
        self._warn_of_units()
        listed = tuple(self.lost + left_out(self.document))
        return Imported(self._text(listed), tuple(self.case.assumed), listed)

    def _carries(self, stages: Iterable[str]) -> dict[str, bool]:
        """Whether the mean gear-mesh force of each loaded stage is positive, by stage.

        Empty if the case does not determine the forces.
        """
        try:
            case = case_of_toml(tomllib.loads(self.case.text()), self.where, "imported")
            flow = power_flow(case)
        except InputError:
            return {}
        forces = {name: flow.stage(name).sun_gear_mesh_force for name in stages}
        return {name: force > 0 for name, force in forces.items() if force}

    def _warn_of_units(self) -> None:
        """Warn about values that are missing in the case because of their unit."""
        components = self.document.components
        attributes = [(c, a) for c in components.values() for a in c.of_model.values()]
        for load_case in self.document.load_cases:
            attributes += [(components[k], a) for k, a in load_case.attributes]
        for component, a in attributes:
            if a.unknown_unit:
                where = ", ".join(filter(None, (component.label, a.id, a.where)))
                problem = f"{echo(a.unit)} is no unit known for it; the value is left out"
                self.case.warn(f"{where}: {problem}")

    def _material(self, gears: list[Component]) -> None:
        materials = [m for gear in gears for m in self.document.references(gear, "material")]
        shafts = [s for g in gears if (s := self.assembly.frames.shaft(g)) is not None]
        materials += [m for shaft in shafts for m in self.document.references(shaft, "material")]
        section = self.case.section("[material]")
        for row in MATERIAL:
            datum = read(materials, row)
            self.material[row.key] = section.take_or_assume(row.key, datum, row.usual, "steel")
        mark(materials, "the material")

    def _lubricant(self) -> None:
        """Write the first lubricant with a viscosity at 40 °C, and the temperature of the oil in
        the casing, a gear mesh or a bearing."""
        oiled = self.document.kind("gear_casing", "cylindrical_stage", *BEARINGS)
        lubricants = self.document.kind("lubricant")
        lubricant = next((c for c in lubricants if read([c], VISCOSITIES[0])), None)
        if lubricant is None:
            return
        section = self.case.section("[lubricant]")
        for row in VISCOSITIES:
            section.take(row.key, read([lubricant], row))
        section.take(OIL.key, read(sorted(oiled, key=lambda c: c.kind != "gear_casing"), OIL))
        lubricant.role = "the lubricant"
        for part in oiled:
            self.document.references(part, "lubricant")  # marks relations as used

    def _stages(self, gears: GearReader, named: dict[str, RexsStage]) -> dict[str, PlainRack]:
        """Write all stages with their supports; returns racks by stage."""
        racks = {}
        spatial = self.joints.has_flexible_shafts
        axial = spatial or any(is_helical(stage) for stage in named.values())
        for name, stage in named.items():
            writer = StageWriter(gears, self.case, self.where, stage, name)
            racks[name] = writer.write()
            self.scales[name] = scale = self._scale(stage, racks[name])
            of_stage = [m for m in self.members if m.stage is stage]
            carriers = [m for m in of_stage if m.role == "carrier"]
            for shaft in (shaft for m, shaft in self.joints.shafts.items() if m.stage is stage):
                shaft.write(self.supports, scale)
            for carrier in carriers:
                density = self.material["density_kg_per_m3"]
                self.supports.carrier_blank(carrier, density, 1e-3 * writer.center_distance)
            for member in of_stage:
                self.supports.support(member, scale, self._needs(member, axial))
            for carrier in carriers:
                needs = ("radial", *["axial"] * axial, *["tilt"] * spatial)
                self.supports.planet(stage.planet_bearings, scale, carrier.z, needs)
            self._gear_mesh(gears.modified.has(name))
        return racks

    def _gear_mesh(self, modified: bool) -> None:
        gear_mesh = self.case.section("[stages.gear_mesh]")
        if modified:
            gear_mesh.assume("model", "per_pair", "modified flanks need contact of each tooth pair")
            gear_mesh.assume("contact_law", "one-sided", "gaps open and close")
            return
        why = "mean of ISO 6336-1; gear-mesh stiffness is not carried over"
        gear_mesh.assume("model", "constant", why)
        gear_mesh.assume("contact_law", "linear", "as the constant stiffness")

    def _scale(self, stage: RexsStage, rack: PlainRack) -> Scale:
        names = ("face_width", "common_face_width")
        widths = [number([c], names, "m") for c in (*stage.all_gears, *stage.pairs)]
        width = min(w.value for w in widths if w is not None and w.value > 0)
        teeth = [abs(value(gear, "number_of_teeth", "none")) for gear in stage.all_gears]
        mean = round(sum(teeth) / np.count_nonzero(teeth))
        return Scale(
            1e9 * self.material["young_modulus_gpa"] * width, 1e-3 * reference_radius(mean, rack)
        )

    def _needs(self, member: Member, axial: bool) -> tuple[str, ...]:
        """Directions in which a member must have a stiffness.

        A sun may float between its planets. Only one member of each body needs axial support.
        """
        joints, body = self.joints, self.joints.body(member)
        floats = member.role == "sun" and len(member.stage.halves["planet"][0]) >= 3
        needs = [] if floats or member.bearings else ["radial"]
        if axial and not any(map(joints.is_carried, body)) and member is body[0]:
            needs.append("axial")
        if member in joints.shafts:
            return tuple(needs)
        if member in self.held:
            needs = ["radial", "axial", "torsion"] if axial else ["radial", "torsion"]
        if joints.has_flexible_shafts and not joints.is_held_against_tilt(member):
            needs.append("tilt")
        return tuple(needs)

    def _held(self, ports: PortWriter) -> dict[Member, str]:
        """Members that do not rotate, with reasons."""
        held, members = {}, self.members
        for member in members:
            if member.anchor is not None and self.assembly.held(member.anchor):
                held[member] = f"{member.anchor.label} is coupled to the casing"
        for member in members:
            stage = [m for m in members if m.stage is member.stage]
            single = sum(m.body == member.body for m in members) == 1
            free = single and member.body not in ports.bodies and not any(m in held for m in stage)
            if member.role == "ring" and free:
                why = f"nothing drives {member.anchor.label if member.anchor else 'the ring'}"
                held[member] = f"assumed: {why}"
                self.case.warn(f"{member.name} is held: {why}")
        return held

    def _top(self, top: Section, racks: dict[str, PlainRack]) -> None:
        units = self.document.kind("gear_unit")
        title = next((u.name for u in units if u.name.strip()), "")
        printable = "".join(c if c.isprintable() else " " for c in title)[:80]
        top.put("title", printable or "Imported from REXS", units[0].label if printable else "")
        helical = any(rack.helix_angle for rack in racks.values())
        why = "helical stages have axial forces" if helical else "all gears are spur gears"
        kinematics = "axial" if helical else "planar"
        if self.joints.has_flexible_shafts:
            kinematics, why = "spatial", "a shaft between members is flexible"
        top.assume("kinematics", kinematics, why)
        if self.held:
            names = [member.name for member in self.held]
            top.put("held", names, "; ".join(self.held.values()))
        self._gravity(top, units)
        mark(units, "the case")
        mark(self.document.kind("gear_casing"), "the casing")

    def _gravity(self, top: Section, units: list[Component]) -> None:
        if flag(units, "account_for_gravity") is not True:
            return
        size = number(units, "gravitational_acceleration", "m / s^2")
        parts = [value(units[0], name, "none") for name in GRAVITY]
        length = math.hypot(*parts)
        if length == 0:
            self.case.warn(f"{units[0].label}: accounts for gravity, but states no direction")
            return
        g = _GRAVITY if size is None else size.value
        why = f"{units[0].label}, direction_vector_gravity: x, y, z are v, w, u"
        why += "" if size is not None else "; size assumed"
        top.put("gravity_m_per_s2", [g * p / length for p in parts], why)

    def _text(self, listed: tuple[str, ...]) -> str:
        file, by = Path(self.where).name, self.document.application
        head = [
            f"From {file}: REXS {self.document.version}" + (f", written by {by}" if by else ""),
            "",
            "The comment at each key states its component and attribute, or why it is assumed.",
            "Axes: z is the u axis of the gear unit, x is v, y is w.",
        ]
        tail = ["", "Not in this case" + (":" if listed else ": nothing of the file.")]
        tail += [f"  {line}" for line in listed]
        return commented(head) + "\n" + self.case.text() + "\n" + commented(tail[1:])


def _names(stages: list[RexsStage]) -> list[str]:
    """Names of stages: those of the file if they are valid and unique, else stage_1, …"""
    names = [stage.component.name.strip() for stage in stages]
    valid = all(re.fullmatch(r"[A-Za-z][A-Za-z0-9_-]{0,31}", name) for name in names)
    if valid and len({*names}) == len(names):
        return names
    return [f"stage_{k}" for k in range(1, len(stages) + 1)]
