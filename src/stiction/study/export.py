"""Results as files for other programs: the suffix says which kind, and units go along."""

import errno
import os
import shutil
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray

from stiction.errors import InputError, warn_accuracy
from stiction.files import cannot, write_whole
from stiction.results import DIRECTION

OVERHEAD = 2**16
SUFFIXES = (".nc", ".csv")


def check_suffix(path: Path) -> None:
    """Refuse a file name whose suffix does not say what can be written."""
    if path.suffix not in SUFFIXES:
        raise InputError(
            f"{path}: the suffix says what is written, and must be one of {', '.join(SUFFIXES)};"
            f" got {path.suffix or 'none'!r}"
        )


def export(result: xr.Dataset, path: Path) -> None:
    """Write a result as its suffix says, whole or not at all.

    Parameters
    ----------
    result : Dataset
        From `monte_carlo`, `Study.run` or `open_run(...).dataset()`.
    path : Path
        ``.nc`` (NetCDF) holds everything. ``.csv`` holds a table: a row a sample, columns named
        ``name (unit)`` with the unit 1 for pure numbers, every number in full, ``nan`` where a
        sample is missing. Profiles along the interface are left out with a warning.

    Raises
    ------
    StoreError
        If it cannot be written.
    """
    if path.suffix == ".nc":
        write_result(result, path)
        return
    frame = pd.DataFrame(columns(result))
    # Numbers are written as the shortest text that reads back to the same bits.
    write_whole(path, lambda aside: frame.to_csv(aside, index=False, na_rep="nan"))


def write_result(result: xr.Dataset, path: Path) -> None:
    """Write a result as one NetCDF file with checksums, whole or not at all."""
    with suppress(OSError):
        free = shutil.disk_usage(path.parent).free
        # The NetCDF library does not say that the disk is full, and holds on to what it has begun.
        if free < 1.05 * result.nbytes + OVERHEAD:
            raise cannot("written", path, OSError(errno.ENOSPC, os.strerror(errno.ENOSPC)))
    encoding = {
        str(name): {"fletcher32": True}
        for name, variable in result.variables.items()
        if variable.ndim and variable.size and variable.dtype.kind in "fiub"
    }
    write_whole(
        path, lambda aside: result.to_netcdf(aside, engine="netcdf4", encoding=encoding)
    )


def columns(result: xr.Dataset) -> dict[str, NDArray[Any]]:
    """Return one column a variable, one row a sample at each point of the sweep.

    Parameters
    ----------
    result : Dataset

    Returns
    -------
    dict of (rows,) arrays
        By ``name (unit)``: what is swept, the sample number, what was found.
    """
    named = {str(name): variable for name, variable in result.data_vars.items()}
    narrow = {name: v for name, v in named.items() if not {"x", "y"} & set(v.dims)}
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
    along = {
        str(name): v.variable for name, v in result.coords.items() if set(v.dims) <= set(dims)
    }
    table = {}
    for name, variable in (*along.items(), *((n, v.variable) for n, v in narrow.items())):
        full = variable.set_dims(sizes).transpose(*dims)
        table[f"{name} ({variable.attrs.get('units', '1')})"] = np.asarray(full.values).ravel()
    return table
