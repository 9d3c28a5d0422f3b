"""Take a profile from labelled data: choose the variable and its coordinates, convert to SI.

A source is a file, an xarray object, a table of pandas, a surface, a
quantity with a unit or an array. It may hold many variables, and their
names and units follow no standard. A wrong choice would give a wrong
number, so an ambiguous choice is refused. `labelled` takes these steps:

1. Make the source a DataArray or a Dataset.
2. Choose the variable and its coordinates by the argument. Without an
   argument, choose by the name, and then by the unit.
3. Name the dimensions 'x' and 'y', or 'row' for a list of points. The
   sample comes first.
4. Convert values and coordinates to SI, and check them.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Annotated, Any

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
from stiction.problem.reading.columns import (
    MAX_LISTED,
    Column,
    Reading,
    Table,
    Wanted,
    is_coefficient_name,
    read_column,
    reading_of,
    role_of,
    stated_column,
    unclear,
)
from stiction.problem.reading.files import HEIGHT, heights_of, load
from stiction.problem.reading.tables import Options, name_and_unit, table_of_frame

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
SAID_BY_ROLE = {
    "strength": "friction", "friction_coefficient": "friction", "normal_pressure": "pressing force"
}  # fmt: skip
"""Roles of columns that may hold a quantity, whatever they are called."""
Missing = Annotated[
    float | str | tuple[float | str, ...] | list[float | str], "float | str | list"
]
TALL = 1e-3
"""Range of heights without a unit, m, above which they are probably in um or nm."""

OF_A_PLANE = (
    ". A map has columns or coordinates x and y, or is an array (nx, ny), as np.loadtxt(path).T"
    " reads a matrix, and needs an interface of two lengths and two numbers of nodes"
)
"""Advice for two dimensions where a line was expected."""


OVERLOAD = 9.9e37
"""Smallest number with which an instrument marks an overload or a missing value (SCPI)."""


# -- values in SI --------------------------------------------------------------------------------


def is_labelled(value: Any) -> bool:
    """Return whether a value has labels: a table or an xarray object."""
    return isinstance(value, Table) or (hasattr(value, "dims") and hasattr(value, "coords"))


def is_coefficient(value: Any) -> bool:
    """Return whether a labelled array states that it holds friction coefficients, unit 1."""
    return hasattr(value, "dims") and is_in(unit_of(value), "1")


def unit_of(array: Any) -> str:
    """Return the unit that a labelled array states, '' if it states no unit."""
    return str(array.attrs.get("units") or array.attrs.get("unit") or "").strip()


def in_si(array: Any, what: str, si: str, given: str | None = None) -> Any:
    """Return the values of a DataArray in SI, converted from its unit or the unit of the caller."""
    with prefixed(what, " "):
        values = as_numbers(magnitude_in_one_of(array.data, [si])[0])
        return values * _factor(si, unit_of(array), given)


def _factor(si: str, stated: str, given: str | None) -> float:
    """Return the factor to SI from the unit of the caller or of the source, which must agree."""
    factor = factor_to(si, given or stated or si)
    if given and parse(stated) and not np.isclose(factor_to(si, stated), factor, rtol=1e-12):
        raise InputError(
            f"is given in {given}, but the source states {stated}. Leave the unit out, or correct"
            " the source"
        )
    return factor


def column_in_si(
    column: Column, quantity: str, given: str | None, units: Iterable[str], option: str = ""
) -> tuple[Array, str]:
    """Return a column in SI and its SI unit. The source or the caller states the original unit."""
    name = given or column.unit or "1" * is_coefficient_name(column)
    if not name:
        way = f", or pass {option}=" * bool(option)
        raise InputError(
            f"the unit of the {quantity} is not stated. Write it into the heading of"
            f" {column.label!r}{way}"
        )
    if np.any(beyond := np.abs(column.values) >= OVERLOAD):
        value = column.values[beyond][0]
        raise InputError(
            f"the {quantity} holds {value:g}, with which instruments mark an overload. Cut the"
            f" record there, or pass missing={value:g} if this is a missing value"
        )
    for si in units:
        if is_in(name, si):
            with prefixed(quantity, " "):
                return column.values * _factor(si, column.unit or name, given), si
    raise InputError(
        f"the {quantity} is in {name}. Its unit must be a multiple of {' or '.join(units)}"
    )


def simplified(value: Any, quantity: str) -> Any:
    """Return a labelled array if the source has labels. Otherwise return numbers in SI."""
    si = QUANTITIES[quantity].units
    if isinstance(value, Table):
        return value
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


def without_missing(values: Array, options: Options) -> Array:
    """Return values with NaN in place of the numbers that mark a missing value."""
    numbers = [number for number in options.stated if not isinstance(number, str)]
    absent = [np.isclose(values, number, rtol=1e-6, atol=0.0) for number in numbers]
    return np.where(np.any(absent, axis=0), np.nan, values) if absent else values


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
    x: Wanted = None,
    value: Wanted = None,
    unit: str | None = None,
    x_unit: str | None = None,
    options: Options = Options(),  # noqa: B008
) -> Any:
    """Return a quantity from `source` in SI, along `dims` or the directions of the source.

    A dimension with a different name, such as the sample, comes first.
    It is the only dimension if each sample has a single value. The
    attributes state what was read.
    """
    # 1. Make the source a table or labelled data.
    is_file = isinstance(source, str | Path)
    data: Any = load(Path(source), options) if is_file else simplified(source, quantity)
    if not is_labelled(data):
        data = _of_array(data, source)
    if getattr(data, "name", None) == HEIGHT and quantity != "height":
        raise InputError(
            "holds heights. Pass strength=, a function that maps them to strengths (Pa), or keep"
            " them with quantity='height'"
        )
    # 2. Choose the column and its coordinates by the rule.
    lines: Any = ()
    read: Reading | None = None
    if isinstance(data, Table):
        array, read = _of_table(data, quantity, dims, x, value)
        lines = data.lines
    elif hasattr(data, "data_vars"):
        array, read = _of_dataset(data, quantity, dims, value)
    elif value not in (None, data.name):
        raise InputError(
            f"value: {value!r} is not the name of the only variable, {data.name!r}"
        )
    else:
        array = data
    if not isinstance(data, Table):
        dims = dims or (("x", "y") if {"x", "y"} <= {*array.dims} else ("x",))
        array = _with_places(array, dims, x)
    dims = dims or (("x", "y") if "y" in array.coords else ("x",))
    # 3. Name the dimensions.
    array = _directed(array, dims)
    if len({*dims} & {*array.coords}) == 1 < len(dims):
        raise InputError("has the coordinate x or y only. Give a map both, or leave both out")
    # 4. Convert to SI, and check.
    if options.missing is not None:
        array = array.copy(data=without_missing(array.values, options))
    values = in_si(array, quantity, QUANTITIES[quantity].units, unit)
    raw = array.values if isinstance(array.data, np.ndarray) else values
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
    array = array.copy(data=values)
    array.attrs = {}
    if read is not None:
        about = read._replace(source=_source(source), unit=unit or read.unit).attributes
        array.attrs = {key: value for key, value in about.items() if value}
    return array


def _source(source: Any) -> str:
    return Path(source).name if isinstance(source, str | Path) else type(source).__name__


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


# -- step 2: the column and its coordinates -----------------------------------------------------


def _is_map(columns: Sequence[Column]) -> bool:
    """Return whether the values of a table lie over x and y: places repeat."""
    named = {_plain(column.name): column.values for column in columns}
    if [*named] == ["0", "1", "2"]:  # without headings both must repeat
        return all(np.unique(named[name]).size <= named[name].size // 2 for name in "01")
    both = len(named) > 2 and {"x", "y"} <= {*named}
    return both and np.unique(named["x"]).size < named["x"].size


def _of_table(
    table: Table, quantity: str, dims: Any, x: Wanted, value: Wanted
) -> tuple[Any, Reading]:
    """Return the values of a table over its coordinates, and what was read."""
    import xarray as xr

    if table.begins:
        raise InputError(several_tables(table))
    dims = dims or (("x", "y") if _is_map(table.columns) else ("x",))
    chosen, places = _chosen(table.columns, quantity, dims, x, value)
    if texts := [column.text for column in (chosen, *places.values()) if column.text]:
        raise InputError(texts)
    array = xr.DataArray(
        chosen.values,
        {dim: ("row", column.values, _units(column)) for dim, column in places.items()},
        ("row",), str(chosen.name), _units(chosen),
    )  # fmt: skip
    return array, reading_of(table, chosen, QUANTITIES[quantity].units, places)


def _of_dataset(data: Any, quantity: str, dims: Any, value: Wanted) -> tuple[Any, Reading]:
    """Return a variable of a dataset, with others along it as coordinates, and what was read."""
    dims = dims or (("x", "y") if {"x", "y"} <= {*data.dims} else ("x",))
    names = [*data.data_vars]
    columns = tuple(
        Column(str(name), unit_of(data[name]), data[name], -1 - number, str(name))
        for number, name in enumerate(names)
    )
    if value is not None:
        chosen = stated_column(columns, "value", value)
    else:
        left = [c for c in columns if c.values.ndim >= len(dims)]
        chosen = _by_rule(left, quantity)
    array = data[names[-1 - chosen.number]]
    along = {
        name: data[name]
        for name in names
        if name != array.name and data[name].ndim == 1 and {*data[name].dims} <= {*array.dims}
    }
    table = Table(columns, "", np.zeros(0))
    read = reading_of(table, chosen, QUANTITIES[quantity].units, {})
    return array.assign_coords(along), read


def _with_places(array: Any, dims: tuple[str, ...], x: Wanted) -> Any:
    """Return a DataArray whose only coordinates are its positions."""
    along = {_plain(name): at.variable for name, at in array.coords.items() if at.ndim == 1}
    called = [name for name in along if name in (dims if len(dims) == 2 else PLACES)]
    if x is not None:
        if x not in array.coords:
            raise InputError(unknown_name("x", str(x), [*map(str, array.coords)]))
        along, called = {"x": array[x].variable}, ["x"]
    if len(called) > len(dims):
        raise InputError(
            f"coordinates {' and '.join(called)} could be the position x. Pass x={called[0]!r}"
        )
    places = {name if len(dims) == 2 else "x": along[name] for name in called}
    dropped = [name for name in array.coords if name not in array.dims]
    return array.drop_vars(dropped).assign_coords(places)


def _units(column: Column) -> dict[str, str]:
    return {"units": column.unit} if column.unit else {}


def several_tables(table: Table) -> str:
    """Return the message about remarks that separate several tables in a file."""
    lines = ", ".join(map(str, table.begins[:5])) + ", ..." * (len(table.begins) > 5)
    return (
        f"holds {len(table.begins)} tables with remarks between them, which begin at lines {lines}."
        " Pass skip= with the number of lines above the last one, or save the wanted table in a"
        " file of its own"
    )


def _chosen(
    columns: Sequence[Column], quantity: str, dims: tuple[str, ...], x: Wanted, value: Wanted
) -> tuple[Column, dict[str, Column]]:
    """Return the column of a quantity, and by direction the columns of its coordinates."""
    chosen = None if value is None else stated_column(columns, "value", value)
    stated = None if x is None else stated_column(columns, "x", x)
    if any(column.heading for column in columns):  # without a name, it is an index
        columns = [column for column in columns if column.heading]
    plain = [_plain(column.name) for column in columns]
    bare = plain == [str(number) for number in range(len(columns))]
    places: dict[str, Column] = {}
    if len(dims) == 2:
        places = {name: c for name, c in zip(plain, columns, strict=True) if name in dims}
        if bare and len(columns) == 3:
            places, chosen = {"x": columns[0], "y": columns[1]}, chosen or columns[2]
        if len(places) < 2:
            listed = ", ".join(repr(column.label) for column in columns[:MAX_LISTED])
            raise InputError(f"has no columns x and y: got {listed}{OF_A_PLANE}")
    elif stated is not None:
        places = {"x": stated}
    elif bare and len(columns) == 2:
        if chosen is not columns[0]:
            places = {"x": columns[0]}
    elif place := _place_of([c for c in columns if c is not chosen], quantity):
        places = {"x": place}
    if chosen is None:
        chosen = _by_rule([c for c in columns if c not in places.values()], quantity)
        si = QUANTITIES[quantity].units
        if si != "1" and not chosen.unit and is_coefficient_name(chosen):
            raise InputError(
                f"{chosen} is a friction coefficient, but the {quantity} is in {si}. Pass"
                " quantity='friction_coefficient', or a heading with the unit"
            )
    if len(dims) == 1 and not places and len(columns) > 2 and value is None:
        raise InputError(unclear(columns, "position x", "x"))
    return chosen, places


def _by_rule(columns: Sequence[Column], quantity: str) -> Column:
    """Return the column of a quantity by the rule. Other names than its own exclude a column."""
    words, si = _words(quantity), QUANTITIES[quantity].units
    others = {name: key for key in NAMES for name in NAMES[key] if name not in words}
    named = {c: others[name] for c in columns if (name := _plain(c.name)) in others}
    left = [column for column in columns if column not in named]
    if left or not named:
        says = _says(words, quantity, left)
        chosen = read_column(left, quantity, "value", None, [si], says)
        if chosen.unit or si != "Pa" or not is_coefficient_name(chosen):
            return chosen
        named = {chosen: "friction_coefficient"}
    column, other = next(iter(named.items()))
    raise InputError(
        f"the heading {column.label!r} says {other}, not {quantity}. Pass quantity={other!r}, or"
        f" value={column.label!r}"
    )


def _words(quantity: str) -> tuple[str, ...]:
    return quantity, *NAMES.get(quantity, ())


def _says(words: Sequence[str], quantity: str, columns: Sequence[Column]) -> Any:
    """Return whether a heading says that its column is a quantity: by its name, else its role."""
    named = any(_plain(column.name) in words for column in columns)
    if named or quantity not in SAID_BY_ROLE:
        return lambda column: _plain(column.name) in words
    return lambda column: role_of(column) == SAID_BY_ROLE[quantity]


def _place_of(columns: Sequence[Column], quantity: str) -> Column | None:
    """Return the column of positions: by its heading, or as the only one in a unit of length."""
    words = _words(quantity)
    numeric = [c for c in columns if not c.text and _plain(c.name) not in words]
    called = [c for c in numeric if _plain(c.name) in PLACES]
    if not called:
        called = [c for c in numeric if role_of(c) == "travel" and c.unit not in words]
        called = [c for c in called if not c.unit or is_in(c.unit, "m")]
    if not called and QUANTITIES[quantity].units != "m":
        called = [c for c in numeric if is_in(c.unit, "m")]
        called = called if len(called) == 1 else []
    if len(called) > 1:
        raise InputError(unclear(columns, "position x", "x", called))
    return called[0] if called else None


def _plain(name: Any) -> str:
    return str(name).casefold().replace(" ", "_")


# -- step 3: dimensions --------------------------------------------------------------------------


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


# -- step 4: checks ------------------------------------------------------------------------------


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
    """Warn about a number that is far from all others and often marks a missing value."""
    flat = np.ravel(values)
    known = flat[np.isfinite(flat)]
    for end in (known.min(), known.max()) if known.size else ():
        rest = known[known != end]
        usual = np.isclose(end, SENTINELS, rtol=1e-5, atol=0.0).any()
        if usual and rest.size and min(abs(rest - end)) > np.ptp(rest):
            where = _place(int(np.argmax(flat == end)), lines, flat.size)
            warn_user(
                f"{quantity}: {end:.9g} occurs in {where} ({known.size - rest.size} such values),"
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
