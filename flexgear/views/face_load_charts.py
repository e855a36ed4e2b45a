"""Load along the face: curves with their factor, maps over the flank, what misaligns it.

Datasets are those of equilibria whose pairs have slices: ``face_line_load``, ``line_load`` with
``slice_position`` and ``slice_path``, ``gear_mesh_misalignment_by_cause`` by flank.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from scipy.interpolate import griddata

from flexgear.gears.face_load import factor_along, mean_along
from flexgear.model.names import FlankName
from flexgear.views.style import (
    MICRO,
    NEUTRAL,
    SEQUENTIAL_MAP,
    FloatArray,
    panels,
    planet_colour,
    styled,
)

N_PER_MM = 1e-3  # N/m -> N/mm
MILLI = 1e3  # m -> mm
ALONG_FACE = "along the face over its width, −z to +z (–)"
CELLS = 60  # of a map along the path and along the face


@styled
def along_face_chart(data: xr.Dataset) -> Figure:
    """Line load of a gear mesh (N/mm) along the face in the mean of all positions, by planet."""
    groups = dict(carrying(data))
    figure, axes = panels(len(groups), 1, height_mm=12 + 48 * len(groups), sharex=True)
    at = data["face"].to_numpy()
    for ax, (title, flanks) in zip(axes[:, 0], groups.items(), strict=True):
        factors = []
        for name in flanks:
            of_flank = data.sel(flank=name)
            load = of_flank["face_line_load"].mean("position").to_numpy() * N_PER_MM
            mean = mean_along(load)
            factors.append(factor_along(load, float(of_flank["face_section"])))
            planet = int(of_flank["flank_planet"])
            ax.plot(at, load, color=planet_colour(planet), label=f"planet {planet}")
            ax.axhline(mean, color=NEUTRAL, lw=0.5, zorder=1)
        least, most = min(factors), max(factors)
        span = f"{least:.3f}" if most - least < 5e-4 else f"{least:.3f} to {most:.3f}"
        ax.set_title(f"{title}: $K_{{Hβ}}$ {span}")
        ax.set_ylabel("line load (N/mm)")
        ax.set(ylim=(0.0, None), xlim=(-0.5, 0.5))
    axes[-1, 0].set_xlabel(ALONG_FACE)
    legend(figure, axes)
    return figure


@styled
def before_and_after(before: xr.Dataset, after: xr.Dataset) -> Figure:
    """Line load (N/mm) along the face in the mean of all positions, planet 1, of two sets of
    flanks."""
    groups = {title: flanks[0] for title, flanks in carrying(before)}
    figure, axes = panels(len(groups), 1, height_mm=12 + 48 * len(groups), sharex=True)
    for ax, (title, name) in zip(axes[:, 0], groups.items(), strict=True):
        for data, style, label in ((before, "--", "before"), (after, "-", "after")):
            load = data["face_line_load"].sel(flank=name).mean("position").to_numpy() * N_PER_MM
            ax.plot(data["face"], load, style, color=planet_colour(1), label=label)
        ax.set_title(f"{title}, planet {int(before.sel(flank=name)['flank_planet'])}")
        ax.set_ylabel("line load (N/mm)")
        ax.set(ylim=(0.0, None), xlim=(-0.5, 0.5))
    axes[-1, 0].set_xlabel(ALONG_FACE)
    legend(figure, axes)
    return figure


@styled
def contact_pattern(data: xr.Dataset) -> Figure:
    """Largest line load (N/mm) at every place of the flanks over all positions: of planet 1 with
    ring and sun, over path of contact and face."""
    groups = {title: flanks[0] for title, flanks in carrying(data)}
    figure, axes = panels(len(groups), 1, height_mm=12 + 62 * len(groups))
    for ax, (title, name) in zip(axes[:, 0], groups.items(), strict=True):
        of_flank = data.sel(flank=name)
        x, z, w = (
            of_flank[n].to_numpy().ravel() * scale
            for n, scale in (
                ("slice_path", MILLI),
                ("slice_position", MILLI),
                ("line_load", N_PER_MM),
            )
        )
        touches = np.isfinite(w) & (w > 0)
        across, along, largest = _binned(x[touches], z[touches], w[touches])
        shown = ax.pcolormesh(across, along, largest, cmap=SEQUENTIAL_MAP, shading="flat")
        ax.set_title(
            f"{title}, planet {int(of_flank['flank_planet'])}: "
            f"largest {np.nanmax(largest):.4g} N/mm"
        )
        ax.set_xlabel("path coordinate, planet's root to its tip (mm)")
        ax.set_ylabel("along the face (mm)")
        ax.grid(visible=False)
        figure.colorbar(shown, ax=ax, label="line load (N/mm)", pad=0.01)
    return figure


@styled
def misalignment_chart(data: xr.Dataset) -> Figure:
    """Misalignment (µm over the face) of every gear mesh by what causes it, by planet: mean of all
    positions, and from least to largest; the sum of all of them on the right."""
    groups = dict(carrying(data))
    figure, axes = panels(len(groups), 1, height_mm=14 + 52 * len(groups))
    for ax, (title, flanks) in zip(axes[:, 0], groups.items(), strict=True):
        misalignment = data["gear_mesh_misalignment_by_cause"].sel(flank=flanks) * MICRO
        whole = misalignment.sum("cause", skipna=False).assign_coords(cause="all together")
        causes = misalignment.sel(cause=(misalignment != 0.0).any(["position", "flank"]))
        every = xr.concat([causes, whole], "cause")
        width = 0.8 / len(flanks)
        for k, name in enumerate(flanks):
            size = every.sel(flank=name)
            mean = size.mean("position").to_numpy()
            ends = [mean - size.min("position").to_numpy(), size.max("position").to_numpy() - mean]
            planet = int(data["flank_planet"].sel(flank=name))
            at = np.arange(len(mean)) + width * (k - 0.5 * (len(flanks) - 1))
            ax.bar(at, mean, width, color=planet_colour(planet), label=f"planet {planet}")
            ax.errorbar(at, mean, np.array(ends), fmt="none", ecolor=NEUTRAL, elinewidth=0.7)
        ax.axhline(0.0, color=NEUTRAL, lw=0.7)
        ax.set_xticks(range(every.sizes["cause"]), [str(c) for c in every["cause"].to_numpy()])
        ax.grid(visible=False, axis="x")
        ax.set_title(title)
        ax.set_ylabel("closer at +z than at −z (µm)")
    legend(figure, axes)
    return figure


def carrying(data: xr.Dataset) -> Iterator[tuple[str, list[str]]]:
    """Flanks that carry, by stage, kind and side, in their order."""
    groups: dict[str, list[str]] = {}
    for name in map(FlankName.parse, data["flank"].to_numpy().tolist()):
        if float(data["face_line_load"].sel(flank=name).max()) > 0:
            groups.setdefault(name.group.replace("_", " "), []).append(name)
    yield from groups.items()


def _binned(x: FloatArray, z: FloatArray, w: FloatArray) -> tuple[FloatArray, ...]:
    """Edges of cells along x and z, and the largest w in each; in cells between that had no sample
    from their neighbours, NaN outside."""
    across = np.linspace(x.min(), x.max(), CELLS + 1)
    along = np.linspace(z.min(), z.max(), CELLS // 2 + 1)
    column = np.clip(np.searchsorted(across, x, side="right") - 1, 0, CELLS - 1)
    row = np.clip(np.searchsorted(along, z, side="right") - 1, 0, CELLS // 2 - 1)
    largest = np.full((CELLS // 2, CELLS), np.nan)
    np.fmax.at(largest, (row, column), w)
    there = np.argwhere(np.isfinite(largest))
    every = np.indices(largest.shape).reshape(2, -1).T
    filled = griddata(there, largest[tuple(there.T)], every).reshape(largest.shape)
    return across, along, filled


def legend(figure: Figure, axes: FloatArray) -> None:
    """One legend below all axes, of what the first one shows."""
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=min(len(labels), 6))
