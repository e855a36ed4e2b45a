"""Inputs and output of a case from the external loads and speeds of a file.

A port is a body with an external load that transmits torque about its axis. Torque and speed of
equal sign mean that power enters there. As many speeds and torques are used as the train has free
ones, beginning with those that the file marks as defining; the others must follow from these.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Self

import numpy as np

from flexgear.arrays import Array
from flexgear.files.case_text import CaseText, Datum, Section
from flexgear.files.rexs.assembly import Assembly
from flexgear.files.rexs.document import Component, flag, read, value
from flexgear.files.rexs.shafts import SunShaft
from flexgear.files.rexs.stages import Member, axial_place
from flexgear.files.rexs.tables import FORCES, INERTIA, MOMENTS, PORT, SCHEMA_UNITS
from flexgear.gears.determinacy import Members, members_of, rank, require_free_ties
from flexgear.model.load import case_of_toml
from flexgear.model.units import RPM

_SPEED_TOLERANCE = 1e-3  # of the largest speed, between stated and derived speeds
_LEAST_LEVER = 1e-9  # m, of a force
_ALIGNMENT_TOLERANCE = 1e-6  # of the entries of a rotation matrix
SPEED, TORQUE, POWER = PORT
_DERIVED = "derived: from another speed in the file"
_FEW_LOADS = "there are fewer loads than free speeds"
_WITHOUT_LOADS = "the case is one of free vibration, for modes only"


@dataclass(eq=False)
class Port:
    """A member with external loads; its speed (rpm), torque (N m) and power (kW) about +u.

    defines_torque: whether the file marks its torque as defining. masses: components of additional
    masses, with the total inertia, kg m².
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
    def size(self) -> float:
        """Power into the train (kW), or torque times speed (N m rpm) if the file has no power; 0 if
        it has neither."""
        if self.power is not None:
            return self.power.value
        torque, speed = (0.0 if d is None else d.value for d in (self.torque, self.speed))
        return torque * speed

    @property
    def drives(self) -> bool | None:
        """Whether power enters the train at the port; None if the file does not determine it."""
        return None if self.power is None and not self.size else self.size > 0

    def is_back_driven(self, rated: Self) -> bool:
        """Whether power flows against that of the port ``rated``; at rest the torque counts."""
        torques = [0.0 if port.torque is None else port.torque.value for port in (self, rated)]
        return (self.size * rated.size or math.prod(torques)) < 0.0

    def torque_over(self, rated: Self) -> float:
        """Torque over that of the port ``rated``, 0 if either is unknown or 0."""
        torques = [0.0 if port.torque is None else port.torque.value for port in (self, rated)]
        return abs(torques[0] / torques[1]) if torques[1] else 0.0

    def take_torque(self, section: Section, speed: float | None = None) -> None:
        """Write the torque to a section, or the power if there is no torque. speed: in rpm, of
        ports whose power becomes a torque: the output, and those without a speed in the case."""
        if self.torque is not None or self.power is None:
            section.take(TORQUE.key, self.torque)
        elif not speed:
            section.take(POWER.key, self.power)
        else:
            torque = 1e3 * self.power.value * RPM / speed
            section.put(TORQUE.key, torque, f"{self.power.source} / speed")


def ports_of(assembly: Assembly, members: list[Member]) -> list[Port]:
    """Ports in the order of their members; loads that transmit no torque are ignored."""
    ports: dict[int, Port] = {}
    for load in assembly.document.kind("external_load"):
        transmits = flag([load], "transmits_torque")
        torque, power = read([load], TORQUE), read([load], POWER)
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
        port_of_body = ports.get(assembly.body(mass))
        if port_of_body is None:
            continue
        port_of_body.masses.append(mass)
        inertia = read([mass], INERTIA)
        if inertia is not None:
            mass.role = "inertia at a port"
            port_of_body.inertia = _sum(port_of_body.inertia, inertia)
    for body, port in ports.items():
        port.speed = speed_of(assembly, body)
    return sorted(ports.values(), key=lambda port: members.index(port.member))


def speed_of(assembly: Assembly, body: int | None) -> Datum | None:
    """Speed of a body about the gear unit's u axis, rpm: that of its shafts, else of its gears."""
    members = assembly.members(body)
    shafts = [c for c in members if c.kind == "shaft"]
    shafts.sort(key=lambda c: flag([c], "defines_speed") is not True)
    gears = [c for c in members if c.kind in ("cylindrical_gear", "ring_gear")]
    for component in [*shafts, *gears]:
        datum = read([component], SPEED)
        if datum is not None:
            read([component, *members], SPEED)  # marks equal speeds as used
            return _signed(datum, assembly.frames.sense(component))
    return None


