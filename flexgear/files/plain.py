"""Results as plain values, which files of text can hold."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from flexgear.model.errors import FlexgearError


def plain(value: Any) -> Any:
    """Mappings, lists, text and Python numbers only, from numpy and xarray values."""
    if isinstance(value, Mapping):
        return {str(k): plain(v) for k, v in value.items()}
    if hasattr(value, "to_numpy"):
        value = value.to_numpy()
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, (list, tuple)):
        return [plain(v) for v in value]
    if value is None or isinstance(value, (str, bool, int, float)):
        return value
    raise FlexgearError(f"a summary cannot hold a {type(value).__name__}")
