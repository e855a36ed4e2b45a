"""From a case and its bodies to one ``System``."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from flexgear.coupling.gear_meshes import pair_data
from flexgear.coupling.links import add_spring, invariant_part, rotating_rows, turn
from flexgear.coupling.system import (
    Brake,
    Damping,
    Link,
    System,
    TurningSupport,
    Variant,
    orthonormal_rigid,
    without_rigid_forces,
)
from flexgear.gears.geometry import StageGeometry, stage_geometry
from flexgear.gears.kinematics import stage_kinematics
from flexgear.model.case import Case
from flexgear.model.errors import InputError
from flexgear.structures.bodies import (
    Body,
    lumped_body,
    rigid_rows,
    rigid_variant,
    stiffened,
)
from flexgear.structures.reduced import ReducedBody
from flexgear.structures.shaft import BeamSection, shaft_body

Array = NDArray[np.float64]


def body_of(reduced: ReducedBody) -> Body:
    """A reduced finite-element body as a body of the system."""
    nodes = 6 * len(reduced.node_names)
    return Body(
        name=reduced.name,
        node_names=tuple(reduced.node_names),
        positions=np.asarray(reduced.positions),
        mass=reduced.mass,
        stiffness=reduced.stiffness,
        node_map=np.eye(nodes, reduced.mass.shape[0]),
        recover=reduced.recover,
    )


def gear_inertia(case: Case, gear: str, geometry: StageGeometry) -> tuple[float, Array]:
    """Mass (kg) and diagonal inertia (3,) kg m² of a gear as a hollow cylinder.

    Outer diameter is the reference circle, inner the bore; width the face width.
    """
    outer = getattr(geometry, gear).reference_radius
    inner = 0.5 * getattr(case.stage, gear).bore_diameter
    width, density = case.stage.face_width, case.material.density
    mass = density * math.pi * (outer**2 - inner**2) * width
    polar = 0.5 * mass * (outer**2 + inner**2)
    tilt = 0.5 * polar + mass * width**2 / 12
    return mass, np.array([tilt, tilt, polar])


def sun_shaft(case: Case, geometry: StageGeometry) -> Body:
    """Sun gear and its shaft."""
    mass, inertia = gear_inertia(case, "sun", geometry)
    m, shaft = case.material, case.shaft
    return shaft_body(
        [BeamSection(s.length, s.outer_diameter, s.inner_diameter) for s in shaft.sections],
        young=m.young_modulus,
        poisson=m.poisson_ratio,
        density=m.density,
        direction=-1.0 if shaft.direction == "-z" else 1.0,
        elements_per_section=shaft.elements_per_section,
        end_masses={"sun": np.diag([mass, mass, mass, *inertia])},
    )


@dataclass(frozen=True)
class Stiffening:
    """Factors on the elastic stiffness of components, for limit studies."""

    ring: float = 1.0
    carrier: float = 1.0
    shaft: float = 1.0


class _Assembly:
    """Collects bodies, springs and rotating supports; makes the matrices at the end."""

    def __init__(self, bodies: list[Body], source: str) -> None:
        self.bodies, self.source = bodies, source
        self.starts = dict(
            zip([b.name for b in bodies], np.cumsum([0, *[b.size for b in bodies]]), strict=False)
        )
        self.size = sum(b.size for b in bodies)
        self.mass = np.zeros((self.size, self.size))
        self.stiffness = np.zeros((self.size, self.size))
        for b in bodies:
            at = slice(self.starts[b.name], self.starts[b.name] + b.size)
            self.mass[at, at] = b.mass
            self.stiffness[at, at] = b.stiffness
        self.links: list[Link] = []
        self.turning: list[TurningSupport] = []
        self.support_nodes: list[Array] = []
        self.support_turns: list[int] = []
        self.support_rows: list[tuple[float, list[tuple[int, Array]]]] = []

    def body(self, name: str) -> Body:
        return next(b for b in self.bodies if b.name == name)

    def has(self, name: str) -> bool:
        return name in self.starts

    def rows(self, body: str, node: str) -> Array:
        out = np.zeros((6, self.size))
        b = self.body(body)
        out[:, self.starts[body] : self.starts[body] + b.size] = b.node(node)
        return out

    def housing_rows(self, position: Array) -> Array:
        """Motion of a point fixed to the housing; zero where the housing is rigid ground."""
        if not self.has("housing"):
            return np.zeros((6, self.size))
        return rigid_rows(position)[:6] @ self.rows("housing", "housing")

    def link(self, name: str, rows: Array, matrix: Array) -> None:
        matrix = np.asarray(matrix, dtype=float)
        if not matrix.any():
            return
        add_spring(self.stiffness, rows, matrix)
        self.links.append(Link(name, rows, matrix))

    def turning_support(self, name: str, body: str, node: str, matrix: Array) -> None:
        """Support of a node that turns with the carrier on the housing."""
        matrix = np.asarray(matrix, dtype=float)
        if np.abs(matrix[5]).max() > 0 or np.abs(matrix[:, 5]).max() > 0:
            raise InputError(
                self.source,
                f"bearings.{name}",
                "holds the rotation about the axis, so the train could not turn",
                "set the stiffness about z to zero",
            )
        rows, mean = self.rows(body, node), invariant_part(matrix)
        housing = self.housing_rows(self.body(body).position(node))
        self.link(name, rows, mean)
        # what the constant spring to ground leaves out, on (turned node, housing)
        moves = bool(housing.any())
        rest = np.zeros((12, 12))
        rest[:6, :6] = matrix - mean
        if moves:
            rest[:6, 6:], rest[6:, :6], rest[6:, 6:] = -matrix, -matrix, matrix
        if np.abs(rest).max() <= 1e-9 * max(np.abs(matrix).max(), 1e-300):
            return
        self.turning.append(TurningSupport(name, rows, housing, matrix))
        turned = self._support_node(rows, turns=1)
        fixed = self._support_node(housing, turns=0) if moves else -1
        for value, vector in zip(*rotating_rows(rest), strict=True):
            ends = [(turned, vector[:6])]
            if moves:
                ends.append((fixed, vector[6:]))
            self.support_rows.append((float(value), ends))

    def _support_node(self, rows: Array, turns: int) -> int:
        self.support_nodes.append(rows)
        self.support_turns.append(turns)
        return len(self.support_nodes) - 1

    def rotation(self, body: str) -> Array:
        """Coordinates (size,) of a unit rotation of one body about the axis of its frame."""
        out = np.zeros(self.size)
        b, at = self.body(body), self.starts[body]
        if b.rigid:
            out[at + 5] = 1.0
        else:
            spin = rigid_rows(b.positions)[:, 5]
            out[at : at + len(spin)] = spin
        return out


def _components(
    case: Case,
    geometry: StageGeometry,
    ring: ReducedBody,
    carrier: ReducedBody,
    variant: Variant,
    stiffening: Stiffening,
) -> list[Body]:
    made = {
        "ring": stiffened(body_of(ring), stiffening.ring),
        "carrier": stiffened(body_of(carrier), stiffening.carrier),
        "shaft": stiffened(sun_shaft(case, geometry), stiffening.shaft),
    }
    for name in made:
        if not getattr(variant, name):
            made[name] = rigid_variant(made[name])
    mass, inertia = gear_inertia(case, "planet", geometry)
    planets = [
        lumped_body(f"planet_{i + 1}", mass, (inertia[0], inertia[1], inertia[2]))
        for i in range(case.stage.planets)
    ]
    out = case.inertia
    output = lumped_body("output", out.output_mass, (out.output_tilt, out.output_tilt, out.output))
    output = replace(output, positions=made["shaft"].positions[-1:].copy())
    bodies = [made["ring"], made["carrier"], *planets, made["shaft"], output]
    if case.housing.kind == "lumped":
        bodies.append(lumped_body("housing", case.housing.mass, case.housing.inertia))
    return bodies


def build_system(
    case: Case,
    ring: ReducedBody,
    carrier: ReducedBody,
    variant: Variant | None = None,
    stiffening: Stiffening | None = None,
) -> System:
    """Couple all bodies of a case; ``variant`` says which components bend.

    ring, carrier: reduced bodies (also used, as rigid bodies with the same mass, by rigid
    variants). Raises InputError where a support would hold the rotation.
    """
    variant = variant or Variant(case.ring.flexible, case.carrier.flexible, case.shaft.flexible)
    geometry = stage_geometry(case.stage)
    motion = stage_kinematics(case)
    bodies = _components(case, geometry, ring, carrier, variant, stiffening or Stiffening())
    a = _Assembly(bodies, case.source)
    _tie_ring(a, case)
    _tie_carrier(a, case)
    _tie_shaft(a, case)
    if a.has("housing"):
        a.link("housing_mount", a.rows("housing", "housing"), np.diag(case.housing.stiffness))
    drive = a.rows("carrier", "drive")[5]
    at = np.flatnonzero(drive)
    a.mass[np.ix_(at, at)] += case.inertia.drive * np.outer(drive[at], drive[at])
    radius, n = geometry.center_distance, case.stage.planets
    angles = np.asarray(case.stage.planet_angles)
    orbit, spins = a.rotation("carrier"), []
    for i in range(n):
        orbit[a.starts[f"planet_{i + 1}"] + 1] = radius
        spins.append(a.rotation(f"planet_{i + 1}"))
    turning = a.rotation("shaft") + a.rotation("output")
    z_s, z_p, z_r = (getattr(case.stage, g).teeth for g in ("sun", "planet", "ring"))
    rolling = orbit - (z_r - z_p) / z_p * sum(spins) + (z_s + z_r) / z_s * turning
    rigid = orthonormal_rigid(a.mass, np.column_stack([orbit, *spins, turning]))
    pin_angle = np.zeros(a.size)
    for i, phi in enumerate(angles):
        pin = a.rows("carrier", f"pin_{i + 1}")
        pin_angle += (math.cos(phi) * pin[1] - math.sin(phi) * pin[0]) / (radius * n)
    teeth = [a.rows("ring", name) for name in a.body("ring").node_names if name[:5] == "tooth"]
    planets = [a.rows(f"planet_{i + 1}", f"planet_{i + 1}") for i in range(n)]
    blocks = [*teeth, *planets, a.rows("shaft", "sun"), *a.support_nodes]
    pairs = pair_data(
        case,
        geometry,
        tooth_positions=a.body("ring").positions[: len(teeth)],
        planet_polar=gear_inertia(case, "planet", geometry)[1][2],
        sun_polar=gear_inertia(case, "sun", geometry)[1][2],
        supports=a.support_rows,
        support_turns=a.support_turns,
        first_support_block=len(teeth) + n + 1,
    )
    d = case.damping
    modal = d.kind == "modal"
    return System(
        variant=variant,
        bodies=tuple(bodies),
        mass=a.mass,
        stiffness=without_rigid_forces(a.stiffness, a.mass, rigid),
        rigid=rigid,
        rolling=rolling,
        blocks=np.vstack(blocks),
        carrier_angle=pin_angle,
        drive=drive,
        output=a.rows("output", "output")[5],
        pairs=pairs,
        links=tuple(a.links),
        turning=tuple(a.turning),
        damping=Damping(
            d.ratio if modal else 0.0, 0.0 if modal else d.alpha, 0.0 if modal else d.beta
        ),
        brake=Brake(
            case.brake.rated_torque or motion.output_torque, motion.sun_speed, case.brake.exponent
        ),
        rated_torque=case.drive.rated_torque,
        rated_speed=case.drive.rated_speed,
        planets=n,
        header={
            "drive_inertia_kg_m2": case.inertia.drive,
            "output_inertia_kg_m2": case.inertia.output,
            "brake_exponent": case.brake.exponent,
        },
    )


def _tie_ring(a: _Assembly, case: Case) -> None:
    ring, b = a.body("ring"), case.ring.bolts
    bolt = np.diag(
        [b.stiffness_radial, b.stiffness_tangential, b.stiffness_axial]
        + [b.stiffness_tilt, b.stiffness_tilt, b.stiffness_twist]
    )
    for name in ring.node_names:
        x = ring.position(name)
        if name.startswith("bolt"):
            axes = turn(math.atan2(x[1], x[0])).T
            a.link(name, axes @ (a.rows("ring", name) - a.housing_rows(x)), bolt)
        elif name.startswith("fit"):
            fit = case.ring.fits[int(name.split("_")[1]) - 1]
            matrix = np.diag(
                [fit.stiffness_radial, fit.stiffness_radial, fit.stiffness_axial]
                + [fit.stiffness_tilt, fit.stiffness_tilt, 0.0]
            )
            a.link(name, a.rows("ring", name) - a.housing_rows(x), matrix)


def _tie_carrier(a: _Assembly, case: Case) -> None:
    if np.any(case.bearings.planet.matrix[5] != 0):
        raise InputError(
            case.source,
            "bearings.planet",
            "holds the planet's rotation about its axis, so the gears could not roll",
            "set the stiffness about z (torsion, row 6) to zero",
        )
    for side in ("drive", "far"):
        bearing = getattr(case.bearings, f"carrier_{side}")
        a.turning_support(f"carrier_{side}", "carrier", f"bearing_{side}", bearing.matrix)
    for i, phi in enumerate(case.stage.planet_angles):
        pin = turn(-phi) @ a.rows("carrier", f"pin_{i + 1}")
        planet = a.rows(f"planet_{i + 1}", f"planet_{i + 1}")
        a.link(f"planet_bearing_{i + 1}", pin - planet, case.bearings.planet.matrix)


def _tie_shaft(a: _Assembly, case: Case) -> None:
    spline = np.diag(np.asarray(case.shaft.spline.stiffness, dtype=float))
    a.link("spline", a.rows("shaft", "end") - a.rows("output", "output"), spline)
    a.turning_support("output", "output", "output", case.bearings.output.matrix)
    if case.bearings.sun is not None:
        a.turning_support("sun", "shaft", "sun", case.bearings.sun.matrix)
