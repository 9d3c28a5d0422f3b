"""Read users' profiles in SI, and put them on the nodes of an interface.

A profile enters in three ways: through `read_profile`, as an argument
of a call or an object (`at_nodes`), or by its name in a study file
(`profile_in_file`). The profiles of samples enter together
(`placed_profiles`). `read_profile`, which study files also use, takes
these steps. `at_nodes` takes steps 1 and 3:

1. Find the quantity in the source, in SI (`labels.py`).
2. Turn heights into strengths, if the caller gives a map.
3. Put the values on the nodes (`placing.py`), or sort them if there is
   no interface.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np

from stiction.base.arrays import Array
from stiction.base.errors import InputError, prefixed, unknown_name
from stiction.base.model import (
    FilePath,
    Number,
    as_numbers,
    check,
    checked,
)
from stiction.base.variables import QUANTITIES
from stiction.problem.interface import Interface
from stiction.problem.profiles.placing import place, quantity_of, refuse_missing
from stiction.problem.reading.columns import Wanted
from stiction.problem.reading.labels import (
    OF_A_PLANE,
    Missing,
    check_positive,
    labelled,
)
from stiction.problem.reading.tables import Options

if TYPE_CHECKING:
    import xarray as xr

READ = ("source", "column", "unit_in_source", "values", "other_columns", "left_out")
"""Attributes that state what was read."""


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
        Labels of xarray and pandas are used, and units of pint
        and astropy. An ``.npy`` file has the shape (nodes,) or
        (nx, ny). A ``.csv``, ``.txt``, ``.dat``, ``.tsv`` or
        ``.xlsx`` file has columns, with or without a line of
        names such as ``x (mm), strength (MPa)``. A ``.nc`` file
        has variables with `units`, and x as a coordinate. A map
        over 'x' and 'y' is a table with both as columns, a matrix
        below comments that state its width and height (Gwyddion), or
        a binary file or object that SurfaceTopography reads.
    x, value : str or int, optional
        Heading, name or number (from 0) of the column, coordinate or
        variable. By default `value` is the column called as the
        quantity, tau_p, shear strength, COF, Reibzahl, ... or the only
        column with numbers besides x, specimens and times, and `x` is
        the column called x, position, travel, Weg, ... or the only
        column in a unit of length. If two columns have no headings, the
        first is x.
    unit, x_unit : str, optional
        Units of the values and the positions, if the source does not
        state them. By default SI.
    quantity : str
        'strength', 'residual_strength', 'initial_stress',
        'normal_pressure' (Pa), 'critical_slip', 'height' (m),
        'weakening_rate' (Pa/m), 'load_profile' or
        'friction_coefficient' (1).
    strength : callable, optional
        Map from heights (m, an array) to strengths (Pa):
        ``strength=lambda h: 1e6 + 5e11 * h``. Heights are then read.
    missing : float, str or sequence of them, optional
        Numbers and words that stand for a missing value, such as
        ``-9999`` or ``"Bad"``. Empty cells, ``nan``, ``n/a``, ``-``,
        ``***`` and ``#N/A`` always do.
    decimal : {".", ","}, optional
        Decimal mark of a text file. It is needed if the mark could also
        separate thousands.
    skip : int
        Number of lines, or rows of a sheet, to pass over before the headings.
    sheet : int or str
        Number (from 0) or name of the sheet of a workbook.
    interface : Interface, optional
        Map the profile to the nodes x_i = i L/n, modulo L. Points may
        have any order, and no point may be missing. Without an
        interface, missing values (NaN, empty cells) stay, for
        `stiction.fit_field` or for `RandomField.given`, which draws
        equally likely values.

    Returns
    -------
    xarray.DataArray
        Profile over 'x' (m), or over 'x' and 'y' on a plane, with
        `units`. Attributes state what was read: file, column, unit,
        number of values, other columns, and rows that were left out.

    Raises
    ------
    InputError
        If the source cannot be read, a unit is
        unknown or unsuitable, columns are ambiguous,
        or the profile does not fit the interface.

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
    array.attrs = names | {key: read[key] for key in READ if read.get(key)}
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
