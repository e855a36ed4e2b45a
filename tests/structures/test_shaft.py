"""Beams of the sun shaft against closed forms."""

import numpy as np
import pytest
from scipy import linalg

from flexgear.structures.bodies import rigid_rows, rigid_variant
from flexgear.structures.shaft import BeamSection, shaft_body

STEEL = {"young": 210e9, "poisson": 0.3, "density": 7850.0}
SECTION = BeamSection(1.2, 0.32, 0.1)


def shaft(direction=-1.0, elements=4, section=SECTION):
    return shaft_body([section], direction=direction, elements_per_section=elements, **STEEL)


@pytest.mark.parametrize("direction", [-1.0, 1.0])
def test_cantilever_tip_deflection_holds_bending_and_shear(direction):
    body = shaft(direction)
    free = slice(6, None)
    force = np.zeros(body.size)
    force[-6] = 1e5  # x at the far end
    q = np.zeros(body.size)
    q[free] = np.linalg.solve(body.stiffness[free, free], force[free])
    bend = SECTION.length**3 / (3 * 210e9 * SECTION.second_moment)
    shear = SECTION.length / (SECTION.shear_coefficient(0.3) * 210e9 / 2.6 * SECTION.area)
    assert q[-6] == pytest.approx(1e5 * (bend + shear), rel=1e-10)
    assert np.sign(q[-2]) == direction  # the far end turns about y with the way it points
    torsion = np.zeros(body.size)
    torsion[-1] = 1e4
    q[free] = np.linalg.solve(body.stiffness[free, free], torsion[free])
    twist = 1e4 * 1.2 / (210e9 / 2.6 * 2 * SECTION.second_moment)
    assert q[-1] == pytest.approx(twist, rel=1e-10)


def test_rigid_motion_is_free_and_carries_the_whole_mass():
    body = shaft()
    rigid = rigid_rows(body.positions)
    assert np.abs(body.stiffness @ rigid).max() < 1e-9 * np.abs(body.stiffness).max()
    mass = rigid_variant(body).mass
    m = 7850 * SECTION.area * 1.2
    assert mass[0, 0] == pytest.approx(m, rel=1e-12)
    assert mass[5, 5] == pytest.approx(7850 * 2 * SECTION.second_moment * 1.2, rel=1e-12)
    about_sun = m * 1.2**2 / 3 + 7850 * SECTION.second_moment * 1.2
    assert mass[3, 3] == pytest.approx(about_sun, rel=1e-12)


def test_slender_cantilever_frequency_converges_at_fourth_order():
    section = BeamSection(6.0, 0.1)
    exact = 1.875104069**2 * np.sqrt(210e9 * section.second_moment / (7850 * section.area * 6.0**4))
    errors = []
    for elements in (1, 2, 4):
        body = shaft(elements=elements, section=section)
        free = slice(6, None)
        values = linalg.eigh(body.stiffness[free, free], body.mass[free, free], eigvals_only=True)
        errors.append(abs(np.sqrt(values[0]) / exact - 1))
    assert errors[0] < 6e-3 and errors[2] < 2e-4  # shear and rotary inertia: 1e-4 at L/d = 60
