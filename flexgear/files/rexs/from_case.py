"""Export of a case as a REXS model: gears, shafts, carriers, bearings, joints, loads, results.

Axes: u, v, w are z, x, y of the case. Speeds, torques and powers of steady operation are written as
a load case.
"""

import cmath
import math
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from flexgear.arrays import Array
from flexgear.files.rexs import tables as table
from flexgear.files.rexs.outgoing import Outgoing, Place, TrainOut, Written, located
from flexgear.files.rexs.stage_out import StageOut, springs_out, thrust_out, torsion_out
from flexgear.gears.load_bins import HOUR, LoadBin, bins_of_load_cases
from flexgear.gears.power_flow import power_flow
from flexgear.gears.radii import stage_radii
from flexgear.model.bearings import Bearing, Lubricant
from flexgear.model.bodies import Shaft
from flexgear.model.case import Case
from flexgear.model.member import GearMember, LumpedInertia
from flexgear.model.modifications import FlankModifications
from flexgear.model.names import GroupName, MemberName
from flexgear.model.rating import GearRating, RatedGearMesh, Rating
from flexgear.model.section import Section
from flexgear.model.stage import Stage
from flexgear.model.train import Input, Joint, MemberLoad, Output
from flexgear.model.units import Quantity


def _all_but(kind: type[Section], *written: str) -> tuple[str, ...]:
    """Keys of a type of section, without those that REXS holds."""
    return tuple(key for key in kind.model_fields if key not in written)


_UNWRITTEN: dict[type[Section], Iterable[str]] = {  # by type of section, what REXS does not hold
    Case: _all_but(
        Case, "name", "title", "source", "gravity", "material", "stages", "joints", "held",
        "inputs", "output", "loads", "load_cases", "spectrum", "lubricant", "rating",
    ),
    Lubricant: _all_but(Lubricant, *(row.field for row in (*table.VISCOSITIES, table.OIL))),
    **{
        port: _all_but(
            port, "member", "speed", "torque", "power", "inertia", "mass", "tilt_inertia", "bearing"
        )
        for port in (Input, Output)
    },
    Joint: ("damping",),
    Stage: ("errors", "gear_mesh"),
    Bearing: ("damping", "elements", "journal", "mean_diameter", "rollers"),
    Shaft: ("flexible", "elements_per_section"),
    GearMember: ("body_factor",),
    GearRating: _all_but(
        GearRating, "steel", "grade", "accuracy_grade",
        *(row.field for row in (*table.GEAR_STRENGTH, *table.GEAR_SURFACE)),
    ),
    FlankModifications: _all_but(FlankModifications, *table.KEYS),
    Rating: _all_but(
        Rating, "gear_meshes", "application_factor", *(row.field for row in table.LOAD_FACTORS)
    ),
    RatedGearMesh: ("face_width",),
}  # fmt: skip
_OF_FE_BODIES = ("fe", "hub", "bearing_drive", "bearing_far")


def not_written(case: Case) -> list[str]:
    """Descriptions of the parts of a case that its REXS model does not contain."""
    unwritten = [f"loads on {load.member}" for load in case.loads if not _is_written(load)]
    states = [state for c in case.load_cases for _, _, state in c.states("")]
    if any(s.frame != "fixed" and (s.force or s.moment) for s in states):
        unwritten.append("loads of load_cases in rotating frames")
    for path, section in _written_sections("", case):
        unwritten += [f"{path}{key}" for key in _unwritten_keys(section) if _is_set(section, key)]
        if isinstance(section, Bearing) and section.thrust is not None:
            unwritten.append(f"{path}thrust" + (": static factors" if thrust_out(section) else ""))
        elif isinstance(section, LumpedInertia) and (section.inertia or section.equivalent_mass):
            unwritten.append(f"{path[:-1]}: its moment of inertia")
        elif isinstance(section, Stage) and "fe" in map(section.form, (*section.members, "planet")):
            unwritten.append(f"{path[:-1]}: FE bodies, bearings of an FE carrier")
    return unwritten


def _written_sections(path: str, section: Section) -> Iterator[tuple[str, Section]]:
    """Pairs of the path of keys and the section, for a section of a case and all sections nested
    in it that REXS can hold."""
    yield path, section
    for key in _all_but(type(section), *_unwritten_keys(section), *_OF_FE_BODIES):
        parts = getattr(section, key)
        for k, part in enumerate(parts if isinstance(parts, tuple) else (parts,)):
            place = part.name if isinstance(part, Stage) else k
            which = f".{place}" if isinstance(parts, tuple) else ""
            if isinstance(part, Section):
                yield from _written_sections(f"{path}{key}{which}.", part)


