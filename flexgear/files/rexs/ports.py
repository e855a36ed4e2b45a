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
from dataclasses import dataclass
from typing import Any

import numpy as np

from flexgear.files.case_text import CaseText, Section
from flexgear.files.rexs.assembly import Assembly
from flexgear.files.rexs.document import Component, Datum, Document, LoadCase, flag, number
from flexgear.files.rexs.stages import Member
from flexgear.gears.power_flow import PowerFlow, power_flow
from flexgear.model.errors import InputError
from flexgear.model.load import case_of_toml
from flexgear.model.units import RPM

SAME = 1e-3  # of the largest, between what a file says and what follows from the rest of it
_ALIGNED = 1e-6
_TORQUE, _POWER = "torque_around_u_axis", "power"
_TIME = ("operating_time", "load_duration")
_SHARE = ("operating_time_fraction", "load_duration_fraction")
_WHOLE = 20_000.0  # h, where a file gives shares alone


@dataclass(eq=False)
class Port:
    """A member that an external load acts on; speed (rpm), torque (N m), power (kW) about +u.

    inertia: of additional masses, kg m².
    """

    member: Member
    loads: list[Component]
    speed: Datum | None = None
    torque: Datum | None = None
    power: Datum | None = None
    defines_torque: bool = False
    inertia: Datum | None = None

    @property
    def drives(self) -> bool | None:
        """Whether power goes in here, None where the file does not say."""
        if self.power is not None:
            return self.power.value > 0
        if self.torque is None or self.speed is None or not self.torque.value * self.speed.value:
            return None
        return self.torque.value * self.speed.value > 0


def ports_of(assembly: Assembly, members: list[Member]) -> list[Port]:
    """Ports in the order of the members; loads without torque are left to be listed."""
    ports: dict[int, Port] = {}
    for load in assembly.document.kind("external_load"):
        transmits = flag([load], "transmits_torque")
        value = number([load], _TORQUE, "N m") or number([load], _POWER, "kW")
        if transmits is False or (transmits is None and value is None):
            continue
        member = _member_of(assembly, load, members)
        if member is None:
            continue
        load.role = f"the load on {member.name}"
        port = ports.setdefault(assembly.body(load), Port(member, []))
        port.loads.append(load)
        turn = assembly.frames.sense(load)
        port.torque = _add(port.torque, _signed(number([load], _TORQUE, "N m"), turn))
        port.power = _add(port.power, number([load], _POWER, "kW"))
        port.defines_torque |= flag([load], "defines_torque") is True
    for body, port in ports.items():
        port.speed = speed_of(assembly, body)
        port.inertia = _inertia(assembly, body)
    order = {member: k for k, member in enumerate(members)}
    return sorted(ports.values(), key=lambda p: order[p.member])


def speed_of(assembly: Assembly, body: int | None) -> Datum | None:
    """Speed of a body, rpm about the gear unit's u axis: of its shafts, else of its gears."""
    mine = assembly.members(body)
    shafts = [c for c in mine if c.kind == "shaft"]
    shafts.sort(key=lambda c: flag([c], "defines_speed") is not True)
    for component in [*shafts, *(c for c in mine if c.kind in ("cylindrical_gear", "ring_gear"))]:
        datum = number([component], "rotational_speed", "1 / min")
        if datum is not None:
            for twin in mine:
                number([component, twin], "rotational_speed", "1 / min")
            return _signed(datum, assembly.frames.sense(component))
    return None


def _member_of(assembly: Assembly, load: Component, members: list[Member]) -> Member | None:
    """A member of the body that the load acts on: the nearest along links, else the first."""
    body = assembly.body(load)
    mine = [m for m in members if m.body == body and m.anchor is not None]
    if not mine:
        return None
    lengths = {m: assembly.path_length(load, m.anchor) for m in mine if m.anchor is not None}
    return min(mine, key=lambda m: lengths[m])


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
        data = [number([load], f"force_{a}_direction", "N") for a in "vwu"]
        data += [number([load], f"torque_around_{a}_axis", "N m") for a in "vw"]
        values = [0.0 if datum is None else datum.value for datum in data]
        if any(values):
            load.role = load.role or f"forces on {member.name}"
        if any(datum is not None for datum in data):
            yield load, member, values


def _signed(datum: Datum | None, turn: float) -> Datum | None:
    if datum is None or turn > 0:
        return datum
    return Datum(-datum.value, f"{datum.source}; its shaft points against the main axis")


def _add(total: Datum | None, more: Datum | None) -> Datum | None:
    if total is None or more is None:
        return total or more
    return Datum(total.value + more.value, f"{total.source} + {more.source}")


def _inertia(assembly: Assembly, body: int) -> Datum | None:
    total = None
    for mass in assembly.document.kind("additional_mass"):
        if assembly.body(mass) == body:
            datum = number([mass], "moment_of_inertia_u_axis", "kg m^2")
            if datum is not None:
                mass.role = "inertia at a port"
                total = _add(total, datum)
    return total


