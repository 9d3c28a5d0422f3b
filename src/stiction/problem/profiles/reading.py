"""Measured profiles: read from files and labelled arrays, and put on the nodes of an interface.

Whatever the source, its values become a DataArray in SI: along 'x', on a plane along 'x' and 'y'
or, as a list of points, along 'row', with places (m) as coordinates 'x' and 'y' if there are any.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple

import numpy as np

from stiction.base.arrays import Array
from stiction.base.errors import (
    AccuracyWarning,
    InputError,
    UnitWarning,
    prefixed,
    unknown_name,
    warn_user,
)
from stiction.base.model import (
    FilePath,
    Flag,
    Number,
    Positive,
    Real,
    as_numbers,
    check,
    checked,
    describe,
    real_array,
)
from stiction.base.quantities import magnitude, plain
from stiction.base.units import factor_to, is_in, parse
from stiction.base.variables import QUANTITIES
from stiction.problem.interface import Interface
from stiction.problem.profiles.placing import MEASURED, OF_A_PLANE, Gaps, close_gaps, place
from stiction.problem.profiles.tables import (
    IMAGES,
    INSTRUMENTS,
    Options,
    heights_of,
    load,
    name_and_unit,
    sizes_of,
    table_of_frame,
)

if TYPE_CHECKING:
    import xarray as xr

NAMES = {
    "strength": ("tau_p", "taup", "tau", "peak_strength", "shear_strength"),
    "residual_strength": ("tau_r", "taur"),
    "initial_stress": ("tau_i", "taui"),
    "normal_pressure": ("pressure", "normal_stress", "sigma_n", "sigma"),
    "critical_slip": ("d_c", "dc"),
    "load_profile": ("profile", "load"),
    "friction_coefficient": ("mu", "coefficient"),
    "height": ("heights", "topography", "z"),
}
"""What else a quantity may be called."""
PLACES = ("x", "position", "pos", "distance", "coordinate", "lateral")
POSITIVE = (
    "strength", "normal_pressure", "critical_slip", "weakening_rate", "fracture_energy",
    "friction_coefficient",
)  # fmt: skip
"""Quantities whose values lie above zero."""
SENTINELS = np.array(
    [-99.0, -999.0, -999.25, -9999.0, -99999.0, -32768.0, 1e20, 1e30, 1e38, 9.96921e36, 1.70141e38,
     3.40282e38, -3.40282e38]
)  # fmt: skip
"""Numbers that instruments and formats write for a missing value."""
SAMPLE_NAMES = ("sample", "samples")
_UNNAMED = re.compile(r"\d+$|values?$|y\d*$")
"""Columns that say nothing of what they hold; without a heading they are called by numbers."""

LISTED_COLUMNS = 20
"""Names of columns in a message."""
TALL = 1e-3
"""Range of heights, m, from which on a unit must be stated: numbers in um or nm have more."""

Column = str | int | None
Spacing = Positive | tuple[Positive, Positive]
Offset = Real | tuple[Real, Real]
Missing = Annotated[
    float | str | tuple[float | str, ...] | list[float | str], "float | str | list"
]


@checked
def read_profile(
    source: Any,
    *,
    x: Column = None,
    value: Column = None,
    unit: str | None = None,
    x_unit: str | None = None,
    quantity: str = "strength",
    strength: Callable[[Any], Any] | None = None,
    missing: Missing | None = None,
    decimal: Literal[".", ","] | None = None,
    skip: Number = 0,
    sheet: Number | str = 0,
    record: Number | None = None,
    spacing: Spacing | None = None,
    rows: Literal["x", "y"] | None = None,
    interface: Interface | None = None,
    offset: Offset | Literal["centre"] = 0.0,
    interpolate: Flag = False,
    gaps: Gaps = "refuse",
) -> xr.DataArray:
    """Read a profile along the interface from a file or a labelled array, in SI units.

    Parameters
    ----------
    source : path, array, or table with labels
        Labels of xarray, pandas and quantities of pint and astropy count. Of files:
        ``.npy``: shape (nodes,) or (nx, ny). ``.csv``, ``.txt``, ``.dat``, ``.tsv``,
        ``.xlsx``: columns, with or without a line of names such as ``x (mm); strength
        (MPa)``. ``.nc``: variables with `units`, and x as a coordinate. A map is over 'x'
        and 'y': a table with both as columns, a matrix without headings, a grey image
        (``.png``, ``.tif``), or a binary file or object that SurfaceTopography reads.
    x, value : str or int, optional
        Name, heading or number (from 0) of the column, coordinate or variable. By default the one
        with such a name (``x``, ``position``; ``strength``, ``tau_p``), the only one in a unit of
        length or of `quantity`, or, without headings, the first and second of two columns.
    unit, x_unit : str, optional
        Units of the values and of positions if the source states none; SI by default.
    quantity : str
        'strength', 'residual_strength', 'initial_stress', 'normal_pressure' (Pa), 'critical_slip',
        'height' (m), 'weakening_rate' (Pa/m), 'load_profile' or 'friction_coefficient' (1).
    strength : callable, optional
        Map from heights (m, an array), or from the grey values of an image, to strengths (Pa):
        ``strength=lambda h: 1e6 + 5e11 * h``. Heights are then read.
    missing : float, str or sequence of them, optional
        Numbers and words that stand for a missing value, such as ``-9999`` or ``"Bad"``. Empty
        cells, ``nan``, ``n/a``, ``-``, ``***`` and ``#N/A`` always do.
    decimal : {".", ","}, optional
        Decimal mark of a text, if the file does not tell it from a mark of thousands.
    skip : int
        Number of lines, or rows of a sheet, to pass over before the headings.
    sheet : int or str
        Number (from 0) or name of the sheet of a workbook.
    record : int, optional
        Number (from 0) of the record, if empty lines or repeated headings separate several.
    spacing : float or (float, float), optional
        Distance of the points along x, and along y, of an array, a matrix or an image, m.
    rows : {"x", "y"}, optional
        Direction in which the lines of a matrix in a text follow each other. It is y if
        comments state the width and height of the map, as Gwyddion writes them.
    interface : Interface, optional
        Map the profile to the nodes x_i = i L/n, modulo L, from points in any order.
    offset : float, (float, float) or "centre"
        Is added to the coordinates, m; or the centre of the record is put on the centre of
        the interface.
    interpolate : bool
        Interpolate linearly if the points of a line do not coincide with the nodes.
    gaps : {"refuse", "fill", "skip"}
        Refuse missing values (NaN, empty cells, missing points), fill them with straight
        lines (on planes with triangles), or leave NaN, for `stiction.fit_field` and
        `RandomField.given`, which fills them with equally likely values. Without an
        interface, they always stay.

    Returns
    -------
    xarray.DataArray
        Over 'x' (m), on a plane over 'x' and 'y', with `units`. With gaps it has the
        coordinate 'measured', False in a gap, which results take over.

    Raises
    ------
    InputError
        If the source cannot be read, a unit is unknown or unsuitable, columns are
        ambiguous, or the profile does not fit the interface.

    Warns
    -----
    AccuracyWarning
        If something is interpolated or filled in, or x lies between the nodes.
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
    if interface is None and (interpolate or gaps == "fill"):
        raise InputError("interface: needed to interpolate, or to fill gaps")
    if interpolate and interface is not None and interface.is_plane:
        raise InputError("interpolate: is an option of profiles of a line")
    if strength is not None and quantity != "strength":
        raise InputError("strength: is a map to a strength; leave quantity='strength'")
    if offset == "centre" and interface is None:
        raise InputError("offset: 'centre' needs an interface")
    options = reading_options(missing, decimal, skip, sheet, record)
    dims = None if interface is None else interface.dims
    with prefixed(str(source) if isinstance(source, str | Path) else "source"):
        array = labelled(
            source, "height" if strength else quantity, dims, x=x, value=value, unit=unit,
            x_unit=x_unit, options=options, rows=rows, spacing=spacing,
        )  # fmt: skip
        if strength is not None:
            array = array.copy(data=_mapped(strength, array.values))
        array = _moved(array, offset, interface)
        array = array.squeeze(
            [dim for dim in {*array.dims} - {"x", "y", "row"} if array.sizes[dim] == 1]
        )
        if not {*array.dims} <= {"x", "y", "row"}:
            raise InputError(f"must hold one profile, got shape {array.shape}")
        if interface is not None:
            values, measured = place(array, interface, interpolate, gaps)
            array = xr.DataArray(values, interface.coordinates, interface.dims)
            if not np.all(measured):
                array[MEASURED] = (interface.dims, measured)
        else:
            array = _in_order(array)
    for dim in {"x", "y"} & {*array.coords}:
        array[dim].attrs.update(units="m", long_name=f"position along {dim}")
    if MEASURED in array.coords:
        array[MEASURED].attrs["long_name"] = "measured, not filled in"
    array.attrs = {"units": QUANTITIES[quantity].units, "long_name": quantity.replace("_", " ")}
    return array.rename(quantity)