def _unwritten_keys(section: Section) -> list[str]:
    """Keys of a section that REXS does not hold, whether they are set or not."""
    keys = [k for kind, keys in _UNWRITTEN.items() if isinstance(section, kind) for k in keys]
    return [key for key in keys if key in type(section).model_fields]


def _is_set(section: Section, key: str) -> bool:
    """Whether a section has a key with a value other than the default."""
    default = type(section).model_fields[key].get_default(call_default_factory=True)
    return bool(getattr(section, key) != default)


class BinResults(NamedTuple):
    """Results of load bins other than speeds and torques.

    gears: attributes by gear meshes of one half and gear, "" for theirs; bearings: attributes by
    bearing. Each attribute has one value for each bin (B,), not finite if there is no result.
    """

    bins: Sequence[LoadBin]
    gears: Mapping[tuple[GroupName, str], Mapping[str, Array]]
    bearings: Mapping[str, Mapping[str, Array]]


def model_of_case(case: Case, rated: BinResults | None = None) -> Outgoing:
    """The REXS model of a case with its load cases, or with the bins and results of a rating.
    Raises InputError for a train whose speeds are not determined."""
    train = TrainOut(case=case, flow=power_flow(case), places=places(case))
    origin = located((0.0, 0.0, 0.0))
    train.unit = train.add("gear_unit", case.title or case.name, **origin, **_gravity(case))
    train.casing = train.part(train.unit, "gear_casing", "casing", **_oil_temperature(case))
    if case.lubricant is not None:
        oil = train.add("lubricant", "oil", **table.written(case.lubricant, table.VISCOSITIES))
        train.relate("reference", origin=train.casing, referenced=oil)
    for stage in case.stages:
        StageOut(train, stage).add()
    for joint in case.joints:
        _add_joint(train, joint)
    ports = {port.member: _add_port(train, port) for port in case.ports}
    if ports:
        torque = {} if case.output is None else train.flow.torque
        _add_state(train, ports, LoadBin("", 0.0, torque, train.flow.speed, case.loads))
    bins = bins_of_load_cases(case) if rated is None else rated.bins
    of_bins = [load for load_bin in bins for load in load_bin.loads]
    loaded = dict.fromkeys(load.member for load in (*case.loads, *of_bins) if _is_written(load))
    forces = {member: _add_forces(train, member) for member in loaded}
    for b, load_bin in enumerate(bins):
        train.load_cases.append((load_bin.name, {}))
        train.result(train.unit, operating_time=HOUR * load_bin.hours)
        _add_state(train, ports, load_bin)
        for member, number in forces.items():
            force = _force_attributes(load_bin.loads, member)
            if force != _force_attributes(case.loads, member):
                train.result(number, **force)
        for number, attributes in _results(train, rated) if rated else ():
            values = {name: float(by_bin[b]) for name, by_bin in attributes.items()}
            train.result(number, **{name: x for name, x in values.items() if math.isfinite(x)})
    return train


def _results(train: TrainOut, rated: BinResults) -> Iterator[tuple[int, Mapping[str, Array]]]:
    """Ids of components and their results by bin. Concept bearings are left out, since REXS has no
    attributes for their rating, and bearings that are not written."""
    for key, attributes in rated.gears.items():
        yield from ((number, attributes) for number in train.gear_data[key])
    for name, attributes in rated.bearings.items():
        for number in train.bearings.get(name, ()):
            if train.components[number - 1][0] != "concept_bearing":
                yield number, attributes


def _oil_temperature(case: Case) -> dict[str, Written | None]:
    """Attribute of the casing, in °C, the unit of the schema, which has another zero than SI."""
    kelvin = None if case.lubricant is None else case.lubricant.temperature
    if kelvin is None:
        return {}
    celsius = Quantity("temperature").from_si(kelvin, table.OIL.suffix)
    return {table.OIL.names[0]: table.without_rounding(celsius)}


def _gravity(case: Case) -> dict[str, Written | None]:
    size = math.sqrt(sum(g * g for g in case.gravity))
    if not size:
        return {"account_for_gravity": False}
    along = {name: g / size for name, g in zip(table.GRAVITY, case.gravity, strict=True)}
    return {"account_for_gravity": True, **along, "gravitational_acceleration": size}


