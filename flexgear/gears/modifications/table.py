"""A flank as a table over profile and face: bilinear in (ρ, z) between its points.

ρ = r_b ξ at the roll angle ξ, or √(d²/4 − r_b²) at the diameter d; constant beyond the outermost
points, so min g ≤ g ≤ max g anywhere.
"""

from __future__ import annotations

import numpy as np
import scipy  # which loads its parts as they are named

from flexgear.arrays import Array
from flexgear.gears.modifications.flank import Flank, Gap
from flexgear.model.modifications import FlankModifications, FlankTable
from flexgear.model.section import Refusal

BEYOND = 0.01  # of the active profile, or of half the face: what is a coarse number, not an error


def table(modifications: FlankModifications, flank: Flank) -> Gap | None:
    """Gap at rho and z (any shapes that broadcast), m; None without a table. Refusal of points
    beyond the tip or the face, and of tables that leave out the flank."""
    if modifications.table is None:
        return None
    rho, z = _rolls(modifications.table, flank), np.array(modifications.table.z)
    if np.abs(z).max() > (1 + BEYOND) * flank.half_face:
        raise Refusal(
            "table.z",
            f"reaches {1e3 * np.abs(z).max():g} mm, beyond the face of "
            f"±{1e3 * flank.half_face:g} mm",
            "count z from the middle of the face, or check the unit",
        )
    between = scipy.interpolate.RegularGridInterpolator(
        (_two(rho), _two(z)), _values(modifications.table)
    )

    def gap(rho_at: Array, z_at: Array) -> Array:
        points = np.broadcast_arrays(np.clip(rho_at, rho[0], rho[-1]), np.clip(z_at, z[0], z[-1]))
        return np.asarray(between(np.stack(points, axis=-1))).reshape(points[0].shape)

    return gap


def _rolls(flank_table: FlankTable, flank: Flank) -> Array:
    """Roll lengths of the points on the profile, m."""
    name, places = flank_table.profile
    if name == "roll_angles":
        rho = flank.base_radius * np.array(places)
    else:
        rho = np.array([flank.roll_length(d) for d in places])
    low, high = sorted((flank.tip, flank.root))
    edge = BEYOND * flank.path
    beyond = rho.max() > high + edge if flank.tip > flank.root else rho.min() < low - edge
    if beyond or rho.max() < low or rho.min() > high or np.any(np.diff(rho) <= 0):
        factor, unit = (np.degrees(1.0), "deg") if name == "roll_angles" else (1e3, "mm")
        ends = np.array([low, high])
        angles, diameters = ends / flank.base_radius, 2.0 * np.hypot(ends, flank.base_radius)
        ends = factor * (angles if name == "roll_angles" else diameters)
        raise Refusal(
            f"table.{name}",
            f"{places[0] * factor:g} … {places[-1] * factor:g} {unit} do not fit the active "
            f"profile, {ends[0]:.6g} … {ends[1]:.6g} {unit}",
            "end at the tip, and begin outside the base circle",
        )
    return rho


def _two(nodes: Array) -> Array:
    """Nodes of an interpolation, at least two."""
    return nodes if len(nodes) > 1 else np.array([nodes[0], nodes[0] + 1.0])


def _values(flank_table: FlankTable) -> Array:
    """Gaps at ``_two`` of both axes, m."""
    gaps = np.array(flank_table.gaps)
    for axis in (0, 1):
        if gaps.shape[axis] == 1:
            gaps = np.repeat(gaps, 2, axis=axis)
    return gaps
