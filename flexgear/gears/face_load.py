"""Factors of the load along the face, from line loads of slices.

    K_Hβ = max_z W(z) / mean_z W(z),    W(z): line load at z over a cycle of the gear mesh

(ISO 6336-1: largest and mean load per width). Slices know the load at their middles; where it is
uneven that converges at first order in their number, so it is continued to the ends of the line.

Springs beside each other have a load at every place. The load of teeth that bend as FE influences
say has not: Hertz's line contact and nodes a module apart tell no change over less than a module,
yet thinner and thinner slices show one, at the ends of the face and at the corner where lines come
in. There the load holds over the last half ``section``, a length of about a module, and W in K_Hβ
is the mean over a section, as in Annex E of ISO 6336-1 (from AGMA 927-A01), which takes the load of
pieces of the face and not of places.
"""

from __future__ import annotations

import numpy as np

from flexgear.arrays import Array


def with_ends(line_load: Array, held: Array | float = 0.0) -> Array:
    """Line load (…, K + 2) with its values at both ends, not below zero.

    line_load: (…, K) at the middles of equal slices; held (…): length up to the end over which the
    load holds, in slices. Continued is the parabola through the three slices at the end, or the
    line through two where the third does not touch; that line, too, where it has not far to go
    because the load holds.
    """
    w, held = np.asarray(line_load, dtype=float), np.asarray(held, dtype=float)
    reach = np.maximum(0.5 - held, 0.0)
    ends = []
    for side in (w, w[..., ::-1]):
        end = side[..., 0].copy()
        if w.shape[-1] > 1:
            touches = (side[..., 0] > 0) & (side[..., 1] > 0)
            end += np.where(touches, reach * (side[..., 0] - side[..., 1]), 0.0)
        if w.shape[-1] > 2:
            bend = side[..., 0] - 2 * side[..., 1] + side[..., 2]
            end += np.where(touches & (side[..., 2] > 0) & (held == 0.0), 0.375 * bend, 0.0)
        ends.append(np.maximum(end, 0.0)[..., None])
    return np.concatenate([ends[0], w, ends[1]], axis=-1)


def factor_along(load: Array, section: float = 0.0) -> float:
    """Largest over mean of a line load (F,) at evenly spaced places, the ends of the face included;
    largest of the means over sections, a share of the face, wherever they lie; linear between the
    places."""
    return float(means_over(load, section).max() / mean_along(load))


def means_over(load: Array, section: float) -> Array:
    """Means of a line load (F,) as in ``factor_along`` over sections that begin or end at one of
    its places; itself where a section has no length."""
    if section <= 0.0:
        return load
    places, steps = np.arange(len(load)), min(section, 1.0) * (len(load) - 1)
    total = np.concatenate([[0.0], np.cumsum(0.5 * (load[1:] + load[:-1]))])

    def up_to(x: Array) -> Array:
        """Integral from the first place to x, in steps."""
        low = np.minimum(x.astype(np.int64), len(load) - 2)
        part = x - low
        return total[low] + part * load[low] + 0.5 * part**2 * (load[low + 1] - load[low])

    last = len(load) - 1.0
    start = np.concatenate([places[places <= last - steps], (places - steps)[places >= steps]])
    return np.asarray((up_to(np.minimum(start + steps, last)) - up_to(start)) / steps)


def mean_along(load: Array) -> float:
    """Mean of a line load (F,) at evenly spaced places, the ends of the face included."""
    return float((load[1:] + load[:-1]).sum() / (2 * (len(load) - 1)))
