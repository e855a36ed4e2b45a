"""Which flank of a gear mesh carries, and the tooth pairs there.

Datasets of a flexible stage hold the pairs of both flanks. Under the sense of torque that is rated
the drive flanks carry ("ring_pair_…"), under the other the coast flanks ("ring_coast_pair_…"), and
after a torque reversal each in its turn.
"""

from __future__ import annotations

import xarray as xr

from flexgear.model.errors import FlexgearError

GEARS = ("ring", "sun")
PARTS = ("load", "tooth", "stiffness", "position")


def coast_carries(data: xr.Dataset, gear: str) -> xr.DataArray:
    """True (sample, planet) where the coast flank bears more than the drive flank.

    gear: "ring" or "sun". Nowhere with the linear contact law, which has no coast flanks.
    """
    drive = abs(data[f"{gear}_pair_load"].sum("slot"))
    if f"{gear}_coast_pair_load" not in data:
        return xr.DataArray(drive < 0)
    return xr.DataArray(data[f"{gear}_coast_pair_load"].sum("slot") > drive)


def carrying_pairs(data: xr.Dataset, gear: str) -> xr.Dataset:
    """Pairs of the flank that carries, planet by planet and sample by sample.

    "load" N, "tooth" from 1 (0: none), "stiffness" N/m and "position" m, each (sample, planet,
    slot); those that ``data`` holds. The drive flank's where neither carries.
    """
    if f"{gear}_pair_load" not in data:
        raise FlexgearError(f"the dataset holds no tooth pairs of the {gear}")
    coast = coast_carries(data, gear)
    pairs = {}
    for part in PARTS:
        name, other = f"{gear}_pair_{part}", f"{gear}_coast_pair_{part}"
        if name in data:
            pairs[part] = data[name].where(~coast, data[other]) if other in data else data[name]
    return xr.Dataset(pairs)


def tooth_loads(data: xr.Dataset, gear: str) -> xr.DataArray:
    """Loads of the pairs on the flank that carries, N, flat; slots without a pair are left out."""
    pairs = carrying_pairs(data, gear)
    at = pairs["tooth"].to_numpy() > 0
    return xr.DataArray(pairs["load"].to_numpy()[at], dims="pair", attrs={"units": "N"})


def flank_histories(data: xr.Dataset, gear: str) -> xr.Dataset:
    """Over the samples: "load" of pairs on the flank that carries, N, not a number in slots without
    a pair; "drive" and "coast" (sample, planet), 1 where that flank bears a load."""
    coast, pairs = coast_carries(data, gear), carrying_pairs(data, gear)
    loaded = abs(pairs["load"].sum("slot")) > 0
    carrying = {"drive": (loaded & ~coast) * 1.0, "coast": (loaded & coast) * 1.0}
    return xr.Dataset({"load": pairs["load"].where(pairs["tooth"] > 0), **carrying})


def carrying_flank(data: xr.Dataset, gear: str) -> str:
    """Which flank carries over the samples: "drive", "coast", "drive and coast" or "none"."""
    return flank_names(flank_histories(data, gear))


def flank_names(histories: xr.Dataset) -> str:
    """The same of ``flank_histories`` or of their largest values."""
    return " and ".join(w for w in ("drive", "coast") if bool(histories[w].any())) or "none"
