"""Common style of all pictures: palettes, units, sizes of figures, files.

Figures are built on `matplotlib.figure.Figure` with an Agg canvas; pyplot is never imported and
rcParams change only inside `styled` functions, so a user's own matplotlib session is untouched.

Palettes: planets after Okabe & Ito (2008), variants after P. Tol's "high contrast" and "muted"
schemes (SRON/EPS/TN/09-002); both are safe for the common forms of colour blindness.
"""

import itertools
import os
from collections.abc import Callable, Iterable, Sequence
from fractions import Fraction
from functools import wraps
from io import BytesIO
from math import pi
from pathlib import Path
from typing import Any, Literal, ParamSpec, TypeVar

import matplotlib
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.ticker import FuncFormatter, MaxNLocator, MultipleLocator
from numpy.typing import ArrayLike, NDArray

from flexgear.arrays import Array
from flexgear.files.atomic import atomic_file
from flexgear.model.errors import FlexgearError

P = ParamSpec("P")
R = TypeVar("R")
Share = bool | Literal["none", "all", "row", "col"]

PLANET_COLOURS = (
    "#0072B2", "#E69F00", "#009E73", "#CC79A7", "#D55E00", "#56B4E9", "#8C6D1F", "#444444",
)  # fmt: skip
VARIANT_COLOURS = {"flexible": "#004488", "rigid": "#BB5566"}
OTHER_VARIANTS = ("#117733", "#DDAA33", "#882255", "#44AA99", "#999933", "#AA4499", "#332288")
SPLIT_COLOUR = "#DDAA33"  # loads by stiffness split, eq. 23
ORIGINAL_COLOUR = "#2166AC"  # undeformed outlines
DEFORMED_COLOUR = "#C5221F"  # deformed outlines
NEUTRAL = "#6B7280"
SEQUENTIAL_MAP = "viridis"
DIVERGING_MAP = "RdBu_r"

MICRO = 1e6  # m -> µm, rad -> µrad
MILLI = 1e3  # m -> mm
KILO = 1e-3  # N -> kN
MEGA = 1e-6  # Pa -> MPa
N_PER_M_TO_N_PER_UM = 1e-6  # N/m -> N/µm

FULL_WIDTH_MM = 183.0
PICTURES = ("png", "svg", "pdf")  # that figures are written as
DEFLATE = 3  # level for PNG: files a tenth larger than at 6, in two thirds of the time
RC: Any = {  # its type changes with the version of matplotlib
    "font.family": ["DejaVu Sans"],
    "font.size": 8.5,
    "axes.titlesize": 9.0,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.labelsize": 8.5,
    "axes.linewidth": 0.7,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.formatter.useoffset": False,
    "grid.color": "#E3E5E8",
    "grid.linewidth": 0.6,
    "lines.linewidth": 1.2,
    "lines.solid_capstyle": "round",
    "legend.fontsize": 8.0,
    "legend.frameon": False,
    "xtick.labelsize": 8.0,
    "ytick.labelsize": 8.0,
    "figure.facecolor": "white",
    "figure.dpi": 100.0,
    "savefig.facecolor": "white",
    "svg.fonttype": "none",
    "pdf.fonttype": 42,
    "path.simplify": True,
    "agg.path.chunksize": 20000,
}


def force_scale(forces: ArrayLike) -> tuple[str, float]:
    """Unit of forces (…), N, in a picture, and the factor to it: N where all are below 1 kN."""
    return ("N", 1.0) if np.nanmax(np.abs(forces), initial=0.0) < 1e3 else ("kN", KILO)


def styled(function: Callable[P, R]) -> Callable[P, R]:
    """Run ``function`` under the house style and restore the caller's rcParams afterwards."""

    @wraps(function)
    def wrapper(*args: P.args, **kwargs: P.kwargs) -> R:
        with matplotlib.rc_context(RC):
            return function(*args, **kwargs)

    return wrapper


class NotebookFigure(Figure):
    """A matplotlib figure without pyplot that notebooks show as PNG."""

    def _repr_png_(self) -> bytes:
        picture = BytesIO()
        with matplotlib.rc_context(RC):
            self.savefig(picture, format="png", dpi=110)
        return picture.getvalue()


