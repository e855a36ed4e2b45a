"""How large it would be what gear-mesh models leave out: friction, oval planets, bent pins.

Estimates for ``flexgear check`` and the manual; nothing else reads them.

**Friction** μ N lies across the line of action and turns round at the pitch point C. With the load
spread evenly over the path of contact it takes of the power of a gear mesh the share

    μ (1/r_b,planet ± 1/r_b,gear) x̄ / cos β_b,   x̄ = mean of |s − s_C| over the path

upper sign external, lower internal: at the distance x from C flanks slide with x |ω₁ ± ω₂|.

**A planet's rim** is a ring that does not stretch, of mean radius R, bending stiffness EI, with
u = Σ aₙ cos nθ + bₙ sin nθ outward, v = −∫u dθ round the rim, section turned by ψ = (v − u')/R:

    U = (π E I / 2R³) Σ (n² − 1)² (aₙ² + bₙ²),   n ≥ 2      (Timoshenko, Strength of Materials II)

Tooth forces act at the working circles r_w (v + (r_w − R) ψ along them), the pin presses on half of
the bore by a cosine. Free but for these, so rollers that fill the bore would hold it rounder: what
comes out is the most that a rim gives way along the lines of action. Planets that are flexible FE
bodies ovalise in the model, so nothing of it is estimated for them.

**A pin** inside its planet is a beam built in at both plates, its force even over the seat: its
middle against the seat's ends

    δ = M c²/(8EI) − F c³/(384EI) + F c/(8 κ G A),   M = F (L/8 − c/8) + F c²/(24 L)

(span L between the plates, seat width c, κ = 0.9).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from flexgear.arrays import Array
from flexgear.gears.geometry import StageGeometry, stage_geometry

if TYPE_CHECKING:
    from flexgear.model.stage_view import StageView

FRICTION = 0.05  # between ground, oiled flanks; 0.03 to 0.08 are usual
RIM_KEYS = {r: f"free_planet_rim_gives_way_{r}_gear_mesh_um" for r in ("ring", "sun")}
SHEAR = 0.9  # of a round section
ORDERS = np.arange(2, 2001)


def neglected_effects(view: StageView, forces: Mapping[str, float]) -> dict[str, float]:
    """Sizes under the normal forces of one gear mesh of "sun" and "ring", N, with their units in
    the keys; rims of planets with a bore that are no flexible FE bodies, pins of an FE carrier."""
    g, stage = stage_geometry(view), view.stage
    effects = {"coefficient_of_friction": FRICTION}
    for role in g.gear_meshes:
        name = "gear_mesh" if stage.kind == "parallel" else f"{role}_gear_mesh"
        effects[f"friction_loss_share_{name}"] = friction_share(g, role, FRICTION)
        effects[f"friction_force_{name}_n"] = FRICTION * abs(forces[role])
    if stage.planet is None:
        return effects
    halves = 2 if stage.double_helical else 1
    normal = {
        role: halves * abs(forces[role]) * math.cos(g.base_helix_angle) for role in g.gear_meshes
    }
    if stage.planet.bore_diameter > 0.0 and view.fe_tie("planet") is None:
        for role, size in _planet_rim(view, g, normal, 0.5 * stage.planet.bore_diameter).items():
            effects[RIM_KEYS[role]] = 1e6 * size
    if view.stage.form("carrier") == "fe":
        on_pin = sum(normal[s] * math.cos(m.working_angle) for s, m in g.gear_meshes.items())
        effects["pin_bends_in_planet_um"] = 1e6 * _pin(view, on_pin)
    return effects


def friction_share(g: StageGeometry, role: str, coefficient: float) -> float:
    """Share of a gear mesh's power that friction takes, with the load even over the path."""
    gear, gear_mesh = g.gears[role], g.gear_meshes[role]
    pitch_point = g.planet.base_radius * math.tan(gear_mesh.working_angle)
    lo, hi = gear_mesh.s_lo - pitch_point, gear_mesh.s_hi - pitch_point
    mean = (hi * abs(hi) - lo * abs(lo)) / (2.0 * (hi - lo))
    slip = 1.0 / g.planet.base_radius + gear.outward / gear.base_radius
    return coefficient * slip * mean / math.cos(g.base_helix_angle)


