"""Charts of vibration over speed: steady states with all branches, linear response, and parametric
instability; and of the energy balance over time."""

import itertools
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from flexgear.arrays import Array
from flexgear.model.names import GearMeshName
from flexgear.results import time_figures
from flexgear.results.report.wording import scale, signal_scale, words
from flexgear.results.run_orders import rms_of_states
from flexgear.views.select import variable
from flexgear.views.style import (
    DEFORMED_COLOUR,
    MICRO,
    NEUTRAL,
    PLANET_COLOURS,
    force_scale,
    least_span,
    legend_of,
    panels,
    planet_colour,
    styled,
)

UP, DOWN, CHANGE = "#C5221F", "#2166AC", "#444444"
LOST, BACK = "#F7CFA3", "#E59C8C"
BROAD = 6.0  # width of a line, points
MARKERS: Any = {"marker": "o", "ms": 2.2, "markevery": 0.025}  # of curves of longer periods
COUNTS = {2: "two", 4: "four", 8: "eight"}
FORCE, ERROR = "response_gear_mesh_force", "response_transmission_error"
MAX_GEAR_MESHES = len(PLANET_COLOURS)
SAME = 1e-3  # difference of the forces of equal planets, over the largest force
MAX_SENSORS = 4  # with a panel
HIGHEST = 20.0  # times the median of stable states, at which a panel ends, with a note


@styled
def response_chart(data: xr.Dataset) -> Figure:
    """Largest and smallest gear-mesh force, peak-to-peak transmission error, and rms of sensors.

    Solid: stable, dashed: unstable; arrows: jumps of a sweep to the force at their head; markers:
    periods of several gear meshes; broad lines below: teeth lose contact, or coast flanks touch.
    """
    x = data[f"response_{data.attrs['over']}_share"].to_numpy().astype(float)
    sensors = np.asarray(data.coords.get("sensor", ())).tolist()[:MAX_SENSORS]
    height, ratios = 150 + 40 * len(sensors), [1.6, 1.0, *[0.7] * len(sensors)]
    figure, axes = panels(len(ratios), 1, height_mm=height, sharex=True, height_ratios=ratios)
    force, error, *of_sensors = axes[:, 0]
    drawn = _distinct(data)
    names = list(drawn.values())
    of_drawn = data.isel(gear_mesh=list(drawn))
    forces = [_measure(of_drawn, FORCE, m) for m in ("maximum", "minimum")]
    unit, by = force_scale(forces)
    top, bottom = (by * f for f in forces)
    swing = _measure(of_drawn, ERROR, "maximum") - _measure(of_drawn, ERROR, "minimum")
    swing = MICRO * swing
    for k, (name, colour) in enumerate(zip(names, PLANET_COLOURS, strict=False)):
        for ax, y, width in ((force, top, 1.4), (force, bottom, 0.8), (error, swing, 1.2)):
            _curve(ax, data, x, y[:, k], colour, width, name)
        for ax, y in ((force, top), (error, swing)):
            _contact(ax, of_drawn, x, y[:, k], k)
    for ax, sensor in zip(of_sensors, sensors, strict=True):
        signal = rms_of_states(data, sensor)
        shown = signal[data["stable"].to_numpy() == 1] if data["stable"].any() else signal
        signal_unit, factor = signal_scale(shown, data["sensor_unit"].sel(sensor=sensor).item())
        signal = factor * signal
        _curve(ax, data, x, signal, NEUTRAL, 1.2, "")
        _limit(ax, signal[:, None], 0.0, data["stable"].to_numpy() == 1)
        ax.set_ylabel(f"{sensor}, rms ({signal_unit})")
    for ax, y, low in ((force, top, bottom), (error, swing, swing)):
        _limit(ax, y, float(low.min()), data["stable"].to_numpy() == 1)
        ax.set_xlim(float(x.min()), float(x.max()))
    _jumps(force, data, by)
    _changes(force, data)
    force.set_ylabel(f"gear-mesh force ({unit}),\nlargest and smallest")
    error.set_ylabel("transmission error (µm),\npeak to peak")
    axes[-1, 0].set_xlabel(f"{data.attrs['over']} over rated {data.attrs['over']} (–)")
    legend_of(figure, 3, first=_legend(of_drawn, names))
    return figure


