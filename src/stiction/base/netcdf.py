"""Read NetCDF files from any source: only values stored in the file, and of limited size.

A NetCDF-4 file is an HDF5 file. While HDF5 reads, it follows names of
other files (external storage, external links, virtual datasets), and it
unpacks data without a limit. The steps are:

1. Read all bytes of the file first, so that it cannot change between
   check and use.
2. Check the whole file (`_check`): each link is hard, and each value is
   inside the file. The arrays have at most as many values as the file
   has bytes, or `MAX_VALUES`. Chunks unpack to the size of their shape.
   All texts together are smaller than the file.
3. Let h5netcdf read the numbers and the lists of texts.

Classic NetCDF files contain no file names, and scipy reads them.
"""

from __future__ import annotations

import io
import math
import zlib
from collections.abc import Collection
from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.base.errors import InputError
from stiction.base.files import MAX_FILE_BYTES, check_unpacked, refuse_damage

if TYPE_CHECKING:
    import xarray as xr

MAX_OBJECTS = 1_000
MAX_VALUES = 2**23
"""Number of values that a file of fewer bytes may hold. A larger file
may hold a value per byte."""
SHUFFLE, DEFLATE, CHECKSUM, VIRTUAL = 2, 1, 3, 3
"""HDF5's numbers of the accepted filters, and of the layout of virtual
datasets."""
CHECKSUM_BYTES = 4


def read_netcdf(content: bytes, unwanted: Collection[str] = ()) -> xr.Dataset:
    """Return the numbers and texts at the root of a NetCDF file, without `unwanted` names.

    Raises an `InputError` that states why a file cannot be read.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import xarray as xr
    >>> data = {"load": ("x", [3.0, 7.0]), "name": "first", "labels": ("x", ["a", "b"])}
    >>> given = xr.Dataset(data, attrs={"title": "press"})
    >>> path = pathlib.Path(tempfile.mkdtemp(), "press.nc")
    >>> given.to_netcdf(path, engine="h5netcdf")
    >>> read = read_netcdf(path.read_bytes())
    >>> sorted(read.data_vars), read["load"].values.tolist(), read.attrs
    (['labels', 'load'], [3.0, 7.0], {'title': 'press'})
    >>> sorted(read_netcdf(path.read_bytes(), ["load"]).data_vars)
    ['labels']
    >>> classic = bytes(given[["load"]].to_netcdf(engine="scipy", format="NETCDF3_CLASSIC"))
    >>> classic[:3], read_netcdf(classic)["load"].values.tolist()
    (b'CDF', [3.0, 7.0])
    >>> read_netcdf(b"x (mm), y (mm)")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: is not a NetCDF file of numbers: ...
    """
    import h5py
    import xarray as xr

    options: Any = {"engine": "scipy"}
    with refuse_damage("a NetCDF file of numbers"):
        if not content.startswith(b"CDF"):
            with h5py.File(io.BytesIO(content)) as file:
                dropped = [*unwanted, *_check(file, content, unwanted)]
            options = {
                "engine": "h5netcdf", "phony_dims": "access", "drop_variables": dropped
            }  # fmt: skip
        with xr.open_dataset(
            io.BytesIO(content), decode_times=False, decode_timedelta=False, **options
        ) as opened:
            texts = [
                name for name, array in opened.items() if array.dtype.kind not in "fiubOUT"
            ]
            return opened.drop_vars(texts).load()


def _check(file: Any, content: bytes, unwanted: Collection[str]) -> list[str]:
    """Refuse files that lead to other files or to much memory (step 2).

    Returns the names at the root that hold neither numbers nor a list
    of texts.

    Examples
    --------
    >>> import h5py
    >>> with h5py.File(io.BytesIO(), "w") as file:
    ...     file["load"], file["name"] = [3.0, 7.0], "first"
    ...     file["labels"] = ["a", "b"]
    ...     file["groups/slip"], file["texts"] = [1, 2], [["a", "b"]]
    ...     print(_check(file, bytes(1000), ()))
    ...     file["other"] = h5py.SoftLink("load")
    ...     _check(file, bytes(1000), ())  # doctest: +ELLIPSIS
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: 'other' is a link to another place. Copy the data into...
    """
    import h5py

    names: list[str] = []

    def add(name: str, link: Any) -> str | None:  # a text ends the visit
        names.append(name)
        if not isinstance(link, h5py.HardLink):
            return f"{name!r} is a link to another place. Copy the data into the file itself"
        return f"holds more than {MAX_OBJECTS} objects" if len(names) > MAX_OBJECTS else None

    if wrong := file.visititems_links(add):
        raise InputError(wrong)
    values, letters, others = 0, _letters_in_attributes(file, content), []
    for name in names:
        item = file[name]
        if not isinstance(item, h5py.Dataset):
            continue
        letters += _letters_in_attributes(item, content)
        made = item.id.get_create_plist()
        if made.get_layout() == VIRTUAL or made.get_external_count():
            raise InputError(
                f"{item.name!r} takes its values from another file. Copy them into the file itself"
            )
        values += _padded_size(item)
        check_unpacked(values, content, MAX_VALUES, 1)
        if h5py.check_string_dtype(item.dtype) and item.ndim == 1:
            # Many entries may refer to one long text, so read one by one.
            for number in range(item.size if item.name.lstrip("/") not in unwanted else 0):
                letters += max(len(item[number]), 1)
                _check_letters(letters, content)
        elif item.dtype.kind in "fiub":
            _check_chunks(item, made)
        else:
            others.append(item.name.lstrip("/"))
    return others


