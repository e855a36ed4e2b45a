"""What a panel says of a point under the pointer: name of its line, both values with their axes.

Labels of axes hold the units. A line without a name has that of the entry of the legend in its
colour and dash, where there is a single one.
"""

from __future__ import annotations

from typing import Any

import numpy as np

Trace = dict[str, Any]
_VALUE = ":.5~g"


def with_hover(data: list[Trace], layout: dict[str, Any]) -> None:
    """Add labels to all traces that show any."""
    names: dict[tuple[str, str], set[str]] = {}
    for trace in data:
        if trace.get("name"):
            names.setdefault(_look(trace), set()).add(trace["name"])
    for trace in data:
        if trace.get("hoverinfo") == "skip" or trace["type"] not in _KINDS:
            continue
        names_of_trace = {trace["name"]} if trace.get("name") else names.get(_look(trace), set())
        title = f"<b>{next(iter(names_of_trace))}</b><br>" if len(names_of_trace) == 1 else ""
        axes = (
            layout.get("xaxis", {}),
            layout.get(trace.get("yaxis", "y").replace("y", "yaxis"), {}),
        )
        panel = layout.get("title", {}).get("text", "")
        lines = [_line(trace, which, axis, panel) for which, axis in zip("xy", axes, strict=True)]
        if trace["type"] == "heatmap":
            lines.append((trace["colorbar"]["title"]["text"] or "value") + f": %{{z{_VALUE}}}")
        trace["hovertemplate"] = f"{title}{'<br>'.join(filter(None, lines))}<extra></extra>"


_KINDS = ("scatter", "bar", "heatmap")


def _look(trace: Trace) -> tuple[str, str]:
    """Colour and dash of a trace."""
    part = trace.get("line") or trace.get("marker") or {}
    return str(part.get("color")), str(part.get("dash", "solid"))


def _line(trace: Trace, which: str, axis: dict[str, Any], panel: str) -> str:
    """ "time (s): 3.2467"; of an axis of words the word, of one that is hidden nothing; a y axis
    without a label has the title of its panel."""
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
    """Of every value the text of the tick next to it, the value itself where none is near."""
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
