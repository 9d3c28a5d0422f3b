"""All studies in one NetCDF file, a group for each."""

from __future__ import annotations

import json
from pathlib import Path

import xarray as xr

from stiction import __version__
from stiction._files import write_atomically
from stiction._model import to_plain
from stiction.papers.albertini2020.data import Data


def write_results(path: Path, data: Data) -> Path:
    """Write the studies with all it takes to compute them again.

    Parameters
    ----------
    path : Path
        Replaced as a whole if it is there.
    data : Data
    """
    root = xr.Dataset(
        attrs={
            "title": "Stochastic properties of static friction: the paper's studies",
            "stiction_version": __version__,
            "setting": json.dumps(to_plain(data.setting)),
            "samples": data.samples,
            "seed": data.seed,
        }
    )

    def write(aside: Path) -> None:
        root.to_netcdf(aside, mode="w")
        for name, dataset in data.studies.items():
            # The histogram and the profiles compress; what is random does not, and is kept whole.
            encoding = {
                str(key): {"zlib": True, "complevel": 1}
                for key, variable in dataset.data_vars.items()
                if variable.ndim > 1 and variable.dtype.kind == "i"
            }
            dataset.to_netcdf(aside, mode="a", group=name, encoding=encoding)

    write_atomically(path, write)
    return path
