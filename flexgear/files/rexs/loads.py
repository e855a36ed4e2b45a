"""Inputs and output of a case from the external loads and speeds of a file.

A port is a body with an external load that transmits torque about its axis. Power with sign says
which way it goes: torque and speed of one sign drive. Of all speeds and torques as many are taken
as the train leaves free, those that the file defines first; the others must follow.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from flexgear.files.rexs.assembly import Assembly
from flexgear.files.rexs.document import Component, Datum, Document, flag, number
from flexgear.files.rexs.frames import Frame
from flexgear.files.rexs.members import Member

SAME = 1e-3  # of the largest, between what a file says and what follows from the rest of it
_ALIGNED = 1e-6
_TORQUE, _POWER = "torque_around_u_axis", "power"


@dataclass(eq=False)
class Port:
    """A member that an external load acts on; speed (rpm), torque (N m), power (kW) about +u.

    rank: 0 for what the file says it defines. inertia: of additional masses, kg m².
    """

    member: Member
    loads: list[Component]
    speed: Datum | None = None
    torque: Datum | None = None
    power: Datum | None = None
    defines_torque: bool = False
    inertia: Datum | None = None
    forces: list[str] = field(default_factory=list)

    @property
    def drives(self) -> bool | None:
        """Whether power goes in here, None where the file does not say."""
        if self.power is not None:
            return self.power.value > 0
        if self.torque is None or self.speed is None or not self.torque.value * self.speed.value:
            return None
        return self.torque.value * self.speed.value > 0


def ports_of(document: Document, assembly: Assembly, members: list[Member]) -> list[Port]:
    """Ports in the order of the members; loads without torque are left to be listed."""
    ports: dict[int, Port] = {}
    for load in document.kind("external_load"):
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
        port.speed = speed_of(document, assembly, body)
        port.inertia = _inertia(document, assembly, body)
    order = {member: k for k, member in enumerate(members)}
    return sorted(ports.values(), key=lambda p: order[p.member])


def forces_on(
    document: Document, assembly: Assembly, members: list[Member]
) -> list[tuple[Member, Component, tuple[list[float], list[float]]]]:
    """Forces (N) and moments (N m) across loads, in the case's axes x, y, z = v, w, u.

    Of shafts along the gear unit's axes; moments about u are torques of ports. Others are listed.
    """
    forces = []
    for load in document.kind("external_load"):
        shaft = assembly.frames.shaft(load)
        frame = None if shaft is None else assembly.frames.of(shaft)
        member = _member_of(assembly, load, members)
        if member is None or (frame is not None and not _is_aligned(frame)):
            continue
        force = [number([load], f"force_{a}_direction", "N") for a in "vwu"]
        moment = [number([load], f"torque_around_{a}_axis", "N m") for a in "vw"]
        values = [0.0 if d is None else d.value for d in (*force, *moment)]
        if any(values):
            load.role = load.role or f"forces on {member.name}"
            forces.append((member, load, (values[:3], [*values[3:], 0.0])))
    return forces


def _is_aligned(frame: Frame) -> bool:
    """Whether a frame's axes are those of the gear unit."""
    return bool(abs(frame.axes - np.eye(3)).max() < _ALIGNED)


def speed_of(document: Document, assembly: Assembly, body: int | None) -> Datum | None:
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


def defined_speed(document: Document, assembly: Assembly, body: int) -> bool:
    """Whether a shaft of the body defines the speed."""
    return any(
        flag([c], "defines_speed") is True
        for c in document.kind("shaft")
        if assembly.body(c) == body
    )


def choices(ports: list[Port], mobility: int) -> Iterator[tuple[list[Port], list[Port]]]:
    """Which ports' speeds and torques to take, most wanted first.

    ``mobility`` speeds, and a torque at all other ports but as many as that.
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
    ways = {m: assembly.way_length(load, m.anchor) for m in mine if m.anchor is not None}
    return min(mine, key=lambda m: ways[m])


def _signed(datum: Datum | None, turn: float) -> Datum | None:
    if datum is None or turn > 0:
        return datum
    return Datum(-datum.value, f"{datum.source}; its shaft points against the main axis")


def _add(total: Datum | None, more: Datum | None) -> Datum | None:
    if total is None or more is None:
        return total or more
    return Datum(total.value + more.value, f"{total.source} + {more.source}")


def _inertia(document: Document, assembly: Assembly, body: int) -> Datum | None:
    total = None
    for mass in document.kind("additional_mass"):
        if assembly.body(mass) == body:
            datum = number([mass], "moment_of_inertia_u_axis", "kg m^2")
            if datum is not None:
                mass.role = "inertia at a port"
                total = _add(total, datum)
    return total
