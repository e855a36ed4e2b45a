"""A case as a REXS model: gears, shafts, carriers, bearings, joints, loads; steady results.

Frame: u is the case's z, v its x, w its y. Speeds, torques and powers of the steady flow stand in a
load case.
"""

from __future__ import annotations

import cmath
import math
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from flexgear.arrays import Array
from flexgear.files.rexs import tables as table
from flexgear.files.rexs.outgoing import Outgoing, Place, Written, located
from flexgear.files.rexs.stage_out import (
    StageOut,
    TrainOut,
    add_section,
    springs_out,
    torsion_out,
)
from flexgear.gears.load_bins import HOUR, LoadBin, bins_of_load_cases
from flexgear.gears.power_flow import power_flow
from flexgear.gears.radii import stage_radii
from flexgear.model.case import Case
from flexgear.model.member import LumpedInertia, MatedGear, PlanetGear
from flexgear.model.modifications import FLANKS, FlankModifications
from flexgear.model.names import GroupName, MemberName
from flexgear.model.section import Section
from flexgear.model.train import Input, Joint, MemberLoad, Output

_WRITTEN = {
    "name", "title", "source", "gravity", "material", "stages", "joints", "held", "inputs",
    "output", "loads", "load_cases", "spectrum",
}  # fmt: skip
_UNWRITTEN = sorted(FlankModifications.model_fields.keys() - table.KEYS)  # modifications
_OF_SPRINGS = ("damping", "elements", "journal", "rollers", "thrust")  # that REXS has not
_OF_PORTS = {
    "member", "speed", "torque", "power", "inertia", "mass", "tilt_inertia", "bearing",
}  # fmt: skip


def not_written(case: Case) -> list[str]:
    """Parts of the case that the REXS model does not hold, in words."""
    lost = _set(case, "", _WRITTEN)
    for k, port in enumerate(case.ports):
        where = "output" if port is case.output else f"inputs[{k}]"
        lost += _set(port, f"{where}.", _OF_PORTS)
        lost += _lost(port.bearing, f"{where}.bearing.", *_OF_SPRINGS)
    lost += [f"loads on {load.member}" for load in case.loads if not _is_written(load)]
    states = [state for c in case.load_cases for _, _, state in c.states("")]
    if any(s.frame != "fixed" and (s.force or s.moment) for s in states):
        lost.append("loads of load_cases in turning frames")
    for k, joint in enumerate(case.joints):
        lost += _lost(joint, f"joints[{k}].", "damping")
    for stage in case.stages:
        before = f"stages.{stage.name}."
        lost += _lost(stage, before, "errors", "gear_mesh")
        lost += _lost(stage.planet_bearing, f"{before}planet_bearing.", *_OF_SPRINGS)
        for name in (*stage.members, "planet"):
            member, where = getattr(stage, name, None), f"{before}{name}"
            if getattr(member, "inertia", None) or getattr(member, "equivalent_mass", None):
                lost.append(f"{where}: its moment of inertia")
            if isinstance(member, LumpedInertia):
                for key, support in member.supports.items():
                    lost += _lost(support, f"{where}.{key}.", *_OF_SPRINGS)
            if isinstance(member, MatedGear | PlanetGear):
                ground = member.modifications
                lost += _lost(member, f"{where}.", "rating")
                lost += _lost(ground, f"{where}.modifications.", *_UNWRITTEN)
                for flank in FLANKS:
                    of_flank = getattr(ground, flank, None)
                    lost += _lost(of_flank, f"{where}.modifications.{flank}.", *_UNWRITTEN)
        if stage.sun is not None:
            keys = ("flexible", "elements_per_section")
            lost += _lost(stage.sun.shaft, f"{before}sun.shaft.", *keys)
        if "fe" in map(stage.form, (*stage.members, "planet")):
            lost.append(f"{before[:-1]}: FE bodies, bearings of an FE carrier")
    return lost


def _set(section: Section, before: str, written: Iterable[str]) -> list[str]:
    """Keys of a section that are set, but for those that are written."""
    return _lost(section, before, *(k for k in type(section).model_fields if k not in written))