def _distinct(data: xr.Dataset) -> dict[int, str]:
    """Indices of the gear meshes that have lines of their own, with labels: planets with the same
    forces in every state have one line."""
    names = [GearMeshName.parse(n) for n in data["gear_mesh"].to_numpy()]
    forces = np.stack([_measure(data, FORCE, m) for m in ("maximum", "minimum")])
    off = SAME * np.abs(forces).max()
    drawn = dict[int, list[GearMeshName]]()
    for k, name in enumerate(names):
        same = (j for j in drawn if names[j].group == name.group
                and np.abs(forces[..., j] - forces[..., k]).max() <= off)  # fmt: skip
        drawn.setdefault(next(same, k), []).append(name)
    lines = itertools.islice(drawn.items(), MAX_GEAR_MESHES)
    return {k: words(GearMeshName.joined(of)) for k, of in lines}


def _measure(data: xr.Dataset, name: str, measure: str) -> Array:
    """A measure of all gear meshes (n, g)."""
    return data[name].sel(measure=measure).to_numpy().astype(float)


def _curve(
    ax: Axes, data: xr.Dataset, x: Array, y: Array, colour: str, width: float, name: str
) -> None:
    """Draw values of all curves; stable and unstable pieces of a curve are connected."""
    stable, branch = data["stable"].to_numpy() == 1, data["response_branch"].to_numpy()
    cuts = np.flatnonzero((np.diff(stable.astype(int)) != 0) | (np.diff(branch) != 0)) + 1
    for start, stop in itertools.pairwise([0, *cuts.tolist(), len(stable)]):
        joined = stop < len(x) and branch[stop] == branch[start]
        at = slice(start, stop + joined)
        style, faint = ("-", 1.0) if stable[start] else ((0, (3, 1.6)), 0.65)
        look: dict[str, Any] = {"lw": width * faint, "label": name}
        look |= MARKERS if _periods(data)[start] > 1 else {}
        ax.plot(x[at], y[at], linestyle=style, color=colour, **look)


def _periods(data: xr.Dataset) -> Array:
    """Number of gear-mesh periods after which each state repeats; one in files without it."""
    return np.asarray(data.get("response_period", np.ones(data.sizes["point"])))


def period_words(period: int) -> str:
    """Words for a motion that repeats after several gear-mesh periods."""
    return f"period of {COUNTS[period]} gear meshes"


def _limit(ax: Axes, values: Array, lowest: float, stable: NDArray[np.bool_]) -> None:
    """Set the vertical range from the lowest value or zero to the highest of values (states, g), or
    to ``HIGHEST`` on both sides with a note."""
    highest = float(values.max())
    top = HIGHEST * float(np.median(values[stable])) if stable.any() else 0.0
    if highest <= top or top <= 0.0:
        ax.set_ylim(1.06 * min(0.0, lowest), 1.06 * highest or 1.0)
        return
    ax.set_ylim(max(1.06 * min(0.0, lowest), -top), top)
    ax.text(0.99, 0.97, f"states continue up to {highest:.3g}", transform=ax.transAxes, ha="right",
            va="top", fontsize=7.5, color=NEUTRAL)  # fmt: skip


def _contact(ax: Axes, data: xr.Dataset, x: Array, y: Array, gear_mesh: int) -> None:
    """Draw broad lines below a curve where teeth lose contact, and where coast flanks touch."""
    branch = data["response_branch"].to_numpy()
    lost, back = data.attrs["without_contact"], "coast flanks touch, too"
    for name, colour, label in (("lost", LOST, lost), ("back", BACK, back)):
        at = np.flatnonzero(data[f"{name}_contact_share"].to_numpy()[:, gear_mesh] > 0.0)
        breaks = (np.diff(at) > 1) | (np.diff(branch[at]) != 0)
        for run in np.split(at, np.flatnonzero(breaks) + 1) if len(at) else []:
            look: Any = {"lw": BROAD, "solid_capstyle": "butt", "zorder": 1, "label": label}
            ax.plot(x[run], y[run], color=colour, **look)


