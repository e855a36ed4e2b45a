"""A cylindrical roller bearing: Q = K ⟨δ⟩^(10/9) for every roller of every row.

A roller at the angle ψ in a row at z closes by

    δ = (x + z r_y) cos ψ + (y − z r_x) sin ψ − gap − drop,
    K = 35 948 L^(8/9) N/mm^(10/9), L in mm,

L being its effective length (ISO/TS 16281: steel, both raceways). The rollers' loads give forces
along x and y and moments about both; their own tilt, which shares the load along a roller, is left
out. Rollers stand at ψ = 2π i/Z; in a bearing with defects they pass, by what the cage turns

    ψ_i = 2π i/Z + (R_i α_i + R_o α_o)/(R_i + R_o) ,

α_i, α_o being the angles by which the races of radii R_i, R_o have turned, in rolling without slip.
A defect of the width w and the depth d, as long as the rollers, lets down a roller of radius r

    drop = min(d, (w/2 − |a|)²/2ρ),   1/ρ = 1/r + 1/R_i or 1/r − 1/R_o ,

where it rests on the edge that is nearer; a is how far, along the race, the roller's middle is off
the middle of the defect. That of a roller, number 1, drops where it faces a race: with the roller's
own turns (R_o/r)(α_o − ψ), at the outer race and half a turn later at the inner one. Impact on the
edges beyond what the drop's course does to the bearing's parts, and slip, are left out.

Parameters: K in N/m^(10/9), gap m, rollers of a row, rows, stiffness of the linear bearing in its
place (radial N/m, tilt N m/rad), the system's angle that turns a race, the cage's turns for one of
it, number of defects; then the rows' places z, m, then ``DEFECT`` of every defect.

Sources: Harris, Kotzalas 2006, Essential Concepts of Bearing Technology, ch. 6 and 7; ISO/TS
16281:2008; the drop is the geometry of two circles.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from flexgear.arrays import Array
from flexgear.compiled import INNER, UNCOUNTED, njit
from flexgear.coupling.laws.basic import clear
from flexgear.coupling.laws.law import Law, compiled_law
from flexgear.model.bearings import Bearing, Rollers, RollingElements
from flexgear.model.faults import Fault

EXPONENT = 10.0 / 9.0
LOOSE = 1e-4  # share of the linear stiffness in the tangent of a bearing without load
STIFFNESS, GAP, COUNT, ROWS, RADIAL, TILT, TURNED, CAGE, DEFECTS, PLACES = range(10)
# 1 of a race, 0 of roller 1; row; turns of it for one of the angle; angle at the start, rad; radius
# on which it lies, half of its width, depth, m; 1/2ρ, 1/m
ON_RACE, ROW, RATE, START, RADIUS, HALF, DEPTH, CURVATURE, DEFECT = range(9)


class RaceRates(NamedTuple):
    """By how much inner and outer race turn against the axes of x, y for one of the system's angle;
    load_zone: where along ψ a roller is that lies towards +x, rad."""

    inner: float
    outer: float
    load_zone: float = 0.0


def roller_stiffness(length: float) -> float:
    """K of a steel roller between two raceways, N/m^(10/9); length m."""
    return float(35948.0 * (1e3 * length) ** (8 / 9) * 1e3**EXPONENT)


def roller_parameters(rollers: Rollers, radial: float, tilt: float) -> list[float]:
    """Parameters of the law; radial, tilt: of the linear bearing."""
    stiffness = roller_stiffness(rollers.length)
    counts = float(rollers.count), float(rollers.rows)
    at_rest = [radial, tilt, 0.0, 0.0, 0.0]
    return [stiffness, rollers.clearance, *counts, *at_rest, *rollers.places]


def with_defects(
    parameters: Array,
    elements: RollingElements,
    rates: RaceRates,
    faults: Sequence[Fault],
) -> Array:
    """Parameters of a bearing whose rollers pass and which has these defects."""
    roller = 0.5 * elements.diameter
    inner, outer = (0.5 * elements.pitch_diameter + sign * roller for sign in (-1, 1))
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
    passing = np.array([*parameters, *np.ravel(blocks)])
    passing[[CAGE, DEFECTS]] = cage, len(blocks)
    return passing


@njit(**INNER)
def _drop(parameters, row, i, psi):
    """By how much defects let down roller i, at ψ, of a row."""
    drop, at = 0.0, PLACES + int(parameters[ROWS])
    for _ in range(int(parameters[DEFECTS])):
        on_race = parameters[at + ON_RACE] == 1.0
        if parameters[at + ROW] == row and (on_race or i == 0):
            angle = parameters[at + RATE] * parameters[TURNED] + parameters[at + START]
            turns = ((psi - angle) if on_race else angle) / (2.0 * math.pi)
            away = 2.0 * math.pi * abs(turns - math.floor(turns + 0.5)) * parameters[at + RADIUS]
            inside = parameters[at + HALF] - away
            if inside > 0.0:
                drop += min(parameters[at + DEPTH], parameters[at + CURVATURE] * inside * inside)
        at += DEFECT
    return drop


@njit(**INNER)
def _closed(parameters, row, i, motion):
    """cos ψ, sin ψ, z of roller i of a row, and by how much it has closed at motions (4,)."""
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
    """Loads (t, rows, Z) at motions (t, 4) and angles (t,); parameters change on the way."""
    for t in range(out.shape[0]):
        parameters[TURNED] = turned[t]
        for row in range(out.shape[1]):
            for i in range(out.shape[2]):
                delta = _closed(parameters, row, i, motion[t])[3]
                out[t, row, i] = parameters[STIFFNESS] * max(delta, 0.0) ** EXPONENT


def roller_loads(parameters: Array, motion: Array, turned: Array) -> Array:
    """Load of every roller (t, rows, Z) N at motions (t, 4): x, y, r_x, r_y; turned (t,): the
    system's angle that turns a race."""
    out = np.empty((len(motion), int(parameters[ROWS]), int(parameters[COUNT])))
    _loads(np.array(parameters), np.ascontiguousarray(motion), turned, out)
    return out


@compiled_law
def _rollers(parameters, motion, force, tangent):
    """Sums over all rollers; the way of a roller is g · (x, y, r_x, r_y)."""
    k = parameters[STIFFNESS]
    clear(force, tangent)
    energy = 0.0
    for row in range(int(parameters[ROWS])):
        for i in range(int(parameters[COUNT])):
            c, s, z, delta = _closed(parameters, row, i, motion[0])
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


ROLLERS = Law(
    "rollers", _rollers, (0, 1, 3, 4), _nominal, _stated_by, part_loads=roller_loads, turned=TURNED
)
