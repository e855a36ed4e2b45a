"""Offscreen 3D pictures of deformed bodies, rendered by pyvista and framed by matplotlib.

    drawn point = x + f u(x) ,  colour = |u| in µm ,

with the exaggeration f stated in the picture. The projection is parallel, so that the scale bar is
valid everywhere. VTK without GL libraries ends in a segmentation fault, so a subprocess tests first
whether this machine can render; pyvista is imported only after ``require_rendering``.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from numpy.typing import NDArray

from flexgear.arrays import Array
from flexgear.model.errors import FlexgearError, InputError
from flexgear.results.report.wording import number, with_unit
from flexgear.views.style import (
    FULL_WIDTH_MM,
    MICRO,
    SEQUENTIAL_MAP,
    factor_text,
    new_figure,
    nice_number,
    styled,
)

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
    """Command that installs the libraries for rendering on Debian and Ubuntu."""
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
    """Render one small picture with ``window`` in a subprocess: "" or the reason of failure."""
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
    """Whether offscreen rendering works, the render window to use, and the reason why the default
    window failed; tested once in a process."""
    first = ""
    for window in candidates():
        reason = probe(window, TIMEOUT)
        if not reason:
            return True, window, ""
        first = first or reason
    return False, None, first


def require_rendering() -> None:
    """Set the render window that works for VTK; FlexgearError with a remedy if there is none."""
    works, window, reason = working_window()
    if not works:
        raise FlexgearError(
            f"cannot render in 3D ({reason}): install the OpenGL libraries with "
            f"'{apt_line()}' (or, without EGL, '{apt_line(OSMESA_PACKAGE)}')"
        )
    if window is not None:
        os.environ[WINDOW_VARIABLE] = window


PER_CENT = 1e-4  # m: a mode is scaled to 100 µm, so that µm are per cent
VTK_CELLS = {4: 10, 8: 12}  # tetrahedron, hexahedron
VIEWS: Mapping[str, tuple[Array, Array]] = {  # direction towards the eye, up
    "iso": (np.array([0.45, -0.85, 0.95]), np.array([0.0, 0.0, 1.0])),
    "axial": (np.array([0.0, 0.0, 1.0]), np.array([0.0, 1.0, 0.0])),
    "side": (np.array([0.0, -1.0, 0.12]), np.array([0.0, 0.0, 1.0])),
    "back": (np.array([0.45, -0.85, -0.95]), np.array([0.0, 0.0, 1.0])),
}


@dataclass(frozen=True)
class Snapshot:
    """Rendered pixels (h, w, 3), the height they span (m), and the eye's right and up axes."""

    pixels: NDArray[np.uint8]
    height: float
    right: Array
    up: Array


def load_renderer() -> None:
    """Import pyvista, which takes seconds, if this machine can render."""
    if working_window()[0]:
        require_rendering()
        import pyvista  # noqa: F401


def eye_axes(view: str) -> tuple[Array, Array, Array]:
    """Unit vectors to the eye, right and up of a named view."""
    towards, up = (v / np.linalg.norm(v) for v in VIEWS[view])
    right = np.cross(up, towards)
    right /= np.linalg.norm(right)
    return towards, right, np.cross(towards, right)


def deformation_exaggeration(points: Array, displacement: Array) -> float:
    """Round factor that draws the largest displacement as at most 6 % of the body's size."""
    size = float(np.max(np.ptp(points, axis=0)))
    largest = float(np.max(np.linalg.norm(displacement, axis=1), initial=0.0))
    return nice_number(0.06 * size / largest) if largest > 0 else 1.0


def field_grid(field: xr.Dataset) -> Any:
    """A field (``deformed``) as an undeformed pyvista.UnstructuredGrid, m, with the point data
    "displacement" (p, 3), m, "stress_Pa" (p, 6: xx, yy, zz, xy, yz, xz) and "von_mises_stress_Pa",
    ready for ``warp_by_vector`` and ``save``. InputError for another dataset."""
    if "point" not in field or "cell" not in field:
        remedy = "give one of deformed() or mode_field()"
        raise InputError("--field", "dataset", "is no field of a body", remedy)
    grid = _grid(field["point"].to_numpy(), field["cell"].to_numpy())
    grid.point_data["displacement"] = field["displacement"].to_numpy()
    for name in ("stress", "von_mises_stress"):
        grid.point_data[f"{name}_{field[name].attrs['units']}"] = field[name].to_numpy()
    return grid


def body_surface(points: Array, cells: NDArray[np.integer], values: Array) -> Any:
    """Outer surface (pyvista PolyData) of a hex8 or tet4 mesh with point data "µm"."""
    grid = _grid(points, cells)
    grid.point_data["µm"] = values
    return grid.extract_surface(algorithm="dataset_surface")


def _grid(points: Array, cells: NDArray[np.integer]) -> Any:
    """pyvista.UnstructuredGrid of a hex8 or tet4 mesh."""
    import pyvista

    from flexgear.structures.fe_mesh.fe_mesh import HEX_TO_VTK

    corners = cells.shape[1]
    if corners == 8:
        cells = cells[:, HEX_TO_VTK]
    return pyvista.UnstructuredGrid({VTK_CELLS[corners]: cells}, points.astype(float))