def _member_of(assembly: Assembly, load: Component, members: list[Member]) -> Member | None:
    """The member nearest to a load along the links of its body, None if the body has no member."""
    body = assembly.body(load)
    lengths = {
        member: assembly.path_length(load, member.anchor)
        for member in members
        if member.body == body and member.anchor is not None
    }
    return min(lengths, key=lambda member: lengths[member], default=None)


def forces_of(ports: PortWriter) -> dict[Member, tuple[Array, str]]:
    """Sum (5,) of the external loads with forces or moments on each member, and its source.

    Components are forces along x, y, z (v, w, u), N, and moments about x and y, N m, in fixed axes
    at the middle of the member, of a sun on a shaft at the end of its shaft. Moments include
    those of forces at a distance l along the axis, −l F_y and l F_x. Loads on shafts with other
    axes than the gear unit are ignored.
    """
    assembly, shafts = ports.assembly, ports.shafts
    sums: dict[Member, tuple[Array, str]] = {}
    for load in assembly.document.kind("external_load"):
        shaft = assembly.frames.shaft(load)
        frame = None if shaft is None else assembly.frames.of(shaft)
        member = _member_of(assembly, load, ports.members)
        rotated = frame is not None and abs(frame.axes - np.eye(3)).max() > _ALIGNMENT_TOLERANCE
        if member is None or rotated:
            continue
        names = (*FORCES, *MOMENTS)
        values = [value(load, name, SCHEMA_UNITS[name]) for name in names]
        if any(values):
            load.role = load.role or f"forces on {member.name}"
        at = shafts[member].ends[1] if member in shafts else member.z
        place = axial_place(assembly, load)
        lever = 0.0 if at is None or place is None else 1e-3 * (place - at)
        if abs(lever) > _LEAST_LEVER:
            values[3] -= lever * values[1]
            values[4] += lever * values[0]
        if {*names} & load.attributes.keys():
            total, source = sums.get(member, (np.zeros(len(values)), ""))
            sums[member] = total + values, f"{source} + {load.label}" if source else load.label
    return sums


def put_forces(section: Section, load: Array, source: str) -> None:
    """Write force and transverse moments (5,) on a member; torques are written with the ports."""
    section.put("force_n", load[:3].tolist(), f"{source}: v, w, u directions")
    section.put("moment_nm", [*load[3:].tolist(), 0.0], f"{source}: about v and w")


def _signed(datum: Datum | None, sense: float) -> Datum | None:
    """A value about the axis of a shaft as one about the gear unit's u axis."""
    if datum is None or sense > 0:
        return datum
    return Datum(-datum.value, f"{datum.source}; its shaft points against the main axis")


def _sum(total: Datum | None, more: Datum | None) -> Datum | None:
    if total is None or more is None:
        return total or more
    return Datum(total.value + more.value, f"{total.source} + {more.source}")


def _speed_rows(train: Members, driven: Iterable[Member]) -> Array:
    """Rows over the speeds of all members of a train: its ties, then one for each driven member."""
    place = {str(name): k for k, name in enumerate(train.names)}
    places = [place[member.name] for member in driven]
    return np.vstack([train.tie_rows, np.eye(len(train.names))[places]])


def _independent(train: Members, members: Iterable[Member]) -> list[Member]:
    """Members whose speeds the ties of a train leave independent, each beside those before it."""
    driven: list[Member] = []
    for member in members:
        rows = _speed_rows(train, [*driven, member])
        driven += [member] if rank(rows) == len(rows) else []
    return driven


