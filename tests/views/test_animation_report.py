"""The turning star as a file, and the HTML page."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from flexgear.model.errors import FlexgearError
from flexgear.views.animation import animate_star, video_available
from flexgear.views.report import rows_of, text_of, write_report
from flexgear.views.style import new_figure, save_figure

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


def test_summary_rows_carry_values_and_units():
    rows = rows_of({"steady": {"tooth_displacement_peak_um": {"x": 36.83}, "n": [1, 2.5]}})
    assert rows[0] == ("steady › tooth_displacement_peak_um › x", "36.83", "µm")
    assert rows[1][1] == "1, 2.5"
    assert text_of(1034567.0) == "1\u202f034\u202f567"
    assert text_of(True) == "yes"


def test_report_is_one_self_contained_page(tmp_path: Path):
    picture = save_figure(new_figure(20, 20), tmp_path / "a.png", dpi=40)
    page = write_report(
        tmp_path / "report.html",
        title="wind <5> MW",
        summary={"case": "wind", "kinematics": {"carrier_speed_rpm": 11.27}},
        pictures=[(picture, "A caption")],
        parameters='[stage]\nface_width_mm = 430 # "chosen"',
        version="1.2.3",
        content_hash="abc123",
        notes=["Ring tie: root, averaging."],
    )
    text = page.read_text("utf-8")
    assert "wind &lt;5&gt; MW" in text
    for words in ("11.27", "r/min", "A caption", "1.2.3", "abc123", "face_width_mm", "averaging"):
        assert words in text
    assert not re.search(r'(src|href)="(?!data:)', text)
    picture.unlink()
    assert "data:image/png;base64," in text


def test_missing_picture_is_one_clear_line(tmp_path: Path):
    with pytest.raises(FlexgearError, match=r"cannot read picture .*gone\.png"):
        write_report(tmp_path / "r.html", "t", {}, [(tmp_path / "gone.png", "")], {}, "1", "h")
    assert not (tmp_path / "r.html").exists()
