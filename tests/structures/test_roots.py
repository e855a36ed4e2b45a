"""Submodel of a tooth root: gradients, cut, convergence, hand; motion of the cut in a ring."""

import math
from dataclasses import replace

import numpy as np
import pytest
from plain_meshes import annulus, box, tetrahedra

from flexgear.gears.geometry import stage_geometry
from flexgear.model.load import load_case
from flexgear.structures.bodies import rigid_motion
from flexgear.structures.fe_mesh.tooth_segment import SegmentDivisions, SegmentParameters
from flexgear.structures.fem.assembly import FeModel, element_gradient
from flexgear.structures.reduced import ReducedBody
from flexgear.structures.surface_strain import FieldAt
from flexgear.structures.tooth_influence.roots import (
    DEPTH,
    FINE,
    body_root_rows,
    both_cuts,
    root_influence,
    root_parameters,
)

STEEL = (2.1e11, 0.3)
CASE = load_case("wind-5mw", {"stage.helix_angle_deg": "0"}).view()
MODULE = CASE.stage.normal_module
COARSE = SegmentDivisions(flank=4, fillet=4, tooth=2, rim=3, layers=3)


def segment(slot, **changes):
    tooth = stage_geometry(CASE).gears[slot]
    alone = SegmentParameters(tooth, 0.1 * MODULE, 0.0, None, 0.1 * MODULE, 1)
    parameters = root_parameters(alone, MODULE, changes.pop("depth", DEPTH))
    fine = replace(FINE, rim=parameters.divisions.rim, layers=1)
    return replace(parameters, **{"divisions": fine, **changes})


def plane(parameters):
    return root_influence(parameters, *STEEL, plane_strain=True)


def under_line_load(influence, height, line_load=1e6):
    """Stress (rows,) under a line load at a share of the flank's roll from its root, N/m."""
    return both_fillets(influence, height, line_load)[0]


def both_fillets(influence, height, line_load=1e6):
    """The same in the fillet under the loaded flank and in the other one, (2, rows)."""
    low, high = sorted(influence.roll[[0, -1]])
    width = float(np.ptp(influence.z))
    place = np.array([[low + height * (high - low)], [0.0], [width]])
    return line_load * width * influence.per_force(*place)[0, 1, :, :, 0]


