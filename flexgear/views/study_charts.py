"""Charts of ratings, with load duration, damage and reserves, and of tolerance studies, with
histogram and distribution of samples."""

import math
from collections.abc import Sequence

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullLocator

from flexgear.arrays import Array
from flexgear.gears.load_bins import LoadBin
from flexgear.model.errors import FlexgearError
from flexgear.model.names import GroupName
from flexgear.results.rating import Rating
from flexgear.results.report.study_tables import RATING, SPECTRUM
from flexgear.results.report.wording import rounded, scale, words
from flexgear.results.tolerance_dataset import SPREADS, distribution_band
from flexgear.solve.load_series import SeriesBins
from flexgear.views.select import variable
from flexgear.views.style import (
    DEFORMED_COLOUR,
    NEUTRAL,
    PLANET_COLOURS,
    labelled_bars,
    legend_of,
    panels,
    styled,
    text_only,
)


@styled
def load_duration_chart(
    bins: Sequence[LoadBin], member: str, samples: SeriesBins | None = None
) -> Figure:
    """Torque at a port over the turns of its member with at least this torque.

    Bins are steps, extreme loads triangles at the left edge, the samples of series a line.
    """
    lasting = [b for b in bins if not b.extreme]
    turns = np.array([b.turns(b.speed[member]) for b in lasting])
    torque = np.array([b.torque[member] for b in lasting])
    unit, by = scale([b.torque[member] for b in bins], "N m")
    figure, axes = panels(1, 1, height_mm=80)
    ax = axes[0, 0]
    total = float(turns.sum()) or 1.0
    least = max(float(turns[turns > 0.0].min(initial=total)), 1e-9 * total)
    sense = -1.0 if torque.sum() < 0.0 else 1.0  # the largest in the rated sense comes first
    order = np.argsort(-sense * torque)
    edges = np.concatenate([[0.0], np.cumsum(turns[order])])
    ax.stairs(
        by * torque[order], np.maximum(edges, 0.5 * least), baseline=0.0, fill=True,
        color=PLANET_COLOURS[0], alpha=0.25, label=f"{len(lasting)} load bins",
    )  # fmt: skip
    if samples is not None and samples.duration:
        intervals = np.array(sorted(samples.duration, key=lambda k: -sense * k))
        exceeded = np.cumsum([samples.duration[int(k)] for k in intervals])
        level = (intervals + 0.5) * samples.fine_step
        frequent = exceeded > 0.1 * least
        ax.plot(
            exceeded[frequent],
            by * level[frequent],
            color=DEFORMED_COLOUR,
            label="samples of series",
        )
    extreme = [by * b.torque[member] for b in bins if b.extreme]
    if extreme:
        ax.plot(
            np.full(len(extreme), 0.5 * least), extreme, ">", color=NEUTRAL, clip_on=False,
            label="extreme loads, without duration",
        )  # fmt: skip
    ax.set_xscale("log")
    ax.set_xlim(0.5 * least, 1.05 * total)
    ax.set_xlabel(f"turns of {words(member)} with at least this torque")
    ax.set_ylabel(f"torque on {words(member)} ({unit})")
    ax.set_title("Load duration")
    ax.legend(loc="lower left")
    return figure


MAX_DAMAGED = 6  # parts in the chart of damage, the most damaged
MAX_PARTS = 24  # in the chart of reserves, the weakest
MAX_NAMES = 24  # of bins; more are numbered
LEAST_DAMAGE = 1e-6  # of the largest damage, that is shown
NOT_ASSESSED = "No part is assessed"
EVEN = 0.01  # relative difference of damage below which equal parts are shown by their common name