def _lost(section: Section | None, before: str, *keys: str) -> list[str]:
    """Names of the keys that a section has and that are set."""
    fields = {} if section is None else type(section).model_fields
    return [
        f"{before}{key}"
        for key in keys
        if key in fields
        and getattr(section, key) != fields[key].get_default(call_default_factory=True)
    ]


class BinResults(NamedTuple):
    """Results of load bins beside speeds and torques, each attribute by bin (B,), not finite where
    there is none. gears: by gear meshes of one half and gear; bearings: by that of a planet."""

    bins: Sequence[LoadBin]
    gears: Mapping[tuple[GroupName, str], Mapping[str, Array]]
    bearings: Mapping[str, Mapping[str, Array]]


def model_of_case(case: Case, rated: BinResults | None = None) -> Outgoing:
    """The REXS model of a case, with its load cases, or with the bins of a rating and what they
    made of gears and bearings. InputError for a train without one answer for its speeds."""
    model = Outgoing()
    unit = model.add(
        "gear_unit", case.title or case.name, **located((0.0, 0.0, 0.0)), **_gravity(case)
    )
    casing = model.part(unit, "gear_casing", "casing")
    material = model.add("material", "material", **table.written(case.material, table.MATERIAL))
    train = TrainOut(case, power_flow(case), model, places(case), unit, casing, material)
    for stage in case.stages:
        StageOut(train, stage).add()
    for joint in case.joints:
        _add_joint(train, joint)
    for member, speed in train.flow.speed.items() if case.ports else ():
        model.result(train.shafts[member], rotational_speed=speed)
    ports = {port.member: _add_port(train, port) for port in case.ports}
    bins = bins_of_load_cases(case) if rated is None else rated.bins
    forces: dict[str, list[int]] = {}
    for load in filter(_is_written, case.loads):
        _add_forces(train, forces, load.member, load.first)
    for load in filter(_is_written, [load for load_bin in bins for load in load_bin.loads]):
        if load.member not in forces:
            _add_forces(train, forces, load.member, np.zeros(6))
    for b, load_bin in enumerate(bins):
        _add_load_case(train, load_bin, ports, forces)
        for number, attributes in _rated(train, rated) if rated else ():
            sizes = {name: float(values[b]) for name, values in attributes.items()}
            model.result(number, **{name: x for name, x in sizes.items() if math.isfinite(x)})
    return model


def _rated(train: TrainOut, rated: BinResults) -> Iterator[tuple[int, Mapping[str, Array]]]:
    """Components and their results by bin; bearings without ratings have no attributes for them."""
    for key, attributes in rated.gears.items():
        yield from ((number, attributes) for number in train.gear_data[key])
    for name, attributes in rated.bearings.items():
        for number in train.bearings[name]:
            if train.model.components[number - 1][0] != "concept_bearing":
                yield number, attributes


def _gravity(case: Case) -> dict[str, Written | None]:
    size = math.sqrt(sum(g * g for g in case.gravity))
    if not size:
        return {"account_for_gravity": False}
    along = {name: g / size for name, g in zip(table.GRAVITY, case.gravity, strict=True)}
    return {"account_for_gravity": True, **along, "gravitational_acceleration": size}


def _add_joint(train: TrainOut, joint: Joint) -> None:
    model, name, ends = train.model, f"{joint.first} – {joint.second}", (joint.first, joint.second)
    first, second = map(train.end, ends)
    if joint.length is not None and joint.outer_diameter is not None:
        shaft = model.part(train.unit, "shaft", name, **located(train.places[joint.first]))
        section = (joint.length, joint.outer_diameter, joint.inner_diameter)
        add_section(model, shaft, 0.0, *section)
        model.side("coupling", first, shaft, name, u_coordinate_on_shaft_outer_side=0.0)
        model.side("coupling", shaft, second, name, u_coordinate_on_shaft_inner_side=joint.length)
        return
    at = MemberName.parse(joint.first)
    torsion = torsion_out(joint, stage_radii(train.case.view(at.stage)), at.part)
    springs = springs_out(joint, 1.0)
    model.side("coupling", first, second, name, rotational_stiffness=torsion, **springs)