def reading_options(
    missing: Missing | None,
    decimal: str | None = None,
    skip: int = 0,
    sheet: int | str = 0,
    record: int | None = None,
) -> Options:
    """Return what a caller states about a file."""
    several = missing if isinstance(missing, tuple | list | None) else (missing,)
    return Options(skip, sheet, None if several is None else (*several,), decimal, record)


def without_missing(array: Any, options: Options) -> Any:
    """Return an array with NaN in the place of numbers that stand for missing values."""
    numbers = [one for one in options.missing or () if not isinstance(one, str)]
    absent = [np.isclose(array.values, number, rtol=1e-6, atol=0.0) for number in numbers]
    return array.where(~np.any(absent, axis=0)) if absent else array


def _mapped(strength: Callable[[Any], Any], heights: Array) -> Array:
    """Return strengths (Pa) of heights (m), NaN where there is no height."""
    values = as_numbers(strength(heights.copy()))
    if values.shape != heights.shape:
        raise InputError(
            f"strength: must return one strength for each height, got shape {values.shape} for"
            f" {heights.shape}"
        )
    values = np.where(np.isnan(heights), np.nan, values)
    _check_positive(values, "strength", _Places())
    return values


def _moved(array: Any, offset: Any, interface: Interface | None) -> Any:
    """Return a profile whose coordinates are moved by an offset (m), or to the centre."""
    dims = [dim for dim in ("x", "y") if dim in array.coords]
    if offset == 0.0:
        return array
    if not dims:
        raise InputError("offset: the source has no coordinates; its points are the nodes")
    if offset == "centre":
        assert interface is not None
        centres = zip(interface.dims, interface.shape, interface.spacings, strict=True)
        middle = {dim: (interface.first + 0.5 * (n - 1)) * h for dim, n, h in centres}
        offsets = [
            middle[dim] - 0.5 * float(array[dim].min() + array[dim].max()) for dim in dims
        ]
    else:
        offsets = [*np.broadcast_to(offset, len(dims))]
    moved = {
        d: (array[d].dims, array[d].values + a) for d, a in zip(dims, offsets, strict=True)
    }
    return array.assign_coords(moved)


