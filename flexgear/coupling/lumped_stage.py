"""Springs, nodes and gear meshes of the lumped stages of a train."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexgear.coupling.assembly import Assembly
from flexgear.coupling.bearings import linear_part, own_law
from flexgear.coupling.gear_meshes import GearMeshSet, model_number
from flexgear.coupling.lumped_bodies import LumpedMember
from flexgear.gears.errors import stage_errors
from flexgear.gears.paths import stage_paths
from flexgear.gears.stage_flow import StageFlow
from flexgear.model.case import Case
from flexgear.model.errors import InputError
from flexgear.model.train_member import Support
from flexgear.model.train_stage import TrainStage
from flexgear.structures.kinematics import turn

Array = NDArray[np.float64]


@dataclass(frozen=True)
class StageFrame:
    """Which of the system's angles a stage depends on: θ; the carrier's (−1 where it stands)."""

    theta: int
    carrier: int


def support_matrix(support: Support, radius: float) -> Array:
    """Stiffness (6, 6) of a support with its tangential spring as torsion k r², SI."""
    matrix = np.array(support.matrix, dtype=float)
    matrix[5, 5] += support.tangential * radius**2
    return matrix


def tie_lumped_stage(
    a: Assembly, stage: TrainStage, members: list[LumpedMember], frame: StageFrame
) -> None:
    """Supports and planet bearings of a lumped stage."""
    for m in members:
        name = m.body.name
        node = a.rows(name, name)
        if m.part == "planet":
            phi = stage.planet_angles[m.planet]
            carrier = a.rows(f"{stage.name}.carrier", f"{stage.name}.carrier")
            # the pin in the planet's axes: the carrier's motion there
            centre = np.eye(6)
            centre[1, 5] = orbit_radius(members)
            centre[2, 4] = -orbit_radius(members)
            pin = centre @ turn(-phi) @ carrier
            bearing, link = stage.planet_bearing, f"{stage.name}.planet_bearing_{m.planet + 1}"
            a.link(link, pin - node, linear_part(bearing, support_matrix(bearing, 0.0)))
            a.law_bearing(link, node, pin, bearing)
            continue
        support = stage.member(m.part).support
        matrix = linear_part(support, support_matrix(support, m.radius))
        torsion = np.zeros((6, 6))
        torsion[5, 5], matrix[5, 5] = matrix[5, 5], 0.0
        housing = a.housing_rows(a.body(name).position(name))
        a.link(f"{name}_torsion", node - housing, torsion)
        if matrix.any():
            if frame.carrier < 0:
                a.link(f"{name}_support", node - housing, matrix)
            else:
                a.turning_support(f"{name}_support", name, name, matrix, frame.carrier)
        moves = bool(housing.any())
        if moves and frame.carrier >= 0 and own_law(support) is not None:
            raise InputError(
                a.source, f"stages.{stage.name}.{m.part}.support",
                "has a clearance or rollers between a frame that turns and a housing that moves",
                'set housing.kind to "rigid", or make the support linear',
            )  # fmt: skip
        a.law_bearing(f"{name}_support", node, housing if moves else None, support)


def orbit_radius(members: list[LumpedMember]) -> float:
    """Distance of the planets from the axis, m."""
    return next(m.radius for m in members if m.part == "carrier")


def lumped_sets(
    train: Case,
    number: int,
    members: list[LumpedMember],
    flow: StageFlow,
    frame: StageFrame,
    first_block: int,
) -> list[GearMeshSet]:
    """Gear meshes of lumped stage ``number``; blocks are its members in their order.

    With the linear law only the flank that carries the rated torque is there. Pair damping takes
    1/m = r_bp²/J_p + r_b²/J, without the second term where the gear is held.
    """
    stage = train.stages[number]
    options = stage.gear_mesh
    view = train.view(stage.name)
    paths = stage_paths(view, flow.gear_mesh_forces)
    errors = stage_errors(view, paths)
    driven_forward = (flow.planet_torque if stage.kind == "parallel" else -flow.sun_torque) >= 0
    first, second = ("pinion", "gear") if stage.kind == "parallel" else ("sun", "planet")
    place = {(m.part, m.side, m.planet): first_block + k for k, m in enumerate(members)}
    by_part = {(m.part, m.side): m for m in members}
    planets = (
        [place["gear", "", -1]]
        if stage.kind == "parallel"
        else [place["planet", "", i] for i in range(stage.planets)]
    )
    planet = by_part[second, ""]
    out = []
    for (kind, side), path in paths.items():
        front = kind.endswith("_back") != driven_forward
        if not front and options.contact_law == "linear":
            continue
        part = "ring" if kind.startswith("ring") else first
        gear = by_part[part, side if part == "ring" else ""]
        inverse = path.base_radius_planet**2 / planet.inertia
        if gear.body.node_map[5].any():
            inverse += path.base_radius_gear**2 / gear.inertia
        out.append(
            GearMeshSet(
                path=path,
                errors=errors[kind, side],
                stage=number,
                angle=frame.theta,
                carrier_angle=frame.carrier,
                phi=np.asarray(stage.planet_angles, dtype=float),
                planet_blocks=planets,
                gear_block=place[part, gear.side, -1],
                tooth_positions=None,
                turns=-1,
                front=front,
                one_sided=options.contact_law != "linear",
                equivalent_mass=1.0 / inverse,
                damping_ratio=options.damping_ratio,
                model=model_number(options.model),
            )
        )
    return out


def planet_axes(stage: TrainStage, m: LumpedMember) -> float:
    """Constant angle of a body's axes in its stage's frame, rad."""
    if m.part == "planet" or (m.part == "gear" and stage.kind == "parallel"):
        return stage.planet_angles[max(m.planet, 0)]
    return 0.0


def orbit_force(stage: TrainStage, m: LumpedMember, radius: float, speed: float) -> Array:
    """Centrifugal force (6,) on a planet in its own axes, N."""
    out = np.zeros(6)
    if m.part == "planet":
        out[0] = m.mass * radius * speed**2
    return out


def frame_matrices(m: LumpedMember, frame_speed: float, spin: float) -> tuple[Array, Array]:
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