class PortWriter:
    """Ports of a document's loads. ``bodies``: those they act on."""

    def __init__(self, assembly: Assembly, case: CaseText, members: list[Member]) -> None:
        self.assembly, self.case, self.members = assembly, case, members
        self.ports = ports_of(assembly, members)
        self.bodies = {port.member.body for port in self.ports}

    def write(self, where: str) -> None:
        """Inputs and output, at the end of the case."""
        free = _flow(self.case.text(), where, {})
        if not self.ports:
            self.case.warn(
                "no external load transmits torque: a case of free vibration, modes only"
            )
            return
        speeds = self._speeds(where, free.mobility)
        if speeds is None:
            self.case.warn("no speed in the file: a case of free vibration, modes only")
            return
        for port in self.ports:
            if port.speed is None:
                follows = "derived: from the speed that the file gives elsewhere"
                port.speed = Datum(speeds[port.member.name], follows)
        if len(self.ports) < free.mobility:
            self.case.warn("fewer loads than free speeds: a case of free vibration, modes only")
            return
        chosen, loaded = self._chosen(where, free.mobility)
        if len(self.ports) < 2 or len(loaded) < len(self.ports) - free.mobility:
            self._free(chosen)
            return
        self._loaded(chosen, loaded, speeds)

    def _speeds(self, where: str, mobility: int) -> dict[str, float] | None:
        """Speeds (rpm) of all members, from those that the file gives; None if there are none."""
        driven: dict[str, Datum] = {}
        order = sorted(
            {m.body: m for m in reversed(self.members)}.values(),
            key=lambda m: (not self._defined(m), m.body not in self.bodies),
        )
        for member in order:
            datum = speed_of(self.assembly, member.body)
            if datum is None or (not datum.value and member.body not in self.bodies):
                continue
            if len(driven) < mobility:
                try:
                    _flow(self.case.text(), where, {**driven, member.name: datum}, partial=True)
                except InputError:
                    continue
                driven[member.name] = datum
        if len(driven) < mobility:
            return None
        flow = _flow(self.case.text(), where, driven)
        speeds = {name: value * RPM for name, value in flow.speed.items()}
        self._compare(speeds)
        return speeds

    def _defined(self, member: Member) -> bool:
        """Whether a shaft of the member's body defines the speed."""
        shafts = (c for c in self.assembly.members(member.body) if c.kind == "shaft")
        return any(flag([c], "defines_speed") is True for c in shafts)

    def _compare(self, speeds: dict[str, float]) -> None:
        """Warn where the file states another speed than follows from the speeds that were taken."""
        largest = max(map(abs, speeds.values()), default=0.0)
        for member in self.members:
            datum = speed_of(self.assembly, member.body)
            if datum is not None and abs(datum.value - speeds[member.name]) > SAME * largest:
                self.case.warn(
                    f"{datum.source}: {datum.value:.6g} rpm, but {speeds[member.name]:.6g} rpm"
                    " follows from the speed that was taken"
                )

    def _chosen(self, where: str, mobility: int) -> tuple[list[Port], list[Port]]:
        """Ports whose speeds, and whose torques, are taken: the first choice that a train can have,
        of ``mobility`` speeds and the torques of all ports but ``mobility`` of them."""
        ports = sorted(
            self.ports,
            key=lambda p: p.speed is not None and p.speed.source.startswith("derived"),
        )
        ports.sort(key=lambda p: not self._defined(p.member))
        speeds = [p for p in ports if p.speed is not None]
        torques = [p for p in ports if p.torque is not None or p.power is not None]
        torques.sort(key=lambda p: (not p.defines_torque, p.drives is False))
        count = len(ports) - mobility  # of torques
        best: tuple[list[Port], list[Port]] = ([], [])
        for chosen, loaded in itertools.product(
            map(list, itertools.combinations(speeds, min(mobility, len(speeds)))),
            map(list, itertools.combinations(torques, min(count, len(torques)))),
        ):
            best = best if best[0] else (chosen, loaded)
            driven = {p.member.name: p.speed for p in chosen if p.speed is not None}
            try:
                _flow(self.case.text(), where, driven)
            except InputError:
                continue
            return chosen, loaded
        return best

    def _free(self, chosen: list[Port]) -> None:
        """Ports of a case without loads: it is one of free vibration about steady speeds."""
        self.case.warn(
            "the torques of the file do not suffice: a case of free vibration, modes only"
        )
        for port in chosen:
            section = self.case.section("[[inputs]]")
            section.put("member", port.member.name, port.loads[0].label)
            section.take("speed_rpm", port.speed)

    def _loaded(self, chosen: list[Port], loaded: list[Port], speeds: dict[str, float]) -> None:
        output = self._output(loaded)
        for port in (*(p for p in self.ports if p is not output), output):
            section = self.case.section("[output]" if port is output else "[[inputs]]")
            section.put("member", port.member.name, port.loads[0].label)
            if port in chosen:
                section.take("speed_rpm", port.speed)
            if port in loaded:
                assert port.torque is not None or port.power is not None
                if port.torque is not None:
                    section.take("torque_nm", port.torque)
                elif port is output or port not in chosen:
                    assert port.power is not None
                    value = 1e3 * port.power.value * RPM / speeds[port.member.name]
                    section.put("torque_nm", value, f"{port.power.source} / speed")
                else:
                    section.take("power_kw", port.power)
            if port.inertia is not None:
                section.take("inertia_kg_m2", port.inertia)
        if output.drives is True:
            self.case.warn(f"{output.loads[0].label}: its signs say that it drives, as all others")
        self._forces()

    def _forces(self) -> None:
        """Forces and moments on members, as constant loads; moments about u are torques of
        ports."""
        for load, member, values in forces_of(self.assembly, self.members):
            if not any(values):
                continue
            section = self.case.section("[[loads]]")
            section.put("member", member.name, load.label)
            section.put("force_n", values[:3], f"{load.label}: v, w, u directions")
            if any(values[3:]):
                section.put("moment_nm", [*values[3:], 0.0], f"{load.label}: about v and w")
            self.case.warn(f"{load.label}: its force acts in the middle of {member.name} here")

    def _output(self, loaded: list[Port]) -> Port:
        """Where power goes out: as the file's signs say, else where it gives no torque."""
        outs = [p for p in self.ports if p.drives is False]
        if outs:
            return max(outs, key=_power)
        silent = [p for p in self.ports if p not in loaded]
        return silent[-1] if silent else self.ports[-1]


