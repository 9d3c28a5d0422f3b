"""NetCDF files from anywhere: only numbers that the file itself holds, and no more than expected.

A NetCDF-4 file is an HDF5 file. HDF5 follows names of other files (external storage, external
links, virtual datasets) while it reads, and unpacks whatever a filter says. The steps are:

1. The bytes of the file were read already, so that nobody changes it between a look and a use.
2. Walk through all groups. Links must be hard; data must lie in the file, have few values for its
   size, and be packed by zlib, once, if at all.
3. Read the attributes of the root and of its variables, and lists of texts, which are no larger
   together than the file, and the numeric variables. Chunks are inflated here, within the size that
   their shape states: HDF5 inflates until it has no memory.
4. Name the dimensions as NetCDF does.
5. Decode them as xarray does: missing values, scale and offset, but no times.

One library, h5py, looks and reads, so that a file cannot mean two things. Files of classic NetCDF
hold no names of files; scipy reads them.
"""

from __future__ import annotations

import io
import math
import zlib
from collections.abc import Collection, Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.base.errors import InputError
from stiction.base.files import check_unpacked

if TYPE_CHECKING:
    import xarray as xr

MAX_OBJECTS = 1_000
MAX_VALUES = 2**23
"""Values of a file of fewer bytes than this; larger files may hold one value a byte."""
SHUFFLE, DEFLATE, CHECKSUM, VIRTUAL = 2, 1, 3, 3
"""HDF5's numbers of the filters that are read, and of the layout of virtual datasets."""
UNREAD = {"DIMENSION_LIST", "REFERENCE_LIST", "_NCProperties", "_nc3_strict"}
HIDDEN = {"CLASS", "NAME", "_Netcdf4Dimid", "_Netcdf4Coordinates"}
"""Attributes by which NetCDF describes its own file."""
SCALE, NO_VARIABLE = "DIMENSION_SCALE", "This is a netCDF dimension but not a netCDF variable"
NOT_A_SCALE = "_nc4_non_coord_"
"""Begins the HDF5 name of a variable that has the name of a dimension, and is not along it."""


def read_netcdf(content: bytes, unwanted: Collection[str] = ()) -> xr.Dataset:
    """Return the numbers and texts of the root of a NetCDF file, or raise an `InputError`.

    Those of `unwanted` names are left out.
    """
    import xarray as xr

    options: Any = {"decode_times": False, "decode_timedelta": False}
    try:
        if content.startswith(b"CDF"):
            with xr.open_dataset(io.BytesIO(content), engine="scipy", **options) as opened:
                numeric = [name for name, one in opened.items() if one.dtype.kind in "fiu"]
                return opened[numeric].load()
        variables, attributes = _from_hdf5(content, unwanted)
        decoded, attributes, coordinates = xr.conventions.decode_cf_variables(
            variables, attributes, **options
        )
        data = xr.Dataset(decoded, attrs=attributes)
        return data.set_coords(coordinates & {*decoded}).load()
    except InputError:
        raise
    except Exception as error:  # libraries let through whatever a broken file leads to
        text = (str(error) or type(error).__name__).splitlines()[0]
        raise InputError(f"is not a NetCDF file of numbers: {text}") from None


def _from_hdf5(content: bytes, unwanted: Collection[str]) -> tuple[dict[str, Any], Any]:
    """Return the variables of an HDF5 file as they are stored, and attributes of the file."""
    import h5py
    import xarray as xr

    with h5py.File(io.BytesIO(content)) as file:
        values = 0
        for dataset in _datasets(file):
            _check_storage(dataset)
            values += _padded_size(dataset)
            check_unpacked(values, content, MAX_VALUES, 1)
        budget = [len(content)]
        at_root = {
            name: (item, _attributes(item, budget))
            for name, item in file.items()
            if isinstance(item, h5py.Dataset)
        }
        scales = {
            about["_Netcdf4Dimid"]: name
            for name, (_, about) in at_root.items()
            if about.get("CLASS") == SCALE
        }
        variables = {
            name.removeprefix(NOT_A_SCALE): xr.Variable(
                _dims(item, name, about, scales),
                _values(item) if item.dtype.kind in "fiu" else _texts(item, budget),
                {key: value for key, value in about.items() if key not in HIDDEN},
            )
            for name, (item, about) in at_root.items()
            if name not in unwanted and item.shape is not None
            if item.dtype.kind in "fiu"
            or (h5py.check_string_dtype(item.dtype) and item.ndim == 1)
            if not str(about.get("NAME")).startswith(NO_VARIABLE)
        }
        return variables, _attributes(file, budget)


def _datasets(file: Any) -> Iterator[Any]:
    """Yield all datasets, in all groups; everything must be reached by hard links."""
    import h5py

    waiting, seen, count = [file], {h5py.h5o.get_info(file.id).addr}, 0
    while waiting:
        group = waiting.pop()
        count += len(group)
        if count > MAX_OBJECTS:
            raise InputError(f"holds more than {MAX_OBJECTS} objects")
        for name in group:
            if not isinstance(group.get(name, getlink=True), h5py.HardLink):
                raise InputError(
                    f"{name!r} is a link to another place; copy the data into the file itself"
                )
            item = group[name]
            if isinstance(item, h5py.Dataset):
                yield item
            elif isinstance(item, h5py.Group):
                address = h5py.h5o.get_info(item.id).addr
                if address not in seen:  # links may run in circles
                    seen.add(address)
                    waiting.append(item)


