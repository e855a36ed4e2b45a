"""Conversion of matplotlib figures to plotly panels, which zoom and have hover labels.

Each axes becomes one panel {"data": [...], "layout": {...}} of plotly, so that every chart needs
only one drawing function.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.text import Annotation, Text
from matplotlib.ticker import FixedFormatter, FuncFormatter

from flexgear.views.traces import DASHES, colour_of, listed, look_of, numbers, plain_math, traces_of

Panel = dict[str, Any]
TEXTS = 200  # of a panel
PIXELS, LEAST_HEIGHT, MARGINS = 92, 300, 120  # of an inch; of axes; of both margins, px


def panels_of(figure: Figure) -> list[Panel]:
    """Panels of a drawn figure, in the order of its axes."""
    drawn_axes = (a for a in figure.axes if a.get_label() != "<colorbar>" and a.get_visible())
    panels = [_panel(axes) for axes in drawn_axes]
    drawn = [trace for panel in panels for trace in panel["data"]]
    for legend in figure.legends:
        for panel in panels:
            panel["data"] += _legend_entries(legend, drawn)
    for panel in panels:
        _name_once(panel["data"])
        _scale_once(panel["data"])
        with_hover(panel["data"], panel["layout"])
    return [panel for panel in panels if any(t.get("x") != [None] for t in panel["data"])]


def _name_once(traces: list[dict[str, Any]]) -> None:
    """Group traces of one name under one legend entry, which hides them together."""
    in_legend: set[str] = set()
    for trace in traces:
        name = trace.get("name")
        if name and trace.get("showlegend"):
            trace |= {"legendgroup": name, "showlegend": name not in in_legend}
            in_legend.add(name)


def _scale_once(traces: list[dict[str, Any]]) -> None:
    """Show one colour bar for all maps with the same limits, with the first label among them."""
    first: dict[tuple[float, float], dict[str, Any]] = {}
    for trace in (t for t in traces if t["type"] == "heatmap"):
        first_trace = first.setdefault((trace["zmin"], trace["zmax"]), trace)
        trace["showscale"] = trace is first_trace
        first_trace["colorbar"]["title"]["text"] = (
            first_trace["colorbar"]["title"]["text"] or (trace["colorbar"]["title"]["text"])
        )


def _panel(axes: Axes) -> Panel:
    """A panel of one axes."""
    data = [t for t in traces_of(axes) if t]
    if axes.get_legend() is not None:
        data += list(_legend_entries(axes.get_legend(), data))
    layout: dict[str, Any] = {
        "shapes": list(_marks(axes)),
        "annotations": list(_texts(axes)),
        "xaxis": _axis(axes, "x"),
        "yaxis": _axis(axes, "y"),
    }
    inches = axes.get_window_extent().height / axes.figure.dpi
    if PIXELS * inches > LEAST_HEIGHT:
        layout["height"] = round(PIXELS * inches) + MARGINS
    if axes.get_aspect() in (1.0, "equal"):
        layout["yaxis"] |= {"scaleanchor": "x", "scaleratio": 1}
    title = axes.get_title(loc="left") or axes.get_title()
    if title:
        layout["title"] = {"text": plain_math(title)}
    return {"data": data, "layout": layout}


def _marks(axes: Axes) -> Iterator[dict[str, Any]]:
    """Shapes for bands and lines across the whole panel, drawn by axvspan, axvline and axhline."""
    across = axes.get_xaxis_transform()
    for patch in axes.patches:
        if patch.get_transform() == patch.get_patch_transform() + across:
            box = patch.get_patch_transform().transform_path(patch.get_path()).get_extents()
            yield {
                "type": "rect",
                "layer": "below",
                "line": {"width": 0},
                "fillcolor": colour_of(patch.get_facecolor()),
                "xref": "x",
                "yref": "y domain",
                "x0": float(box.x0),
                "x1": float(box.x1),
                "y0": 0.0,
                "y1": 1.0,
            }
    for line in axes.lines:
        dash = DASHES.get(str(line.get_linestyle()), "solid")
        width = float(line.get_linewidth())
        look = {"color": colour_of(line.get_color()), "width": width, "dash": dash}
        x, y = (listed(numbers(v)) for v in (line.get_xdata(), line.get_ydata()))
        if not x or line.get_transform() == axes.transData:
            continue
        ends = {"x0": x[0], "x1": x[-1], "y0": y[0], "y1": y[-1]}
        if line.get_transform() == across:
            scales = {"xref": "x", "yref": "y domain"}
        elif line.get_transform() == axes.get_yaxis_transform():
            scales = {"xref": "x domain", "yref": "y"}
        else:
            continue
        layer = "above" if axes.containers else "below"  # bars would hide it
        yield {"type": "line", "layer": layer, "line": look, **scales, **ends}


def _texts(axes: Axes) -> Iterator[dict[str, Any]]:
    """Annotations for the texts in data coordinates, or at shares of the panel."""
    for text in axes.texts[:TEXTS]:
        in_data = isinstance(text, Annotation) and text.xycoords == "data"
        if isinstance(text, Annotation) and in_data and text.arrow_patch is not None:
            yield _arrow(text, text.arrow_patch)
        in_panel = text.get_transform() == axes.transAxes
        placed = in_data or in_panel or text.get_transform() == axes.transData
        if not placed or not text.get_text().strip():
            continue
        x, y = text.xy if isinstance(text, Annotation) else text.get_position()
        log = [s == "log" and not in_panel for s in (axes.get_xscale(), axes.get_yscale())]
        if any(on and not v > 0 for on, v in zip(log, (x, y), strict=True)):
            continue
        at = [float(np.log10(v)) if on else float(v) for on, v in zip(log, (x, y), strict=True)]
        yield {
            "x": at[0],
            "y": at[1],
            "text": plain_math(text.get_text()),
            "showarrow": False,
            **({"xref": "x domain", "yref": "y domain"} if in_panel else {}),
            **_anchor(text, in_data),
            "font": {"size": 10, "color": colour_of(text.get_color())},
        }


def _arrow(text: Annotation, arrow: Patch) -> dict[str, Any]:
    """Annotation for an arrow in data coordinates on linear axes."""
    (x, y), (ax, ay) = ([float(v) for v in end] for end in (text.xy, text.xyann))
    ends = {"x": x, "y": y, "ax": ax, "ay": ay, "axref": "x", "ayref": "y"}
    colour = colour_of(arrow.get_edgecolor())
    return {**ends, "text": "", "showarrow": True, "arrowhead": 2, "arrowwidth": 1.2,
            "arrowcolor": colour}  # fmt: skip


def _anchor(text: Text, in_data: bool) -> dict[str, Any]:
    """Alignment of a text to its point; annotations are above the point, or beside the end of a
    bar."""
    if in_data:
        is_label = isinstance(text, Annotation) and text.anncoords == "offset points" and text.xyann
        if is_label and is_label[0]:
            side = "left" if is_label[0] > 0 else "right"
            upward = "bottom" if is_label[1] > 0 else "middle"
            return {"xanchor": side, "yanchor": upward, "xshift": is_label[0], "borderpad": 0}
        return {"yshift": 8}
    across = {"left": "left", "right": "right"}.get(str(text.get_horizontalalignment()), "center")
    upward = {"top": "top", "bottom": "bottom", "baseline": "bottom"}.get(
        str(text.get_verticalalignment()), "middle"
    )
    return {"xanchor": across, "yanchor": upward, "borderpad": 0}


def _axis(axes: Axes, which: str) -> dict[str, Any]:
    """Layout of the axis "x" or "y": title, scale, range, ticks."""
    drawn = axes.xaxis if which == "x" else axes.yaxis
    low, high = (float(v) for v in (axes.get_xlim() if which == "x" else axes.get_ylim()))
    axis: dict[str, Any] = {"title": {"text": plain_math(_label(axes, which))}}
    log = drawn.get_scale() == "log"
    if log:
        axis |= {"type": "log", "exponentformat": "power"}  # not the prefix of "100µ"
    ends = [low, high]
    axis["range"] = [float(np.log10(v)) for v in ends] if log and min(ends) > 0 else ends
    formatter = drawn.get_major_formatter()
    if isinstance(formatter, FixedFormatter | FuncFormatter):
        at = drawn.get_majorticklocs()
        texts = formatter.format_ticks(list(at))
        ticks = [(float(t), plain_math(x)) for t, x in zip(at, texts, strict=False) if x]
        if ticks:
            axis |= {"tickvals": [t for t, _ in ticks], "ticktext": [s for _, s in ticks]}
    if not drawn.get_visible() or not axes.axison:
        axis |= {"visible": False}
    return axis


def _label(axes: Axes, which: str) -> str:
    """Label of an axis; for shared axes the first label among them."""
    shared = axes.get_shared_x_axes() if which == "x" else axes.get_shared_y_axes()
    alike = [axes, *shared.get_siblings(axes)]
    labels = [(a.xaxis if which == "x" else a.yaxis).get_label_text() for a in alike]
    return next((text for text in labels if text), "")


def _legend_entries(legend: Any, traces: list[dict[str, Any]]) -> Iterator[dict[str, Any]]:
    """Empty traces for entries of a legend without a trace of that name."""
    names = {t.get("name") for t in traces}
    for handle, text in zip(legend.legend_handles, legend.get_texts(), strict=True):
        name = plain_math(text.get_text())
        if name in names:
            continue
        if isinstance(handle, Line2D):
            look = look_of(handle)
        else:
            getter = "get_color" if hasattr(handle, "get_color") else "get_facecolor"
            colour = getattr(handle, getter)()
            if isinstance(colour, np.ndarray) and colour.ndim == 2:
                colour = colour[0] if len(colour) else "#666"
            look = {"mode": "lines", "line": {"color": colour_of(colour), "dash": "solid"}}
        yield {"type": "scatter", "x": [None], "y": [None], "name": name, "showlegend": True} | look


Trace = dict[str, Any]
_VALUE = ":.5~g"


def with_hover(data: list[Trace], layout: dict[str, Any]) -> None:
    """Add hover labels to traces: their name, and both coordinates with labels and units."""
    for trace in data:
        if trace.get("hoverinfo") == "skip" or trace["type"] not in _KINDS:
            continue
        title = f"<b>{trace['name']}</b><br>" if trace.get("name") else ""
        axes = layout.get("xaxis", {}), layout.get("yaxis", {})
        panel = layout.get("title", {}).get("text", "")
        lines = [_line(trace, which, axis, panel) for which, axis in zip("xy", axes, strict=True)]
        if trace["type"] == "heatmap":
            lines.append((trace["colorbar"]["title"]["text"] or "value") + f": %{{z{_VALUE}}}")
        trace["hovertemplate"] = f"{title}{'<br>'.join(filter(None, lines))}<extra></extra>"


_KINDS = ("scatter", "bar", "heatmap")


def _line(trace: Trace, which: str, axis: dict[str, Any], panel: str) -> str:
    """Hover text of one axis: "time (s): 3.2467".

    An axis with words as ticks gives the word alone, a hidden axis nothing; a y axis without label
    has the title of the panel.
    """
    if axis.get("visible") is False:
        return ""
    label = axis.get("title", {}).get("text") or (panel if which == "y" else "") or which
    if "ticktext" not in axis or trace["type"] == "heatmap":
        return f"{label}: %{{{which}{_VALUE}}}"
    reach = 1e-6 if trace.get("mode", "").startswith("lines") else 0.5  # of a step of the ticks
    texts = _words(trace.get(which, []), axis["tickvals"], axis["ticktext"], reach)
    columns = trace.setdefault("customdata", [[] for _ in texts])
    column = len(columns[0]) if columns else 0
    for row, text in zip(columns, texts, strict=True):
        row.append(text)
    prefix = "" if label == which else f"{label}: "
    return f"{prefix}%{{customdata[{column}]}}"


def _words(
    values: list[float | None], at: list[float], texts: list[str], reach: float
) -> list[str]:
    """Text of the nearest tick of each value, or the value if no tick is within ``reach`` steps."""
    ticks = np.asarray(at, dtype=float)
    step = float(np.diff(np.sort(ticks)).min()) if len(ticks) > 1 else 1.0
    words = []
    for value in values:
        if value is None:
            words.append("")
            continue
        k = int(np.abs(ticks - value).argmin())
        near = abs(ticks[k] - value) <= reach * step
        words.append(texts[k] if near else f"{value:.5g}")
    return words
