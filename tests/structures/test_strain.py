"""Strain at vertices and surfaces: exact for low orders, convergence, closed forms on a tube."""

import math

import numpy as np
import pytest
from plain_meshes import annulus, tetrahedra

from flexgear.structures.bodies import rigid_motion
from flexgear.structures.fem.assembly import FeModel, facet_sample, scalar_basis
from flexgear.structures.linalg.sparse import Factor
from flexgear.structures.reduced import ReducedBody
from flexgear.structures.strain import (
    strain_of_gradient,
    stress_of_strain,
    vertex_gradient,
    von_mises,
)
from flexgear.structures.surface_strain import Ray, Surface

E, NU = 210e9, 0.3


def grid(n, map_=lambda x: x):
    """Hexahedra of a cube, VTK-like corners in scikit-fem's order; n (3,) cells."""
    from skfem import MeshHex

    mesh = MeshHex.init_tensor(*(np.linspace(0, 1, k + 1) for k in n))
    return map_(mesh.p.T.copy()), mesh.t.T


def tets(n, map_=lambda x: x):
    from skfem import MeshTet

    mesh = MeshTet.init_tensor(*(np.linspace(0, 1, k + 1) for k in n))
    return map_(mesh.p.T.copy()), mesh.t.T


def skewed(x):
    return x @ np.array([[1.0, 0.2, 0.0], [0.1, 0.7, 0.3], [0.0, -0.2, 0.4]]) + 0.02 * np.sin(5 * x)


def gradient_of(points, cells, u):
    gradient = vertex_gradient(points, cells) @ u  # rows (vertex, direction), columns of u
    return gradient.reshape(len(points), 3, u.shape[1]).swapaxes(1, 2)


@pytest.mark.parametrize("make", [grid, tets])
@pytest.mark.parametrize("n", [(4, 4, 3), (5, 3, 1)])
def test_uniform_strain_gives_exact_stress_at_every_vertex(make, n):
    """Patch test, with a rigid rotation on top, also where there is one layer of cells."""
    points, cells = make(n, skewed)
    slope = np.random.default_rng(3).normal(size=(3, 3)) * 1e-3
    spin = np.array([[0, -1, 2.0], [1, 0, -3], [-2, 3, 0]])
    u = points @ (slope + spin).T
    stress = stress_of_strain(strain_of_gradient(gradient_of(points, cells, u)), E, NU)
    mu = E / 2 / (1 + NU)
    lam = E * NU / (1 + NU) / (1 - 2 * NU)
    full = lam * np.trace(slope) * np.eye(3) + mu * (slope + slope.T)
    exact = full[[0, 1, 2, 0, 1, 0], [0, 1, 2, 1, 2, 2]]
    assert np.abs(stress - exact).max() < 1e-6 * np.abs(exact).max()
    size = np.sqrt(1.5 * np.sum((full - np.trace(full) / 3 * np.eye(3)) ** 2))
    np.testing.assert_allclose(von_mises(stress), size, rtol=1e-6)


@pytest.mark.parametrize("make", [grid, tets])
def test_linear_strain_is_exact_up_to_the_surface(make):
    """A bent beam: u quadratic in x, y, z."""
    points, cells = make((5, 4, 3), skewed)
    x, y, z = points.T
    u = np.column_stack([x * y, 0.5 * z**2 - x**2, 3 * y * z + x**2 - y])
    exact = np.zeros((len(x), 3, 3))
    exact[:, 0, :2] = np.column_stack([y, x])
    exact[:, 1, 0], exact[:, 1, 2] = -2 * x, z
    exact[:, 2] = np.column_stack([2 * x, 3 * z - 1, 3 * y])
    np.testing.assert_allclose(gradient_of(points, cells, u), exact, atol=1e-8)


