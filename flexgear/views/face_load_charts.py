"""Charts of flanks under load: line load along the face, contact patterns, misalignment, root
stress, transmission error and stiffness over gear-mesh cycles.

Datasets are equilibria whose pairs have slices (``face_line_load``, ``line_load`` with
``slice_position`` and ``slice_path``, ``gear_mesh_misalignment_by_cause``, by flank) and results of
``solve.static.gear_mesh_cycles``: curves show the first cycle, orders are those of all cycles.
"""

import math
from typing import Any

import numpy as np
import scipy
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from flexgear.gears.slices import factor_along, mean_along
from flexgear.model.names import FlankName
from flexgear.results.face_load import misalignment_by_cause
from flexgear.results.report.wording import number
from flexgear.results.stage_figures import gears_of
from flexgear.results.tooth_pattern import ToothPattern, filled, loaded_flanks
from flexgear.views.style import (
    MEGA,
    MICRO,
    MILLI,
    N_PER_M_TO_N_PER_UM,
    NEUTRAL,
    ORIGINAL_COLOUR,
    SEQUENTIAL_MAP,
    SPLIT_COLOUR,
    legend_of,
    new_figure,
    panels,
    planet_colour,
    styled,
)

N_PER_MM = 1e-3  # N/m -> N/mm
ALONG_FACE = "along the face over its width, −z to +z (–)"
CELLS = 60  # of a contact pattern along the path; half as many along the face


Row = tuple[Any, str, list[FlankName]]  # axes, title and flanks of a row of a figure


def _rows(
    data: xr.Dataset, height_mm: float, columns: int = 1, **options: Any
) -> tuple[Figure, list[Row]]:
    """Figure with a row of axes, ``height_mm`` high, for each group of loaded gear meshes."""
    groups = {group.replace("_", " "): flanks for group, flanks in loaded_flanks(data).items()}
    height = 14 + height_mm * len(groups)
    figure, axes = panels(len(groups), columns, height_mm=height, **options)
    rows = axes[:, 0] if columns == 1 else axes
    return figure, [(ax, *group) for ax, group in zip(rows, groups.items(), strict=True)]


def _finish_along_face(figure: Figure) -> Figure:
    """The figure with labels, limits and legend of loads per width along the face."""
    for ax in figure.axes:
        ax.set_ylabel("load per width,\nall pairs (N/mm)")
        ax.set(ylim=(0.0, None), xlim=(-0.5, 0.5))
    figure.axes[-1].set_xlabel(ALONG_FACE)
    legend_of(figure)
    return figure


@styled
def along_face_chart(data: xr.Dataset) -> Figure:
    """Load per width (N/mm) of all gear meshes along the face, mean of all positions, by planet."""
    figure, rows = _rows(data, 48, sharex=True)
    for ax, title, flanks in rows:
        factors = []
        for name in flanks:
            of_flank = data.sel(flank=name)
            load = of_flank["face_line_load"].mean("position").to_numpy() * N_PER_MM
            factors.append(factor_along(load, float(of_flank["face_section"])))
            planet = int(of_flank["flank_planet"])
            ax.plot(data["face"], load, color=planet_colour(planet), label=f"planet {planet}")
            ax.axhline(mean_along(load), color=NEUTRAL, lw=0.5, zorder=1)
        low, high = min(factors), max(factors)
        span = f"{low:.3f}" if high - low < 5e-4 else f"{low:.3f} to {high:.3f}"
        ax.set_title(f"{title}: $K_{{Hβ}}$ {span}")
    return _finish_along_face(figure)


@styled
def before_and_after(before: xr.Dataset, after: xr.Dataset) -> Figure:
    """Load per width (N/mm) of planet 1 along the face before and after a change of the flanks,
    mean of all positions."""
    figure, rows = _rows(before, 48, sharex=True)
    for ax, title, (name, *_) in rows:
        for data, style, label in ((before, "--", "before"), (after, "-", "after")):
            load = data["face_line_load"].sel(flank=name).mean("position").to_numpy() * N_PER_MM
            ax.plot(data["face"], load, style, color=planet_colour(1), label=label)
        ax.set_title(f"{title}, planet {int(before.sel(flank=name)['flank_planet'])}")
    return _finish_along_face(figure)


