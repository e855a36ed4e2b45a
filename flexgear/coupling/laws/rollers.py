"""A cylindrical roller bearing: Q = K ⟨δ⟩^(10/9) for every roller of every row.

A roller at the angle ψ in a row at z closes by

    δ = (x + z r_y) cos ψ + (y − z r_x) sin ψ − gap,    K = 35 948 L^(8/9) N/mm^(10/9), L in mm,

L being its effective length (ISO/TS 16281: steel, both raceways). The rollers' loads give forces
along x and y and moments about both. Rollers stand at ψ = 2π i/Z: that they pass is left out, and
so is their own tilt, which shares the load along a roller. Parameters: K in N/m^(10/9), gap m,
rollers of a row, rows, stiffness of the linear bearing in its place (radial N/m, tilt N m/rad),
then the rows' places z, m.

Sources: Harris, Kotzalas 2006, Essential Concepts of Bearing Technology, ch. 6 and 7; ISO/TS
16281:2008.
"""

from __future__ import annotations

import math

import numpy as np

from flexgear.arrays import Array
from flexgear.coupling.laws.basic import clear
from flexgear.coupling.laws.law import Law, compiled_law
from flexgear.model.bearings import Bearing, Rollers

EXPONENT = 10.0 / 9.0
LOOSE = 1e-4  # share of the linear stiffness in the tangent of a bearing without load
STIFFNESS, GAP, COUNT, ROWS, RADIAL, TILT, PLACES = range(7)


def roller_stiffness(length: float) -> float:
    """K of a steel roller between two raceways, N/m^(10/9); length m."""
    return float(35948.0 * (1e3 * length) ** (8 / 9) * 1e3**EXPONENT)


def roller_parameters(rollers: Rollers, radial: float, tilt: float) -> list[float]:
    """Parameters of the law; radial, tilt: of the linear bearing."""
    stiffness = roller_stiffness(rollers.length)
    counts = float(rollers.count), float(rollers.rows)
    return [stiffness, rollers.clearance, *counts, radial, tilt, *rollers.places]


def roller_loads(parameters: Array, motion: Array) -> Array:
    """Load of every roller (…, rows, Z) N at motions (…, 4): x, y, r_x, r_y."""
    count, rows = int(parameters[COUNT]), int(parameters[ROWS])
    psi = 2 * np.pi * np.arange(count) / count
    z = np.asarray(parameters[PLACES : PLACES + rows])
    x = motion[..., 0, None] + motion[..., 3, None] * z
    y = motion[..., 1, None] - motion[..., 2, None] * z
    delta = x[..., None] * np.cos(psi) + y[..., None] * np.sin(psi) - parameters[GAP]
    return np.asarray(parameters[STIFFNESS] * np.maximum(delta, 0.0) ** EXPONENT)


@compiled_law
def _rollers(parameters, motion, force, tangent):
    """Sums over all rollers; the way of a roller is g · (x, y, r_x, r_y)."""
    k, gap, count = parameters[STIFFNESS], parameters[GAP], int(parameters[COUNT])
    clear(force, tangent)
    energy = 0.0
    for row in range(int(parameters[ROWS])):
        z = parameters[PLACES + row]
        x = motion[0, 0] + z * motion[0, 3]
        y = motion[0, 1] - z * motion[0, 2]
        for i in range(count):
            psi = 2.0 * math.pi * i / count
            c, s = math.cos(psi), math.sin(psi)
            delta = x * c + y * s - gap
            if delta > 0.0:
                load = k * delta**EXPONENT
                energy += load * delta / (1.0 + EXPONENT)
                slope = EXPONENT * load / delta
                way = (c, s, -z * s, z * c)
                for a in range(4):
                    force[0, a] += load * way[a]
                    for b in range(4):
                        tangent[0, a, b] += slope * way[a] * way[b]
    for a in range(4):
        force[1, a] = force[0, a]
        if energy == 0.0:
            tangent[0, a, a] = LOOSE * (parameters[RADIAL] if a < 2 else parameters[TILT])
    return energy


def _nominal(parameters: Array) -> Array:
    return np.array([parameters[RADIAL], parameters[RADIAL], parameters[TILT], parameters[TILT]])


def _stated_by(bearing: Bearing, viscosity: float | None) -> list[float] | None:
    if bearing.rollers is None:
        return None
    stiffness = bearing.stiffness
    return roller_parameters(bearing.rollers, stiffness[0], stiffness[3])


ROLLERS = Law("rollers", _rollers, (0, 1, 3, 4), _nominal, _stated_by, part_loads=roller_loads)