def _jumps(ax: Axes, data: xr.Dataset, by: float) -> None:
    """Draw a triangle at each turning point and arrows to all stable states to which a sweep may
    jump. by: factor to the unit of the axes."""
    for k in range(data.sizes.get("turning_point", 0)):
        row = data.isel(turning_point=k)
        rising = int(row["turning_point_sense"]) > 0
        colour, marker, turns = (UP, ">", "rises") if rising else (DOWN, "<", "falls")
        x, y = float(row["turning_point_parameter"]), by * float(row["turning_point_force"])
        label = f"jump as {data.attrs['over']} {turns}"
        ax.plot([x], [y], marker, color=colour, ms=4.5, zorder=4, label=label)
        targets = row["turning_point_target_force"].to_numpy()
        for target in by * targets[np.isfinite(targets)]:
            arrow = {"arrowstyle": "-|>", "color": colour, "lw": 0.9, "shrinkA": 3, "shrinkB": 0}
            ax.annotate("", (x, target), (x, y), arrowprops=arrow, zorder=4).set_in_layout(False)


def _changes(ax: Axes, data: xr.Dataset) -> None:
    """Draw marks at the bottom of the panel where stability changes without a turning point."""
    if "stability_change" not in data.sizes:
        return
    changed = data["stability_change_kind"].to_numpy() != 0
    if changed.any():
        at = data["stability_change_parameter"].to_numpy()[changed]
        look: Any = {"color": CHANGE, "ms": 4, "label": "another motion branches off"}
        ax.plot(at, np.zeros(len(at)), "d", clip_on=False, zorder=4, **look)


def _legend(data: xr.Dataset, names: list[str]) -> list[Any]:
    """Entries of the legend for lines, which have many pieces."""
    handles: list[Any] = [
        Line2D([], [], color=PLANET_COLOURS[k], lw=1.4, label=name) for k, name in enumerate(names)
    ]
    stable = data["stable"].to_numpy() == 1
    if stable.any():
        handles.append(Line2D([], [], color=NEUTRAL, lw=1.4, label="stable"))
    if not stable.all():
        dashes = (0, (3, 1.6))
        handles.append(Line2D([], [], color=NEUTRAL, lw=0.9, ls=dashes, label="unstable"))
    handles += [
        Line2D(
            [], [], color=NEUTRAL, lw=1.4, label=period_words(period), **MARKERS | {"markevery": 1}
        )
        for period in np.unique(_periods(data)).astype(int).tolist()
        if period > 1
    ]
    return handles


DECADES = 3.0  # of a panel, below its highest value
MAX_LABELS = 8  # of peaks or bands in a panel
LABEL_WIDTH = 0.07  # of the width of a panel


def _stage_panels(
    data: xr.Dataset, stages: list[str], draw: Callable[[Axes, xr.Dataset, str], None]
) -> Figure:
    """Figure with a panel over speed for each stage, and a legend."""
    figure, axes = panels(len(stages), 1, height_mm=22 + 63 * len(stages), sharex=True)
    for ax, stage in zip(axes[:, 0], stages, strict=True):
        draw(ax, data, stage)
        if len(stages) > 1:
            ax.set_title(stage.replace("_", " "))
    axes[-1, 0].set_xlabel("speed over rated speed (–)")
    legend_of(figure, 5)
    return figure


def _name_points(ax: Axes, points: Iterable[tuple[float, float, str]]) -> None:
    """Write labels (x, y, text) above the first points that have room."""
    labelled: list[float] = []
    for x, y, text in points:
        if len(labelled) == MAX_LABELS:
            break
        if all(abs(x - other) >= LABEL_WIDTH * np.ptp(ax.get_xlim()) for other in labelled):
            labelled.append(x)
            ax.annotate(text, (x, y), xytext=(0, 3), textcoords="offset points", fontsize=7,
                        ha="center", va="bottom")  # fmt: skip


