"""Results as files for other programs, with units: the suffix selects the format."""

from __future__ import annotations

import errno
import os
import shutil
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from stiction.base.errors import InputError, warn_accuracy
from stiction.base.files import cannot, write_whole
from stiction.base.variables import DIRECTION

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

OVERHEAD = 2**16


def export(result: xr.Dataset, path: Path) -> None:
    """Write a result as NetCDF (.nc) or as a table (.csv), whole or not at all."""
    if path.suffix == ".nc":
        write_result(result, path)
    elif path.suffix == ".csv":
        frame = table_of(result)
        # Numbers are written as the shortest text that reads back to the same bits.
        write_whole(path, lambda aside: frame.to_csv(aside, index=False, na_rep="nan"))
    else:
        raise InputError(f"{path}: the suffix must be .nc or .csv, got {path.suffix!r}")


def write_result(result: xr.Dataset, path: Path) -> None:
    """Write a result as a NetCDF file with checksums, whole or not at all."""
    with suppress(OSError):
        free = shutil.disk_usage(path.parent).free
        # NetCDF does not report a full disk, and keeps its unfinished file open.
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


def table_of(result: xr.Dataset) -> pd.DataFrame:
    """Return a table with a column for each variable and a row for each sample and point.

    Columns are named ``name (unit)``: swept keys, the sample number, results. The curves of
    equally likely interfaces are left out, but their band stays.
    """
    result = result.drop_dims("member", errors="ignore")
    wide = sorted(
        str(name)
        for name, values in result.data_vars.items()
        if "sample" in values.dims
        and {*values.dims[values.dims.index("sample") + 1 :]} - {DIRECTION}
    )
    if wide:
        warn_accuracy(
            f"{', '.join(wide)}: has several numbers for each sample and does not fit into a table."
            " Export a .nc file to keep it"
        )
    narrow = result.drop_vars(wide)
    for name, values in narrow.data_vars.items():
        if DIRECTION in values.dims:  # a column for each component
            parts = {
                f"{name}_{c.item()}": values.sel({DIRECTION: c}) for c in values[DIRECTION]
            }
            narrow = narrow.drop_vars([name]).assign(parts)
    rows = list(dict.fromkeys(dim for v in narrow.data_vars.values() for dim in v.dims))
    narrow = narrow.drop_dims({*narrow.dims} - {*rows})
    names = dict.fromkeys([*narrow.coords, *rows, *narrow.data_vars])
    units = {name: narrow[name].attrs.get("units", "1") for name in names}
    frame = narrow.to_dataframe(dim_order=rows).reset_index()[list(names)]
    return frame.rename(columns={name: f"{name} ({unit})" for name, unit in units.items()})
