"""Finite elements: stiffness, mass and interface ties. The only place that imports scikit-fem."""

from flexgear.structures.fem.assembly import FeModel, plane_strain, solid_mesh
from flexgear.structures.fem.sampling import (
    Sample,
    disc_points,
    edge_nodes,
    element_gradient,
    facet_nodes,
    facet_sample,
    nodes_between,
    point_sample,
)
from flexgear.structures.fem.ties import Interface, averaging_tie, interface_of, rigid_tie, seat_tie

__all__ = [
    "FeModel",
    "Interface",
    "Sample",
    "averaging_tie",
    "disc_points",
    "edge_nodes",
    "element_gradient",
    "facet_nodes",
    "facet_sample",
    "interface_of",
    "nodes_between",
    "plane_strain",
    "point_sample",
    "rigid_tie",
    "seat_tie",
    "solid_mesh",
]
