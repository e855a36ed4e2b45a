"""The star turning: an animated GIF (or mp4 where imageio-ffmpeg is installed)."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
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

from flexgear.files.atomic import atomic_file
from flexgear.model.errors import FlexgearError
from flexgear.views.star import (
    StageOutline,
    as_positions,
    draw_star,
    square,
    star_exaggeration,
    star_handles,
)
from flexgear.views.style import FloatArray, factor_text, panels, styled

Progress = Callable[[int, int], None]


def star_frames(
    field: FloatArray, angles: FloatArray, outline: StageOutline, factor: float, dpi: float
) -> Iterator[NDArray[np.uint8]]:
    """RGB pictures (h, w, 3), one a position; the axes stay put from frame to frame."""
    largest = factor * float(np.nanmax(np.hypot(field[..., 0], field[..., 1]), initial=0.0))
    reach = outline.ring_radius + max(largest, 0.03 * outline.ring_radius) * 1.15
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
    axes: Axes, displacement: FloatArray, angle: float, outline: StageOutline, factor: float
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
    displacement: FloatArray,
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
    displacement: FloatArray,
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
    displacement: xr.DataArray | FloatArray,
    carrier_angles: Sequence[float] | FloatArray,
    outline: StageOutline,
    path: str | os.PathLike[str],
    exaggeration: float | None = None,
    frames_per_second: float = 20.0,
    dpi: float = 120.0,
    progress: Progress | None = None,
) -> Path:
    """Write the turning star atomically as .gif (or .mp4) and return the path.

    ``displacement`` (p, z, 3) m at ``carrier_angles`` (p,) rad, one frame each; the clip loops,
    so leave out the last position where it equals the first. ``progress(done, total)`` is called
    after every frame.
    """
    target = Path(path)
    kind = target.suffix.lower()
    if kind not in (".gif", ".mp4"):
        raise FlexgearError(f"cannot write animation {target}: use the suffix .gif or .mp4")
    if kind == ".mp4" and not video_available():
        raise FlexgearError(
            f"cannot write animation {target}: install imageio-ffmpeg (pip install imageio-ffmpeg)"
            " or use the suffix .gif"
        )
    field, angles = as_positions(displacement, carrier_angles)
    factor = exaggeration or star_exaggeration(field, outline.ring_radius)
    pictures = star_frames(field, angles, outline, factor, dpi)
    reported = report_progress(pictures, angles.size, progress)
    with atomic_file(target) as temporary:
        if kind == ".gif":
            write_gif(reported, temporary, frames_per_second)
        else:
            write_video(reported, temporary, frames_per_second)
    return target


def report_progress(
    pictures: Iterator[NDArray[np.uint8]], total: int, progress: Progress | None
) -> Iterator[NDArray[np.uint8]]:
    for k, picture in enumerate(pictures):
        yield picture
        if progress is not None:
            progress(k + 1, total)


def write_gif(pictures: Iterator[NDArray[np.uint8]], path: Path, frames_per_second: float) -> None:
    """GIF with one palette for all frames (no flicker)."""
    first = Image.fromarray(next(pictures)).quantize(128, dither=Image.Dither.NONE)

    def others() -> Iterator[Image.Image]:
        for picture in pictures:
            yield Image.fromarray(picture).quantize(palette=first, dither=Image.Dither.NONE)

    first.save(
        path,
        format="GIF",
        save_all=True,
        append_images=others(),
        duration=round(1000 / frames_per_second),
        loop=0,
        optimize=False,
    )


def video_available() -> bool:
    """True where imageio-ffmpeg is installed."""
    try:
        import imageio_ffmpeg  # type: ignore[import-not-found]
    except ImportError:
        return False
    return bool(imageio_ffmpeg)


def write_video(
    pictures: Iterator[NDArray[np.uint8]], path: Path, frames_per_second: float
) -> None:
    """H.264 video, sides cut to even numbers of pixels as the codec demands."""
    import imageio_ffmpeg  # type: ignore[import-not-found]

    first = even(next(pictures))
    writer = imageio_ffmpeg.write_frames(
        str(path), (first.shape[1], first.shape[0]), fps=frames_per_second, macro_block_size=2
    )
    writer.send(None)
    try:
        writer.send(first)
        for picture in pictures:
            writer.send(even(picture))
    finally:
        writer.close()


def even(picture: NDArray[np.uint8]) -> NDArray[np.uint8]:
    rows, columns = (n - n % 2 for n in picture.shape[:2])
    return np.ascontiguousarray(picture[:rows, :columns])
