"""From a case to one ``System``: lumped stages, flexible stages and the joints between them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from flexgear.coupling.assembly import Assembly
from flexgear.coupling.determinacy import (
    free_motions,
    holding_rows,
    rolling_motions,
    vibration_motions,
)
from flexgear.coupling.gear_meshes import labels, pair_data
from flexgear.coupling.links import behind_spline
from flexgear.coupling.loads import frame_forces, given_loads
from flexgear.coupling.lumped_bodies import LumpedMember, lumped_members
from flexgear.coupling.lumped_stage import StageFrame, lumped_sets, tie_lumped_stage
from flexgear.coupling.port_machines import (
    machine_words,
    port_machines,
    require_free_speeds,
)
from flexgear.coupling.stage_parts import (
    Stiffening,
    pin_rotation,
    spline_matrix,
    stage_components,
    stage_nodes,
    stage_sets,
    tie_stage,
)
from flexgear.coupling.system import (
    Damping,
    Port,
    System,
    Variant,
    orthonormal_rigid,
    without_rigid_forces,
)
from flexgear.coupling.under_way import UnderWay, end_of, rotation, speed_row
from flexgear.gears.geometry import stage_geometry
from flexgear.gears.power_flow import power_flow
from flexgear.gears.radii import stage_radii
from flexgear.model.case import Case
from flexgear.model.errors import FlexgearError, InputError
from flexgear.model.joint import Joint
from flexgear.model.stage_view import inside, spoken
from flexgear.structures.bodies import Body, lumped_body
from flexgear.structures.reduced import ReducedBody
from flexgear.structures.shaft import BeamSection, beam_element

Array = NDArray[np.float64]
Reduced = tuple[ReducedBody, ReducedBody]  # ring, carrier


def build_system(
    train: Case,
    flexible: Mapping[str, Reduced] | None = None,
    variants: Mapping[str, Variant] | None = None,
    stiffening: Stiffening | None = None,
) -> System:
    """Couple all bodies of a case.

    flexible: by name of a flexible stage its reduced ring and carrier (also used, as rigid bodies
    with the same mass, by rigid variants); variants: which of its components bend; stiffening: of
    those of all flexible stages. Raises InputError where the case has no single rated state or a
    body is loose.
    """
    with spoken(train):
        return _coupled(train, flexible or {}, variants or {}, stiffening)


def _coupled(
    train: Case,
    flexible: Mapping[str, Reduced],
    variants: Mapping[str, Variant],
    stiffening: Stiffening | None,
) -> System:
    flow = power_flow(train)
    bodies, members = _bodies(train, flexible, variants, stiffening)
    b = UnderWay(train, flow, Assembly(bodies, train.source), members)
    for number in range(len(train.stages)):
        b.frames.append(_frame(b, number))
    for number in range(len(train.stages)):
        _tie_and_mesh(b, number)
    for joint in train.joints:
        _join(b, joint)
    behind_splines = {f"{s.name}.sun" for s in train.stages if s.is_flexible}
    for port in train.ports:
        if port.member not in behind_splines:  # there it is that of the body "output"
            b.a.add_inertia(rotation(b, port.member), train.port_inertia(port.member))
    if b.a.has("housing"):
        mount = np.diag(train.housing.stiffness)
        b.a.link("housing_mount", b.a.rows("housing", "housing"), mount)
    return _system(b, variants)


def _bodies(
    train: Case,
    flexible: Mapping[str, Reduced],
    variants: Mapping[str, Variant],
    stiffening: Stiffening | None,
) -> tuple[list[Body], list[list[LumpedMember]]]:
    bodies: list[Body] = []
    members: list[list[LumpedMember]] = []
    for stage in train.stages:
        if not stage.is_flexible:
            members.append(lumped_members(train, stage))
            bodies += [m.body for m in members[-1]]
            continue
        if stage.name not in flexible:
            raise FlexgearError(f"the reduced ring and carrier of stage {stage.name} are missing")
        view = train.view(stage.name)
        parts = stage_components(
            view, stage_geometry(view), *flexible[stage.name],
            variants.get(stage.name, Variant()), stiffening,
            port=train.port_at(f"{stage.name}.sun"),
        )  # fmt: skip
        bodies += [replace(p, name=f"{stage.name}.{p.name}") for p in parts]
        members.append([])
    if train.housing.kind == "lumped":
        bodies.append(lumped_body("housing", train.housing.mass, train.housing.inertia))
    return bodies, members


def _frame(b: UnderWay, number: int) -> StageFrame:
    """Angles of a stage: θ = φ_carrier − φ_ring, or the gear's of a parallel stage."""
    stage, held = b.train.stages[number], b.train.held_members()
    if stage.kind == "parallel":
        return StageFrame(b.angle(rotation(b, f"{stage.name}.gear")), -1)
    if stage.is_flexible:
        view = b.train.view(stage.name)
        radius = stage_radii(view).center_distance
        pins = pin_rotation(b.a, view, radius, f"{stage.name}.")
        return StageFrame(b.angle(pins), b.angle(pins))
    carrier, ring = f"{stage.name}.carrier", f"{stage.name}.ring"
    turns = np.zeros(b.a.size) if carrier in held else rotation(b, carrier)
    relative = turns if ring in held else turns - rotation(b, ring)
    return StageFrame(b.angle(relative), b.angle(turns) if turns.any() else -1)


