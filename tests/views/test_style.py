"""House style: units, colours, atomic saving, no trace in the user's matplotlib."""

import subprocess
import sys
from pathlib import Path

import matplotlib
import pytest
from matplotlib.figure import Figure
from PIL import Image

from flexgear.model.errors import FlexgearError
from flexgear.views import style


def test_importing_and_drawing_leaves_users_matplotlib_alone(steady):
    before = dict(matplotlib.rcParams)
    from flexgear.views.histories import load_sharing

    load_sharing(steady)
    assert dict(matplotlib.rcParams) == before


def test_pyplot_is_never_imported():
    code = (
        "import sys, flexgear.views.star, flexgear.views.histories, flexgear.views.histories, "
        "flexgear.views.vibration_charts, flexgear.views.star;"
        "raise SystemExit('matplotlib.pyplot' in sys.modules or 'pyvista' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


@pytest.mark.parametrize(
    ("value", "denominator", "text"),
    [(0.0, 5, "0"), (1.2566370614, 5, "2π/5"), (6.283185307, 5, "2π"), (-0.6283185307, 5, "−π/5")],
)
def test_angles_read_as_fractions_of_pi(value, denominator, text):
    assert style.pi_label(value, denominator) == text


@pytest.mark.parametrize(
    ("value", "nice"), [(2345.0, 2000.0), (999.0, 500.0), (1000.0, 1000.0), (0.07, 0.05), (0, 1)]
)
def test_nice_number_never_exceeds(value, nice):
    assert style.nice_number(value) == pytest.approx(nice)


def test_flexible_and_rigid_keep_their_colours_whatever_else_is_drawn():
    colours = style.variant_colours(["ring only", "rigid", "shaft only", "flexible"])
    assert colours["rigid"] == style.VARIANT_COLOURS["rigid"]
    assert colours["flexible"] == style.VARIANT_COLOURS["flexible"]
    assert len(set(colours.values())) == 4


@pytest.mark.parametrize("kind", ["png", "svg", "pdf"])
def test_save_figure_writes_by_suffix(tmp_path: Path, kind: str):
    figure = style.new_figure(40, 60)
    figure.subplots().plot([0, 1])
    path = style.save_figure(figure, tmp_path / "new" / f"a.{kind}", dpi=50)
    start = path.read_bytes()[:5]
    assert start.startswith({"png": b"\x89PNG", "svg": b"<?xml", "pdf": b"%PDF-"}[kind])
    assert [p.name for p in path.parent.iterdir()] == [path.name]


def test_saved_picture_has_the_asked_resolution(tmp_path: Path):
    path = style.save_figure(style.new_figure(50.8, 76.2), tmp_path / "a.png", dpi=100)
    with Image.open(path) as picture:
        assert picture.size == (300, 200)


def test_unknown_suffix_is_one_clear_line(tmp_path: Path):
    with pytest.raises(FlexgearError, match=r"suffix \.png, \.svg or \.pdf"):
        style.save_figure(style.new_figure(30, 30), tmp_path / "a.bmp")


def test_interrupted_write_keeps_the_old_file(tmp_path: Path, monkeypatch):
    path = tmp_path / "a.png"
    path.write_bytes(b"old")

    figure = style.new_figure(30, 30)

    def fail(self, *_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(Figure, "draw", fail)
    with pytest.raises(KeyboardInterrupt):
        style.save_figure(figure, path)
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]