def rim_rows(angle: float, radial: float, tangential: float, arm: float) -> Array:
    """Displacement of a place of a ring per aₙ and bₙ, (2, orders), along (radial, tangential);
    arm: r/R − 1 of its radius r against the ring's mean radius R."""
    n = ORDERS
    c, s = np.cos(n * angle), np.sin(n * angle)
    along_a, along_b = -s / n, c / n  # v, round the rim
    turned_a, turned_b = along_a + n * s, along_b - n * c  # R ψ = v − u'
    return np.array(
        [
            radial * c + tangential * (along_a + arm * turned_a),
            radial * s + tangential * (along_b + arm * turned_b),
        ]
    )


def rim_compliance(bending: float, radius: float) -> Array:
    """aₙ and bₙ per unit of their loads, (orders,), m/N; bending: EI, N m²."""
    n = ORDERS.astype(float)
    return np.asarray(radius**3 / (math.pi * bending * (n**2 - 1.0) ** 2))


def _planet_rim(
    view: StageView, g: StageGeometry, normal: Mapping[str, float], bore: float
) -> dict[str, float]:
    """Displacement of the rim along each line of action, m, ring at θ = 0, sun at π;
    bore: its radius."""
    width = view.stage.face_width * (2.0 if view.stage.double_helical else 1.0)
    height, radius = g.planet.root_radius - bore, 0.5 * (g.planet.root_radius + bore)
    bending = view.material.young_modulus * width * height**3 / 12.0
    rows, load, on_pin = {}, np.zeros((2, len(ORDERS))), 0.0
    for role, angle, sense in (("ring", 0.0, 1.0), ("sun", math.pi, -1.0)):
        alpha = g.gear_meshes[role].working_angle
        arm = g.planet.base_radius / math.cos(alpha) / radius - 1.0
        rows[role] = rim_rows(angle, -math.sin(alpha), sense * math.cos(alpha), arm)
        load += normal[role] * rows[role]
        on_pin += normal[role] * math.cos(alpha)
    load += on_pin * _half_bore()
    deflection = load * rim_compliance(bending, radius)
    return {role: float(np.sum(row * deflection)) for role, row in rows.items()}


def _half_bore() -> Array:
    """Load of a pin's unit force towards θ = −π/2, (2, orders): p = (2/π) cos(θ + π/2) per angle
    over the half of the bore about it."""
    n, middle = ORDERS.astype(float), -0.5 * math.pi
    share = 2.0 / math.pi * 2.0 * np.cos(0.5 * math.pi * n) / (1.0 - n**2)
    return np.array([share * np.cos(n * middle), share * np.sin(n * middle)])


def _pin(view: StageView, force: float) -> float:
    """Displacement of the pin's middle against the ends of its seat, m."""
    body, m = view.carrier, view.material
    seat = body.pin_seat_width or body.plate_gap
    area = 0.25 * math.pi * (body.pin_diameter**2 - body.pin_bore**2)
    second = math.pi * (body.pin_diameter**4 - body.pin_bore**4) / 64.0
    shear = m.young_modulus / (2.0 * (1.0 + m.poisson_ratio))
    return pin_sag(force, body.plate_gap, seat, m.young_modulus * second, SHEAR * shear * area)


def pin_sag(force: float, span: float, seat: float, bending: float, shear: float) -> float:
    """δ of the module's docstring, m; bending: EI, N m²; shear: κ G A, N."""
    moment = force * (span - seat) / 8.0 + force * seat**2 / (24.0 * span)
    return (
        moment * seat**2 / (8.0 * bending)
        - force * seat**3 / (384.0 * bending)
        + force * seat / (8.0 * shear)
    )
