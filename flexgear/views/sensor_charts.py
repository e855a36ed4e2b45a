"""What sensors measure: over time, over the rotation in equilibria, and its order spectrum."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from flexgear.gears.expected_lines import SIDEBAND, ExpectedLine
from flexgear.model.errors import InputError
from flexgear.model.names import GEAR_MESH, PLANET_PASS, SHAFT
from flexgear.results.orders import (
    case_of,
    expected_orders,
    first_input,
    history_over_turns,
    order_spectrum,
)
from flexgear.results.sinks import SENSOR_TIME
from flexgear.views.order_charts import LOOKS
from flexgear.views.style import legend_below, panels, styled

SHOWN = {  # unit and factor of a quantity in pictures
    "acceleration": ("m/s²", 1.0), "velocity": ("mm/s", 1e3), "displacement": ("µm", 1e6),
    "strain": ("µm/m", 1e6), "speed": ("rad/s", 1.0), "torque": ("N m", 1.0),
}  # fmt: skip
STATIC = {"m": "displacement", "1": "strain", "N m": "torque"}
DECADES = 7  # of a spectrum, below its highest line
MOST_SHOWN = 4000  # samples of a history
MOST = 2**17  # of a spectrum, the last ones
KINDS = (GEAR_MESH, SIDEBAND, SHAFT, PLANET_PASS)  # of expected lines


@styled
def sensors_chart(data: xr.Dataset) -> Figure:
    """Every sensor of a transient: its last samples, and amplitudes of the dataset by orders of the
    first input, with the lines that are expected there."""
    signal = data["sensor_signal"].isel({SENSOR_TIME: slice(-MOST_SHOWN, None)})
    time, names = signal[SENSOR_TIME].to_numpy(), signal["sensor"].to_numpy()
    figure, axes = panels(len(names), 2, height_mm=28 + 42 * len(names), sharex="col")
    spectrum, lines = _orders(data)
    for k, ((left, right), name) in enumerate(zip(axes, names, strict=True)):
        quantity = str(signal["sensor_quantity"][k].item())
        unit, factor = SHOWN[quantity]
        values = factor * signal.sel(sensor=name).to_numpy().astype(float)
        left.plot(time, values, lw=0.7)
        left.set_title(f"{name}: {values.min():.4g} … {values.max():.4g} {unit}")
        left.set_ylabel(f"{quantity} ({unit})")
        if spectrum is None:
            right.set_visible(False)
            continue
        amplitude = factor * spectrum.sel(sensor=name).to_numpy()
        top = float(amplitude.max(initial=0.0)) or 1.0
        for line, order in lines:
            colour, style = LOOKS[line.kind]
            right.axvline(order, color=colour, ls=style, lw=0.7, zorder=0.5)
        right.semilogy(spectrum["order"], amplitude, lw=0.7)
        right.set_ylim(2 * top * 10.0**-DECADES, 3 * top)
        right.set_xlim(0, float(spectrum["order"][-1]))
        right.set_title(f"{name}: amplitudes by order")
        right.set_ylabel(f"amplitude ({unit})")
    axes[-1, 0].set_xlabel("time (s)")
    if spectrum is not None:
        axes[-1, 1].set_xlabel(f"order of {spectrum.attrs['of']} (–)")
        kinds = dict.fromkeys(line.kind for line, _ in lines)
        handles = [
            Line2D(
                [], [], color=LOOKS[kind][0], ls=LOOKS[kind][1], lw=1.0, label=f"expected: {kind}"
            )
            for kind in kinds
        ]
        if handles:
            legend_below(figure, handles, len(handles))
    figure.align_ylabels(axes)
    return figure


def _orders(data: xr.Dataset) -> tuple[xr.DataArray | None, list[tuple[ExpectedLine, float]]]:
    """Order spectrum of the end of a dataset's signals, and the lines of teeth, shafts and planets
    in its range; none of a train that does not turn one way."""
    last = data.isel({SENSOR_TIME: slice(-MOST, None)})
    member = first_input(data)
    try:
        spectrum = order_spectrum(history_over_turns(last, "sensor_signal", member))
        expected = expected_orders(case_of(data), member)
    except InputError:
        return None, []
    highest = float(spectrum["order"][-1])
    return spectrum, [x for x in expected if x[1] <= highest and x[0].kind in KINDS]


@styled
def static_sensors_chart(data: xr.Dataset) -> Figure:
    """Every sensor that has a value in equilibrium, over the rotation of the reference member."""
    static = data["sensor_static"]
    degrees = np.degrees(data["input_angle"].to_numpy()[:, 0])
    names = static["static_sensor"].to_numpy()
    figure, axes = panels(len(names), 1, height_mm=16 + 34 * len(names), sharex=True)
    for ax, name in zip(axes[:, 0], names, strict=True):
        of_sensor = static.sel(static_sensor=name)
        quantity = STATIC[str(of_sensor["static_sensor_unit"].item())]
        unit, factor = SHOWN[quantity]
        values = factor * of_sensor.to_numpy()
        ax.plot(degrees, values, lw=0.9)
        ax.set_title(f"{name}: {values.min():.4g} … {values.max():.4g} {unit}")
        ax.set_ylabel(f"{quantity} ({unit})")
    axes[-1, 0].set_xlabel("rotation of the reference member (°)")
    figure.align_ylabels(axes[:, 0])
    return figure
