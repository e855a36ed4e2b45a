"""Nominal contact pressure of a gear mesh at its pitch point, without load factors.

    p = 2 w/(π a) of Hertz (``hertz``),   w = Z_ε² F cos β_b / b,
    Z_ε² = (4 − ε_α)/3 (1 − ε_β) + ε_β/ε_α,   1/ε_α where ε_β ≥ 1

with the normal force F of one gear mesh, its face width b and the radius of relative curvature
ρ_n = ρ_t/cos β_b at the pitch point: σ_H0 of ISO 6336-2:2019 without Z_β.
"""

from __future__ import annotations

import math

from flexgear.gears.geometry import StageGeometry
from flexgear.gears.hertz import ContactBody, line_contact, relative_radius
from flexgear.model.stage_view import StageView


def pitch_point_pressure(view: StageView, g: StageGeometry, role: str, force: float) -> float:
    """Pa; role: "sun" or "ring"; force: normal, of one gear mesh and half, N."""
    gear_mesh, gear, material = g.gear_meshes[role], g.gears[role], view.material
    curvature = [
        tooth.base_radius * math.tan(gear_mesh.working_angle) for tooth in (g.planet, gear)
    ]
    cos_base = math.cos(g.base_helix_angle)
    radius = relative_radius(*curvature, internal=gear.internal) / cos_base
    ratio, overlap = gear_mesh.transverse_contact_ratio, min(gear_mesh.overlap_ratio, 1.0)
    share = max((4.0 - ratio) / 3.0 * (1.0 - overlap), 0.0) + overlap / ratio
    depth = gear.reference_radius  # which the pressure does not depend on
    body = ContactBody(material.young_modulus, material.poisson_ratio, depth)
    line_load = abs(force) * cos_base / view.stage.face_width * share
    return float(line_contact(body, body, radius).pressure(line_load))
