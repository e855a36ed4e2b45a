"""Cylindrical roller bearing: Q = K ⟨δ⟩^(10/9) for every roller of every row.

A roller at the angle ψ in a row at z is compressed by

    δ = (x + z r_y) cos ψ + (y − z r_x) sin ψ − gap − drop,

with K of ``roller_stiffness``. The rollers' loads give forces along x and y and moments about both;
tilt of rollers, which shifts the load along a roller, is neglected. Rollers are at ψ = 2π i/Z; in a
bearing with defects they move with the cage,

    ψ_i = 2π i/Z + (R_i α_i + R_o α_o)/(R_i + R_o) ,

α_i, α_o being the rotations of the races of radii R_i, R_o = R ∓ r cos α, with R of the circle of
rollers and their contact angle α, for rolling without slip. A defect of width w and depth d, as
long as the rollers, lowers a roller of radius r by

    drop = min(d, (w/2 − |a|)²/2ρ),   1/ρ = 1/r + 1/R_i or 1/r − 1/R_o ,

as it rests on the nearer edge; a is the distance of the roller from the middle of the defect along
the race. A defect of a roller, number 1, causes a drop where it faces a race: with the roller's
rotation (R_o/r)(α_o − ψ), at the outer race and half a turn later at the inner one. Slip is
neglected, and impact on edges beyond the effect of the drop on the parts of the bearing.

Parameters: K in N/m^(10/9), gap m, rollers of a row, rows, stiffness of the linear bearing that it
replaces (radial N/m, tilt N m/rad), angle that rotates a race, rotation of the cage per radian of
it, number of defects; then positions z of the rows, m, then ``DEFECT`` values of every defect.

Sources: Harris, Kotzalas 2006, Essential Concepts of Bearing Technology, ch. 6 and 7; ISO/TS
16281:2008; the drop is the geometry of two circles.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from flexgear.arrays import Array
from flexgear.compiled import INNER, UNCOUNTED, njit
from flexgear.coupling.laws.basic import clear
from flexgear.coupling.laws.law import Law, compiled_law
from flexgear.gears.bearings.rows import roller_stiffness
from flexgear.model.bearings import Bearing, Rollers, RollingElements
from flexgear.model.faults import Fault

EXPONENT = 10.0 / 9.0  # of the compression in the load
LEAST_TANGENT = 1e-4  # of a bearing without load, over its linear stiffness
STIFFNESS, GAP, COUNT, ROWS, RADIAL, TILT, TURNED, CAGE, DEFECTS, PLACES = range(10)
# values of a defect: 1 on a race, 0 on roller 1; row; rotation per radian of the angle; angle at
# the start, rad; radius of its position, half width, depth, m; 1/2ρ, 1/m
ON_RACE, ROW, RATE, START, RADIUS, HALF, DEPTH, CURVATURE, DEFECT = range(9)


class RaceRates(NamedTuple):
    """Rotation of inner and outer race relative to the axes x, y per radian of the angle;
    load_zone: ψ of rollers on the side towards +x, rad."""

    inner: float
    outer: float
    load_zone: float = 0.0


def roller_parameters(rollers: Rollers, radial: float, tilt: float) -> list[float]:
    """Parameters of a bearing without defects; radial, tilt: stiffness of the linear bearing."""
    stiffness = roller_stiffness(rollers.length)
    counts = float(rollers.count), float(rollers.rows)
    return [stiffness, rollers.clearance, *counts, radial, tilt, 0.0, 0.0, 0.0, *rollers.places]


def with_defects(
    parameters: Array, elements: RollingElements, rates: RaceRates, faults: Sequence[Fault]
) -> Array:
    """Parameters of a bearing with defects, whose rollers move with the cage."""
    roller, pitch = 0.5 * elements.diameter, 0.5 * elements.pitch_diameter
    inner, outer = (pitch + sign * roller * math.cos(elements.contact_angle) for sign in (-1, 1))
    cage = (inner * rates.inner + outer * rates.outer) / (inner + outer)
    at_inner, at_outer = 0.5 * (1 / roller + 1 / inner), 0.5 * (1 / roller - 1 / outer)
    spin = outer / roller * (rates.outer - cage)
    blocks: list[tuple[float, ...]] = []
    for fault in faults:
        size = 0.5 * (fault.width or 0.0), fault.depth or 0.0
        place, row = fault.position, float(fault.row - 1)
        if fault.kind == "roller":
            blocks.append((0.0, row, spin, place, roller, *size, at_outer))
            blocks.append((0.0, row, spin, place + math.pi, roller, *size, at_inner))
            continue
        place += rates.load_zone
        if fault.kind == "inner_race":
            blocks.append((1.0, row, rates.inner, place, inner, *size, at_inner))
        else:
            blocks.append((1.0, row, rates.outer, place, outer, *size, at_outer))
    extended = np.array([*parameters, *np.ravel(blocks)])
    extended[[CAGE, DEFECTS]] = cage, len(blocks)
    return extended


@njit(**INNER)
def _drop(parameters, row, i, psi):
    """Drop of roller i, at ψ, of a row in defects, m."""
    drop, at = 0.0, PLACES + int(parameters[ROWS])
    for _ in range(int(parameters[DEFECTS])):
        on_race = parameters[at + ON_RACE] == 1.0
        if parameters[at + ROW] == row and (on_race or i == 0):
            angle = parameters[at + RATE] * parameters[TURNED] + parameters[at + START]
            turns = ((psi - angle) if on_race else angle) / (2.0 * math.pi)
            distance = 2.0 * math.pi * abs(turns - math.floor(turns + 0.5))
            inside = parameters[at + HALF] - distance * parameters[at + RADIUS]
            if inside > 0.0:
                drop += min(parameters[at + DEPTH], parameters[at + CURVATURE] * inside * inside)
        at += DEFECT
    return drop


@njit(**INNER)
def _compression(parameters, row, i, motion):
    """cos ψ, sin ψ and z of roller i of a row, and its compression δ at motions (4,)."""
    z = parameters[PLACES + row]
    psi = 2.0 * math.pi * i / parameters[COUNT] + parameters[CAGE] * parameters[TURNED]
    c, s = math.cos(psi), math.sin(psi)
    x, y = motion[0] + z * motion[3], motion[1] - z * motion[2]
    delta = x * c + y * s - parameters[GAP]
    if parameters[DEFECTS] > 0.0:
        delta -= _drop(parameters, row, i, psi)
    return c, s, z, delta


@njit(**UNCOUNTED)
def _loads(parameters, motion, turned, out):
    """Fills ``out`` (t, rows, Z) with loads at motions (t, 4) and angles (t,); overwrites the angle
    in ``parameters``."""
    for t in range(out.shape[0]):
        parameters[TURNED] = turned[t]
        for row in range(out.shape[1]):
            for i in range(out.shape[2]):
                delta = _compression(parameters, row, i, motion[t])[3]
                out[t, row, i] = parameters[STIFFNESS] * max(delta, 0.0) ** EXPONENT


def roller_loads(parameters: Array, motion: Array, turned: Array) -> Array:
    """Load (t, rows, Z) of every roller, N, at motions (t, 4) x, y, r_x, r_y; turned: angle (t,)
    that rotates a race, rad."""
    out = np.empty((len(motion), int(parameters[ROWS]), int(parameters[COUNT])))
    _loads(np.array(parameters), np.ascontiguousarray(motion), turned, out)
    return out


@compiled_law
def _rollers(parameters, motion, force, tangent):
    """Sums over all rollers; the compression of a roller is g · (x, y, r_x, r_y) − gap − drop."""
    k = parameters[STIFFNESS]
    clear(force, tangent)
    energy = 0.0
    for row in range(int(parameters[ROWS])):
        for i in range(int(parameters[COUNT])):
            c, s, z, delta = _compression(parameters, row, i, motion[0])
            if delta > 0.0:
                load = k * delta**EXPONENT
                energy += load * delta / (1.0 + EXPONENT)
                slope = EXPONENT * load / delta
                g = (c, s, -z * s, z * c)
                for a in range(4):
                    force[0, a] += load * g[a]
                    for b in range(4):
                        tangent[0, a, b] += slope * g[a] * g[b]
    for a in range(4):
        force[1, a] = force[0, a]
        if energy == 0.0:
            tangent[0, a, a] = LEAST_TANGENT * (parameters[RADIAL] if a < 2 else parameters[TILT])
    return energy


def _nominal(parameters: Array) -> Array:
    return np.array([parameters[RADIAL], parameters[RADIAL], parameters[TILT], parameters[TILT]])


def _stated_by(bearing: Bearing, viscosity: float | None) -> list[float] | None:
    if bearing.rollers is None:
        return None
    radial, tilt = bearing.stiffness[0], bearing.stiffness[3]
    of_rows = radial * float(np.mean(np.square(bearing.rollers.places)))  # that share ``radial``
    return roller_parameters(bearing.rollers, radial, tilt or of_rows)


ROLLERS = Law(
    "rollers", _rollers, (0, 1, 3, 4), _nominal, _stated_by, part_loads=roller_loads, turned=TURNED
)
