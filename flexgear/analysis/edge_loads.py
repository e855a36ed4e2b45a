"""Where edges carry: tips off the path of contact, and ends of the face; against the mean.

The mean line load of a gear mesh at an instant is its force over the length along the face that
its contact lines have on the path of contact, touching or not: what even sharing would put
everywhere. Off the path the tip edge of one gear presses on its mate. At an end of the face it is
the slice of a line there, as far as that is on the path.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexgear.analysis.line_loads import LineLoads
from flexgear.coupling.pair_data import PairData
from flexgear.gears.slices import Line, line_ends

Array = NDArray[np.float64]
AT_END = 1e-6  # of half a face: contact lines that end so near its end, end there


class EdgeLoads(NamedTuple):
    """(t, M): mean line load N/m, NaN without load; share of the load off the path, NaN without
    load; largest line load N/m off the path, and in the last slices at the ends of the face."""

    mean: Array
    tip_share: Array
    tip: Array
    end: Array


def edge_loads(pairs: PairData, lines: LineLoads) -> EdgeLoads:
    """Of all gear meshes; 0 of those whose pairs have no slices."""
    low, high = (a[:, None, None] for a in (pairs.path_lo, pairs.path_hi))
    on_path = (lines.path >= low) & (lines.path <= high)
    force, load = np.nan_to_num(lines.force), np.nan_to_num(lines.line_load)
    total, length = force.sum(axis=(2, 3)), _lengths(pairs, lines)
    some = total > 0
    off = np.where(on_path, 0.0, force).sum(axis=(2, 3))
    at_end = np.zeros(load.shape, dtype=bool)
    half = pairs.half_face[:, None] * (1.0 - AT_END)
    at_end[..., 0] = lines.ends[..., 0] <= -half
    last = np.broadcast_to(np.maximum(pairs.slices - 1, 0)[:, None], load.shape[1:3])
    m, slot = np.indices(last.shape)
    at_end[:, m, slot, last] |= lines.ends[..., 1] >= half
    return EdgeLoads(
        mean=np.divide(total, length, out=np.full_like(total, np.nan), where=some & (length > 0)),
        tip_share=np.divide(off, total, out=np.full_like(total, np.nan), where=some),
        tip=np.where(on_path, 0.0, load).max(axis=(2, 3)),
        end=np.where(on_path & at_end, load, 0.0).max(axis=(2, 3)),
    )


def _lengths(pairs: PairData, lines: LineLoads) -> Array:
    """Length (t, M) m along z that contact lines have on the path of contact."""
    length = np.zeros(lines.approach.shape[:2])
    for m in np.flatnonzero(pairs.slices):
        path, slope = (float(pairs.path_lo[m]), float(pairs.path_hi[m])), float(pairs.slope[m])
        s = lines.path[:, m, :, 0] - slope * lines.z[:, m, :, 0]
        start, stop = line_ends(s.ravel(), Line(path, path, slope, float(pairs.half_face[m])))
        length[:, m] = np.nan_to_num(stop - start).reshape(s.shape).sum(axis=1)
    return length
