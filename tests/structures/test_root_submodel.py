"""Submodel of a tooth root: gradients of elements, cut, convergence, hand of helix."""

import math
from dataclasses import replace

import numpy as np
import pytest
from plain_meshes import box, tetrahedra

from flexgear.gears.geometry import stage_geometry
from flexgear.model.load import load_case
from flexgear.structures.fe_mesh.tooth_segment import SegmentDivisions, SegmentParameters
from flexgear.structures.fem.assembly import FeModel, element_gradient
from flexgear.structures.tooth_influence.roots import (
    DEPTH,
    FINE,
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
    found = (element_gradient(model, vertices) @ (x * y - 2 * z**2 + 3 * x)).reshape(-1, 3)
    exact = np.column_stack([y + 3, x, -4 * z])[vertices]
    np.testing.assert_allclose(found, exact, atol=1e-10)


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
