"""Can this machine render? Asked in a subprocess, because VTK without GL libraries segfaults."""

from __future__ import annotations

import os
import subprocess
import sys
from functools import lru_cache

from flexgear.model.errors import FlexgearError

WINDOW_VARIABLE = "VTK_DEFAULT_OPENGL_WINDOW"
EGL = "vtkEGLRenderWindow"
OSMESA = "vtkOSOpenGLRenderWindow"
GL_PACKAGES = "libgl1 libegl1 libglu1-mesa libxcursor1 libxft2 libxinerama1 libgomp1"
OSMESA_PACKAGE = "libosmesa6"
TIMEOUT = 60.0  # s for one small picture

PROBE = """
try:
    import resource
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
except (ImportError, ValueError, OSError):
    pass
import numpy, pyvista
plotter = pyvista.Plotter(off_screen=True, window_size=(48, 48))
plotter.set_background("white")
plotter.add_mesh(pyvista.Sphere(), color="black")
picture = plotter.screenshot(None, return_img=True)
plotter.close()
raise SystemExit(0 if numpy.ptp(picture) > 50 else 3)
"""


def apt_line(packages: str = GL_PACKAGES) -> str:
    """The command that installs what rendering needs on Debian and Ubuntu."""
    sudo = "" if hasattr(os, "geteuid") and os.geteuid() == 0 else "sudo "
    return f"{sudo}apt-get install -y --no-install-recommends {packages}"


def candidates() -> tuple[str | None, ...]:
    """Render windows to try, in order; None is VTK's own choice."""
    chosen = os.environ.get(WINDOW_VARIABLE)
    headless = sys.platform.startswith("linux") and not os.environ.get("DISPLAY")
    usual = (EGL, OSMESA) if headless else (None, EGL, OSMESA)
    if chosen:
        return (chosen, *(window for window in usual if window != chosen))
    return usual


def probe(window: str | None, timeout: float) -> str:
    """Render one small picture with ``window`` in a subprocess: "" if it worked, else why not."""
    environment = dict(os.environ)
    environment.pop(WINDOW_VARIABLE, None)
    if window is not None:
        environment[WINDOW_VARIABLE] = window
    try:
        done = subprocess.run(
            [sys.executable, "-c", PROBE],
            env=environment,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            stdin=subprocess.DEVNULL,
            timeout=timeout,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return f"no picture within {timeout:g} s"
    except OSError as error:
        return f"the probe did not start ({error.strerror})"
    if done.returncode == 0:
        return ""
    if done.returncode < 0:
        return f"VTK died of signal {-done.returncode}"
    if done.returncode == 3:
        return "the picture stayed empty"
    lines = done.stderr.decode(errors="replace").strip().splitlines()
    return lines[-1] if lines else f"exit code {done.returncode}"


@lru_cache(maxsize=1)
def working_window() -> tuple[bool, str | None, str]:
    """Try offscreen rendering, once a process: whether it works, the render window to use, and why
    the default window failed."""
    first = ""
    for window in candidates():
        reason = probe(window, TIMEOUT)
        if not reason:
            return True, window, ""
        first = first or reason
    return False, None, first


def rendering_available() -> bool:
    """True where an offscreen picture can be drawn, be it with EGL, GLX or OSMesa."""
    return working_window()[0]


def require_rendering() -> None:
    """Make VTK use the render window that works; `FlexgearError` with the apt line if none does."""
    works, window, reason = working_window()
    if not works:
        raise FlexgearError(
            f"cannot render in 3D ({reason}): install the OpenGL libraries with "
            f"'{apt_line()}' (or, without EGL, '{apt_line(OSMESA_PACKAGE)}')"
        )
    if window is not None:
        os.environ[WINDOW_VARIABLE] = window
