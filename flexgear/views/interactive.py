"""Pictures that zoom: what a matplotlib figure shows, as plotly panels.

Each axes becomes one panel {"data": [...], "layout": {...}} in plotly's own terms, so that one
function draws a chart. Lines keep their envelope where they have more points than a screen.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PathCollection, PolyCollection, QuadMesh
from matplotlib.colors import to_hex, to_rgba
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.lines import Line2D
from matplotlib.patches import FancyArrowPatch, Patch, Rectangle
from matplotlib.text import Annotation
from matplotlib.ticker import FixedFormatter, FuncFormatter
from numpy.typing import NDArray

from flexgear.views.plain_math import plain_math

Panel = dict[str, Any]
Array = NDArray[Any]
POINTS = 12_000  # of all lines of a panel
LEAST_POINTS = 400  # of one line
CELLS = 200  # of a map along each side
TEXTS = 40  # of a panel
DIGITS = 5
PIXELS, LEAST_HEIGHT, MARGINS = 92, 300, 120  # an inch; of a panel's axes, and round them
DASHES = {"-": "solid", "--": "dash", ":": "dot", "-.": "dashdot"}
MARKERS = {"o": "circle", "s": "square", "^": "triangle-up", "v": "triangle-down", "D": "diamond",
           "x": "x-thin-open", "+": "cross-thin-open", ".": "circle"}  # fmt: skip


def panels_of(figure: Figure) -> list[Panel]:
    """Panels of a figure that has been drawn, in the order of its axes."""
    groups: list[list[Axes]] = []
    for axes in figure.axes:
        if axes.get_label() == "<colorbar>" or not axes.get_visible():
            continue
        same = next((g for g in groups if _same_place(g[0], axes)), None)
        if same is None:
            groups.append([axes])
        else:
            same.append(axes)
    found = [_panel(group) for group in groups]
    for legend in figure.legends:
        for panel in found:
            panel["data"] += list(_legend_entries(legend, panel["data"]))
    for panel in found:
        _name_once(panel["data"])
    return [panel for panel in found if panel["data"]]


def _name_once(traces: list[dict[str, Any]]) -> None:
    """One entry of the legend for all traces of a name, which it hides together."""
    known: set[str] = set()
    for trace in traces:
        name = trace.get("name")
        if name and trace.get("showlegend"):
            trace |= {"legendgroup": name, "showlegend": name not in known}
            known.add(name)


def _same_place(one: Axes, other: Axes) -> bool:
    """Whether axes lie over each other, as twins with two scales do."""
    return bool(np.allclose(one.get_position().bounds, other.get_position().bounds))


def _panel(group: list[Axes]) -> Panel:
    """A panel of one axes, or of two with a second scale at the right."""
    data: list[dict[str, Any]] = []
    layout: dict[str, Any] = {"shapes": [], "annotations": []}
    for k, axes in enumerate(group[:2]):
        traces = [t for t in _traces(axes) if t]
        if k:
            traces = [{**t, "yaxis": "y2"} for t in traces]
        layout["shapes"] += _marks(axes, "y2" if k else "y")
        if not k:
            layout["annotations"] = list(_texts(axes))
            layout["xaxis"] = _axis(axes, "x")
        layout["yaxis2" if k else "yaxis"] = _axis(axes, "y") | (
            {"overlaying": "y", "side": "right", "showgrid": False} if k else {}
        )
        if axes.get_legend() is not None:
            traces += list(_legend_entries(axes.get_legend(), traces))
        data += traces
    first = group[0]
    inches = first.get_window_extent().height / first.figure.dpi
    if PIXELS * inches > LEAST_HEIGHT:
        layout["height"] = round(PIXELS * inches) + MARGINS
    if first.get_aspect() in (1.0, "equal"):
        layout["yaxis"] |= {"scaleanchor": "x", "scaleratio": 1}
    title = first.get_title(loc="left") or first.get_title()
    if title:
        layout["title"] = {"text": plain_math(title)}
    return {"data": data, "layout": layout}


def _traces(axes: Axes) -> Iterator[dict[str, Any]]:
    lines = [x for x in axes.lines if x.get_visible() and x.get_transform() == axes.transData]
    most = max(LEAST_POINTS, POINTS // max(1, len(lines)))
    for collection in axes.collections:
        if collection.get_visible():
            yield from _of_collection(collection)
    for image in axes.images:
        yield _of_image(image)
    yield from _of_patches(axes)
    for line in lines:
        yield _of_line(line, most)


def _of_line(line: Line2D, most: int) -> dict[str, Any]:
    x, y = envelope(
        _numbers(line.get_xdata(orig=False)), _numbers(line.get_ydata(orig=False)), most
    )
    if not x.size:
        return {}
    colour = _colour(line.get_color())
    marker, style = str(line.get_marker()), str(line.get_linestyle())
    trace: dict[str, Any] = {"type": "scatter", "x": _listed(x), "y": _listed(y)} | _named(line)
    drawn = style in DASHES
    marked = marker in MARKERS
    trace["mode"] = "+".join(["lines"] * drawn + ["markers"] * marked) or "lines"
    if drawn:
        trace["line"] = {"color": colour, "width": 1.25 * float(line.get_linewidth()),
                         "dash": DASHES[style]}  # fmt: skip
        if str(line.get_drawstyle()).startswith("steps"):
            trace["line"]["shape"] = "hv"
    if marked:
        face = line.get_markerfacecolor()
        trace["marker"] = {
            "color": _colour(face) if _is_colour(face) else colour,
            "symbol": MARKERS[marker],
            "size": float(line.get_markersize()) * 1.2,
        }
    return trace


def envelope(x: Array, y: Array, most: int) -> tuple[Array, Array]:
    """At most about ``most`` points of a line: the least and largest of equal pieces."""
    if x.size <= most:
        return x, y
    pieces = max(1, most // 2)
    step = -(-x.size // pieces)
    at = []
    for start in range(0, x.size, step):
        piece = y[start : start + step]
        if np.isfinite(piece).any():
            ends = {start + int(np.nanargmin(piece)), start + int(np.nanargmax(piece))}
            at += sorted(ends)
        else:
            at.append(start)
    return x[at], y[at]


def _of_collection(collection: Any) -> Iterator[dict[str, Any]]:
    if isinstance(collection, QuadMesh):
        yield _of_quads(collection)
    elif isinstance(collection, PathCollection):
        at = _filled(collection.get_offsets())
        if not len(at):
            return
        faces = collection.get_facecolor()
        rgba = faces if len(faces) else collection.get_edgecolor()
        colours = [_colour(c) for c in rgba]
        marker = {"color": colours[0] if len(set(colours)) == 1 else colours, "size": 7}
        yield {"type": "scatter", "mode": "markers", "x": _listed(at[:, 0]),
               "y": _listed(at[:, 1]), "marker": marker} | _named(collection)  # fmt: skip
    elif isinstance(collection, LineCollection):
        yield from _polylines(collection, [np.asarray(s) for s in collection.get_segments()], False)
    elif isinstance(collection, PolyCollection):
        yield from _polylines(
            collection, [np.asarray(p.vertices) for p in collection.get_paths()], True
        )


def _polylines(collection: Any, pieces: list[Array], filled: bool) -> Iterator[dict[str, Any]]:
    if not pieces:
        return
    gap = np.full((1, 2), np.nan)
    points = np.vstack([part for piece in pieces for part in (np.asarray(piece, float), gap)])
    rgba = collection.get_facecolor() if filled else collection.get_edgecolor()
    colour = _colour(rgba[0]) if len(rgba) else "#6B7280"
    trace: dict[str, Any] = {
        "type": "scatter",
        "mode": "lines",
        "x": _listed(points[:, 0]),
        "y": _listed(points[:, 1]),
        "line": {"color": colour, "width": 1},
    }
    if filled:
        trace |= {"fill": "toself", "fillcolor": colour, "line": {"width": 0}, "hoverinfo": "skip"}
    yield trace | _named(collection)


def _of_quads(quads: QuadMesh) -> dict[str, Any]:
    corners: Any = quads.get_coordinates()
    x, y = corners[0, :, 0], corners[:, 0, 1]
    z = _filled(quads.get_array()).reshape(len(y) - 1, len(x) - 1)
    return _map(0.5 * (x[1:] + x[:-1]), 0.5 * (y[1:] + y[:-1]), z, quads)


def _of_image(image: AxesImage) -> dict[str, Any]:
    z = _filled(image.get_array())
    if z.ndim != 2:
        return {}
    left, right, bottom, top = image.get_extent()
    rows, columns = z.shape
    x = left + (np.arange(columns) + 0.5) * (right - left) / columns
    ends = (top, bottom) if image.origin == "upper" else (bottom, top)
    y = ends[0] + (np.arange(rows) + 0.5) * (ends[1] - ends[0]) / rows
    return _map(x, y, z, image)


def _map(x: Array, y: Array, z: Array, source: Any) -> dict[str, Any]:
    across, down = (max(1, -(-n // CELLS)) for n in (len(x), len(y)))
    colours = source.get_cmap()(np.linspace(0, 1, 11))
    low, high = source.get_clim()
    z = z[::down, ::across]
    return {
        "type": "heatmap", "x": _listed(x[::across]), "y": _listed(y[::down]),
        "z": [_listed(row) for row in z], "zmin": float(low), "zmax": float(high),
        "colorscale": [[k / 10, to_hex(c)] for k, c in enumerate(colours)],
        "colorbar": {"thickness": 12},
    }  # fmt: skip


def _of_patches(axes: Axes) -> Iterator[dict[str, Any]]:
    """Bars, one trace a colour, and outlines of what else is drawn in data coordinates."""
    bars: dict[str, list[tuple[float, float, float, float]]] = {}
    names: dict[str, Any] = {}
    for container in axes.containers:
        for patch in container.patches if hasattr(container, "patches") else ():
            names[_colour(patch.get_facecolor())] = _named(container)
    in_bars = {id(p) for c in axes.containers for p in getattr(c, "patches", ())}
    for patch in axes.patches:
        if not patch.get_visible() or isinstance(patch, FancyArrowPatch):
            continue
        if isinstance(patch, Rectangle) and id(patch) in in_bars:
            box = (*patch.get_xy(), patch.get_width(), patch.get_height())
            bars.setdefault(_colour(patch.get_facecolor()), []).append(box)
        elif patch.get_transform() == patch.get_patch_transform() + axes.transData:
            yield from _outline(axes, patch)
    for colour, boxes in bars.items():
        yield _bars(axes, np.array(boxes, dtype=float), colour) | names.get(colour, {})


def _bars(axes: Axes, box: Array, colour: str) -> dict[str, Any]:
    x, y, width, height = box.T
    flat = len(x) > 1 and np.ptp(height) == 0 and np.ptp(x) == 0
    common: dict[str, Any] = {"type": "bar", "marker": {"color": colour}, "showlegend": False}
    if flat or (len(x) == 1 and abs(width[0]) > 0 and x[0] == 0 and height[0] < 1):
        return common | {"orientation": "h", "base": _listed(x), "x": _listed(width),
                         "y": _listed(y + height / 2), "width": _listed(height)}  # fmt: skip
    return common | {"base": _listed(y), "y": _listed(height), "x": _listed(x + width / 2),
                     "width": _listed(width)}  # fmt: skip


def _outline(axes: Axes, patch: Patch) -> Iterator[dict[str, Any]]:
    pixels = patch.get_transform().transform_path(patch.get_path())  # where curves become chords
    back = axes.transData.inverted()
    pieces = [back.transform(piece) for piece in pixels.to_polygons(closed_only=False)]
    if not pieces:
        return
    gap = np.full((1, 2), np.nan)
    points = np.vstack([part for piece in pieces for part in (np.asarray(piece), gap)])[:-1]
    edge = to_rgba(patch.get_edgecolor())
    trace: dict[str, Any] = {
        "type": "scatter",
        "mode": "lines",
        "x": _listed(points[:, 0]),
        "y": _listed(points[:, 1]),
        "hoverinfo": "skip",
        "line": {"color": _colour(edge), "width": float(patch.get_linewidth())},
    }
    if patch.get_fill() and to_rgba(patch.get_facecolor())[3] > 0:
        trace |= {"fill": "toself", "fillcolor": _colour(patch.get_facecolor())}
    yield trace | _named(patch)


def _marks(axes: Axes, scale: str) -> Iterator[dict[str, Any]]:
    """Lines across the whole panel, as axvline and axhline draw them."""
    for line in axes.lines:
        style = {"type": "line", "layer": "below",
                 "line": {"color": _colour(line.get_color()), "width": float(line.get_linewidth()),
                          "dash": DASHES.get(str(line.get_linestyle()), "solid")}}  # fmt: skip
        x, y = (_listed(_numbers(v)) for v in (line.get_xdata(), line.get_ydata()))
        if not x or line.get_transform() == axes.transData:
            continue
        if line.get_transform() == axes.get_xaxis_transform():
            yield style | {"xref": "x", "yref": f"{scale} domain", "x0": x[0], "x1": x[-1],
                           "y0": y[0], "y1": y[-1]}  # fmt: skip
        elif line.get_transform() == axes.get_yaxis_transform():
            yield style | {"xref": "x domain", "yref": scale, "x0": x[0], "x1": x[-1],
                           "y0": y[0], "y1": y[-1]}  # fmt: skip


def _texts(axes: Axes) -> Iterator[dict[str, Any]]:
    for text in axes.texts[:TEXTS]:
        own = isinstance(text, Annotation) and text.xycoords == "data"
        if not (own or text.get_transform() == axes.transData) or not text.get_text().strip():
            continue
        x, y = text.xy if isinstance(text, Annotation) else text.get_position()
        log = [s == "log" for s in (axes.get_xscale(), axes.get_yscale())]
        if any(on and not v > 0 for on, v in zip(log, (x, y), strict=True)):
            continue
        place = [float(np.log10(v)) if on else float(v) for on, v in zip(log, (x, y), strict=True)]
        yield {
            "x": place[0],
            "y": place[1],
            "text": plain_math(text.get_text()),
            "showarrow": False,
            "yshift": 8 if own else 0,
            "font": {"size": 10, "color": _colour(text.get_color())},
        }


def _axis(axes: Axes, which: str) -> dict[str, Any]:
    own = axes.xaxis if which == "x" else axes.yaxis
    low, high = (float(v) for v in (axes.get_xlim() if which == "x" else axes.get_ylim()))
    found: dict[str, Any] = {"title": {"text": plain_math(_label(axes, which))}}
    log = own.get_scale() == "log"
    if log:
        found["type"] = "log"
    ends = [low, high]
    found["range"] = [float(np.log10(v)) for v in ends] if log and min(ends) > 0 else ends
    formatter = own.get_major_formatter()
    if (
        isinstance(formatter, FixedFormatter | FuncFormatter)
        or "Categor" in type(formatter).__name__
    ):
        at = own.get_majorticklocs()
        texts = formatter.format_ticks(at.tolist())
        ticks = [(float(t), plain_math(x)) for t, x in zip(at, texts, strict=False) if x]
        if ticks:
            found |= {"tickvals": [t for t, _ in ticks], "ticktext": [s for _, s in ticks]}
    if not own.get_visible() or not axes.axison:
        found |= {"visible": False}
    return found


def _label(axes: Axes, which: str) -> str:
    """Label of an axis; of shared axes that of the one which carries it."""
    shared = axes.get_shared_x_axes() if which == "x" else axes.get_shared_y_axes()
    alike = [axes, *shared.get_siblings(axes)]
    labels = [(a.xaxis if which == "x" else a.yaxis).get_label_text() for a in alike]
    return next((text for text in labels if text), "")


def _legend_entries(legend: Any, traces: list[dict[str, Any]]) -> Iterator[dict[str, Any]]:
    """Entries of a legend that no trace carries."""
    known = {t.get("name") for t in traces}
    for handle, text in zip(legend.legend_handles, legend.get_texts(), strict=True):
        name = plain_math(text.get_text())
        if name in known:
            continue
        own = "get_color" if hasattr(handle, "get_color") else "get_facecolor"
        colour = getattr(handle, own)()
        if isinstance(colour, np.ndarray) and colour.ndim == 2:
            colour = colour[0] if len(colour) else "#666"
        dash = DASHES.get(str(getattr(handle, "get_linestyle", lambda: "-")()), "solid")
        yield {"type": "scatter", "mode": "lines", "x": [None], "y": [None], "name": name,
               "showlegend": True, "line": {"color": _colour(colour), "dash": dash}}  # fmt: skip


def _named(artist: Any) -> dict[str, Any]:
    label = str(artist.get_label() or "")
    shown = bool(label) and not label.startswith("_")
    return {"name": plain_math(label), "showlegend": True} if shown else {"showlegend": False}


def _filled(values: Any) -> Array:
    """Numbers, NaN where they are masked."""
    return np.asarray(np.ma.filled(np.ma.asarray(values, dtype=float), np.nan), dtype=float)


def _numbers(values: Any) -> Array:
    return _filled(values).ravel()


def _listed(values: Array) -> list[float | None]:
    """Numbers to five digits; None where there is none, which plotly leaves out."""
    return [float(f"{v:.{DIGITS}g}") if np.isfinite(v) else None for v in np.asarray(values, float)]


def _is_colour(value: Any) -> bool:
    return not (isinstance(value, str) and value in ("none", "auto"))


def _colour(value: Any) -> str:
    r, g, b, a = to_rgba(value)
    if a >= 0.999:
        return to_hex((r, g, b))
    return f"rgba({round(255 * r)},{round(255 * g)},{round(255 * b)},{a:.3g})"
