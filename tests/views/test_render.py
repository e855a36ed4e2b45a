"""Probing for a renderer, and pictures where there is one."""

import os
import subprocess

import numpy as np
import pytest

from flexgear.model.errors import FlexgearError
from flexgear.views import render

needs_gl = pytest.mark.skipif(  # text, for the process that comes to such a test
    "not render.working_window()[0]", reason="no OpenGL library for offscreen rendering"
)


@pytest.fixture
def fresh_probe(monkeypatch):
    """Forget what was probed, before and after."""
    monkeypatch.setenv(render.WINDOW_VARIABLE, "restored afterwards")
    monkeypatch.delenv(render.WINDOW_VARIABLE)
    monkeypatch.delenv("DISPLAY", raising=False)
    render.working_window.cache_clear()
    yield monkeypatch
    render.working_window.cache_clear()


def test_segfault_in_the_probe_becomes_the_apt_line(fresh_probe):
    fresh_probe.setattr(render, "PROBE", "import os, signal; os.kill(os.getpid(), signal.SIGSEGV)")
    assert not render.working_window()[0]
    with pytest.raises(FlexgearError, match="signal 11") as caught:
        render.require_rendering()
    line = (
        "apt-get install -y --no-install-recommends "
        "libgl1 libegl1 libglu1-mesa libxcursor1 libxft2 libxinerama1 libgomp1"
    )
    assert line in str(caught.value)
    assert "libosmesa6" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_hanging_probe_is_given_up(fresh_probe):
    fresh_probe.setattr(render, "PROBE", "import time; time.sleep(30)")
    assert "no picture within" in render.probe(None, timeout=0.3)


def test_missing_library_is_named(fresh_probe):
    fresh_probe.setattr(render, "PROBE", "raise ImportError('libGL.so.1: cannot open')")
    assert "libGL.so.1" in render.probe(None, timeout=20)


def test_osmesa_is_the_fallback(fresh_probe):
    fresh_probe.setattr(
        render,
        "PROBE",
        f"import os; raise SystemExit(os.environ.get('{render.WINDOW_VARIABLE}') != "
        f"'{render.OSMESA}')",
    )
    fresh_probe.setenv("DISPLAY", "")
    render.require_rendering()
    assert os.environ[render.WINDOW_VARIABLE] == render.OSMESA


def test_probe_runs_once_a_process(fresh_probe):
    calls = []
    real = subprocess.run
    fresh_probe.setattr(render, "PROBE", "raise SystemExit(0)")
    fresh_probe.setattr(subprocess, "run", lambda *a, **k: calls.append(1) or real(*a, **k))
    assert render.working_window()[0]
    assert render.working_window()[0]
    assert len(calls) == 1


@pytest.mark.parametrize("view", list(render.VIEWS))
def test_eye_axes_are_orthonormal_and_right_handed(view):
    towards, right, up = render.eye_axes(view)
    np.testing.assert_allclose(np.cross(right, up), towards, atol=1e-12)


@needs_gl
def test_deformed_ring_is_rendered_with_bar_factor_and_scale(annulus):
    points, cells, displacement = annulus
    figure = render.render_deformed(
        points, cells, displacement, "Ring", view="axial", window_size=(300, 240)
    )
    ax, bar = figure.axes
    assert "× 2\u2009000" in ax.get_title(loc="left")
    assert "largest 40 µm" in ax.get_title(loc="left")
    assert bar.get_ylabel() == "displacement magnitude (µm)"
    assert any(text.get_text().endswith(" mm") for text in ax.texts)
    picture = np.asarray(ax.images[0].get_array())
    filled = (picture < 250).any(axis=2)
    assert 0.1 < filled.mean() < 0.6
    assert not filled[100:140, 130:170].any()  # the middle of the ring is empty


@needs_gl
def test_length_scale_holds(annulus):
    """A ring 2.12 m wide, undeformed and seen along its axis, spans 2.12 m by its own scale."""
    points, cells, displacement = annulus
    shot = render.snapshot(points, cells, 0 * displacement, 1.0, (0.0, 1.0), "axial", (1600, 1600))
    columns = np.flatnonzero((shot.pixels < 250).any(axis=2).any(axis=0))
    width = (columns[-1] - columns[0] + 1) / 1600 * shot.height
    assert width == pytest.approx(2.12, rel=0.01)


@needs_gl
def test_tetrahedra_are_rendered():
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
    cells = np.array([[0, 1, 2, 3]])
    figure = render.render_deformed(points, cells, 1e-6 * points, window_size=(120, 100))
    assert len(figure.axes) == 2