def thick_tube(n):
    """Ring 0.6 … 1.0 m under internal pressure of 100 MPa: model, displacements."""
    model = FeModel(annulus(n, inner=0.6, outer=1.0, width=0.2), E, NU, 7850.0)
    sample = facet_sample(model, model.fe_mesh.facets["inner"])
    ray = sample.points * [1, 1, 0]
    ray /= np.linalg.norm(ray, axis=1)[:, None]
    load = sample.load(100e6 * sample.weights[:, None] * ray)
    # held at six dofs that rigid motion needs; the load is in balance, so they carry nothing
    nodes = model.nodes[: model.vertex_dofs // 3]
    a = np.argmax(nodes[:, 0])
    b, c = np.argmin(nodes[:, 0]), np.argmax(nodes[:, 1])
    held = np.array([3 * a, 3 * a + 1, 3 * a + 2, 3 * b + 1, 3 * b + 2, 3 * c + 2])
    free = np.setdiff1d(np.arange(model.dofs), held)
    u = np.zeros(model.dofs)
    factor = Factor(model.stiffness[free][:, free].tocsr())
    u[free] = factor.backward(factor.forward(load[free][:, None]))[:, 0]
    return model, u


def test_thick_tube_under_pressure_converges_to_lame():
    """σ_r, σ_θ = p a²/(b² − a²) (1 ∓ b²/r²); free ends: σ_z = 0. On the inner surface, too."""
    errors = []
    for k in (1, 2):
        model, u = thick_tube((36 * k, 2 * k, 2))
        points = np.asarray(model.fe_mesh.points)
        gradient = gradient_of(
            points, np.asarray(model.fe_mesh.cells), u.reshape(-1, 3)[: len(model.fe_mesh.points)]
        )
        stress = stress_of_strain(strain_of_gradient(gradient), E, NU)
        r2 = points[:, 0] ** 2 + points[:, 1] ** 2
        c, s = points[:, 0] / np.sqrt(r2), points[:, 1] / np.sqrt(r2)
        radial = c * c * stress[:, 0] + s * s * stress[:, 1] + 2 * c * s * stress[:, 3]
        hoop = s * s * stress[:, 0] + c * c * stress[:, 1] - 2 * c * s * stress[:, 3]
        base = 100e6 * 0.36 / 0.64
        off = [radial - base * (1 - 1 / r2), hoop - base * (1 + 1 / r2), stress[:, 2]]
        errors.append(np.abs(off).max() / hoop.max())
    assert errors[1] < 0.05
    assert np.log2(errors[0] / errors[1]) > 1.5


def test_energy_of_stress_and_strain_is_that_of_the_stiffness_matrix():
    """½ ∫ σ : ε dV = ½ uᵀ K u, with the elements' own gradients at their integration points."""
    model, u = thick_tube((18, 2, 2))
    basis = scalar_basis(model.fe_mesh)
    nodal = u.reshape(-1, 3)[basis.element_dofs]  # (a, e, i)
    gradient = sum(
        np.einsum("ei,jeq->eqij", nodal[a], basis.basis[a][0].grad) for a in range(len(nodal))
    )
    strain = strain_of_gradient(gradient)
    stress = stress_of_strain(strain, E, NU)
    density = (stress * strain * [1, 1, 1, 2, 2, 2]).sum(axis=-1)
    assert (density * basis.dx).sum() == pytest.approx(u @ model.stiffness @ u, rel=1e-8)


ALPHA, EPS = 3e-4, -1.1e-4


def tube(mesh):
    """Ring whose coordinates are rigid motion, then uniform expansion across and along the axis,
    then torsion: u_theta = r z."""
    x, y, z = points = np.asarray(mesh.points).T
    zero = 0 * x
    stretch = [np.array([x, y, zero]), np.array([zero, zero, z]), np.array([-y * z, x * z, zero])]
    columns = [column.T.reshape(-1) for column in stretch]
    rigid = rigid_motion(points.T).reshape(-1, 6)
    return ReducedBody(
        name="ring",
        node_names=("middle",),
        positions=np.zeros((1, 3)),
        mass=np.eye(9),
        stiffness=np.eye(9),
        n_modes=3,
        report={},
        points=points.T,
        cells=np.asarray(mesh.cells),
        recovery=np.column_stack([rigid, *columns]).astype(np.float32),
    )


MESH = annulus((48, 3, 3), inner=0.8, outer=1.0, width=0.3)


@pytest.mark.parametrize("mesh", [MESH, tetrahedra(MESH)])
@pytest.mark.parametrize("first", [False, True])
def test_expansion_and_torsion_are_read_as_they_are(mesh, first):
    """Around ε, along the axis ε_z, at 45° their mean and half of γ = r."""
    rays = [Ray(angle, z, first) for angle in (0.0, 0.3, -2.0) for z in (0.0, 0.11)]
    strain = Surface(tube(mesh)).strain(rays)
    around = strain.along([0.0] * len(rays))
    along = strain.along([math.pi / 2] * len(rays))
    slanted = strain.along([math.pi / 4] * len(rays))
    assert np.abs(around[:, :6]).max() < 1e-12 and np.abs(slanted[:, :6]).max() < 1e-12
    # the surface is a polygon: the normal is off by half a step, the field is not
    np.testing.assert_allclose(around[:, 6:8], [[1, 0]] * len(rays), atol=2e-6)
    np.testing.assert_allclose(along[:, 6:8], [[0, 1]] * len(rays), atol=2e-6)
    np.testing.assert_allclose(slanted[:, 6:8], [[0.5, 0.5]] * len(rays), atol=2e-6)
    # inside, the base is the outer one turned about the axis of z
    shear = 0.5 * (0.8 if first else 1.0) * (-1 if first else 1)
    np.testing.assert_allclose(slanted[:, 8], shear, rtol=0.02)


def test_rows_sample_the_field_of_strain_and_its_stress():
    body, q = tube(MESH), np.array([1, -2, 3, 0.1, 0.2, -0.3, ALPHA, EPS, 2e-4]) * 1.0
    ray, surface = Ray(0.4, 0.07), Surface(tube(MESH))
    vertices, weights, base = surface.meeting(ray)
    xx, yy, zz, xy, yz, xz = weights @ body.strain(q)[vertices]
    tensor = base @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ base.T
    strain = surface.strain([ray])
    np.testing.assert_allclose(strain.rows[0] @ q, tensor, atol=1e-8 * ALPHA + 1e-9)
    stress = strain.hoop_stress(210e9, 0.3)[0] @ q
    exact = 210e9 / (1 - 0.09) * (ALPHA + 0.3 * EPS)
    assert stress == pytest.approx(exact, rel=1e-4)


def test_a_ray_beside_the_body_meets_nothing():
    surface = Surface(tube(MESH))
    assert surface.meeting(Ray(0.0, 0.2)) is None
    assert np.isnan(surface.strain([Ray(0.0, 0.2)]).rows).all()