@styled
def linear_response_chart(data: xr.Dataset) -> Figure:
    """Amplitude of the largest gear-mesh force of each stage by order of its gear-mesh frequency,
    with the mode of the largest share of each peak."""
    stages = list(dict.fromkeys(map(str, data["stage"].to_numpy())))
    return _stage_panels(data, stages, _forces)


def _forces(ax: Axes, data: xr.Dataset, stage: str) -> None:
    """Draw the forces of one stage."""
    of_stage = np.flatnonzero(data["stage"].to_numpy() == stage)
    forces = data["linear_force_amplitude"].to_numpy()
    unit, by = force_scale(forces)
    force = by * forces[:, of_stage].max(axis=1)
    factor = data["speed_factor"].to_numpy()
    for k, order in enumerate(data["gear_mesh_order"].to_numpy().tolist()):
        ax.semilogy(factor, force[:, k], color=planet_colour(order), label=f"order {order}")
    top = float(force.max(initial=0.0)) or 1.0
    ax.set(xlim=(factor[0], factor[-1]), ylim=(top * 10**-DECADES, 3.0 * top))
    ax.set_ylabel(f"amplitude of gear-mesh force ({unit})")
    names = set(data["gear_mesh"].to_numpy()[of_stage].tolist())
    points = []
    for k in range(data.sizes.get("peak", 0)):
        row = data.isel(peak=k)
        at, height = float(row["peak_factor"]), by * float(row["peak_force"])
        largest = force[np.argmin(np.abs(factor - at)), int(row["peak_order"]) - 1]
        if str(row["peak_gear_mesh"].values) in names and height >= 0.99 * largest:
            mode = int(data["kept_mode"][int(np.argmax(row["peak_mode_share"].to_numpy()))])
            points.append((at, height, f"mode {mode}"))
    _name_points(ax, points)


UNSTABLE, SHADE = PLANET_COLOURS[4], "#FBE9DF"


@styled
def stability_chart(data: xr.Dataset) -> Figure:
    """Growth rate over speed, a panel for each stage: shaded bands in which vibration grows, with
    modes i and j and order l of l f_z = f_i + f_j at the fastest growth; operating speeds grey."""
    stages = [str(s) for s in data["turning_stage"].to_numpy()]
    return _stage_panels(data, stages, _growth)


def _growth(ax: Axes, data: xr.Dataset, stage: str) -> None:
    """Draw the growth rate of one stage."""
    factor, growth = with_edges(data, stage)
    for speed in np.atleast_1d(data.attrs["operating_factors"]):
        if factor[0] <= speed <= factor[-1]:
            ax.axvline(speed, color=NEUTRAL, lw=0.8, label="speeds at which the case runs")
    bands = bands_of(data, stage)
    for band in bands:
        ax.axvspan(band["lower_factor"], band["upper_factor"], color=SHADE, zorder=0)
    ax.plot(factor, growth, color=UNSTABLE, label="growth of free vibration")
    ax.set(xlim=(factor[0], factor[-1]), ylabel="growth rate (1/s)")
    if not bands:
        ax.set_ylim(-0.05, 1.0)
        ax.text(0.5, 0.5, "no vibration grows in this range", transform=ax.transAxes, ha="center",
                color=NEUTRAL)  # fmt: skip
        return
    least_span(ax, 1e-3)
    ax.set_ylim(0.0, 1.18 * float(growth.max()))
    fastest = sorted(bands, key=lambda b: -b["growth_rate"])
    _name_points(
        ax,
        (
            (b["peak_factor"], b["growth_rate"], combination(b["modes"], b["order"]))
            for b in fastest
        ),
    )


def combination(modes: tuple[int, int], order: int) -> str:
    """Condition of modes i, j and order l: "2 f₃ = f_z", "f₂ + f₅ = 3 f_z"."""
    i, j = (f"f$_{{{k}}}$" for k in modes)
    left = f"2 {i}" if modes[0] == modes[1] else f"{i} + {j}"
    return f"{left} = {'' if order == 1 else f'{order} '}f$_z$"


