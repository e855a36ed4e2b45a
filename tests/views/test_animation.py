"""The turning star as a file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from flexgear.views.animation import animate_star

ANGLES = np.linspace(0, 2 * np.pi / 5, 5, endpoint=False)


def test_gif_has_one_moving_frame_an_angle(tmp_path: Path, outline, field):
    path = animate_star(field(ANGLES), ANGLES, outline, tmp_path / "star.gif", dpi=60)
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

    monkeypatch.setattr("flexgear.views.animation.star_frame", stop)
    with pytest.raises(KeyboardInterrupt):
        animate_star(field(ANGLES), ANGLES, outline, tmp_path / "star.gif", dpi=40)
    assert list(tmp_path.iterdir()) == []
