"""Plotly panels of deformed bodies and of their natural modes."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.colors import to_hex
from numpy.typing import NDArray

from flexgear.arrays import Array
from flexgear.results.report.wording import number
from flexgear.views.interactive import Panel
from flexgear.views.render import body_surface, deformation_exaggeration
from flexgear.views.style import MEGA, MICRO, MILLI, SEQUENTIAL_MAP, factor_text

TRIANGLES = 40_000  # of a body on the page
PAGE_TRIANGLES = 80_000  # of all bodies of a page
MODE_SIZE = 0.06  # drawn largest displacement in a mode over the size of the body
EYE = {"eye": {"x": 0.8, "y": -1.4, "z": 1.3}}
CORNER = {"direction": "left", "x": 0.02, "y": 0.98, "xanchor": "left", "yanchor": "top"}
PARTS, COLOURS = 5000, 500  # about: of the largest coordinate, and of the largest colour


def body_scene(
    points: Array,
    cells: NDArray[np.integer],
    displacement: Array,
    von_mises: Array,
    triangles: int = TRIANGLES,
) -> list[Panel]:
    """Surface x + f u of a body, coloured by |u| in µm, or after a click by the equivalent stress
    von_mises (p,), Pa, in MPa; triangles: their largest number; other arguments as of
    ``render_deformed``."""
    u = np.asarray(displacement, dtype=float)
    factor = deformation_exaggeration(np.asarray(points, dtype=float), u)
    at, corners, vertex = coarse_surface(points, cells, triangles)
    deformed = MILLI * (at + factor * u[vertex])
    reach = float(np.abs(deformed).max())
    size = np.linalg.norm(u[vertex], axis=1) * MICRO
    trace: dict[str, Any] = {
        "type": "mesh3d",
        **{name: _short(deformed[:, k], reach) for k, name in enumerate("xyz")},
        **_coloured(corners, size, "µm"),
    }
    shape = f"displacement {factor_text(factor)}"
    caption = f"{shape}, largest {number(size.max())} µm"
    layout = _layout([{}, {}, {}]) | {"title": {"text": caption}}
    stress = MEGA * np.asarray(von_mises)[vertex]
    layout["updatemenus"] = [_colours_of(trace, shape, caption, stress)]
    return [{"data": [trace], "layout": layout}]


def mode_scene(
    points: Array,
    cells: NDArray[np.integer],
    shapes: Array,
    labels: Sequence[str],
    triangles: int = TRIANGLES,
) -> list[Panel]:
    """A body in natural modes, coloured by its displacement in per cent of the largest. shapes:
    (m, p, 3) with largest displacement 1. ``swing`` of the panel has the undeformed surface and the
    displacements of each mode, by label, between which the page animates."""
    at, corners, vertex = coarse_surface(points, cells, triangles)
    by = MODE_SIZE * np.ptp(points, axis=0).max()
    rest, drawn = MILLI * at, MILLI * by * shapes[:, vertex]
    sizes = [np.rint(100 * np.linalg.norm(shape[vertex], axis=1)) for shape in shapes]
    reach = float(np.abs(rest).max())
    modes = [
        {"label": label, "by": [_short(x, reach) for x in shape.T], "size": size.tolist()}
        for label, shape, size in zip(labels, drawn, sizes, strict=True)
    ]
    low, high = (MILLI * (end + sign * by) for end, sign in ((at.min(0), -1), (at.max(0), 1)))
    layout = _layout([{"range": _short(ends, reach)} for ends in zip(low, high, strict=True)])
    layout["scene"]["uirevision"] = "kept"
    trace = {
        "type": "mesh3d",
        **_coloured(corners, sizes[0], "%"),
        "cmin": 0,
        "cmax": 100,
    }
    swing = {"rest": [_short(x, reach) for x in rest.T], "modes": modes}
    return [{"data": [trace], "layout": layout, "swing": swing}]


def _layout(axes: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Layout of a 3D panel with equal scales in mm; axes: further settings of x, y and z."""
    bare = {"showbackground": False, "showspikes": False}
    named = {
        f"{name}axis": {**bare, "title": {"text": f"{name} (mm)"}, **axis}
        for name, axis in zip("xyz", axes, strict=True)
    }
    scene = {"aspectmode": "data", "camera": EYE, **named}
    return {"scene": scene, "margin": {"l": 0, "r": 0, "t": 0, "b": 0}}


