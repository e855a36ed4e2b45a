"""Root stress by the motion of the cut: rigid motion, hoop strain, every tooth of a ring."""

from dataclasses import replace

import numpy as np
import pytest
from plain_meshes import annulus, tetrahedra

from flexgear.gears.geometry import stage_geometry
from flexgear.model.load import load_case
from flexgear.structures.bodies import rigid_motion
from flexgear.structures.fe_mesh.tooth_segment import SegmentDivisions, SegmentParameters
from flexgear.structures.reduced import ReducedBody
from flexgear.structures.surface_strain import FieldAt
from flexgear.structures.tooth_influence.roots import (
    DEPTH,
    FINE,
    both_cuts,
    ring_root_rows,
    root_influence,
    root_parameters,
)

YOUNG, POISSON = 2.1e11, 0.3
CASE = load_case("wind-5mw", {"stage.helix_angle_deg": "0"}).view()
MODULE = CASE.stage.normal_module
COARSE = SegmentDivisions(flank=4, fillet=6, tooth=2, rim=3, layers=2)
EPS = 1e-4


def segment(depth=DEPTH, **changes):
    tooth = stage_geometry(CASE).gears["ring"]
    alone = SegmentParameters(tooth, 0.1 * MODULE, 0.0, None, 0.1 * MODULE, 1)
    return replace(root_parameters(alone, MODULE, depth), **changes)


@pytest.fixture(scope="module")
def root():
    return root_influence(
        segment(divisions=COARSE, face_width=0.05, helix_rate=0.3), YOUNG, POISSON
    )


def stress(root, motion):
    """Both fillets (2, rows, q, …) by displacements (c, 3, …) of the cut."""
    return np.einsum("srqci,ci...->srq...", both_cuts(root), motion)


def test_rigid_motion_makes_no_stress(root):
    found = stress(root, rigid_motion(root.cut_points))
    assert np.abs(found[..., :3]).max() < 1e-6 * YOUNG  # of motion by a metre, and by a radian
    assert np.abs(found[..., 3:]).max() < 1e-6 * YOUNG
    assert found.shape[-1] == 6


def test_notch_factor_of_hoop_strain_does_not_depend_on_the_depth_of_the_cut():
    """Lamé's ring in plane strain, free at the root circle r0: u_r = A r + B/r, B = A r0²/(1 − 2ν),
    σ_θ = E/(1 − ν²) ε_θ there; teeth make a notch of it."""
    found = []
    for depth in (DEPTH, DEPTH + 1.5):
        parameters = segment(depth)
        fine = replace(FINE, rim=parameters.divisions.rim, layers=1)
        parameters = replace(parameters, divisions=fine)
        root = root_influence(parameters, YOUNG, POISSON, plane_strain=True)
        inner = parameters.tooth.root_radius
        x, y, _ = root.cut_points.T
        scale = EPS / (1.0 + 1.0 / (1.0 - 2.0 * POISSON))
        share = scale * (1.0 + inner**2 / (1.0 - 2.0 * POISSON) / (x**2 + y**2))
        both = stress(root, np.column_stack([share * x, share * y, 0.0 * x]))
        np.testing.assert_allclose(both[1], both[0], rtol=1e-6)  # a spur tooth has two alike
        found.append(both[0] / (YOUNG / (1.0 - POISSON**2) * EPS))
    print(f"\nnotch factors {found[0].max(), found[1].max()}")
    assert np.abs(found[1] - found[0]).max() < 0.03 * found[0].max()
    assert 1.0 < found[0].max() < 3.0


@pytest.mark.parametrize("make", [lambda x: x, tetrahedra])
def test_every_tooth_of_a_ring_feels_its_body(root, make):
    """A field that is the same at every tooth and one that turns with it, on a coarse mesh; the
    rows are less rigid motion."""
    mesh = make(annulus((40, 3, 3), inner=0.88, outer=1.1, width=0.06))
    points = np.asarray(mesh.points)
    x, y, z = points.T
    fields = [np.column_stack([x, y, 0 * x]), np.column_stack([0 * x, 0 * x, z])]
    fields.append(np.column_stack([x, 0 * x, 0 * x]))
    columns = [rigid_motion(points).reshape(-1, 6), *(f.reshape(-1, 1) for f in fields)]
    body = ReducedBody(
        name="ring", node_names=("middle",), positions=np.zeros((1, 3)), mass=np.eye(9),
        stiffness=np.eye(9), n_modes=3, report={}, points=points, cells=np.asarray(mesh.cells),
        recovery=np.column_stack(columns).astype(np.float32),
    )  # fmt: skip
    inside = FieldAt(body).weights(root.cut_points)
    np.testing.assert_allclose(inside @ points, root.cut_points, atol=1e-12)
    rows = ring_root_rows(root, body, 8)
    a, b, c = root.cut_points.T
    even = stress(root, np.column_stack([a, b, 0 * a]))
    along = stress(root, np.column_stack([0 * a, 0 * a, c]))
    across = stress(root, np.column_stack([a, 0 * a, 0 * a]))
    size = np.abs(even).max()
    for found in rows:
        np.testing.assert_allclose(found[..., 6], even, atol=1e-5 * size)
        np.testing.assert_allclose(found[..., 7], along, atol=1e-5 * size)
    np.testing.assert_allclose(rows[0, ..., 8], across, atol=1e-5 * size)
    np.testing.assert_allclose(rows[4, ..., 8], across, atol=1e-5 * size)  # half a turn: the same
    np.testing.assert_allclose(rows[2, ..., 8], even - across, atol=1e-5 * size)  # a quarter: y
    assert np.abs(rows[..., :6]).max() < 1e-6 * size
