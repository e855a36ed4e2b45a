"""Figure-8 view: magnifications, frames, what is taken out."""

from __future__ import annotations

import numpy as np

from flexgear.views import positions
from flexgear.views.style import DEFORMED_COLOUR


def test_equilibrium_view_takes_out_the_rigid_turn_and_magnifies(outline, steady):
    """Planet 1 sits 320 µm behind: at × 500 its circle is drawn 0.16 m against the rotation."""
    position = steady["flexible"].isel(time=[700])
    figure = positions.equilibrium_positions(position, outline)
    angle = float(position["carrier_angle"][0])
    left, right = figure.axes
    circles = [li for li in left.get_lines() if li.get_color() == DEFORMED_COLOUR]
    centres = [np.column_stack(li.get_data())[:-1].mean(axis=0) for li in circles]
    radial = 500 * float(position["planet_displacement"][0, 0, 0])
    e_r = np.array([np.cos(angle), np.sin(angle)])
    e_t = np.array([-np.sin(angle), np.cos(angle)])
    expected = (outline.center_distance + radial) * e_r - 0.16 * e_t
    assert min(np.linalg.norm(c - expected) for c in centres) < 1e-6
    assert (right.get_xlabel(), right.get_ylabel()) == ("Y (m)", "Z (m)")
    for words in ("2\u2009000", "500", "10\u2009000", "50\u2009000", "5\u2009000"):
        assert words in figure.get_suptitle()


def test_tilt_shows_in_the_side_view():
    disc = positions.Disc(np.zeros(3), 0.3, np.array([0, 0, 0, 1e-5, 0, 7.0]))
    points, moved = disc.curves()
    np.testing.assert_allclose(moved[:, 2], 1e-5 * points[:, 1], atol=1e-18)
    np.testing.assert_allclose(moved[:, :2], 0, atol=1e-18)


def test_without_a_drive_node_nothing_is_taken_out(steady):
    position = steady["flexible"].isel(time=100)
    assert positions.drive_rotation(position) > 0
    assert positions.drive_rotation(position.drop_vars("carrier_displacement")) == 0
    assert positions.drive_rotation(position.assign_coords(carrier_node=["pin_1"])) == 0
