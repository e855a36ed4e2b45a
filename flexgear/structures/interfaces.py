"""How ring and carrier are tied at their interface nodes, and what holds them there."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from flexgear.model.names import NodeName
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
    seat_tie,
)
from flexgear.structures.fem.ties import Tie
from flexgear.structures.nodes import SEATS, carrier_nodes, ring_nodes
from flexgear.structures.springs import carrier_springs, ring_springs, stiffness_at

Array = NDArray[np.float64]
AXIS = np.array([0.0, 0.0, 1.0])


class Nodes(Protocol):
    """Named nodes: an interface or a reduced body."""

    @property
    def node_names(self) -> tuple[str, ...]:
        """(n,) names."""

    @property
    def positions(self) -> Array:
        """(n, 3) m."""


def ring_interface(view: StageView, model: FeModel) -> Interface:
    """Ties of teeth, then of fits, splines and bolts, see `model/ring_supports.py`."""
    ring, patches, nodes = view.ring, model.fe_mesh.facets, ring_nodes(view, model.fe_mesh)
    tie = rigid_tie if ring.tie_kind == "rigid" else averaging_tie
    ties: list[Tie] = []
    for j in range(view.ring_gear.teeth):
        sample = facet_sample(model, patches[f"tooth_{ring.tie}_{j + 1:03d}"])
        name = NodeName.of("tooth", j + 1, digits=3)
        ties.append(tie(name, nodes[name], sample))
    for support in ring_held(ring, view.stage.face_width):
        place = nodes[support.node]
        if support.end is None:
            sample = facet_sample(model, patches[support.group])
            ties.append(averaging_tie(support.node, place, sample))
        elif support.group:
            ties.append(tie(support.node, place, facet_sample(model, patches[support.group])))
        else:
            outward = np.array([np.cos(support.angle), np.sin(support.angle), 0.0])
            disc = disc_points(place, np.array([0.0, 0.0, 1.0]), support.diameter, outward)
            ties.append(averaging_tie(support.node, place, point_sample(model, *disc)))
    return interface_of(model, ties)


def carrier_interface(view: StageView, model: FeModel) -> Interface:
    """Ties of the drive flange, of bearing seats and of pins, whose axes are along z.

    Pins are seats of planet bearings; carrier bearings are narrow beside their diameter and hold
    the carrier by shoulders as well, so their nodes average the whole displacement.
    """
    ties: list[Tie] = []
    for name, place in carrier_nodes(view, model.fe_mesh).items():
        sample = facet_sample(model, model.fe_mesh.facets[name])
        if name in SEATS:
            ties.append(averaging_tie(name, place, sample))
        else:
            ties.append(seat_tie(name, place, AXIS, sample))
    return interface_of(model, ties)


def ring_supports(view: StageView, body: Nodes) -> Array:
    """Stiffness (b, b) of the ring's springs to ground at its interface nodes."""
    return stiffness_at(ring_springs(view), body.node_names)


def carrier_supports(view: StageView, body: Nodes, stiffness: Array) -> Array:
    """The same of the carrier, and its drive node held against rotation about the axis."""
    supports = stiffness_at(carrier_springs(view), body.node_names)
    held = 6 * body.node_names.index("drive") + 5
    supports[held, held] += 1e3 * stiffness[held, held]
    return supports