def snapshot(
    points: Array,
    cells: NDArray[np.integer],
    displacement: Array,
    factor: float,
    limits: tuple[float, float],
    view: str,
    window_size: tuple[int, int],
) -> Snapshot:
    """Pixels of the deformed body with its undeformed outline, without text."""
    require_rendering()
    import pyvista

    towards, right, up = eye_axes(view)
    magnitude = np.linalg.norm(displacement, axis=1) * MICRO
    rest = body_surface(points, cells, magnitude)
    deformed = body_surface(points + factor * displacement, cells, magnitude)
    bounds = np.vstack([rest.points, deformed.points])
    across, along = bounds @ right, bounds @ up
    width, height = np.ptp(across), np.ptp(along)
    aspect = window_size[0] / window_size[1]
    span = 1.06 * max(float(height), float(width) / aspect)
    middle = 0.5 * (across.max() + across.min()) * right + 0.5 * (along.max() + along.min()) * up
    plotter = pyvista.Plotter(off_screen=True, window_size=list(window_size), lighting="none")
    try:
        plotter.set_background("white")
        plotter.add_mesh(
            deformed,
            scalars="µm",
            cmap=SEQUENTIAL_MAP,
            clim=list(limits),
            show_scalar_bar=False,
            smooth_shading=True,
            split_sharp_edges=True,
            feature_angle=35.0,
            ambient=0.6,
            diffuse=0.45,
            specular=0.0,
        )
        edges = rest.extract_feature_edges(
            feature_angle=35.0, boundary_edges=True, manifold_edges=False
        )
        if edges.n_points:
            plotter.add_mesh(edges, color="#30343B", line_width=1.5, opacity=0.8)
        light = pyvista.Light(position=(0.35, 0.45, 1.0), light_type="camera light")
        plotter.add_light(light)
        plotter.enable_parallel_projection()
        distance = 4.0 * float(np.max(np.ptp(bounds, axis=0)))
        plotter.camera.focal_point = middle
        plotter.camera.position = middle + distance * towards
        plotter.camera.up = up
        plotter.camera.parallel_scale = 0.5 * span
        plotter.reset_camera_clipping_range()
        plotter.enable_anti_aliasing("ssaa")
        pixels = np.asarray(plotter.screenshot(None, return_img=True))
    finally:
        plotter.close()
    return Snapshot(pixels[..., :3], span, right, up)


@styled
def render_deformed(
    points: Array,
    cells: NDArray[np.integer],
    displacement: Array,
    title: str = "",
    exaggeration: float | None = None,
    view: str = "iso",
    window_size: tuple[int, int] = (1500, 1100),
    relative: bool = False,
) -> Figure:
    """Picture of a deformed body with its undeformed outline as dark lines.

    points: (n, 3) m; cells: (m, 8) or (m, 4), in the vertex order of `FeMesh` (scikit-fem, not
    VTK); displacement: (n, 3) m; view: iso, axial, side or back; relative: whether the displacement
    has an arbitrary amplitude, as that of a mode, so that colours are per cent of the largest.
    """
    points = np.asarray(points, dtype=float)
    displacement = np.asarray(displacement, dtype=float)
    if relative:
        displacement = displacement * (PER_CENT / np.linalg.norm(displacement, axis=1).max())
    factor = exaggeration or deformation_exaggeration(points, displacement)
    largest = float(np.max(np.linalg.norm(displacement, axis=1), initial=0.0)) * MICRO
    limits = (0.0, largest or 1.0)
    shot = snapshot(points, cells, displacement, factor, limits, view, window_size)
    size = f"displacement {factor_text(factor)}, largest {number(largest)} µm"
    bar_title, label = size, "displacement magnitude (µm)"
    if relative:
        bar_title, label = "amplitude arbitrary", "displacement (% of the largest)"
    head = "; ".join([bar_title, "dark lines: undeformed"])
    return framed(shot, f"{title}\n{head}" if title else head, label, limits)


def framed(shot: Snapshot, title: str, label: str, limits: tuple[float, float]) -> Figure:
    """Figure of the pixels with title, colour bar, scale bar and axes."""
    rows, columns = shot.pixels.shape[:2]
    figure = new_figure(FULL_WIDTH_MM * 0.86 * rows / columns + 10)
    ax = figure.subplots()
    ax.imshow(shot.pixels, interpolation="antialiased")
    ax.set_axis_off()
    ax.set_title(title, fontsize=9)
    colours = ScalarMappable(Normalize(*limits), SEQUENTIAL_MAP)
    figure.colorbar(colours, ax=ax, label=label, shrink=0.75, pad=0.01, aspect=26)
    draw_scale_bar(ax, shot)
    draw_triad(ax, shot)
    return figure


def draw_scale_bar(axes: Any, shot: Snapshot) -> None:
    """Draw a bar of a round length in the lower right corner."""
    rows, columns = shot.pixels.shape[:2]
    metre = rows / shot.height
    bar = nice_number(0.28 * columns / metre)
    right, y = 0.97 * columns, 0.965 * rows
    left = right - bar * metre
    axes.plot([left, right], [y, y], color="black", lw=2.2, solid_capstyle="butt")
    axes.text(0.5 * (left + right), y - 0.012 * rows, with_unit(bar, "m"), ha="center", va="bottom")


def draw_triad(axes: Any, shot: Snapshot) -> None:
    """Draw the directions of X, Y, Z in the lower left corner."""
    rows, columns = shot.pixels.shape[:2]
    origin = np.array([0.085 * columns, 0.90 * rows])
    length = 0.075 * rows
    for k, name in enumerate("XYZ"):
        step = length * np.array([shot.right[k], -shot.up[k]])
        if np.hypot(*step) < 0.2 * length:
            continue
        tip = origin + step
        axes.annotate(
            "", tip, origin, arrowprops={"arrowstyle": "-|>", "lw": 1.0, "color": "black"}
        )
        axes.text(*(origin + 1.32 * step), name, ha="center", va="center", fontsize=8)