class PortWriter:
    """Writes the ports of a document into a case. where: name of the file. bodies: bodies with
    ports. shafts: shafts of suns. sections: written sections by member."""

    def __init__(
        self, assembly: Assembly, case: CaseText, members: list[Member], where: str
    ) -> None:
        self.assembly, self.case, self.members, self.where = assembly, case, members, where
        self.ports = ports_of(assembly, members)
        self.bodies = {port.member.body for port in self.ports}
        self.shafts: dict[Member, SunShaft] = {}
        self.sections: dict[Member, Section] = {}

    def write(self) -> None:
        """Write inputs, output and forces on members at the end of the case. Raises InputError for
        a train that cannot turn, or has redundant joints."""
        written = case_of_toml(tomllib.loads(self.case.text()), self.where, "imported")
        train = members_of(written)
        if not self.ports:
            self.case.warn(f"no external load transmits torque: {_WITHOUT_LOADS}")
            return
        mobility = require_free_ties(train)
        speeds = self._speeds(train, mobility)
        if speeds is None or len(self.ports) < mobility:
            lacks = "the file has no speed" if speeds is None else _FEW_LOADS
            self.case.warn(f"{lacks}: {_WITHOUT_LOADS}")
            return
        for port in self.ports:
            if port.speed is None:
                port.speed = Datum(speeds[port.member.name], _DERIVED)
        chosen, loaded = self._choose(train, mobility)
        suffice = len(self.ports) > 1 and len(loaded) == len(self.ports) - mobility
        if not suffice:
            self.case.warn(f"the torques of the file do not suffice: {_WITHOUT_LOADS}")
        output = self._output(loaded) if suffice else None
        for port in sorted(self.ports, key=lambda port: port is output):
            if suffice or port in chosen or port.member in self.shafts:
                section = self.case.section("[output]" if port is output else "[[inputs]]")
                section.put("member", port.member.name, port.loads[0].label)
                if port in chosen:
                    section.take(SPEED.key, port.speed)
                if suffice and port in loaded:
                    derives = port is output or port not in chosen
                    port.take_torque(section, speeds[port.member.name] if derives else None)
                self.sections[port.member] = section
                if port.member in self.shafts:
                    self.shafts[port.member].write_port_body(section, port.masses)
                else:
                    section.take(INERTIA.key, port.inertia)
        if output is None:
            return
        if output.drives is True:
            self.case.warn(f"{output.loads[0].label}: by its signs it drives, as all other loads")
        for member, (total, source) in forces_of(self).items():
            if total.any():
                section = self.case.section("[[loads]]")
                section.put("member", member.name, source)
                put_forces(section, total, source)
                place = "behind the shaft" if member in self.shafts else "in the middle"
                self.case.warn(
                    f"{source}: its force acts {place} of {member.name} in the case, with the"
                    " moment of its distance"
                )

    def _speeds(self, train: Members, mobility: int) -> dict[str, float] | None:
        """Speeds (rpm) of all members, derived from speeds in the file; None if there are too few.

        Warns about each speed in the file that differs from the derived one.
        """
        stated = {m: datum for m in self.members if (datum := speed_of(self.assembly, m.body))}
        bodies = {m.body: m for m in reversed(self.members)}.values()
        usable = [m for m in bodies if m in stated and (stated[m].value or m.body in self.bodies)]
        usable.sort(key=lambda m: (not self._defined(m), m.body not in self.bodies))
        driven = _independent(train, usable)
        if len(driven) < mobility:
            return None
        right = [0.0] * len(train.ties) + [stated[member].value for member in driven]
        solution = np.linalg.solve(_speed_rows(train, driven), right)
        speeds = dict(zip(map(str, train.names), solution.tolist(), strict=True))
        largest = max(map(abs, speeds.values()))
        for member, datum in stated.items():
            if abs(datum.value - speeds[member.name]) > _SPEED_TOLERANCE * largest:
                self.case.warn(
                    f"{datum.source}: {datum.value:.6g} rpm, but {speeds[member.name]:.6g} rpm"
                    " follows from the speeds that are used"
                )
        return speeds

    def _defined(self, member: Member) -> bool:
        """Whether a shaft of the member's body defines its speed."""
        shafts = (c for c in self.assembly.members(member.body) if c.kind == "shaft")
        return any(flag([c], "defines_speed") is True for c in shafts)

    def _choose(self, train: Members, mobility: int) -> tuple[list[Port], list[Port]]:
        """Ports whose speeds are used (``mobility`` of them, if so many are independent), and ports
        whose torques are used (all but ``mobility``). Power at zero speed gives no torque."""
        speeds = sorted(
            self.ports,
            key=lambda p: (
                not self._defined(p.member),
                p.speed is None or p.speed.source == _DERIVED,
            ),
        )
        torques = [
            p for p in speeds if p.torque is not None or (p.power and p.speed and p.speed.value)
        ]
        torques.sort(key=lambda p: (not p.defines_torque, p.drives is False))
        driven = _independent(train, [port.member for port in speeds])
        return [p for p in speeds if p.member in driven], torques[: len(self.ports) - mobility]

    def _output(self, loaded: list[Port]) -> Port:
        """The port where most power leaves the train; without such, the last port without load."""
        outputs = [p for p in self.ports if p.drives is False]
        if outputs:
            return max(outputs, key=lambda port: abs(port.size))
        unloaded = [p for p in self.ports if p not in loaded] or self.ports
        return unloaded[-1]
