"""Statistics of samples that assume no distribution: quantiles, mean and their intervals."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import bdtr, betaincinv, stdtrit

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Estimate:
    """A value and the ends of its confidence interval, NaN where there are too few samples."""

    value: float
    low: float
    high: float


def quantile_ranks(count: int, share: float, confidence: float) -> tuple[int, int]:
    """Ranks l < u, from 1, with P(X_(l) ≤ Q ≤ X_(u)) ≥ confidence for the quantile Q of ``share``.

    The number of samples below Q is binomial whatever their distribution (David & Nagaraja 2003,
    Order Statistics, §7.1). Each side keeps half the risk; l = 0 and u = count + 1 say that there
    are too few samples for an end.
    """
    risk = 0.5 * (1 - confidence)
    below = bdtr(np.arange(count, dtype=float), count, share)  # P(at most k samples below Q)
    low = int(np.searchsorted(below, risk, side="right"))
    high = int(np.searchsorted(below, 1 - risk, side="left")) + 1
    return low, high


def quantile(samples: ArrayLike, share: float, confidence: float = 0.95) -> Estimate:
    """Quantile of samples (n,), median-unbiased, with the interval of its order statistics."""
    x = np.sort(np.asarray(samples, dtype=float))
    if not len(x):
        return Estimate(math.nan, math.nan, math.nan)
    low, high = quantile_ranks(len(x), share, confidence)
    return Estimate(
        float(np.quantile(x, share, method="median_unbiased")),
        float(x[low - 1]) if low >= 1 else math.nan,
        float(x[high - 1]) if high <= len(x) else math.nan,
    )


def mean(samples: ArrayLike, confidence: float = 0.95) -> Estimate:
    """Mean of samples (n,) with Student's interval x̄ ± t s/√n."""
    x = np.asarray(samples, dtype=float)
    if len(x) < 2:
        return Estimate(float(x.mean()) if len(x) else math.nan, math.nan, math.nan)
    reach = stdtrit(len(x) - 1, 0.5 * (1 + confidence)) * x.std(ddof=1) / math.sqrt(len(x))
    return Estimate(float(x.mean()), float(x.mean() - reach), float(x.mean() + reach))


def share_above(samples: ArrayLike, limit: float, confidence: float = 0.95) -> Estimate:
    """Share of all parts above a limit, with the interval of Clopper & Pearson (1934)."""
    x = np.asarray(samples, dtype=float)
    low, high = share_interval(np.array([np.sum(x > limit)]), len(x), confidence)
    return Estimate(
        float(np.mean(x > limit)) if len(x) else math.nan, float(low[0]), float(high[0])
    )


def distribution_band(count: int, confidence: float = 0.95) -> tuple[Array, Array]:
    """Ends (n,) of the interval, point by point, of the distribution behind n rising samples."""
    return share_interval(np.arange(1, count + 1), count, confidence)


def share_interval(successes: Array | NDArray[np.int64], count: int, confidence: float
                   ) -> tuple[Array, Array]:  # fmt: skip
    """Interval of a share of which ``successes`` out of ``count`` samples were seen."""
    risk, k = 0.5 * (1 - confidence), np.asarray(successes, dtype=float)
    low = np.where(k > 0, betaincinv(np.maximum(k, 1), count - k + 1, risk), 0.0)
    high = np.where(k < count, betaincinv(k + 1, np.maximum(count - k, 1), 1 - risk), 1.0)
    return np.asarray(low), np.asarray(high)
