"""Gear-mesh stiffness by ISO 6336-1, method B, written down without the package.

    q' = 0.04723 + 0.15551/z_n1 + 0.25791/z_n2 − 0.00635 x_1 − …   mm µm/N, x = 0 here
    c' = C_M C_R C_B cos β / q',   c_γ = c' (0.75 ε_α + 0.25),   k = c_γ b

with C_M = 0.8, C_R = 1, C_B of a rack of dedendum 1.25 m_n and 20°, z_n = z/(cos² β_b cos β), and
1/z_n2 = 0 for an internal gear. c_γ b acts in the transverse plane; along the 3D normal it is
1/cos² β_b larger.
"""

import numpy as np

from ren2021.equations import Stage

RACK = (1 + 0.5 * (1.2 - 1.25)) * 1.0  # C_B at 20°
N_PER_MM_UM = 1e9  # N/(mm µm) in N/m per m


def gear_mesh_stiffness(stage: Stage, kind: str, normal: bool) -> float:
    """Of one half, N/m, "sun" or "ring", along the 3D normal or in the transverse plane."""
    turned = np.cos(stage.base_helix) ** 2 * np.cos(stage.helix_angle)
    first = stage.planet_teeth if kind == "ring" else min(stage.planet_teeth, stage.sun_teeth)
    q = 0.04723 + 0.15551 * turned / first
    if kind == "sun":
        q += 0.25791 * turned / max(stage.planet_teeth, stage.sun_teeth)
    single = 0.8 * RACK * np.cos(stage.helix_angle) / q
    total = single * (0.75 * contact_ratio(stage, kind) + 0.25)
    k = total * N_PER_MM_UM * stage.face_width
    return float(k / np.cos(stage.base_helix) ** 2 if normal else k)


def contact_ratio(stage: Stage, kind: str) -> float:
    """Transverse contact ratio ε_α of gears with addendum m_n."""
    m, at = stage.module, stage.transverse_angle
    half = m / (2 * np.cos(stage.helix_angle))

    def tip(teeth: int, outward: int) -> float:
        r = half * teeth
        return float(np.sqrt((r + outward * m) ** 2 - (r * np.cos(at)) ** 2))

    distance = stage.carrier_radius * np.sin(at)
    pitch = 2 * np.pi * half * np.cos(at)
    planet = tip(stage.planet_teeth, 1)
    if kind == "sun":
        return float((tip(stage.sun_teeth, 1) + planet - distance) / pitch)
    return float((planet - tip(stage.ring_teeth, -1) + distance) / pitch)
