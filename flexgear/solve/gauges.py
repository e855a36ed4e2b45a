"""Strain of virtual gauges and stress of rims as rows that act on the coordinates of a system."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexgear.coupling.system import System
from flexgear.gears.geometry import stage_geometry
from flexgear.model.case import Case
from flexgear.model.gauge import Gauge
from flexgear.model.material import Material
from flexgear.model.names import BodyName
from flexgear.model.stage_view import StageView
from flexgear.solve.bodies import Bodies
from flexgear.structures.reduced import ReducedBody
from flexgear.structures.surface_strain import Ray, Surface

Array = NDArray[np.float64]


class GaugeRows(NamedTuple):
    """names: "stage.gauge"; strain (g, d): what they measure."""

    names: list[str]
    strain: Array


def gauge_rows(case: Case, system: System, bodies: Bodies) -> GaugeRows:
    """Of all FE rings of a case. InputError for a gauge beside the FE mesh."""
    names: list[str] = []
    strain = [np.zeros((0, system.size))]
    for view, ring in _rings(case, bodies):
        gauges = view.ring_gear.gauges
        if not gauges:
            continue
        names += [f"{view.name}.{gauge.name}" for gauge in gauges]
        if ring is None:
            strain.append(np.zeros((len(gauges), system.size)))
            continue
        surface_strain = Surface(ring).strain([_ray(view, gauge) for gauge in gauges])
        rows = surface_strain.along([gauge.direction for gauge in gauges])
        for i in np.flatnonzero(np.isnan(rows).any(axis=1)):
            raise view.refuse(
                f"ring.gauges.{i}", "lies beside the FE mesh", "compare its place with the ring's"
            )
        strain.append(_placed(system, view, rows))
    return GaugeRows(names, np.vstack(strain))


def _ray(view: StageView, gauge: Gauge) -> Ray:
    """Where a gauge is: on the outer surface, or in a root at the tooth's critical section, which
    the helix turns with z."""
    if gauge.tooth is None:
        assert gauge.angle is not None  # the model wants one of both
        return Ray(gauge.angle, gauge.z)
    geometry, stage = stage_geometry(view), view.stage
    hand = 1.0 if stage.planet_hand == "right" else -1.0
    twist = hand * math.tan(stage.helix_angle) / geometry.ring.reference_radius
    section = geometry.ring.root.section
    angle = math.atan2(section.thickness / 2, section.distance)
    side = -1.0 if gauge.side == "-theta" else 1.0
    middle = geometry.ring.pitch_angle * (gauge.tooth - 1) + twist * gauge.z
    return Ray(middle + side * angle, gauge.z, first=True)


def rim_stress_rows(case: Case, system: System, bodies: Bodies) -> Array:
    """(z, d) stress along the circumference on the outer surface over every tooth of every FE ring
    at mid-face, Pa, in the order of the tooth nodes; not a number where a ring has no FE mesh."""
    stress = [np.zeros((0, system.size))]
    for view, ring in _rings(case, bodies):
        if ring is None:
            stress.append(np.zeros((_teeth(system, view), system.size)))
            continue
        stress.append(_placed(system, view, _rim(view.material, ring, view.ring_gear.teeth)))
    return np.vstack(stress)


def _rings(case: Case, bodies: Bodies) -> Iterator[tuple[StageView, ReducedBody | None]]:
    """Stages with an FE ring, and its body; None where it is rigid."""
    for stage, view in case.fe_ring_stages.items():
        yield view, bodies.get(BodyName.of(stage, "ring"))


def _teeth(system: System, view: StageView) -> int:
    """Tooth nodes of a stage's ring."""
    nodes = system.body(f"{view.name}.ring").nodes
    return sum(node.kind == "tooth" for node in nodes)


def _rim(material: Material, ring: ReducedBody, teeth: int) -> Array:
    """(z, d) stress along the circumference over the teeth, Pa."""
    at = [k for k, node in enumerate(ring.nodes) if node.kind == "tooth"]
    if not len(ring.cells):
        return np.full((len(at), len(ring.mass)), np.nan)
    angles = 2 * np.pi * np.array([ring.nodes[k].number - 1 for k in at]) / teeth
    middle = ring.positions[at, 2]
    rays = [Ray(float(angle), float(z)) for angle, z in zip(angles, middle, strict=True)]
    strain = Surface(ring).strain(rays)
    return strain.hoop_stress(material.young_modulus, material.poisson_ratio)


def _placed(system: System, view: StageView, rows: Array) -> Array:
    """Rows on a ring's coordinates as rows on all; zero where it is rigid."""
    out, body = np.zeros((len(rows), system.size)), f"{view.name}.ring"
    if not system.body(body).rigid:
        out[:, system.slice_of(body)] = rows
    return out
