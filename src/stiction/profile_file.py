"""A strength profile of one's own, read from a file and put on the nodes."""

from __future__ import annotations

import csv
import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stiction._model import describe
from stiction.errors import InputError, warn_accuracy
from stiction.interface import Interface

Array = NDArray[np.float64]

ENDINGS = (".npy", ".csv", ".nc")


def read_profile(path: Path, interface: Interface) -> Array:
    """Peak strength at the nodes, from a file.

    Parameters
    ----------
    path : Path
        ``.npy``: shape (nodes,). ``.csv``: one column of strengths, or two columns x (m) and
        strength (Pa), with or without a line of names. ``.nc``: one variable over one dimension
        (the one called strength or tau_p if there are several), with x (m) if it has that
        coordinate.
    interface : Interface

    Returns
    -------
    (nodes,) array, Pa
        As given where the file has one value for each node; with x elsewhere than at the nodes,
        interpolated linearly and periodically.

    Raises
    ------
    InputError
        If the file cannot be read, holds no such profile, or does not fit the interface.

    Warns
    -----
    AccuracyWarning
        If the profile is interpolated.
    """
    readers = {".npy": _read_npy, ".csv": _read_csv, ".nc": _read_netcdf}
    if path.suffix not in readers:
        raise InputError(f"{path}: a profile must end in {', '.join(ENDINGS)}")
    try:
        x, strength = readers[path.suffix](path)
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error}") from None
    if strength.ndim != 1 or strength.size == 0:
        raise InputError(f"{path}: must hold one profile, got shape {strength.shape}")
    if not np.all(np.isfinite(strength)):
        raise InputError(
            f"{path}: must be finite; entry {int(np.argmin(np.isfinite(strength)))} is not"
        )
    if x is None:
        if strength.size != interface.nodes:
            raise InputError(
                f"{path}: has {strength.size} values, the interface has {interface.size} nodes"
                " (interface.size); give a value for each node, or x beside the values"
            )
        return strength
    return _on_nodes(path, x, strength, interface)


def _on_nodes(path: Path, x: Array, strength: Array, interface: Interface) -> Array:
    length = interface.extent
    problems = []
    if not np.all(np.isfinite(x)) or not np.all(np.diff(x) > 0.0):
        problems.append(f"{path}: x must be finite and increase from line to line")
    elif x[0] < 0.0 or x[-1] > length * (1.0 + 1e-9):
        problems.append(
            f"{path}: x must lie in [0, {length:g}] m (interface.extent), got {x[0]:g} to {x[-1]:g}"
        )
    if problems:
        raise InputError(problems)
    nodes = interface.x
    if x.size == nodes.size and np.allclose(x, nodes, rtol=0.0, atol=1e-6 * interface.spacing):
        return strength
    gap = float(np.max(np.diff(np.append(x, x[0] + length))))
    warn_accuracy(
        f"{path}: {x.size} points are interpolated linearly to {nodes.size} nodes; the widest gap"
        f" between them is {gap:.3g} m, {gap / interface.spacing:.3g} times the spacing of nodes"
    )
    return np.interp(nodes, x, strength, period=length)


def _read_npy(path: Path) -> tuple[Array | None, Array]:
    try:
        array = np.load(path, allow_pickle=False)
    except ValueError as error:
        raise InputError(f"{path}: is not a .npy file of numbers: {error}") from None
    if array.dtype.kind not in "fiu":
        raise InputError(f"{path}: must hold numbers, got {array.dtype}")
    return None, np.ascontiguousarray(np.squeeze(array), dtype=np.float64)


def _read_csv(path: Path) -> tuple[Array | None, Array]:
    with path.open(newline="", encoding="utf-8-sig") as file:
        lines = [
            [cell.strip() for cell in line]
            for line in csv.reader(row for row in file if not row.lstrip().startswith("#"))
            if any(cell.strip() for cell in line)
        ]
    if lines and not any(_is_number(cell) for cell in lines[0]):
        del lines[0]  # names
    if len(lines) == 1 and len(lines[0]) > 2:  # one line of values
        lines = [[cell] for cell in lines[0]]
    widths = {len(line) for line in lines}
    if widths not in ({1}, {2}):
        raise InputError(
            f"{path}: must have one column (strength, Pa) or two (x, m, and strength, Pa)"
        )
    for number, line in enumerate(lines):
        if not all(_is_number(cell) for cell in line):
            raise InputError(f"{path}: entry {number} is no number: {describe(','.join(line))}")
    table = np.array(lines, dtype=np.float64)
    return (None, table[:, 0]) if table.shape[1] == 1 else (table[:, 0], table[:, 1])


def _is_number(text: str) -> bool:
    try:
        return not math.isnan(float(text)) or text.lower() == "nan"
    except ValueError:
        return False


def _read_netcdf(path: Path) -> tuple[Array | None, Array]:
    import xarray as xr

    try:
        with xr.open_dataset(path) as opened:
            data = opened.load()
    except ValueError as error:
        raise InputError(f"{path}: is no NetCDF file: {error}") from None
    named: dict[str, Any] = {
        str(name): variable.squeeze(drop=True)
        for name, variable in data.data_vars.items()
        if variable.squeeze().ndim == 1 and variable.dtype.kind in "fiu"
    }
    chosen = [named[name] for name in ("strength", "tau_p") if name in named] or [*named.values()]
    if not chosen or (len(chosen) > 1 and "strength" not in named and "tau_p" not in named):
        raise InputError(
            f"{path}: must hold one profile called strength (Pa), got {', '.join(named) or 'none'}"
        )
    profile = chosen[0]
    x = profile.coords["x"].values.astype(np.float64) if "x" in profile.coords else None
    return x, np.ascontiguousarray(profile.values, dtype=np.float64)
