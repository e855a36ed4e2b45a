"""Plane-strain finite elements of a tooth with a crack at its root: triangles, nodes split there.

The mesh is gmsh's of ``plane_teeth`` with the crack as a line in it; the tooth with and without the
crack are the same triangles, those of one side of the line with nodes of their own.
"""

import math

import numpy as np
from cut_teeth.shape import shape
from plane_teeth import MeshTri, meshed, pressed

FINEST = 0.06  # of the depth, elements at the crack's end


def crack_compliance(gear, loads, young, poisson, *, held, size, depth, angle):
    """What a crack adds to the deflection under each unit line load, m²/N; depth m from the root
    section's start at an angle, rad, to the tooth's middle line."""
    tooth = shape(gear)
    start = np.array([tooth.section.real, tooth.section.imag])
    way = np.array([-gear.outward * math.cos(angle), -math.sin(angle)])
    crack = (start, start + depth * way)
    whole, edges = meshed(tooth, loads, held, size, crack, FINEST * depth)
    split = _split(whole, np.unique(edges.pop("crack")), start, way, gear.outward)
    compliances = []
    for fe_mesh in (whole, split):
        _, forces, u = pressed(fe_mesh, edges, loads, young, poisson)
        compliances.append(np.sum(forces * u, axis=1))
    return compliances[1] - compliances[0]


def _split(whole, line, start, way, outward):
    """The mesh with second nodes along the crack, but at its end, for the triangles above it."""
    p, t = whole.p, whole.t.copy()
    along = way @ (p[:, line] - start[:, None])
    inside = line[along < along.max() * (1 - 1e-9)]
    across = np.array([outward * -way[1], outward * way[0]])
    across *= np.sign(across[0] * outward)
    above = across @ (p[:, t].mean(axis=1) - start[:, None]) > 0
    second = np.arange(p.shape[1])
    second[inside] = p.shape[1] + np.arange(len(inside))
    t[:, above] = second[t[:, above]]
    return MeshTri(np.hstack([p, p[:, inside]]), t)
