"""Plane-strain finite elements of a tooth with a crack at its root: triangles, nodes split there.

The mesh is gmsh's of ``plane_teeth`` with the crack as a line in it; the tooth with and without the
crack are the same triangles, those of one side of the line with nodes of their own.
"""

from __future__ import annotations

import math

import numpy as np
from cut_teeth.shape import shape
from plane_teeth import (
    ELEMENT,
    NEIGHBOURS,
    ROOT_CHORDS,
    Basis,
    FacetBasis,
    LinearForm,
    MeshTri,
    _marks,
    _Outline,
    _read,
    _uniform,
    condense,
    lame_parameters,
    linear_elasticity,
    solved,
)

from flexgear.structures.fe_mesh.session import gmsh_session

FINEST = 0.06  # of the depth, elements at the crack's end


class _CrackedOutline(_Outline):
    """With a point on the +y root of the loaded tooth, where the crack starts."""

    start, mouth = None, 0

    def root_to(self, places):
        x = places[:, 0]
        if self.start is None or places[0, 1] < 0 or not min(x) < self.start[0] < max(x):
            super().root_to(places)
            return
        upper = np.sign(x[-1] - x[0]) * (x - self.start[0]) < 0
        self.spline_to(np.vstack([places[upper], self.start]))
        self.mouth = self.last
        self.spline_to(places[~upper])


def crack_compliance(gear, load, young, poisson, *, held, size, depth, angle):
    """What a crack adds to the deflection under a unit line load, m²/N; depth m from the root
    section's start at an angle, rad, to the tooth's middle line."""
    tooth = shape(gear)
    start = np.array([tooth.section.real, tooth.section.imag])
    way = np.array([-gear.outward * math.cos(angle), -math.sin(angle)])
    whole, edges, line = _meshed(tooth, load, held, size, (start, start + depth * way))
    split = _split(whole, line, start, way, gear.outward)
    out = []
    for fe_mesh in (whole, split):
        basis = Basis(fe_mesh, ELEMENT)
        stiffness = linear_elasticity(*lame_parameters(young, poisson)).assemble(basis)

        @LinearForm
        def pressed(v, w):
            return load.pressure(w.x) * (load.direction[0] * v[0] + load.direction[1] * v[1])

        facets = {name: _facets(fe_mesh, ends) for name, ends in edges.items()}
        force = pressed.assemble(FacetBasis(fe_mesh, ELEMENT, facets=facets["contact"]))
        force /= force @ _uniform(basis, load.direction)
        u = solved(*condense(stiffness, force, D=basis.get_dofs(facets=facets["held"])))
        out.append(float(force @ u))
    return out[1] - out[0]


def _facets(fe_mesh, ends):
    number = {tuple(pair): k for k, pair in enumerate(np.sort(fe_mesh.facets.T, axis=1))}
    return np.array([number[tuple(sorted(pair))] for pair in ends.T])


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


def _meshed(tooth, load, held, size, crack):
    """FE mesh, pairs of nodes of its edges "contact" and "held", and nodes on the crack."""
    far = tooth.section.real - tooth.gear.outward * held
    with gmsh_session("cracked") as gmsh:
        line = _CrackedOutline(gmsh, tooth, size)
        parts = {}
        for j in range(-NEIGHBOURS, NEIGHBOURS + 1):
            line.start = crack[0] if j == 0 else None
            parts[j] = line.tooth(j * line.pitch, () if j else _marks(tooth.gear, load))
        end = (NEIGHBOURS + 0.5) * line.pitch
        corners = [
            line.point((far * math.cos(a), far * math.sin(a)), 3 * size) for a in (end, 0, -end)
        ]
        edge = [
            line.geo.addLine(line.last, corners[0]),
            line.geo.addCircleArc(corners[0], line.origin, corners[1]),
            line.geo.addCircleArc(corners[1], line.origin, corners[2]),
            line.geo.addLine(corners[2], line.first),
        ]
        surface = line.geo.addPlaneSurface([line.geo.addCurveLoop([*line.curves, *edge])])
        cut = line.geo.addLine(line.mouth, line.point(crack[1]))
        line.geo.synchronize()
        gmsh.model.mesh.embed(1, [cut], 2, surface)
        for curve in line.roots:
            gmsh.model.mesh.setTransfiniteCurve(curve, ROOT_CHORDS + 1)
        fields, refined = gmsh.model.mesh.field, []
        depth = math.dist(*crack)
        for (x, y), finest in ((load.middle, load.half_width / 4), (crack[1], FINEST * depth)):
            refined.append(fields.add("MathEval"))
            distance = f"sqrt((x-({x}))^2 + (y-({y}))^2)"
            fields.setString(refined[-1], "F", f"{finest} + 0.2*{distance}")
        both = fields.add("Min")
        fields.setNumbers(both, "FieldsList", refined)
        fields.setAsBackgroundMesh(both)
        gmsh.model.mesh.generate(2)
        curves = {"contact": parts[0][1:3], "held": edge, "crack": [cut]}
        fe_mesh, facets = _read(gmsh, curves)
    nodes = {name: fe_mesh.facets[:, numbers] for name, numbers in facets.items()}
    return fe_mesh, {k: nodes[k] for k in ("contact", "held")}, np.unique(nodes["crack"])
