"""Forces on a train other than at ports: weight, loads of the case, forces of rotating frames."""

import numpy as np

from flexgear.arrays import Array
from flexgear.coupling.assembly import Assembly
from flexgear.coupling.gear_meshes import GivenLoad
from flexgear.coupling.members import Member
from flexgear.gears.radii import stage_radii
from flexgear.model.errors import InputError
from flexgear.model.names import MemberName
from flexgear.model.stage import Stage
from flexgear.model.train import varying
from flexgear.structures.bodies import Body, turn


def given_loads(a: Assembly) -> list[GivenLoad]:
    """Weight, centrifugal forces of planets, and loads of the case."""
    out: list[GivenLoad] = []
    for number, stage in enumerate(a.case.stages):
        speed = a.flow.speed.get(f"{stage.name}.carrier", 0.0)
        radius = stage_radii(a.case.view(stage.name)).center_distance
        for m in a.members[number]:
            if any(a.case.gravity):
                out.append(_weight(a, number, m))
            if a.case.gyroscopic and m.planet >= 0:  # centrifugal, in the axes of the planet
                force = np.r_[m.mass * radius * speed**2, np.zeros(5)]
                out.append(GivenLoad(a.block_of[m.body.name], force, grows=1))
    if any(a.case.gravity) and a.housing is not None:
        block = _weight_block(a, a.housing)
        out.append(GivenLoad(block, np.r_[a.case.gravity, 0, 0, 0]))
    for k in range(len(a.case.loads)):
        out += _given_load(a, k)
    return out


def _weight(a: Assembly, number: int, m: Member) -> GivenLoad:
    """Weight of a body; of a reduced body Rᵀ M g on all coordinates. In a rotating frame gravity
    rotates backwards."""
    size, block = 1.0, a.block_of.get(m.body.name, -1)
    if m.lumped and block >= 0:
        size = m.mass
    else:
        block = _weight_block(a, m.body)
    vector = turn(-_planet_axes(a.case.stages[number], m)) @ np.r_[a.case.gravity, 0, 0, 0]
    return GivenLoad(block, size * vector, a.body_angle(number, m))


def _weight_block(a: Assembly, body: Body) -> int:
    """Adds a block on which an acceleration acts as weight of a body."""
    rows = np.zeros((6, a.size))
    rows[:3, a.slice_of(body.name)] = weight_rows(body)
    return _new_block(a, rows)


def weight_rows(body: Body) -> Array:
    """Rows (3, n) Rᵀ M, on which an acceleration acts as weight of a body. R (n, 3): unit
    translations of the body; M does not include inertias of ports."""
    return (body.mass @ body.rigid_motions[:, :3]).T


def _given_load(a: Assembly, k: int) -> list[GivenLoad]:
    """Load number k of the case, at the connection of its member to the rest of the train; a
    history as one load for each component."""
    load, places = a.case.loads[k], _places(a)
    if load.member not in places:
        problem = f"{load.member} cannot be loaded"
        remedy = f"name one of {', '.join(sorted(places))}"
        raise InputError(a.case.source, f"loads[{k}].member", problem, remedy)
    number, m = places[MemberName.parse(load.member)]
    block = a.block_of.get(load.member, -1)
    if not m.lumped or block < 0:  # an FE body, or both halves of a ring
        block = _new_block(a, a.end_rows(load.member))
    angle = a.body_angle(number, m)
    if load.frame == "carrier" and m.frame == "ring":
        problem = f"is the carrier's, but {load.member} turns"
        remedy = 'give the load in fixed axes, frame = "fixed"'
        raise InputError(a.case.source, f"loads[{k}].frame", problem, remedy)
    angle = angle if load.frame == "fixed" else -1
    to_body = turn(-_planet_axes(a.case.stages[number], m))
    if not load.is_history:
        return [GivenLoad(block, to_body @ load.first, angle)]
    return [
        GivenLoad(block, size * to_body[:, c], angle, size=load.first[c] / size, history=place)
        for place, (of, c, size) in enumerate(varying(a.case.loads))
        if of == k
    ]