@styled
def damage_chart(data: xr.Dataset) -> Figure:
    """Damage (share of the life) by bin of the most damaged flank, root and bearing of each stage;
    up to the top where the load exceeds the static strength. Equal parts with equal damage have
    their common name, others that of the worst."""
    damage = np.nan_to_num(data["damage"].transpose("part", "bin").to_numpy(), posinf=np.inf)
    largest = float(damage[np.isfinite(damage)].max(initial=0.0)) or 1.0
    above = np.isinf(damage).any(axis=1)
    damage = np.minimum(damage, 10 * largest)
    total = damage.sum(axis=1)
    of_stage = list(zip(data["part_stage"].to_numpy(), data["part_kind"].to_numpy(), strict=True))
    worst = {
        of_stage[k]: int(k) for k in np.argsort(total) if total[k] > LEAST_DAMAGE * total.max()
    }
    order = sorted(worst.values(), key=lambda k: -total[k])[:MAX_DAMAGED]
    if not total.any():
        assessed = bool(data["damage"].notnull().any())
        return text_only("No bin damages any part that is assessed" if assessed else NOT_ASSESSED)
    names, count = data["bin"].to_numpy(), data.sizes["bin"]
    alike = data["part_alike"].to_numpy()
    figure, axes = panels(1, 1, height_mm=95)
    ax, at = axes[0, 0], np.arange(count)
    width = 0.8 / len(order)
    for place, k in enumerate(order):
        size = "above static strength" if above[k] else rounded(float(total[k]))
        even = np.allclose(damage[alike == alike[k]], damage[k], rtol=EVEN)
        name = alike[k] if even else data["part"].to_numpy()[k]
        label = f"{words(str(name))}: {size}"
        colour = PLANET_COLOURS[place]
        if count <= MAX_NAMES:
            ax.bar(at + (place - (len(order) - 1) / 2) * width, damage[k], width, color=colour,
                   label=label)  # fmt: skip
        else:
            ax.step(at + 1, damage[k], where="mid", color=colour, lw=1.0, label=label)
    ax.set_yscale("log")
    ax.set_ylim(LEAST_DAMAGE * damage[order].max(), 2 * damage[order].max())
    ax.yaxis.set_major_locator(LogLocator(numticks=8))
    ax.set_ylabel("damage in the bin (–)")
    ax.set_title("Damage by load bin; extreme loads have no duration")
    if count <= MAX_NAMES:
        ax.set_xticks(at, [str(name) for name in names], rotation=60, ha="right")
    else:
        ax.set_xlabel("number of the bin (–)")
    ax.grid(axis="x", visible=False)
    figure.legend(loc="outside lower center", ncols=2)
    return figure


@styled
def safety_chart(data: xr.Dataset) -> Figure:
    """Bars of the load reserve by part: the factor on all loads at which the part reaches its
    limit. Equal parts have one bar, that of the weakest."""
    reserve, alike = data["load_reserve"].to_numpy(), data["part_alike"].to_numpy()
    finite = [k for k in np.argsort(reserve) if np.isfinite(reserve[k]) and reserve[k] > 0.0]
    by_name = {alike[k]: int(k) for k in reversed(finite)}  # the weakest of equal parts
    weakest = sorted(by_name.values(), key=lambda k: reserve[k])[:MAX_PARTS]
    if not weakest:
        return text_only(NOT_ASSESSED)
    figure, axes = panels(1, 1, height_mm=24 + 6.5 * len(weakest))
    ax, sizes = axes[0, 0], reserve[weakest]
    names = [words(str(alike[k])) for k in weakest]
    colours = [DEFORMED_COLOUR if size < 1.0 else PLANET_COLOURS[0] for size in sizes]
    labelled_bars(ax, sizes.tolist(), names, [f"{size:.3g}" for size in sizes], colours)
    ax.set_xscale("log")
    ax.set_xlim(min(0.5, 0.7 * sizes.min()), max(2.0, 1.5 * sizes.max()))
    ax.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    ax.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
    ax.xaxis.set_minor_locator(NullLocator())
    ax.axvline(1.0, color=NEUTRAL, lw=1.2, ls="--")
    ax.set_title("Factor on all loads that parts bear within their limits")
    ax.set_xlabel("factor on all loads within the limits (–)")
    return figure