def _in_order(array: Any) -> Any:
    """Return a profile with rising coordinates, and points on a plane as a map."""
    if "row" in array.dims:
        array = array.set_index(row=["x", "y"])
    for index in array.indexes.values():
        if index.has_duplicates:
            twin = index[index.duplicated()]
            if (blocks := array.attrs.get("blocks", 1)) > 1:
                raise InputError(
                    f"x repeats, and empty lines separate {blocks} records; pass record=0 to"
                    f" {blocks - 1} for one of them"
                )
            raise InputError(
                f"x repeats: there are two values at {twin[0]} m ({twin.size} such places); keep"
                f" one of the two, or their mean{OF_A_PLANE}"
            )
    array = array.unstack()
    return array.sortby([dim for dim in array.dims if dim in array.coords])


# -- values in SI --------------------------------------------------------------------------------


def is_labelled(value: Any) -> bool:
    """Whether it is an xarray object, tested without importing xarray."""
    return hasattr(value, "dims") and hasattr(value, "coords")


def is_coefficient(value: Any) -> bool:
    """Whether a labelled array states that it holds pure numbers: friction coefficients."""
    return is_labelled(value) and is_in(unit_of(value), "1")


def simplified(value: Any, quantity: str) -> Any:
    """Return `value` as labelled, pandas objects over positions too, or as numbers in SI."""
    si = QUANTITIES[quantity].units
    if is_labelled(value):
        whole = value.dims or hasattr(value, "data_vars")
        return value if whole else in_si(value, quantity, si)
    if hasattr(value, "to_xarray") and hasattr(value, "index"):
        return of_pandas(value)
    if hasattr(value, "positions_and_heights"):
        return heights_of(value)
    return plain(value, (si,))[0]


