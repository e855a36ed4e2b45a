"""Strain of virtual gauges and stress of rims as rows that act on the coordinates of a system."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexgear.coupling.system import System
from flexgear.model.case import Case
from flexgear.model.material import Material
from flexgear.solve.bodies import Bodies
from flexgear.structures.reduced import ReducedBody
from flexgear.structures.surface_strain import Ray, Surface, gauge_ray

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class SurfaceRows:
    """gauges: names, "stage.gauge"; gauge_strain (g, d): their strain; rim_stress (z, d): stress
    along the circumference on the outer surface over every tooth of every FE ring at mid-face, Pa,
    in the order of the tooth nodes; not a number where a ring was given without FE mesh."""

    gauges: list[str]
    gauge_strain: Array
    rim_stress: Array


def surface_rows(case: Case, system: System, bodies: Bodies) -> SurfaceRows:
    """Of all FE rings of a case. InputError for a gauge beside the FE mesh."""
    names: list[str] = []
    strain, stress = [np.zeros((0, system.size))], [np.zeros((0, system.size))]
    for stage, view in case.flexible_stages.items():
        ring = bodies[stage].ring if stage in bodies else None
        if ring is None:
            continue
        body, surface = f"{stage}.ring", Surface(ring)
        gauges = view.stage.ring.gauges if view.stage.ring is not None else ()
        found = surface.strain([gauge_ray(view, gauge) for gauge in gauges])
        rows = found.along([gauge.direction for gauge in gauges])
        for i in np.flatnonzero(np.isnan(rows).any(axis=1)):
            raise view.refuse(
                f"ring.gauges.{i}", "lies beside the FE mesh", "compare its place with the ring's"
            )
        names += [f"{stage}.{gauge.name}" for gauge in gauges]
        strain.append(_placed(system, body, rows))
        stress.append(_placed(system, body, _rim(view.material, ring, surface)))
    return SurfaceRows(names, np.vstack(strain), np.vstack(stress))


def _rim(material: Material, ring: ReducedBody, surface: Surface) -> Array:
    """(z, d) stress along the circumference over the teeth, Pa."""
    teeth = sum(name.startswith("tooth_") for name in ring.node_names)
    if not len(ring.cells):
        return np.full((teeth, len(ring.mass)), np.nan)
    angles = 2 * np.pi * np.arange(teeth) / teeth
    strain = surface.strain([Ray(float(angle), 0.0) for angle in angles])
    return strain.hoop_stress(material.young_modulus, material.poisson_ratio)


def _placed(system: System, body: str, rows: Array) -> Array:
    """Rows on a body's coordinates as rows on all; zero where it is rigid."""
    out = np.zeros((len(rows), system.size))
    if not system.body(body).rigid:
        out[:, system.slice_of(body)] = rows
    return out