@styled
def ring_safety_chart(data: xr.Dataset) -> Figure:
    """Safety of the teeth of stationary rings over their azimuth: by computed stresses, and by
    ISO 6336 (dashed); a panel for each ring."""
    part = data["ring_tooth_part"].to_numpy()
    stages = list(dict.fromkeys(data["part_stage"].sel(part=part).to_numpy()))
    figure, axes = panels(len(stages), 1, height_mm=25 + 65 * len(stages))
    for ax, stage in zip(axes[:, 0], stages, strict=True):
        of_stage = [p for p in dict.fromkeys(part) if data["part_stage"].sel(part=p) == stage]
        for name, colour in zip(of_stage, PLANET_COLOURS, strict=False):
            azimuth = np.degrees(data["ring_tooth_azimuth"].to_numpy()[part == name])
            safety = data["direct_tooth_safety"].to_numpy()[part == name]
            norm, text = float(data["safety"].sel(part=name)), words(str(name))
            label = f"{text}: least {safety.min():.3g} at {azimuth[safety.argmin()]:.0f} deg"
            ax.plot(azimuth, safety, marker=".", ms=3, lw=1.0, color=colour, label=label)
            if np.isfinite(norm):
                label = f"{text} by ISO 6336: {norm:.3g}"
                ax.plot([0.0, 360.0], [norm, norm], ls="--", lw=1.2, color=colour, label=label)
        ax.set_xlim(0.0, 360.0)
        ax.set_xticks(np.arange(0, 361, 45))
        ax.set_ylim(0.0, 1.05 * ax.get_ylim()[1])
        ax.set_ylabel("safety (–)")
        ax.set_title(f"{words(str(stage))}: teeth of the stationary ring, by computed stresses")
    axes[-1, 0].set_xlabel("azimuth of the tooth (deg)")
    figure.legend(loc="outside lower center", ncols=2)
    return figure


def rating_charts(rating: Rating) -> dict[str, tuple[str, str, Figure, str]]:
    """Section, caption, figure and sentence of the charts of a rating, by name."""
    data, first = rating.dataset(), rating.case.inputs[0].member
    charts = {
        "reserves": (
            RATING, "Load that parts bear", safety_chart(data),
            "Factor on all loads at which a part reaches its limit; below one it fails.",
        ),
        "damage": (
            RATING, "Damage by bin", damage_chart(data),
            "Share of the life of the most damaged parts of each stage by load bin.",
        ),
    }  # fmt: skip
    if any(b.hours and b.speed[first] for b in rating.bins):
        charts["duration"] = (
            SPECTRUM, "Load duration", load_duration_chart(rating.bins, first),
            f"For how many turns of {words(first)} each torque lasts, by load bins.",
        )  # fmt: skip
    if data.sizes["ring_tooth"]:
        charts["ring"] = (
            RATING, "Safety of the ring's teeth", ring_safety_chart(data),
            "Computed stresses with the life curves of the standard, beyond ISO 6336, tooth by "
            "tooth: a load of constant direction always acts on the same teeth of the ring.",
        )  # fmt: skip
    return charts


BARS = "#9DBAD5"
MEAN, STATED, STANDARD = PLANET_COLOURS[2], PLANET_COLOURS[1], PLANET_COLOURS[4]
LINE = PLANET_COLOURS[0]
MAX_BINS = 40  # of a histogram
EQUAL = 1e-9  # relative spread of equal samples
STYLES = ("-", "--", "-.", ":")  # of the quantiles
STATISTICS = [f"{one}{end}" for one in ("average", "quantile") for end in ("", "_low", "_high")]
STATISTICS.append("as_stated")


