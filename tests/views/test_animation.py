"""The turning star as a file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from flexgear.model.errors import FlexgearError
from flexgear.views.animation import animate_star, video_available

ANGLES = np.linspace(0, 2 * np.pi / 5, 5, endpoint=False)


def test_gif_has_one_moving_frame_an_angle_and_reports_progress(tmp_path: Path, outline, field):
    seen = []
    path = animate_star(
        field(ANGLES),
        ANGLES,
        outline,
        tmp_path / "star.gif",
        dpi=60,
        progress=lambda done, total: seen.append((done, total)),
    )
    with Image.open(path) as clip:
        assert clip.n_frames == 5
        assert clip.info["loop"] == 0
        first = np.asarray(clip.convert("RGB"), dtype=int)
        clip.seek(2)
        assert np.abs(np.asarray(clip.convert("RGB"), dtype=int) - first).max() > 100
    assert seen == [(k, 5) for k in range(1, 6)]
    assert list(tmp_path.iterdir()) == [path]


def test_stopped_animation_leaves_nothing(tmp_path: Path, outline, field):
    def stop(done, total):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        animate_star(field(ANGLES), ANGLES, outline, tmp_path / "star.gif", dpi=40, progress=stop)
    assert list(tmp_path.iterdir()) == []


def test_mp4_where_possible_else_a_remedy(tmp_path: Path, outline, field):
    path = tmp_path / "star.mp4"
    if video_available():
        animate_star(field(ANGLES), ANGLES, outline, path, dpi=40)
        assert path.stat().st_size > 1000
    else:
        with pytest.raises(FlexgearError, match="pip install imageio-ffmpeg"):
            animate_star(field(ANGLES), ANGLES, outline, path, dpi=40)


def test_other_suffixes_are_refused(tmp_path: Path, outline, field):
    with pytest.raises(FlexgearError, match=r"\.gif or \.mp4"):
        animate_star(field(ANGLES), ANGLES, outline, tmp_path / "star.avi")