def _add_joint(train: TrainOut, joint: Joint) -> None:
    name = f"{joint.first} – {joint.second}"
    first, second = train.end(joint.first), train.end(joint.second)
    if joint.length is not None and joint.outer_diameter is not None:
        shaft = train.part(train.unit, "shaft", name, **located(train.places[joint.first]))
        sizes = table.written(joint, table.SHAFT_SECTION)
        train.part(shaft, "shaft_section", u_coordinate_on_shaft=0.0, **sizes)
        train.side("coupling", first, shaft, name, u_coordinate_on_shaft_outer_side=0.0)
        train.side("coupling", shaft, second, name, u_coordinate_on_shaft_inner_side=joint.length)
        return
    at = MemberName.parse(joint.first)
    torsion = torsion_out(joint, stage_radii(train.case.view(at.stage)), at.part)
    springs = springs_out(joint, 1.0)
    train.side("coupling", first, second, name, rotational_stiffness=torsion, **springs)


def _add_port(train: TrainOut, port: Input | Output) -> int:
    """Add the external load at a port; returns its id."""
    shaft = train.end(port.member)
    number = train.part(
        shaft,
        "external_load",
        port.member,
        u_coordinate_on_shaft=0.0,
        transmits_torque=True,
        defines_torque=port.given_torque is not None,
    )
    if port.inertia or port.mass is not None:
        body = table.written(port, table.PORT_BODY)
        train.part(shaft, "additional_mass", u_coordinate_on_shaft=0.0, **body)
    return number


def _add_forces(train: TrainOut, member: str) -> int:
    """Add an external load with the forces of the case on a member; returns its id."""
    begins_here = member in train.ends  # the shaft behind a spline
    at = 0.0 if begins_here else train.places[member][0] - train.begins[member]
    return train.part(
        train.end(member),
        "external_load",
        f"force on {member}",
        u_coordinate_on_shaft=at,
        transmits_torque=False,
        **_force_attributes(train.case.loads, member),
    )


def _add_state(train: TrainOut, ports: dict[str, int], state: LoadBin) -> None:
    """Add speeds of members, torques and powers of ports, and stated load factors to the last load
    case. ports: ids by member. Torques of the state are empty for a case without loads."""
    for member, value in state.speed.items():
        train.result(train.shafts[member], rotational_speed=value)
    for member, number in ports.items() if state.torque else ():
        power = state.torque[member] * state.speed[member] + 0.0  # no −0
        train.result(number, torque_around_u_axis=state.torque[member], power=power)
    rules = train.case.rating.in_load_case(state.factors, state.extreme)
    rows = [table.APPLICATION_FACTOR, *table.LOAD_FACTORS][not state.factors :]
    for (group, gear), numbers in train.gear_data.items():
        forced, older = rules.forced(group.stage, group.role), rules.edition == 2006
        factors = {} if gear else table.written(forced, rows, at=older)
        for number in numbers if factors else ():
            train.result(number, **factors)


def _is_written(load: MemberLoad) -> bool:
    """Whether REXS can hold a load, which must be constant, in fixed axes and without torque."""
    return not load.is_history and load.frame == "fixed" and load.moment[2] == 0


def _force_attributes(loads: Iterable[MemberLoad], member: str) -> dict[str, float]:
    """Attributes of the sum of those loads on a member that REXS can hold: forces along x, y, z and
    moments about x and y; N, N m."""
    of_member = [load.first for load in loads if load.member == member and _is_written(load)]
    total = np.sum([np.zeros(6), *of_member], axis=0)
    return dict(zip((*table.FORCES, *table.MOMENTS), total.tolist(), strict=False))


def places(case: Case) -> dict[str, Place]:
    """Position (u, v, w) of each member, m: stages side by side along u, joined members coaxial."""
    neighbours: dict[str, list[tuple[str, complex]]] = defaultdict(list)  # offsets v + i w
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
        stack: list[tuple[str, complex]] = [(start, 0j)]
        while stack:
            member, at = stack.pop()
            if member not in across:
                across[member] = at
                stack += [(other, at + step) for other, step in neighbours[member]]
    positions, u = {}, 0.0
    for stage in case.stages:
        for part in stage.members:
            name = f"{stage.name}.{part}"
            positions[name] = (u + stage.gear_width / 2, across[name].real, across[name].imag)
        u += 2 * stage.gear_width
    return positions
