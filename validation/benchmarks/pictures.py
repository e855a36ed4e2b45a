"""The pictures of the page."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from benchmarks.record import Comparison, Curve, Report, plain
from flexgear.views.style import NEUTRAL, PLANET_COLOURS, panels, save_figure, styled


def draw(report: Report, folder: Path) -> list[Path]:
    """benchmarks-ratios.png, -size.png and -steps.png as far as there is anything to show."""
    figures = {"ratios": _ratios(report), "size": _sizes(report), "steps": _steps(report)}
    return [
        save_figure(figure, folder / f"benchmarks-{name}.png", dpi=150)
        for name, figure in figures.items()
        if figure is not None
    ]


@styled
def _ratios(report: Report) -> Figure | None:
    """Every comparison: median and spread of peer over flexgear."""
    comparisons = report.comparisons
    if not comparisons:
        return None
    figure, axes = panels(1, height_mm=22 + 8.5 * len(comparisons))
    a: Axes = axes[0, 0]
    groups = list(dict.fromkeys(c.group for c in comparisons))
    for y, c in enumerate(comparisons):
        colour = PLANET_COLOURS[groups.index(c.group) % len(PLANET_COLOURS)]
        low, high = min(c.ratios), max(c.ratios)
        a.barh(y, c.ratio - 1.0, left=1.0, height=0.62, color=colour, alpha=0.85)
        a.plot([low, high], [y, y], color="black", linewidth=1.0, marker="|", markersize=5)
        a.annotate(
            plain(c.ratio), (max(high, 1.0), y), (5, 0), textcoords="offset points", va="center",
            ha="left", fontsize=7.5,
        )  # fmt: skip
    a.set_yticks(range(len(comparisons)), [_name(c) for c in comparisons], fontsize=7)
    a.invert_yaxis()
    a.set_xscale("log")
    lowest, highest = (f(r for c in comparisons for r in c.ratios) for f in (min, max))
    a.set_xlim(0.5 * min(lowest, 1.0), 4 * highest)
    a.axvline(1.0, color=NEUTRAL, linewidth=1.0)
    a.grid(axis="y", visible=False)
    a.set_xlabel("time of the peer over flexgear's; bar: median, line: spread")
    for group in groups:  # its name over the first of its bars
        first = next(y for y, c in enumerate(comparisons) if c.group == group)
        a.annotate(
            group, (1.0, first - 0.5), (4, 0), textcoords="offset points", va="center",
            fontsize=6.3, fontweight="bold",
        )  # fmt: skip
    return figure


def _name(c: Comparison) -> str:
    peer, size = c.peer_name, c.size
    short = peer.split(", right-hand")[0].split(" as SciPy ships")[0]
    return f"{short}\n{size.split(', ', 1)[1] if ', ' in size else size}"


@styled
def _sizes(report: Report) -> Figure | None:
    """Assembly and reduction over the number of dofs."""
    names = [n for n in ("assembly", "cyclic") if any(c.picture == n for c in report.curves)]
    if not names:
        return None
    titles = {"assembly": "Assembly of stiffness and mass", "cyclic": "Reduction of the ring"}
    figure, axes = panels(1, len(names), height_mm=70)
    for a, name in zip(axes[0], names, strict=True):
        for k, curve in enumerate(c for c in report.curves if c.picture == name):
            _line(a, curve, k)
        a.set(xscale="log", yscale="log", title=titles[name])
        a.legend()
    return figure


@styled
def _steps(report: Report) -> Figure | None:
    """Cost of a step over kept modes and over planets."""
    curves = {c.picture: c for c in report.curves if c.picture in ("modes", "planets")}
    if len(curves) < 2:
        return None
    figure, axes = panels(1, 2, height_mm=70)
    left, right = axes[0]
    modes, planets = curves["modes"], curves["planets"]
    left.plot(modes.x, modes.y, "o", color=PLANET_COLOURS[0], label=modes.label)
    slope, base = np.polyfit(modes.x, modes.y, 1)
    x = np.array([0.0, max(modes.x)])
    left.plot(x, base + slope * x, color=NEUTRAL, label="straight line")
    left.set(title="Time step over kept modes", xlim=(0, None), ylim=(0, None))
    left.set(xlabel=modes.x_label, ylabel=modes.y_label)
    left.legend()
    _line(right, planets, 0)
    x = np.array(planets.x)
    for power, style in ((1, ":"), (2, "--")):
        y = planets.y[0] * (x / x[0]) ** power
        right.plot(x, y, style, color=NEUTRAL, label=f"$N^{power}$" if power > 1 else "$N$")
    right.set(title="Time step over planets", ylim=(0, None))
    right.legend()
    return figure


def _line(a: Axes, curve: Curve, colour: int) -> None:
    a.plot(curve.x, curve.y, "o-", color=PLANET_COLOURS[colour], label=curve.label)
    a.set(xlabel=curve.x_label, ylabel=curve.y_label)
