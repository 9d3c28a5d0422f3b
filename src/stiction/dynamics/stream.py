"""A run streamed to disk: a folder of small NetCDF files, readable at every moment."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import xarray as xr
from numpy.typing import NDArray

from stiction.dynamics.frames import FIELDS, TIME, frame_variables
from stiction.dynamics.stations import Stations
from stiction.errors import InputError
from stiction.interface import Interface
from stiction.model import FilePath, Flag, Names, check
from stiction.results import coordinate, to_dataset

FORMAT = 2
_MANIFEST = "rupture.json"


def chunk_dataset(
    values: Mapping[str, NDArray[Any]],
    interface: Interface,
    stations: Stations,
    attributes: Mapping[str, Any],
) -> xr.Dataset:
    """Frames as a labelled dataset."""
    data = {name: value for name, value in values.items() if name != "time"}
    places = {dim: coordinate(interface, dim) for dim in interface.dims}
    coordinates = {"time": (values["time"], TIME), **places, **stations.coordinates(interface)}
    return to_dataset(data, frame_variables(interface), coordinates, attributes)


def _replace(path: Path, write: Any) -> None:
    aside = path.with_name(path.name + ".tmp")
    try:
        write(aside)
        with open(aside, "rb") as stream:
            os.fsync(stream.fileno())
        os.replace(aside, path)
    except BaseException:
        aside.unlink(missing_ok=True)
        raise


class Stream:
    """The writer of a folder of chunks; each is written aside, synced and renamed.

    Parameters
    ----------
    folder : path
        Made here; refused if it holds anything and this is not a restart.
    resume : bool
        Go on after the chunks that are there.
    """

    def __init__(self, folder: str | Path, *, resume: bool = False) -> None:
        self.folder = check("store", folder, FilePath)
        self.chunks: dict[str, int] = {}  # and the last step each of them holds
        manifest = self.folder / _MANIFEST
        if manifest.exists() and resume:
            self.chunks = dict(_read_manifest(self.folder)["chunks"])
        elif self.folder.exists() and (not self.folder.is_dir() or any(self.folder.iterdir())):
            raise InputError(
                f"store: {str(self.folder)!r} exists and is not empty; give a new folder, or "
                "restart from a checkpoint to go on with this one"
            )
        self.folder.mkdir(parents=True, exist_ok=True)

    def drop_after(self, step: int) -> None:
        """Forget chunks with anything later than a step: the restarted run writes it again."""
        kept = [name for name, last in self.chunks.items() if last <= step]
        for name in list(self.chunks)[len(kept) :]:
            (self.folder / name).unlink(missing_ok=True)
        self.chunks = {name: self.chunks[name] for name in kept}
        self._write_manifest()

    def append(self, dataset: xr.Dataset, last_step: int) -> None:
        """Write one more chunk, which goes up to a step.

        Raises
        ------
        OSError
            If it cannot be written (disk full); the chunks before it stay readable.
        """
        name = f"frames-{len(self.chunks):06d}.nc"
        try:
            _replace(
                self.folder / name,
                lambda path: dataset.to_netcdf(path, engine="netcdf4"),
            )
            self.chunks[name] = last_step
            self._write_manifest()
        except (OSError, RuntimeError) as error:  # the NetCDF library reports a full disk so
            self.chunks.pop(name, None)
            raise OSError(
                f"store: cannot write {name} to {str(self.folder)!r} ({error}); the "
                f"{len(self.chunks)} chunks before it are complete and can be opened"
            ) from error

    def _write_manifest(self) -> None:
        text = json.dumps({"format": FORMAT, "chunks": self.chunks}, indent=1)
        _replace(self.folder / _MANIFEST, lambda path: path.write_text(text))


def _read_manifest(folder: Path) -> dict[str, Any]:
    try:
        manifest: dict[str, Any] = json.loads((folder / _MANIFEST).read_text())
    except (OSError, ValueError) as error:
        raise InputError(f"store: {str(folder)!r} is not a streamed rupture ({error})") from None
    if manifest.get("format") != FORMAT:
        raise InputError(
            f"store: {str(folder)!r} has format version {manifest.get('format')!r}, this version "
            f"reads {FORMAT}"
        )
    return manifest


def open_rupture(
    folder: str | Path, *, variables: Sequence[str] | None = None, steps: bool = True
) -> xr.Dataset:
    """Read a streamed run, also one that is still going on or was cut short.

    Parameters
    ----------
    folder : path
        As given to `simulate_rupture` as `store`.
    variables : sequence of str, optional
        Fields over ('time', 'x'), or ('time', 'x', 'y'), to load; all that were stored if left out.
    steps : bool
        Load the record of every step too, and that of stations.

    Returns
    -------
    xarray.Dataset

    Raises
    ------
    InputError
        If the folder is not such a store.
    """
    root = check("store", folder, FilePath)
    if variables is not None:
        variables = check("variables", variables, Names)
    check("steps", steps, Flag)
    parts = []
    for name in _read_manifest(root)["chunks"]:
        with xr.open_dataset(root / name, engine="netcdf4") as data:
            unwanted = [] if steps else [v for v in data if "step" in data[v].dims]
            if variables is not None:
                unwanted += [v for v in FIELDS if v in data and v not in variables]
            parts.append(data.drop_vars(unwanted).load())
    if not parts:
        raise InputError(f"store: {str(root)!r} holds no frames yet")
    framed = xr.concat(
        [p.drop_dims("step", errors="ignore") for p in parts],
        dim="time",
        data_vars="minimal",
        coords="minimal",
        compat="override",
        join="override",
    )
    if steps and any("step" in p.sizes for p in parts):
        names = [v for v in parts[0] if "step" in parts[0][v].dims]
        framed = framed.merge(
            xr.concat(
                [p[names].drop_vars(("time", "x", "y"), errors="ignore") for p in parts],
                dim="step",
                join="override",
            )
        )
    framed.attrs = parts[-1].attrs
    return framed
