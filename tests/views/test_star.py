"""The star has its points where the field has its maxima, still and turning."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from flexgear.views import star

TENTH, FIFTH = 2 * np.pi / 10, 2 * np.pi / 5


def deformed(axes) -> np.ndarray:
    (line,) = [li for li in axes.get_lines() if li.get_label() == "deformed ring"]
    return 1e-3 * np.column_stack(line.get_data())  # drawn in mm, as labels and pointers say


def peaks(radius: np.ndarray) -> np.ndarray:
    return np.flatnonzero((radius > np.roll(radius, 1)) & (radius >= np.roll(radius, -1)))


@pytest.mark.parametrize("angle", [0.0, 0.3, TENTH, FIFTH])
def test_five_points_stand_at_the_planets(outline, angle):
    phi = 2 * np.pi * np.arange(93) / 93
    ripple = 30e-6 * np.cos(5 * (phi - angle))
    field = np.column_stack([ripple * np.cos(phi), ripple * np.sin(phi), 0 * phi])
    figure = star.ring_star(field[None], np.array([angle]), outline)
    points = deformed(figure.axes[0])[:-1]
    radius = np.hypot(*points.T)
    assert radius.max() == pytest.approx(outline.ring_radius + 0.06, abs=1e-3)
    tops = np.arctan2(points[peaks(radius), 1], points[peaks(radius), 0]) % (2 * np.pi)
    planets = np.sort((angle + np.array(outline.planet_angles)) % (2 * np.pi))
    assert tops.size == 5
    gaps = np.abs(np.sort(tops)[:, None] - planets[None, :])
    assert np.minimum(gaps, 2 * np.pi - gaps).min(axis=0).max() <= np.pi / 93 + 1e-9


def test_star_states_its_exaggeration_and_units(outline, field):
    angles = np.array([TENTH, FIFTH])
    figure = star.ring_star(field(angles), angles, outline)
    assert "× 2\u2009000" in figure.get_suptitle()
    assert [ax.get_xlabel() for ax in figure.axes] == ["X (mm)", "X (mm)"]
    assert "2π/5" in figure.axes[1].get_title(loc="left")


def test_undeformed_ring_is_drawn_without_dividing_by_zero(outline):
    figure = star.ring_star(np.zeros((1, 93, 3)), np.zeros(1), outline)
    np.testing.assert_allclose(np.hypot(*deformed(figure.axes[0]).T), outline.ring_radius)


def test_radial_profile_is_in_micrometres(outline, field):
    figure = star.radial_profile(field(np.zeros(1)), np.zeros(1), outline)
    values = figure.axes[0].get_lines()[0].get_ydata()
    assert np.max(values) == pytest.approx(30.0)
    assert "µm" in figure.axes[0].get_ylabel()


ANGLES = np.linspace(0, 2 * np.pi / 5, 5, endpoint=False)


def test_gif_has_one_moving_frame_an_angle(tmp_path: Path, outline, field):
    path = star.animate_star(field(ANGLES), ANGLES, outline, tmp_path / "star.gif", dpi=60)
    with Image.open(path) as clip:
        assert clip.n_frames == 5
        assert clip.info["loop"] == 0
        first = np.asarray(clip.convert("RGB"), dtype=int)
        clip.seek(2)
        assert np.abs(np.asarray(clip.convert("RGB"), dtype=int) - first).max() > 100
    assert list(tmp_path.iterdir()) == [path]


def test_stopped_animation_leaves_nothing(tmp_path: Path, outline, field, monkeypatch):
    def stop(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("flexgear.views.star.draw_star", stop)
    with pytest.raises(KeyboardInterrupt):
        star.animate_star(field(ANGLES), ANGLES, outline, tmp_path / "star.gif", dpi=40)
    assert list(tmp_path.iterdir()) == []