def with_stated_unit(value: Any, units: Iterable[str]) -> tuple[Any, str | None]:
    """Return numbers, whose labels do not count, and the unit that they state, if they do.

    It is the unit of a quantity, the attribute `units`, or stands in the name of a Series.
    """
    stated = ""
    if is_labelled(value) and not hasattr(value, "data_vars"):
        stated, value = unit_of(value), value.data
    elif hasattr(value, "to_xarray") and hasattr(value, "name"):
        stated, value = name_and_unit(str(value.name or ""))[1], value.to_numpy()
    numbers, si = plain(value, units)
    return numbers, si or stated or None


def of_pandas(value: Any) -> Any:
    """Return a Series or DataFrame as labelled, or as an array if its labels are 0, 1, 2, ...

    Labels that are floats are positions (m). A table with headings is that of a file.
    """
    import xarray as xr

    if value.ndim == 1:
        if value.dtype == object:
            value = value.astype(np.float64)
        name, unit = name_and_unit(str(value.name or ""))
        attributes = {"units": unit} if unit else {}
        if _in_order_of_nodes(value.index, "index of the Series") and not unit:
            return value.to_numpy()
        coords = {} if _is_range(value.index) else {"x": value.index.to_numpy()}
        return xr.DataArray(value.to_numpy(), coords, ("x",), name or None, attributes)
    if all(isinstance(name, str) for name in value.columns):
        return table_of_frame(value)
    values, columns, index = value.to_numpy(), value.columns, value.index
    if values.dtype.kind not in "fiu":
        raise InputError("must hold numbers only; the DataFrame has columns of another type")
    if index.dtype.kind == "f" and _is_range(columns):
        return xr.DataArray(values.T, {"x": index.to_numpy()}, ("sample", "x"))
    coords = {"x": columns.to_numpy()}
    if _in_order_of_nodes(columns, "columns of the DataFrame"):
        coords = {}
    return xr.DataArray(values, coords, ("sample", "x"))


def _is_range(index: Any) -> bool:
    return index.dtype.kind in "iu" and bool(np.all(index == np.arange(index.size)))


def _in_order_of_nodes(index: Any, what: str) -> bool:
    """Return whether labels are 0, 1, 2, ...; refuse those that are no positions either."""
    if _is_range(index):
        return True
    if index.dtype.kind != "f" or not np.all(np.isfinite(index)):
        raise InputError(
            f"has labels that are not positions in m: the {what} holds {index.dtype} such as"
            f" {index[0]!r}; give positions as floats, or take values in their order by"
            " .to_numpy()"
        )
    return False


def in_si(array: Any, what: str, si: str, given: str | None = None) -> Any:
    """Return the values of a DataArray in SI, by its unit or the one that the caller gives."""
    stated = unit_of(array)
    with prefixed(what, " "):
        values = as_numbers(magnitude(array.data, si))
        factor = factor_to(si, given or stated or si)
        known = given and parse(stated)
        if known and not np.isclose(factor_to(si, stated), factor, rtol=1e-12):
            raise InputError(f"is given in {given}, but the source states {stated}")
    return values * factor


def unit_of(array: Any) -> str:
    return str(array.attrs.get("units") or array.attrs.get("unit") or "").strip()


# -- which variable, and which coordinates -------------------------------------------------------


