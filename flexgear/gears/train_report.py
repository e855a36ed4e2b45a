"""What ``flexgear check`` tells about the stages of a train: assembly, gears, gear meshes.

Data only. Keys end in their unit, as those of case files do. Speeds and forces are the power
flow's.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from flexgear.gears.contact import ASSEMBLY_TOLERANCE, GearMeshPath
from flexgear.gears.messages import gear_mesh_name
from flexgear.gears.paths import assembly_misfit, stage_paths
from flexgear.gears.tooth import ToothGeometry
from flexgear.gears.train_geometry import PER_PAIR_MODELS, TrainGeometry, train_geometry
from flexgear.gears.train_laws import iso_peak_of

if TYPE_CHECKING:
    from flexgear.model.case import Case
    from flexgear.model.train_stage import TrainStage

Report = dict[str, dict[str, Any]]
PART_OF_SLOT = {"sun": "pinion", "planet": "gear"}


def train_report(train: Case) -> Report:
    """Sections of all stages: "assembly" if there is one stage, else "stage_1 assembly".

    Raises InputError, with the stage named, for gears that cannot mesh, collide or do not assemble.
    """
    report: Report = {}
    for stage in train.stages:
        before = f"{stage.name} " if len(train.stages) > 1 else ""
        report |= {before + name: rows for name, rows in stage_report(train, stage).items()}
    return report


def stage_report(train: Case, stage: TrainStage) -> Report:
    """Sections "assembly", the gears, and "sun_gear_mesh", "ring_gear_mesh" (parallel stage:
    "gear_mesh"). Lengths of gears are diameters; stiffness is along the 3D normal and, in a
    double-helical stage, of one half, as face width and contact ratios are."""
    g, paths = train_geometry(stage, train.source), stage_paths(train, stage)
    parallel = stage.kind == "parallel"
    report: Report = {"assembly": _assembly(stage, g)}
    for slot, gear in g.gears.items():
        report[PART_OF_SLOT[slot] if parallel else slot] = _gear(gear, getattr(g.radii, slot))
    side = "left" if stage.double_helical else ""
    for slot in g.gear_meshes:
        name = "gear_mesh" if parallel else f"{gear_mesh_name(stage, slot)}_gear_mesh"
        report[name] = _gear_mesh(train, stage, g, slot, paths[slot, side])
    return report


def _assembly(stage: TrainStage, g: TrainGeometry) -> dict[str, Any]:
    rows: dict[str, Any] = {"center_distance_mm": 1e3 * g.radii.center_distance}
    if stage.kind == "planetary":
        misfit = assembly_misfit(stage, g)
        rows = {
            "planets": stage.planets,
            "(z_sun + z_ring)/N": g.assembly,
            "assembles": misfit <= ASSEMBLY_TOLERANCE,
            "largest_misfit_of_a_sun_tooth_in_pitches": misfit,
            **rows,
        }
        if math.isfinite(g.planet_clearance):
            rows["planet_clearance_mm"] = 1e3 * g.planet_clearance
    rows["transverse_pressure_angle_deg"] = math.degrees(g.radii.transverse_angle)
    rows["base_helix_angle_deg"] = math.degrees(g.radii.base_helix_angle)
    if stage.double_helical:
        rows["halves"] = 2
        rows["face_width_of_a_half_mm"] = 1e3 * stage.face_width
    if g.overridden:
        rows["radii"] = "as given, not those of the teeth"
    return rows


def _gear(gear: ToothGeometry, base_radius: float) -> dict[str, Any]:
    return {
        "teeth": gear.teeth,
        "reference_diameter_mm": 2e3 * gear.reference_radius,
        "base_diameter_mm": 2e3 * base_radius,
        "tip_diameter_mm": 2e3 * gear.tip_radius,
        "root_diameter_mm": 2e3 * gear.root_radius,
    }


def _gear_mesh(
    train: Case, stage: TrainStage, g: TrainGeometry, slot: str, path: GearMeshPath
) -> dict[str, Any]:
    gear_mesh = g.gear_meshes[slot]
    start = (path.s0 - path.s_lo) / path.base_pitch
    rows: dict[str, Any] = {
        "working_pressure_angle_deg": math.degrees(gear_mesh.working_angle),
        "transverse_contact_ratio": gear_mesh.transverse_contact_ratio,
        "overlap_ratio": gear_mesh.overlap_ratio,
        "contact_ratio": gear_mesh.total_contact_ratio,
        "base_pitch_mm": 1e3 * path.base_pitch,
        "path_of_contact_mm": [1e3 * path.s_lo, 1e3 * path.s_hi],
        "backlash_um": 1e6 * path.backlash,
        "place_of_first_pair_in_pitches": _share(start[0]),
    }
    if stage.kind == "planetary":
        rows["phase_of_planets_in_pitches"] = [_share(x - start[0]) for x in start]
    rows["stiffness"] = stage.gear_mesh.model
    rows["mean_stiffness_n_per_m"] = path_mean_stiffness(path)
    low, high = _stiffness_range(path)
    rows["least_stiffness_n_per_m"], rows["largest_stiffness_n_per_m"] = low, high
    if stage.gear_mesh.model in PER_PAIR_MODELS:
        rows["pair_stiffness_peak_n_per_m"] = float(path.k_grid.max())
    if not g.overridden:
        rows["iso_single_stiffness_n_per_mm_um"] = iso_peak_of(train, stage, slot) / 1e9
    return rows


def _share(x: float) -> float:
    """x modulo 1, and 0 for what is 1 but for rounding."""
    return round(float(x) % 1.0, 9) % 1.0


def path_mean_stiffness(path: GearMeshPath) -> float:
    """Mean over a base pitch, N/m: of the wave, or of all pairs together."""
    if path.wave is not None:
        return float(path.wave.mean())
    k = path.k_grid
    area = float(np.sum(0.5 * (k[1:] + k[:-1]) * np.diff(path.s_grid)))
    return area / path.base_pitch


def _stiffness_range(path: GearMeshPath) -> tuple[float, float]:
    """Least and largest stiffness of the gear mesh over a base pitch, N/m."""
    if path.wave is not None:
        return float(path.wave.min()), float(path.wave.max())
    x = path.s_lo + path.base_pitch * np.arange(256) / 256
    count = math.ceil((path.s_grid[-1] - path.s_grid[0]) / path.base_pitch) + 1
    s = x + path.base_pitch * np.arange(-count, count + 1)[:, None]
    total = np.interp(s, path.s_grid, path.k_grid, left=0.0, right=0.0).sum(axis=0)
    return float(total.min()), float(total.max())
