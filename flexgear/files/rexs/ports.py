"""Writes inputs and output of a case, with as many speeds and torques as the train leaves free."""

from __future__ import annotations

import tomllib
from typing import Any

from flexgear.files.case_text import CaseText
from flexgear.files.rexs.assembly import Assembly
from flexgear.files.rexs.document import Datum, Document
from flexgear.files.rexs.loads import (
    SAME,
    Port,
    choices,
    defined_speed,
    forces_on,
    ports_of,
    speed_of,
)
from flexgear.files.rexs.members import Member
from flexgear.gears.power_flow import PowerFlow, power_flow
from flexgear.model.case import Case
from flexgear.model.errors import InputError
from flexgear.model.load import case_of_toml
from flexgear.model.units import RPM


class PortWriter:
    """Ports of a document's loads. ``bodies``: those they act on."""

    def __init__(
        self, document: Document, assembly: Assembly, case: CaseText, members: list[Member]
    ) -> None:
        self.document, self.assembly, self.case, self.members = document, assembly, case, members
        self.ports = ports_of(document, assembly, members)
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
            self._complete(port, speeds[port.member.name])
        if len(self.ports) < free.mobility:
            self.case.warn("fewer loads than free speeds: a case of free vibration, modes only")
            return
        chosen, loaded = self._chosen(where, free.mobility)
        if len(self.ports) < 2 or len(loaded) < len(self.ports) - free.mobility:
            self._free(chosen, speeds)
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
            datum = speed_of(self.document, self.assembly, member.body)
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
        return member.body is not None and defined_speed(self.document, self.assembly, member.body)

    def _compare(self, speeds: dict[str, float]) -> None:
        """Say where the file has another speed than follows from the one that was taken."""
        largest = max(map(abs, speeds.values()), default=0.0)
        for member in self.members:
            datum = speed_of(self.document, self.assembly, member.body)
            if datum is not None and abs(datum.value - speeds[member.name]) > SAME * largest:
                self.case.warn(
                    f"{datum.source}: {datum.value:.6g} rpm, but {speeds[member.name]:.6g} rpm"
                    " follows from the speed that was taken"
                )

    def _complete(self, port: Port, follows: float) -> None:
        """Speed of a port that the file gives elsewhere."""
        if port.speed is None:
            port.speed = Datum(follows, "derived: from the speed that the file gives elsewhere")

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

    def _free(self, chosen: list[Port], speeds: dict[str, float]) -> None:
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
        self._signs(output)
        self._forces()

    def _forces(self) -> None:
        """Forces and moments on members, in fixed axes, at the member's middle."""
        for member, load, (force, moment) in forces_on(self.document, self.assembly, self.members):
            section = self.case.section("[[loads]]")
            section.put("member", member.name, load.label)
            section.put("force_n", force, f"{load.label}: v, w, u directions")
            if any(moment):
                section.put("moment_nm", moment, f"{load.label}: about v and w")
            self.case.warn(f"{load.label}: its force acts in the middle of {member.name} here")

    def _output(self, loaded: list[Port]) -> Port:
        """Where power goes out: as the file's signs say, else where it gives no torque."""
        outs = [p for p in self.ports if p.drives is False]
        if outs:
            return max(outs, key=_power)
        silent = [p for p in self.ports if p not in loaded]
        return silent[-1] if silent else self.ports[-1]

    def _signs(self, output: Port) -> None:
        if output.drives is True:
            self.case.warn(f"{output.loads[0].label}: its signs say that it drives, as all others")


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