def labelled(
    source: Any,
    quantity: str,
    dims: tuple[str, ...] | None = None,
    *,
    x: Column = None,
    value: Column = None,
    unit: str | None = None,
    x_unit: str | None = None,
    options: Options = Options(),  # noqa: B008
    rows: str | None = None,
    spacing: Any = None,
) -> Any:
    """Return a quantity of `source` in SI along the directions `dims`, or those that it has.

    A dimension of another name comes first. It is the only one if there is one value a sample.
    """
    is_file = isinstance(source, str | Path)
    data: Any = load(Path(source), options) if is_file else simplified(source, quantity)
    is_surface = hasattr(source, "positions_and_heights")
    if quantity != "height" and (is_surface or (is_file and _ending(source) in INSTRUMENTS)):
        raise InputError(
            "holds heights; pass strength= with a map from heights (m) to strengths (Pa), or read"
            " quantity='height'"
        )
    if not is_labelled(data):
        data = _of_array(data, source, quantity)
    if is_file and _ending(source) in IMAGES and not unit:
        if quantity != "height":
            raise InputError("holds grey values; pass strength= with a map to strengths (Pa)")
        unit = "m"  # the map takes grey values as they are
    if _is_matrix(data, dims, rows, spacing, value):
        data = _matrix(data, rows)
    data = _spaced(data, spacing)
    if not hasattr(data, "data_vars"):
        if value not in (None, data.name):
            only = f"the name of the only variable, {data.name!r}"
            raise InputError(f"value: {value!r} is not {only}")
        data, value = data.to_dataset(name=quantity), quantity
    dims = dims or (("x", "y") if _is_map(data) else ("x",))
    chosen, places = _chosen(data, quantity, dims, x, value)
    texts = [data.variables[name].attrs.get("text") for name in (chosen, *places.values())]
    if "row" in data.dims and any(texts):
        raise InputError(filter(None, texts))
    array = data[chosen]
    at = {dim: data[name].variable for dim, name in places.items()}
    at = {dim: one for dim, one in at.items() if {*one.dims} <= {*array.dims}}
    dropped = [name for name in array.coords if name not in (MEASURED, *array.dims)]
    array = _directed(array.drop_vars(dropped).assign_coords(at), dims)
    if len({*dims} & {*array.coords}) == 1 < len(dims):
        raise InputError("has the coordinate x or y only; a map has both, or none")
    array = without_missing(array, options)
    values = in_si(array, quantity, QUANTITIES[quantity].units, unit)
    raw = array.values if isinstance(array.data, np.ndarray) else values
    lines = data.attrs.get("lines", ())
    where = _Places(lines if np.size(lines) == values.size else None)
    _check_positive(values, quantity, where, raw)
    if options.missing is None:
        _doubt_sentinels(raw, quantity, where)
    array.attrs["blocks"] = np.size(np.unique(data.attrs.get("blocks", 0)))
    if quantity == "height" and not (unit or unit_of(array) or hasattr(array.data, "units")):
        _doubt_metres(values[np.isfinite(values)])
    for dim in {*dims} & {*array.coords}:
        place = in_si(array[dim], dim, "m", x_unit)
        if not np.all(np.isfinite(place)):
            entry = int(np.argmin(np.isfinite(place)))
            line = f" (line {data.attrs['lines'][entry]})" if "lines" in data.attrs else ""
            raise InputError(f"{dim} must be finite; entry {entry}{line} is not")
        array = array.assign_coords({dim: (array[dim].dims, place)})
    return array.copy(data=values)


def _ending(path: str | Path) -> str:
    return Path(path).suffix.lower()


def _of_array(values: Any, source: Any, quantity: str) -> Any:
    """Return an array without labels as a profile of a line or a plane."""
    import xarray as xr

    try:
        array = real_array(values)
    except TypeError as error:
        raise InputError(
            f"must be a path, an array, or a table with labels, got {describe(source)}; {error}"
        ) from None
    if array.ndim not in (1, 2) or array.size == 0:
        raise InputError(f"must have shape (nodes,) or (nx, ny), got shape {array.shape}")
    return xr.DataArray(array, dims=("x", "y")[: array.ndim])


class _Places(NamedTuple):
    """Where values stand: the numbers of their lines if they come from a table."""

    lines: Any = None

    def of(self, entry: int) -> str:
        """Return the place of an entry in words."""
        return f"entry {entry}" if self.lines is None else f"line {self.lines[entry]}"


def _check_positive(values: Array, quantity: str, where: _Places, raw: Any = None) -> None:
    """Refuse values of a positive quantity that are zero or less."""
    wrong = np.flatnonzero(values <= 0.0)
    if quantity in POSITIVE and wrong.size:
        entry, given = int(wrong[0]), np.ravel(values if raw is None else raw)
        number = f"{given[entry]:.9g}"
        raise InputError(
            f"{quantity} must be positive, is {number} in {where.of(entry)} ({wrong.size} such"
            f" values); if it stands for no value, pass missing={number} to st.read_profile, or"
            " make it NaN"
        )


