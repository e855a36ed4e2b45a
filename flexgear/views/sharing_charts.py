"""Charts of trains: load sharing and gear-mesh forces of planets, floating members, power flow,
lives of bearings.

Datasets have ``gear_mesh_force`` and ``planet_load_factor`` by gear mesh (with stage, kind, side
and planet) and ``body_displacement`` by body and degree of freedom, over positions or time.
"""

from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MaxNLocator, NullLocator

from flexgear.arrays import Array
from flexgear.gears.power_flow import PowerFlow
from flexgear.model.errors import FlexgearError
from flexgear.model.names import BodyName, MemberName
from flexgear.model.units import RPM
from flexgear.results.labelled_dataset import groups_in
from flexgear.results.report import wording
from flexgear.results.report.wording import number, scale, words
from flexgear.views.histories import layer
from flexgear.views.select import MAX_OSCILLATIONS, close_up, draw, orbit, oscillations, variable
from flexgear.views.style import (
    MICRO,
    NEUTRAL,
    PLANET_COLOURS,
    force_scale,
    labelled_bars,
    least_span,
    legend_of,
    panels,
    planet_colour,
    styled,
    text_only,
    variant_colours,
)

MEMBER_COLOURS = {
    "sun": "#D55E00",
    "ring": "#0072B2",
    "carrier": "#009E73",
    "pinion": "#D55E00",
    "gear": "#0072B2",
}
HALVES = {"left": "-", "right": "--"}
EQUAL = 1e-4  # of the largest value: planets that differ less have one line
STATIONARY = 1e-9  # of the largest displacement: a smaller one is rounding
GAP = 1.5  # of the usual step: a longer step is a gap of the line
FAR_APART = 50.0  # largest over smallest of some bars above which the axis is logarithmic


@styled
def sharing_chart(data: xr.Dataset) -> Figure:
    """Load factor K_γ = N F / ΣF of every planet, a panel for each stage and kind of gear mesh."""
    return _planets_chart(data, "planet_load_factor", "$K_γ$")


@styled
def gear_mesh_forces(data: xr.Dataset) -> Figure:
    """Normal force of every planet, a panel for each stage and kind of gear mesh."""
    return _planets_chart(data, "gear_mesh_force", "force", "N")


def _planets_chart(data: xr.Dataset, name: str, symbol: str, unit: str = "") -> Figure:
    """A panel for each stage and kind of gear mesh with a line for each planet and their mean;
    histories with too many oscillations as envelopes, with a close-up around the largest value."""
    rows = gear_mesh_groups(data, name)
    values = np.column_stack([part.to_numpy() for part in rows.values()])
    unit, factor = force_scale(values) if unit else ("", 1.0)
    count = max(oscillations(series) for series in values.T)
    dense = count > MAX_OSCILLATIONS
    window = {str(next(iter(rows.values())).dims[0]): close_up(values)} if dense else {}
    columns, height = 1 + dense, 18 + (58 if len(rows) == 1 else 36 * len(rows))
    figure, axes = panels(
        len(rows), columns, height_mm=height, sharex="col", width_ratios=[2, 1][:columns]
    )
    for row, (title, part) in zip(axes, rows.items(), strict=True):
        alike = _planet_lines(row[0], data, part, factor, count if dense else None)
        mean, largest = (factor * float(x) for x in (part.mean(), part.max()))
        sizes = f"mean {mean:.4g} {unit}, largest {largest:.4g} {unit}"
        if not unit:  # of load factors, whose mean is 1
            sizes = f"largest {wording.factor(largest)}"
        alike_words = ", all planets alike" if alike else ""
        row[0].set_title(f"{title}{alike_words}:{chr(10) if dense else ' '}{sizes}")
        row[0].set_ylabel(f"{symbol} ({unit or '–'})")
        if dense:
            _planet_lines(row[1], data.isel(window), part.isel(window), factor)
            text = "close-up at the largest"
            row[1].set_title(text, weight="normal", fontsize=8, loc="right")
            row[1].xaxis.set_major_locator(MaxNLocator(2))
        for ax in row:
            ax.axhline(factor * float(part.mean()), color=NEUTRAL, lw=0.7, zorder=1)
            least_span(ax, 0.01)
    at, label = sample_axis(data)
    if len(at) > 1:
        axes[-1, 0].set_xlim(at.min(), at.max())
    for ax in axes[-1]:
        ax.set_xlabel(label)
    figure.align_ylabels(axes[:, 0])
    legend_of(figure, 8, least=2)
    return figure


