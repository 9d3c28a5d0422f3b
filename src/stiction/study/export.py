"""Results as files for other programs: the suffix says which kind, and units go along."""

from __future__ import annotations

import csv
import errno
import importlib.util
import json
import math
import os
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from stiction.errors import InputError, warn_accuracy
from stiction.files import cannot_write, write_dataset
from stiction.progress import Meter
from stiction.results import DIRECTION

ROWS = 2**14
OVERHEAD = 2**16
NEEDS = {".parquet": "pyarrow", ".zarr": "zarr"}
SUFFIXES = (".nc", ".csv", ".parquet", ".zarr")


def check_suffix(path: Path) -> None:
    """Refuse a file name whose suffix does not say what can be written.

    Raises
    ------
    InputError
        Naming the suffixes that can be, or the library that is missing.
    """
    if path.suffix not in SUFFIXES:
        raise InputError(
            f"{path}: the suffix says what is written, and must be one of {', '.join(SUFFIXES)};"
            f" got {path.suffix or 'none'!r}"
        )
    library = NEEDS.get(path.suffix)
    if library is not None and importlib.util.find_spec(library) is None:
        raise InputError(
            f"{path}: {path.suffix} needs {library}, which is not installed: python -m pip install"
            f" {library}; or write .nc or .csv"
        )


def export(result: xr.Dataset, path: str | Path) -> None:
    """Write a result as its suffix says, whole or not at all.

    Parameters
    ----------
    result : Dataset
        From `monte_carlo`, `Study.run` or `open_run(...).dataset()`.
    path : path
        ``.nc`` (NetCDF) and ``.zarr`` (needs zarr) hold everything. ``.csv`` and ``.parquet``
        (needs pyarrow) hold a table: a row a sample, columns named ``name (unit)`` with the unit 1
        for pure numbers, every number in full, ``nan`` where a sample is missing. Profiles along
        the interface do not fit into it and are left out with a warning.

    Raises
    ------
    InputError
        If the suffix is none of these, or its library is not installed.
    StoreError
        If it cannot be written.
    """
    path = Path(path)
    check_suffix(path)
    if path.suffix == ".nc":
        write_result(result, path)
        return
    aside = path.with_name(path.name + ".part")
    write: Callable[[xr.Dataset, Path], None] = {
        ".csv": _write_csv,
        ".parquet": _write_parquet,
        ".zarr": _write_zarr,
    }[path.suffix]
    try:
        _remove(aside)
        write(result, aside)
        if path.is_dir():  # an earlier .zarr
            shutil.rmtree(path)
        os.replace(aside, path)
    except OSError as error:
        _remove(aside)
        raise cannot_write(path, error) from error


def write_result(result: xr.Dataset, path: Path) -> None:
    """Write a result as one NetCDF file with checksums, whole or not at all."""
    # The NetCDF library does not say that the disk is full, and holds on to what it has begun.
    if _free_bytes(path.parent) < 1.05 * result.nbytes + OVERHEAD:
        raise cannot_write(path, OSError(errno.ENOSPC, ""))
    try:
        write_dataset(result, path)
    except (OSError, RuntimeError) as error:  # the NetCDF library raises either
        raise cannot_write(path, error) from error


def _free_bytes(folder: Path) -> float:
    try:
        return shutil.disk_usage(folder).free
    except OSError:
        return math.inf


def _remove(path: Path) -> None:
    if path.is_dir():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)


def columns(result: xr.Dataset) -> dict[str, NDArray[Any]]:
    """One column a variable, one row a sample at each point of the sweep.

    Parameters
    ----------
    result : Dataset

    Returns
    -------
    dict of (rows,) arrays
        By ``name (unit)``: what is swept, the sample number, what was found.
    """
    named = {str(name): variable for name, variable in result.data_vars.items()}
    narrow = {name: v for name, v in named.items() if not {"x", "y", "kept_sample"} & set(v.dims)}
    wide = sorted(named.keys() - narrow.keys())
    if wide:
        warn_accuracy(
            f"{', '.join(wide)}: profiles along the interface do not fit into a table of samples"
            " and are left out; .nc holds them"
        )
    for name, v in list(narrow.items()):
        if DIRECTION in v.dims:  # a column for each component
            del narrow[name]
            narrow |= {f"{name}_{c.item()}": v.sel({DIRECTION: c}) for c in v[DIRECTION]}
    dims = tuple(dict.fromkeys(dim for v in narrow.values() for dim in v.dims))
    sizes = {dim: result.sizes[dim] for dim in dims}
    along = {str(name): v.variable for name, v in result.coords.items() if set(v.dims) <= set(dims)}
    table = {}
    for name, variable in (*along.items(), *((n, v.variable) for n, v in narrow.items())):
        full = variable.set_dims(sizes).transpose(*dims)
        table[f"{name} ({variable.attrs.get('units', '1')})"] = np.asarray(full.values).ravel()
    return table


def _write_csv(result: xr.Dataset, path: Path) -> None:
    table = columns(result)
    rows = len(next(iter(table.values())))
    with (
        path.open("w", newline="", encoding="utf-8") as file,
        Meter(f"writing {path.stem}", rows, unit="rows") as meter,
    ):
        writer = csv.writer(file)
        writer.writerow(table)
        for part in _parts(table, rows):
            writer.writerows(part)
            meter.advance(len(part))
        file.flush()
        os.fsync(file.fileno())


def _parts(table: dict[str, NDArray[Any]], rows: int) -> Iterator[list[Any]]:
    for first in range(0, rows, ROWS):
        # Python's own numbers print as the shortest text that reads back to the same bits.
        part = [column[first : first + ROWS].tolist() for column in table.values()]
        yield list(zip(*part, strict=True))


def _write_parquet(result: xr.Dataset, path: Path) -> None:
    import pyarrow
    import pyarrow.parquet

    table = pyarrow.table({name: pyarrow.array(v) for name, v in columns(result).items()})
    about = {
        key: value if isinstance(value, str) else json.dumps(value)
        for key, value in ((str(k), v) for k, v in result.attrs.items())
    }
    pyarrow.parquet.write_table(table.replace_schema_metadata(about), path)


def _write_zarr(result: xr.Dataset, path: Path) -> None:
    result.to_zarr(path)