def _doubt_sentinels(values: Any, quantity: str, where: _Places) -> None:
    """Warn of a number far from all others that usually stands for a missing value."""
    flat = np.ravel(values)
    known = flat[np.isfinite(flat)]
    for end in (known.min(), known.max()) if known.size else ():
        rest = known[known != end]
        usual = np.isclose(end, SENTINELS, rtol=1e-5, atol=0.0).any()
        if usual and rest.size and min(abs(rest - end)) > np.ptp(rest):
            count, entry = known.size - rest.size, int(np.argmax(flat == end))
            warn_user(
                f"{quantity}: {end:.9g} stands in {where.of(entry)} ({count} such values), far from"
                f" all others, and often means that a value is missing; pass missing={end:.9g} to"
                " st.read_profile, or missing=() if it is a value",
                AccuracyWarning,
            )


def _doubt_metres(heights: Array) -> None:
    """Warn of heights without a unit that are rather in um or nm."""
    if heights.size and np.ptp(heights) > TALL:
        warn_user(
            f"height: has no unit, is taken in m, and ranges over {np.ptp(heights):.3g} m; give"
            " unit='um' or another, or unit='m' if that is right",
            UnitWarning,
        )


def _chosen(
    data: Any, quantity: str, dims: tuple[str, ...], x: Column, value: Column
) -> tuple[Any, dict[str, Any]]:
    """Return the names of the variable, and of its places by direction if there are any."""
    names, table, si = list(data.data_vars), "row" in data.dims, QUANTITIES[quantity].units
    if table and data.attrs.get("headed"):  # a column without a name is an index
        names = [name for name in names if data.variables[name].attrs["heading"]]
    words = (quantity, *NAMES.get(quantity, ()))
    chosen = None if value is None else _column(data, names, "value", value)
    indices = {*data.data_vars} - {*names}
    along = [
        name for name in data.variables if data.variables[name].ndim == 1 and name != chosen
    ]
    along = [name for name in along if name not in indices]
    if len(dims) == 2:
        places = {_plain(name): name for name in along if _plain(name) in dims}
        if [*map(str, names)] == ["0", "1", "2"] and table:
            places, chosen = {"x": names[0], "y": names[1]}, chosen or names[2]
    else:
        name = _choose(data, [name for name in along if name in data.dims], PLACES)
        name = name or _choose(data, along, PLACES, "m" if table and si != "m" else "")
        if name is None and table and len(names) == 2 and _plain(names[0]) not in words:
            name = names[0] if names[0] != chosen else None
        places = {} if name is None else {"x": name}
    if x is not None:
        places["x"] = _column(data, along, "x", x)
    left = [name for name in names if name not in places.values()]
    left = [name for name in left if table or data.variables[name].ndim >= len(dims)]
    if chosen is None:
        chosen = _choose(data, left, words, si)
    if chosen is None and len(left) == 1 and _UNNAMED.match(_plain(left[0])):
        chosen = left[0]
    rivals = [name for name in left if name != chosen and _plain(name) in PLACES]
    many = value is None and len(names) > 2
    unplaced = len(places) < len(dims) and (len(dims) == 2 or many)
    if chosen is None or (table and (unplaced or (rivals and x is None and len(dims) == 1))):
        raise InputError(_unclear(data, names, quantity, dims))
    return chosen, places


def _is_matrix(data: Any, dims: Any, rows: Any, spacing: Any, value: Column) -> bool:
    """Return whether a table without headings is a map, with one line of the file for each row."""
    if "row" not in data.dims or data.attrs.get("headed") or len(data.data_vars) < 2:
        return False
    if rows is not None or sizes_of(data.attrs.get("comments", ())).keys() >= {
        "width",
        "height",
    }:
        return True
    is_map = value is None and (spacing is not None or (dims is not None and len(dims) == 2))
    if is_map and len(data.data_vars) != 3:
        raise InputError(
            f"holds {len(data.data_vars)} columns without names; pass rows='x' if each line of the"
            " file has one x, rows='y' if it has one y"
        )
    return False


