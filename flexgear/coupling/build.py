"""From a case to one ``System``: its stages member by member, and the joints between them.

What cannot work is said before any work: every command asks ``require_workable`` first. Nothing is
checked there that the work itself does not check: the coupled system is built from the same code on
rigid rings and carriers, whose rigid motions are those of the finite-element bodies.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping

import numpy as np
from numpy.typing import NDArray

from flexgear.coupling.assembly import (
    Assembly,
    TrainAssembly,
    connect,
    end_rows,
    ends_of,
    rotation,
    speed_row,
)
from flexgear.coupling.connections import (
    GearBlock,
    GearBlocks,
    connections,
    spline_matrix,
    stage_sets,
)
from flexgear.coupling.determinacy import (
    free_motions,
    holding_rows,
    require_masses,
    rolling_motions,
    vibration_motions,
)
from flexgear.coupling.gear_meshes import labels, pair_data
from flexgear.coupling.loads import frame_forces, given_loads
from flexgear.coupling.members import AnyBody, reference_radius, stage_members
from flexgear.coupling.port_machines import (
    machine_words,
    port_machines,
    require_free_speeds,
)
from flexgear.coupling.springs import behind_spline
from flexgear.coupling.system import (
    Damping,
    Port,
    StageFrame,
    System,
    orthonormal_rigid,
    variant_label,
    without_rigid_forces,
)
from flexgear.gears.error_cycle import longest_time_step
from flexgear.gears.geometry import stage_geometry
from flexgear.gears.paths import require_assembly, stage_paths
from flexgear.gears.power_flow import power_flow
from flexgear.gears.radii import stage_radii
from flexgear.model.case import Case
from flexgear.model.errors import InputError
from flexgear.model.names import MOUNT, BodyName, MemberName, NodeName
from flexgear.model.stage_view import StageView, inside
from flexgear.model.train import Joint
from flexgear.structures.bodies import Body, lumped_body
from flexgear.structures.reduced import ReducedBody
from flexgear.structures.shaft import BeamSection, beam_element
from flexgear.structures.sources.of_case import fe_sources
from flexgear.structures.tooth_shapes import RimFlexibility

Array = NDArray[np.float64]


def build_system(
    case: Case,
    bodies: Mapping[BodyName, AnyBody] | None = None,
    rigid: Collection[BodyName] = (),
    stiffening: Mapping[BodyName, float] | None = None,
    bending: bool = True,
) -> System:
    """Couple all bodies of a case.

    bodies: reduced FE bodies; rigid: which of the bodies that may bend do not, those that are not
    in ``bodies`` by the case's sizes; stiffening: factors on the elastic stiffness of bodies, for
    limit studies; bending: see ``stage_sets``. Raises InputError where the case has no single rated
    state or a body is loose.
    """
    flow, bodies = power_flow(case), bodies or {}
    members = [stage_members(case, s, bodies, rigid, stiffening) for s in case.stages]
    assembly = Assembly([*(m.body for s in members for m in s), *_housing(case)], case.source)
    b = TrainAssembly(case, flow, assembly, members, bending)
    for number in range(len(case.stages)):
        b.frames.append(_frame(b, number))
    rims = _rims(bodies, rigid, stiffening or {})
    for number in range(len(case.stages)):
        _tie_and_mesh(b, number, rims)
    for joint in case.joints:
        _join(b, joint)
    for port in case.ports:
        if not any(body.part == "output" for body in ends_of(b, port.member)):  # has its own
            b.a.add_inertia(rotation(b, port.member), case.port_inertia(port.member))
    if b.a.has("housing"):
        _mount_housing(b)
    return _system(b, rigid)


def _housing(case: Case) -> list[Body]:
    """Body of the housing; none where it is rigid ground."""
    housing = case.housing
    if housing.kind == "lumped":
        return [lumped_body(BodyName.of("", "housing"), housing.mass, housing.inertia)]
    if housing.kind == "reduced":
        from flexgear.structures.sources.matrices import given_housing  # readers of matrices

        return [given_housing(housing, case.source)]
    return []


def _mount_housing(b: TrainAssembly) -> None:
    """Springs between the housing and the ground, at each node of an FE housing that has some."""
    matrix, body = b.case.housing.mount.matrix, b.a.body("housing")
    nodes = [name for name in body.node_names if NodeName.parse(name).kind == MOUNT]
    for node in nodes or ["housing"]:
        b.a.link(f"housing_{node if nodes else 'mount'}", b.a.rows("housing", node), matrix)


def _frame(b: TrainAssembly, number: int) -> StageFrame:
    """Angles of a stage, see ``StageFrame``.

    A carrier's is that of an FE carrier's pins, where its planets are; a ring's that of the hub
    that its supports stand on, as those of a held ring stand in the housing: what either ring winds
    up against them is elastic displacement.
    """
    stage, held = b.case.stages[number], b.case.held_members()
    if stage.kind == "parallel":
        return StageFrame(b.angle(rotation(b, f"{stage.name}.gear")), -1)
    carrier, ring = f"{stage.name}.carrier", f"{stage.name}.ring"
    turns = np.zeros(b.a.size)
    if carrier not in held:
        several = len(b.a.body(carrier).node_names) > 1
        turns = _pin_rotation(b, number) if several else rotation(b, carrier)
    ring_turns = np.zeros(b.a.size) if ring in held else rotation(b, ring)
    theta = b.angle(turns - ring_turns)
    of_carrier, of_ring = (b.angle(row) if row.any() else -1 for row in (turns, ring_turns))
    planets = -1
    if any(m.floats for m in b.members[number]):
        radii = stage_radii(b.case.view(stage.name))
        planets = b.angle(-radii.ring / radii.planet * (turns - ring_turns))
    return StageFrame(theta, of_carrier, of_ring, planets)


def _pin_rotation(b: TrainAssembly, number: int) -> Array:
    """Row (d,) of the mean rotation of the pins about the axis, rad."""
    view = b.case.view(b.case.stages[number].name)
    pins = [f"pin_{k}" for k in range(1, view.stage.planets + 1)]
    tangential = [b.rows(f"{view.name}.carrier", pin)[1] for pin in pins]
    return np.asarray(np.mean(tangential, axis=0) / stage_radii(view).center_distance)


def _rims(
    bodies: Mapping[BodyName, AnyBody],
    rigid: Collection[BodyName],
    stiffening: Mapping[BodyName, float],
) -> dict[str, RimFlexibility]:
    """What teeth of FE rings that bend yield along the face, by the stages where it counts."""
    return {
        name.stage: body.rim.softer(1.0 / stiffening.get(name, 1.0))
        for name, body in bodies.items()
        if isinstance(body, ReducedBody) and body.rim is not None and name not in rigid
    }


def _tie_and_mesh(b: TrainAssembly, number: int, rims: Mapping[str, RimFlexibility]) -> None:
    stage, frame = b.case.stages[number], b.frames[number]
    with inside(b.case, stage):
        for connection in connections(b.case.view(stage.name)):
            connect(b, number, connection)
    blocks = _gear_blocks(b, number)
    flexible = {m.part for m in b.members[number] if m.contacts and not m.body.rigid}
    view = b.case.view(stage.name)
    gears = {m.part for m in b.members[number] if m.part in ("ring", "planet")}
    rigid = [part for part in gears - flexible if view.fe_tie(part)]
    flow, rim = b.flow.stage(stage.name), rims.get(stage.name)
    b.sets += stage_sets(b.case, number, flow, frame, blocks, b.bending, rim, rigid)


def _gear_blocks(b: TrainAssembly, number: int) -> GearBlocks:
    """Enter the contacts of a stage's bodies as blocks; teeth of a body of two halves are those of
    the left, then of the right."""
    blocks: dict[tuple[str, int, str], GearBlock] = {}
    for m in b.members[number]:
        nodes, first = m.contacts, len(b.blocks)
        if not nodes:
            continue
        b.block_of[m.body.name] = first
        b.blocks += [b.a.rows(m.body.name, node) for node in nodes]
        if len(nodes) == 1:
            blocks[m.part, m.planet, m.side] = GearBlock(first)
            continue
        rigid = first if m.floats else None
        nodes = nodes[1:] if m.floats else nodes
        first += int(m.floats)
        places = np.array([m.body.position(node) for node in nodes])
        for k, side in enumerate(sides := b.case.stages[number].sides):
            half = slice(k * len(nodes) // len(sides), (k + 1) * len(nodes) // len(sides))
            blocks[m.part, m.planet, side] = GearBlock(first + half.start, places[half], rigid)
    return GearBlocks(blocks)


def _join(b: TrainAssembly, joint: Joint) -> None:
    """A spline or shaft between two members."""
    if joint.length is not None and joint.outer_diameter is not None:
        section = BeamSection(joint.length, joint.outer_diameter, joint.inner_diameter)
        m = b.case.material
        matrix, _ = beam_element(section, joint.length, m.young_modulus, m.poisson_ratio, m.density)
    else:
        spring = np.array(joint.matrix, dtype=float)
        spring[5, 5] += joint.tangential * _radius(b, joint.first) ** 2
        matrix = np.block([[spring, -spring], [-spring, spring]])
    ends, angles = [], []
    for end, member in enumerate((joint.first, joint.second)):
        first, *_ = b.bodies_of(member)
        if {"spline", "end"} <= first.ports.keys():  # nothing hangs between spline and joint
            matrix = behind_spline(matrix, spline_matrix(b.case.view(first.body.name.stage)), end)
        ends.append(end_rows(b, member))
        angles.append(b.body_angle(b.case.stage_index(member), first))
    name = f"{joint.first}-{joint.second}"
    b.a.joint(name, ends[0], ends[1], matrix, (angles[0], angles[1]))


def _radius(b: TrainAssembly, member: str) -> float:
    """Centre distance of a carrier, base radius of a gear, m."""
    at = MemberName.parse(member)
    view = b.case.view(at.stage)
    return reference_radius(view.stage, at.part, stage_radii(view))


def _system(b: TrainAssembly, rigid_bodies: Collection[BodyName]) -> System:
    a, case, flow = b.a, b.case, b.flow
    require_masses(a.bodies, case.source, a.mass)
    loads = given_loads(b)
    extra = a.extra_rows(len(b.blocks), loads)
    blocks = np.vstack([*b.blocks, *a.contact_nodes])
    pairs = pair_data(b.sets, len(blocks) // 6, extra)
    rigid = orthonormal_rigid(a.mass, _loose_motions(b))
    angles = np.vstack(b.angles)
    contact = holding_rows(pairs, blocks, len(angles), a.bearing_rows())
    rolling, input_rows, speeds = _rolling(b, rigid, contact)
    gyroscopic, centripetal = frame_forces(b, rolling, input_rows)
    rotations = np.array([rotation(b, p.member) for p in case.ports]).reshape(-1, a.size)
    require_free_speeds(case, rotations @ rolling)
    d, modal = case.damping, case.damping.kind == "modal"
    lead = case.inputs[0].member if case.inputs else ""
    inertias = {f"{p.member}_inertia_kg_m2": case.port_inertia(p.member) for p in case.ports}
    return System(
        variant=variant_label(case.flexible_bodies, rigid_bodies),
        rigid_bodies=frozenset(rigid_bodies),
        bodies=tuple(a.bodies),
        mass=a.mass,
        stiffness=without_rigid_forces(a.stiffness, a.mass, rigid),
        rigid=rigid,
        rolling=rolling,
        input_rows=input_rows,
        angles=angles,
        blocks=blocks,
        ports=tuple(
            Port(
                p.member,
                row,
                flow.torque[p.member],
                reaction=p.given_torque is None,
            )
            for p, row in zip(case.ports, rotations, strict=True)
        ),
        pairs=pairs,
        gear_meshes=labels(b.sets),
        links=tuple(a.links),
        bearings=tuple(a.bearings),
        frames=dict(zip([s.name for s in case.stages], b.frames, strict=True)),
        ring_frames={
            m.body.name: b.body_angle(number, m)
            for number, members in enumerate(b.members)
            for m in members
            if m.frame == "ring" and not m.lumped
        },
        rotating_frame_supports=tuple(a.rotating_frame_supports),
        support_names=tuple(a.support_names),
        damping=Damping(
            d.ratio if modal else 0.0, 0.0 if modal else d.alpha, 0.0 if modal else d.beta
        ),
        machines=port_machines(case, flow),
        rated_torque=flow.torque.get(lead, 0.0),
        rated_speed=flow.speed.get(lead, 0.0),
        input_speeds=speeds,
        planets=max(s.planets for s in case.stages),
        gyroscopic=gyroscopic,
        centripetal=centripetal,
        header={**machine_words(case), **inertias},
    )


def _loose_motions(b: TrainAssembly) -> Array:
    """Motions (d, r) that no constant spring resists.

    Those of a single stage with bodies that bend are known in closed form and have no round-off:
    planets orbit with the carrier, each planet spins, the ring turns with its hub, the sun with
    what hangs on it. There are others where members float without a spring.
    """
    loose, stage = b.a.loose_motions(), b.case.stages[0]
    if len(b.case.stages) > 1 or b.case.joints or not stage.is_flexible:
        return loose
    held, planets = b.case.held_members(), b.bodies_of(f"{stage.name}.planet")
    rigid_motions = [b.a.rotation(m.body.name) for m in planets]
    for part in ("carrier", "ring", "sun"):
        member = MemberName.of(stage.name, part)
        motion = np.sum([b.a.rotation(m.body.name) for m in b.bodies_of(member)], axis=0)
        for m in planets if part == "carrier" else ():
            motion[b.a.starts[m.body.name] + 1] = stage_radii(b.case.view()).center_distance
        if member not in held:
            rigid_motions.append(motion)
    candidates = np.column_stack(rigid_motions)
    return candidates if loose.shape == candidates.shape else loose


def _rolling(
    b: TrainAssembly, rigid: Array, contact: Array
) -> tuple[Array, Array, tuple[float, ...]]:
    """Rolling (d, F) of the train, rows (F, d) of its independent rotations, their rated speeds.

    In free vibration supports may resist rotations, or members float: what is left free has no
    speed of its own, unless it is the rotations that the inputs give.
    """
    driven = [p.member for p in b.case.ports if p.speed is not None]
    free = free_motions(rigid, contact).shape[1]
    if b.case.output is None and (not driven or free != len(driven)):
        return *vibration_motions(b.a.mass, rigid, contact), ()
    input_rows = np.array([speed_row(b, m) for m in driven]).reshape(-1, b.a.size)
    rolling = rolling_motions(b.a.bodies, b.a.source, rigid, contact, input_rows)
    return rolling, input_rows, tuple(b.flow.speed[m] for m in driven)


def require_workable(case: Case) -> None:
    """InputError, with the key and what to do, for a case that no analysis could be made of."""
    flow = power_flow(case)
    _require_steps(case, max(stage.gear_mesh_frequency for stage in flow.stages))
    for stage in case.stages:
        if not stage.is_flexible:
            forces = flow.stage(stage.name).gear_mesh_forces
            stage_paths(case.view(stage.name), forces)
            continue
        with inside(case, stage):
            _require_stage(case.view(stage.name))
    for stage in case.stages:
        _require_influences(case.view(stage.name))
    rigid_system(case)


def rigid_system(case: Case) -> System:
    """The coupled train with its flexible bodies made rigid by the case's sizes."""
    bodies: dict[BodyName, Body] = {}
    for stage in case.stages:
        if stage.is_flexible:
            with inside(case, stage):
                view = case.view(stage.name)
                for name, source in fe_sources(view).items():
                    bodies[name] = source.rigid(from_files=False)
    return build_system(case, bodies, case.flexible_bodies, bending=False)


def _require_steps(case: Case, frequency: float) -> None:
    """Time steps see every tooth pair of the fastest gear mesh (Hz) come and go."""
    longest, period = longest_time_step(frequency), 1 / frequency if frequency else math.inf
    steps = case.solver.step_tolerance == 0.0
    for key in ["time_step", "step_time_step"] if steps else ["longest_time_step"]:
        step = getattr(case.solver, key)
        if step is not None and step > longest:
            raise InputError(
                case.source,
                f"solver.{key}_s",
                f"a step of {step:.3g} s is too long for a gear-mesh period of {period:.3g} s",
                f"at most {longest:.3g} s; ten times less shows what the gear mesh excites",
            )


def _require_stage(view: StageView) -> None:
    """Gears mesh and assemble; FE meshes can be made, or their files are there and in place."""
    require_assembly(view, stage_geometry(view))
    for source in fe_sources(view).values():
        source.check()


def _require_influences(view: StageView) -> None:
    if "fe" in (view.gear_mesh.tooth_compliance, view.gear_mesh.root_stress):
        from flexgear.structures.tooth_influence import require_influences  # half of the package

        require_influences(view)
