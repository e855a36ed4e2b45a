"""Drawings of a stage and of modified flanks."""

import numpy as np
import pytest
from matplotlib.path import Path

from flexgear.gears.geometry import stage_geometry
from flexgear.gears.modifications import Flank, gaps_of
from flexgear.gears.paths import GearFlank
from flexgear.model.load import load_case
from flexgear.model.modifications import FlankModifications, Relief
from flexgear.views import stage_drawing
from flexgear.views.interactive import panels_of
from flexgear.views.stage_drawing import flank_drawing, front_drawing, gear_outline, section_drawing


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
    sizes = [p.get_path().get_extents(p.get_patch_transform()).width for p in front.patches]
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
        front = front_drawing(case.view(stage.name)).axes[0]
        assert front.patches
        assert len(front.texts) == (stage.planets if stage.kind == "planetary" else 0)
        assert section_drawing(case.view(stage.name)).axes[0].patches


FLANKS = {
    "external": Flank(tip=0.030, root=0.010, half_face=0.05, base_radius=0.06),
    "internal": Flank(tip=0.040, root=0.060, half_face=0.05, base_radius=0.12),
}


@pytest.mark.parametrize("flank", FLANKS.values(), ids=FLANKS)
def test_axes_scale_and_traces(flank):
    modifications = FlankModifications(
        helix_slope=8e-6, tip_relief=Relief(amount=3e-5, length=0.01)
    )
    one = GearFlank("planet", "ring", flank, tuple(gaps_of(modifications, flank)))
    figure = flank_drawing(one, "Stage")
    surface, profile, helix = figure.axes[:3]
    assert surface.get_ylim() == pytest.approx((1e3 * flank.root, 1e3 * flank.tip))
    assert "(mm)" in surface.get_ylabel() and "(mm)" in helix.get_xlabel()
    assert surface.get_title(loc="left") == (
        "Stage planet, flank towards the ring: −4 … 34 µm missing"
    )
    low, middle, high = (line.get_xdata() for line in profile.get_lines())
    np.testing.assert_allclose(high - low, 8.0)
    assert (middle[0], middle[-1]) == pytest.approx((0.0, 30.0))
    root, _, tip = (line.get_ydata() for line in helix.get_lines())
    np.testing.assert_allclose(tip - root, 30.0)
    assert (root[0], root[-1]) == pytest.approx((-4.0, 4.0))
    assert [a.get_ylabel() for a in figure.axes].count("missing (µm)") == 2
    bar = surface.collections[0].colorbar
    assert not surface.texts
    assert bar.get_ticks().tolist() == [0, 5, 10, 15, 20, 25, 30]


def test_a_flank_that_lacks_the_same_everywhere_has_no_contours():
    flank = FLANKS["external"]
    one = GearFlank("sun", "drive", flank, (lambda rho, z: 5e-6 + 0 * rho + 0 * z,))
    figure = flank_drawing(one, "")
    assert figure.axes[0].get_title(loc="left") == "sun, drive flank: 5 … 5 µm missing"
    figure.canvas.draw()


def test_the_map_is_interactive_in_a_report():
    modifications = FlankModifications(lead_crowning=8e-6)
    one = GearFlank(
        "sun", "drive", FLANKS["external"], tuple(gaps_of(modifications, FLANKS["external"]))
    )
    figure = flank_drawing(one, "")
    figure.canvas.draw()
    drawn = panels_of(figure)
    assert len(drawn) == 3  # map and traces; each trace is in the legend of its own panel
    maps = [t for p in drawn for t in p["data"] if t["type"] == "heatmap"]
    shown = np.array(maps[0]["z"])
    assert shown.shape[1] == len(maps[0]["x"]) and shown.max() == pytest.approx(8.0, rel=1e-2)