def _matrix(data: Any, rows: str | None) -> Any:
    """Return a map from a table without headings, with the sizes that its comments state."""
    import xarray as xr

    sizes = sizes_of(data.attrs["comments"])
    values = np.stack([column.values for column in data.values()])  # (columns, lines)
    array = xr.DataArray(values if rows != "x" else values.T, dims=("x", "y"))
    for dim, called in (("x", "width"), ("y", "height")):
        if called in sizes:
            length, unit = sizes[called]
            x = np.arange(array.sizes[dim]) * (length / array.sizes[dim])
            array = array.assign_coords({dim: (dim, x, {"units": unit or "m"})})
    if "value units" in sizes:
        array.attrs["units"] = sizes["value units"][1]
    return array


def _spaced(data: Any, spacing: Any) -> Any:
    """Return an array with coordinates at equal distances (m) if these are given."""
    if spacing is None:
        return data
    dims = [dim for dim in ("x", "y") if dim in data.dims]
    if not dims or any(dim in data.coords for dim in dims):
        raise InputError("spacing: the source has coordinates of its own; leave it out")
    steps = np.broadcast_to(spacing, len(dims))
    places = zip(dims, steps, strict=True)
    return data.assign_coords({dim: (dim, h * np.arange(data.sizes[dim])) for dim, h in places})


