"""Plane-strain finite elements of teeth, and Weber and Banaschek's foundation against them.

``validation/weber_banaschek`` has the tooth itself over the whole flank.
"""

import math

import numpy as np
import pytest
from cut_teeth.of_case import gear_of
from plane_teeth import HELD, deflection, load_at
from skfem import Basis, ElementQuad2, ElementVector, FacetBasis, LinearForm, MeshQuad, condense
from skfem import solve as solved
from skfem.models.elasticity import lame_parameters, linear_elasticity

from flexgear.gears.geometry import stage_geometry
from flexgear.gears.weber_banaschek import tooth_compliance
from flexgear.model.load import load_case

YOUNG, POISSON = 210e9, 0.3
PLANE = (1 - POISSON**2) / YOUNG


@pytest.mark.slow
def test_the_deflection_does_not_depend_on_the_fe_mesh_or_on_the_width_of_the_load():
    case = load_case("wind-5mw", {"stage.helix_angle_deg": "0"}).view()
    g, module = stage_geometry(case), case.stage.normal_module
    p, radius = gear_of(case, "ring"), 0.5 * (g.ring.form_radius + g.ring.tip_radius)
    coarse, fine, spread = (
        deflection(p, load_at(p, radius, a * module), YOUNG, POISSON, held=0.06, size=h * module)
        for a, h in ((0.06, 0.4), (0.06, 0.2), (0.12, 0.4))
    )
    for one in (coarse, spread):
        assert one.total == pytest.approx(fine.total, rel=5e-3)
        assert one.tooth == pytest.approx(fine.tooth, rel=5e-3)


def test_the_foundation_is_a_half_plane_held_at_a_depth():
    """A plane has no displacement under a force by itself: it grows with the logarithm of the
    depth at which the body is held, here ``HELD`` root thicknesses."""
    columns, rows = _graded(0.5, 8.0), _graded(0.0, HELD)
    both = np.concatenate([-columns[:0:-1], columns])
    fe_mesh = MeshQuad.init_tensor(both, -rows[::-1])
    element = ElementVector(ElementQuad2())
    basis = Basis(fe_mesh, element)
    stiffness = linear_elasticity(*lame_parameters(YOUNG, POISSON)).assemble(basis)
    root = fe_mesh.facets_satisfying(lambda x: (x[1] > -1e-9) & (np.abs(x[0]) < 0.5))
    edge = fe_mesh.facets_satisfying(lambda x: (x[1] < 1e-9 - HELD) | (np.abs(x[0]) > 8 - 1e-9))
    compliance = {}
    for name, traction in {
        "shear": LinearForm(lambda v, w: 1.5 * (1 - 4 * w.x[0] ** 2) * v[0]),
        "moment": LinearForm(lambda v, w: 12 * w.x[0] * v[1]),
    }.items():
        force = traction.assemble(FacetBasis(fe_mesh, element, facets=root))
        motion = solved(*condense(stiffness, force, D=basis.get_dofs(facets=edge)))
        compliance[name] = force @ motion / PLANE
    assert compliance["shear"] == pytest.approx(4.82 / math.pi, rel=0.02)
    assert compliance["moment"] == pytest.approx(16.67 / math.pi, rel=0.03)


def _graded(fine, last):
    """Places from 0 to ``last``: even to ``fine``, then growing."""
    step = 1 / 24
    places = list(np.arange(0, fine + step / 2, step)) if fine else [0.0]
    while places[-1] < last:
        places.append(min(last, places[-1] + step))
        step *= 1.12 if places[-1] > fine else 1.0
    return np.array(places)


@pytest.mark.parametrize("name", ["sun", "planet", "ring"])
def test_a_load_towards_the_root_leaves_the_foundation_only(name):
    """Continuous where load and middle line cross below the root section, and never negative."""
    case = load_case("wind-5mw").view()
    g = stage_geometry(case)
    tooth = getattr(g, name)
    radius = np.linspace(tooth.form_radius, tooth.tip_radius, 400)
    c = tooth_compliance(tooth.outline(), radius, YOUNG, POISSON)
    total = c.bending + c.foundation
    assert total.min() > PLANE
    assert np.abs(np.diff(total)).max() < 0.02 * total.max()