def _tie_and_mesh(b: UnderWay, number: int) -> None:
    stage, frame, first = b.train.stages[number], b.frames[number], len(b.blocks)
    if stage.is_flexible:
        at, case = f"{stage.name}.", b.train.view(stage.name)
        with inside(b.train, stage):
            tie_stage(b.a, case, at, frame.carrier)
        nodes, teeth = stage_nodes(b.a, case, at)
        b.blocks += nodes
        b.sets += stage_sets(
            case, b.flow.stage(stage.name), tooth_positions=teeth,
            first_block=first, stage=number, angle=frame.theta,
        )  # fmt: skip
        return
    members = b.members[number]
    tie_lumped_stage(b.a, stage, members, frame)
    b.blocks += [b.a.rows(m.body.name, m.body.name) for m in members]
    flow = b.flow.stage(stage.name)
    b.sets += lumped_sets(b.train, number, members, flow, frame, first)


def _join(b: UnderWay, joint: Joint) -> None:
    """A spline or shaft between two members."""
    if joint.length is not None and joint.outer_diameter is not None:
        section = BeamSection(joint.length, joint.outer_diameter, joint.inner_diameter)
        m = b.train.material
        matrix, _ = beam_element(section, joint.length, m.young_modulus, m.poisson_ratio, m.density)
    else:
        spring = np.array(joint.matrix, dtype=float)
        spring[5, 5] += joint.tangential * _radius(b, joint.first) ** 2
        matrix = np.block([[spring, -spring], [-spring, spring]])
    ends, angles = [], []
    for end, member in enumerate((joint.first, joint.second)):
        name, _, part = member.partition(".")
        beam = b.train.stage(name).form(part) == "beam"
        if beam and not b.a.has(f"{name}.output"):
            matrix = behind_spline(matrix, spline_matrix(b.train.view(name)), end)
        number = b.train.stage_index(name)
        rows = np.zeros((6, b.a.size))
        for body, node, share in _joint_nodes(b, name, part):
            rows += share * b.a.rows(body, node)
        ends.append(rows)
        angles.append(b.frames[number].carrier)
    name = f"{joint.first}-{joint.second}"
    b.a.joint(name, ends[0], ends[1], matrix, (angles[0], angles[1]))


def _joint_nodes(b: UnderWay, name: str, part: str) -> list[tuple[str, str, float]]:
    """Bodies and nodes that move a member at its joint, with their share."""
    stage, member = b.train.stage(name), f"{name}.{part}"
    if not stage.is_flexible:
        if part == "ring" and stage.double_helical:
            return [(f"{member}_{side}", f"{member}_{side}", 0.5) for side in ("left", "right")]
        return [(member, member, 1.0)]
    if part != "ring":
        return [(*end_of(b, name, part), 1.0)]
    raise InputError(
        b.train.source, f"joints: {member}", "is the flexible ring, which is bolted to the housing",
        "join the carrier or the sun",
    )  # fmt: skip


def _radius(b: UnderWay, member: str) -> float:
    """Centre distance of a carrier, base radius of a gear, m."""
    name, _, part = member.partition(".")
    stage = b.train.stage(name)
    radii = stage_radii(b.train.view(stage.name))
    slot = {"pinion": "sun", "gear": "planet", "carrier": "center_distance"}.get(part, part)
    return float(getattr(radii, slot))


