"""Displacements over time or carrier angle: tooth nodes, sun, planets (Figures 13–16, 20–22)."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from flexgear.model.errors import FlexgearError
from flexgear.model.names import MemberName
from flexgear.results.stage_part import displacement_of
from flexgear.views.dense import draw, say_envelope
from flexgear.views.histories import finish, layer
from flexgear.views.loads import finish_x
from flexgear.views.select import (
    Runs,
    Window,
    abscissa,
    as_runs,
    leading_dim,
    planet_count,
    thinned,
    variable,
    windowed,
)
from flexgear.views.style import (
    DIVERGING_MAP,
    MICRO,
    NEUTRAL,
    FloatArray,
    panels,
    styled,
    variant_colours,
)

AXES = ("x", "y", "z")


@styled
def three_directions(
    runs: Mapping[str, xr.Dataset],
    pick: Callable[[xr.Dataset], FloatArray],
    title: str,
    directions: tuple[str, str, str],
    x: str,
    mark_peaks: bool,
) -> Figure:
    """One panel a direction (µm) with every variant; ``pick`` gives (n, 3) in m."""
    colours = variant_colours(runs)
    figure, axes = panels(3, 1, height_mm=132, sharex=True)
    for i, (name, dataset) in enumerate(runs.items()):
        at, values = abscissa(dataset, x), pick(dataset) * MICRO
        for k, ax in enumerate(axes[:, 0]):
            if draw(ax, at, values[:, k], colours[name], **layer(i)):
                say_envelope(ax)
            if mark_peaks and i == 0 and np.isfinite(values[:, k]).any():
                peak = float(values[np.nanargmax(np.abs(values[:, k])), k])
                ax.set_title(
                    f"{directions[k]}: largest {signed(peak)} µm ({name})",
                    weight="normal",
                    fontsize=8,
                )
    for k, ax in enumerate(axes[:, 0]):
        ax.axhline(0, color=NEUTRAL, lw=0.6, zorder=1)
        ax.set_ylabel(f"{directions[k]} (µm)")
    figure.suptitle(title, fontsize=9.5, weight="bold")
    figure.align_ylabels(axes[:, 0])
    finish(figure, axes[-1, 0], runs, x)
    return figure


def signed(value: float) -> str:
    return f"{value:.3g}".replace("-", "−")


def cut(runs: Runs, x: str, window: Window | None) -> dict[str, xr.Dataset]:
    return {name: windowed(d, x, window) for name, d in as_runs(runs).items()}


def tooth_node_displacement(
    runs: Runs, tooth: int = 1, x: str = "stage_angle", window: Window | None = None
) -> Figure:
    """X, Y, Z displacement of ring tooth node ``tooth`` (1-based), global (Figures 16, 22)."""

    def pick(dataset: xr.Dataset) -> FloatArray:
        field = variable(dataset, "tooth_displacement")
        if not 1 <= tooth <= field.sizes["tooth"]:
            raise FlexgearError(f"cannot draw tooth {tooth}: there are {field.sizes['tooth']}")
        of_tooth = field.isel(tooth=tooth - 1).transpose(leading_dim(dataset), "axis")
        return np.asarray(of_tooth, dtype=float)

    title = f"Displacement of ring tooth node {tooth}"
    return three_directions(cut(runs, x, window), pick, title, ("X", "Y", "Z"), x, True)


def sun_displacement(runs: Runs, x: str = "stage_angle", window: Window | None = None) -> Figure:
    """x, y, z displacement of the sun, carrier axes (Figures 14, 20)."""

    def pick(dataset: xr.Dataset) -> FloatArray:
        field = displacement_of(dataset, "sun").transpose(leading_dim(dataset), "dof")
        return np.asarray(field, dtype=float)[:, :3]

    return three_directions(
        cut(runs, x, window), pick, "Displacement of the sun, axes of the carrier", AXES, x, True
    )


def relative_planet_motion(
    dataset: xr.Dataset, planet: int, center_distance: float | None
) -> FloatArray:
    """(n, 3) motion of a planet, its axes; less R_c θ_z of the drive node if R_c is given."""
    dim = leading_dim(dataset)
    field = displacement_of(dataset, "planet")
    if not 1 <= planet <= field.sizes["body"]:
        raise FlexgearError(f"cannot draw planet {planet}: there are {field.sizes['body']}")
    motion = np.array(field.isel(body=planet - 1).transpose(dim, "dof"), dtype=float)[:, :3]
    if center_distance is not None:
        nodes = [MemberName.parse(n).part for n in variable(dataset, "carrier_node").values]
        if "drive" not in nodes:
            raise FlexgearError("cannot draw: carrier_displacement has no node 'drive'")
        carrier = variable(dataset, "carrier_displacement").isel(carrier_node=nodes.index("drive"))
        motion[:, 1] -= center_distance * np.asarray(carrier.transpose(dim, "dof"))[:, 5]
    return motion


def planet_displacement(
    runs: Runs,
    planet: int = 1,
    x: str = "stage_angle",
    window: Window | None = None,
    center_distance: float | None = None,
) -> Figure:
    """Radial, tangential and axial displacement of a planet (Figures 15, 21).

    Give ``center_distance`` (m) where the dataset's displacements are absolute: the tangential
    motion R_c θ_z that comes from the rotation of the carrier's drive node is then taken out.
    """
    return three_directions(
        cut(runs, x, window),
        lambda dataset: relative_planet_motion(dataset, planet, center_distance),
        f"Displacement of planet {planet}, its own axes",
        ("x, radial", "y, tangential", "z, axial"),
        x,
        True,
    )


@styled
def tooth_displacement_map(
    dataset: xr.Dataset,
    axis: str = "x",
    x: str = "stage_angle",
    window: Window | None = None,
    samples: int = 1500,
) -> Figure:
    """Displacement of all tooth nodes along ``axis`` as a map over carrier angle (Figure 13)."""
    if axis not in AXES:
        raise FlexgearError(f"cannot draw axis '{axis}': choose x, y or z")
    dataset = thinned(windowed(dataset, x, window), samples)
    field = variable(dataset, "tooth_displacement").isel(axis=AXES.index(axis))
    image = np.asarray(field.transpose("tooth", leading_dim(dataset)), dtype=float) * MICRO
    at = abscissa(dataset, x)
    limit = float(np.nanmax(np.abs(image), initial=1e-12))
    figure, axes = panels(1, 1, height_mm=92)
    ax = axes[0, 0]
    mapped = ax.pcolormesh(
        at,
        np.arange(1, image.shape[0] + 1),
        image,
        cmap=DIVERGING_MAP,
        vmin=-limit,
        vmax=limit,
        shading="nearest",
        rasterized=True,
    )
    ax.grid(False)
    ax.set_ylabel("ring tooth number")
    ax.set_title(f"{axis.upper()} displacement of the {image.shape[0]} ring tooth nodes")
    figure.colorbar(mapped, ax=ax, label=f"{axis.upper()} displacement (µm)", pad=0.01)
    finish_x(ax, x, planet_count(dataset), at[0], at[-1])
    return figure
