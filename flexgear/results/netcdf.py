"""Reading and writing of netCDF-4 files by h5py.

A netCDF-4 file is an HDF5 file in which axes are dimension scales (netCDF-4 file format
specification, Unidata). xarray's engine h5netcdf takes half a second for each of the twenty files
of a run, and the netCDF library in C crashes if two threads use it, even for closing files. h5py
can be used by any thread. Both engines read the files written here.
"""

import io
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Self

import h5py
import numpy as np
import xarray as xr
from numpy.typing import NDArray
from xarray.backends import BackendArray
from xarray.core import indexing

from flexgear.model.errors import InputError

Encoding = Mapping[str, Mapping[str, Any]]
NO_VARIABLE = "This is a netCDF dimension but not a netCDF variable."  # begins a scale's name
COORDINATES = "coordinates"  # attribute with the names of coordinates that are not axes
FORMAT_ATTRIBUTES = {
    "CLASS", "NAME", "DIMENSION_LIST", "REFERENCE_LIST", "_Netcdf4Dimid", "_Netcdf4Coordinates",
    "_nc3_strict", "_NCProperties", "_FillValue", COORDINATES,
}  # fmt: skip
HDF5_VERSIONS = ("v110", "v114")  # whose attributes may be longer than 64 kB
# bytes of chunks that HDF5 holds for each variable; HDF5 2.0 allows 8 MB, which the variables of a
# transient fill over minutes. Samples are written once, in their order, so that one chunk is open
CHUNKS_IN_MEMORY = 2**20


class NewFile:
    """A new file with a dataset, open for writing; an existing file is overwritten.

    encoding: dtype and keywords of ``h5py.Group.create_dataset`` by variable. lengths: final length
    of axes along which values are written later.
    """

    def __init__(
        self, path: Path, data: xr.Dataset, encoding: Encoding, lengths: Mapping[str, int]
    ) -> None:
        self._encoding, self._lengths = encoding, lengths
        self._sizes = {str(d): lengths.get(str(d), n) for d, n in data.sizes.items()}
        self._disk = _Disk(path, "w+b")
        self._file = h5py.File(
            self._disk, "w", libver=HDF5_VERSIONS, track_order=True, rdcc_nbytes=CHUNKS_IN_MEMORY
        )
        try:
            self._fill(data)
        except BaseException:
            self._close()
            raise

    def put(self, name: str, values: NDArray[Any], rows: slice | None = None) -> None:
        """Write values of a variable, or of rows along its first axis; OSError if writing fails."""
        self._file[name][... if rows is None else rows] = values
        self._disk.require()

    def set_attributes(self, attrs: Mapping[Any, Any]) -> None:
        """Add attributes of the dataset."""
        set_attributes(self._file, attrs)

    def close(self) -> None:
        """Close the file; OSError if writing failed."""
        self._close()
        self._disk.require()

    def _close(self) -> None:
        self._file.close()
        self._disk.close()

    def _fill(self, data: xr.Dataset) -> None:
        auxiliary = {
            str(c): {*data.variables[c].dims} for c in data.coords if data.variables[c].dims != (c,)
        }
        attached: set[str] = set()
        coords = {*map(str, data.coords)}
        scales: dict[str, h5py.Dataset] = {}
        for k, (dim, size) in enumerate(self._sizes.items()):
            scales[dim] = scale = (
                self._stored(dim, data.variables[dim])
                if dim in data.variables
                else self._file.create_dataset(dim, (size,), ">f4", track_order=True)
            )
            scale.make_scale(dim if dim in data.variables else f"{NO_VARIABLE} {size:9d}")
            scale.attrs["_Netcdf4Dimid"] = np.int32(k)
        for name in [n for n in map(str, data.variables) if n not in self._sizes]:
            variable = data.variables[name]
            stored = self._stored(name, variable)
            for k, axis in enumerate(variable.dims):
                stored.dims[k].attach_scale(scales[str(axis)])
            if name not in coords:
                labels = [c for c, dims in auxiliary.items() if dims <= {*variable.dims}]
                attached.update(labels)
                set_attributes(stored, {COORDINATES: " ".join(labels)} if labels else {})
        others = [c for c in auxiliary if c not in attached]
        self.set_attributes({COORDINATES: " ".join(others)} if others else {})
        self.set_attributes(data.attrs)

    def _stored(self, name: str, variable: xr.Variable) -> h5py.Dataset:
        """Create a variable in the file, with its attributes. Its values are written at once, but
        for a variable over an axis of ``lengths``, whose samples are written later by ``put``."""
        values, options = variable.to_numpy(), dict(self._encoding.get(name, {}))
        text, boolean = values.dtype.kind in "UO", values.dtype.kind == "b"
        dtype = options.pop("dtype", "i1" if boolean else values.dtype)
        shape, content = tuple(self._sizes[str(d)] for d in variable.dims), None
        if not set(self._lengths) & {*map(str, variable.dims)}:
            content = values.astype(object if text else dtype)
        if not all(shape):  # a run may end before a sensor's first sample
            options = {}
        stored = self._file.create_dataset(
            name,
            shape,
            h5py.string_dtype() if text else dtype,
            content,
            track_order=True,
            **options,
        )
        set_attributes(stored, {**variable.attrs, **({"dtype": "bool"} if boolean else {})})
        return stored