def _check_storage(dataset: Any) -> None:
    """Refuse data that lie outside the file, or that HDF5 would unpack without a limit."""
    kept = dataset.id.get_create_plist()
    if kept.get_layout() == VIRTUAL or kept.get_external_count():
        raise InputError(
            f"{dataset.name!r} takes its values from another file; copy them into the file itself"
        )
    filters = _filters(kept)
    if not {*filters} <= {SHUFFLE, DEFLATE, CHECKSUM} or len({*filters}) < len(filters):
        raise InputError(f"{dataset.name!r} is packed in an unusual way; write it with zlib")


def _filters(kept: Any) -> tuple[int, ...]:
    return tuple(kept.get_filter(number)[0] for number in range(kept.get_nfilters()))


def _padded_size(dataset: Any) -> int:
    """Return the number of values in all chunks, which may reach over the ends."""
    return math.prod(
        -(-size // chunk) * chunk
        for size, chunk in zip(
            dataset.shape or (), dataset.chunks or dataset.shape, strict=True
        )
    )


def _values(dataset: Any) -> Any:
    """Return the values; chunks are inflated within their size, for which HDF5 knows no limit."""
    filters = _filters(dataset.id.get_create_plist())
    if DEFLATE not in filters:
        return dataset[()]
    chunks: list[Any] = []
    dataset.id.chunk_iter(chunks.append)
    size = math.prod(dataset.chunks) * dataset.dtype.itemsize
    if len(chunks) * size > _padded_size(dataset) * dataset.dtype.itemsize:
        raise InputError(f"{dataset.name!r} has more chunks than its shape")
    values = np.full(dataset.shape, dataset.fillvalue, dataset.dtype)
    for start in (chunk.chunk_offset for chunk in chunks):
        skipped, data = dataset.id.read_direct_chunk(start)
        for number in reversed([n for n in range(len(filters)) if not skipped >> n & 1]):
            if filters[number] == DEFLATE:
                data = zlib.decompressobj().decompress(data, size + 5)
            elif filters[number] == SHUFFLE:
                end = len(data) // dataset.dtype.itemsize * dataset.dtype.itemsize
                bytewise = np.frombuffer(data[:end], np.uint8)
                data = bytewise.reshape(dataset.dtype.itemsize, -1).T.tobytes() + data[end:]
            else:  # the checksum, of four bytes, is for HDF5 itself
                data = data[:-4]
        if len(data) != size:
            raise InputError(f"{dataset.name!r} unpacks to another size than its chunks have")
        block = np.frombuffer(data, dataset.dtype).reshape(dataset.chunks)
        room = [slice(at, at + n) for at, n in zip(start, dataset.chunks, strict=True)]
        part = values[tuple(room)]
        part[...] = block[tuple(slice(0, n) for n in part.shape)]
    return dataset[()] if CHECKSUM in filters else values


def _texts(dataset: Any, budget: list[int]) -> Any:
    """Return a list of texts, such as names of stations, within the budget of the attributes.

    They are read one by one, because many of them may name the same long text of the file.
    """
    texts: list[str] = []
    for number in range(dataset.shape[0]):
        text = dataset[number]
        texts.append(text.decode(errors="replace") if isinstance(text, bytes) else str(text))
        budget[0] -= max(len(texts[-1]), 1)
        if budget[0] < 0:
            raise InputError("its texts are larger than the file")
    return np.array(texts, dtype=str)


def _dims(
    dataset: Any, name: str, about: dict[str, Any], scales: dict[int, str]
) -> tuple[str, ...]:
    """Return the names of the dimensions of a dataset at the root."""
    if "_Netcdf4Coordinates" in about:
        return tuple(scales[number] for number in np.ravel(about["_Netcdf4Coordinates"]))
    if about.get("CLASS") == SCALE and dataset.ndim == 1:
        return (name,)
    attached = [dim[0].name if len(dim) == 1 else None for dim in dataset.dims]
    return tuple(
        scale.lstrip("/") if scale else f"{name}_{number}"
        for number, scale in enumerate(attached)
    )


def _attributes(item: Any, budget: list[int]) -> dict[str, Any]:
    """Return the attributes that are a text or numbers; their size is taken from the budget.

    A list of texts may name one text of the file many times: it is left out.
    """
    import h5py

    about = {}
    for name in (name for name in item.attrs if name not in UNREAD):
        attribute = item.attrs.get_id(name)
        shape, text = attribute.shape, h5py.check_string_dtype(attribute.dtype)
        count = math.prod(shape or ()) if text is None else text.length or 1
        if not (attribute.dtype.kind in "fiu" or (text and math.prod(shape or ()) == 1)):
            continue
        value: Any = item.attrs[name] if count <= budget[0] else ""
        if text is not None and not isinstance(value, str):
            value = np.ravel(value)[0]
            value = value.decode(errors="replace") if isinstance(value, bytes) else value
        budget[0] -= max(count, len(value) if isinstance(value, str) else 0)
        if budget[0] < 0:
            raise InputError("its attributes are larger than the file")
        about[name] = value.item() if np.size(value) == 1 and text is None else value
    return about
