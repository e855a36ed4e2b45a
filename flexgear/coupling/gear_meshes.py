"""From gear theory to the arrays of the gear-mesh elements."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from flexgear.coupling.pairs import KINDS, SLOTS, PairData
from flexgear.gears.contact import GearMeshPath, gear_mesh_paths
from flexgear.gears.errors import PairErrors, pair_errors
from flexgear.gears.geometry import StageGeometry
from flexgear.model.case import Case
from flexgear.model.errors import FlexgearError

Array = NDArray[np.float64]
SupportRow = tuple[float, Sequence[tuple[int, Array]]]


def _tables(paths: Sequence[GearMeshPath]) -> tuple[Array, Array, Array, Array]:
    """Stiffness and centroid tables of equal length on uniform grids: start, step, k, z."""
    size = max(len(p.s_grid) for p in paths)
    start, step, k, z = [], [], [], []
    for p in paths:
        grid = np.linspace(p.s_grid[0], p.s_grid[-1], size)
        start.append(grid[0])
        step.append(grid[1] - grid[0])
        k.append(np.interp(grid, p.s_grid, p.k_grid))
        z.append(np.interp(grid, p.s_grid, p.zc_grid))
    return np.array(start), np.array(step), np.array(k), np.array(z)


def _errors(
    errors: Sequence[PairErrors], planets: int, teeth: int, planet_teeth: int
) -> tuple[Array, Array, Array, Array, Array]:
    count = len(errors)
    gear = np.zeros((count, teeth))
    planet = np.zeros((count, planets, planet_teeth))
    for g, e in enumerate(errors):
        gear[g, : len(e.gear_tooth)] = e.gear_tooth
        planet[g] = e.planet_tooth
    return (
        np.array([e.harmonic_amplitude for e in errors]),
        np.array([e.harmonic_phase for e in errors]),
        np.array([e.offset for e in errors]),
        gear,
        planet,
    )


def _supports(
    rows: Sequence[SupportRow], turns: Sequence[int], first_block: int
) -> tuple[NDArray[np.int64], Array, Array, NDArray[np.int64]]:
    count = len(rows)
    block = np.full((count, 2), -1, dtype=np.int64)
    vector = np.zeros((count, 2, 6))
    turning = np.zeros((count, 2), dtype=np.int64)
    for r, (_, ends) in enumerate(rows):
        for e, (node, w) in enumerate(ends):
            block[r, e], vector[r, e] = first_block + node, w
            turning[r, e] = turns[node]
    return block, vector, np.array([r[0] for r in rows], dtype=float), turning


def pair_data(
    case: Case,
    geometry: StageGeometry,
    *,
    tooth_positions: Array,
    planet_polar: float,
    sun_polar: float,
    supports: Sequence[SupportRow],
    support_turns: Sequence[int],
    first_support_block: int,
) -> PairData:
    """Arrays of all gear meshes of a stage.

    tooth_positions: (z_r, 3) m of the ring's tooth nodes; planet_polar, sun_polar: kg m², for the
    equivalent mass on the line of action 1/m = r_bp²/J_p + r_b²/J (ring held: J → ∞), from which
    pair damping is c = 2 ζ √(k m).
    """
    stage, options = case.stage, case.gear_mesh
    one_sided = options.contact_law == "one-sided"
    by_kind, errors_by_kind = gear_mesh_paths(case), pair_errors(case)
    kinds = KINDS if one_sided else KINDS[:2]
    paths = [by_kind[k] for k in kinds]
    if len(tooth_positions) != stage.ring.teeth:
        raise FlexgearError(
            f"the ring body has {len(tooth_positions)} tooth nodes for {stage.ring.teeth} teeth"
        )
    for p in paths:
        reach = p.s_hi - p.s_lo + 2 * abs(p.slope) * p.half_face
        if reach / p.base_pitch > SLOTS:
            raise FlexgearError(
                f"more than {SLOTS} tooth pairs of the {p.kind} gear mesh are in contact at once "
                f"(contact ratio {reach / p.base_pitch:.2f})"
            )
    start, step, k_table, z_table = _tables(paths)
    teeth = max(stage.ring.teeth, stage.sun.teeth)
    amplitude, phase, offset, gear, planet = _errors(
        [errors_by_kind[k] for k in kinds], stage.planets, teeth, stage.planet.teeth
    )
    mass = []
    for p in paths:
        inverse = p.base_radius_planet**2 / planet_polar
        if p.kind.startswith("sun"):
            inverse += p.base_radius_gear**2 / sun_polar
        mass.append(1.0 / inverse)
    block, vector, stiffness, turning = _supports(supports, support_turns, first_support_block)
    slope = np.array([p.slope for p in paths])

    def ints(values: Sequence[object]) -> NDArray[np.int64]:
        return np.array(values, dtype=np.int64)

    def reals(values: Sequence[object]) -> Array:
        return np.array(values, dtype=float)

    return PairData(
        planets=stage.planets,
        ring_teeth=stage.ring.teeth,
        lumped=options.model == "lumped",
        one_sided=one_sided,
        center_distance=geometry.center_distance,
        phi=reals(stage.planet_angles),
        tooth_position=np.ascontiguousarray(tooth_positions, dtype=float),
        is_ring=ints([p.kind.startswith("ring") for p in paths]),
        s0=reals([p.s0 for p in paths]),
        rate=reals([p.rate for p in paths]),
        pitch=reals([p.base_pitch for p in paths]),
        s_lo=reals([p.s_lo for p in paths]),
        s_hi=reals([p.s_hi for p in paths]),
        slope=slope,
        half_face=float(paths[0].half_face),
        normal=reals([p.normal_xy for p in paths]),
        tangent_point=reals([p.tangent_point for p in paths]),
        cos_b=1.0 / np.sqrt(1.0 + slope**2),
        sin_b=slope / np.sqrt(1.0 + slope**2),
        s_pitch=reals([p.base_radius_planet * math.tan(p.alpha) for p in paths]),
        gap=reals([p.backlash if p.kind.endswith("back") else 0.0 for p in paths]),
        table_start=start,
        table_step=step,
        k_table=k_table,
        z_table=z_table,
        gear_tooth0=ints([p.gear_tooth0 for p in paths]),
        gear_step=ints([p.gear_step for p in paths]),
        gear_teeth=ints([p.gear_teeth for p in paths]),
        planet_tooth0=ints([p.planet_tooth0 for p in paths]),
        planet_step=ints([p.planet_step for p in paths]),
        planet_teeth=stage.planet.teeth,
        error_amplitude=amplitude,
        error_phase=phase,
        error_offset=offset,
        error_gear=gear,
        error_planet=planet,
        largest_error=offset
        + np.abs(amplitude)
        + np.abs(gear).max(axis=1)[:, None]
        + np.abs(planet).max(axis=2),
        damping=2 * options.damping_ratio * np.sqrt(np.array(mass)),
        support_block=block,
        support_vector=vector,
        support_stiffness=stiffness,
        support_turns=turning,
    )