def _power(port: Port) -> float:
    if port.power is not None:
        return abs(port.power.value)
    assert port.torque is not None and port.speed is not None
    return abs(port.torque.value * port.speed.value)


def _flow(text: str, where: str, speeds: dict[str, Datum], *, partial: bool = False) -> PowerFlow:
    """Steady flow of the case so far, with these speeds (rpm) and no torques."""
    raw: dict[str, Any] = tomllib.loads(text)
    raw["inputs"] = [
        {"member": member, "speed_rpm": datum.value} for member, datum in speeds.items()
    ]
    case = case_of_toml(raw, where, "imported")
    if partial:
        free = power_flow(case_of_toml({**raw, "inputs": []}, where, "imported"))
        if len(speeds) < free.mobility:
            return free
    return power_flow(case)


def write_load_cases(
    document: Document, assembly: Assembly, text: CaseText, members: list[Member]
) -> set[int]:
    """Write load cases that have a duration behind the ports of a case; ids of those written."""
    written: dict[str, Any] = tomllib.loads(text.text())
    ports = [*written.get("inputs", ()), *([written["output"]] if "output" in written else [])]
    if "output" not in written:
        return set()
    ids: set[int] = set()
    with document.values_of(LoadCase(0, 0, [])):  # of the model, not of the load case that is rated
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
                if port is not None and keys.keys() & {"speed_rpm", "torque_nm", "power_kw"}:
                    section = _section(text, sections, keys["member"], port.loads[0].label)
                    _take(section, keys, port)
            for member, load, source in _forces(assembly, members):
                section = _section(text, sections, member, source)
                section.put("force_n", load[:3], f"{source}: v, w, u directions")
                section.put("moment_nm", [*load[3:], 0.0], f"{source}: about v and w")
    return ids


def _forces(assembly: Assembly, members: list[Member]) -> Iterator[tuple[str, list[float], str]]:
    """Members, sums of the forces and moments on them, and where these come from."""
    sums: dict[str, tuple[list[float], list[str]]] = {}
    for load, member, values in forces_of(assembly, members):
        before, labels = sums.get(member.name, ([0.0] * len(values), []))
        sums[member.name] = (
            [a + b for a, b in zip(before, values, strict=True)],
            [*labels, load.label],
        )
    for name, (total, labels) in sums.items():
        yield name, total, " + ".join(labels)


def _section(text: CaseText, sections: dict[str, Section], member: str, why: str) -> Section:
    """The section of a member in the load case that is being written."""
    if member not in sections:
        sections[member] = text.section("[[load_cases.members]]")
        sections[member].put("member", member, why)
    return sections[member]


def _take(section: Section, keys: Mapping[str, Any], port: Port) -> None:
    """Speed and torque of a port in a load case, where the case gives them."""
    if "speed_rpm" in keys:
        section.take("speed_rpm", port.speed)
    if "torque_nm" in keys or "power_kw" in keys:
        if port.torque is not None:
            section.take("torque_nm", port.torque)
        else:
            section.take("power_kw", port.power)


def _hours(
    document: Document, load_case: LoadCase, whole: Datum | None, text: CaseText
) -> Datum | None:
    """How long a load case lasts, h; None where the file does not say."""
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
