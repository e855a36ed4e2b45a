"""Stiffness of a whole gear mesh as a periodic wave over one base pitch, and its mean.

x is the share of a base pitch from s = s_lo on; pairs are on the path for s − s_lo ∈ [0, ε p_b]
modulo p_b. With k̄ the mean of the wave and ε_α, ε_β transverse contact and overlap ratio:

    constant      k̄
    rectangular   (k̄/ε_α) n(x),  n(x) pairs on the path
    fourier       k̄ [1 + Σ_{h=1…H} c_h cos 2πh (x − ε_α/2)],
                  c_h = 2 sin(πhε_α)/(πhε_α) · sin(πhε_β)/(πhε_β)

The last is n(x), smeared over the face by the helix: the total length of contact lines of a helical
gear mesh, and the rectangular wave for ε_β = 0. n(x) is ε + Σ 2 sin(πhε)/(πh) cos 2πh(x − ε/2).
Hu et al. 2023, eq. 4 is the same for ε_β = 0 with k_single = k̄/ε_α = k_max − k_min and the origin
in the middle of the stretch with two pairs (1 < ε < 2), which makes the sign (−1)^h; its print has
(−1)^{-1} for that and the carrier's frequency in place of the gear mesh's.

Mean after ISO 6336-1:2006, 9.3.2: c_γ = c' (0.75 ε_α + 0.25) per face width.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
SAMPLES = 1024


def stiffness_wave(
    model: str,
    mean: float,
    contact_ratio: float,
    overlap_ratio: float = 0.0,
    harmonics: int = 5,
    samples: int = SAMPLES,
) -> Array:
    """The wave at x = j/samples, (samples,) N/m, by ``model``; its mean is ``mean``.

    Samples of the rectangular wave are means over cells of 1/samples round x, so that the mean is
    kept whatever the contact ratio. Raises ValueError for a model that is no wave.
    """
    x = np.arange(samples) / samples
    if model == "constant":
        return np.full(samples, mean)
    if model == "rectangular":
        half = 0.5 / samples
        return mean / contact_ratio * pairs_on_path(x - half, x + half, contact_ratio)
    if model == "fourier":
        # more terms than half the samples cannot be told apart
        orders = np.arange(1.0, min(harmonics, (samples - 1) // 2) + 1)
        waves = np.cos(2 * np.pi * np.outer(x - contact_ratio / 2, orders))
        return mean * (1 + waves @ wave_coefficients(contact_ratio, overlap_ratio, orders))
    raise ValueError(f"{model!r} is no stiffness wave")


def pairs_on_path(low: Array, high: Array, contact_ratio: float) -> Array:
    """Number of pairs on the path, averaged over x from ``low`` to ``high``."""
    first = math.floor(-float(np.max(high))) - 1
    last = math.ceil(contact_ratio - float(np.min(low))) + 1
    k = np.arange(first, last + 1)[:, None]
    inside = np.minimum(high + k, contact_ratio) - np.maximum(low + k, 0.0)
    return np.clip(inside, 0.0, None).sum(axis=0) / (high - low)


def wave_coefficients(contact_ratio: float, overlap_ratio: float, orders: Array) -> Array:
    """c_h of the orders h, over the mean; np.sinc(x) is sin(πx)/(πx)."""
    return 2 * np.sinc(orders * contact_ratio) * np.sinc(orders * overlap_ratio)


def iso_mean_stiffness(peak: float, contact_ratio: float, face_width: float) -> float:
    """c_γ b, N/m along the 3D normal; peak: c' per face width along it, N/m².

    ISO gives the factor for ε_α ≥ 1.2 and says that below c_γ may be up to a tenth smaller.
    """
    return peak * (0.75 * contact_ratio + 0.25) * face_width