@styled
def displacements_chart(data: xr.Dataset) -> Figure:
    """Orbit of the sun and distance of central members from their axis (µm), a row for each stage.

    In the axes of the carrier (fixed axes in a parallel stage), without the rolling motion.
    """
    stages = _moving(data)
    if not stages:
        return text_only("all central members stay on their axes")
    figure, axes = panels(len(stages), 2, height_mm=14 + 62 * len(stages), width_ratios=[1, 2])
    at, label = sample_axis(data)
    for row, (stage, motion) in zip(axes, stages.items(), strict=True):
        _orbit(row[0], motion)
        row[0].set_title(", ".join(filter(None, (_label(stage), "orbit"))))
        for (part, half), place in motion.items():
            times, line = _with_gaps(data, np.hypot(place[:, 0], place[:, 1]))
            colour, style = MEMBER_COLOURS[part], HALVES.get(half, "-")
            member = f"{part} {half}".strip()
            draw(row[1], times, line, colour, ls=style, lw=1.0, label=member)
        row[1].set_ylabel("distance from the axis (µm)")
        row[1].set_xlabel(label)
        row[1].set(ylim=(0.0, None), xlim=(at.min(), at.max()) if len(at) > 1 else None)
    legend_of(figure)
    return figure


@styled
def power_flow_chart(flow: PowerFlow) -> Figure:
    """Speeds (r/min), torques and powers of all members as bars; ports and held members marked."""
    names = [MemberName.parse(n) for n in flow.speed]
    figure, axes = panels(1, 3, height_mm=26 + 7.0 * len(names), sharey=True)
    stages = list(dict.fromkeys(n.stage for n in names))
    colours = [PLANET_COLOURS[stages.index(n.stage) % 8] for n in names]
    quantities = (
        ("speed", "r/min", [flow.speed[n] * RPM for n in names]),
        ("torque on the stage", *_in_unit([flow.branch_torque[n] for n in names], "N m")),
        ("power into the stage", *_in_unit([flow.branch_power[n] for n in names], "W")),
    )
    labels = [_marked(n, flow) for n in names]
    for ax, (title, unit, values) in zip(axes[0], quantities, strict=True):
        labelled_bars(ax, values, labels, [number(v, 5) for v in values], colours)
        ax.axvline(0, color="black", lw=0.7)
        ax.set_xlabel(f"{title} ({unit})")
        ax.xaxis.set_major_locator(MaxNLocator(4))
        ax.margins(x=0.45)
    unit, (enters, circles) = _in_unit([flow.input_power, flow.circulating_power], "W")
    figure.suptitle(
        f"power in {enters:.4g} {unit}, circulating {circles:.4g} {unit}; "
        f"{flow.mobility} independent speed{'s' if flow.mobility > 1 else ''}",
        fontsize=9, weight="bold",
    )  # fmt: skip
    return figure


@styled
def bearing_life_chart(lives: Mapping[str, Mapping[str, float | None]]) -> Figure:
    """Bars of the basic rating life (h) of bearings by name, with a colour for each stage."""
    bars = [
        (k, words(f"{stage} {name}"), float(life or 0.0))
        for k, (stage, of_stage) in enumerate(lives.items())
        for name, life in of_stage.items()
    ]
    colours = [PLANET_COLOURS[k % len(PLANET_COLOURS)] for k, *_ in bars]
    labels, sizes = [label for _, label, _ in bars], [life for *_, life in bars]
    figure, axes = panels(1, 1, height_mm=26 + 7.0 * len(bars))
    ax = axes[0, 0]
    labelled_bars(ax, sizes, labels, list(map(number, sizes)), colours)
    ax.set_xlabel("basic rating life (h)")
    if max(sizes) > FAR_APART * min(sizes) > 0.0:
        ax.set_xscale("log")
        ax.set_xlim(0.3 * min(sizes), 10.0 * max(sizes))
        ax.xaxis.set_major_locator(LogLocator(numticks=6))
        ax.xaxis.set_minor_locator(NullLocator())
    else:
        ax.xaxis.set_major_locator(MaxNLocator(5))
        ax.margins(x=0.15)
    ax.xaxis.set_major_formatter(lambda value, _: number(value))
    return figure