class _Disk(io.FileIO):
    """File object for HDF5 that reports failed writes only by ``require``. HDF5 would repeat a
    failed write at the end of the process and crash."""

    _error: OSError | None = None

    def require(self) -> None:
        if self._error is not None:
            raise self._error

    def write(self, data: Any, /) -> int:
        view = memoryview(data).cast("B")
        written = 0
        while written < len(view) and self._error is None:
            try:
                written += super().write(view[written:])
            except OSError as error:
                self._error = error
        return len(view)

    def truncate(self, size: int | None = None, /) -> int:
        try:
            return super().truncate(size)
        except OSError as error:
            self._error = self._error or error
            return size or 0


def set_attributes(target: h5py.File | h5py.Dataset, attrs: Mapping[Any, Any]) -> None:
    """Set attributes as netCDF stores them: texts, lists of texts, numbers as vectors."""
    attributes = target.attrs
    for name, value in attrs.items():
        if isinstance(value, str):
            text = value.encode()
            kind = h5py.string_dtype("utf-8", len(text)) if text else None
            content = np.array(text, dtype=kind) if text else h5py.Empty(np.dtype("S1"))
            attributes.create(name, content)
        elif np.asarray(value).dtype.kind in "UO":
            attributes.create(name, [str(v) for v in value], dtype=h5py.string_dtype())
        else:
            attributes.create(name, np.atleast_1d(value))


def read(file: h5py.File, whole: bool) -> xr.Dataset:
    """The dataset of a file, in memory if ``whole``. Otherwise only coordinates are in memory;
    slices of variables are read when accessed, as long as the file is open."""
    stored = {
        name: item
        for name, item in file.items()
        if isinstance(item, h5py.Dataset)
        and not _text(item.attrs.get("NAME", "")).startswith(NO_VARIABLE)
    }
    dims = {name: _dims(file, name, item) for name, item in stored.items()}
    labels = {name for name, axes in dims.items() if axes == (name,)}
    for source in (file, *stored.values()):
        labels.update(_text(source.attrs.get(COORDINATES, "")).split())
    variables = {
        name: xr.Variable(
            dims[name], _values(item, whole or name in labels), dict(_attributes(item))
        )
        for name, item in stored.items()
    }
    coords = {name: variables.pop(name) for name in [*variables] if name in labels}
    return xr.Dataset(variables, coords, dict(_attributes(file)))


def _dims(file: h5py.File, name: str, stored: h5py.Dataset) -> tuple[str, ...]:
    """Axes of a variable: the dimension scales that it refers to; the axis of a scale is itself."""
    references = (refs[0] for refs in stored.attrs.get("DIMENSION_LIST", ()))
    scales = [h5py.h5r.get_name(reference, file.id) for reference in references]
    if None in scales:
        raise ValueError(f"an axis of {name} is missing")
    return tuple(s.decode().lstrip("/") for s in scales) or (name,) * stored.ndim


class _Stored(BackendArray):  # type: ignore[misc]
    """An array of an open file, read by slices.

    A copy is the same object, since the array is read-only; unpickling opens the file again.
    """

    def __init__(self, stored: h5py.Dataset) -> None:
        self._stored, self.shape, self.dtype = stored, stored.shape, stored.dtype

    def __deepcopy__(self, memo: Any) -> Self:
        return self

    def __reduce__(self) -> tuple[Any, ...]:
        path = Path(self._stored.file.filename).absolute()
        return _stored_at, (path, self._stored.name)

    def __getitem__(self, key: Any) -> Any:
        try:
            return indexing.explicit_indexing_adapter(
                key, self.shape, indexing.IndexingSupport.BASIC, self._stored.__getitem__
            )
        except OSError as error:
            name, path = self._stored.name.strip("/"), self._stored.file.filename
            raise InputError(path, name, f"is damaged ({error})", "run the case again") from error


def _stored_at(path: Path, name: str) -> _Stored:
    return _Stored(h5py.File(path)[name])


def _values(stored: h5py.Dataset, whole: bool) -> Any:
    if h5py.check_string_dtype(stored.dtype) is not None:
        text: NDArray[Any] = np.asarray(stored.asstr()[()])
        return text.astype(str)
    if _text(stored.attrs.get("dtype", "")) == "bool":
        return stored[()].astype(bool)
    if stored.dtype.kind not in "iuf":
        raise ValueError(f"{stored.name} holds neither numbers nor text")
    return stored[()] if whole else indexing.LazilyIndexedArray(_Stored(stored))


def _attributes(source: h5py.File | h5py.Dataset) -> Iterator[tuple[str, Any]]:
    for name, value in source.attrs.items():
        if name in FORMAT_ATTRIBUTES or (name == "dtype" and _text(value) == "bool"):
            continue
        if isinstance(value, np.ndarray) and value.dtype.kind in "OSU":
            texts = [_text(v) for v in value.ravel()]
            yield name, texts[0] if len(texts) == 1 else texts
        elif isinstance(value, str | bytes | h5py.Empty):
            yield name, _text(value)
        else:
            yield name, value[0] if np.size(value) == 1 and np.ndim(value) else value


def _text(value: Any) -> str:
    if isinstance(value, h5py.Empty):
        return ""
    if isinstance(value, np.ndarray) and value.size == 1:
        value = value.ravel()[0]
    return value.decode() if isinstance(value, bytes) else str(value)
