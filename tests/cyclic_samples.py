"""Small bodies of equal sectors with ties that do and do not share their period."""

from dataclasses import replace

import numpy as np
from plain_meshes import annulus

from flexgear.structures.fe_mesh.gears import RingFeMeshParameters, ring_fe_mesh
from flexgear.structures.fem.assembly import FeModel, disc_points, facet_sample, point_sample
from flexgear.structures.fem.ties import averaging_tie, interface_of

STEEL = (210e9, 0.3, 7850.0)
TEETH = 12


def plain_ring(teeth=TEETH, radial=1, axial=2, teeth_tie=averaging_tie):
    """A ring whose teeth are patches inside; a fit outside and two bolts on one face."""
    model = FeModel(annulus((2 * teeth, radial, axial), teeth=teeth), *STEEL)
    return model, interface_of(model, ring_ties(model, teeth, 0.7, 0.88, 0.15, teeth_tie))


def ring_ties(model, teeth, radius, bolt_radius, face, tie=averaging_tie, patch="patch"):
    """Teeth at their middles, one fit on the axis, bolts at angles no sector has."""
    ties = []
    for j in range(teeth):
        sample = facet_sample(model, model.fe_mesh.facets[f"{patch}_{j + 1:03d}"])
        angle = np.arctan2(*(sample.weights @ sample.points)[1::-1])
        position = radius * np.array([np.cos(angle), np.sin(angle), 0])
        ties.append(tie(f"tooth_{j + 1}", position, sample))
    outer = facet_sample(model, model.fe_mesh.facets["outer"])
    ties.insert(5, averaging_tie("fit", np.zeros(3), outer))
    for k, angle in enumerate((0.3, 2.5)):
        centre = np.array([bolt_radius * np.cos(angle), bolt_radius * np.sin(angle), face])
        disc = disc_points(centre, 0.06)
        ties.append(averaging_tie(f"bolt_{k + 1}", centre, point_sample(model, *disc)))
    return ties


def some_supports(interface):
    """Stiffness (b, b) of springs at the bolts and the fit of such a ring."""
    out = np.zeros((interface.size, interface.size))
    for name, k in {"bolt_1": 1e9, "bolt_2": 5e8, "fit": 2e8}.items():
        n = 6 * interface.node_names.index(name)
        out[n : n + 6, n : n + 6] = np.diag([k, k, k, 1e-3 * k, 1e-3 * k, 1e-3 * k])
    return out


def toothed_ring_mesh():
    """The generator's ring with helical teeth and bolts that share no factor."""
    return ring_fe_mesh(
        RingFeMeshParameters(
            teeth=24,
            normal_module=0.018,
            helix_angle=np.radians(7.5),
            addendum=0.6,
            root_fillet=0.3,
            face_width=0.1,
            rim_thickness=0.08,
            bolts=5,
            bolt_circle_diameter=0.55,
            bolt_diameter=0.02,
            fits=((-0.05, -0.02),),
            fidelity="quick",
        )
    )


def bent(fe_mesh, amount=1e-4):
    """The same mesh with one vertex moved."""
    points = fe_mesh.points.copy()
    points[3] += amount * np.array([1.0, 0.4, 0.2])
    return replace(fe_mesh, points=points)


def renumbered(fe_mesh, seed=0):
    """The same body with vertices and cells in another order."""
    random = np.random.default_rng(seed)
    place = random.permutation(len(fe_mesh.points))
    points = np.empty_like(fe_mesh.points)
    points[place] = fe_mesh.points
    cells = random.permutation(place[fe_mesh.cells])
    facets = {name: place[rows] for name, rows in fe_mesh.facets.items()}
    return replace(fe_mesh, points=points, cells=cells, facets=facets)


def fixed_frequencies(reduction):
    """Fixed-interface frequencies (n_modes,), Hz, of a reduction."""
    body = reduction.body
    return np.sqrt(np.diag(body.stiffness)[body.interface_dofs :]) / (2 * np.pi)