def _system(b: UnderWay, variants: Mapping[str, Variant]) -> System:
    a, train, flow = b.a, b.train, b.flow
    loads = given_loads(b)
    extra = a.extra_rows(len(b.blocks), loads)
    blocks = np.vstack([*b.blocks, *a.contact_nodes])
    pairs = pair_data(b.sets, len(blocks) // 6, extra)
    rigid = orthonormal_rigid(a.mass, _loose_motions(b))
    angles = np.vstack(b.angles)
    contact = holding_rows(pairs, blocks, len(angles), a.bearing_rows())
    rolling, masters, speeds = _rolling(b, rigid, contact)
    gyroscopic, centripetal = frame_forces(b, rolling, masters)
    rotations = np.array([rotation(b, p.member) for p in train.ports]).reshape(-1, a.size)
    require_free_speeds(train, rotations @ rolling)
    d, modal = train.damping, train.damping.kind == "modal"
    lead = train.inputs[0].member if train.inputs else ""
    inertias = {f"{p.member}_inertia_kg_m2": train.port_inertia(p.member) for p in train.ports}
    return System(
        variants={name: variants.get(name, Variant()) for name in train.flexible_stages},
        bodies=tuple(a.bodies),
        mass=a.mass,
        stiffness=without_rigid_forces(a.stiffness, a.mass, rigid),
        rigid=rigid,
        rolling=rolling,
        masters=masters,
        angles=angles,
        blocks=blocks,
        ports=tuple(
            Port(
                p.member,
                row,
                flow.torque[p.member],
                reaction=p.given_torque is None,
            )
            for p, row in zip(train.ports, rotations, strict=True)
        ),
        pairs=pairs,
        gear_meshes=labels(b.sets),
        links=tuple(a.links),
        bearings=tuple(a.bearings),
        turning=tuple(a.turning),
        damping=Damping(
            d.ratio if modal else 0.0, 0.0 if modal else d.alpha, 0.0 if modal else d.beta
        ),
        machines=port_machines(train, flow),
        rated_torque=flow.torque.get(lead, 0.0),
        rated_speed=flow.speed.get(lead, 0.0),
        master_speeds=speeds,
        planets=max(s.planets for s in train.stages),
        gyroscopic=gyroscopic,
        centripetal=centripetal,
        header={**machine_words(train), **inertias},
    )


def _loose_motions(b: UnderWay) -> Array:
    """Motions (d, r) that no constant spring resists.

    Those of a flexible stage alone are known in closed form and have no round-off: planets orbit
    with the carrier, each planet spins, the sun turns with its output. There are more where the sun
    floats without a spring.
    """
    loose, stage = b.a.loose_motions(), b.train.stages[0]
    if not b.train.is_short:
        return loose
    orbit, spins = b.a.rotation("stage.carrier"), []
    for i in range(stage.planets):
        planet = f"stage.planet_{i + 1}"
        orbit[b.a.starts[planet] + 1] = stage_radii(b.train.view()).center_distance
        spins.append(b.a.rotation(planet))
    turning = b.a.rotation("stage.shaft") + b.a.rotation("stage.output")
    known = np.column_stack([orbit, *spins, turning])
    return known if loose.shape == known.shape else loose


def _rolling(b: UnderWay, rigid: Array, contact: Array) -> tuple[Array, Array, tuple[float, ...]]:
    """Rolling (d, F) of the train, rows (F, d) of its independent rotations, their rated speeds.

    In free vibration supports may resist rotations, or members float: what is left free has no
    speed of its own, unless it is the rotations that the inputs give.
    """
    given = [p.member for p in b.train.ports if p.speed is not None]
    free = free_motions(rigid, contact).shape[1]
    if b.train.output is None and (not given or free != len(given)):
        return *vibration_motions(b.a.mass, rigid, contact), ()
    masters = np.array([speed_row(b, m) for m in given]).reshape(-1, b.a.size)
    rolling = rolling_motions(b.a.bodies, b.a.source, rigid, contact, masters)
    return rolling, masters, tuple(b.flow.speed[m] for m in given)