@pytest.mark.parametrize("make", [lambda x: x, tetrahedra])
def test_gradients_of_quadratic_fields_are_exact_at_vertices(make):
    model = FeModel(make(box()), *STEEL, density=1.0)
    x, y, z = model.nodes.T
    vertices = np.array([0, 7, len(model.fe_mesh.points) // 2])
    gradient = (element_gradient(model, vertices) @ (x * y - 2 * z**2 + 3 * x)).reshape(-1, 3)
    exact = np.column_stack([y + 3, x, -4 * z])[vertices]
    np.testing.assert_allclose(gradient, exact, atol=1e-10)


@pytest.mark.parametrize("slot", ["planet", "ring"])
def test_stress_does_not_depend_on_the_depth_of_the_cut(slot):
    """Anywhere in both fillets, the stretched and the compressed one, by the largest stress."""
    some, deeper = (both_fillets(plane(segment(slot, depth=d)), 0.6) for d in (DEPTH, DEPTH + 1.5))
    print("\ndeeper cut, %:", np.round(100 * (deeper - some) / some.max(), 2))
    assert some[0].max() > 0.5 * -some[1].min() > 0.0
    assert np.abs(deeper - some).max() < 0.03 * some.max()


def test_elements_converge_and_tension_is_inside_the_fillet():
    """Twice as many elements: 2 %. The largest stress is where 30° tangents touch, within 15°."""
    standard, fine = (
        plane(segment("sun")),
        plane(
            segment(
                "sun",
                flank_layer=0.05 * MODULE,
                divisions=replace(FINE, fillet=24, tooth=10, rim=12, layers=1),
            )
        ),
    )
    stress, points = under_line_load(standard, 0.6), standard.points[:, 0]
    assert stress.max() == pytest.approx(under_line_load(fine, 0.6).max(), rel=0.02)
    worst = int(np.argmax(stress))
    step = points[worst + 1] - points[worst - 1]
    # the middle tooth stands on the x axis
    assert math.degrees(math.atan2(abs(step[1]), abs(step[0]))) == pytest.approx(30, abs=15)


def test_the_other_hand_of_helix_is_the_mirror_image():
    parameters = segment("planet", divisions=COARSE, face_width=3 * MODULE)
    both = [root_influence(replace(parameters, helix_rate=rate), *STEEL) for rate in (0.4, -0.4)]
    roll = float(np.mean(both[0].roll))
    width, z = np.full(2, 0.5 * MODULE), np.array([-0.8, 0.3]) * MODULE
    force = np.array([1e3, 2.5e3])
    rolls = np.full(2, roll)
    one, other = (
        np.tensordot(force, root.per_force(rolls, side * z, width)[:, 1, 0], axes=1)
        for root, side in zip(both, (1, -1), strict=True)
    )
    np.testing.assert_allclose(other[:, ::-1], one, rtol=0, atol=1e-8 * np.abs(one).max())


EPS = 1e-4
YOUNG, POISSON = STEEL


@pytest.fixture(scope="module")
def root():
    coarse = SegmentDivisions(flank=4, fillet=6, tooth=2, rim=3, layers=2)
    return root_influence(
        segment("ring", divisions=coarse, face_width=0.05, helix_rate=0.3), *STEEL
    )


def stress(root, motion):
    """Both fillets (2, rows, q, …) by displacements (c, 3, …) of the cut."""
    return np.einsum("srqci,ci...->srq...", both_cuts(root), motion)


def test_rigid_motion_makes_no_stress(root):
    stresses = stress(root, rigid_motion(root.cut_points))
    assert np.abs(stresses[..., :3]).max() < 1e-6 * YOUNG  # of motion by a metre, and by a radian
    assert np.abs(stresses[..., 3:]).max() < 1e-6 * YOUNG
    assert stresses.shape[-1] == 6


def test_notch_factor_of_hoop_strain_does_not_depend_on_the_depth_of_the_cut():
    """Lamé's ring in plane strain, free at the root circle r0: u_r = A r + B/r, B = A r0²/(1 − 2ν),
    σ_θ = E/(1 − ν²) ε_θ there; teeth make a notch of it."""
    factors = []
    for depth in (DEPTH, DEPTH + 1.5):
        parameters = segment("ring", depth=depth)
        root = plane(parameters)
        inner = parameters.tooth.root_radius
        x, y, _ = root.cut_points.T
        scale = EPS / (1.0 + 1.0 / (1.0 - 2.0 * POISSON))
        share = scale * (1.0 + inner**2 / (1.0 - 2.0 * POISSON) / (x**2 + y**2))
        both = stress(root, np.column_stack([share * x, share * y, 0.0 * x]))
        np.testing.assert_allclose(both[1], both[0], rtol=1e-6)  # a spur tooth has two alike
        factors.append(both[0] / (YOUNG / (1.0 - POISSON**2) * EPS))
    print(f"\nnotch factors {factors[0].max(), factors[1].max()}")
    assert np.abs(factors[1] - factors[0]).max() < 0.03 * factors[0].max()
    assert 1.0 < factors[0].max() < 3.0


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
    rows = body_root_rows(root, body, 8)
    a, b, c = root.cut_points.T
    even = stress(root, np.column_stack([a, b, 0 * a]))
    along = stress(root, np.column_stack([0 * a, 0 * a, c]))
    across = stress(root, np.column_stack([a, 0 * a, 0 * a]))
    size = np.abs(even).max()
    for row in rows:
        np.testing.assert_allclose(row[..., 6], even, atol=1e-5 * size)
        np.testing.assert_allclose(row[..., 7], along, atol=1e-5 * size)
    np.testing.assert_allclose(rows[0, ..., 8], across, atol=1e-5 * size)
    np.testing.assert_allclose(rows[4, ..., 8], across, atol=1e-5 * size)  # half a turn: the same
    np.testing.assert_allclose(rows[2, ..., 8], even - across, atol=1e-5 * size)  # a quarter: y
    assert np.abs(rows[..., :6]).max() < 1e-6 * size
