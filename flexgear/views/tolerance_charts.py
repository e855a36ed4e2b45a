"""A tolerance study in pictures: histogram and distribution of what every group got."""

from __future__ import annotations

import math

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, MaxNLocator

from flexgear.arrays import Array
from flexgear.model.errors import FlexgearError
from flexgear.model.names import GroupName
from flexgear.results.tolerance_dataset import distribution_band
from flexgear.views.select import variable
from flexgear.views.style import NEUTRAL, PLANET_COLOURS, legend_of, panels, styled

BARS = "#9DBAD5"
MEAN, STATED, STANDARD = PLANET_COLOURS[2], PLANET_COLOURS[1], PLANET_COLOURS[4]
LINE = PLANET_COLOURS[0]
MOST_BINS = 40
EQUAL = 1e-9  # relative: below, all samples are one number
STYLES = ("-", "--", "-.", ":")  # of the quantiles
DRAWN = {  # by the name of the statistics: the variable, what it says, digits, factor
    "load_sharing": ("load_sharing_max", "largest $K_\\gamma$ over one turn", 4, 1.0),
    "k_h_beta": ("k_h_beta", "face load factor $K_{H\\beta}$ over one turn", 3, 1.0),
    "largest_line_load": ("largest_line_load", "largest line load (N/mm)", 0, 1e-3),
}
STATISTICS = [f"{one}{end}" for one in ("average", "quantile") for end in ("", "_low", "_high")]
STATISTICS.append("as_stated")


@styled
def tolerance_chart(data: xr.Dataset, name: str = "load_sharing") -> Figure:
    """One row a group: histogram of the samples, and their distribution with its interval.

    name: of ``DRAWN``.

    Mean, quantiles and their intervals, the value of the case's own errors and what IEC 61400-4
    has designers assume are marked. Groups with the same values are drawn once, those with one
    value in all samples are named where there are others.
    """
    of, label, digits, factor = DRAWN[name]
    variable(data, of)
    plain = {of: "values"} | {f"{name}_{statistic}": f"its_{statistic}" for statistic in STATISTICS}
    chosen = factor * data[list(plain)].rename(plain)
    if name == "load_sharing":
        chosen = chosen.assign(mesh_load_factor=data["mesh_load_factor"])
    chosen.attrs = {**data.attrs, "digits": digits}
    groups = _groups(chosen)
    equal = {title: x for title, (x, _) in groups.items() if _constant(x)}
    drawn = {title: group for title, group in groups.items() if title not in equal} or groups
    figure, axes = panels(len(drawn), 2, height_mm=22 + 58 * len(drawn))
    for row, (title, (values, of_group)) in zip(axes, drawn.items(), strict=True):
        row[0].set_title(title)
        _histogram(row[0], values, of_group)
        _distribution(row[1], values, of_group)
        for ax in row:
            ax.set_xlabel(label)
            _span(ax, values)
    legend_of(figure, axes, 3)
    lines = [f"{data.attrs['case']}: {data.sizes['sample']} samples of its manufacturing errors"]
    if drawn is not groups:
        lines += [f"{title}: {x[0]:.6f} in all of them" for title, x in equal.items()]
    figure.suptitle("\n".join(lines), fontsize=9)
    return figure


def _groups(data: xr.Dataset) -> dict[str, tuple[Array, xr.Dataset]]:
    """Rising samples and figures of groups by title; those with the same samples as one."""
    groups: list[tuple[list[str], Array, xr.Dataset]] = []
    for group in data["group"].to_numpy():
        of_group = data.sel(group=group)
        values = of_group["values"].to_numpy()
        values = values[np.isfinite(values)]
        if not len(values):
            continue
        for names, drawn, _ in groups:
            if len(drawn) == len(values) and np.allclose(values, drawn, rtol=1e-6, atol=0):
                names.append(str(group))
                break
        else:
            groups.append(([str(group)], values, of_group))
    if not groups:
        raise FlexgearError("nothing to draw: no sample has an equilibrium everywhere")
    return {_title(names): (np.sort(x), of_group) for names, x, of_group in groups}


