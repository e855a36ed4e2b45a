"""Inputs and output of a case from the external loads and speeds of a file.

A port is a body with an external load that transmits torque about its axis. Power with sign says
which way it goes: torque and speed of one sign drive. Of all speeds and torques as many are taken
as the train leaves free, those that the file defines first; the others must follow.
"""

from __future__ import annotations

import itertools
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from flexgear.files.case_text import CaseText
from flexgear.files.rexs.assembly import Assembly
from flexgear.files.rexs.document import Component, Datum, flag, number
from flexgear.files.rexs.stages import Member
from flexgear.gears.power_flow import PowerFlow, power_flow
from flexgear.model.case import Case
from flexgear.model.errors import InputError
from flexgear.model.load import case_of_toml
from flexgear.model.units import RPM

SAME = 1e-3  # of the largest, between what a file says and what follows from the rest of it
_ALIGNED = 1e-6
_TORQUE, _POWER = "torque_around_u_axis", "power"


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


def defined_speed(assembly: Assembly, body: int) -> bool:
    """Whether a shaft of the body defines the speed."""
    return any(
        flag([c], "defines_speed") is True
        for c in assembly.document.kind("shaft")
        if assembly.body(c) == body
    )


def choices(ports: list[Port], mobility: int) -> Iterator[tuple[list[Port], list[Port]]]:
    """Which ports' speeds and torques to take, the preferred choice first.

    Each has ``mobility`` speeds, and the torques of all ports but ``mobility`` of them.
    """
    speeds = [p for p in ports if p.speed is not None]
    torques = [p for p in ports if p.torque is not None or p.power is not None]
    torques.sort(key=lambda p: (not p.defines_torque, p.drives is False))
    torque_count = len(ports) - mobility
    for chosen in itertools.combinations(speeds, min(mobility, len(speeds))):
        for loaded in itertools.combinations(torques, min(torque_count, len(torques))):
            yield list(chosen), list(loaded)


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
        return member.body is not None and defined_speed(self.assembly, member.body)

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
        ports = sorted(
            self.ports,
            key=lambda p: p.speed is not None and p.speed.source.startswith("derived"),
        )
        ports.sort(key=lambda p: not self._defined(p.member))
        best: tuple[list[Port], list[Port]] = ([], [])
        for chosen, loaded in choices(ports, mobility):
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
    case = _case(raw, where)
    if partial and len(speeds) < power_flow(_case({**raw, "inputs": []}, where)).mobility:
        return power_flow(_case({**raw, "inputs": []}, where))
    return power_flow(case)


def _case(raw: dict[str, Any], where: str) -> Case:
    return case_of_toml(raw, where, "imported")
