"""What is said of teeth as their tools make them."""

import math

import numpy as np
import pytest
from cut_teeth import envelope
from cut_teeth.of_case import gear_of
from gears.plain_gear import Gear

from flexgear.gears.geometry import stage_geometry
from flexgear.gears.implausible import lowest_contact, tooth_warnings, trimmed
from flexgear.gears.tool import PlainTool
from flexgear.model.load import bundled_cases, load_case

PROFILE_A = {"stage.planet.dedendum": "1.25", "stage.planet.root_fillet": "0.38"}
SPUR = {"stage.helix_angle_deg": "0"}


@pytest.mark.parametrize("name", bundled_cases())
def test_nothing_is_said_of_bundled_cases(name):
    case = load_case(name)
    for stage in case.stages:
        assert not tooth_warnings(case.view(stage.name))


def test_a_rings_tip_on_the_root_of_a_planet():
    """In micrometres as the brute-force tooth stands proud where the ring's tip comes; none with
    the remedy that is told."""
    view = load_case("wind-5mw", {**PROFILE_A, **SPUR}).view()
    (text,) = tooth_warnings(view)
    g = stage_geometry(view)
    reach = lowest_contact(g.planet, g.ring, g.ring_mesh.working_angle)
    # by the cosine rule: the ring's tip on the line of action, seen from the planet's centre
    along = g.planet.base_radius * math.tan(g.ring_mesh.working_angle)
    at, sine = (
        g.ring.base_radius / math.cos(g.ring_mesh.working_angle),
        math.sin(g.ring_mesh.working_angle),
    )
    square = at**2 + (along - reach) ** 2 - 2 * at * (along - reach) * sine
    assert math.sqrt(square) == pytest.approx(g.ring.tip_radius, rel=1e-9)
    gear = gear_of(view, "planet")
    radius = math.hypot(gear.base_radius, reach)
    cut = envelope.half_angles(gear, np.array([radius - 1e-6, radius]))[1]
    proud = 1e6 * gear.base_radius * (cut - float(gear.half_angle(radius)))
    assert 5 < proud < 60
    assert f"stands {proud:.1f} µm proud" in text
    assert "planet.dedendum" in text
    assert not tooth_warnings(load_case("wind-5mw", SPUR).view())


def test_undercut_shortens_the_path_of_contact():
    keys = {
        "stage.sun.teeth": "12", "stage.planet.teeth": "48", "stage.ring.teeth": "108",
        "stage.planets": "3", **SPUR,
    }  # fmt: skip
    view = load_case("wind-5mw", keys).view()
    texts = tooth_warnings(view)
    assert any("sun: its tool undercuts" in text for text in texts)
    assert any("does not cover the path of contact" in text for text in texts)
    g = stage_geometry(view)
    between = g.planet.tangent_distance(g.sun, g.sun_mesh.working_angle)
    at_end = g.sun.roll_length(g.sun.form_radius)
    assert g.sun_mesh.s_hi == pytest.approx(between - at_end, rel=1e-12)
    assert g.sun_mesh.s_hi < g.planet.roll_length(g.planet.tip_radius)


@pytest.mark.parametrize("teeth", [60, 93])
def test_a_cutter_trims_rings_with_less_than_18_teeth_more(teeth):
    """The textbook's difference for radial infeed, 20° and full depth."""
    for more, trims in ((16, True), (18, False)):
        gear = Gear(teeth, 0.0, root_fillet=0.2, tool=PlainTool(teeth=teeth - more))
        assert (trimmed(gear.tooth(internal=True)) > 0.01 * gear.normal_module) == trims