def _places(a: Assembly) -> dict[MemberName, tuple[int, Member]]:
    """Index of the stage and first body of members that can be loaded, by name."""
    return {
        member: (a.case.stage_index(member), a.bodies_of(member)[0])
        for member in a.case.member_names()
        if a.ends_of(member)
    }


def _new_block(a: Assembly, rows: Array) -> int:
    """Adds a block with motion rows (6, d); returns its index."""
    return len(a.blocks) + a.contact_node(rows, -1)


def frame_forces(a: Assembly, rolling: Array) -> tuple[Array | None, Array | None]:
    """Gyroscopic and centripetal matrices (d, d) of lumped bodies at rated speed, or None.

    Coordinates q include the rolling motion R a, which frames follow: only the remaining motion
    (I − R a) q with a = (RᵀMR)⁻¹RᵀM causes forces of the frame (``without_rolling``). Natural
    vibration has no such rolling, so frames do not move with the vibration of any member.
    """
    if not a.case.gyroscopic:
        return None, None
    gyroscopic, centripetal = np.zeros_like(a.mass), np.zeros_like(a.mass)
    for number, stage in enumerate(a.case.stages):
        flow = a.flow.stage(stage.name)
        carrier = a.flow.speed.get(f"{stage.name}.carrier", 0.0)
        for m in a.members[number]:
            if not m.lumped:
                continue
            member = f"{stage.name}.{m.part}"
            spin = flow.planet_speed if m.planet >= 0 else a.flow.speed[member]
            frame = spin if m.frame == "ring" else carrier
            at = a.slice_of(m.body.name)
            gyroscopic[at, at], centripetal[at, at] = _frame_matrices(m, frame, spin)
    momenta = rolling.T @ a.mass
    coordinates = np.linalg.solve(momenta @ rolling, momenta)
    return (
        without_rolling(gyroscopic, rolling, coordinates),
        without_rolling(centripetal, rolling, coordinates),
    )


def without_rolling(matrix: Array, rolling: Array, coordinates: Array) -> Array:
    """Matrix Pᵀ A P (d, d) with P = I − rolling · coordinates, which has no forces under rolling.

    rolling: (d, F) motion per radian of each independent rotation; coordinates: (F, d) rows that
    give the rotations. Rolling does not move a planet in the rotating carrier, and the centrifugal
    force has no moment about the axis; the plain centripetal matrix would act on the absolute
    tangential displacement R θ, which grows without bound.
    """
    projection = np.eye(len(matrix)) - rolling @ coordinates
    return np.asarray(projection.T @ matrix @ projection)


def _planet_axes(stage: Stage, m: Member) -> float:
    """Constant angle of a body's axes in its stage's frame, rad."""
    if m.planet >= 0:
        return stage.planet_angles[m.planet]
    return m.port("gear").axes


def _frame_matrices(m: Member, frame_speed: float, spin: float) -> tuple[Array, Array]:
    """Matrices G and C (d, d) of a lumped body in a frame that rotates at ``frame_speed``, rad/s.

    M q̈ + G q̇ + (K − C) q with E = [[0, −1], [1, 0]]: translations G = 2 m ω E, C = m ω²; tilts of
    a body of polar inertia J_p that spins at Ω (absolute) G = (2 J_t ω − J_p Ω) E and
    C = J_t ω² − J_p Ω ω (Genta 2005, Dynamics of Rotating Systems, §2.6, in rotating axes).
    """
    gyroscopic, centripetal = np.zeros((6, 6)), np.zeros((6, 6))
    e = np.array([[0.0, -1.0], [1.0, 0.0]])
    w = frame_speed
    gyroscopic[:2, :2], centripetal[:2, :2] = 2 * m.mass * w * e, m.mass * w**2 * np.eye(2)
    gyroscopic[3:5, 3:5] = (2 * m.tilt * w - m.inertia * spin) * e
    centripetal[3:5, 3:5] = (m.tilt * w**2 - m.inertia * spin * w) * np.eye(2)
    node_map = m.body.node_map
    return node_map.T @ gyroscopic @ node_map, node_map.T @ centripetal @ node_map