def gear_mesh_groups(data: xr.Dataset, name: str) -> dict[str, xr.DataArray]:
    """Gear meshes that share a load, by title: stage, kind, side; samples first."""
    field = variable(data, name)
    field = field.transpose(*[d for d in field.dims if d != "gear_mesh"], "gear_mesh")
    out, groups = dict[str, xr.DataArray](), groups_in(field)
    for group, at in groups.items():
        if name == "planet_load_factor" and len(at) < 2:
            continue  # a parallel stage has nothing to share
        title = " ".join(filter(None, (_label(group.stage), group.side, group.kind, "gear mesh")))
        out[title] = field.isel(gear_mesh=at)
    if not out:
        raise FlexgearError("cannot draw: no stage has more than one planet")
    return out


def _planet_lines(
    ax: Axes, data: xr.Dataset, part: xr.DataArray, factor: float, beside: int | None = None
) -> bool:
    """Draw the history of each planet, or a single one if they are equal; returns whether they are.
    beside: None for lines; for envelopes the largest number of oscillations in the picture."""
    values = part.to_numpy() * factor
    spread = float(np.nanmax(np.ptp(values, axis=1), initial=0.0))
    alike = values.shape[1] > 1 and spread < EQUAL * np.nanmax(np.abs(values), initial=0.0)
    planets = zip(part["planet"].to_numpy().tolist(), values.T, strict=True)
    lines = [(planet_colour(p), v, {"lw": 1.0, "label": f"planet {p}"}) for p, v in planets]
    for colour, line, look in [("black", values.mean(axis=1), {"lw": 1.2})] if alike else lines:
        at, y = _with_gaps(data, line)
        if beside is not None:
            draw(ax, at, y, colour, fill=bool(alike), beside=beside, **look)
        else:
            ax.plot(at, y, color=colour, **look)
    return bool(alike)


def sample_axis(data: xr.Dataset) -> tuple[Array, str]:
    """Time (s), or turns of the first input coordinate, and the label of the axis."""
    if "time" in data.dims:
        return np.asarray(variable(data, "time"), dtype=float), "time (s)"
    angle = variable(data, "input_angle").isel(input_coordinate=0)
    coordinate = angle.coords.get("input_coordinate")
    name = "the input" if coordinate is None else str(coordinate.item())
    return np.asarray(angle, dtype=float) / (2 * np.pi), f"turns of {_label(name)} (–)"


def _with_gaps(data: xr.Dataset, values: Array) -> tuple[Array, Array]:
    """Curve of values over samples, with NaN between samples that are further apart than usual."""
    at, _ = sample_axis(data)
    if len(at) < 3:
        return at, values
    step = np.abs(np.diff(at))
    gaps = np.flatnonzero(step > GAP * np.median(step)) + 1
    return np.insert(at, gaps, np.nan), np.insert(values, gaps, np.nan)


def _moving(data: xr.Dataset) -> dict[str, dict[tuple[str, str], Array]]:
    """Radial displacements (t, 2), µm, of central members that leave their axis, by stage, then by
    part and half."""
    field = variable(data, "body_displacement")
    field = field.transpose(*[d for d in field.dims if d not in ("body", "dof")], "body", "dof")
    stages: dict[str, dict[tuple[str, str], Array]] = {}
    largest = float(np.abs(field.to_numpy()[..., :2]).max(initial=0.0)) * MICRO
    for name in map(BodyName.parse, field["body"].to_numpy()):
        displacement = np.asarray(field.sel(body=name), dtype=float)[:, :2] * MICRO
        if (
            name.part in MEMBER_COLOURS
            and np.abs(displacement).max(initial=0.0) > STATIONARY * largest
        ):
            stages.setdefault(name.stage, {})[name.part, name.side] = displacement
    return stages