def _check_letters(letters: int, content: bytes) -> None:
    """Refuse texts that are longer than their file.

    >>> _check_letters(3, b"abc")
    >>> _check_letters(4, b"abc")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: texts need more memory than the whole file...
    """
    if letters > len(content):
        raise InputError("texts need more memory than the whole file. Write the file again")


def _letters_in_attributes(item: Any, content: bytes) -> int:
    """Return the size of the attributes of an object. Texts are read one by one.

    >>> import h5py
    >>> with h5py.File(io.BytesIO(), "w") as file:
    ...     file.attrs.update({"title": "press", "axes": ["x", "load"], "range": [1.0, 7.0, 9.0]})
    ...     print(_letters_in_attributes(file, bytes(13)))  # 5 + (1 + 4) + 3
    ...     _letters_in_attributes(file, bytes(12))  # doctest: +ELLIPSIS
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: texts need more memory than the whole file...
    >>> with h5py.File(io.BytesIO(), "w") as file:
    ...     file.attrs["axes"] = ["x", "load"]
    ...     _letters_in_attributes(file, range(MAX_FILE_BYTES // 2 + 1))  # as long as a large file
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: attribute 'axes' holds too many texts, 2. Delete it
    """
    import h5py

    letters = 0
    for name in item.attrs:
        attribute = item.attrs.get_id(name)
        count = math.prod(attribute.shape or ())
        if h5py.check_string_dtype(attribute.dtype):
            if count > 1 and count * len(content) > MAX_FILE_BYTES:
                raise InputError(f"attribute {name!r} holds too many texts, {count}. Delete it")
            letters += sum(map(len, np.ravel(item.attrs[name]).tolist()))
        else:
            letters += count
        _check_letters(letters, content)
    return letters


def _padded_size(dataset: Any) -> int:
    """Return the number of values in all chunks, which may extend beyond the array.

    >>> from types import SimpleNamespace
    >>> _padded_size(SimpleNamespace(shape=(7, 4), chunks=(3, 4)))  # 9 x 4
    36
    >>> [_padded_size(SimpleNamespace(shape=shape, chunks=None)) for shape in ((7, 4), (), None)]
    [28, 1, 1]
    """
    sizes = zip(dataset.shape or (), dataset.chunks or dataset.shape or (), strict=True)
    return math.prod(-(-size // chunk) * chunk for size, chunk in sizes)


def _check_chunks(dataset: Any, made: Any) -> None:
    """Refuse chunks that unpack to another size than their shape.

    HDF5 has no limit for this size.

    A chunk may be stored without compression, or with a checksum of four bytes.

    >>> import h5py
    >>> def check(write=lambda item: None, **options):
    ...     with h5py.File(io.BytesIO(), "w") as file:
    ...         item = file.create_dataset("load", (6,), "f8", chunks=(4,), **options)
    ...         item[:] = range(6)
    ...         write(item)
    ...         try:
    ...             return _check_chunks(item, item.id.get_create_plist())
    ...         except InputError as error:
    ...             return str(error)
    >>> bool(check(compression="gzip", shuffle=True, fletcher32=True) or check(shuffle=True))
    False
    >>> check(compression="lzf")
    "'/load' is compressed by an unsupported filter. Compress it by zlib"
    >>> [check(lambda item: item.id.write_direct_chunk((4,), zlib.compress(bytes(size))),
    ...        compression="gzip") for size in (31, 32, 33)]
    ["chunks of '/load' unpack to a wrong size", None, "chunks of '/load' unpack to a wrong size"]
    >>> [check(lambda item: item.id.write_direct_chunk((0,), bytes(size), 1), compression="gzip")
    ...  for size in (32, 36)]
    [None, "chunks of '/load' unpack to a wrong size"]
    """
    filters = [made.get_filter(number)[0] for number in range(made.get_nfilters())]
    if not {*filters} <= {SHUFFLE, DEFLATE, CHECKSUM} or filters.count(DEFLATE) > 1:
        raise InputError(
            f"{dataset.name!r} is compressed by an unsupported filter. Compress it by zlib"
        )
    if DEFLATE not in filters:
        return
    chunks: list[Any] = []
    dataset.id.chunk_iter(chunks.append)
    values = math.prod(dataset.chunks)
    if len(chunks) * values > _padded_size(dataset):
        raise InputError(
            f"{dataset.name!r} has more chunks than its shape allows. Write the file again"
        )
    size = values * dataset.id.get_type().get_size()
    for chunk in chunks:
        skipped, data = dataset.id.read_direct_chunk(chunk.chunk_offset)
        inside = filters  # written before the data that are looked at
        if not skipped >> filters.index(DEFLATE) & 1:
            inside = filters[: filters.index(DEFLATE)]
            data = zlib.decompressobj().decompress(data, size + CHECKSUM_BYTES + 1)
        if len(data) != size + CHECKSUM_BYTES * (CHECKSUM in inside):
            raise InputError(f"chunks of {dataset.name!r} unpack to a wrong size")