def _add_port(train: TrainOut, port: Input | Output) -> int:
    """Adds the external load at a port; its id."""
    shaft, inertia = train.end(port.member), train.case.port_inertia(port.member)
    number = train.model.part(
        shaft,
        "external_load",
        port.member,
        u_coordinate_on_shaft=0.0,
        transmits_torque=True,
        defines_torque=port.given_torque is not None,
    )
    if train.case.output is not None:
        torque, power = train.flow.torque[port.member], train.flow.power[port.member]
        train.model.result(number, torque_around_u_axis=torque, power=power)
    if inertia > 0 or port.mass is not None:
        train.model.part(
            shaft,
            "additional_mass",
            u_coordinate_on_shaft=0.0,
            moment_of_inertia_u_axis=inertia,
            mass_of_component=port.mass,
            moment_of_inertia_v_axis=port.tilt_inertia,
            moment_of_inertia_w_axis=port.tilt_inertia,
        )
    return number


def _add_forces(train: TrainOut, forces: dict[str, list[int]], member: str, load: Array) -> None:
    """Adds force and transverse moments (6,) on a member, with the id among ``forces``."""
    number = train.model.part(
        train.end(member),
        "external_load",
        f"force on {member}",
        u_coordinate_on_shaft=0.0,
        transmits_torque=False,
        **_force_attributes(load),
    )
    forces.setdefault(member, []).append(number)


def _add_load_case(
    train: TrainOut, load_bin: LoadBin, ports: dict[str, int], forces: dict[str, list[int]]
) -> None:
    """Results of a load bin; loads that the case has already are not written again.

    ports, forces: ids of external loads by member.
    """
    model = train.model
    model.begin_load_case()
    model.result(train.unit, operating_time=HOUR * load_bin.hours)
    for member, speed in load_bin.speed.items():
        model.result(train.shafts[member], rotational_speed=speed)
    for member, number in ports.items():
        torque = load_bin.torque[member]
        power = torque * load_bin.speed[member]
        model.result(number, torque_around_u_axis=torque, power=power)
    for member, numbers in forces.items():
        loads = [load for load in load_bin.loads if load.member == member]
        if loads != [load for load in train.case.loads if load.member == member]:
            total = sum((load.first for load in filter(_is_written, loads)), np.zeros(6))
            for k, number in enumerate(numbers):
                model.result(number, **_force_attributes(np.zeros(6) if k else total))


def _is_written(load: MemberLoad) -> bool:
    """Whether REXS has an attribute for a load: constant, in fixed axes, no torque."""
    return not load.is_history and load.frame == "fixed" and load.moment[2] == 0


def _force_attributes(load: Array) -> dict[str, float]:
    """Attributes of a load (6,), N along x, y, z and N m about them, of which the last is 0."""
    return dict(zip((*table.FORCES, *table.MOMENTS), map(float, load), strict=False))


def places(case: Case) -> dict[str, Place]:
    """Place of every member (u, v, w in m): stages side by side along u, joined ones coaxial."""
    neighbours: dict[str, list[tuple[str, complex]]] = defaultdict(list)  # steps v + i w to others
    steps = {(joint.first, joint.second): 0j for joint in case.joints}
    for stage in case.stages:
        first, *others = (f"{stage.name}.{part}" for part in stage.members)
        arm = stage_radii(case.view(stage.name)).center_distance
        step = cmath.rect(arm, stage.position) if stage.kind == "parallel" else 0j
        steps |= {(first, other): step for other in others}
    for (first, second), step in steps.items():
        neighbours[first].append((second, step))
        neighbours[second].append((first, -step))
    across: dict[str, complex] = {}
    for start in case.member_names():
        waiting: list[tuple[str, complex]] = [(start, 0j)]
        while waiting:
            position, at = waiting.pop()
            if position not in across:
                across[position] = at
                waiting += [(other, at + step) for other, step in neighbours[position]]
    placed, u = {}, 0.0
    for stage in case.stages:
        for part in stage.members:
            name = f"{stage.name}.{part}"
            placed[name] = (u + stage.gear_width / 2, across[name].real, across[name].imag)
        u += 2 * stage.gear_width
    return placed
