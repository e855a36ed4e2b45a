"""Stiffness of a tooth pair along the path of contact and along the helical contact line.

k'(ξ) is the stiffness per unit face width along the 3D line of action, ξ ∈ [0, 1] the place on the
path of contact. A pair whose contact line has s(z) = s + t z holds

    k(s) = ∫ k'(ξ(s + t z)) dz,   z_c(s) = ∫ k' z dz / k,

over the part of the face inside the path. Both follow exactly from the running integrals of k'
and k' ξ on a fine grid, so a spur pair is the limit t → 0 of the same rule.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Law = Callable[[Array], Array]
STEEL_YOUNG = 206e9  # ISO 6336-1 refers c' to steel


def iso_single_stiffness(
    *,
    teeth: tuple[int, int],
    internal: bool,
    shifts: tuple[float, float],
    dedendum: float,
    pressure_angle: float,
    helix_angle: float,
    young_modulus: float,
) -> float:
    """Peak c' of one pair per unit face width along the 3D line of action, N/m².

    ISO 6336-1:2006, 9.3: c'_th = 1/q' with virtual tooth numbers z_n = z/cos³β (internal gear:
    z_n2 → ∞), c' = c'_th C_M C_R C_B cosβ with C_M = 0.8, C_R = 1 and
    C_B = [1 + 0.5 (1.2 − h_fP/m)] [1 − 0.02 (20° − α_n)]. ISO's c' refers force and deflection
    to the transverse line of action; along the 3D one it is larger by 1/cos²β_b.
    teeth, shifts: planet (or pinion) first. Angles rad, young_modulus Pa.
    """
    cos_b = math.cos(helix_angle)
    z1 = teeth[0] / cos_b**3
    inverse2 = 0.0 if internal else cos_b**3 / teeth[1]
    x1, x2 = shifts
    q = (
        0.04723 + 0.15551 / z1 + 0.25791 * inverse2 - 0.00635 * x1 - 0.11654 * x1 / z1
        - 0.00193 * x2 - 0.24188 * x2 * inverse2 + 0.00529 * x1**2 + 0.00182 * x2**2
    )  # fmt: skip
    basic = (1 + 0.5 * (1.2 - dedendum)) * (1 - 0.02 * (20 - math.degrees(pressure_angle)))
    transverse = 0.8 / q * basic * cos_b * 1e9 * young_modulus / STEEL_YOUNG  # N/(mm µm) -> N/m²
    sin_bb = math.sin(helix_angle) * math.cos(pressure_angle)
    return transverse / (1 - sin_bb**2)


def parabola(peak: float, end_ratio: float) -> Law:
    """k'(ξ) = peak [1 − (1 − end_ratio)(2ξ − 1)²], zero outside [0, 1]."""
    return lambda xi: peak * (1 - (1 - end_ratio) * (2 * xi - 1) ** 2)


def table_law(places: Array, values: Array) -> Law:
    """k'(ξ) by linear interpolation of a table; values N/m²."""
    return lambda xi: np.interp(xi, places, values)


def pair_stiffness(
    law: Law, s: Array, s_lo: float, s_hi: float, slope: float, half_face: float, grid: int = 2001
) -> tuple[Array, Array]:
    """k(s) N/m and z_c(s) m for path coordinates ``s`` (n,) at mid-face."""
    length = s_hi - s_lo
    if abs(slope) * half_face < 1e-9 * length:  # spur: whole face at one place
        xi = (s - s_lo) / length
        inside = (xi >= 0) & (xi <= 1)
        return np.where(inside, 2 * half_face * law(np.clip(xi, 0, 1)), 0.0), np.zeros_like(s)
    places = np.linspace(0.0, 1.0, grid)
    dense = law(places)
    first, second = _running(places, dense)
    low = np.clip((s - abs(slope) * half_face - s_lo) / length, 0, 1)
    high = np.clip((s + abs(slope) * half_face - s_lo) / length, 0, 1)
    area = _at(places, dense, first, high) - _at(places, dense, first, low)
    moment = _at(places, dense, second, high, 1) - _at(places, dense, second, low, 1)
    # z = (s_lo + ξ L − s)/t and dz = L dξ/|t|
    k = np.maximum(area, 0.0) * length / abs(slope)
    centre = np.divide(moment, area, out=0.5 * (low + high), where=area > 1e-12 * first[-1])
    z = np.clip((s_lo + centre * length - s) / slope, -half_face, half_face)
    return k, np.where(k > 0, z, 0.0)


def _running(places: Array, values: Array) -> tuple[Array, Array]:
    """∫ v dξ and ∫ v ξ dξ of a piecewise linear v at the grid points, exactly."""
    h = np.diff(places)
    a, b = values[:-1], values[1:]
    x, y = places[:-1], places[1:]
    flat = h * (a + b) / 2
    moment = h * (a * (2 * x + y) + b * (x + 2 * y)) / 6
    return np.concatenate([[0], np.cumsum(flat)]), np.concatenate([[0], np.cumsum(moment)])


def _at(places: Array, values: Array, running: Array, xi: Array, power: int = 0) -> Array:
    """Running integral at any ξ, exact for piecewise linear values."""
    j = np.clip(np.searchsorted(places, xi, side="right") - 1, 0, len(places) - 2)
    x, d = places[j], xi - places[j]
    slope = (values[j + 1] - values[j]) / (places[j + 1] - places[j])
    if power == 0:
        return running[j] + d * (values[j] + 0.5 * slope * d)
    return running[j] + d * (values[j] * x + 0.5 * d * (values[j] + slope * x) + slope * d * d / 3)
