"""Files of fields over time for ParaView: a .vtu for each time, and a .pvd."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import xarray as xr

from flexgear.files.atomic import PathLike, staged_folder
from flexgear.model.arguments import Count
from flexgear.model.errors import FlexgearError, InputError
from flexgear.views.render import field_grid

SERIES = "series.pvd"


def save_series(fields: Mapping[float, xr.Dataset], folder: PathLike) -> Path:
    """Write fields (``deformed``, ``mode_field``) by time (s); returns the path for ParaView.

    folder: for a .vtu of each field, and the .pvd that names them with their times. Point data as
    of ``field_grid``. Files are replaced only when all are written. FlexgearError without fields.
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


def swing(field: xr.Dataset, frames: Count = 24) -> dict[float, xr.Dataset]:
    """Fields of a natural mode (``mode_field``) over one period by time t, s: displacement
    u cos 2π f t and its stress; a rigid motion takes one second. InputError for another field."""
    if "frequency" not in field.attrs:
        raise InputError("--field", "dataset", "is no natural mode", "give one of mode_field()")
    period = 1.0 / field.attrs["frequency"] if field.attrs["frequency"] > 0 else 1.0
    phases = np.arange(frames) / frames
    return {float(share * period): _at_phase(field, float(share)) for share in phases}


def _at_phase(field: xr.Dataset, share: float) -> xr.Dataset:
    factor = float(np.cos(2 * np.pi * share))
    scales = {"displacement": factor, "stress": factor, "von_mises_stress": abs(factor)}
    scaled = {name: field[name].copy(data=k * field[name]) for name, k in scales.items()}
    return field.assign(scaled)
