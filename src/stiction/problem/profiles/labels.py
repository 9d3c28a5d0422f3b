"""Take a profile from labelled data: choose the variable and its coordinates, convert to SI.

A source is a file, an xarray object, a table of pandas, a surface, a
quantity with a unit or an array. It may hold many variables, and their
names and units follow no standard. A wrong choice would give a wrong
number, so an ambiguous choice is refused. `labelled` takes these steps:

1. Make the source a DataArray or a Dataset.
2. Take a table without headings for a map if its comments say so.
3. Choose the variable and its coordinates by the argument. Without an
   argument, choose by the name, and then by the unit.
4. Name the dimensions 'x' and 'y', or 'row' for a list of points. The
   sample comes first.
5. Convert values and coordinates to SI, and check them.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

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
from stiction.base.model import as_numbers, describe, real_array
from stiction.base.units import factor_to, is_in, magnitude_in_one_of, parse, plain
from stiction.base.variables import QUANTITIES
from stiction.problem.profiles.files import HEIGHT, heights_of, load
from stiction.problem.profiles.tables import Options, name_and_unit, sizes_of, table_of_frame

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
"""Other names of a quantity."""
PLACES = ("x", "position", "pos", "distance", "coordinate", "lateral")
SAMPLE_NAMES = ("sample", "samples")
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
UNNAMED = re.compile(r"\d+$|values?$|y\d*$")
"""Names that say nothing about a column. A column without a heading has its number as a name."""
OF_A_PLANE = (
    ". A map has columns or coordinates x and y, or is an .npy of shape (nx, ny), and needs an"
    " interface of two lengths and two numbers of nodes"
)
"""Advice for two dimensions where a line was expected."""
LISTED_COLUMNS = 20
"""Names of columns in a message."""
TALL = 1e-3
"""Range of heights without a unit, m, above which they are probably in um or nm."""

Column = str | int | None


# -- values in SI --------------------------------------------------------------------------------


def is_labelled(value: Any) -> bool:
    """Return whether a value is an xarray object, without importing xarray."""
    return hasattr(value, "dims") and hasattr(value, "coords")


def is_coefficient(value: Any) -> bool:
    """Return whether a labelled array states that it holds friction coefficients, unit 1."""
    return is_labelled(value) and is_in(unit_of(value), "1")


def unit_of(array: Any) -> str:
    """Return the unit that a labelled array states, '' if it states no unit."""
    return str(array.attrs.get("units") or array.attrs.get("unit") or "").strip()


def in_si(array: Any, what: str, si: str, given: str | None = None) -> Any:
    """Return the values of a DataArray in SI, converted from its unit or the unit of the caller."""
    stated = unit_of(array)
    with prefixed(what, " "):
        values = as_numbers(magnitude_in_one_of(array.data, [si])[0])
        factor = factor_to(si, given or stated or si)
        known = given and parse(stated)
        if known and not np.isclose(factor_to(si, stated), factor, rtol=1e-12):
            raise InputError(
                f"is given in {given}, but the source states {stated}. Leave the unit out, or"
                " correct the source"
            )
    return values * factor


def simplified(value: Any, quantity: str) -> Any:
    """Return a labelled array if the source has labels. Otherwise return numbers in SI."""
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
    """Return numbers without labels, and the unit if the source states a unit.

    The unit belongs to a quantity, is the attribute `units`, or stands
    in the name of a Series.
    """
    stated = ""
    if is_labelled(value) and not hasattr(value, "data_vars"):
        stated, value = unit_of(value), value.data
    elif hasattr(value, "to_xarray") and hasattr(value, "name"):
        stated, value = name_and_unit(str(value.name or ""))[1], value.to_numpy()
    numbers, si = plain(value, units)
    return numbers, si or stated or None


def without_missing(array: Any, options: Options) -> Any:
    """Return an array with NaN in place of the numbers that stand for a missing value."""
    numbers = [number for number in options.stated if not isinstance(number, str)]
    absent = [np.isclose(array.values, number, rtol=1e-6, atol=0.0) for number in numbers]
    return array.where(~np.any(absent, axis=0)) if absent else array


def of_pandas(value: Any) -> Any:
    """Return a Series or DataFrame with labels, or an array if its labels are 0, 1, 2, ...

    Labels of type float are positions, m. A DataFrame with headings is
    read like a file.
    """
    import xarray as xr

    if value.ndim == 1:
        if value.dtype == object:
            value = value.astype(np.float64)
        name, unit = name_and_unit(str(value.name or ""))
        attributes = {"units": unit} if unit else {}
        coords = _positions(value.index, "index of the Series")
        if not coords and not unit:
            return value.to_numpy()
        return xr.DataArray(value.to_numpy(), coords, ("x",), name or None, attributes)
    if all(isinstance(name, str) for name in value.columns):
        return table_of_frame(value)
    values, columns, index = value.to_numpy(), value.columns, value.index
    if values.dtype.kind not in "fiu":
        raise InputError("must hold numbers only. The DataFrame has columns of another type")
    if index.dtype.kind == "f" and _is_range(columns):
        return xr.DataArray(values.T, {"x": index.to_numpy()}, ("sample", "x"))
    coords = _positions(columns, "columns of the DataFrame")
    return xr.DataArray(values, coords, ("sample", "x"))


def _is_range(index: Any) -> bool:
    return index.dtype.kind in "iu" and bool(np.all(index == np.arange(index.size)))


def _positions(index: Any, what: str) -> dict[str, Array]:
    """Return positions, m, or an empty dictionary if the labels are only numbers of rows."""
    if _is_range(index):
        return {}
    if index.dtype.kind != "f" or not np.all(np.isfinite(index)):
        raise InputError(
            f"has labels that are not positions in m: the {what} holds {index.dtype} such as"
            f" {index[0]!r}. Give positions as floats, or only values by .to_numpy()"
        )
    return {"x": index.to_numpy()}


# -- from a source to a profile ------------------------------------------------------------------


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
) -> Any:
    """Return a quantity from `source` in SI, along `dims` or the directions of the source.

    A dimension with a different name, such as the sample, comes first.
    It is the only dimension if each sample has a single value.
    """
    # 1. Make the source a DataArray or a Dataset.
    is_file = isinstance(source, str | Path)
    data: Any = load(Path(source), options) if is_file else simplified(source, quantity)
    if not is_labelled(data):
        data = _of_array(data, source)
    name = getattr(data, "name", None)
    if name == HEIGHT and quantity != "height":
        raise InputError(
            "holds heights. Pass strength=, a function that maps them to strengths (Pa), or keep"
            " them with quantity='height'"
        )
    # 2. A table without headings may be a map.
    data = _as_map(data, dims, value)
    if not hasattr(data, "data_vars"):
        if value not in (None, data.name):
            raise InputError(
                f"value: {value!r} is not the name of the only variable, {data.name!r}"
            )
        data, value = data.to_dataset(name=quantity), quantity
    # 3. Choose the variable and its coordinates.
    dims = dims or (("x", "y") if _is_map(data) else ("x",))
    chosen, places = _chosen(data, quantity, dims, x, value)
    texts = [data.variables[name].attrs.get("text") for name in (chosen, *places.values())]
    if "row" in data.dims and any(texts):
        raise InputError(filter(None, texts))
    # 4. Name the dimensions.
    array = data[chosen]
    at = {dim: data[name].variable for dim, name in places.items()}
    at = {dim: along for dim, along in at.items() if {*along.dims} <= {*array.dims}}
    dropped = [name for name in array.coords if name not in array.dims]
    array = _directed(array.drop_vars(dropped).assign_coords(at), dims)
    if len({*dims} & {*array.coords}) == 1 < len(dims):
        raise InputError("has the coordinate x or y only. Give a map both, or leave both out")
    # 5. Convert to SI, and check.
    array = without_missing(array, options)
    values = in_si(array, quantity, QUANTITIES[quantity].units, unit)
    raw = array.values if isinstance(array.data, np.ndarray) else values
    lines = data.attrs.get("lines", ())
    check_positive(values, quantity, lines, raw)
    if options.missing is None:
        _doubt_sentinels(raw, quantity, lines)
    if quantity == "height" and not (unit or unit_of(array) or hasattr(array.data, "units")):
        _doubt_metres(values[np.isfinite(values)])
    for dim in {*dims} & {*array.coords}:
        place = in_si(array[dim], dim, "m", x_unit)
        if not np.all(np.isfinite(place)):
            where = _place(int(np.argmin(np.isfinite(place))), lines, place.size)
            raise InputError(f"{dim} must be finite, and {where} is not")
        array = array.assign_coords({dim: (array[dim].dims, place)})
    return array.copy(data=values)


def _of_array(values: Any, source: Any) -> Any:
    """Return an array without labels as a profile along a line or over a plane."""
    import xarray as xr

    try:
        array = real_array(values)
    except TypeError as error:
        raise InputError(
            f"must be a path, an array, or a table with labels, got {describe(source)}: {error}"
        ) from None
    if array.ndim not in (1, 2) or array.size == 0:
        raise InputError(f"must have shape (nodes,) or (nx, ny), got shape {array.shape}")
    return xr.DataArray(array, dims=("x", "y")[: array.ndim])


# -- step 2: maps --------------------------------------------------------------------------------


def _as_map(data: Any, dims: Any, value: Column) -> Any:
    """Return a matrix from a text file as a map. Return other data unchanged.

    Comments may state the width, the height and the unit of a map, as
    Gwyddion writes them.
    """
    import xarray as xr

    if not isinstance(data, xr.Dataset) or "row" not in data.dims:
        return data
    if data.attrs.get("headed") or len(data.data_vars) < 2:
        return data
    sizes = sizes_of(data.attrs["comments"])
    if not {"width", "height"} <= sizes.keys():
        if value is None and dims is not None and len(dims) == 2 and len(data.data_vars) != 3:
            raise InputError(
                f"holds {len(data.data_vars)} columns without names. Pass a map as columns x, y and"
                " value, or as an array: np.loadtxt(path).T if each line has a single y"
            )
        return data
    # Each line of the file has a single y.
    array = xr.DataArray(np.stack([column.values for column in data.values()]), dims=("x", "y"))
    for dim, name in (("x", "width"), ("y", "height")):
        length, unit = sizes[name]
        x = np.arange(array.sizes[dim]) * (length / array.sizes[dim])
        array = array.assign_coords({dim: (dim, x, {"units": unit or "m"})})
    array.attrs["units"] = sizes.get("value units", (1.0, ""))[1]
    return array


def _is_map(data: Any) -> bool:
    """Return whether values lie on a plane: over x and y, or in a table where x repeats."""
    if "row" not in data.dims:
        return {"x", "y"} <= {*data.dims}
    columns = {_plain(name): data.variables[name].values for name in data.data_vars}
    if [*columns] == ["0", "1", "2"]:  # without headings both must repeat
        return all(np.unique(columns[name]).size <= columns[name].size // 2 for name in "01")
    both = len(columns) > 2 and {"x", "y"} <= {*columns}
    return both and np.unique(columns["x"]).size < columns["x"].size


# -- step 3: the variable and its coordinates ----------------------------------------------------


def _chosen(
    data: Any, quantity: str, dims: tuple[str, ...], x: Column, value: Column
) -> tuple[Any, dict[str, Any]]:
    """Return the name of the variable, and by direction the names of its coordinates."""
    names, table, si = list(data.data_vars), "row" in data.dims, QUANTITIES[quantity].units
    if table and data.attrs.get("headed"):  # a column without a name is an index
        names = [name for name in names if data.variables[name].attrs["heading"]]
    words = (quantity, *NAMES.get(quantity, ()))
    chosen = None if value is None else _stated(data, names, "value", value)
    along = [
        name for name, variable in data.variables.items()
        if variable.ndim == 1 and name != chosen and (name in names or name in data.coords)
    ]  # fmt: skip
    places: dict[str, Any] = {}
    if len(dims) == 2:
        places = {_plain(name): name for name in along if _plain(name) in dims}
        if [*map(str, names)] == ["0", "1", "2"] and table:
            places, chosen = {"x": names[0], "y": names[1]}, chosen or names[2]
    else:
        name = _choose(data, [name for name in along if name in data.dims], PLACES)
        name = name or _choose(data, along, PLACES, "m" if table and si != "m" else "")
        if name is None and table and len(names) == 2 and _plain(names[0]) not in words:
            name = names[0] if names[0] != chosen else None
        if name is not None:
            places["x"] = name
    if x is not None:
        places["x"] = _stated(data, along, "x", x)
    left = [name for name in names if name not in places.values()]
    left = [name for name in left if table or data.variables[name].ndim >= len(dims)]
    if chosen is None:
        chosen = _choose(data, left, words, si)
    if chosen is None and len(left) == 1 and UNNAMED.match(_plain(left[0])):
        chosen = left[0]
    rivals = [name for name in left if name != chosen and _plain(name) in PLACES]
    many = value is None and len(names) > 2
    unplaced = len(places) < len(dims) and (len(dims) == 2 or many)
    if chosen is None or (table and (unplaced or (rivals and x is None and len(dims) == 1))):
        raise InputError(_unclear(data, names, quantity, dims))
    return chosen, places


def _choose(data: Any, names: list[Any], words: Sequence[str], si: str = "") -> Any:
    """Return the first variable found among some names, or else the only variable in a unit."""
    for word in words:
        if fitting := [name for name in names if _plain(_name(data, name)) == word]:
            return _only(data, fitting)
    fitting = [name for name in names if is_in(unit_of(data.variables[name]), si)]
    return fitting[0] if len(fitting) == 1 else None


def _stated(data: Any, names: list[Any], argument: str, wanted: str | int) -> Any:
    """Return the variable that the caller named by its name, heading or number."""
    if isinstance(wanted, int) and "row" in data.dims:
        for name, column in data.items():
            if column.attrs.get("column") == str(wanted):
                return name
    fitting = [
        name for name in names
        if wanted in (name, _name(data, name), data[name].attrs.get("heading"))
    ]  # fmt: skip
    if not fitting:
        raise InputError(unknown_name(argument, str(wanted), map(str, names)))
    return _only(data, fitting)


def column_of(
    table: Any, kinds: Sequence[str], units: Iterable[str] = (), wanted: Column = None
) -> Any:
    """Return the wanted column in a table of tests, or the column whose name begins with a word.

    If no name begins with such a word, return the column in a unit of
    `units`, provided that only one column has such a unit.
    """
    names = list(table.data_vars)
    if wanted is not None:
        return table[_stated(table, names, "column", wanted)]
    first = {name: re.split(r"[\s_:.]", name.strip("_:. ").lower())[0] for name in names}
    called = [name for name in names if first[name] in kinds]
    if len(called) > 1:
        raise InputError(
            f"{' and '.join(map(repr, called))} may both be the {kinds[0]}. Rename either"
        )
    fitting = [name for name in names if any(is_in(unit_of(table[name]), si) for si in units)]
    called = called or (fitting if len(fitting) == 1 else [])
    return table[called[0]] if called else None


def _name(data: Any, name: Any) -> Any:
    """Return the name in the heading of a column, which several columns may share."""
    return data.variables[name].attrs.get("name", name)


def _only(data: Any, names: list[Any]) -> Any:
    """Return the only name. Refuse several columns with the same heading."""
    if len(names) > 1:
        numbers = " and ".join(str(data[name].attrs.get("column", name)) for name in names)
        raise InputError(
            f"columns {numbers} are all called {_name(data, names[0])!r}. Choose a column by its"
            " number, value= or x="
        )
    return names[0]


def _unclear(data: Any, names: list[Any], quantity: str, dims: tuple[str, ...]) -> str:
    """Return a message that lists all columns, because the choice is ambiguous."""
    units = {name: unit_of(data.variables[name]) for name in names if not str(name).isdecimal()}
    shown = [f"{name!r} in {unit}" if unit else repr(name) for name, unit in units.items()]
    listed = ", ".join(shown[:LISTED_COLUMNS]) or f"{len(names)} columns without names"
    listed += f" and {len(shown) - LISTED_COLUMNS} more" * (len(shown) > LISTED_COLUMNS)
    if len(dims) == 2 and not {*dims} <= {_plain(name) for name in data.variables}:
        return f"has no columns x and y: got {listed}{OF_A_PLANE}"
    return (
        f"holds no variable that is clearly the {quantity} ({QUANTITIES[quantity].units}): got"
        f" {listed}. Call it {quantity!r}, state its unit, or give x=..., value=... and unit=...;"
        " heights and friction coefficients need quantity='height' or 'friction_coefficient'"
        + OF_A_PLANE
        * (len(data.data_vars) != 2)
    )


def _plain(name: Any) -> str:
    return str(name).casefold().replace(" ", "_")


# -- step 4: dimensions --------------------------------------------------------------------------


def _directed(array: Any, dims: tuple[str, ...]) -> Any:
    """Return the array over 'x' (or 'x' and 'y', or 'row'). A dimension of samples comes first."""
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
    single = not along and len(samples) == 1  # a single value for each sample
    single = single and (len(dims) == 1 or _plain(samples[0]) in SAMPLE_NAMES)
    clear = single or along in ([*dims], ["row"])
    if not clear or len(samples) > 1 or "y" in samples or len({*array.dims}) < array.ndim:
        raise InputError(
            f"which dimensions run along the interface is not clear from ({', '.join(names)}). Call"
            f" them 'x', 'y' (across slip) and 'sample'{OF_A_PLANE * (len(dims) == 1)}"
        )
    array = array.drop_vars([name for name in array.coords if name not in dims])
    return array.transpose(*samples, *along)


# -- step 5: checks ------------------------------------------------------------------------------


def _place(entry: int, lines: Any, size: int) -> str:
    """Describe the place of an entry in the source: its line in a table, or its number."""
    return f"line {lines[entry]}" if np.size(lines) == size else f"entry {entry}"


def check_positive(values: Array, quantity: str, lines: Any = (), raw: Any = None) -> None:
    """Refuse values of a positive quantity that are zero or less."""
    wrong = np.flatnonzero(values <= 0.0)
    if quantity in POSITIVE and wrong.size:
        entry, given = int(wrong[0]), np.ravel(values if raw is None else raw)
        number = f"{given[entry]:.9g}"
        raise InputError(
            f"{quantity} must be positive, is {number} in {_place(entry, lines, given.size)}"
            f" ({wrong.size} such values). If it means that a value is missing, pass"
            f" missing={number} to st.read_profile, or make it NaN"
        )


def _doubt_sentinels(values: Any, quantity: str, lines: Any) -> None:
    """Warn about a number that is far from all others and often stands for a missing value."""
    flat = np.ravel(values)
    known = flat[np.isfinite(flat)]
    for end in (known.min(), known.max()) if known.size else ():
        rest = known[known != end]
        usual = np.isclose(end, SENTINELS, rtol=1e-5, atol=0.0).any()
        if usual and rest.size and min(abs(rest - end)) > np.ptp(rest):
            where = _place(int(np.argmax(flat == end)), lines, flat.size)
            warn_user(
                f"{quantity}: {end:.9g} stands in {where} ({known.size - rest.size} such values),"
                f" and often means that a value is missing. Pass missing={end:.9g}, or missing=()",
                AccuracyWarning,
            )


def _doubt_metres(heights: Array) -> None:
    """Warn about heights without a unit that are probably in um or nm."""
    if heights.size and np.ptp(heights) > TALL:
        warn_user(
            f"height: has no unit and is read in m. The heights span {np.ptp(heights):.3g} m. Pass"
            " unit='um' or another unit, or unit='m' if metres are right",
            UnitWarning,
        )
