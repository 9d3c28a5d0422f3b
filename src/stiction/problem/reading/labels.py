"""Names of labelled data: choose the variable and its coordinates, and name the dimensions.

A source is a file, an xarray object or a table of pandas. It may hold
many variables, and their names and units follow no standard. A wrong
choice would give a wrong number, so an ambiguous choice is refused.
`named` takes these steps:

1. Choose the variable and its coordinates by the argument. Without an
   argument, choose by the name, and then by the unit.
2. Call the dimensions 'x' and 'y', or 'row' for a list of points. The
   sample comes first.

`profile_in_si` then converts values and coordinates to SI.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Annotated, Any

import numpy as np

from stiction.base.arrays import Array
from stiction.base.errors import InputError, prefixed, unknown_name
from stiction.base.units import (
    as_numbers,
    check_agreement,
    check_measured,
    conversion,
    is_in,
    magnitude_in_one_of,
    stated_unit,
)
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
SAID_BY_ROLE = {
    "strength": "friction", "friction_coefficient": "friction", "normal_pressure": "pressing force"
}  # fmt: skip
"""Role of the columns that may hold a quantity under any name."""
Missing = Annotated[
    float | str | tuple[float | str, ...] | list[float | str], "float | str | list"
]
OF_A_PLANE = (
    ". A map needs columns or coordinates x and y, or an array (nx, ny), such as np.loadtxt(path).T"
    " of a matrix, and an interface with two lengths and two numbers of nodes"
)
"""Advice for two dimensions where a line was expected."""


# -- columns of numbers ---------------------------------------------------------------------------


def column_in_si(
    column: Column, quantity: str, given: str | None, units: Iterable[str], option: str = ""
) -> tuple[Array, str]:
    """Return a column in SI and its SI unit.

    The source or the caller states the original unit.
    """
    name = given or column.unit or "1" * is_coefficient_name(column)
    if not name:
        way = f", or pass {option}=" * bool(option)
        raise InputError(
            f"the unit of the {quantity} is not stated. Write it into the heading of"
            f" {column.label!r}{way}"
        )
    check_measured(column.values, quantity, doubted=False)
    with prefixed(quantity, " "):
        if given:
            check_agreement(given, column.unit)
        factor, si = conversion(name, tuple(units))
    return column.values * factor, si


def with_stated_unit(value: Any, units: Iterable[str]) -> tuple[Array, str | None]:
    """Return numbers without labels, and the unit if the source states a unit.

    The unit belongs to a quantity, is the attribute `units`, or is part
    of the name of a Series.
    """
    stated = ""
    if hasattr(value, "dims") and not hasattr(value, "data_vars"):
        stated, value = stated_unit(value), value.data
    elif hasattr(value, "to_xarray") and hasattr(value, "name"):
        stated, value = name_and_unit(str(value.name or ""))[1], value.to_numpy()
    numbers, si = magnitude_in_one_of(value, tuple(units))
    return as_numbers(numbers), si or stated or None


def without_missing(values: Array, options: Options) -> Array:
    """Return values with NaN in place of the numbers that mark a missing value."""
    numbers = [number for number in options.stated if not isinstance(number, str)]
    absent = [np.isclose(values, number, rtol=1e-6, atol=0.0) for number in numbers]
    return np.where(np.any(absent, axis=0), np.nan, values) if absent else values


# -- from a source to a profile ------------------------------------------------------------------


def is_coefficient(value: Any) -> bool:
    """Return whether a labelled array states that it holds friction coefficients, unit 1."""
    return hasattr(value, "dims") and is_in(stated_unit(value), "1")


def of_array(values: Any, quantity: str) -> Any:
    """Return an array without labels as a profile along a line or over a plane."""
    import xarray as xr

    numbers, si = magnitude_in_one_of(values, (QUANTITIES[quantity].units,))
    array = as_numbers(numbers)
    if array.ndim not in (1, 2) or array.size == 0:
        raise InputError(f"must have shape (nodes,) or (nx, ny), got shape {array.shape}")
    return xr.DataArray(array, dims=("x", "y")[: array.ndim], attrs={"units": si or ""})


# -- steps 1 and 2 --------------------------------------------------------------------------------


def named(
    data: Any,
    quantity: str,
    dims: tuple[str, ...] | None = None,
    *,
    x: Wanted = None,
    value: Wanted = None,
) -> Any:
    """Return a quantity among labelled data over 'x' (or 'x' and 'y', or 'row'), the sample first.

    The attributes are the unit and, of a table, what was read. Data
    without labels, and labelled single numbers, are returned as given.
    """
    # 1. The column and its coordinates, by the rule.
    if hasattr(data, "to_xarray") and hasattr(data, "index"):
        if data.ndim == 1 or not all(isinstance(name, str) for name in data.columns):
            raise InputError(
                "a table of pandas needs headings, such as x (mm) and strength (MPa). For values"
                " in the order of nodes, pass .to_numpy()"
            )
        data = table_of_frame(data)
    if isinstance(data, Table):
        array, read = _of_table(data, quantity, dims, x, value)
        dims = dims or (("x", "y") if "y" in array.coords else ("x",))
    elif not (getattr(data, "dims", ()) or hasattr(data, "data_vars")):
        return data
    else:
        dims = dims or (("x", "y") if {"x", "y"} <= {*data.dims} else ("x",))
        array, read = data, None
        if hasattr(data, "data_vars"):
            array, read = _of_dataset(data, quantity, dims, x, value)
        elif value not in (None, data.name):
            raise InputError(f"value: must be the only variable, {data.name!r}, got {value!r}")
        if x is not None or {*array.coords} != {*dims}:
            array = _with_places(array, dims, x)
    # 2. The dimensions.
    array = _directed(array, dims)
    if len({*dims} & {*array.coords}) == 1 < len(dims):
        raise InputError("has only one of the coordinates x and y. Give both")
    array.attrs |= {"read": read, "lines": getattr(data, "lines", ())}
    return array


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
        {d: ("row", at.values, {"units": at.unit}) for d, at in places.items()},
        ("row",), str(chosen.name), {"units": chosen.unit},
    )  # fmt: skip
    return array, reading_of(table, chosen, QUANTITIES[quantity].units, places)


def _of_dataset(
    data: Any, quantity: str, dims: Any, x: Wanted, value: Wanted
) -> tuple[Any, Reading]:
    """Return a variable of a dataset, with others along it as coordinates, and what was read."""
    names = [*data.data_vars]
    columns = tuple(
        Column(str(name), stated_unit(data[name]), data[name], -1 - number, str(name))
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
    called = [_plain(x)] if x is not None else dims if len(dims) == 2 else PLACES
    used = {
        _plain(column.name) if len(dims) == 2 else "x": column
        for column in columns
        if _plain(column.name) in {*called} & {*map(_plain, along)}
    }
    read = reading_of(table, chosen, QUANTITIES[quantity].units, used)
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
        raise InputError(f"coordinates {' and '.join(called)} could be x. Pass x={called[0]!r}")
    places = {name if len(dims) == 2 else "x": along[name] for name in called}
    dropped = [name for name in array.coords if name not in array.dims]
    return array.drop_vars(dropped).assign_coords(places)


def several_tables(table: Table) -> str:
    """Return the message about remarks that separate several tables in a file."""
    lines = ", ".join(map(str, table.begins[:5])) + ", ..." * (len(table.begins) > 5)
    return (
        f"holds {len(table.begins)} tables, separated by remarks. They begin at lines {lines}. Pass"
        " skip= with the number of lines above the last table, or save the wanted table alone"
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
    if len(dims) == 1 and not places and len(columns) > 2 and value is None:
        raise InputError(unclear(columns, "position x", "x"))
    return chosen, places


def _by_rule(columns: Sequence[Column], quantity: str) -> Column:
    """Return the column of a quantity by the rule.

    The name of another excludes a column.
    """
    words, si = (quantity, *NAMES.get(quantity, ())), QUANTITIES[quantity].units
    others = {name: key for key in NAMES for name in NAMES[key] if name not in words}
    named = {c: others[name] for c in columns if (name := _plain(c.name)) in others}
    left = [column for column in columns if column not in named]
    if left or not named:
        says = _says(words, quantity, left)
        chosen = read_column(left, quantity, "value", None, [si], says)
        if chosen.unit or si == "1" or not is_coefficient_name(chosen):
            return chosen
        named = {chosen: "friction_coefficient"}
    column, other = next(iter(named.items()))
    raise InputError(
        f"the heading {column.label!r} says {other}, not {quantity}. Pass quantity={other!r}, or"
        f" value={column.label!r}"
    )


def _says(words: Sequence[str], quantity: str, columns: Sequence[Column]) -> Any:
    """Return whether a heading says that its column is a quantity: by its name, else its role."""
    named = any(_plain(column.name) in words for column in columns)
    if named or quantity not in SAID_BY_ROLE:
        return lambda column: _plain(column.name) in words
    return lambda column: role_of(column) == SAID_BY_ROLE[quantity]


def _place_of(columns: Sequence[Column], quantity: str) -> Column | None:
    """Return the column of positions: by its heading, or as the only one in a unit of length."""
    words = (quantity, *NAMES.get(quantity, ()))
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


def _directed(array: Any, dims: tuple[str, ...]) -> Any:
    """Return the array over 'x' (or 'x' and 'y', or 'row').

    A dimension of samples comes first.
    """
    if len(dims) == 1 and "x" in array.coords:
        array = array.swap_dims({array["x"].dims[0]: "x"})
    names = [str(dim) for dim in array.dims]
    if len(dims) == 1 and "x" not in names:
        called = [name for name in names if _plain(name) not in SAMPLE_NAMES]
        if len(called) == 1:
            array = array.rename({called[0]: "x"})
    along = [dim for dim in (*dims, "row") if dim in array.dims]
    samples = [dim for dim in array.dims if dim not in along]
    single = not along and len(samples) == 1  # a single value for each sample
    single = single and (len(dims) == 1 or _plain(samples[0]) in SAMPLE_NAMES)
    clear = single or along in ([*dims], ["row"])
    if not clear or len(samples) > 1 or "y" in samples or len({*array.dims}) < array.ndim:
        raise InputError(
            f"the dimensions ({', '.join(names)}) do not say which run along the interface. Call"
            f" them 'x', 'y' (across slip) and 'sample'{OF_A_PLANE * (len(dims) == 1)}"
        )
    array = array.drop_vars([name for name in array.coords if name not in dims])
    return array.transpose(*samples, *along)
