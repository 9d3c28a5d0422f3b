"""Users' profiles: put them on the nodes of an interface, and read them from files.

A profile enters as an argument of a call or an object (`at_nodes`),
through `read_profile`, or by its name in a study file
(`profile_in_file`). Its quantity is found in the source and converted
to SI in `reading/labels.py`.

The nodes are x_i = i L/n in each direction. The interface
is periodic, so points may come in any order and begin
anywhere. On a specimen, the nodes are x_i = (i + 1/2)
L/n, and the profile stops at its ends. The steps of placing are:

1. Find the common offset of the points from the nodes, as a fraction of
   the spacing. Warn about an offset. Refuse points that do not lie on
   nodes.
2. Number the node of each point. Refuse two different values at a node.
3. Give each node the value of its point, or NaN.
4. Refuse missing values, unless the caller can use them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from stiction.base.arrays import Array
from stiction.base.errors import InputError, prefixed, unknown_name, warn_accuracy
from stiction.base.model import FilePath, Number, as_numbers, check, checked, real_array
from stiction.base.variables import QUANTITIES
from stiction.problem.interface import Interface
from stiction.problem.reading.columns import Wanted
from stiction.problem.reading.labels import (
    OF_A_PLANE,
    Missing,
    check_positive,
    is_labelled,
    labelled,
    simplified,
)
from stiction.problem.reading.tables import Options

if TYPE_CHECKING:
    import xarray as xr

TOLERANCE = 0.02
"""Fraction of the spacing by which rounding in a file may move a point."""


def points_of(array: Any) -> tuple[Array, dict[str, Array]]:
    """Return values (..., points) and positions (m) by direction.

    Values without coordinates keep their shape, and their dictionary of
    positions is empty.
    """
    dims = [dim for dim in ("x", "y") if dim in array.coords]
    if len(dims) == 2 and "row" not in array.dims:
        array = array.stack(row=dims, create_index=False)
    return array.values, {dim: array[dim].values for dim in dims}


def place(array: Any, interface: Interface) -> Array:
    """Return values at the nodes of an interface (..., *shape), with NaN at missing points."""
    values, places = points_of(array)
    if not places:
        shape = values.shape[-len(interface.shape) :]
        if shape != interface.shape:
            hint = turned(shape, interface.shape)
            if not interface.is_plane:
                hint = ". Give a value for each node, or positions (x=...)"
            raise InputError(f"must have shape {interface.shape}, got shape {shape}{hint}")
        return values
    if values.size == 0:
        raise InputError("has no values")
    # 1. Find the offset from the nodes.
    offsets = [_offset(dim, places[dim], interface) for dim in interface.dims]
    # 2. Number nodes.
    steps = [
        np.round(places[dim] / h - interface.first - offset).astype(np.int64)
        for dim, h, offset in zip(interface.dims, interface.spacings, offsets, strict=True)
    ]
    if interface.is_free:
        flat, at = steps[0], places["x"]
        if not 0 <= flat.min() <= flat.max() < interface.size:
            raise InputError(
                f"x extends from {at.min():g} to {at.max():g} m, beyond a specimen of"
                f" {interface.measure:g} m. Crop the record or move its coordinates, as in"
                " profile.assign_coords(x=profile.x - profile.x.min())"
            )
    else:
        flat = np.ravel_multi_index(steps, interface.shape, mode="wrap")
    node, first, twins = np.unique(flat, return_index=True, return_inverse=True)
    _check_repeats(values, places, first[twins], interface)
    # 3. Put values on the nodes.
    full = np.full((*values.shape[:-1], interface.size), np.nan)
    full[..., node] = values[..., first]
    return full.reshape(*values.shape[:-1], *interface.shape)


def turned(given: tuple[int, ...], shape: tuple[int, ...]) -> str:
    """Return a hint for the message about the shape of a plane, if its axes are swapped."""
    if len(shape) == 2 and given == shape[::-1]:
        return ". x and y are swapped: the first axis of a profile is x"
    return ""


def _offset(dim: str, x: Array, interface: Interface) -> float:
    """Return the offset of the points from the nodes, in spacings, in (-0.5, 0.5] (step 1)."""
    axis = interface.dims.index(dim)
    spacing, length = interface.spacings[axis], interface.lengths[axis]
    formula, cells = f"{dim}_i = i L/n", ", as at the centres of cells"
    if interface.is_free:
        formula, cells = f"{dim}_i = (i + 1/2) L/n", ""
    at = np.unique(x) / spacing - interface.first
    if at[-1] - at[0] > interface.shape[axis] + TOLERANCE:
        period = np.ptp(x) + spacing * np.median(np.diff(at))  # both ends are not one place
        raise InputError(
            f"{dim} extends from {x.min():g} to {x.max():g} m on an interface of {length:g} m."
            f" Check the unit of {dim}, crop the record, or make interface.length {period:.6g}"
        )
    first = at[0] - np.ceil(at[0] - 0.5 - TOLERANCE)
    if interface.is_free and first > 0.5 - 2.0 * TOLERANCE:
        first -= 1.0  # the node before would lie outside
    deviation = at - first - np.round(at - first)
    coarse = not interface.is_plane and (at.size < 2 or np.median(np.diff(at)) > 1.5)
    if coarse or np.abs(deviation).max() > TOLERANCE:
        advice = "" if interface.is_plane else ", as in profile.interp(x=problem.interface.x)"
        raise InputError(
            f"the {at.size} points of {dim}, from {x.min():.6g} to {x.max():.6g} m, do not coincide"
            f" with the {interface.shape[axis]} nodes {formula}, which are {spacing:.6g} m apart."
            f" Check the unit of {dim}, or give values at the nodes (interface.{dim}){advice}"
        )
    offset = float(first + deviation.mean())
    if abs(offset) > TOLERANCE:
        warn_accuracy(
            f"{dim} is offset by {offset:.2g} of a spacing from the nodes {formula}{cells}, where"
            f" values are used. Add {offset * spacing:+.4g} m to positions in the result"
        )
    return offset


def _check_repeats(
    values: Array, places: dict[str, Array], twins: NDArray[np.int64], interface: Interface
) -> None:
    """Refuse two points at the same place, unless they have the same value a period apart."""
    rows = values.reshape(-1, twins.size)
    for i in np.flatnonzero(twins != np.arange(twins.size)):
        pair = [twins[i], i]
        sides = zip(places.values(), interface.lengths, strict=True)
        apart = max(np.ptp(x[pair]) / length for x, length in sides)
        first, second = rows.T[pair]
        if apart < 0.5 or not np.array_equal(first, second, equal_nan=True):
            where = ", ".join(
                f"{dim} = {x[twins[i]]:.9g} and {x[i]:.9g} m" for dim, x in places.items()
            )
            raise InputError(
                f"{where} are the same position on an interface of period {interface.length}"
                f" m. Keep either value{'' if interface.is_plane else OF_A_PLANE}"
            )


def refuse_missing(values: Array, interface: Interface) -> Array:
    """Return values (..., *shape). Refuse NaN among them (step 4)."""
    missing = np.isnan(values)
    if missing.any():
        rows = missing.reshape(-1, *interface.shape)
        row = int(np.argmax(rows.any(axis=interface.axes)))
        raise InputError(
            f"values are missing (NaN) at {rows[row].sum()} of {interface.size} nodes"
            f"{f' of sample {row}' * (len(rows) > 1)}, the first at"
            f" {interface.describe_node(int(np.argmax(rows[row])))}. Make interface.length the"
            " length of the record, or draw equally likely values there with"
            " RandomField.given(profile)"
        )
    return values


def at_nodes(name: str, value: Any, interface: Interface, *, missing: bool = False) -> Any:
    """Return the values of a quantity at the nodes. With `missing`, some may be NaN.

    `name` may be a dotted key. Numbers, and arrays with a different
    shape, are returned unchanged, because the caller checks them.
    """
    quantity = quantity_of(name)
    with prefixed(name):
        if hasattr(value, "options"):  # a `ProfileFile`
            value = value.to_xarray(interface)
        value = simplified(value, quantity)
        if is_labelled(value):
            array = labelled(value, quantity, interface.dims)
            if array.ndim == 1 and not {*array.dims} <= {"x", "row"}:  # a value for each sample
                if quantity == "strength":
                    raise InputError(
                        "has no dimension along the interface. Name this dimension 'x'"
                    )
                return array.values[:, np.newaxis]
            array = place(array, interface)
            return array if missing else refuse_missing(array, interface)
        with suppress(TypeError):  # values that are no numbers are refused with other mistakes
            array = real_array(value)
            if array.shape[-len(interface.shape) :] == interface.shape:
                return array if missing else refuse_missing(array, interface)
    return value


def quantity_of(key: str) -> str:
    """Return the quantity that the parameter with this name or dotted key holds."""
    field = key.rsplit(".", 1)[-1]
    return "load_profile" if field == "profile" else field


@checked
def read_profile(
    source: Any,
    *,
    x: Wanted = None,
    value: Wanted = None,
    unit: str | None = None,
    x_unit: str | None = None,
    quantity: str = "strength",
    strength: Callable[[Any], Any] | None = None,
    missing: Missing | None = None,
    decimal: Literal[".", ","] | None = None,
    skip: Number = 0,
    sheet: Number | str = 0,
    interface: Interface | None = None,
) -> xr.DataArray:
    """Read a profile along the interface from a file or a labelled array, in SI units.

    A column is read if its heading, or the caller, says that it is the
    wanted quantity; if more than one column could be it, none is read.

    Parameters
    ----------
    source : path, array, or table with labels
        Labels of xarray and pandas are used, and units of pint and astropy. A
        ``.csv``, ``.txt``, ``.dat``, ``.tsv`` or ``.xlsx`` file has columns, with
        or without a line of names such as ``x (mm), strength (MPa)``. An ``.npy``
        file has the shape (nodes,) or (nx, ny), a ``.nc`` file variables with
        `units`, and x as a coordinate. A map over 'x' and 'y' is a table with both
        as columns, or a binary file or object that SurfaceTopography reads.
    x, value : str or int, optional
        Heading, name or number (from 0) of the column, coordinate or variable. By
        default `value` is the column called as the quantity, tau_p, shear strength,
        COF, Reibzahl, ... or the only column with numbers besides x, specimens and
        times, and `x` is the column called x, position, travel, Weg, ... or the only
        column in a unit of length. If two columns have no headings, the first is x.
    unit, x_unit : str, optional
        Units of values and positions that the source does not state. By default SI.
    quantity : str
        'strength', 'residual_strength', 'initial_stress',
        'normal_pressure' (Pa), 'critical_slip', 'height' (m),
        'weakening_rate' (Pa/m), 'load_profile' or
        'friction_coefficient' (1).
    strength : callable, optional
        Map from heights (m) to strengths (Pa): ``lambda h: 1e6 + 5e11 * h``.
    missing : float, str or sequence of them, optional
        Numbers and words that mark a missing value, such as ``-9999`` or ``"Bad"``.
        Empty cells, ``nan``, ``n/a``, ``-``, ``***`` and ``#N/A`` always do.
    decimal : {".", ","}, optional
        Decimal mark of a text file, needed if it could also separate thousands.
    skip : int
        Number of lines or rows to pass over before the headings.
    sheet : int or str
        Number (from 0) or name of the sheet of a workbook.
    interface : Interface, optional
        Map the profile to the nodes x_i = i L/n, modulo L. Points may have any
        order, and no point may be missing. Without an interface, missing values stay
        (NaN), for `fit_field` or `RandomField.given`, which draws them.

    Returns
    -------
    xarray.DataArray
        Profile over 'x' (m), or over 'x' and 'y' on a plane, with
        `units`. Attributes state what was read: file, column, unit,
        number of values, other columns, and rows that were left out.

    Raises
    ------
    InputError
        If the source cannot be read, a unit is unknown or unsuitable, columns
        are ambiguous, or the profile does not fit the interface.

    Warns
    -----
    AccuracyWarning
        If x lies between the nodes.
    UnitWarning
        If heights without a unit range over more than 1 mm.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> import numpy as np
    >>> import stiction as st
    >>> interface = st.Interface(length=0.1, nodes=8)
    >>> path = Path(tempfile.mkdtemp()) / "profile.csv"
    >>> table = np.column_stack([interface.x * 1e3, np.linspace(0.8, 1.2, 8)])
    >>> np.savetxt(path, table, delimiter=",", header="x (mm),strength (MPa)", comments="")
    >>> profile = st.read_profile(path, interface=interface)
    >>> round(float(profile.values.max()), 6)  # in Pa, as all of the package
    1200000.0
    """
    import xarray as xr

    if quantity not in QUANTITIES:
        raise InputError(unknown_name("quantity", quantity, QUANTITIES))
    if strength is not None and quantity != "strength":
        raise InputError("strength: maps heights to strengths. Leave quantity='strength'")
    options = Options(skip, sheet, missing, decimal)
    dims = None if interface is None else interface.dims
    with prefixed(str(source) if isinstance(source, str | Path) else "source"):
        # 1. Find the quantity.
        array = labelled(
            source, "height" if strength else quantity, dims, x=x, value=value, unit=unit,
            x_unit=x_unit, options=options,
        )  # fmt: skip
        read = array.attrs
        # 2. Map heights.
        if strength is not None:
            array = array.copy(data=_mapped(strength, array.values))
        single = [dim for dim in {*array.dims} - {"x", "y", "row"} if array.sizes[dim] == 1]
        array = array.squeeze(single)
        if not {*array.dims} <= {"x", "y", "row"}:
            raise InputError(f"must hold a single profile, got shape {array.shape}")
        # 3. Place or sort the values.
        if interface is None:
            array = _in_order(array)
        else:
            values = refuse_missing(place(array, interface), interface)
            array = xr.DataArray(values, interface.coordinates, interface.dims)
    for dim in {"x", "y"} & {*array.coords}:
        array[dim].attrs.update(units="m", long_name=f"position along {dim}")
    names = {"units": QUANTITIES[quantity].units, "long_name": quantity.replace("_", " ")}
    array.attrs = names | read
    return array.rename(quantity)


def _mapped(strength: Callable[[Any], Any], heights: Array) -> Array:
    """Return strengths, Pa, from heights, m. Missing heights give NaN (step 2)."""
    values = as_numbers(strength(heights.copy()))
    if values.shape != heights.shape:
        shapes = f"got shape {values.shape} for {heights.shape}"
        raise InputError(f"strength: must return a strength for each height, {shapes}")
    values = np.where(np.isnan(heights), np.nan, values)
    check_positive(values, "strength")
    return values


def _in_order(array: Any) -> Any:
    """Return a profile with rising coordinates, and points on a plane as a map (step 3)."""
    if "row" in array.dims:
        array = array.set_index(row=["x", "y"])
    for index in array.indexes.values():
        if index.has_duplicates:
            twin = index[index.duplicated()]
            raise InputError(
                f"x repeats: there are two values at {twin[0]} m ({twin.size} such places). Keep"
                f" either, or pass skip= with the lines above the last record{OF_A_PLANE}"
            )
    array = array.unstack()
    return array.sortby([dim for dim in array.dims if dim in array.coords])


# -- profiles in study files -----------------------------------------------------------------------


class ProfileFile(NamedTuple):
    """A profile file named in a study file. It is read when the interface is known."""

    path: Path
    options: dict[str, Any]

    def to_xarray(self, interface: Interface | None = None) -> xr.DataArray:
        """Read the file, and place its values on an interface."""
        return read_profile(self.path, interface=interface, **self.options)


def profile_in_file(given: Any, field: str, folder: Path) -> Any:
    """Return the profile named in a study file by its path, or by `file` and reader options."""
    table = dict(given) if isinstance(given, Mapping) else {"file": given}
    if "file" not in table:
        return given
    path = folder / check("file", table.pop("file"), FilePath)
    reserved = sorted(table.keys() & {"source", "quantity", "interface"})
    if reserved:
        raise InputError(f"{reserved[0]}: is not an option in a study file")
    return ProfileFile(path, table | {"quantity": quantity_of(field)})
