"""Rows of strain at points of a surface: closed forms on a tube, and the field that they sample."""

import math

import numpy as np
import pytest
from plain_meshes import annulus, tetrahedra

from flexgear.structures.kinematics import rigid_motion
from flexgear.structures.reduced import ReducedBody
from flexgear.structures.surface_strain import Ray, Surface

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
    found = Surface(tube(mesh)).strain(rays)
    around = found.along([0.0] * len(rays))
    along = found.along([math.pi / 2] * len(rays))
    slanted = found.along([math.pi / 4] * len(rays))
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
    found = surface.strain([ray])
    np.testing.assert_allclose(found.rows[0] @ q, tensor, atol=1e-8 * ALPHA + 1e-9)
    stress = found.hoop_stress(210e9, 0.3)[0] @ q
    exact = 210e9 / (1 - 0.09) * (ALPHA + 0.3 * EPS)
    assert stress == pytest.approx(exact, rel=1e-4)


def test_a_ray_beside_the_body_meets_nothing():
    surface = Surface(tube(MESH))
    assert surface.meeting(Ray(0.0, 0.2)) is None
    assert np.isnan(surface.strain([Ray(0.0, 0.2)]).rows).all()
