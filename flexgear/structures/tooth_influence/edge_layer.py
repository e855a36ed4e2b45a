"""Surface of the layer under a flank near the tip edge, where half of the body is missing.

The dip of line contact that is taken off an influence is that of a layer bonded to a rigid base.
Inside a flank Hertz's line contact in a half plane with the layer's κ (``hertz``), stands for it:

    K_∞(r) = (2c/π) [ln(h/r) + κ − ½],   r = |x − y|,  c = (1 − ν²)/E

At the tip the layer ends, and so does the same layer of the FE segment: what is taken off
there has the end in it. Both layers are solved here in plane strain by finite elements on the same
nodes, a line of them from the edge inwards,

    middle = K_layer − S,    end = K_layer with an end − S,    S = K_layer − K_∞

with S(r) = (2c/π) ∫_0^∞ (L(t) − 1)/t [cos(t r/h) − 1] dt, smooth, what a layer yields less than a
half plane away from the load (in the FE influence of the tooth that is not taken off). At the edge
the layer with an end is a wedge: its surface sinks as −2c ln r [cos²φ/(2a + sin 2a) +
sin²φ/(2a − sin 2a)] under a load on the edge, 2a being the angle of the wedge and φ = π/2 − a that
of the load from its middle, half as much again as the 2c/π of a half plane where 2a is 115°.
Source: Timoshenko and Goodier 1951, Theory of Elasticity, articles 35 and 36.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from flexgear.gears.hertz import layer_share
from flexgear.structures.fem import plane_strain
from flexgear.structures.linalg.sparse import flexibility

Array = NDArray[np.float64]
# in depths of the layer; half as long elements change the approach at an edge by 0.1 %
SMALLEST, COARSEST, GROWTH = 0.001, 0.08, 1.2  # elements along the surface, from the edge on
REACH = 4.0  # of the nodes from the edge, at twice of which the layer is cut and held
DOWN, DOWN_COARSEST, DOWN_GROWTH = 0.001, 0.25, 1.4  # elements below the surface


@dataclass(frozen=True, eq=False)
class EdgeLayer:
    """place: nodes (n,) along the surface from the edge, in depths h; middle, end: (n, n) normal
    displacement by line loads at nodes, in c = (1 − ν²)/E, of a layer that goes on beyond the edge
    and of one that ends there."""

    place: Array
    middle: Array
    end: Array


def edge_layer(angle: float, poisson: float) -> EdgeLayer:
    """Of a tip edge at which flank and tip land make an angle (rad) inside the tooth.

    Elements of both layers lean alike, so that what they do not resolve drops out of end − middle.
    """
    along = _graded(SMALLEST, COARSEST, GROWTH, 2 * REACH)
    before = _graded(SMALLEST, 4 * COARSEST, 2 * GROWTH - 1, REACH)
    place, end = _solved(along, angle, poisson)
    _, middle = _solved(np.concatenate([-before[:0:-1], along]), angle, poisson)
    less = _less_than_half_plane(np.abs(place[:, None] - place), poisson)
    return EdgeLayer(place, middle - less, end - less)


def _solved(along: Array, angle: float, poisson: float) -> tuple[Array, Array]:
    """Nodes (n,) of the surface from x = 0 to ``REACH`` and their compliance (n, n) in c; a layer
    of depth 1 that begins at along[0], its end inclined by ``angle`` to the surface."""
    down = _graded(DOWN, DOWN_COARSEST, DOWN_GROWTH, 1.0)
    x, y = np.meshgrid(along, down / down[-1], indexing="ij")
    points = np.column_stack([(x + y / math.tan(angle)).ravel(), y.ravel()])
    number = np.arange(x.size).reshape(x.shape)
    corners = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    cells = np.stack([c.ravel() for c in corners], axis=1)
    nodes, stiffness = plane_strain(points, cells, 1.0 - poisson**2, poisson)
    from_end = nodes[:, 0] - nodes[:, 1] / math.tan(angle)
    free = (nodes[:, 1] < 1.0 - 1e-9) & (from_end < along[-1] - 1e-9)
    loaded = np.flatnonzero((nodes[:, 1] < 1e-9) & (nodes[:, 0] > -1e-9) & (from_end <= REACH))
    loaded = loaded[np.argsort(nodes[loaded, 0])]
    free_dofs = np.flatnonzero(np.repeat(free, 2))
    loads = sp.csc_matrix(
        (
            np.ones(len(loaded)),
            (np.searchsorted(free_dofs, 2 * loaded + 1), np.arange(len(loaded))),
        ),
        shape=(len(free_dofs), len(loaded)),
    )
    return nodes[loaded, 0], flexibility(stiffness[free_dofs][:, free_dofs].tocsr(), loads)


def _graded(first: float, coarsest: float, growth: float, stop: float) -> Array:
    """Places from 0 to ``stop`` or just beyond; steps grow from the first one on."""
    places, step = [0.0], first
    while places[-1] < stop:
        places.append(places[-1] + step)
        step = min(growth * step, coarsest)
    return np.array(places)


def _less_than_half_plane(distance: Array, poisson: float) -> Array:
    """S in c at distances (any shape) in depths."""
    t, weight = np.polynomial.legendre.leggauss(200)
    t, weight = 10.0 * (t + 1), 10.0 * weight  # L is 1 from there on
    share = weight * (layer_share(t, poisson) - 1) / t
    places, number = np.unique(np.round(distance, 12), return_inverse=True)
    deficit = 2 / math.pi * (np.cos(np.outer(places, t)) - 1) @ share
    return np.asarray(deficit[number].reshape(distance.shape))