@styled
def tolerance_chart(data: xr.Dataset, name: str = "load_sharing") -> Figure:
    """A row for each group: histogram of the samples, and their distribution with its band.

    name: of ``SPREADS``. Marks: mean, quantiles and their intervals, the value of the errors that
    the case states, the value that IEC 61400-4 assumes. Groups with equal values are drawn once;
    groups with one value in all samples are only named if there are others.
    """
    spread = SPREADS[name]
    of = spread.variable
    variable(data, of)
    plain = {of: "values"} | {f"{name}_{statistic}": f"its_{statistic}" for statistic in STATISTICS}
    chosen = spread.factor * data[list(plain)].rename(plain)
    if name == "load_sharing":
        chosen = chosen.assign(mesh_load_factor=data["mesh_load_factor"])
    chosen.attrs = {**data.attrs, "digits": spread.digits}
    groups = _groups(chosen)
    equal = {title: x for title, (x, _) in groups.items() if _constant(x)}
    drawn = {title: group for title, group in groups.items() if title not in equal} or groups
    figure, axes = panels(len(drawn), 2, height_mm=22 + 58 * len(drawn))
    for row, (title, (values, of_group)) in zip(axes, drawn.items(), strict=True):
        row[0].set_title(title)
        _histogram(row[0], values, of_group)
        _distribution(row[1], values, of_group)
        for ax in row:
            ax.set_xlabel(spread.label)
            _span(ax, values)
    legend_of(figure, 3)
    lines = [f"{data.attrs['case']}: {data.sizes['sample']} samples of its manufacturing errors"]
    if drawn is not groups:
        lines += [f"{title}: {x[0]:.6f} in all of them" for title, x in equal.items()]
    figure.suptitle("\n".join(lines), fontsize=9)
    return figure


def _groups(data: xr.Dataset) -> dict[str, tuple[Array, xr.Dataset]]:
    """Sorted samples and statistics of groups by title; groups with equal samples as one."""
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
    """Title of groups with a common beginning: "stage 1 ring and sun"."""
    stages: dict[str, list[str]] = {}
    for group in map(GroupName.parse, names):
        start = f"{group.stage} {group.kind}" if group.side else group.stage
        stages.setdefault(start.replace("_", " "), []).append(group.side or group.kind)
    return ", ".join(f"{stage} {' and '.join(kinds)}".strip() for stage, kinds in stages.items())


def _histogram(ax: Axes, values: Array, of_group: xr.Dataset) -> None:
    """Draw the histogram of samples with their mean; bins by Freedman and Diaconis (1981)."""
    if _constant(values):
        text = f"{values[0]:.6f} in all {len(values)} samples"
        ax.text(0.5, 0.5, text, ha="center", va="center", transform=ax.transAxes, color=NEUTRAL)
        ax.set_yticks([])
        return
    width = 2 * np.subtract(*np.quantile(values, [0.75, 0.25])) / len(values) ** (1 / 3)
    bins = np.ptp(values) / width if width > 0 else MAX_BINS
    ax.hist(values, bins=int(np.clip(np.ceil(bins), 5, MAX_BINS)), color=BARS)
    ax.set_ylabel("samples")
    mean, low, high = (float(of_group[f"its_average{e}"]) for e in ("", "_low", "_high"))
    ax.axvspan(low, high, color=MEAN, alpha=0.25, lw=0)
    ax.axvline(mean, color=MEAN, lw=1.2, label=f"mean, {_percent(of_group)} interval")
    _marks(ax, of_group)


def _distribution(ax: Axes, values: Array, of_group: xr.Dataset) -> None:
    """Draw the cumulative distribution of samples with its band, and quantiles with intervals."""
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
    """Mark the value of the stated errors, and that of the standard if it is near the samples."""
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
    """Set readable ticks, even for equal samples."""
    if _constant(values):
        middle = float(values[0])
        ax.set_xlim(middle - 0.01, middle + 0.01)
    ax.xaxis.set_major_locator(MaxNLocator(5))


def _constant(values: Array) -> bool:
    return bool(np.ptp(values) <= EQUAL * abs(values[-1]))
