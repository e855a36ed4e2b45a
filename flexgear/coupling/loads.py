"""Forces on a train beside its ports: weight, given loads, and those of frames that turn."""

from __future__ import annotations

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
    """Forces given from outside."""
    out: list[GivenLoad] = []
    for number, stage in enumerate(a.case.stages):
        speed = a.flow.speed.get(f"{stage.name}.carrier", 0.0)
        radius = stage_radii(a.case.view(stage.name)).center_distance
        for m in a.members[number]:
            if any(a.case.gravity):
                out.append(_weight(a, number, m))
            if a.case.gyroscopic and m.planet >= 0:  # centrifugal, in the planet's own axes
                force = np.r_[m.mass * radius * speed**2, np.zeros(5)]
                out.append(GivenLoad(a.block_of[m.body.name], force, grows=1))
    if any(a.case.gravity) and a.housing is not None:
        node = _weighed_block(a, a.housing)
        out.append(GivenLoad(node, np.r_[a.case.gravity, 0, 0, 0]))
    for k in range(len(a.case.loads)):
        out += _given_load(a, k)
    return out


def _weight(a: Assembly, number: int, m: Member) -> GivenLoad:
    """Weight of a body through all its mass: of a reduced body Rᵀ M g on every coordinate. In
    bodies whose frame turns gravity turns backwards."""
    size, block = 1.0, a.block_of.get(m.body.name, -1)
    if m.lumped and block >= 0:
        size = m.mass
    else:
        block = _weighed_block(a, m.body)
    vector = turn(-_planet_axes(a.case.stages[number], m)) @ np.r_[a.case.gravity, 0, 0, 0]
    return GivenLoad(block, size * vector, a.body_angle(number, m))


def _weighed_block(a: Assembly, body: Body) -> int:
    """Block on which an acceleration acts as a body's weight; rows of rotations are zero."""
    rows = np.zeros((6, a.size))
    rows[:3, a.slice_of(body.name)] = weight_rows(body)
    return _new_block(a, rows)


def weight_rows(body: Body) -> Array:
    """Rows (3, n) Rᵀ M, on which an acceleration acts as a body's weight.

    R (n, 3): unit translations of the whole body; the mass is the body's own, without inertias of
    its ports.
    """
    return (body.mass @ body.rigid_motions[:, :3]).T


def _given_load(a: Assembly, k: int) -> list[GivenLoad]:
    """The load that the case lists as number k, on a member where it meets the rest of the train;
    a history component by component."""
    load, places = a.case.loads[k], _places(a)
    if load.member not in places:
        raise InputError(
            a.case.source, f"loads[{k}].member", f"{load.member} cannot be loaded",
            f"name one of {', '.join(sorted(places))}",
        )  # fmt: skip
    number, m = places[MemberName.parse(load.member)]
    block = a.block_of.get(load.member, -1)  # of one lumped body; halves of a ring share it
    if not m.lumped or block < 0:
        block = _new_block(a, a.end_rows(load.member))
    angle = a.body_angle(number, m)
    if load.frame == "carrier" and m.frame == "ring":
        raise InputError(
            a.case.source, f"loads[{k}].frame", f"is the carrier's, but {load.member} turns",
            'give the load in fixed axes, frame = "fixed"',
        )  # fmt: skip
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
    """Members that can be loaded, by name, with the number of their stage and their first body."""
    return {
        member: (a.case.stage_index(member), a.bodies_of(member)[0])
        for member in a.case.member_names()
        if a.ends_of(member)
    }


def _new_block(a: Assembly, rows: Array) -> int:
    """Block of rows (6, d), made for a force there."""
    return len(a.blocks) + a.contact_node(rows, -1)


def frame_forces(a: Assembly, rolling: Array) -> tuple[Array | None, Array | None]:
    """Gyroscopic and centripetal matrices (d, d) of the lumped bodies at rated speed.

    Coordinates hold the rolling motion R a, which the frame follows: only what is left of a motion,
    (I − R a) q with a = (RᵀMR)⁻¹RᵀM, makes forces of the frame, and these leave the rolling alone.
    Natural vibration holds no such rolling, so the frame does not swing with any member.
    """
    if not a.case.gyroscopic:
        return None, None
    turning, centripetal = np.zeros_like(a.mass), np.zeros_like(a.mass)
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
            turning[at, at], centripetal[at, at] = _frame_matrices(m, frame, spin)
    momenta = rolling.T @ a.mass
    amounts = np.linalg.solve(momenta @ rolling, momenta)
    return (
        without_rolling(turning, rolling, amounts),
        without_rolling(centripetal, rolling, amounts),
    )


def without_rolling(matrix: Array, rolling: Array, amounts: Array) -> Array:
    """Pᵀ A P (d, d) with P = I − rolling · amounts: forces of the motion beside rolling.

    rolling: (d, F) motion per radian of each independent rotation; amounts: (F, d) rows that
    give the rotations. A planet that has rolled on has not left its place in the turning carrier,
    and the centrifugal force, which passes through the axis wherever the planet is, has no moment.
    The centripetal matrix as it stands would push the absolute tangential displacement R θ outward
    for ever.
    """
    rest = np.eye(len(matrix)) - rolling @ amounts
    return np.asarray(rest.T @ matrix @ rest)


def _planet_axes(stage: Stage, m: Member) -> float:
    """Constant angle of a body's axes in its stage's frame, rad."""
    if m.planet >= 0:
        return stage.planet_angles[m.planet]
    return m.port("gear").axes


def _frame_matrices(m: Member, frame_speed: float, spin: float) -> tuple[Array, Array]:
    """G and C (d, d) of a lumped body in a frame that turns at ``frame_speed``, rad/s.

    M q̈ + G q̇ + (K − C) q with E = [[0, −1], [1, 0]]: translations G = 2 m ω E, C = m ω²; tilts of
    a body of polar inertia J_p that spins at Ω (absolute) G = (2 J_t ω − J_p Ω) E and
    C = J_t ω² − J_p Ω ω (Genta 2005, Dynamics of Rotating Systems, §2.6, in rotating axes).
    """
    turning, centripetal = np.zeros((6, 6)), np.zeros((6, 6))
    e = np.array([[0.0, -1.0], [1.0, 0.0]])
    w = frame_speed
    turning[:2, :2], centripetal[:2, :2] = 2 * m.mass * w * e, m.mass * w**2 * np.eye(2)
    turning[3:5, 3:5] = (2 * m.tilt * w - m.inertia * spin) * e
    centripetal[3:5, 3:5] = (m.tilt * w**2 - m.inertia * spin * w) * np.eye(2)
    dofs = m.body.node_map
    return dofs.T @ turning @ dofs, dofs.T @ centripetal @ dofs
