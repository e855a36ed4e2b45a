"""Series of fields for ParaView."""

from xml.etree import ElementTree

import numpy as np
import pytest
import pyvista
from stage_samples import stage_with_vertices
from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline
from vtkmodules.vtkIOHDF import vtkHDFReader

from flexgear.model.errors import FlexgearError, InputError
from flexgear.solve.deformed import mode_field
from flexgear.solve.modes import modes
from flexgear.views.field_series import save_series, swing


@pytest.fixture(scope="module")
def model():
    return stage_with_vertices()


def test_a_mode_swings_over_its_period(model, tmp_path):
    body = "stage.ring"
    frequencies = modes(model)["frequency"].to_numpy()
    number = 1 + int(np.flatnonzero(frequencies > 0)[3])
    field = mode_field(model, body, number)
    assert field.attrs["frequency"] == pytest.approx(frequencies[number - 1], rel=1e-9)
    moved = np.linalg.norm(field["displacement"], axis=1)
    assert moved.max() == pytest.approx(1e-3)
    path = save_series(swing(field, 8), tmp_path / "mode")
    series = pyvista.get_reader(path)
    assert series.time_values == pytest.approx(np.arange(8) / 8 / field.attrs["frequency"])
    for frame, factor in ((0, 1.0), (2, 0.0), (4, -1.0)):
        series.set_active_time_point(frame)
        displacement = series.read()[0]["displacement"]
        np.testing.assert_allclose(displacement, factor * field["displacement"], atol=1e-12)


def test_the_collection_names_every_file_once(model, tmp_path):
    field = mode_field(model, "stage.carrier", 20)
    path = save_series({0.0: field, 0.5: field}, tmp_path / "two")
    named = [one.attrib for one in ElementTree.parse(path).iter("DataSet")]
    assert [(one["file"], float(one["timestep"])) for one in named] == [
        ("field_0.vtu", 0.0),
        ("field_1.vtu", 0.5),
    ]
    assert sorted(p.name for p in path.parent.iterdir()) == [
        "field_0.vtu", "field_1.vtu", "series.pvd",
    ]  # fmt: skip


def test_a_series_of_fields_that_cannot_be_saved_is_refused(model, tmp_path):
    with pytest.raises(FlexgearError, match="one field or more"):
        save_series({}, tmp_path / "none")
    field = mode_field(model, "stage.ring", 20)
    with pytest.raises(FlexgearError, match="single precision"):
        save_series({1000.0: field, 1000.00001: field}, tmp_path / "close.vtkhdf")
    assert not list(tmp_path.iterdir())
    with pytest.raises(InputError, match="100000 is not there"):
        mode_field(model, "stage.ring", 100_000)


def test_one_file_holds_a_series(model, tmp_path):
    """VTK's own reader finds the times and, at each of them, the fields."""
    field = mode_field(model, "stage.ring", 20)
    frames = swing(field, 6)
    path = save_series(frames, tmp_path / "mode.vtkhdf")
    assert path == tmp_path / "mode.vtkhdf" and list(tmp_path.iterdir()) == [path]
    reader = vtkHDFReader()
    reader.SetFileName(str(path))
    reader.UpdateInformation()
    about = reader.GetOutputInformation(0)
    times = about.Get(vtkStreamingDemandDrivenPipeline.TIME_STEPS())
    assert times == pytest.approx(list(frames), rel=1e-6)  # VTK keeps them in single precision
    for time, frame in zip(times, frames.values(), strict=True):
        reader.UpdateTimeStep(time)
        grid = pyvista.wrap(reader.GetOutputDataObject(0))
        assert grid.n_points == field.sizes["vertex"]
        np.testing.assert_allclose(grid["displacement"], frame["displacement"], atol=1e-15)
