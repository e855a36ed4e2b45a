"""Inputs and output of a case from the external loads and speeds of a file.

A port is a body with an external load that transmits torque about its axis. Power with sign says
which way it goes: torque and speed of one sign drive. Of all speeds and torques as many are taken
as the train leaves free, those that the file defines first; the others must follow.

A load case lasts for ``operating_time`` of the gear unit (``load_duration`` up to REXS 1.2), or for
a share of the whole time, ``operating_time_fraction`` (``load_duration_fraction``). No time at all
marks an extreme load.
"""

from __future__ import annotations

import itertools
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from flexgear.arrays import Array
from flexgear.files.case_text import CaseText, Datum, Section
from flexgear.files.rexs.assembly import Assembly
from flexgear.files.rexs.document import Component, Document, LoadCase, flag, number, read, value
from flexgear.files.rexs.shafts import SunShaft
from flexgear.files.rexs.stages import Member
from flexgear.files.rexs.tables import BEHIND, FORCES, INERTIA, MOMENTS, PORT, SCHEMA_UNITS
from flexgear.gears.power_flow import power_flow
from flexgear.model.case import Case
from flexgear.model.errors import InputError
from flexgear.model.load import case_of_toml
from flexgear.model.units import RPM

SAME = 1e-3  # of the largest, between what a file says and what follows from the rest of it
_ALIGNED = 1e-6
_SPEED, _TORQUE, _POWER = PORT
_TIME = ("operating_time", "load_duration")
_SHARE = ("operating_time_fraction", "load_duration_fraction")
_WHOLE = 20_000.0  # h, where a file gives shares alone
_FREE = "a case of free vibration, modes only"


@dataclass(eq=False)
class Port:
    """A member that an external load acts on; speed (rpm), torque (N m), power (kW) about +u.

    masses: additional ones; inertia: theirs, kg m².
    """

    member: Member
    loads: list[Component]
    speed: Datum | None = None
    torque: Datum | None = None
    power: Datum | None = None
    defines_torque: bool = False
    inertia: Datum | None = None
    masses: list[Component] = field(default_factory=list)

    @property
    def drives(self) -> bool | None:
        """Whether power enters here, None where the file does not state it."""
        if self.power is not None:
            return self.power.value > 0
        if self.torque is None or self.speed is None or not self.torque.value * self.speed.value:
            return None
        return self.torque.value * self.speed.value > 0

    @property
    def size(self) -> float:
        """Magnitude of its power, or of torque times speed (N m · rpm) where the file has no
        power."""
        if self.power is not None:
            return abs(self.power.value)
        assert self.torque is not None and self.speed is not None
        return abs(self.torque.value * self.speed.value)

    def take_torque(self, section: Section) -> None:
        """Write its torque to a section, or else its power."""
        section.take(*((_TORQUE.key, self.torque) if self.torque else (_POWER.key, self.power)))


def ports_of(assembly: Assembly, members: list[Member]) -> list[Port]:
    """Ports in the order of the members; loads without torque are left to be listed."""
    ports: dict[int, Port] = {}
    for load in assembly.document.kind("external_load"):
        transmits = flag([load], "transmits_torque")
        torque, power = read([load], _TORQUE), read([load], _POWER)
        if transmits is False or (transmits is None and torque is None and power is None):
            continue
        member = _member_of(assembly, load, members)
        if member is None:
            continue
        load.role = f"the load on {member.name}"
        port = ports.setdefault(assembly.body(load), Port(member, []))
        port.loads.append(load)
        port.torque = _sum(port.torque, _signed(torque, assembly.frames.sense(load)))
        port.power = _sum(port.power, power)
        port.defines_torque |= flag([load], "defines_torque") is True
    for mass in assembly.document.kind("additional_mass"):
        port_there = ports.get(assembly.body(mass))
        if port_there is None:
            continue
        port_there.masses.append(mass)
        inertia = read([mass], INERTIA)
        if inertia is not None:
            mass.role = "inertia at a port"
            port_there.inertia = _sum(port_there.inertia, inertia)
    for body, port in ports.items():
        port.speed = speed_of(assembly, body)
    return sorted(ports.values(), key=lambda port: members.index(port.member))


