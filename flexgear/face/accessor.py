"""What every dataset of flexgear has below ``.fg``."""

from __future__ import annotations

import xarray as xr


@xr.register_dataset_accessor("fg")
class Accessor:
    """Pictures of a dataset."""

    def __init__(self, data: xr.Dataset) -> None:
        self._data = data