def _title(names: list[str]) -> str:
    """ "stage 1 ring, sun": the common beginning once."""
    stages: dict[str, list[str]] = {}
    for group in map(GroupName.parse, names):
        start = f"{group.stage} {group.kind}" if group.side else group.stage
        stages.setdefault(start.replace("_", " "), []).append(group.side or group.kind)
    return ", ".join(f"{stage} {' and '.join(kinds)}".strip() for stage, kinds in stages.items())


def _histogram(ax: Axes, values: Array, of_group: xr.Dataset) -> None:
    if _constant(values):
        text = f"{values[0]:.6f} in all {len(values)} samples"
        ax.text(0.5, 0.5, text, ha="center", va="center", transform=ax.transAxes, color=NEUTRAL)
        ax.set_yticks([])
        return
    width = 2 * np.subtract(*np.quantile(values, [0.75, 0.25])) / len(values) ** (1 / 3)
    bins = np.ptp(values) / width if width > 0 else MOST_BINS
    ax.hist(values, bins=int(np.clip(np.ceil(bins), 5, MOST_BINS)), color=BARS)
    ax.set_ylabel("samples")
    mean, low, high = (float(of_group[f"its_average{e}"]) for e in ("", "_low", "_high"))
    ax.axvspan(low, high, color=MEAN, alpha=0.25, lw=0)
    ax.axvline(mean, color=MEAN, lw=1.2, label=f"mean, {_percent(of_group)} interval")
    _marks(ax, of_group)


def _distribution(ax: Axes, values: Array, of_group: xr.Dataset) -> None:
    low, high = distribution_band(len(values), float(of_group.attrs["confidence"]))
    ax.fill_between(values, low, high, step="post", color=LINE, alpha=0.2, lw=0,
                    label=f"distribution, {_percent(of_group)} band")  # fmt: skip
    share = np.arange(1, len(values) + 1) / len(values)
    ax.step(values, share, where="post", color=LINE, lw=1.2)
    notes = []
    for style, p in zip(STYLES, of_group["quantile"].to_numpy(), strict=False):
        at = of_group.sel(quantile=p)
        q, start, end = (float(at[f"its_quantile{e}"]) for e in ("", "_low", "_high"))
        ax.plot([values[0], q, q], [p, p, 0], color="black", lw=0.7, ls=style)
        ends = [values[0] if math.isnan(start) else start, values[-1] if math.isnan(end) else end]
        ax.plot(ends, [p, p], color="black", lw=2.2, solid_capstyle="butt",
                label=f"quantiles, {_percent(of_group)} intervals")  # fmt: skip
        notes.append(f"{100 * p:g} %: {q:.{of_group.attrs['digits']}f}")
    box = {"facecolor": "white", "edgecolor": "none", "alpha": 0.85, "pad": 2.0}
    ax.text(0.98, 0.05, "\n".join(notes), ha="right", va="bottom", transform=ax.transAxes,
            fontsize=7.5, bbox=box)  # fmt: skip
    ax.set_ylim(0, 1.02)
    ax.set_ylabel("share of samples")
    ax.yaxis.set_major_formatter(FuncFormatter(lambda v, _: f"{100 * v:g} %"))
    _marks(ax, of_group)


def _marks(ax: Axes, of_group: xr.Dataset) -> None:
    """The case as it is stated, and the standard's assumption where it is in reach."""
    stated = float(of_group["its_as_stated"])
    if math.isfinite(stated):
        ax.axvline(stated, color=STATED, lw=1.2, ls="--", label="errors of the case as stated")
    if "mesh_load_factor" not in of_group:
        return
    (low, high), assumed = ax.get_xlim(), float(of_group["mesh_load_factor"])
    if abs(assumed - 0.5 * (low + high)) < high - low:
        ax.axvline(assumed, color=STANDARD, lw=1.2, ls=":", label="IEC 61400-4")


def _percent(of_group: xr.Dataset) -> str:
    return f"{100 * float(of_group.attrs['confidence']):g} %"


def _span(ax: Axes, values: Array) -> None:
    """Readable ticks, also where all samples are equal."""
    if _constant(values):
        middle = float(values[0])
        ax.set_xlim(middle - 0.01, middle + 0.01)
    ax.xaxis.set_major_locator(MaxNLocator(5))


def _constant(values: Array) -> bool:
    return bool(np.ptp(values) <= EQUAL * abs(values[-1]))
