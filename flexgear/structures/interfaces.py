"""Where ring and carrier are tied, and what holds them there: interface nodes and supports.

Nodes, in order. Ring: tooth_001.. at the reference circle and mid-face, fit_1.. and spline_1.. on
the axis, bolt_01.. on the bolt circles in the bolted faces. Carrier: drive, bearing_drive,
bearing_far on the axis at the middle of their patches, pin_1.. on the pins' axes at mid-face.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from flexgear.gears.geometry import stage_geometry
from flexgear.model.ring import End
from flexgear.model.ring_supports import ring_supports as ring_held
from flexgear.model.stage_view import StageView
from flexgear.structures.fem import (
    FeModel,
    Interface,
    averaging_tie,
    disc_points,
    facet_sample,
    interface_of,
    point_sample,
    rigid_tie,
)
from flexgear.structures.fem.ties import Tie
from flexgear.structures.springs import carrier_springs, ring_springs, stiffness_at


class Nodes(Protocol):
    """Named nodes: an interface or a reduced body."""

    @property
    def node_names(self) -> tuple[str, ...]:
        """(n,) names."""

    @property
    def positions(self) -> NDArray[np.float64]:
        """(n, 3) m."""


def ring_interface(view: StageView, model: FeModel) -> Interface:
    """Ties of teeth, then of fits, splines and bolts, see `model/ring_supports.py`."""
    ring, patches = view.ring, model.fe_mesh.facets
    tie = rigid_tie if ring.tie_kind == "rigid" else averaging_tie
    radius = stage_geometry(view).ring.reference_radius
    ties: list[Tie] = []
    for j in range(view.ring_gear.teeth):
        angle = 2 * np.pi * j / view.ring_gear.teeth
        sample = facet_sample(model, patches[f"tooth_{ring.tie}_{j + 1:03d}"])
        position = radius * np.array([np.cos(angle), np.sin(angle), 0.0])
        ties.append(tie(f"tooth_{j + 1:03d}", position, sample))
    for support in ring_held(ring, view.stage.face_width):
        position = np.array(support.place)
        if support.end is None:
            sample = facet_sample(model, patches[support.group])
            ties.append(averaging_tie(support.node, position, sample))
            continue
        position[2] = _bolted_face(model, support.end)
        if support.group:
            ties.append(tie(support.node, position, facet_sample(model, patches[support.group])))
        else:
            outward = np.array([np.cos(support.angle), np.sin(support.angle), 0.0])
            disc = disc_points(position, np.array([0.0, 0.0, 1.0]), support.diameter, outward)
            ties.append(averaging_tie(support.node, position, point_sample(model, *disc)))
    return interface_of(model, ties)


def _bolted_face(model: FeModel, end: End) -> float:
    """z of an end face, m: the group's, or the body's end where there is none."""
    name = "end_plus" if end == "+z" else "end_minus"
    points, facets = np.asarray(model.fe_mesh.points), model.fe_mesh.facets
    z = points[facets[name] if name in facets else slice(None)][..., 2]
    return float(z.max() if end == "+z" else z.min())


def carrier_interface(view: StageView, model: FeModel) -> Interface:
    """Ties of drive flange, bearing seats and pins."""
    patches = model.fe_mesh.facets
    ties = []
    for name in ("drive", "bearing_drive", "bearing_far"):
        sample = facet_sample(model, patches[name])
        z = float(sample.weights @ sample.points[:, 2] / sample.weights.sum())
        ties.append(averaging_tie(name, np.array([0.0, 0.0, z]), sample))
    radius = stage_geometry(view).center_distance
    for i, angle in enumerate(view.stage.planet_angles):
        position = radius * np.array([np.cos(angle), np.sin(angle), 0.0])
        name = f"pin_{i + 1}"
        ties.append(averaging_tie(name, position, facet_sample(model, patches[name])))
    return interface_of(model, ties)


def ring_supports(view: StageView, body: Nodes) -> NDArray[np.float64]:
    """Stiffness (b, b) of the ring's springs to ground at its interface nodes."""
    return stiffness_at(ring_springs(view), body.node_names)


def carrier_supports(
    view: StageView, body: Nodes, stiffness: NDArray[np.float64]
) -> NDArray[np.float64]:
    """The same of the carrier, and its drive node held against rotation about the axis."""
    supports = stiffness_at(carrier_springs(view), body.node_names)
    held = 6 * body.node_names.index("drive") + 5
    supports[held, held] += 1e3 * stiffness[held, held]
    return supports
