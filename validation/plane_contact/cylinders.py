"""Two cylinders pressed together: the same contact against Hertz's line contact.

    a² = 4 w R/(π E*),   1/R = 1/R₁ + 1/R₂,   E* = E/(2 (1 − ν²))
    approach of a centre = w (1 − ν²)/(π E) (2 ln(4 R_i/a) − 1)

Half width and, for a cylinder pressed from two opposite sides, approach of its centre: Johnson
1985, Contact Mechanics, eqs. 4.43 and 5.57. Here half a cylinder stands on its diameter
without friction.
"""

import math
from dataclasses import dataclass

import numpy as np

from flexgear.arrays import Array
from plane_contact import active_set
from plane_contact.body import Body, Elastic
from plane_contact.gear_contact import forces_on, half_width
from plane_contact.rolling import Candidates, foot_on, with_middles
from plane_contact.sector import Grid, chain_on, triangles

WINDOW = 2.5  # half widths on either side in which nodes may touch


@dataclass(frozen=True)
class Hertz:
    """Half width (m) and approach of both centres (m)."""

    half_width: float
    approach: float


def theory(radii: tuple[float, float], load: float, material: Elastic) -> Hertz:
    """Line contact under ``load`` N per m."""
    plane = (1 - material.poisson**2) / material.young
    mean = 1 / (1 / radii[0] + 1 / radii[1])
    a = math.sqrt(8 * load * mean * plane / math.pi)
    return Hertz(a, load * plane / math.pi * sum(2 * math.log(4 * r / a) - 1 for r in radii))


def computed(radii: tuple[float, float], load: float, material: Elastic, edges: int) -> Hertz:
    """The same by finite elements, ``edges`` per half width."""
    a = theory(radii, load, material).half_width
    count = 2 * round(WINDOW * edges)
    x = np.linspace(-WINDOW * a, WINDOW * a, count + 1)
    bodies = [_half_cylinder(r, x, material) for r in radii]
    at = with_middles(x)
    gap = sum(r - np.sqrt(r**2 - at**2) for r in radii)
    nodes, weights = foot_on(x, 0, at)
    slave = np.arange(len(at))[:, None] + np.zeros(3, int), np.tile([1.0, 0.0, 0.0], (len(at), 1))
    down = np.tile([0.0, -1.0], (len(at), 1))  # into the material, in each body's own frame
    place = at.astype(complex)
    c = Candidates(
        gap, place, place, at, (slave[0], nodes), (slave[1], weights), (down, down), slave[0][:, 0]
    )
    maps = [forces_on(c, b, body) for b, body in enumerate(bodies)]
    compliance = sum(m.T @ (b.compliance @ m) for m, b in zip(maps, bodies, strict=True))
    p, approach = active_set.solve(
        gap, 0.5 * (compliance + compliance.T), np.ones((len(at), 1)), np.array([load])
    )
    return Hertz(half_width(at, p), float(approach[0]))


def _half_cylinder(radius: float, x: Array, material: Elastic) -> Body:
    """Half a cylinder below its contact at the origin, its chain the vertices at x."""
    fine = x + 1j * (np.sqrt(radius**2 - x**2) - radius)
    angle = math.asin(x[-1] / radius)
    steps = np.geomspace(angle, math.pi / 2, 24)[1:]
    right = -1j * radius + radius * np.exp(1j * (math.pi / 2 - steps))
    left = -np.conj(right[::-1])
    flat = np.linspace(radius, -radius, 21)[1:-1] - 1j * radius
    loop = np.concatenate([left, fine, right, flat])
    grid = Grid(flank=0, growth=0.15, coarse=0.1)
    fe_mesh = triangles([loop], [fine], grid, radius)
    vertices, facets = chain_on(fe_mesh, fine)
    basis = Body.basis_of(fe_mesh)
    base = basis.get_dofs(lambda p: p[1] < -radius * (1 - 1e-9))
    middle = int(np.argmin(np.hypot(fe_mesh.p[0], fe_mesh.p[1] + radius)))
    held = np.union1d(base.all(["u^2"]), basis.nodal_dofs[0, middle])
    body = Body(fe_mesh, material, held)
    body.of_chains(vertices[None], facets[None])
    return body
