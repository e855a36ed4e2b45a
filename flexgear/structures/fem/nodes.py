"""Nodes of the quadratic basis by the vertices they belong to."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexgear.model.errors import FlexgearError
from flexgear.structures.fem.assembly import FeModel

Ints = NDArray[np.int64]


def edge_nodes(model: FeModel, first: Ints, second: Ints) -> Ints:
    """Nodes at the middles of edges between vertices, arrays of one shape."""
    numbers, keys = _edges(model)
    n = len(model.nodes)
    asked_keys = np.minimum(first, second).astype(np.int64) * n + np.maximum(first, second)
    order = np.argsort(keys)
    place = np.minimum(np.searchsorted(keys[order], asked_keys), len(keys) - 1)
    nodes = order[place]
    if not np.array_equal(keys[nodes], asked_keys):
        raise FlexgearError("two vertices of the FE mesh have no edge between them")
    return numbers[nodes]


def facet_nodes(model: FeModel, facets: Ints) -> Ints:
    """All nodes (k,) of facets given by their vertices (f, 3 or 4) in cyclic order."""
    middles = edge_nodes(model, facets, np.roll(facets, -1, axis=1))
    return np.unique(np.concatenate([facets.ravel(), middles.ravel()]))


def nodes_between(model: FeModel, free: Ints, border: Ints) -> Ints:
    """The vertices ``free`` and the middles of edges that join them with one another or with
    ``border``."""
    numbers, _ = _edges(model)
    ends = model.basis.mesh.edges
    is_free, inside = (np.zeros(len(model.nodes), dtype=bool) for _ in range(2))
    is_free[free] = True
    inside[free] = inside[border] = True
    between = (is_free[ends[0]] & inside[ends[1]]) | (is_free[ends[1]] & inside[ends[0]])
    return np.concatenate([np.unique(free), numbers[between]])


def _edges(model: FeModel) -> tuple[Ints, Ints]:
    """Node and key of every edge of the mesh."""
    ends = np.sort(model.basis.mesh.edges.astype(np.int64), axis=0)
    return model.basis.edge_dofs[0].astype(np.int64), ends[0] * len(model.nodes) + ends[1]