def speed_of(assembly: Assembly, body: int | None) -> Datum | None:
    """Speed of a body, rpm about the gear unit's u axis: of its shafts, else of its gears."""
    mine = assembly.members(body)
    shafts = [c for c in mine if c.kind == "shaft"]
    shafts.sort(key=lambda c: flag([c], "defines_speed") is not True)
    for component in [*shafts, *(c for c in mine if c.kind in ("cylindrical_gear", "ring_gear"))]:
        datum = read([component], _SPEED)
        if datum is not None:
            for twin in mine:
                read([component, twin], _SPEED)
            return _signed(datum, assembly.frames.sense(component))
    return None


def _member_of(assembly: Assembly, load: Component, members: list[Member]) -> Member | None:
    """A member of the body that the load acts on: the nearest along links, else the first."""
    body = assembly.body(load)
    lengths = {
        member: assembly.path_length(load, member.anchor)
        for member in members
        if member.body == body and member.anchor is not None
    }
    return min(lengths, key=lambda member: lengths[member], default=None)


def forces_of(
    assembly: Assembly, members: list[Member]
) -> Iterator[tuple[Component, Member, list[float]]]:
    """Loads with a force or moment stated, their members, and N, N m along x, y, z = v, w, u and
    about x, y, in fixed axes, at the member's middle.

    Of shafts along the gear unit's axes; others are listed.
    """
    for load in assembly.document.kind("external_load"):
        shaft = assembly.frames.shaft(load)
        frame = None if shaft is None else assembly.frames.of(shaft)
        member = _member_of(assembly, load, members)
        turned = frame is not None and abs(frame.axes - np.eye(3)).max() > _ALIGNED
        if member is None or turned:
            continue
        names = (*FORCES, *MOMENTS)
        values = [value(load, name, SCHEMA_UNITS[name]) for name in names]
        if any(values):
            load.role = load.role or f"forces on {member.name}"
        if {*names} & load.attributes.keys():
            yield load, member, values


def _put_forces(section: Section, values: list[float], source: str) -> None:
    """Force and moment of a member, without that about its axis: torques are those of ports."""
    section.put("force_n", values[:3], f"{source}: v, w, u directions")
    section.put("moment_nm", [*values[3:], 0.0], f"{source}: about v and w")


def _signed(datum: Datum | None, turn: float) -> Datum | None:
    if datum is None or turn > 0:
        return datum
    return Datum(-datum.value, f"{datum.source}; its shaft points against the main axis")


def _sum(total: Datum | None, more: Datum | None) -> Datum | None:
    if total is None or more is None:
        return total or more
    return Datum(total.value + more.value, f"{total.source} + {more.source}")


