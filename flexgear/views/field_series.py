"""Fields over time for ParaView: one .vtu a sample and the .pvd that names them."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import xarray as xr

from flexgear.files.atomic import PathLike, staged_folder
from flexgear.model.errors import FlexgearError
from flexgear.views.render import field_grid

SERIES = "series.pvd"


def save_series(fields: Mapping[float, xr.Dataset], folder: PathLike) -> Path:
    """Write fields (``deformed``, ``mode_field``) by time (s) into a folder; the .pvd's path.

    Point data as of ``field_grid``. The folder appears whole or stays as it was. FlexgearError
    where there is no field.
    """
    if not fields:
        raise FlexgearError("a series needs one field or more")
    root = ElementTree.Element("VTKFile", type="Collection", version="0.1")
    collection = ElementTree.SubElement(root, "Collection")
    digits = len(str(len(fields) - 1))
    with staged_folder(folder) as stage:
        for number, (time, field) in enumerate(fields.items()):
            name = f"field_{number:0{digits}d}.vtu"
            field_grid(field).save(stage / name)
            ElementTree.SubElement(collection, "DataSet", timestep=repr(float(time)), file=name)
        ElementTree.indent(root)
        text = ElementTree.tostring(root, encoding="utf-8", xml_declaration=True)
        (stage / SERIES).write_bytes(text)
    return Path(folder) / SERIES


def swing(field: xr.Dataset, frames: int = 24) -> dict[float, xr.Dataset]:
    """A mode's field (``mode_field``) over one period by time, s: u cos 2π f t, and its stress.

    A rigid motion, which has no period, takes one second.
    """
    period = 1.0 / field.attrs["frequency"] if field.attrs["frequency"] > 0 else 1.0
    phases = np.arange(frames) / frames
    return {float(share * period): _at_phase(field, float(share)) for share in phases}


def _at_phase(field: xr.Dataset, share: float) -> xr.Dataset:
    factor = float(np.cos(2 * np.pi * share))
    scales = {"displacement": factor, "stress": factor, "von_mises_stress": abs(factor)}
    moved = {name: field[name].copy(data=k * field[name]) for name, k in scales.items()}
    return field.assign(moved)