@styled
def contact_pattern(data: xr.Dataset) -> Figure:
    """Largest line load (N/mm) over all positions on the flanks of planet 1 with ring and sun, over
    path of contact and face."""
    figure, rows = _rows(data, 62)
    for ax, title, (name, *_) in rows:
        of_flank = data.sel(flank=name)
        scales = {"slice_path": MILLI, "slice_position": MILLI, "line_load": N_PER_MM}
        x, z, w = (of_flank[n].to_numpy().ravel() * scale for n, scale in scales.items())
        touches = np.isfinite(w) & (w > 0)
        cells = (CELLS // 2, CELLS)
        largest, along, across, _ = scipy.stats.binned_statistic_2d(
            z[touches], x[touches], w[touches], "max", cells
        )
        # cells without a sample are interpolated from their neighbours, or NaN at the border
        largest = filled(largest)
        mapped = ax.pcolormesh(across, along, largest, cmap=SEQUENTIAL_MAP, shading="flat")
        planet = int(of_flank["flank_planet"])
        ax.set_title(f"{title}, planet {planet}: largest {np.nanmax(largest):.4g} N/mm")
        ax.set_xlabel("path coordinate, planet's root to its tip (mm)")
        ax.set_ylabel("along the face (mm)")
        ax.grid(visible=False)
        figure.colorbar(mapped, ax=ax, label="line load (N/mm)", pad=0.01)
    return figure


@styled
def misalignment_chart(data: xr.Dataset) -> Figure:
    """Misalignment (µm over the face) of every gear mesh by cause and planet: mean of all positions
    with the range from least to largest; on the right the sum of all causes."""
    figure, rows = _rows(data, 52)
    for ax, title, flanks in rows:
        causes = misalignment_by_cause(data.sel(flank=flanks)) * MICRO
        total = causes.sum("cause", skipna=False).assign_coords(cause="all together")
        bars = xr.concat([causes, total], "cause")
        width = 0.8 / len(flanks)
        for k, name in enumerate(flanks):
            size = bars.sel(flank=name)
            mean = size.mean("position").to_numpy()
            ends = [mean - size.min("position").to_numpy(), size.max("position").to_numpy() - mean]
            planet = int(data["flank_planet"].sel(flank=name))
            at = np.arange(len(mean)) + width * (k - 0.5 * (len(flanks) - 1))
            ax.bar(at, mean, width, color=planet_colour(planet), label=f"planet {planet}")
            ax.errorbar(at, mean, np.array(ends), fmt="none", ecolor=NEUTRAL, elinewidth=0.7)
        ax.axhline(0.0, color=NEUTRAL, lw=0.7)
        ax.set_xticks(range(bars.sizes["cause"]), [str(c) for c in bars["cause"].to_numpy()])
        ax.grid(visible=False, axis="x")
        ax.set_title(title)
        ax.set_ylabel("closer at +z than at −z (µm)")
    legend_of(figure)
    return figure


COLUMNS = 8
GAP = 0.12  # between flanks, of their size


@styled
def tooth_rows_chart(pattern: ToothPattern) -> Figure:
    """Largest line load (N/mm) on the flank of every tooth, over face (across) and diameter
    (upwards), in numbered rows from the top; the first flank of the last row has the scales."""
    teeth = len(pattern.line_load)
    columns = min(COLUMNS, teeth)
    rows = math.ceil(teeth / columns)
    figure = new_figure(28 + 14 * rows)
    ax = figure.subplots()
    load = pattern.line_load * N_PER_MM
    largest = float(np.nanmax(load))
    across, upward = (
        (edges - edges[0]) / (edges[-1] - edges[0]) for edges in (pattern.face, pattern.diameter)
    )
    for tooth, cells in enumerate(load):
        x, y = (tooth % columns) * (1 + GAP), (rows - 1 - tooth // columns) * (1 + 3 * GAP)
        mapped = ax.pcolormesh(
            x + across, y + upward, cells, cmap=SEQUENTIAL_MAP, vmin=0.0, vmax=largest
        )
        ax.text(x, y + 1.01, str(tooth + 1), fontsize=5.5, color=NEUTRAL, va="bottom")
    ends = [f"{MILLI * edge:.4g}".replace("-", "−") for edge in (pattern.face[0], pattern.face[-1])]
    ax.set_xticks([0.0, 1.0], ends)
    ax.set_yticks([0.0, 1.0], [f"{MILLI * d:.4g}" for d in pattern.diameter[[0, -1]]])
    ax.set_xlabel("along the face, −z to +z (mm)", loc="left")
    ax.set_ylabel("diameter (mm)", loc="bottom")
    ax.set_xlim(-GAP, columns * (1 + GAP))
    ax.set_ylim(-GAP, rows * (1 + 3 * GAP))
    ax.grid(visible=False)
    for spine in ax.spines.values():
        spine.set_visible(False)
    ax.set_title(f"{pattern.title}, {teeth} teeth: largest {largest:.4g} N/mm")
    figure.colorbar(mapped, ax=ax, label="largest line load (N/mm)", pad=0.01)
    return figure


TOOTH = "#333333"
SIDES = {"-theta": "−θ", "+theta": "+θ"}


@styled
def root_stress_chart(data: xr.Dataset, stage: str) -> Figure:
    """Root stress (MPa) of each gear of a stage.

    Left: largest stress in the loaded fillets of planet 1's gear meshes over the rotation of the
    reference member; thin lines: least stress in the opposite fillets of these teeth; for an FE
    ring also the largest stress in both fillets of its first tooth. Right: along the face at the
    position of the largest stress, for every planet.
    """
    gears = dict(gears_of(data, stage))
    figure, axes = panels(len(gears), 2, height_mm=26 + 46 * len(gears), sharex="col", sharey="row")
    turn = np.degrees(data["input_angle"].to_numpy()[:, 0])
    for (left, right), (gear, of_gear) in zip(axes, gears.items(), strict=True):
        for k in range(of_gear.sizes["flank"]):
            of_flank = of_gear.isel(flank=k)
            planet, kind = int(of_flank["flank_planet"]), str(of_flank["flank_kind"].item())
            dashed = gear == "planet" and kind == "sun"
            look = {"color": planet_colour(planet), "ls": "--" if dashed else "-"}
            if planet == 1:
                title = f"planet with the {kind}" if gear == "planet" else None
                compression = of_flank["face_root_compression"].min("face")
                for stress, width in ((of_flank["root_stress"], 0.9), (compression, 0.4)):
                    left.plot(turn, stress * MEGA, lw=width, label=title, **look)
            worst = int(np.nanargmax(of_flank["root_stress"].to_numpy()))
            at = of_flank.isel(position=worst)
            label = f"planet {planet}" if kind in (gear, "ring") else None
            for name, width in (("face_root_stress", 0.9), ("face_root_compression", 0.4)):
                right.plot(of_flank["face"], at[name] * MEGA, lw=width, label=label, **look)
        if gear == "ring" and "tooth_root_stress" in of_gear:
            _first_tooth(left, turn, of_gear, stage)
        left.set_title(f"{gear}: largest {float(of_gear['root_stress'].max()) * MEGA:.0f} MPa")
        left.set_ylabel("root stress (MPa)")
        for ax in (left, right):
            ax.axhline(0.0, color=NEUTRAL, lw=0.5, zorder=1)
    axes[-1, 0].set_xlabel("rotation of the reference member (°)")
    axes[-1, 1].set_xlabel(ALONG_FACE)
    legend_of(figure, 4)
    return figure


def _first_tooth(ax: Axes, turn: Any, of_gear: xr.Dataset, stage: str) -> None:
    """Draw the root stress of the first tooth of an FE ring over its rotation, by fillet."""
    first = int(np.argmax(of_gear["tooth_stage"].to_numpy() == stage))
    for fillet, style in zip(of_gear["fillet"].to_numpy(), ("-", ":"), strict=True):
        stress = of_gear["tooth_root_stress"].isel(tooth=first).sel(fillet=fillet) * MEGA
        ax.plot(
            turn,
            stress,
            style,
            color=TOOTH,
            lw=0.8,
            label=f"ring tooth 1, fillet at {SIDES[str(fillet)]}",
        )


PHASE = "gear-mesh cycle (–)"
STATES = (
    ("transmission_error", "under load", ORIGINAL_COLOUR),
    ("unloaded_transmission_error", "unloaded", SPLIT_COLOUR),
)


@styled
def transmission_error_chart(data: xr.Dataset) -> Figure:
    """Transmission error of planet 1 about its mean over a gear-mesh cycle, µm along the line of
    action, and its amplitudes by order of the gear mesh; under load and unloaded."""
    figure, rows = _rows(data, 52, 2, width_ratios=[3, 2])
    first = data.isel(position=data["gear_mesh_phase"].to_numpy() < 1.0 - 1e-9)
    for (left, right), title, (name, *_) in rows:
        notes = []
        for k, (error, state, colour) in enumerate(STATES):
            values = first[error].sel(flank=name).to_numpy() * MICRO
            middle, half = np.round([values.mean(), 0.5 * np.ptp(values)], 4)  # to 0.1 nm
            span = f"{number(middle)} ± {number(half, 3)}"
            notes.append(f"{span.replace('-', '−')} µm {state}")
            phase = first["gear_mesh_phase"].to_numpy()
            left.plot(phase, values - values.mean(), color=colour, label=state)
            orders = data["gear_mesh_order"].to_numpy()
            amplitude = data[f"{error}_order"].sel(flank=name).to_numpy() * MICRO
            right.bar(orders + 0.4 * (k - 0.5), amplitude, 0.4, color=colour, label=state)
        planet = int(data["flank_planet"].sel(flank=name))
        left.set_title(f"{title}, planet {planet}: mean " + "; ".join(notes))
        left.set(xlabel=PHASE, ylabel="less its mean (µm)", xlim=(0.0, 1.0))
        right.set(xlabel="order of the gear mesh (–)", ylabel="amplitude (µm)")
        right.set_xticks(orders[:: max(1, len(orders) // 10)])
    legend_of(figure)
    return figure


@styled
def stiffness_chart(data: xr.Dataset) -> Figure:
    """Stiffness of every gear mesh (N/µm along the line of action) over a gear-mesh cycle."""
    figure, rows = _rows(data, 48, sharex=True)
    first = data.isel(position=data["gear_mesh_phase"].to_numpy() < 1.0 - 1e-9)
    for ax, title, flanks in rows:
        for name in flanks:
            planet = int(data["flank_planet"].sel(flank=name))
            stiffness = first["gear_mesh_stiffness"].sel(flank=name) * N_PER_M_TO_N_PER_UM
            label = f"planet {planet}"
            ax.plot(first["gear_mesh_phase"], stiffness, color=planet_colour(planet), label=label)
        mean = float(data["gear_mesh_stiffness"].sel(flank=flanks).mean()) * N_PER_M_TO_N_PER_UM
        ax.set_title(f"{title}: mean {mean:,.0f} N/µm".replace(",", "\u2009"))
        ax.set(ylabel="N/µm", xlim=(0.0, 1.0))
    figure.axes[-1].set_xlabel(PHASE)
    legend_of(figure)
    return figure
