"""What ``flexgear check`` tells about a case: geometry, phasing, speeds, forces; data only."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from flexgear.gears.contact import assembly_mismatch, gear_mesh_paths
from flexgear.gears.geometry import GearMeshGeometry, StageGeometry, stage_geometry
from flexgear.gears.kinematics import stage_kinematics
from flexgear.gears.laws import compliance, iso_peak

if TYPE_CHECKING:
    from flexgear.model.flexible_stage import FlexibleStage

RPM = 30.0 / math.pi


@dataclass(frozen=True)
class Row:
    """One line: section, label, value in ``unit``; note says whether all is well."""

    section: str
    label: str
    value: float | str
    unit: str = ""
    note: str = ""


def check_case(case: FlexibleStage) -> list[Row]:
    """All rows. Raises InputError for gears that cannot mesh, collide or do not assemble."""
    g = stage_geometry(case.stage, case.source)
    paths = gear_mesh_paths(case)  # refuses planets that do not assemble
    rows = [*_assembly(case, g), *_diameters(case, g)]
    for name, gear_mesh in (("ring", g.ring_mesh), ("sun", g.sun_mesh)):
        rows += _gear_mesh(case, g, name, gear_mesh)
        rows.append(
            Row(f"planet–{name}", "largest pair stiffness", paths[name].k_grid.max() / 1e9, "GN/m")
        )
        rows += _phasing(name, paths[name].s0 / paths[name].base_pitch)
    return [*rows, *_motion(case)]


def _assembly(case: FlexibleStage, g: StageGeometry) -> list[Row]:
    off = np.abs(assembly_mismatch(g, np.asarray(case.stage.planet_angles))).max()
    note = "planets assemble" if off < 1e-3 else "planets do not assemble (override is set)"
    return [
        Row("assembly", "(z_sun + z_ring)/planets", g.assembly, "", note),
        Row("assembly", "largest misfit of a sun tooth", off, "pitches"),
        Row("assembly", "gap between planet tips", g.planet_clearance * 1e3, "mm"),
        Row("assembly", "centre distance", g.center_distance * 1e3, "mm"),
        Row("assembly", "transverse pressure angle", math.degrees(g.transverse_angle), "deg"),
        Row("assembly", "base helix angle", math.degrees(g.base_helix_angle), "deg"),
    ]


def _diameters(case: FlexibleStage, g: StageGeometry) -> list[Row]:
    rows = []
    for name in ("sun", "planet", "ring"):
        gear = getattr(g, name)
        for label, radius in (
            ("reference diameter", gear.reference_radius),
            ("base diameter", gear.base_radius),
            ("tip diameter", gear.tip_radius),
            ("root diameter", gear.root_radius),
        ):
            rows.append(Row(name, label, 2e3 * radius, "mm"))
    rim = g.ring.root_radius + case.ring.rim_thickness
    rows.append(Row("ring", "outer diameter", 2e3 * rim, "mm"))
    return rows


def _gear_mesh(case: FlexibleStage, g: StageGeometry, name: str, m: GearMeshGeometry) -> list[Row]:
    section = f"planet–{name}"
    split = compliance(case, g, name)
    theory = 1e-9 / (split.total * math.cos(g.base_helix_angle) ** 2)
    low = math.floor(m.total_contact_ratio)
    share = m.total_contact_ratio - low
    return [
        Row(section, "working pressure angle", math.degrees(m.working_angle), "deg"),
        Row(section, "transverse contact ratio", m.transverse_contact_ratio),
        Row(section, "overlap ratio", m.overlap_ratio),
        Row(
            section,
            "total contact ratio",
            m.total_contact_ratio,
            "",
            f"{low} pairs {100 * (1 - share):.0f} %, {low + 1} pairs {100 * share:.0f} % of time",
        ),
        Row(section, "normal backlash", m.backlash * 1e3, "mm"),
        Row(section, "c' after ISO 6336-1", iso_peak(case, name) / 1e9, "N/(mm µm)"),
        Row(section, "c' after Weber and Banaschek", float(theory.max()), "N/(mm µm)"),
    ]


def _phasing(name: str, position: np.ndarray) -> list[Row]:
    """Phase of planet i against planet 1, in gear-mesh periods from 0 to 1."""
    phase = (position - position[0]) % 1.0
    phase = np.where(phase > 1 - 1e-9, 0.0, phase)
    return [
        Row(
            f"planet–{name}",
            "phases of the planets",
            ", ".join(f"{p:.3f}" for p in phase),
            "periods",
            "in phase" if np.ptp(phase) < 1e-6 else "",
        )
    ]


def _motion(case: FlexibleStage) -> list[Row]:
    k = stage_kinematics(case)
    return [
        Row("motion", "carrier speed", k.carrier_speed * RPM, "r/min"),
        Row("motion", "sun speed", k.sun_speed * RPM, "r/min"),
        Row("motion", "planet speed (absolute)", k.planet_speed * RPM, "r/min"),
        Row("motion", "ratio", k.ratio),
        Row("motion", "gear mesh frequency", k.gear_mesh_frequency, "Hz"),
        Row("motion", "input torque", k.input_torque / 1e3, "kN m"),
        Row("motion", "output torque", k.output_torque / 1e3, "kN m"),
        Row("motion", "torque on the ring", k.ring_torque / 1e3, "kN m"),
        Row("motion", "force of each ring gear mesh", k.ring_mesh_force / 1e3, "kN"),
        Row("motion", "force of each sun gear mesh", k.sun_mesh_force / 1e3, "kN"),
    ]
