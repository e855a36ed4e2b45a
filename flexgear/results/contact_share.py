"""Share of time with n tooth pairs in contact."""

from __future__ import annotations

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike


def contact_share(in_contact: ArrayLike) -> dict[int, float]:
    """{n: share} over all samples and planets; in_contact (..., slots) true for a pair at work.

    Pass ``tooth > 0`` for pairs on the path of contact, ``load > 0`` for pairs that carry load.
    """
    number = np.asarray(in_contact, dtype=bool).sum(axis=-1).ravel()
    if number.size == 0:
        return {}
    count = np.bincount(number)
    return {n: float(c / number.size) for n, c in enumerate(count) if c}


def pairs_in_contact(at_work: xr.DataArray) -> xr.DataArray:
    """1 (…, pairs) where just so many pairs, 0, 1, 2, …, are at work (…, slot): its mean is the
    share of time."""
    number = xr.DataArray(np.arange(at_work.sizes["slot"] + 1), dims="pairs")
    return (at_work.sum("slot") == number) * 1.0


def expected_contact_share(contact_ratio: float) -> dict[int, float]:
    """{n: share} for equally spaced pairs, each in contact over contact_ratio base pitches.

    floor(ε) + 1 pairs for the fraction ε − floor(ε) of a pitch, floor(ε) for the rest.
    """
    low = int(np.floor(contact_ratio))
    more = float(contact_ratio - low)
    return {n: share for n, share in ((low, 1 - more), (low + 1, more)) if share > 0}
