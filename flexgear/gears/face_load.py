"""Factors of the load along the face, from line loads of slices.

    K_Hβ = max_z W(z) / mean_z W(z),    W(z): line load at z over a cycle of the gear mesh

(ISO 6336-1: largest and mean load per width). Slices know the load at their middles. Where they are
springs beside each other that converges at first order in their number where the load is uneven: it
is continued to the ends of the line. Teeth give way at the ends of the face, where the load of
slices that bend each other no longer rises, or falls: there it is held, up to the end.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def with_ends(line_load: Array, bent: NDArray[np.bool_] | bool = False) -> Array:
    """Line load (…, K + 2) with its values at both ends, not below zero.

    line_load: (…, K) at the middles of equal slices; bent (…): whether they bend each other, and
    the last load holds up to the end. Continued is the parabola through the three slices at the
    end, or the line through two where the third does not touch.
    """
    w = np.asarray(line_load, dtype=float)
    ends = []
    for own in (w, w[..., ::-1]):
        end = own[..., 0].copy()
        if w.shape[-1] > 1:
            touches = (own[..., 0] > 0) & (own[..., 1] > 0) & ~np.asarray(bent, dtype=bool)
            end += np.where(touches, 0.5 * (own[..., 0] - own[..., 1]), 0.0)
        if w.shape[-1] > 2:
            bend = own[..., 0] - 2 * own[..., 1] + own[..., 2]
            end += np.where(touches & (own[..., 2] > 0), 0.375 * bend, 0.0)
        ends.append(np.maximum(end, 0.0)[..., None])
    return np.concatenate([ends[0], w, ends[1]], axis=-1)


def factor_along(load: Array) -> float:
    """Largest over mean of a line load (F,) at evenly spaced places, the ends of the face included;
    the mean by the trapezoidal rule."""
    return float(load.max() / mean_along(load))


def mean_along(load: Array) -> float:
    """Mean of a line load (F,) at evenly spaced places, the ends of the face included."""
    return float((load[1:] + load[:-1]).sum() / (2 * (len(load) - 1)))
