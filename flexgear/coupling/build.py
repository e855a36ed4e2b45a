"""Assembly of a case into one ``System``: stages member by member, and joints between them.

Every command first calls ``require_workable``, which builds the same system with rigid rings and
carriers: their rigid motions are those of the FE bodies, so that faults of supports and joints are
reported before any FE body is reduced.
"""

import math
from collections.abc import Collection, Mapping, Sequence

import numpy as np

from flexgear.arrays import Array
from flexgear.coupling.assembly import Assembly
from flexgear.coupling.connections import connections, spline_matrix, stage_sets
from flexgear.coupling.determinacy import (
    free_motions,
    holding_rows,
    require_masses,
    rolling_motions,
    vibration_motions,
)
from flexgear.coupling.gear_meshes import GearBlock, GearBlocks, StageFrame, labels, pair_data
from flexgear.coupling.loads import frame_forces, given_loads
from flexgear.coupling.machines import machine_words, port_machines, require_free_speeds
from flexgear.coupling.members import AnyBody, stage_members
from flexgear.coupling.springs import behind_spline
from flexgear.coupling.system import (
    Damping,
    Port,
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
from flexgear.model.errors import InputError, echo
from flexgear.model.faults import bearing_defects
from flexgear.model.names import MOUNT, BodyName, MemberName, NodeName
from flexgear.model.read import nearest
from flexgear.model.sensor import ON_AXIS, require_places
from flexgear.model.stage_view import inside
from flexgear.model.train import Joint
from flexgear.structures.bodies import Body, lumped_body
from flexgear.structures.reduced import ReducedBody, RimFlexibility
from flexgear.structures.shaft import BeamSection, beam_element
from flexgear.structures.sources.of_case import fe_sources


def build_system(
    case: Case,
    bodies: Mapping[BodyName, AnyBody] | None = None,
    rigid: Collection[BodyName] = (),
    bending: bool = True,
) -> System:
    """System of all bodies of a case.

    bodies: reduced FE bodies; rigid: names of flexible bodies that are modelled as rigid, from
    dimensions of the case if they are not in ``bodies``; bending: see ``stage_sets``. Raises
    InputError if the case has no unique rated state or a body has no support.
    """
    bodies = bodies or {}
    members = [stage_members(case.view(s.name), bodies, rigid) for s in case.stages]
    a = Assembly(case, power_flow(case), members, _housing(case))
    for number in range(len(case.stages)):
        a.frames.append(_frame(a, number))
    rims = {  # flexibility of the teeth of flexible FE bodies along the face, by stage and part
        (name.stage, name.part): body.rim
        for name, body in bodies.items()
        if isinstance(body, ReducedBody) and body.rim is not None and name not in rigid
    }
    for number, stage in enumerate(case.stages):
        with inside(case, stage):
            for connection in connections(case.view(stage.name)):
                a.connect(number, connection)
        rims_of_stage = {part: rim for (name, part), rim in rims.items() if name == stage.name}
        _gear_mesh(a, number, bending, rims_of_stage)
    for joint in case.joints:
        _join(a, joint)
    for port in case.ports:
        # the body behind the spline of a sun's shaft already has the inertia of its port
        if not any(body.part == "output" for body in a.ends_of(port.member)):
            a.add_inertia(a.rotation(port.member), case.port_inertia(port.member))
        drag = (f"{port.member}_drag", a.rotation(port.member), np.zeros(a.size))
        a.damper(*drag, port.damping)
    if a.housing is not None:
        # at every mount node of an FE housing
        matrix = a.case.housing.mount.matrix
        nodes = [name for name in a.housing.node_names if NodeName.parse(name).kind == MOUNT]
        for node in nodes or ["housing"]:
            a.link(f"housing_{node if nodes else 'mount'}", a.node_rows("housing", node), matrix)
    return _system(a, rigid)


def _housing(case: Case) -> Body | None:
    """Body of the housing; None for rigid ground."""
    housing = case.housing
    if housing.kind == "lumped":
        return lumped_body(BodyName.of("", "housing"), housing.mass, housing.inertia)
    if housing.kind == "reduced":
        from flexgear.structures.sources.matrices import given_housing  # readers of matrices

        return given_housing(housing, case.source)
    return None


def _frame(a: Assembly, number: int) -> StageFrame:
    """Angles of a stage, see ``StageFrame``. The angle of an FE carrier is that of its pins, that
    of an FE ring the rotation of its hub, zero if it is held: torsion of the ring relative to its
    supports is elastic displacement."""
    stage, held = a.case.stages[number], a.case.held_members()
    if stage.kind == "parallel":
        return StageFrame(a.angle(a.rotation(f"{stage.name}.gear")), -1)
    carrier, ring = f"{stage.name}.carrier", f"{stage.name}.ring"
    carrier_row = np.zeros(a.size)
    if carrier not in held:
        is_fe = len(a.body(carrier).node_names) > 1
        carrier_row = _pin_rotation(a, number) if is_fe else a.rotation(carrier)
    ring_row = np.zeros(a.size) if ring in held else a.rotation(ring)
    theta = a.angle(carrier_row - ring_row)
    carrier_angle, ring_angle = (
        a.angle(row) if row.any() else -1 for row in (carrier_row, ring_row)
    )
    planets = -1
    defects = bearing_defects(a.case, stage.name, "planet_bearing")
    if defects or any(m.floats for m in a.members[number]):
        radii = stage_radii(a.case.view(stage.name))
        planets = a.angle(-radii.base["ring"] / radii.base["planet"] * (carrier_row - ring_row))
    return StageFrame(theta, carrier_angle, ring_angle, planets)


def _pin_rotation(a: Assembly, number: int) -> Array:
    """Row (d,) of the mean rotation of the pins about the carrier's axis."""
    view = a.case.view(a.case.stages[number].name)
    pins = [f"pin_{k}" for k in range(1, view.stage.planets + 1)]
    tangential = [a.rows(f"{view.name}.carrier", pin)[1] for pin in pins]
    return np.asarray(np.mean(tangential, axis=0) / stage_radii(view).center_distance)


def _gear_mesh(a: Assembly, number: int, bending: bool, rims: Mapping[str, RimFlexibility]) -> None:
    """Adds the gear meshes of a stage. rims: of its flexible FE ring and planet. Gear meshes
    include the whole compliance of the teeth of rigid FE members, as of lumped ones."""
    view, blocks = a.case.view(a.case.stages[number].name), _gear_blocks(a, number)
    flexible = {m.part for m in a.members[number] if m.contacts and not m.body.rigid}
    gears = {m.part for m in a.members[number] if m.part in ("ring", "planet")}
    view = view.with_rigid([part for part in gears - flexible if view.fe_tie(part)])
    flow, frame = a.flow.stage(view.name), a.frames[number]
    a.sets += stage_sets(view, number, flow, frame, blocks, bending, rims)


def _gear_blocks(a: Assembly, number: int) -> GearBlocks:
    """Adds the contact nodes of a stage's bodies as blocks. Nodes of a body with two halves are the
    teeth of the left half, then of the right half."""
    blocks: dict[tuple[str, int, str], GearBlock] = {}
    for m in a.members[number]:
        nodes, first = m.contacts, len(a.blocks)
        if not nodes:
            continue
        a.block_of[m.body.name] = first
        a.blocks += [a.rows(m.body.name, node) for node in nodes]
        if len(nodes) == 1:
            blocks[m.part, m.planet, m.body.name.side] = GearBlock(first)
            continue
        rigid = first if m.floats else None
        nodes = nodes[1:] if m.floats else nodes
        first += int(m.floats)
        places = np.array([m.body.position(node) for node in nodes])
        for k, side in enumerate(sides := a.case.stages[number].sides):
            half = slice(k * len(nodes) // len(sides), (k + 1) * len(nodes) // len(sides))
            blocks[m.part, m.planet, side] = GearBlock(first + half.start, places[half], rigid)
    return blocks


def _join(a: Assembly, joint: Joint) -> None:
    """Adds a joint, by its stiffness or as a shaft, between two members."""
    if joint.length is not None and joint.outer_diameter is not None:
        section = BeamSection(joint.length, joint.outer_diameter, joint.inner_diameter)
        m = a.case.material
        matrix, _ = beam_element(section, joint.length, m.young_modulus, m.poisson_ratio, m.density)
    else:
        spring = np.array(joint.matrix, dtype=float)
        first_member = MemberName.parse(joint.first)
        radii = stage_radii(a.case.view(first_member.stage))
        spring[5, 5] += joint.tangential * radii.rotation_radius(first_member.part) ** 2
        matrix = np.block([[spring, -spring], [-spring, spring]])
    ends, angles = [], []
    for end, member in enumerate((joint.first, joint.second)):
        first, *_ = a.bodies_of(member)
        if {"spline", "end"} <= first.ports.keys():  # no body between spline and joint
            matrix = behind_spline(matrix, spline_matrix(a.case.view(first.body.name.stage)), end)
        ends.append(a.end_rows(member))
        angles.append(a.body_angle(a.case.stage_index(member), first))
    name = f"{joint.first}-{joint.second}"
    a.joint(name, ends[0], ends[1], matrix, (angles[0], angles[1]))
    a.damper(f"{name}_damper", ends[0][5], ends[1][5], joint.damping)


def _system(a: Assembly, rigid_bodies: Collection[BodyName]) -> System:
    """System of an assembled train. Raises InputError for missing masses and supports."""
    case, flow = a.case, a.flow
    require_masses(a.bodies, case.source, a.mass)
    loads, first = given_loads(a), len(a.blocks)  # loads may add contact nodes
    blocks = np.vstack([*a.blocks, *a.contact_nodes])
    rows = (first, a.node_angles, a.support_rows, a.bearings, loads)
    pairs = pair_data(a.sets, len(blocks) // 6, *rows)
    rigid = orthonormal_rigid(a.mass, _loose_motions(a))
    angles = np.vstack(a.angles)
    bearing_rows = [row for bearing in a.bearings for row in bearing.held]
    contact = holding_rows(pairs, blocks, len(angles), bearing_rows)
    rolling, input_rows, speeds = _rolling(a, rigid, contact)
    gyroscopic, centripetal = frame_forces(a, rolling)
    rotations = np.array([a.rotation(p.member) for p in case.ports]).reshape(-1, a.size)
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
            Port(p.member, row, flow.torque[p.member], reaction=p.given_torque is None)
            for p, row in zip(case.ports, rotations, strict=True)
        ),
        pairs=pairs,
        gear_meshes=labels(a.sets),
        links=tuple(a.links),
        bearings=tuple(a.bearings),
        frames=dict(zip([s.name for s in case.stages], a.frames, strict=True)),
        ring_frames={
            m.body.name: a.body_angle(number, m)
            for number, members in enumerate(a.members)
            for m in members
            if m.frame == "ring" and not m.lumped
        },
        rotating_frame_supports=tuple(a.rotating_frame_supports),
        support_names=tuple(row.name for row in a.support_rows),
        damping=Damping(d.ratio, ratios=d.ratios) if modal else Damping(0.0, d.alpha, d.beta),
        machines=port_machines(case, flow),
        rated_torque=flow.torque.get(lead, 0.0),
        input_speeds=speeds,
        gyroscopic=gyroscopic,
        centripetal=centripetal,
        header={**machine_words(case), **inertias},
    )


def _loose_motions(a: Assembly) -> Array:
    """Motions (d, r) that no constant spring resists.

    For a single stage with flexible bodies in closed form, without round-off: carrier with planets,
    spin of each planet, ring with hub, sun with the body behind its spline; unless more motions are
    free, of members that float without a spring.
    """
    loose, stage = a.loose_motions(), a.case.stages[0]
    if len(a.case.stages) > 1 or a.case.joints or not stage.is_flexible:
        return loose
    planets, rigid_motions = a.bodies_of(f"{stage.name}.planet"), []
    for part in ("planet", "carrier", "ring", "sun"):
        members = a.bodies_of(f"{stage.name}.{part}")
        motions = np.zeros((len(members), a.size))
        for motion, m in zip(motions, members, strict=True):
            motion[a.slice_of(m.body.name)] = m.body.spin
        if part == "planet":
            rigid_motions += list(motions)
        elif f"{stage.name}.{part}" not in a.case.held_members():
            rigid_motions.append(motions.sum(axis=0))
            for m in planets if part == "carrier" else ():
                tangential = a.slice_of(m.body.name).start + 1
                rigid_motions[-1][tangential] = stage_radii(a.case.view()).center_distance
    candidates = np.column_stack(rigid_motions)
    return candidates if loose.shape == candidates.shape else loose


def _rolling(a: Assembly, rigid: Array, contact: Array) -> tuple[Array, Array, tuple[float, ...]]:
    """Rolling motions (d, F) of the train, rows (F, d) of its independent rotations, their speeds.
    In free vibration supports may resist rotations, and members may float: free motions then have
    no rated speed, unless they are the rotations of the inputs."""
    driven = [p.member for p in a.case.ports if p.speed is not None]
    free = free_motions(rigid, contact).shape[1]
    if a.case.output is None and (not driven or free != len(driven)):
        return *vibration_motions(a.mass, rigid, contact), ()
    input_rows = np.array([a.speed_row(m) for m in driven]).reshape(-1, a.size)
    rolling = rolling_motions(a.bodies, a.case.source, rigid, contact, input_rows)
    return rolling, input_rows, tuple(a.flow.speed[m] for m in driven)


def require_workable(case: Case) -> None:
    """Raises InputError, with key and remedy, for a case that cannot be analysed."""
    flow = power_flow(case)
    _require_steps(case, max(stage.gear_mesh_frequency for stage in flow.stages))
    for stage in case.stages:
        if not stage.is_flexible:
            forces = flow.stage(stage.name).gear_mesh_forces
            stage_paths(case.view(stage.name), forces)
            continue
        with inside(case, stage):
            view = case.view(stage.name)
            require_assembly(view, stage_geometry(view))
            for source in fe_sources(view).values():
                source.check()
    for stage in case.stages:
        view = case.view(stage.name)
        if "fe" in (view.gear_mesh.tooth_compliance, view.gear_mesh.root_stress):
            # imports FE modules that other cases do not need
            from flexgear.structures.tooth_influence.roots import require_influences

            require_influences(view)
    system = rigid_system(case)
    _require_torques(case, system.torque_names)
    require_nodes(case, system)
    require_places(case, [b for b, body in case.flexible_bodies.items() if not body.flexible])


def rigid_system(case: Case) -> System:
    """System whose flexible bodies are replaced by rigid ones with the dimensions of the case."""
    bodies: dict[BodyName, Body] = {}
    for stage in case.stages:
        if stage.is_flexible:
            with inside(case, stage):
                view = case.view(stage.name)
                for name, source in fe_sources(view).items():
                    bodies[name] = source.rigid(from_files=False)
    return build_system(case, bodies, case.flexible_bodies, bending=False)


def _require_torques(case: Case, names: Sequence[str]) -> None:
    """Raises InputError for a torque sensor on none of these ports and springs."""
    for k, sensor in enumerate(case.sensors):
        if sensor.measures == "torque" and sensor.on not in names:
            problem = f"{echo(sensor.on)} is no port, joint or bearing that passes a torque"
            raise InputError(case.source, f"sensors[{k}].on", problem, nearest(sensor.on, names))


def require_nodes(case: Case, system: System) -> None:
    """Raises InputError for a sensor at a node that its body does not have, or in a direction that
    a node on the axis does not have."""
    for k, sensor in enumerate(case.sensors):
        if sensor.node is None:
            continue
        body, at = system.body_of(sensor.on), f"sensors[{k}]"
        if sensor.node not in body.node_names:
            problem = f"{echo(sensor.node)} is no node of {sensor.on}"
            remedy = nearest(sensor.node, body.node_names)
            raise InputError(case.source, f"{at}.node", problem, remedy)
        on_axis = math.hypot(*body.position(sensor.node)[:2]) < ON_AXIS
        if on_axis and sensor.direction in ("radial", "tangential"):
            problem = f"{sensor.direction} is undefined on the axis, where {sensor.node} is"
            raise InputError(case.source, f"{at}.direction", problem, 'use "x", "y" or "z"')


def _require_steps(case: Case, frequency: float) -> None:
    """Raises InputError for time steps too long for the highest gear-mesh frequency, Hz."""
    longest, period = longest_time_step(frequency), 1 / frequency if frequency else math.inf
    fixed_steps = case.solver.step_tolerance == 0.0
    for key in ["time_step", "step_time_step"] if fixed_steps else ["longest_time_step"]:
        step = getattr(case.solver, key)
        if step is not None and step > longest:
            problem = f"a step of {step:.3g} s is too long for a gear-mesh period of {period:.3g} s"
            remedy = f"at most {longest:.3g} s; a tenth of that resolves gear-mesh excitation"
            raise InputError(case.source, f"solver.{key}_s", problem, remedy)
