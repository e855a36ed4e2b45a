"""Load duration: torque over the turns that exceed it, of bins and of the samples behind them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from flexgear.arrays import Array
from flexgear.gears.load_bins import LoadBin
from flexgear.results.report.wording import words
from flexgear.solve.load_series import SeriesBins
from flexgear.views.style import DEFORMED_COLOUR, KILO, NEUTRAL, PLANET_COLOURS, panels, styled


@styled
def load_duration_chart(
    bins: Sequence[LoadBin], member: str, samples: SeriesBins | None = None
) -> Figure:
    """Torque (kN m) at a port over the turns of its member in which it is at least as large.

    Bins are steps, extreme ones triangles at the left edge, the samples of series a line.
    """
    lasting = [b for b in bins if not b.extreme]
    turns = np.array([b.turns(b.speed[member]) for b in lasting])
    torque = np.array([b.torque[member] for b in lasting])
    figure, axes = panels(1, 1, height_mm=80)
    ax = axes[0, 0]
    total = float(turns.sum()) or 1.0
    least = max(float(turns[turns > 0.0].min(initial=total)), 1e-9 * total)
    sense = -1.0 if torque.sum() < 0.0 else 1.0  # the largest in the rated sense comes first
    order = np.argsort(-sense * torque)
    edges = np.concatenate([[0.0], np.cumsum(turns[order])])
    ax.stairs(
        KILO * torque[order], np.maximum(edges, 0.5 * least), baseline=0.0, fill=True,
        color=PLANET_COLOURS[0], alpha=0.25, label=f"{len(lasting)} load bins",
    )  # fmt: skip
    if samples is not None and samples.duration:
        exceeded, level = _exceedance(samples, sense)
        frequent = exceeded > 0.1 * least
        ax.plot(
            exceeded[frequent],
            KILO * level[frequent],
            color=DEFORMED_COLOUR,
            label="samples of series",
        )
    extreme = [KILO * b.torque[member] for b in bins if b.extreme]
    if extreme:
        ax.plot(
            np.full(len(extreme), 0.5 * least), extreme, ">", color=NEUTRAL, clip_on=False,
            label="extreme loads, without duration",
        )  # fmt: skip
    ax.set_xscale("log")
    ax.set_xlim(0.5 * least, 1.05 * total)
    ax.set_xlabel(f"turns of {words(member)} with at least this torque")
    ax.set_ylabel(f"torque on {words(member)} (kN m)")
    ax.set_title("Load duration")
    ax.legend(loc="lower left")
    return figure


def _exceedance(samples: SeriesBins, sense: float) -> tuple[Array, Array]:
    """Turns in which the torque is at least a level, and the levels, N m, by falling torque."""
    intervals = np.array(sorted(samples.duration, key=lambda k: -sense * k))
    turns = np.array([samples.duration[int(k)] for k in intervals])
    return np.cumsum(turns), (intervals + 0.5) * samples.fine_step