def _orbit(ax: Axes, motion: Mapping[tuple[str, str], Array]) -> None:
    """Draw the orbit of the sun, else of the member with the largest displacement."""
    at = max(motion, key=lambda n: (n[0] in ("sun", "pinion"), np.abs(motion[n]).max()))
    path, colour, member = orbit(motion[at]), MEMBER_COLOURS[at[0]], " ".join(at).strip()
    ax.plot(path[:, 0], path[:, 1], color=colour, lw=0.8, label=member)
    ax.plot(*path[0], "o", color=colour, ms=3)
    reach = 1.1 * float(np.abs(path).max())
    ax.axhline(0, color=NEUTRAL, lw=0.6, zorder=1)
    ax.axvline(0, color=NEUTRAL, lw=0.6, zorder=1)
    ax.set(xlim=(-reach, reach), ylim=(-reach, reach), aspect="equal")
    ax.xaxis.set_major_locator(MaxNLocator(4))
    ax.yaxis.set_major_locator(MaxNLocator(4))
    ax.set_xlabel(f"x of the {member} (µm)")
    ax.set_ylabel(f"y of the {member} (µm)")


def _label(name: str) -> str:
    """Name of a member in words: stage_1.sun -> stage 1, sun; stage.sun -> sun."""
    at = MemberName.parse(name)
    parts = [at.stage.replace("_", " ") if at.stage != "stage" else "", at.part.replace("_", " ")]
    return ", ".join(filter(None, parts))


def _marked(name: str, flow: PowerFlow) -> str:
    """Name of a member; of a port with its sense of power, of a held member with "held"."""
    if name not in flow.torque:
        return _label(name)
    if flow.speed[name] == 0:
        return f"{_label(name)} (held)"
    return f"{_label(name)} ({'in' if flow.power[name] > 0 else 'out'})"


def _in_unit(values: list[float], unit: str) -> tuple[str, list[float]]:
    """Values with a prefix of the unit that suits the largest."""
    printed, by = scale(values, unit)
    return printed, [by * v for v in values]


@styled
def comparison_chart(runs: Mapping[str, xr.Dataset]) -> Figure:
    """Largest force of the planets and load sharing K_γ = N max F / Σ F of several runs, a row
    for each group of gear meshes, that of a parallel stage without load sharing. runs: transients,
    or equilibria, of cases with the same stages, by label."""
    forces = {label: gear_mesh_groups(data, "gear_mesh_force") for label, data in runs.items()}
    first = next(iter(forces.values()))
    if any(set(groups) != set(first) for groups in forces.values()):
        raise FlexgearError("cannot draw: the runs are of different stages")
    if len({"time" in data.dims for data in runs.values()}) > 1:
        raise FlexgearError("cannot draw: some are transients and some are equilibria")
    colours, axis_label = variant_colours(runs), ""
    unit, by = force_scale([f.max().item() for g in forces.values() for f in g.values()])
    shared = [f.sizes["gear_mesh"] > 1 for f in first.values()]
    columns = 2 if any(shared) else 1
    figure, axes = panels(len(first), columns, height_mm=24 + 46 * len(first), sharex=True)
    for k, (label, groups) in enumerate(forces.items()):
        x, axis_label = sample_axis(runs[label])
        for row, (title, force) in zip(axes, groups.items(), strict=True):
            factor = runs[label]["planet_load_factor"].sel(gear_mesh=force["gear_mesh"])
            largest = (by * force.max("gear_mesh"), factor.max("gear_mesh"))
            row[0].set_title(title)
            for ax, values in zip(row, largest, strict=False):
                draw(ax, x, values.to_numpy(), colours[label], label=label, **layer(k))
    for row, has_sharing in zip(axes, shared, strict=True):
        row[0].set_ylabel(f"largest force ({unit})")
        for ax in row:
            least_span(ax, 0.01)
        if has_sharing:
            row[1].set_ylabel("load sharing $K_γ$ (–)")
            row[1].axhline(1.0, color=NEUTRAL, lw=0.7)
        for ax in () if has_sharing else row[1:]:
            ax.set_visible(False)
    for column in axes.T:
        lowest = [ax for ax in column if ax.get_visible()][-1]
        lowest.set_xlabel(axis_label)
        lowest.tick_params(labelbottom=True)
    legend_of(figure)
    return figure