def _is_map(data: Any) -> bool:
    """Whether values lie on a plane: over x and y, or in a table of both where x repeats."""
    if "row" not in data.dims:
        return {"x", "y"} <= {*data.dims}
    columns = {_plain(name): data.variables[name].values for name in data.data_vars}
    if [*columns] == ["0", "1", "2"]:  # without headings both must repeat
        return all(np.unique(columns[one]).size <= columns[one].size // 2 for one in "01")
    both = len(columns) > 2 and {"x", "y"} <= {*columns}
    return both and np.unique(columns["x"]).size < columns["x"].size


def _choose(data: Any, names: list[Any], called: tuple[str, ...], si: str = "") -> Any:
    """Return the variable with one of several names, or else the only one that states a unit."""
    for word in called:
        if fitting := [name for name in names if _plain(_name(data, name)) == word]:
            return _only(data, fitting)
    fitting = [name for name in names if is_in(unit_of(data.variables[name]), si)]
    return fitting[0] if len(fitting) == 1 else None


def _name(data: Any, name: Any) -> Any:
    """Return what a column is called, which may be the name of several."""
    return data.variables[name].attrs.get("name", name)


def _only(data: Any, names: list[Any]) -> Any:
    """Return the only one of several columns, or refuse them: they have one heading."""
    if len(names) > 1:
        numbers = " and ".join(str(data[name].attrs.get("column", name)) for name in names)
        raise InputError(
            f"columns {numbers} are all called {_name(data, names[0])!r}; pass the number of one of"
            " them, value= or x="
        )
    return names[0]


def _column(data: Any, names: list[Any], what: str, wanted: Column) -> Any:
    if isinstance(wanted, int) and "row" in data.dims:
        for name, column in data.items():
            if column.attrs.get("column") == str(wanted):
                return name
    if fitting := [
        n for n in names if wanted in (n, _name(data, n), data[n].attrs.get("heading"))
    ]:
        return _only(data, fitting)
    raise InputError(unknown_name(what, str(wanted), map(str, names)))


def _unclear(data: Any, names: list[Any], quantity: str, dims: tuple[str, ...]) -> str:
    units = {name: unit_of(data.variables[name]) for name in names if not str(name).isdecimal()}
    shown = [f"{name!r} in {unit}" if unit else repr(name) for name, unit in units.items()]
    listed = ", ".join(shown[:LISTED_COLUMNS]) or f"{len(names)} columns without names"
    listed += f" and {len(shown) - LISTED_COLUMNS} more" * (len(shown) > LISTED_COLUMNS)
    if len(dims) == 2 and not {*dims} <= {_plain(name) for name in data.variables}:
        return f"has no columns x and y: got {listed}{OF_A_PLANE}"
    return (
        f"holds no variable that is clearly the {quantity} ({QUANTITIES[quantity].units}): got"
        f" {listed}. Call it {quantity!r}, state its unit, or give x=..., value=... and unit=..."
        + (
            "; heights are read with quantity='height', friction coefficients with"
            " quantity='friction_coefficient'"
        )
        * (quantity == "strength")
        + OF_A_PLANE * (len(data.data_vars) != 2)
    )


def _plain(name: Any) -> str:
    return str(name).casefold().replace(" ", "_")


def _directed(array: Any, dims: tuple[str, ...]) -> Any:
    """Return an array over 'x' ('x' and 'y', or 'row'), after the sample if there are several."""
    if len(dims) == 1 and "x" in array.coords:
        array = array.swap_dims({array["x"].dims[0]: "x"})
    names = [str(dim) for dim in array.dims]
    if len(dims) == 1 and "x" not in names:
        called = [name for name in names if _plain(name) in PLACES]
        called = called or [name for name in names if _plain(name) not in SAMPLE_NAMES]
        if len(called) == 1 or (names and all(name.startswith("dim_") for name in names)):
            array = array.rename({called[-1]: "x"})  # without names the order counts
    along = [dim for dim in (*dims, "row") if dim in array.dims]
    samples = [dim for dim in array.dims if dim not in along]
    one_each = not along and len(samples) == 1
    one_each = one_each and (len(dims) == 1 or _plain(samples[0]) in SAMPLE_NAMES)
    clear = one_each or along in ([*dims], ["row"])
    if not clear or len(samples) > 1 or "y" in samples or len({*array.dims}) < array.ndim:
        raise InputError(
            f"which dimensions run along the interface is not clear from ({', '.join(names)}); call"
            " it 'x', on a plane 'x' (the direction of load and slip) and 'y', and another one"
            f" 'sample'{OF_A_PLANE * (len(dims) == 1)}"
        )
    array = array.drop_vars([name for name in array.coords if name not in (MEASURED, *dims)])
    return array.transpose(*samples, *along)


# -- what takes profiles -------------------------------------------------------------------------


def at_nodes(
    name: str, value: Any, interface: Interface, gaps: Gaps = "refuse"
) -> tuple[Any, Any]:
    """Return what a caller gave for a quantity, with one value a node, and where it was measured.

    `name` may be a dotted key. Numbers, and arrays of another shape, pass as they are, for
    whoever checks that. The mask is True if nothing is missing.
    """
    quantity = quantity_of(name)
    with prefixed(name):
        if isinstance(value, ProfileFile):
            value = value.to_xarray(interface)
        value = simplified(value, quantity)
        if is_labelled(value):
            array = labelled(value, quantity, interface.dims)
            if array.ndim == 1 and not {*array.dims} <= {"x", "row"}:  # one value a sample
                if quantity == "strength":
                    raise InputError("has no dimension along the interface; call it 'x'")
                return array.values[:, np.newaxis], True
            return place(array, interface, gaps=gaps)
        with suppress(TypeError):  # no numbers: refused with everything else that is wrong
            array = real_array(value)
            if array.shape[-len(interface.shape) :] == interface.shape:
                return close_gaps(array, True, interface, gaps)
    return value, True


class ProfileFile(NamedTuple):
    """A profile that a study file names: it is read once its interface is known."""

    path: Path
    options: dict[str, Any]

    def to_xarray(self, interface: Interface | None = None) -> xr.DataArray:
        """Read the file, and place its values on an interface."""
        return read_profile(self.path, interface=interface, **self.options)


def profile_in_file(given: Any, field: str, folder: Path) -> Any:
    """Return the profile that a study file names: its path, or `file` and options of the reader."""
    table = dict(given) if isinstance(given, Mapping) else {"file": given}
    if "file" not in table:
        return given
    path = folder / check("file", table.pop("file"), FilePath)
    reserved = sorted(table.keys() & {"source", "quantity", "interface"})
    if reserved:
        raise InputError(f"{reserved[0]}: is not an option in a study file")
    return ProfileFile(path, table | {"quantity": quantity_of(field)})


def quantity_of(key: str) -> str:
    """Return what the parameter of this name, or of this dotted key, holds."""
    field = key.rsplit(".", 1)[-1]
    return "load_profile" if field == "profile" else field