class PortWriter:
    """Ports of a document's loads. ``bodies``: those they act on; ``where``: the file; ``shafts``:
    of suns; ``sections``: those written, by member."""

    def __init__(
        self, assembly: Assembly, case: CaseText, members: list[Member], where: str
    ) -> None:
        self.assembly, self.case, self.members, self.where = assembly, case, members, where
        self.ports = ports_of(assembly, members)
        self.bodies = {port.member.body for port in self.ports}
        self.shafts: dict[Member, SunShaft] = {}
        self.sections: dict[Member, Section] = {}

    def write(self) -> None:
        """Inputs, output and forces on members, at the end of the case."""
        mobility = power_flow(self._case({})).mobility
        speeds = self._speeds(mobility) if self.ports else {}
        why = "" if self.ports else "no external load transmits torque"
        if speeds is None:
            why = "no speed in the file"
        elif self.ports and len(self.ports) < mobility:
            why = "fewer loads than free speeds"
        if why or speeds is None:
            self.case.warn(f"{why}: {_FREE}")
            return
        for port in self.ports:
            if port.speed is None:
                follows = "derived: from the speed that the file gives elsewhere"
                port.speed = Datum(speeds[port.member.name], follows)
        chosen, loaded = self._chosen(mobility)
        if len(self.ports) < 2 or len(loaded) < len(self.ports) - mobility:
            self.case.warn(f"the torques of the file do not suffice: {_FREE}")
            for port in self.ports:
                if port in chosen or port.member in self.shafts:
                    section = self._begin("[[inputs]]", port)
                    section.take(_SPEED.key, port.speed if port in chosen else None)
                    self._end(section, port)
            return
        self._loaded(chosen, loaded, speeds)
        for load, member, values in forces_of(self.assembly, self.members):
            if any(values):
                section = self.case.section("[[loads]]")
                section.put("member", member.name, load.label)
                _put_forces(section, values, load.label)
                place = "behind the shaft" if member in self.shafts else "in the middle"
                self.case.warn(f"{load.label}: its force acts {place} of {member.name} here")

    def _case(self, speeds: Mapping[str, Datum]) -> Case:
        """The case so far, with these speeds (rpm) and no torques."""
        raw = tomllib.loads(self.case.text())
        raw["inputs"] = [{"member": m, _SPEED.key: datum.value} for m, datum in speeds.items()]
        suns = {member.name for member in self.shafts}
        for port in raw["inputs"]:  # whose bodies have no part in speeds
            port |= {row.key: 1.0 for row in BEHIND} if port["member"] in suns else {}
        return case_of_toml(raw, self.where, "imported")

    def _speeds(self, mobility: int) -> dict[str, float] | None:
        """Speeds (rpm) of all members, from those that the file gives; None if there are too few.

        Warns where the file states another speed than follows from those that were taken.
        """
        stated = {m: datum for m in self.members if (datum := speed_of(self.assembly, m.body))}
        order = sorted(
            {m.body: m for m in reversed(self.members)}.values(),
            key=lambda m: (not self._defined(m), m.body not in self.bodies),
        )
        driven: dict[str, Datum] = {}
        for member in order:
            datum = stated.get(member)
            if datum is None or (not datum.value and member.body not in self.bodies):
                continue
            if len(driven) < mobility:
                try:
                    case = self._case({**driven, member.name: datum})
                    if len(driven) + 1 == mobility:
                        power_flow(case)
                except InputError:
                    continue
                driven[member.name] = datum
        if len(driven) < mobility:
            return None
        flow = power_flow(self._case(driven))
        speeds = {name: value * RPM for name, value in flow.speed.items()}
        largest = max(map(abs, speeds.values()), default=0.0)
        for member, datum in stated.items():
            if abs(datum.value - speeds[member.name]) > SAME * largest:
                self.case.warn(
                    f"{datum.source}: {datum.value:.6g} rpm, but {speeds[member.name]:.6g} rpm"
                    " follows from the speed that was taken"
                )
        return speeds

    def _defined(self, member: Member) -> bool:
        """Whether a shaft of the member's body defines the speed."""
        shafts = (c for c in self.assembly.members(member.body) if c.kind == "shaft")
        return any(flag([c], "defines_speed") is True for c in shafts)

    def _chosen(self, mobility: int) -> tuple[list[Port], list[Port]]:
        """Ports whose speeds, and whose torques, are taken: the first choice that a train can have,
        of ``mobility`` speeds and the torques of all ports but ``mobility`` of them."""
        speeds = [p for p in self.ports if p.speed is not None]
        speeds.sort(key=lambda p: p.speed is not None and p.speed.source.startswith("derived"))
        speeds.sort(key=lambda p: not self._defined(p.member))
        torques = [p for p in speeds if p.torque is not None or p.power is not None]
        torques.sort(key=lambda p: (not p.defines_torque, p.drives is False))
        count = len(self.ports) - mobility  # of torques
        choices = itertools.product(
            map(list, itertools.combinations(speeds, min(mobility, len(speeds)))),
            map(list, itertools.combinations(torques, min(count, len(torques)))),
        )
        first: tuple[list[Port], list[Port]] | None = None
        for chosen, loaded in choices:
            first = first or (chosen, loaded)
            try:
                power_flow(self._case({p.member.name: p.speed for p in chosen if p.speed}))
            except InputError:
                continue
            return chosen, loaded
        return first or ([], [])

    def _begin(self, header: str, port: Port) -> Section:
        section = self.case.section(header)
        section.put("member", port.member.name, port.loads[0].label)
        return section

    def _end(self, section: Section, port: Port) -> None:
        """Write the inertia of a port. Behind a sun's shaft the port is a body of its own, which
        gets mass, inertias and bearings, too."""
        self.sections[port.member] = section
        shaft = self.shafts.get(port.member)
        if shaft is None:
            section.take(INERTIA.key, port.inertia)
        else:
            shaft.write_behind(self.case, section, port.masses)

    def _loaded(self, chosen: list[Port], loaded: list[Port], speeds: dict[str, float]) -> None:
        """Inputs and output; power of the output, or at a speed that follows, becomes torque."""
        output = self._output(loaded)
        for port in sorted(self.ports, key=lambda port: port is output):
            section = self._begin("[output]" if port is output else "[[inputs]]", port)
            if port in chosen:
                section.take(_SPEED.key, port.speed)
            if port in loaded:
                derives = port.torque is None and (port is output or port not in chosen)
                if derives and port.power is not None:
                    value = 1e3 * port.power.value * RPM / speeds[port.member.name]
                    section.put(_TORQUE.key, value, f"{port.power.source} / speed")
                else:
                    port.take_torque(section)
            self._end(section, port)
        if output.drives is True:
            self.case.warn(f"{output.loads[0].label}: its signs say that it drives, as all others")

    def _output(self, loaded: list[Port]) -> Port:
        """Where power goes out: as the file's signs say, else where it gives no torque."""
        outs = [p for p in self.ports if p.drives is False]
        if outs:
            return max(outs, key=lambda port: port.size)
        silent = [p for p in self.ports if p not in loaded] or self.ports
        return silent[-1]


