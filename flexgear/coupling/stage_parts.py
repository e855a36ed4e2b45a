"""Bodies, springs and gear meshes of a flexible stage, alone or as part of a train.

``at`` is what stands before the names of its bodies and springs: "" alone, "<stage>." in a train.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from flexgear.coupling.assembly import Assembly
from flexgear.coupling.bearings import linear_part
from flexgear.coupling.gear_meshes import GearMeshSet, model_number
from flexgear.coupling.pair_data import KINDS
from flexgear.coupling.system import Variant
from flexgear.gears.errors import stage_errors
from flexgear.gears.geometry import StageGeometry, stage_geometry
from flexgear.gears.paths import stage_paths
from flexgear.gears.stage_flow import StageFlow
from flexgear.model.errors import InputError
from flexgear.model.ports import Port
from flexgear.model.stage_view import StageView
from flexgear.structures.bodies import Body, lumped_body, rigid_variant, stiffened
from flexgear.structures.kinematics import turn
from flexgear.structures.reduced import ReducedBody
from flexgear.structures.shaft import BeamSection, shaft_body
from flexgear.structures.springs import carrier_springs, ring_springs

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


def gear_inertia(case: StageView, gear: str, geometry: StageGeometry) -> tuple[float, Array]:
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


def sun_shaft(case: StageView, geometry: StageGeometry) -> Body:
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


def stage_components(
    case: StageView,
    geometry: StageGeometry,
    ring: ReducedBody,
    carrier: ReducedBody,
    variant: Variant,
    stiffening: Stiffening | None = None,
    *,
    port: Port | None = None,
) -> list[Body]:
    """Ring, carrier, planets, sun shaft and output of a stage, in this order.

    port: what hangs behind the spline; nothing where the sun is joined to another stage, which has
    its own bodies there.
    """
    stiffening = stiffening or Stiffening()
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
    bodies = [made["ring"], made["carrier"], *planets, made["shaft"]]
    if port is not None:
        assert port.mass is not None and port.tilt_inertia is not None  # the model asks for them
        tilt, polar = port.tilt_inertia, port.inertia or 0.0
        output = lumped_body("output", port.mass, (tilt, tilt, polar))
        bodies.append(replace(output, positions=made["shaft"].positions[-1:].copy()))
    return bodies


def tie_stage(a: Assembly, case: StageView, at: str = "", angle: int = 0) -> None:
    """All springs of a stage; angle: which of the system's angles is the carrier's."""
    _tie_ring(a, case, at)
    _tie_carrier(a, case, at, angle)
    _tie_shaft(a, case, at, angle)


def pin_rotation(a: Assembly, case: StageView, radius: float, at: str = "") -> Array:
    """Row (d,) of the mean rotation of the pins, which stands for the carrier's, rad."""
    row = np.zeros(a.size)
    for i, phi in enumerate(case.stage.planet_angles):
        pin = a.rows(f"{at}carrier", f"pin_{i + 1}")
        row += (math.cos(phi) * pin[1] - math.sin(phi) * pin[0]) / (radius * case.stage.planets)
    return row


def stage_nodes(a: Assembly, case: StageView, at: str = "") -> tuple[list[Array], Array]:
    """Contact nodes of a stage (teeth of the ring, planets, sun) and the teeth's positions."""
    ring = a.body(f"{at}ring")
    teeth = [a.rows(ring.name, name) for name in ring.node_names if name[:5] == "tooth"]
    planets = [a.rows(f"{at}planet_{i + 1}", f"planet_{i + 1}") for i in range(case.stage.planets)]
    return [*teeth, *planets, a.rows(f"{at}shaft", "sun")], ring.positions[: len(teeth)]


