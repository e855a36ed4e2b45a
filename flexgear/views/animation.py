"""The star turning: an animated GIF."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.spines import Spine
from matplotlib.text import Text
from numpy.typing import NDArray
from PIL import Image

from flexgear.arrays import Array
from flexgear.files.atomic import atomic_file
from flexgear.views.star import (
    StageOutline,
    as_positions,
    draw_star,
    square,
    star_exaggeration,
    star_handles,
    star_reach,
)
from flexgear.views.style import factor_text, panels, styled


def star_frames(
    field: Array, angles: Array, outline: StageOutline, factor: float, dpi: float
) -> Iterator[NDArray[np.uint8]]:
    """RGB pictures (h, w, 3), one a position; the axes stay put from frame to frame."""
    reach = star_reach(field, outline, factor)
    figure = star_stage(factor, dpi)
    backdrop = star_backdrop(figure, field[0], float(angles[0]), outline, factor, reach)
    for u, angle in zip(field, angles, strict=True):
        yield star_frame(figure, backdrop, u, float(angle), outline, factor)


@styled
def star_stage(factor: float, dpi: float) -> Figure:
    """The figure that all frames are drawn in."""
    figure, _ = panels(1, 1, height_mm=121, width_mm=105)
    figure.set_dpi(dpi)
    figure.legend(handles=star_handles(), loc="outside lower center", ncols=2)
    figure.suptitle(f"Ring tooth nodes, displacement {factor_text(factor)}", fontsize=9)
    return figure


def place_star(
    axes: Axes, displacement: Array, angle: float, outline: StageOutline, factor: float
) -> list[Artist]:
    """Draw one position instead of the one before; what may move, from the back to the front."""
    for old in (*axes.patches, *axes.lines, *axes.texts):
        old.remove()
    draw_star(axes, displacement, angle, outline, factor)
    axes.set_title(f"$θ_c$ = {np.degrees(angle):.1f}°")
    return sorted(
        (
            artist
            for artist in axes.get_children()
            if isinstance(artist, (Patch, Line2D, Text))
            and not isinstance(artist, Spine)
            and artist is not axes.patch
        ),
        key=Artist.get_zorder,
    )


@styled
def star_backdrop(
    figure: Figure,
    displacement: Array,
    angle: float,
    outline: StageOutline,
    factor: float,
    reach: float,
) -> Any:
    """Pixels of everything but the star, laid out for a first position: drawn once, not per frame.

    The layout is frozen then: nothing may jump.
    """
    axes, canvas = figure.axes[0], agg_canvas(figure)
    moving = place_star(axes, displacement, angle, outline, factor)
    square(axes, reach)
    canvas.draw()
    figure.set_layout_engine("none")
    for artist in moving:
        artist.set_visible(False)
    canvas.draw()
    for artist in moving:
        artist.set_visible(True)
    return canvas.copy_from_bbox(figure.bbox)


@styled
def star_frame(
    figure: Figure,
    backdrop: Any,
    displacement: Array,
    angle: float,
    outline: StageOutline,
    factor: float,
) -> NDArray[np.uint8]:
    """Draw one position onto the backdrop and give its pixels (h, w, 3)."""
    axes, canvas = figure.axes[0], agg_canvas(figure)
    canvas.restore_region(backdrop)
    for artist in place_star(axes, displacement, angle, outline, factor):
        axes.draw_artist(artist)
    return np.asarray(canvas.buffer_rgba())[..., :3].copy()


def agg_canvas(figure: Figure) -> FigureCanvasAgg:
    """The canvas that ``panels`` gave a figure."""
    assert isinstance(figure.canvas, FigureCanvasAgg)
    return figure.canvas


def animate_star(
    displacement: xr.DataArray | Array,
    carrier_angles: Sequence[float] | Array,
    outline: StageOutline,
    path: str | os.PathLike[str],
    frames_per_second: float = 20.0,
    dpi: float = 120.0,
) -> Path:
    """Write the turning star atomically as .gif, with one palette for all frames (no flicker), and
    return the path.

    ``displacement`` (p, z, 3) m at ``carrier_angles`` (p,) rad, one frame each; the clip loops,
    so leave out the last position where it equals the first.
    """
    field, angles = as_positions(displacement, carrier_angles)
    factor = star_exaggeration(field, outline.ring_radius)
    pictures = map(Image.fromarray, star_frames(field, angles, outline, factor, dpi))
    first = next(pictures).quantize(128, dither=Image.Dither.NONE)
    with atomic_file(path) as temporary:
        first.save(
            temporary,
            format="GIF",
            save_all=True,
            append_images=(p.quantize(palette=first, dither=Image.Dither.NONE) for p in pictures),
            duration=round(1000 / frames_per_second),
            loop=0,
            optimize=False,
        )
    return Path(path)
