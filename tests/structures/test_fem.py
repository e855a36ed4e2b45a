"""Stiffness and mass: equal to plain forms, order of convergence, closed forms."""

import numpy as np
import pytest
from plain_meshes import annulus, box, plain_matrices, tetrahedra
from scipy.sparse.linalg import spsolve

from flexgear.structures.fem.assembly import FeModel, point_sample

STEEL = (210e9, 0.3, 7850.0)


pytestmark = pytest.mark.usefixtures("one_thread")


MESHES = {
    "hex": annulus((12, 2, 2)),
    "tet": tetrahedra(annulus((10, 1, 1))),
    "warped": box((3, 2, 2), warp=lambda x: x + 0.03 * np.sin(7 * x[:, [1, 2, 0]])),
}


@pytest.mark.parametrize("name", MESHES)
def test_batched_matrices_equal_plain_forms(name):
    model = FeModel(MESHES[name], *STEEL)
    k, m = plain_matrices(MESHES[name], *STEEL)
    assert abs(model.stiffness - k).max() < 1e-12 * abs(k).max()
    assert abs(model.mass - m).max() < 1e-12 * abs(m).max()
    assert abs(model.stiffness - model.stiffness.T).max() == 0.0


def lame(points, inner=0.75, outer=1.0, pressure=1e8):
    """Radial displacement A r + B / r of a thick cylinder under inner pressure, plane strain."""
    e, nu, _ = STEEL
    factor = pressure * inner**2 / (outer**2 - inner**2) * (1 + nu) / e
    r = np.hypot(points[:, 0], points[:, 1])
    u = factor * ((1 - 2 * nu) * r + outer**2 / r)
    return np.column_stack([u * points[:, 0] / r, u * points[:, 1] / r, 0 * r])


def clamped_solve(model, held, values):
    """u (n, 3) without volume load, given displacements (n, 3) at held nodes."""
    fixed = np.repeat(held, 3)
    u = np.where(held[:, None], values, 0.0).ravel()
    k = model.stiffness.tocsc()
    u[~fixed] = spsolve(k[~fixed][:, ~fixed], -k[~fixed][:, fixed] @ u[fixed])
    return u


@pytest.mark.parametrize("kind", ["hex", "tet"])
def test_element_converges_with_third_order_on_a_smooth_annulus(kind):
    # Lame's field has no volume load anywhere, so it is exact on the faceted ring as well: what
    # is measured is the element, not the facets
    rng = np.random.default_rng(5)
    a, r, z = (
        rng.uniform(0, 2 * np.pi, 200),
        rng.uniform(0.8, 0.94, 200),
        rng.uniform(-0.1, 0.1, 200),
    )
    points = np.column_stack([r * np.cos(a), r * np.sin(a), z])
    errors = []
    for n in (1, 2, 4):
        bricks = annulus((12 * n, n, n))
        mesh = bricks if kind == "hex" else tetrahedra(bricks)
        model = FeModel(mesh, *STEEL)
        outside = np.isin(np.arange(len(model.nodes)), model.basis.get_dofs().all())
        u = clamped_solve(model, outside, lame(model.nodes))
        at = point_sample(model, points, np.ones(200)).interpolation @ u.reshape(-1, 3)
        errors.append(np.sqrt(np.mean((at - lame(points)) ** 2)))
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders[-1] > 2.7, orders
