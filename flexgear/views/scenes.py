"""Deformed bodies that turn under the mouse and the star that turns by itself, as plotly panels."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.colors import to_hex
from numpy.typing import NDArray

from flexgear.views.interactive import Panel
from flexgear.views.render import body_surface, deformation_exaggeration
from flexgear.views.star import StageOutline, ring_points, star_exaggeration
from flexgear.views.style import (
    DEFORMED_COLOUR,
    MEGA,
    MICRO,
    NEUTRAL,
    ORIGINAL_COLOUR,
    SEQUENTIAL_MAP,
    FloatArray,
    factor_text,
    planet_colour,
)

TRIANGLES = 40_000  # of a body on the page
PAGE_TRIANGLES = 80_000  # of all bodies of a page
FRAMES = 24  # of the star
CIRCLE = np.linspace(0, 2 * np.pi, 73)


def body_scene(
    points: FloatArray,
    cells: NDArray[np.integer],
    displacement: FloatArray,
    von_mises: FloatArray | None = None,
    triangles: int = TRIANGLES,
) -> list[Panel]:
    """Surface of a body x + f u, coloured by |u| in µm, or at a button by the equivalent stress in
    MPa where it is given, (p,) Pa, with at most so many triangles; other arguments as of
    ``render_deformed``."""
    u = np.asarray(displacement, dtype=float)
    factor = deformation_exaggeration(np.asarray(points, dtype=float), u)
    surface = body_surface(points, cells, np.linalg.norm(u, axis=1) * MICRO)
    there = surface.point_data["vtkOriginalPointIds"]
    surface.point_data["u"] = u[there]
    if von_mises is not None:
        surface.point_data["MPa"] = MEGA * np.asarray(von_mises)[there]
    surface = surface.triangulate()
    if surface.n_cells > triangles:
        full = surface  # whose points those that stay are
        surface = _decimated(full, triangles)
        kept = [full.find_closest_point(point) for point in surface.points]
        for name in ("u", "MPa") if von_mises is not None else ("u",):
            surface.point_data[name] = np.asarray(full.point_data[name])[kept]
    moved = np.asarray(surface.points, dtype=float) + factor * np.asarray(surface.point_data["u"])
    size = np.linalg.norm(np.asarray(surface.point_data["u"]), axis=1) * MICRO
    corners = surface.faces.reshape(-1, 4)[:, 1:]
    colours = colormaps[SEQUENTIAL_MAP](np.linspace(0, 1, 11))
    trace: dict[str, Any] = {
        "type": "mesh3d",
        **{name: _short(moved[:, k], 4) for k, name in enumerate("xyz")},
        **{name: corners[:, k].tolist() for k, name in enumerate("ijk")},
        "intensity": _short(size, 1),
        "colorscale": [[k / 10, to_hex(c)] for k, c in enumerate(colours)],
        "colorbar": {"title": {"text": "µm"}, "thickness": 12},
        "hovertemplate": "%{intensity:.1f} µm<extra></extra>",
        "lighting": {"ambient": 0.6, "diffuse": 0.7, "specular": 0.1},
    }

    axis = {"showbackground": False, "title": {"text": ""}, "showspikes": False}
    said = f"displacement {factor_text(factor)}, largest {size.max():.1f} µm"
    layout: dict[str, Any] = {
        "title": {"text": said},
        "scene": {"aspectmode": "data", "camera": {"eye": {"x": 0.8, "y": -1.4, "z": 1.3}},
                  "xaxis": axis, "yaxis": axis, "zaxis": axis},
        "margin": {"l": 0, "r": 0, "t": 0, "b": 0},
    }  # fmt: skip
    if von_mises is not None:
        layout["updatemenus"] = [_colours_of(trace, said, np.asarray(surface.point_data["MPa"]))]
    return [{"data": [trace], "layout": layout}]


def triangles_of_each(bodies: int) -> int:
    """Most triangles of each of so many bodies, which together stay within the page's."""
    return min(TRIANGLES, PAGE_TRIANGLES // max(1, bodies))


def _decimated(surface: Any, triangles: int) -> Any:
    """At most so many triangles of a surface: holes stay open where they can.

    Keeping holes and pieces bounds what can go; then they may close and vanish (vtkDecimatePro).
    """
    share = 1 - triangles / surface.n_cells
    kept = surface.decimate_pro(share, preserve_topology=True)
    if kept.n_cells > triangles:
        kept = surface.decimate_pro(share, preserve_topology=False)
    return kept


def _colours_of(trace: dict[str, Any], said: str, stress: FloatArray) -> dict[str, Any]:
    """Buttons that colour a body by displacement, as it is drawn first, or by stress in MPa."""
    shape = said.partition(",")[0]
    ways = {
        "displacement": (trace["intensity"], "µm", said),
        "stress": (
            _short(stress, 1),
            "MPa",
            f"equivalent stress, largest {stress.max():.1f} MPa; {shape}",
        ),
    }
    buttons = []
    for label, (values, unit, title) in ways.items():
        hover = f"%{{intensity:.1f}} {unit}<extra></extra>"
        shown = {
            "intensity": [values],
            "colorbar.title.text": [unit],
            "hovertemplate": [hover],
        }
        buttons.append({"label": label, "method": "update", "args": [shown, {"title.text": title}]})
    return {"type": "buttons", "direction": "left", "buttons": buttons, "x": 0.02, "y": 0.98,
            "xanchor": "left", "yanchor": "top"}  # fmt: skip


def star_scene(
    displacement: FloatArray, carrier_angles: FloatArray, outline: StageOutline
) -> list[Panel]:
    """The star turning with the carrier: displacement (p, z, 3) m at angles (p,) rad."""
    factor = star_exaggeration(displacement, outline.ring_radius)
    at = np.unique(np.linspace(0, len(carrier_angles) - 1, FRAMES).astype(int))
    frames: list[dict[str, Any]] = [
        {"name": f"{np.degrees(carrier_angles[k]):.1f}°",
         "data": _star(displacement[k], float(carrier_angles[k]), outline, factor)}
        for k in at
    ]  # fmt: skip
    circle = _line(outline.ring_radius * np.cos(CIRCLE), outline.ring_radius * np.sin(CIRCLE),
                   ORIGINAL_COLOUR, "undeformed", dash="dot")  # fmt: skip
    moving = {"traces": list(range(1, 1 + len(frames[0]["data"])))}
    frames = [frame | moving for frame in frames]
    still = {"frame": {"duration": 0, "redraw": False}, "mode": "immediate"}
    play = {"frame": {"duration": 90, "redraw": False}, "fromcurrent": True,
            "transition": {"duration": 0}}  # fmt: skip
    steps = [
        {"method": "animate", "label": f["name"], "args": [[f["name"]], still]} for f in frames
    ]
    buttons = [
        {"label": "▶ turn", "method": "animate", "args": [None, play]},
        {"label": "❚❚", "method": "animate", "args": [[None], still]},
    ]
    reach = 1.25 * outline.ring_radius
    layout = {
        "title": {"text": f"displacement {factor_text(factor)}"},
        "xaxis": {"range": [-reach, reach], "title": {"text": "X (m)"}},
        "yaxis": {"range": [-reach, reach], "scaleanchor": "x", "title": {"text": "Y (m)"}},
        "sliders": [{"steps": steps, "currentvalue": {"prefix": "carrier angle "},
                     "pad": {"t": 42}}],
        "updatemenus": [{"type": "buttons", "direction": "left", "buttons": buttons, "x": 0.02,
                         "y": 0.98, "xanchor": "left", "yanchor": "top", "showactive": False}],
        "height": 640,
    }  # fmt: skip
    return [{"data": [circle, *frames[0]["data"]], "layout": layout, "frames": frames}]


def _star(
    displacement: FloatArray, angle: float, outline: StageOutline, factor: float
) -> list[dict[str, Any]]:
    """Lines of one position: ring, sun, planets."""
    ring = ring_points(displacement, outline.ring_radius, factor)
    ring = np.vstack([ring, ring[:1]])
    lines = [_line(ring[:, 0], ring[:, 1], DEFORMED_COLOUR, "ring", width=2.5)]
    circles = [(np.zeros(2), outline.sun_radius, NEUTRAL, "sun")]
    for i in range(len(outline.planet_angles)):
        centre = outline.planet_centre(i, angle)
        circles.append((centre, outline.planet_radius, planet_colour(i + 1), f"planet {i + 1}"))
    for centre, radius, colour, name in circles:
        x, y = centre[0] + radius * np.cos(CIRCLE), centre[1] + radius * np.sin(CIRCLE)
        lines.append(_line(x, y, colour, name))
    return lines


def _line(
    x: FloatArray, y: FloatArray, colour: str, name: str, width: float = 1.5, dash: str = "solid"
) -> dict[str, Any]:
    return {
        "type": "scatter",
        "mode": "lines",
        "x": _short(x, 4),
        "y": _short(y, 4),
        "name": name,
        "showlegend": False,
        "line": {"color": colour, "width": width, "dash": dash},
    }


def _short(values: Any, digits: int) -> list[float]:
    return [round(float(v), digits) for v in values]