def stage_sets(
    view: StageView, flow: StageFlow, *, tooth_positions: Array,
    first_block: int = 0, stage: int = 0, angle: int = 0,
) -> list[GearMeshSet]:  # fmt: skip
    """Gear meshes of a stage with a ring of tooth nodes; blocks: teeth, planets, sun.

    flow: of the stage where it stands, alone or among others; tooth_positions: (z_r, 3) m. With the
    linear law only the flank that carries the rated torque is there. Pair damping takes the
    equivalent mass on the line of action 1/m = r_bp²/J_p + r_b²/J (ring held: J → ∞).
    """
    options, n, teeth = view.gear_mesh, view.stage.planets, len(tooth_positions)
    geometry, paths = stage_geometry(view), stage_paths(view, flow.gear_mesh_forces)
    errors, driven_forward = stage_errors(view, paths), flow.sun_torque <= 0
    polar = {g: gear_inertia(view, g, geometry)[1][2] for g in ("sun", "planet")}
    out = []
    one_sided = options.contact_law == "one-sided"
    for kind in KINDS:
        path, ring = paths[kind, ""], kind.startswith("ring")
        front = kind.endswith("back") != driven_forward
        if not front and not one_sided:
            continue
        inverse = path.base_radius_planet**2 / polar["planet"]
        if not ring:
            inverse += path.base_radius_gear**2 / polar["sun"]
        out.append(
            GearMeshSet(
                path=path,
                errors=errors[kind, ""],
                stage=stage,
                angle=angle,
                carrier_angle=angle,
                phi=np.asarray(view.stage.planet_angles, dtype=float),
                planet_blocks=[first_block + teeth + i for i in range(n)],
                gear_block=first_block if ring else first_block + teeth + n,
                tooth_positions=tooth_positions if ring else None,
                turns=angle if ring else -1,
                front=front,
                one_sided=one_sided,
                equivalent_mass=1.0 / inverse,
                damping_ratio=options.damping_ratio,
                model=model_number(options.model),
            )
        )
    return out


def _tie_ring(a: Assembly, case: StageView, at: str) -> None:
    ring = a.body(f"{at}ring")
    for spring in ring_springs(case):
        node = a.rows(ring.name, spring.node) - a.housing_rows(ring.position(spring.node))
        a.link(f"{at}{spring.node}", spring.axes @ node, spring.matrix)


def _tie_carrier(a: Assembly, case: StageView, at: str, angle: int) -> None:
    if np.any(case.stage.planet_bearing.matrix[5] != 0):
        raise InputError(
            case.source,
            "bearings.planet",
            "holds the planet's rotation about its axis, so the gears could not roll",
            "set the stiffness about z (torsion, row 6) to zero",
        )
    for spring in carrier_springs(case):
        name = f"{at}carrier_{spring.node.removeprefix('bearing_')}"
        a.turning_support(name, f"{at}carrier", spring.node, spring.in_body, angle)
    for i, phi in enumerate(case.stage.planet_angles):
        pin = turn(-phi) @ a.rows(f"{at}carrier", f"pin_{i + 1}")
        planet = a.rows(f"{at}planet_{i + 1}", f"planet_{i + 1}")
        bearing, name = case.stage.planet_bearing, f"{at}planet_bearing_{i + 1}"
        a.link(name, pin - planet, linear_part(bearing, bearing.matrix))
        a.law_bearing(name, planet, pin, bearing)


def spline_matrix(case: StageView) -> Array:
    """Stiffness (6, 6) of the spline at the end of the sun's shaft, SI."""
    return np.diag(np.asarray(case.shaft.spline.stiffness, dtype=float))


def _tie_shaft(a: Assembly, case: StageView, at: str, angle: int) -> None:
    if a.has(f"{at}output"):
        shaft, output = a.rows(f"{at}shaft", "end"), a.rows(f"{at}output", "output")
        a.link(f"{at}spline", shaft - output, spline_matrix(case))
        port = case.case.port_at(f"{at}sun")
        if port is not None and port.bearing is not None:
            bearing = port.bearing.matrix
            a.turning_support(f"{at}output", f"{at}output", "output", bearing, angle)
    if case.stage.sun is not None and case.stage.sun.support.matrix.any():
        bearing = case.stage.sun.support.matrix
        a.turning_support(f"{at}sun", f"{at}shaft", "sun", bearing, angle)