def bands_of(data: xr.Dataset, stage: str) -> list[dict[str, Any]]:
    """Bands of a stage as dictionaries, by rising speed."""
    names = ("lower_factor", "upper_factor", "peak_factor", "growth_rate", "order")
    return [
        {name: data[f"band_{name}"].values[k].item() for name in names}
        | {"modes": tuple(int(m) for m in data["band_modes"].values[k])}
        for k in range(data.sizes.get("band", 0))
        if str(data["band_stage"].values[k]) == stage
    ]


def with_edges(data: xr.Dataset, stage: str) -> tuple[np.ndarray, np.ndarray]:
    """Speed factors and growth rates of a stage, with zeros at the edges of its bands."""
    factor = data["speed_factor"].to_numpy().astype(float)
    growth = data["growth_rate"].sel(turning_stage=stage).to_numpy().astype(float)
    edges = np.array(
        [band[end] for band in bands_of(data, stage) for end in ("lower_factor", "upper_factor")]
    )
    edges = edges[(edges > factor[0]) & (edges < factor[-1])]
    factors = np.concatenate([factor, edges])
    order = np.argsort(factors, kind="stable")
    return factors[order], np.concatenate([growth, np.zeros(len(edges))])[order]


ENERGY_LABELS = {  # label and colour by term
    "input_work": ("work of the input torque", "#0072B2"),
    "brake_work": ("work of the brake", "#D55E00"),
    "damping_work": ("work of structural damping", "#009E73"),
    "pair_damping_work": ("work of tooth-pair damping", "#CC79A7"),
    "parametric_work": ("work of varying tooth stiffness", "#8C6D1F"),
    "load_work": ("work of weight and loads", "#6A51A3"),
    "kinetic": ("kinetic energy", "#56B4E9"),
    "elastic": ("elastic energy, bodies", "#E69F00"),
    "pair_elastic": ("elastic energy, tooth pairs", "#444444"),
}
BALANCED = 1e-4  # of the peak elastic energy: a smaller residual is not drawn
OUTGOING = ("brake_work", "damping_work", "pair_damping_work")
STORED = ("kinetic", "elastic", "pair_elastic")


@styled
def energy_balance(dataset: xr.Dataset) -> Figure:
    """Changes of energy and work since the start over time, and the residual of their balance.

    The residual is that of ``time_figures.energy_balance``, in percent of the peak elastic energy
    in the lowest panel. Brake and damping work are positive in the dataset where energy leaves the
    system, and drawn negative.
    """
    balance, outer = time_figures.energy_balance(dataset), ("input_work", "brake_work")
    left = balance["left"].to_numpy()
    residual = (left - left[0]) / float(balance["elastic"].max())
    time = np.asarray(variable(dataset, "time"), dtype=float)
    energies = {t: np.asarray(dataset[f"energy_{t}"], dtype=float) for t in ENERGY_LABELS}
    changes = {t: (-1 if t in OUTGOING else 1) * (v - v[0]) for t, v in energies.items()}
    balanced = float(np.abs(residual).max()) <= BALANCED
    rows = 2 + int(not balanced)
    figure, axes = panels(rows, 1, height_mm=26 + 42 * rows, sharex=True)
    for ax, group in zip(axes[:, 0], (outer, [t for t in changes if t not in outer]), strict=False):
        unit, factor = scale([float(np.max(np.abs(changes[t]))) for t in group], "J")
        for term in group:
            line = "-" if term in STORED else "--"
            label, colour = ENERGY_LABELS[term]
            ax.plot(time, changes[term] * factor, line, color=colour, label=label)
        ax.set_ylabel(f"change since\nthe start ({unit})")
    last = axes[-1, 0]
    if balanced:
        text = f"balanced to {100 * BALANCED:g} % of the largest elastic energy"
        last.set_title(text, weight="normal", fontsize=8)
    else:
        last.plot(time, 100 * residual, color=DEFORMED_COLOUR, lw=1)
        last.set_ylabel("residual (% of\npeak elastic)")
    for ax in axes[:, 0]:
        ax.axhline(0, color=NEUTRAL, lw=0.7)
    last.set_xlabel("time (s)")
    last.set_xlim(time[0], time[-1])
    figure.align_ylabels(axes[:, 0])
    figure.legend(loc="outside lower center", ncols=3)
    return figure
