"""Topography of a modified flank: the tip above, amounts in micrometres, traces where they say."""

from __future__ import annotations

import numpy as np
import pytest

from flexgear.gears.flanks import GearFlank
from flexgear.gears.modifications import Flank, gaps_of
from flexgear.model.modifications import FlankModifications, Relief
from flexgear.views.interactive import panels_of
from flexgear.views.stage_drawing import flank_drawing

FLANKS = {
    "external": Flank(tip=0.030, root=0.010, half_face=0.05, base_radius=0.06),
    "internal": Flank(tip=0.040, root=0.060, half_face=0.05, base_radius=0.12),
}


@pytest.mark.parametrize("flank", FLANKS.values(), ids=FLANKS)
def test_axes_scale_and_traces(flank):
    given = FlankModifications(helix_slope=8e-6, tip_relief=Relief(amount=3e-5, length=0.01))
    one = GearFlank("planet", "ring", flank, tuple(gaps_of(given, flank)))
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


def test_a_flank_that_lacks_the_same_everywhere_has_no_contours():
    flank = FLANKS["external"]
    one = GearFlank("sun", "drive", flank, (lambda rho, z: 5e-6 + 0 * rho + 0 * z,))
    figure = flank_drawing(one)
    assert figure.axes[0].get_title(loc="left") == "sun, drive flank: 5 … 5 µm missing"
    figure.canvas.draw()


def test_the_map_is_interactive_in_a_report():
    given = FlankModifications(lead_crowning=8e-6)
    one = GearFlank("sun", "drive", FLANKS["external"], tuple(gaps_of(given, FLANKS["external"])))
    figure = flank_drawing(one)
    figure.canvas.draw()
    maps = [t for p in panels_of(figure) for t in p["data"] if t["type"] == "heatmap"]
    shown = np.array(maps[0]["z"])
    assert shown.shape[1] == len(maps[0]["x"]) and shown.max() == pytest.approx(8.0, rel=1e-2)
