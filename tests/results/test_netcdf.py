"""netCDF files as other programs have them: what is written here they read, and the other way."""

import copy
import pickle

import h5py
import numpy as np
import pytest
import xarray as xr

from flexgear.model.errors import InputError
from flexgear.results.netcdf import NewFile, read

SMALL = {"compression": "gzip", "compression_opts": 1, "shuffle": True}


@pytest.fixture
def data():
    """All kinds of variables, axes and attributes that results have."""
    rng = np.random.default_rng(3)
    return xr.Dataset(
        {
            "force": (
                ("time", "gear_mesh"),
                rng.normal(size=(7, 3)),
                {"units": "N", "missing": ""},
            ),
            "tooth": (("time", "gear_mesh", "slot"), rng.integers(0, 99, (7, 3, 2)).astype("i2")),
            "factor": ((), 1.25, {"long_name": "Übersetzung µ"}),
            "loaded": ("gear_mesh", np.array([True, False, True])),
            "none": (("time", "nothing"), np.zeros((7, 0))),
            "failure": ("gear_mesh", np.array(["", "größer als 1", "a, b"])),
            "gap": ("time", np.where(np.arange(7) % 2, np.nan, 1.0)),
        },
        coords={
            "time": ("time", np.linspace(0, 1, 7), {"units": "s"}),
            "gear_mesh": ["stage ring 1", "stage sun 2", "Größe"],
            "planet": ("gear_mesh", np.array([1, 2, 3])),
            "angle": ("time", np.linspace(0, 3, 7)),
            "case": "mine",
        },
        attrs={
            "title": "flexgear µ",
            "empty": "",
            "count": 3,
            "share": 0.1,
            "parameters": "x" * 200_000,
            "names": ["a", "b c"],
            "vector": np.array([1.0, 2.0]),
        },
    )


@pytest.mark.parametrize("engine", ["h5netcdf", "netcdf4"])
def test_other_programs_read_the_files(data, tmp_path, engine):
    if engine == "netcdf4":
        pytest.importorskip("netCDF4")
    encoding = {"force": {**SMALL, "dtype": "f4"}, "tooth": SMALL}
    NewFile(tmp_path / "a.nc", data, encoding, {}).close()
    expected = data.assign(force=data["force"].astype("f4"))
    with xr.open_dataset(tmp_path / "a.nc", engine=engine) as dataset:
        xr.testing.assert_identical(dataset.load().drop_attrs(), expected.drop_attrs())
        assert list(dataset.sizes) == list(data.sizes)
        for name, value in data.attrs.items():
            np.testing.assert_array_equal(dataset.attrs[name], value)
        assert dataset["force"].attrs == data["force"].attrs
        assert dataset["factor"].attrs == data["factor"].attrs


@pytest.mark.parametrize("whole", [True, False])
def test_files_of_other_programs_are_read(data, tmp_path, whole):
    data.to_netcdf(tmp_path / "a.nc", engine="h5netcdf")
    with h5py.File(tmp_path / "a.nc") as file:
        dataset = read(file, whole)
        np.testing.assert_array_equal(dataset["force"].sel(time=[0.5]), data["force"][3:4])
        dataset = dataset.load()
    xr.testing.assert_identical(dataset, data)


def test_values_stay_in_the_file_until_they_are_wanted(data, tmp_path, monkeypatch):
    """Samples at even or odd distances are read as one slice."""
    NewFile(tmp_path / "a.nc", data, {}, {}).close()
    keys, take = [], h5py.Dataset.__getitem__
    with h5py.File(tmp_path / "a.nc") as file:
        dataset = read(file, whole=False)
        monkeypatch.setattr(
            h5py.Dataset, "__getitem__", lambda self, key: keys.append(key) or take(self, key)
        )
        some = dataset["force"].isel(time=[1, 2, 5], gear_mesh=[0, 2]).to_numpy()
    np.testing.assert_array_equal(some, data["force"].to_numpy()[[1, 2, 5]][:, [0, 2]])
    assert len(keys) == 1 and all(isinstance(k, slice) for k in keys[0])


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda x: pickle.loads(pickle.dumps(x))])
def test_variables_in_a_file_can_be_copied(data, tmp_path, copied):
    """As xarray does with coordinates of new arrays, and other processes with all of it."""
    NewFile(tmp_path / "a.nc", data, {}, {}).close()
    with h5py.File(tmp_path / "a.nc") as file:
        dataset = read(file, whole=False)
        late = copied(dataset)
        assert not late.variables["force"]._in_memory
        xr.testing.assert_identical(late.load(), data)
        new = xr.DataArray(np.zeros((7, 3)), dataset["force"].coords, ("time", "gear_mesh"))
        np.testing.assert_array_equal(new["time"], data["time"])


def test_damage_that_is_met_late_is_one_line(data, tmp_path):
    NewFile(tmp_path / "a.nc", data, {"force": SMALL}, {}).close()
    with h5py.File(tmp_path / "a.nc") as file:
        chunk = file["force"].id.get_chunk_info(0)
    content = bytearray((tmp_path / "a.nc").read_bytes())
    content[chunk.byte_offset : chunk.byte_offset + chunk.size] = bytes(chunk.size)
    (tmp_path / "a.nc").write_bytes(content)
    with h5py.File(tmp_path / "a.nc") as file:
        dataset = read(file, whole=False)
        assert float(dataset["factor"]) == 1.25
        with pytest.raises(InputError, match=r"a\.nc: force: is damaged"):
            dataset["force"].load()


def test_room_for_samples_that_come_later(data, tmp_path):
    empty = data.isel(time=slice(0, 0))
    file = NewFile(tmp_path / "a.nc", empty, {"force": SMALL}, {"time": 7})
    for name in (n for n, v in data.variables.items() if "time" in v.dims):
        for part in (slice(0, 4), slice(4, 7)):
            file.put(name, data[name].to_numpy()[part], part)
    file.close()
    with xr.open_dataset(tmp_path / "a.nc", engine="h5netcdf") as dataset:
        xr.testing.assert_identical(dataset.load(), data)


def test_a_file_of_something_else_is_refused(tmp_path):
    with h5py.File(tmp_path / "a.nc", "w") as file:
        file.create_dataset("a", data=np.zeros(2, dtype=[("x", float)]))
    with h5py.File(tmp_path / "a.nc") as file, pytest.raises(ValueError, match="neither numbers"):
        read(file, whole=True)