def _coloured(corners: NDArray[np.integer], size: Array, unit: str) -> dict[str, Any]:
    """Triangles of a surface, coloured by the displacement of their corners in a unit."""
    colours = colormaps[SEQUENTIAL_MAP](np.linspace(0, 1, 11))
    return {
        **{name: corners[:, k].tolist() for k, name in enumerate("ijk")},
        "intensity": _short(size, float(size.max()), COLOURS),
        "colorscale": [[k / 10, to_hex(c)] for k, c in enumerate(colours)],
        "colorbar": {"title": {"text": unit}, "thickness": 12},
        "hovertemplate": f"displacement: %{{intensity:.4~g}} {unit}<extra></extra>",
        "lighting": {"ambient": 0.6, "diffuse": 0.7, "specular": 0.1},
    }


def triangles_of_each(bodies: int) -> tuple[int, int]:
    """Largest number of triangles of a deformed body and of a body in modes, so that all bodies
    together have at most ``PAGE_TRIANGLES``; modes have a fifth, as each adds a field."""
    share = PAGE_TRIANGLES // max(1, bodies)
    return min(TRIANGLES, share - share // 5), share // 5


def coarse_surface(
    points: Array, cells: NDArray[np.integer], triangles: int
) -> tuple[Array, NDArray[np.integer], NDArray[np.integer]]:
    """Undeformed surface of an FE mesh with at most ``triangles`` triangles: points (q, 3), indices
    of points at the corners of triangles (t, 3), and index of the nearest vertex of the FE mesh to
    each point (q,)."""
    full = body_surface(points, cells, np.zeros(len(points))).triangulate()
    vertex = np.asarray(full.point_data["vtkOriginalPointIds"])
    surface = full
    if full.n_cells > triangles:
        surface = _decimated(full, triangles)
        vertex = vertex[[full.find_closest_point(point) for point in surface.points]]
    at = np.asarray(surface.points, dtype=float)
    return at, surface.faces.reshape(-1, 4)[:, 1:], vertex


def _decimated(surface: Any, triangles: int) -> Any:
    """The surface with at most ``triangles`` triangles (vtkDecimatePro).

    The topology is preserved if possible; otherwise holes may close and small pieces vanish.
    """
    share = 1 - triangles / surface.n_cells
    decimated = surface.decimate_pro(share, preserve_topology=True)
    if decimated.n_cells > triangles:
        decimated = surface.decimate_pro(share, preserve_topology=False)
    return decimated


def _colours_of(trace: dict[str, Any], shape: str, caption: str, stress: Array) -> dict[str, Any]:
    """Buttons that colour a body by displacement, the first state, or by stress in MPa."""
    of_stress = f"equivalent stress, largest {number(stress.max())} MPa; {shape}"
    buttons = []
    for label, values, unit, title in (
        ("displacement", trace["intensity"], "µm", caption),
        ("stress", _short(stress, float(stress.max()), COLOURS), "MPa", of_stress),
    ):
        hover = f"{label}: %{{intensity:.4~g}} {unit}<extra></extra>"
        changes = {
            "intensity": [values], "colorbar.title.text": [unit], "hovertemplate": [hover],
        }  # fmt: skip
        args = [changes, {"title.text": title}]
        buttons.append({"label": label, "method": "update", "args": args})
    return {"type": "buttons", "buttons": buttons, **CORNER}


def _short(values: Any, largest: float, parts: int = PARTS) -> list[float]:
    """Values rounded to a power of ten near ``largest / parts``, which keeps the page small."""
    digits = round(math.log10(parts / largest)) if largest else 0
    return [round(float(v), digits) for v in values]
