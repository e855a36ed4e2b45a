"""Conversion of matplotlib artists to plotly traces: lines, markers, bars, maps, outlines.

Lines with more points than a screen are reduced to their envelope.
"""

import re
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PathCollection, PolyCollection, QuadMesh
from matplotlib.colors import to_hex, to_rgba
from matplotlib.lines import Line2D
from matplotlib.patches import FancyArrowPatch, Patch, Rectangle
from numpy.typing import NDArray

Array = NDArray[Any]
POINTS = 12_000  # of all lines of a panel
LEAST_POINTS = 400  # of one line
CELLS = 200  # of a map along each side
DASHES = {"-": "solid", "--": "dash", ":": "dot", "-.": "dashdot"}
MARKERS = {"o": "circle", ".": "circle", ">": "triangle-right", "<": "triangle-left",
           "d": "diamond-tall"}  # fmt: skip


def traces_of(axes: Axes) -> Iterator[dict[str, Any]]:
    """Traces of the visible artists of axes, lines from the lowest to the uppermost."""
    lines = [x for x in axes.lines if x.get_visible() and x.get_transform() == axes.transData]
    lines.sort(key=Line2D.get_zorder)
    limit = max(LEAST_POINTS, POINTS // max(1, len(lines)))
    for collection in axes.collections:
        if collection.get_visible():
            yield from _of_collection(collection)
    yield from _of_patches(axes)
    for line in lines:
        yield _of_line(line, limit)


def _of_line(line: Line2D, limit: int) -> dict[str, Any]:
    """Trace of a line with at most about ``limit`` points."""
    x, y = envelope(numbers(line.get_xdata(orig=False)), numbers(line.get_ydata(orig=False)), limit)
    if not x.size:
        return {}
    return {"type": "scatter", "x": listed(x), "y": listed(y)} | named(line) | look_of(line)


def look_of(line: Line2D) -> dict[str, Any]:
    """Mode, line and marker of a line's trace."""
    colour = colour_of(line.get_color())
    marker, style = str(line.get_marker()), str(line.get_linestyle())
    drawn = style in DASHES
    marked = marker in MARKERS
    trace: dict[str, Any] = {"mode": "+".join(["lines"] * drawn + ["markers"] * marked) or "lines"}
    if drawn:
        trace["line"] = {"color": colour, "width": 1.25 * float(line.get_linewidth()),
                         "dash": DASHES[style]}  # fmt: skip
        if str(line.get_drawstyle()).startswith("steps"):
            trace["line"]["shape"] = "hv"
    if marked:
        face = line.get_markerfacecolor()
        trace["marker"] = {
            "color": colour
            if isinstance(face, str) and face in ("none", "auto")
            else colour_of(face),
            "symbol": MARKERS[marker],
            "size": float(line.get_markersize()) * 1.2,
            "line": {"color": colour_of(line.get_markeredgecolor()), "width": 1},
        }
    return trace


def envelope(x: Array, y: Array, limit: int) -> tuple[Array, Array]:
    """At most about ``limit`` points of a line: the least and largest in equal pieces, and a gap
    (NaN) in each that has one."""
    if x.size <= limit:
        return x, y
    pieces = max(1, limit // 2)
    step = -(-x.size // pieces)
    rows = -(-x.size // step)
    padded = np.full(rows * step, np.nan)
    padded[: x.size] = np.where(np.isfinite(y), y, np.nan)
    piece = padded.reshape(rows, step)
    least = np.where(np.isnan(piece), np.inf, piece).argmin(axis=1)  # 0 if all are NaN
    largest = np.where(np.isnan(piece), -np.inf, piece).argmax(axis=1)
    gap = np.where(np.isnan(piece).any(axis=1), np.isnan(piece).argmax(axis=1), least)
    at = np.unique(np.arange(rows) * step + [least, largest, gap])
    at = at[at < x.size]  # the last piece is filled up with NaN
    return x[at], y[at]


def _of_collection(collection: Any) -> Iterator[dict[str, Any]]:
    if isinstance(collection, QuadMesh):
        yield _of_quads(collection)
    elif isinstance(collection, PathCollection):
        at = _filled(collection.get_offsets())
        if not len(at):
            return
        faces = collection.get_facecolor()
        colours = [colour_of(c) for c in (faces if len(faces) else collection.get_edgecolor())]
        marker = {"color": colours[0] if len(set(colours)) == 1 else colours, "size": 7}
        points = {"x": listed(at[:, 0]), "y": listed(at[:, 1])}
        yield {"type": "scatter", "mode": "markers", **points, "marker": marker} | named(collection)
    elif isinstance(collection, LineCollection | PolyCollection) and collection.get_paths():
        filled = isinstance(collection, PolyCollection)
        trace = _polylines([path.vertices for path in collection.get_paths()])
        rgba = collection.get_facecolor() if filled else collection.get_edgecolor()
        colour = colour_of(rgba[0]) if len(rgba) else "#6B7280"
        if filled:
            trace |= {"fill": "toself", "fillcolor": colour, "hoverinfo": "skip"}
        trace["line"] = {"width": 0} if filled else {"color": colour, "width": 1}
        yield trace | named(collection)


def _polylines(pieces: Sequence[Any]) -> dict[str, Any]:
    """Trace of several polylines (n, 2), with gaps between them."""
    gap = np.full((1, 2), np.nan)
    points = np.vstack([part for piece in pieces for part in (np.asarray(piece, float), gap)])
    x, y = listed(points[:-1, 0]), listed(points[:-1, 1])
    return {"type": "scatter", "mode": "lines", "x": x, "y": y}


def _of_quads(quads: QuadMesh) -> dict[str, Any]:
    """Heat map of rectangular cells, thinned to at most ``CELLS`` each way."""
    corners: Any = quads.get_coordinates()
    x, y = corners[0, :, 0], corners[:, 0, 1]
    z = _filled(quads.get_array()).reshape(len(y) - 1, len(x) - 1)
    x, y = (0.5 * (edges[1:] + edges[:-1]) for edges in (x, y))
    across, down = (max(1, -(-n // CELLS)) for n in (len(x), len(y)))
    colours = quads.get_cmap()(np.linspace(0, 1, 11))
    low, high = quads.get_clim()
    bar: Any = quads.colorbar
    bar_label = plain_math(bar.ax.get_ylabel()) if bar is not None else ""
    z = z[::down, ::across]
    return {
        "type": "heatmap", "x": listed(x[::across]), "y": listed(y[::down]),
        "z": [listed(row) for row in z], "zmin": float(low), "zmax": float(high),
        "colorscale": [[k / 10, to_hex(c)] for k, c in enumerate(colours)],
        "colorbar": {"thickness": 12, "title": {"text": bar_label, "side": "right"}},
    }  # fmt: skip


def _of_patches(axes: Axes) -> Iterator[dict[str, Any]]:
    """Traces of bars, one for each colour, and outlines of other patches in data coordinates."""
    bars: dict[str, list[tuple[float, float, float, float]]] = {}
    names: dict[str, Any] = {}
    for container in axes.containers:
        for patch in container.patches if hasattr(container, "patches") else ():
            names[colour_of(patch.get_facecolor())] = named(container)
    in_bars = {id(p) for c in axes.containers for p in getattr(c, "patches", ())}
    for patch in axes.patches:
        if not patch.get_visible() or isinstance(patch, FancyArrowPatch):
            continue
        if isinstance(patch, Rectangle) and id(patch) in in_bars:
            box = (*patch.get_xy(), patch.get_width(), patch.get_height())
            bars.setdefault(colour_of(patch.get_facecolor()), []).append(box)
        elif patch.get_transform() == patch.get_patch_transform() + axes.transData:
            yield from _outline(axes, patch)
    for colour, boxes in bars.items():
        yield _bars(axes, np.array(boxes, dtype=float), colour) | names.get(colour, {})


def _bars(axes: Axes, box: Array, colour: str) -> dict[str, Any]:
    x, y, width, height = box.T
    flat = len(x) > 1 and np.ptp(height) == 0 and np.ptp(x) == 0
    common: dict[str, Any] = {"type": "bar", "marker": {"color": colour}, "showlegend": False}
    if flat or (len(x) == 1 and abs(width[0]) > 0 and x[0] == 0 and height[0] < 1):
        return common | {"orientation": "h", "base": listed(x), "x": listed(width),
                         "y": listed(y + height / 2), "width": listed(height)}  # fmt: skip
    return common | {"base": listed(y), "y": listed(height), "x": listed(x + width / 2),
                     "width": listed(width)}  # fmt: skip


def _outline(axes: Axes, patch: Patch) -> Iterator[dict[str, Any]]:
    pixels = patch.get_transform().transform_path(patch.get_path())  # for polygons of curves
    inverse = axes.transData.inverted()
    pieces = [inverse.transform(piece) for piece in pixels.to_polygons(closed_only=False)]
    if not pieces:
        return
    line = {"color": colour_of(patch.get_edgecolor()), "width": float(patch.get_linewidth())}
    trace = {**_polylines(pieces), "hoverinfo": "skip", "line": line}
    if patch.get_fill() and to_rgba(patch.get_facecolor())[3] > 0:
        trace |= {"fill": "toself", "fillcolor": colour_of(patch.get_facecolor())}
    yield trace | named(patch)


def named(artist: Any) -> dict[str, Any]:
    """Name of a trace, and whether the legend shows it."""
    label = str(artist.get_label() or "")
    in_legend = bool(label) and not label.startswith("_")
    return {"name": plain_math(label), "showlegend": True} if in_legend else {"showlegend": False}


def _filled(values: Any) -> Array:
    """Floats of an array, NaN for masked elements."""
    return np.asarray(np.ma.filled(np.ma.asarray(values, dtype=float), np.nan), dtype=float)


def numbers(values: Any) -> Array:
    return _filled(values).ravel()


def listed(values: Array) -> list[float | None]:
    """Numbers with five digits, None for NaN and infinity, which plotly omits."""
    exact = np.asarray(values, float)
    finite = np.isfinite(exact)
    sizes = np.abs(np.where(finite & (exact != 0), exact, 1.0))
    power = np.clip(4 - np.floor(np.log10(sizes)), -300, 300)  # of ten, that leaves five digits
    # whole numbers by powers of ten that are exact, so that the shortest decimals are printed
    up, down = 10.0 ** np.maximum(power, 0), 10.0 ** np.maximum(-power, 0)
    short = (np.rint(exact * up / down) * down / up).astype(object)
    short[~finite] = None
    return short.tolist()


def colour_of(value: Any) -> str:
    r, g, b, a = to_rgba(value)
    if a >= 0.999:
        return to_hex((r, g, b))
    return f"rgba({round(255 * r)},{round(255 * g)},{round(255 * b)},{a:.3g})"


def plain_math(text: str) -> str:
    """Mathtext with subscripts and superscripts as the HTML that plotly knows: "$θ_c$" ->
    "θ<sub>c</sub>"; other text escaped."""
    escaped = text.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")
    return re.sub(r"\$([^$]*)\$", lambda m: _math(m[1]), escaped).replace("\n", "<br>")


def _math(text: str) -> str:
    for sign, tag in (("_", "sub"), ("\\^", "sup")):
        text = re.sub(rf"{sign}\{{([^}}]*)\}}", rf"<{tag}>\1</{tag}>", text)
        text = re.sub(rf"{sign}(\w)", rf"<{tag}>\1</{tag}>", text)
    return text
