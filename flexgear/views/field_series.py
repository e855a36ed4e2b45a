"""Files of fields over time for ParaView: a .vtu for each time and a .pvd, or one .vtkhdf."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import xarray as xr
from vtkmodules.util.vtkAlgorithm import VTKPythonAlgorithmBase
from vtkmodules.vtkCommonDataModel import vtkUnstructuredGrid
from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline
from vtkmodules.vtkIOHDF import vtkHDFWriter

from flexgear.files.atomic import PathLike, atomic_file, staged_folder
from flexgear.model.arguments import Count
from flexgear.model.errors import FlexgearError, InputError
from flexgear.views.render import field_grid

SERIES = "series.pvd"


def save_series(fields: Mapping[float, xr.Dataset], target: PathLike) -> Path:
    """Write fields (``deformed``, ``mode_field``) by time (s); returns the path for ParaView.

    target: a file that ends in .vtkhdf for all fields, or a folder for a .vtu of each field and a
    .pvd. Point data as of ``field_grid``. Files are replaced only when all are written.
    FlexgearError without fields, or if VTK cannot write the file.
    """
    if not fields:
        raise FlexgearError("a series needs one field or more")
    if Path(target).suffix == ".vtkhdf":
        return _save_vtkhdf(fields, Path(target))
    return _save_folder(fields, target)


def _save_vtkhdf(fields: Mapping[float, xr.Dataset], target: Path) -> Path:
    times = [float(time) for time in fields]
    if len(np.unique(np.array(times, np.float32))) < len(times):  # precision of VTK
        problem = "keeps times in single precision, in which some of these are the same"
        raise FlexgearError(f"{target.name} {problem}: write a folder instead")
    source = _Samples(times, [field_grid(field) for field in fields.values()])
    with atomic_file(target) as temporary:
        writer = vtkHDFWriter()
        writer.SetFileName(str(temporary))
        writer.SetInputConnection(source.GetOutputPort())
        writer.SetWriteAllTimeSteps(True)
        if not writer.Write():
            raise FlexgearError(f"VTK cannot write {target}")
    return target


class _Samples(VTKPythonAlgorithmBase):  # type: ignore[misc]
    """Source of a VTK pipeline with grids at given times."""

    def __init__(self, times: Sequence[float], grids: Sequence[Any]) -> None:
        super().__init__(nInputPorts=0, nOutputPorts=1, outputType="vtkUnstructuredGrid")
        self.times, self.grids = list(times), grids

    def RequestInformation(self, request: Any, inputs: Any, outputs: Any) -> int:
        """Set the times of the fields in the pipeline."""
        pipeline, about = vtkStreamingDemandDrivenPipeline, outputs.GetInformationObject(0)
        about.Set(pipeline.TIME_STEPS(), self.times, len(self.times))
        about.Set(pipeline.TIME_RANGE(), [min(self.times), max(self.times)], 2)
        return 1

    def RequestData(self, request: Any, inputs: Any, outputs: Any) -> int:
        """Set the grid nearest to the requested time as output."""
        requested_time = outputs.GetInformationObject(0).Get(
            vtkStreamingDemandDrivenPipeline.UPDATE_TIME_STEP()
        )
        nearest = int(np.argmin(np.abs(np.array(self.times) - requested_time)))
        vtkUnstructuredGrid.GetData(outputs).ShallowCopy(self.grids[nearest])
        return 1


def _save_folder(fields: Mapping[float, xr.Dataset], folder: PathLike) -> Path:
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
