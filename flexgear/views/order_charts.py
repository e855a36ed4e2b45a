"""Charts of order spectra with expected lines, run-up maps, averages over a turn, and sensors."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from flexgear.arrays import Array
from flexgear.gears.expected_lines import BEARING, BOLT_PASS, SAME_TEETH, SIDEBAND, TOOTH_FAULT
from flexgear.model.errors import InputError
from flexgear.model.names import GEAR_MESH, PLANET_PASS, SHAFT
from flexgear.model.units import RPM
from flexgear.results.orders import order_spectrum
from flexgear.results.report.wording import number, scale, words
from flexgear.results.run_orders import (
    Lines,
    case_of,
    column_words,
    expected_orders,
    first_input,
    history_over_turns,
    motion_rounding,
    scale_of,
)
from flexgear.results.sinks import SENSOR_TIME
from flexgear.views.style import (
    SEQUENTIAL_MAP,
    cell_edges,
    legend_of,
    panels,
    planet_colour,
    styled,
    text_only,
)
from flexgear.views.traces import CELLS

DECADES = 5  # below the largest amplitude in a spectrum
MAP_DECADES = 4  # below the largest amplitude in a map
COLUMNS = 4  # of a legend
LABEL_SPACING = 0.03  # of the highest order, between labels of harmonics
MAX_HARMONICS = 10  # of a gear mesh in a map
STYLES: dict[str, tuple[str, str]] = {  # colour and line style of expected lines by kind
    GEAR_MESH: ("#374151", "--"),
    SIDEBAND: ("#9CA3AF", ":"),
    SHAFT: ("#0E7C86", ":"),
    PLANET_PASS: ("#7B3294", ":"),
    BOLT_PASS: ("#7B3294", "-."),
    TOOTH_FAULT: ("#C5221F", ":"),
    BEARING: ("#B8860B", ":"),
    SAME_TEETH: ("#9CA3AF", "-."),
}


def curves(values: xr.DataArray, along: str) -> Iterator[tuple[str, Array]]:
    """Every history or spectrum along one dimension, with the labels of the other dimensions."""
    others = [str(d) for d in values.dims if d != along]
    if not others:
        yield "", values.to_numpy()
        return
    for label, curve in values.stack(curve=others).groupby("curve", squeeze=False):
        names = label if isinstance(label, tuple) else (label,)
        yield column_words(values, " ".join(map(str, names))), curve.to_numpy().reshape(-1)


@styled
def order_chart(spectrum: xr.DataArray, lines: Lines = ()) -> Figure:
    """Amplitudes of a spectrum (order, …) on a logarithmic scale, a curve for each label of the
    other dimensions; expected lines by kind."""
    order = spectrum["order"].to_numpy()
    amplitudes = dict(curves(spectrum, "order"))
    largest = max((float(np.nanmax(a, initial=0.0)) for a in amplitudes.values()), default=0.0)
    mean = float(spectrum.attrs.get("largest_mean", 0.0))
    unit, by = scale_of(spectrum, max(largest, mean))
    if largest <= spectrum.attrs.get("rounding", 0.0):
        return text_only(f"Constant, {by * mean:.4g} {unit}: no amplitudes to show")
    unit, by = scale_of(spectrum, largest)
    figure, axes = panels(1, 1, height_mm=85)
    ax = axes[0, 0]
    for k, (label, amplitude) in enumerate(amplitudes.items()):
        ax.plot(order, by * amplitude, color=planet_colour(k + 1), lw=0.9, label=label)
    ax.set_yscale("log")
    ax.set_ylim(by * largest * 10.0**-DECADES, 2 * by * largest)
    ax.set_xlim(0.0, float(order[-1]))
    _mark(ax, lines, float(order[-1]))
    _name_harmonics(ax, lines, float(order[-1]))
    ax.set_xlabel(_order_axis(spectrum))
    ax.set_ylabel(f"amplitude ({unit})")
    ax.set_title(f"Amplitude of {words(str(spectrum.name))}", pad=14)
    legend_of(figure, COLUMNS)
    return figure


def _order_axis(spectrum: xr.DataArray) -> str:
    """Axis label: whose turns orders count, the window of the transform and its length in turns."""
    of, window, turns = (spectrum.attrs[name] for name in ("of", "window", "turns"))
    counted = ("cycle" if of == "the gear mesh" else "turn") + ("s" if turns != 1 else "")
    of = words(of)
    return f"order of {of} (–); {window} window over {turns:.4g} {counted} of {of}"


def _mark(axes: Axes, lines: Lines, highest: float) -> None:
    """Draw expected lines across the panel."""
    for kind, order in {(x.kind, round(at, 6)): None for x, at in lines if at <= highest}:
        colour, style = STYLES[kind]
        axes.axvline(order, color=colour, ls=style, lw=0.8, zorder=0.5, label=f"expected: {kind}")


def _name_harmonics(axes: Axes, lines: Lines, highest: float) -> None:
    """Write the harmonics of gear meshes above the panel where they have room, with the stage if
    there are several; the stage is omitted if all others have only the first harmonic."""
    named = [(order, line) for line, order in lines if line.kind == GEAR_MESH and order <= highest]
    several = len({line.stage for _, line in named}) > 1
    higher = {line.stage for _, line in named if line.harmonic > 1}
    room, last = (LABEL_SPACING * (2 if several else 1)) * highest, -highest
    for order, line in sorted(named, key=lambda entry: entry[0]):
        if order - last >= room:
            bare = not several or higher == {line.stage}
            text = f"{line.harmonic}×" if bare else f"{words(line.stage)} {line.harmonic}×"
            look: Any = {"fontsize": 7, "ha": "center", "va": "bottom"}
            axes.text(order, axes.get_ylim()[1], text, color=STYLES[GEAR_MESH][0], **look)
            last = order


@styled
def order_map_chart(mapped: xr.DataArray, lines: Lines = (), title: str = "") -> Figure:
    """Amplitudes of a map (block, order) by colour, over speed if it is monotonic in time, else
    over time."""
    pooled = _pooled(mapped)
    order, values = pooled["order"].to_numpy(), pooled.to_numpy()
    largest = float(values.max(initial=0.0))
    unit, by = scale_of(mapped, largest)
    speed = np.abs(pooled["speed"].to_numpy()) * RPM
    steady = not ((np.diff(speed) > 0).all() or (np.diff(speed) < 0).all())
    vertical = pooled["time"].to_numpy() if steady else speed
    rows = np.argsort(vertical)
    tiny = largest * 10.0**-MAP_DECADES if largest else 1.0
    level = np.log10(by * np.maximum(values, tiny))[rows]
    figure, axes = panels(1, 1, height_mm=110)
    ax = axes[0, 0]
    image = ax.pcolormesh(
        cell_edges(order), cell_edges(vertical[rows]), level, cmap=SEQUENTIAL_MAP, rasterized=True,
        vmin=np.log10(by * tiny), vmax=np.log10(by * max(largest, tiny)),
    )  # fmt: skip
    ax.grid(False)
    highest = float(order[-1])
    for line, at in lines:
        if line.kind == GEAR_MESH and at <= highest and line.harmonic <= MAX_HARMONICS:
            ax.axvline(at, color="white", ls=":", lw=0.6)
    _name_harmonics(ax, [x for x in lines if x[0].harmonic <= MAX_HARMONICS], highest)
    ax.set_xlabel(_order_axis(mapped))
    of = words(mapped.attrs["of"])  # the speed is that of the turns, relative to another member
    ax.set_ylabel("time (s)" if steady else f"speed of {of} (r/min)")
    name = f"Amplitude of {words(str(mapped.name))}"
    if "column" in mapped.coords:
        name += f", {column_words(mapped, mapped['column'].item())}"
    ax.set_title(title or name, pad=14)
    figure.colorbar(image, ax=ax, label=f"log10 of the amplitude in {unit}", pad=0.01)
    return figure


def _pooled(mapped: xr.DataArray) -> xr.DataArray:
    """A map (block, order) with at most ``CELLS`` cells each way, the largest value in each."""
    width = {d: -(-mapped.sizes[d] // CELLS) for d in ("block", "order")}
    pooled = mapped.reset_coords(drop=True).coarsen(width, boundary="trim", coord_func="mean").max()
    rows = {
        n: ("block", mapped[n].coarsen(block=width["block"], boundary="trim").mean().to_numpy())
        for n in ("speed", "time")
    }
    return pooled.assign_coords(rows).transpose("block", "order")


@styled
def average_chart(mean: xr.DataArray) -> Figure:
    """Means over a turn, with a panel for each planet, or one panel."""
    parts = list(mean.transpose("planet", ...)) if "planet" in mean.dims else [mean]
    largest = float(np.abs(mean).max())
    unit, by = scale_of(mean, largest)
    figure, axes = panels(len(parts), 1, height_mm=30 + 45 * len(parts), sharex=True, sharey=True)
    for ax, part in zip(axes[:, 0], parts, strict=True):
        for k, (label, curve) in enumerate(curves(part, "phase")):
            colour = planet_colour(k + 1)
            ax.plot(part["phase"], by * curve, color=colour, lw=0.9, label=label)
        ax.set_ylabel(f"mean ({unit})")
        if "planet" in part.coords and "planet" in mean.dims:
            ax.set_title(f"planet {int(part['planet'])}")
    axes[-1, 0].set_xlabel(f"{mean['phase'].attrs['long_name']} (–)")
    text = f"{words(str(mean.name)).capitalize()}, mean of {mean.attrs['turns']} turns"
    figure.suptitle(text, fontsize=9.5, weight="bold")
    legend_of(figure, COLUMNS)
    return figure


SHOWN = {  # unit and factor of a quantity in pictures
    "acceleration": ("m/s²", 1.0), "velocity": ("mm/s", 1e3), "displacement": ("µm", 1e6),
    "strain": ("µm/m", 1e6), "speed": ("rad/s", 1.0), "torque": ("N m", 1.0),
}  # fmt: skip
STATIC = {"m": "displacement", "1": "strain", "N m": "torque"}
ROUNDING = 1e-7  # of the largest value of a quantity: a smaller variation is rounding
SENSOR_DECADES = 7  # of a spectrum, below its highest line
MAX_SHOWN = 4000  # samples of a history, the last ones
MAX_SAMPLES = 2**17  # of a spectrum, the last ones
KINDS = (GEAR_MESH, SIDEBAND, SHAFT, PLANET_PASS, BOLT_PASS)  # of expected lines


@styled
def sensors_chart(data: xr.Dataset) -> Figure:
    """Signals of all sensors of a transient: the last samples, and amplitudes by order of the first
    input with expected lines."""
    signal = data["sensor_signal"].isel({SENSOR_TIME: slice(-MAX_SHOWN, None)})
    time, names = signal[SENSOR_TIME].to_numpy(), signal["sensor"].to_numpy()
    figure, axes = panels(len(names), 2, height_mm=28 + 42 * len(names), sharex="col")
    spectrum, lines = _orders(data)
    for k, ((left, right), name) in enumerate(zip(axes, names, strict=True)):
        quantity = str(signal["sensor_quantity"][k].item())
        values = signal.sel(sensor=name).to_numpy().astype(float)
        alike = np.abs(signal.to_numpy()[:, signal["sensor_quantity"].to_numpy() == quantity])
        least = motion_rounding(str(signal["sensor_unit"][k].item()), time)
        rounding = max(ROUNDING * float(alike.max()), least)
        unit, factor, varies = _draw(left, time, values, f"{name}", quantity, rounding)
        if spectrum is None or not varies:
            right.set_visible(False)
            continue
        amplitude = factor * spectrum.sel(sensor=name).to_numpy()
        top = float(amplitude.max(initial=0.0)) or 1.0
        _mark(right, lines[name], float(spectrum["order"][-1]))
        right.semilogy(spectrum["order"], amplitude, lw=0.7)
        right.set_ylim(2 * top * 10.0**-SENSOR_DECADES, 3 * top)
        right.set_xlim(0, float(spectrum["order"][-1]))
        right.locator_params(axis="x", nbins=5)
        right.set_title(f"{name}: amplitudes by order")
        right.set_ylabel(f"amplitude ({unit})")
    shortened = data.sizes[SENSOR_TIME] > MAX_SHOWN
    axes[-1, 0].set_xlabel(f"time (s), last {MAX_SHOWN} samples" if shortened else "time (s)")
    visible = [ax for ax in axes[:, 1] if ax.get_visible()]
    if spectrum is not None and visible:
        visible[-1].set_xlabel(f"order of {words(spectrum.attrs['of'])} (–)")
        visible[-1].tick_params(labelbottom=True)
    legend_of(figure, len(KINDS))
    figure.align_ylabels(axes)
    return figure


def _draw(
    ax: Axes, x: Array, values: Array, name: str, quantity: str, rounding: float
) -> tuple[str, float, bool]:
    """Draw values in SI over x; returns their unit, its factor, and whether they vary by more than
    ``rounding``."""
    unit, factor = scale(values, "N m") if quantity == "torque" else SHOWN[quantity]
    scaled = factor * values
    low, high = float(np.min(scaled)), float(np.max(scaled))
    varies = high - low > factor * rounding
    if varies:
        ax.set_title(f"{name}: {number(low)} … {number(high)} {unit}")
    else:
        mean = 0.0 if abs(high) <= factor * rounding else high
        scaled = np.full(len(scaled), mean)
        ax.set_title(f"{name}: constant, {number(mean)} {unit}")
    ax.plot(x, scaled, lw=0.8)
    ax.set_ylabel(f"{quantity} ({unit})")
    return unit, factor, varies


def _orders(data: xr.Dataset) -> tuple[xr.DataArray | None, dict[str, Lines]]:
    """Order spectrum of the last samples of all sensors, with expected lines of teeth, shafts and
    planets by sensor; None and no lines for a train that reverses or stops."""
    last = data.isel({SENSOR_TIME: slice(-MAX_SAMPLES, None)})
    case, member, names = case_of(data), first_input(data), data["sensor"].to_numpy()
    try:
        spectrum = order_spectrum(history_over_turns(last, "sensor_signal", member))
        expected = {n: expected_orders(case, member, sensors=[n]) for n in map(str, names)}
    except InputError:
        return None, {}
    return spectrum, {n: [x for x in of if x[0].kind in KINDS] for n, of in expected.items()}


@styled
def static_sensors_chart(data: xr.Dataset) -> Figure:
    """Values of sensors in equilibria over the rotation of the reference member."""
    static = data["sensor_static"]
    degrees = np.degrees(data["input_angle"].to_numpy()[:, 0])
    names = static["static_sensor"].to_numpy()
    figure, axes = panels(len(names), 1, height_mm=16 + 34 * len(names), sharex=True)
    for ax, name in zip(axes[:, 0], names, strict=True):
        of_sensor = static.sel(static_sensor=name)
        unit, values = str(of_sensor["static_sensor_unit"].item()), of_sensor.to_numpy()
        rounding = max(ROUNDING * float(np.abs(values).max()), motion_rounding(unit, degrees))
        _draw(ax, degrees, values, f"{name}", STATIC[unit], rounding)
    axes[-1, 0].set_xlabel("rotation of the reference member (°)")
    figure.align_ylabels(axes[:, 0])
    return figure
