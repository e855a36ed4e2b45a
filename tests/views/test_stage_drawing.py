"""Drawings to scale: right radii, teeth that do not cut one another, everything that a case has."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.path import Path

from flexgear.gears.geometry import stage_geometry
from flexgear.model.load import load_case
from flexgear.views import stage_drawing
from flexgear.views.stage_drawing import front_drawing, gear_outline, section_drawing


@pytest.fixture(scope="module")
def view():
    case = load_case("wind-5mw")
    return case.view(case.stages[0].name)


def test_outlines_have_the_radii_of_the_gears(view):
    for gear in stage_geometry(view).gears.values():
        radius = np.hypot(*gear_outline(gear, 0.3).T)
        ends = sorted((gear.tip_radius, gear.root_radius))
        assert radius.min() == pytest.approx(ends[0], rel=1e-3)
        assert radius.max() == pytest.approx(ends[1], rel=1e-3)


def test_teeth_of_all_planets_stand_in_the_spaces_of_ring_and_sun(view):
    """No point of a planet lies in the ring's or the sun's steel, as the stage assembles."""
    g = stage_geometry(view)
    angles = view.stage.planet_angles
    turns = [stage_drawing._planet_rotation(g, a) for a in angles]
    ring = Path(gear_outline(g.ring, 0.0))
    sun = Path(gear_outline(g.sun, stage_drawing._sun_rotation(g, angles[0], turns[0])))
    for angle, turn in zip(angles, turns, strict=True):
        centre = g.center_distance * np.array([np.cos(angle), np.sin(angle)])
        planet = centre + gear_outline(g.planet, turn)
        # within the tooth thickness that backlash takes off, which outlines leave out
        slack = 1e-3 * view.stage.normal_module
        assert ring.contains_points(planet, radius=slack).mean() > 0.999
        assert not sun.contains_points(planet, radius=-slack).any()


def test_a_drawing_shows_bolts_planets_and_bearings(view):
    front = front_drawing(view).axes[0]
    bolts = view.ring.bolt_circles[0].number
    sizes = [np.ptp(p.get_xy()[:, 0]) for p in front.patches]
    drawn = [s for s in sizes if s == pytest.approx(1e3 * view.ring.bolt_circles[0].diameter)]
    assert len(drawn) == bolts
    assert {t.get_text() for t in front.texts} == {str(k + 1) for k in range(view.stage.planets)}
    section = section_drawing(view).axes[0]
    top = max(p.get_xy()[:, 1].max() for p in section.patches)
    rim = stage_geometry(view).ring.root_radius + view.ring.rim_thickness
    assert top == pytest.approx(1e3 * rim)


@pytest.mark.parametrize("name", ["herringbone", "nrel-5mw", "lin-parker"])
def test_lumped_stages_are_drawn_too(name):
    case = load_case(name)
    for stage in case.stages:
        assert front_drawing(case.view(stage.name)).axes[0].patches
        assert section_drawing(case.view(stage.name)).axes[0].patches