def write_load_cases(
    document: Document, assembly: Assembly, text: CaseText, members: list[Member]
) -> set[int]:
    """Write load cases that have a duration behind the ports of a case; ids of those written."""
    written: dict[str, Any] = tomllib.loads(text.text())
    ports = [*written.get("inputs", ()), *([written["output"]] if "output" in written else [])]
    if "output" not in written:
        return set()
    ids: set[int] = set()
    with document.values_of(None):  # of the model, not of the load case that is rated
        whole = number(document.kind("gear_unit"), _TIME, "h")
    for load_case in document.load_cases:
        with document.values_of(load_case):
            hours = _hours(document, load_case, whole, text)
            if hours is None:
                continue
            ids.add(load_case.id)
            section = text.section("[[load_cases]]")
            section.put("name", f"load case {load_case.id}", "")
            if hours.value > 0.0:
                section.put("hours", hours.value, hours.source)
            else:
                section.put("extreme", True, f"{hours.source}: no duration")
            sections = {written["inputs"][0]["member"]: section}
            states = {port.member.name: port for port in ports_of(assembly, members)}
            for keys in ports:
                port = states.get(keys["member"])
                if port is None or not keys.keys() & {row.key for row in PORT}:
                    continue
                section = _section(text, sections, keys["member"], port.loads[0].label)
                if _SPEED.key in keys:
                    section.take(_SPEED.key, port.speed)
                if keys.keys() & {_TORQUE.key, _POWER.key}:
                    port.take_torque(section)
            sums: dict[str, tuple[Array, list[str]]] = {}
            for load, on, values in forces_of(assembly, members):
                total, labels = sums.get(on.name, (np.zeros(len(values)), []))
                sums[on.name] = total + values, [*labels, load.label]
            for member, (total, labels) in sums.items():
                source = " + ".join(labels)
                section = _section(text, sections, member, source)
                _put_forces(section, total.tolist(), source)
    return ids


def _section(text: CaseText, sections: dict[str, Section], member: str, why: str) -> Section:
    """The section of a member in the load case that is being written."""
    if member not in sections:
        sections[member] = text.section("[[load_cases.members]]")
        sections[member].put("member", member, why)
    return sections[member]


def _hours(
    document: Document, load_case: LoadCase, whole: Datum | None, text: CaseText
) -> Datum | None:
    """Duration of a load case, h; None where the file does not state it."""
    stated = {attribute.id for _, attribute in load_case.attributes}
    units = document.kind("gear_unit")
    if stated & {*_TIME}:
        return number(units, _TIME, "h")
    share = number(units, _SHARE, "none") if stated & {*_SHARE} else None
    if share is None:
        return None
    if whole is None:
        line = f"load cases have shares of time alone: of {_WHOLE:g} h in all, assumed"
        if line not in text.assumed:
            text.warn(line)
    total = _WHOLE if whole is None else whole.value
    return Datum(share.value * total, f"{share.source}, of {total:g} h")