def new_figure(height_mm: float, width_mm: float = FULL_WIDTH_MM) -> Figure:
    """Empty figure of the given size with an Agg canvas and constrained layout."""
    figure = NotebookFigure(figsize=(width_mm / 25.4, height_mm / 25.4), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def panels(
    rows: int,
    columns: int = 1,
    *,
    height_mm: float,
    width_mm: float = FULL_WIDTH_MM,
    sharex: Share = False,
    sharey: Share = False,
    **gridspec: Any,
) -> tuple[Figure, NDArray[Any]]:
    """Figure with a (rows, columns) array of axes."""
    figure = new_figure(height_mm, width_mm)
    axes = figure.subplots(
        rows, columns, sharex=sharex, sharey=sharey, squeeze=False, gridspec_kw=gridspec or None
    )
    return figure, axes


def text_only(text: str) -> Figure:
    """A figure with a text instead of a chart."""
    figure, axes = panels(1, 1, height_mm=30)
    axes[0, 0].set_axis_off()
    axes[0, 0].text(0.5, 0.5, text, ha="center", va="center", transform=axes[0, 0].transAxes)
    return figure


def legend_of(
    figure: Figure, columns: int = 6, first: Iterable[Artist] = (), least: int = 1
) -> Legend | None:
    """Legend below all axes of the artists ``first`` and all labelled ones, each label once, in at
    most ``columns`` columns, none of them thin; None for fewer than ``least`` entries."""
    by_label = {str(artist.get_label()): artist for artist in first}
    for ax in figure.axes:
        for handle, label in zip(*ax.get_legend_handles_labels(), strict=True):
            by_label.setdefault(label, handle)
    if len(by_label) < least:
        return None
    entries, columns = [*by_label.values()], min(len(by_label), columns)
    legend = figure.legend(handles=entries, loc="outside lower center", ncols=columns)
    for line in legend.get_lines():
        line.set_linewidth(max(1.5, line.get_linewidth()))
    return legend


def labelled_bars(
    axes: Axes,
    sizes: Sequence[float],
    names: Sequence[str],
    texts: Sequence[str],
    colours: Sequence[str],
) -> None:
    """Draw horizontal bars from the top down, each with its name on the left and a text at its
    end, legible on lines of limits."""
    bars = axes.barh(range(len(sizes)), sizes, 0.7, color=colours)
    box = {"facecolor": "white", "edgecolor": "none", "pad": 0.8}
    axes.bar_label(bars, texts, padding=2, fontsize=7.5, bbox=box)
    axes.set_yticks(range(len(sizes)), names)
    axes.set_ylim(len(sizes) - 0.5, -0.5)
    axes.grid(axis="y", visible=False)
    axes.tick_params(axis="y", length=0)


def least_span(axes: Axes, share: float) -> None:
    """Widen the vertical range to at least ``share`` of its middle value, so that rounding of a
    nearly constant quantity does not fill the panel."""
    low, high = axes.get_ylim()
    middle = 0.5 * (low + high)
    half = 0.5 * share * abs(middle)
    if high - low < 2 * half:
        axes.set_ylim(middle - half, middle + half)


def cell_edges(middles: Array) -> Array:
    """Edges (n + 1,) of cells half way between their middles (n,)."""
    if len(middles) == 1:
        return np.array([middles[0] - 0.5, middles[0] + 0.5])
    between = 0.5 * (middles[1:] + middles[:-1])
    return np.concatenate([[2 * middles[0] - between[0]], between, [2 * middles[-1] - between[-1]]])


def planet_colour(planet: int) -> str:
    """Colour of a planet by its number (1-based)."""
    return PLANET_COLOURS[(planet - 1) % len(PLANET_COLOURS)]


def variant_colours(names: Iterable[str]) -> dict[str, str]:
    """Colour of each variant: "flexible" and "rigid" fixed, others in the order given."""
    others = itertools.cycle(OTHER_VARIANTS)
    return {name: VARIANT_COLOURS.get(name) or next(others) for name in dict.fromkeys(names)}


def pi_label(value: float, denominator: int) -> str:
    """``value`` (rad) as a multiple of π/denominator: 1.2566, 5 -> "2π/5"."""
    share = Fraction(round(value * denominator / pi), denominator)
    top, bottom = abs(share.numerator), share.denominator
    if not top:
        return "0"
    head = ("−" if share < 0 else "") + ("π" if top == 1 else f"{top}π")
    return head if bottom == 1 else f"{head}/{bottom}"


def angle_axis(axes: Axes, planets: int) -> None:
    """Set ticks at multiples of the planet spacing 2π/N if the axis shows two to twelve of them."""
    low, high = axes.get_xlim()
    spacing = 2 * pi / max(planets, 1)
    if high - low >= 1.6 * spacing and high - low <= 12.5 * spacing:
        step = spacing if high - low <= 8 * spacing else 2 * spacing
        axes.set_xlim(low, high + (1e-3 * spacing if high % step > 0.999 * step else 0.0))
        axes.xaxis.set_major_locator(MultipleLocator(step))
        axes.xaxis.set_major_formatter(FuncFormatter(lambda v, _: pi_label(v, planets)))
    else:
        axes.xaxis.set_major_locator(MaxNLocator(8))
    axes.set_xlabel("carrier angle $θ_c$ against the ring (rad)")


def nice_number(value: float) -> float:
    """Largest of 1, 2, 5 × 10ⁿ that does not exceed ``value`` (> 0)."""
    if not np.isfinite(value) or value <= 0:
        return 1.0
    decade = 10.0 ** np.floor(np.log10(value))
    for step in (5.0, 2.0):
        if value >= step * decade * (1 - 1e-12):
            return float(step * decade)
    return float(decade)


def factor_text(factor: float) -> str:
    """An exaggeration in words: 2000.0 -> "× 2 000"."""
    return "× " + f"{factor:,.0f}".replace(",", "\u2009") if factor >= 10 else f"× {factor:g}"


@styled
def save_figure(figure: Figure, path: str | os.PathLike[str], dpi: float = 200.0) -> Path:
    """Write ``figure`` atomically as png, svg or pdf (by suffix) and return the path."""
    target = Path(path)
    kind = target.suffix.lower().lstrip(".")
    if kind not in PICTURES:
        raise FlexgearError(f"cannot write picture {target}: use the suffix .png, .svg or .pdf")
    stamp: dict[str, Any] = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}.get(kind, {})
    with atomic_file(target) as temporary:
        if kind == "png":  # savefig would draw twice, first for the layout
            figure.dpi = dpi
            FigureCanvasAgg(figure).print_png(temporary, pil_kwargs={"compress_level": DEFLATE})
        else:
            figure.savefig(temporary, format=kind, dpi=dpi, metadata=stamp)
    return target
