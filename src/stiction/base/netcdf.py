"""Read NetCDF files from any source: only numbers stored in the file, and of limited size.

A NetCDF-4 file is an HDF5 file. While HDF5 reads, it follows names of
other files (external storage, external links, virtual datasets), and it
unpacks data without a limit. The steps are:

1. Read all bytes of the file first, so that it cannot change between
   check and use.
2. Walk through all groups. Refuse links that are not hard, data outside
   the file, too many values for the size of the file, filters other
   than shuffle, zlib and checksum, and chunks that unpack to more than
   their shape states.
3. Read the attributes, lists of strings and numeric
   variables at the root. All attributes and strings
   together must not be larger than the file.
4. Name the dimensions as NetCDF does.
5. Decode the variables as xarray does: missing values, scale and
   offset, but no times.

The same library, h5py, checks and reads the file, so that the file has
a single meaning. Files of classic NetCDF contain no names of files, and
scipy reads them.
"""

from __future__ import annotations

import io
import math
import zlib
from collections.abc import Collection, Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.base.errors import InputError
from stiction.base.files import check_unpacked, refuse_damage

if TYPE_CHECKING:
    import xarray as xr

MAX_OBJECTS = 1_000
MAX_VALUES = 2**23
"""Values of a file of fewer bytes than this. A larger file may hold one value per byte."""
SHUFFLE, DEFLATE, CHECKSUM, VIRTUAL = 2, 1, 3, 3
"""HDF5's numbers of the accepted filters, and of the layout of virtual datasets."""
PACKED: tuple[list[int], ...] = ([], [SHUFFLE], [DEFLATE], [SHUFFLE, DEFLATE])
"""Orders of filters, without the checksum, which may stand anywhere."""
CHECKSUM_BYTES = 4
UNREAD = {"DIMENSION_LIST", "REFERENCE_LIST", "_NCProperties", "_nc3_strict"}
HIDDEN = {"CLASS", "NAME", "_Netcdf4Dimid", "_Netcdf4Coordinates"}
"""Attributes by which NetCDF describes its own file."""
SCALE, NO_VARIABLE = "DIMENSION_SCALE", "This is a netCDF dimension but not a netCDF variable"
NOT_A_SCALE = "_nc4_non_coord_"
"""Prefix in HDF5 of a variable that has the name of a dimension but another dimension."""


def read_netcdf(content: bytes, unwanted: Collection[str] = ()) -> xr.Dataset:
    """Return the numbers and strings at the root of a NetCDF file, without `unwanted` names.

    Raises an `InputError` that states why a file cannot be read.
    """
    import xarray as xr

    options: Any = {"decode_times": False, "decode_timedelta": False}
    with refuse_damage("a NetCDF file of numbers"):
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


def _from_hdf5(content: bytes, unwanted: Collection[str]) -> tuple[dict[str, Any], Any]:
    """Return the variables in an HDF5 file as stored, and the attributes of the file."""
    import h5py
    import xarray as xr

    with h5py.File(io.BytesIO(content)) as file:
        values = 0
        for dataset in _datasets(file):
            values += _padded_size(dataset)
            check_unpacked(values, content, MAX_VALUES, 1)
            _check_storage(dataset)
            if dataset.name.lstrip("/") not in unwanted:
                _check_chunks(dataset)
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
                item[()] if item.dtype.kind in "fiu" else _texts(item, budget),
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
    """Yield the datasets of all groups, and refuse links that are not hard."""
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
                    f"{name!r} is a link to another place. Copy the data into the file itself"
                )
            item = group[name]
            if isinstance(item, h5py.Dataset):
                yield item
            elif isinstance(item, h5py.Group):
                address = h5py.h5o.get_info(item.id).addr
                if address not in seen:  # links may run in circles
                    seen.add(address)
                    waiting.append(item)


def _padded_size(dataset: Any) -> int:
    """Return the number of values in all chunks. Chunks may extend beyond the array."""
    sizes = zip(dataset.shape or (), dataset.chunks or dataset.shape or (), strict=True)
    return math.prod(-(-size // chunk) * chunk for size, chunk in sizes)


def _check_storage(dataset: Any) -> None:
    """Refuse data that lie outside the file, or that are packed with other filters."""
    kept = dataset.id.get_create_plist()
    if kept.get_layout() == VIRTUAL or kept.get_external_count():
        raise InputError(
            f"{dataset.name!r} takes its values from another file. Copy them into the file itself"
        )
    filters = _filters(dataset)
    packing = [number for number in filters if number != CHECKSUM]
    if packing not in PACKED or len(filters) - len(packing) > 1:
        raise InputError(
            f"{dataset.name!r} is compressed with an unsupported filter. Write it with zlib"
        )


def _filters(dataset: Any) -> list[int]:
    kept = dataset.id.get_create_plist()
    return [kept.get_filter(number)[0] for number in range(kept.get_nfilters())]


def _check_chunks(dataset: Any) -> None:
    """Refuse chunks whose unpacked size differs from their shape, because HDF5 has no limit."""
    filters, chunks = _filters(dataset), list[Any]()
    if DEFLATE not in filters:
        return
    dataset.id.chunk_iter(chunks.append)
    values = math.prod(dataset.chunks)
    if len(chunks) * values > _padded_size(dataset):
        raise InputError(
            f"{dataset.name!r} has more chunks than its shape. Write the file again"
        )
    size = values * dataset.id.get_type().get_size()
    for chunk in chunks:
        skipped, data = dataset.id.read_direct_chunk(chunk.chunk_offset)
        inside = filters  # written before the data that are looked at
        if not skipped >> filters.index(DEFLATE) & 1:
            inside = filters[: filters.index(DEFLATE)]
            data = zlib.decompressobj().decompress(data, size + CHECKSUM_BYTES + 1)
        if len(data) != size + CHECKSUM_BYTES * (CHECKSUM in inside):
            raise InputError(f"{dataset.name!r} unpacks to another size than its chunks have")


def _texts(dataset: Any, budget: list[int]) -> Any:
    """Return a list of strings, such as names of stations, within the budget for attributes.

    Strings are read one by one, because many of them may refer to one
    long string in the file.
    """
    texts: list[str] = []
    for number in range(dataset.shape[0]):
        text = dataset[number]
        texts.append(text.decode(errors="replace") if isinstance(text, bytes) else str(text))
        budget[0] -= max(len(texts[-1]), 1)
        if budget[0] < 0:
            raise InputError("its strings need more memory than the whole file. Write it again")
    return np.array(texts, dtype=str)


def _dims(
    dataset: Any, name: str, about: dict[str, Any], scales: dict[int, str]
) -> tuple[str, ...]:
    """Return the names of the dimensions of a dataset at the root (step 4)."""
    if "_Netcdf4Coordinates" in about:
        return tuple(scales[number] for number in np.ravel(about["_Netcdf4Coordinates"]))
    if about.get("CLASS") == SCALE and dataset.ndim == 1:
        return (name,)
    attached = [dim[0].name.lstrip("/") if len(dim) == 1 else "" for dim in dataset.dims]
    return tuple(scale or f"{name}_{number}" for number, scale in enumerate(attached))


def _attributes(item: Any, budget: list[int]) -> dict[str, Any]:
    """Return the attributes that are strings or numbers, and deduct their size from the budget.

    Lists of strings are left out, because they may refer to one long
    string many times.
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
