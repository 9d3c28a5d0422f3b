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

    >>> force = Column("F", "kN", np.array([2.0, 3.5]), 0, "F (kN)")
    >>> values, unit = column_in_si(force, "peak force", None, ["Pa", "N"])
    >>> values.tolist(), unit
    ([2000.0, 3500.0], 'N')
    >>> bare, coefficients = Column("F", "", values, 0, "F"), Column("COF", "", values, 0)
    >>> values, unit = column_in_si(bare, "peak force", "MPa", ["N", "Pa"])
    >>> values.tolist(), unit, column_in_si(coefficients, "friction", None, ["1"])[1]
    ([2000000000.0, 3500000000.0], 'Pa', '1')
    >>> for column, given in ((force, "N"), (bare, None)):
    ...     try:
    ...         column_in_si(column, "peak force", given, ["N"], "unit")
    ...     except InputError as error:
    ...         print(str(error)[:89])
    peak force is given in N, but the source states kN. Leave the unit out, or correct the so
    the unit of the peak force is not stated. Write it into the heading of 'F', or pass unit=
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

    >>> import pandas as pd
    >>> import xarray as xr
    >>> frame = pd.DataFrame({"F (kN)": [2, 3]})
    >>> with_stated_unit(frame["F (kN)"], ["N"]), with_stated_unit([2, 3], ["N"])[0]
    ((array([2., 3.]), 'kN'), array([2., 3.]))
    >>> arrays = [xr.DataArray([2], attrs={"units": unit}) for unit in ("kN", "")]
    >>> [with_stated_unit(array, ["N"])[1] for array in arrays] == ["kN", None]
    True
    """
    stated = ""
    if hasattr(value, "dims") and not hasattr(value, "data_vars"):
        stated, value = stated_unit(value), value.data
    elif hasattr(value, "to_xarray") and hasattr(value, "name"):
        stated, value = name_and_unit(str(value.name or ""))[1], value.to_numpy()
    numbers, si = magnitude_in_one_of(value, tuple(units))
    return as_numbers(numbers), si or stated or None


def without_missing(values: Array, options: Options) -> Array:
    """Return values with NaN in place of the numbers that mark a missing value.

    >>> values = np.array([-99.0, 2.0, -98.99995, 7.0])
    >>> without_missing(values, Options(missing=(7, "bad", -99))).tolist()
    [nan, 2.0, nan, nan]
    >>> without_missing(np.array([0.0, 1e-9]), Options(missing=0)).tolist()
    [nan, 1e-09]
    >>> without_missing(values, Options(missing="bad")) is values
    True
    """
    numbers = [number for number in options.stated if not isinstance(number, str)]
    absent = [np.isclose(values, number, rtol=1e-6, atol=0.0) for number in numbers]
    return np.where(np.any(absent, axis=0), np.nan, values) if absent else values


# -- from a source to a profile ------------------------------------------------------------------


def is_coefficient(value: Any) -> bool:
    """Return whether a labelled array states that it holds friction coefficients, unit 1.

    >>> import xarray as xr
    >>> arrays = [xr.DataArray([0.4], attrs={"units": unit}) for unit in ("1", "%", "Pa", "")]
    >>> [*map(is_coefficient, arrays)], is_coefficient([0.4])
    ([True, True, False, False], False)
    """
    return hasattr(value, "dims") and is_in(stated_unit(value), "1")


def of_array(values: Any, quantity: str) -> Any:
    """Return an array without labels as a profile along a line or over a plane.

    >>> of_array([[1, 2, 3], [4, 5, 6]], "strength").sizes, of_array([7, 8], "height").dims
    (Frozen({'x': 2, 'y': 3}), ('x',))
    >>> of_array([7, 8], "height").attrs
    {'units': ''}
    """
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

    >>> import pandas as pd
    >>> import xarray as xr
    >>> frame = pd.DataFrame({"tau (kPa)": [3, 4.5], "x (mm)": [5, 0]})
    >>> array = named(frame, "strength")
    >>> array.dims, array.values.tolist(), array.x.values.tolist()
    (('x',), [3.0, 4.5], [5.0, 0.0])
    >>> array.attrs["units"], array.x.attrs["units"], array.attrs["read"].others
    ('kPa', 'mm', ("'x (mm)' (x)",))
    >>> array.attrs["lines"].tolist(), named(xr.DataArray([3], dims="x"), "height").dims
    ([0, 1], ('x',))
    >>> plane = xr.DataArray([[3, 4]], {"x": [5, 6], "y": [7]}, ("y", "x"))
    >>> named(plane, "strength").dims
    ('x', 'y')

    The same for a dataset and for an array with several coordinates:

    >>> data = xr.Dataset({"tau": ("n", [3, 4.5]), "Pos": ("n", [5, 0]), "t": ("n", [1, 2])})
    >>> for given in (data, data.tau.assign_coords(Pos=data.Pos, t=data.t)):
    ...     for x in (None, "t"):
    ...         array = named(given, "strength", x=x)
    ...         print(array.dims, array.x.values, [*array.coords], array.attrs["read"] is None)
    ('x',) [5 0] ['x'] False
    ('x',) [1 2] ['x'] False
    ('x',) [5 0] ['x'] True
    ('x',) [1 2] ['x'] True
    >>> named(data, "strength", value="t").values.tolist(), named([1, 2], "strength")
    ([1, 2], [1, 2])
    >>> named(data.tau, "strength", value="tau").values.tolist()
    [3.0, 4.5]
    >>> for given, value in ((data.tau, "t"), (pd.Series([1]), None), (plane.drop_vars("y"), None)):
    ...     try:
    ...         named(given, "strength", value=value)
    ...     except InputError as error:
    ...         print(str(error)[:57])
    value: must be the only variable, 'tau', got 't'
    a table of pandas needs headings, such as x (mm) and stre
    has only one of the coordinates x and y. Give both
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
    """Return whether the values of a table lie over x and y: places repeat.

    >>> def is_map(names, *values):
    ...     columns = zip(names, map(np.array, values))
    ...     return _is_map([Column(name, "", column, 0) for name, column in columns])
    >>> is_map("Xyt", [0, 0, 1], [4, 5, 6], [7, 8, 9]), is_map("xyt", [0, 1], [4, 4], [7, 8])
    (True, False)
    >>> is_map("xy", [0, 0], [4, 5]), is_map("xzt", [0, 0], [4, 5], [7, 8])
    (False, False)

    Without headings, x and y must both repeat:

    >>> is_map("012", [0, 0, 1, 1], [4, 5, 4, 5], [7, 8, 9, 6])
    True
    >>> is_map("012", [0, 0, 1, 1], [4, 5, 4, 6], [7, 7, 7, 7])
    False
    """
    named = {_plain(column.name): column.values for column in columns}
    if [*named] == ["0", "1", "2"]:  # without headings both must repeat
        return all(np.unique(named[name]).size <= named[name].size // 2 for name in "01")
    both = len(named) > 2 and {"x", "y"} <= {*named}
    return both and np.unique(named["x"]).size < named["x"].size


def _of_table(
    table: Table, quantity: str, dims: Any, x: Wanted, value: Wanted
) -> tuple[Any, Reading]:
    """Return the values of a table over its coordinates, and what was read.

    >>> places = [Column(name, "mm", np.array([0.0, 0.0, 5.0]), 0, name) for name in "xy"]
    >>> tau = Column("tau", "kPa", np.array([3.0, 4.5, np.nan]), 2, "tau (kPa)")
    >>> table = Table((*places, tau), "a.csv", np.arange(3))
    >>> array, read = _of_table(table, "strength", None, None, None)
    >>> array.dims, [*array.coords], array.name, array.units, array.y.units, read.values
    (('row',), ['x', 'y'], 'tau', 'kPa', 'mm', 2)
    >>> array, read = _of_table(table, "strength", ("x",), None, None)
    >>> [*array.coords], read.unit, read.others
    (['x'], 'kPa', ("'x' (x)", "'y' (other, not read)"))
    >>> note = Column("x", "", np.zeros(3), 0, "x", "holds words")
    >>> for wrong in (table._replace(columns=(note, *table[0][1:])), table._replace(begins=(1, 3))):
    ...     try:
    ...         _of_table(wrong, "strength", ("x", "y"), None, None)
    ...     except InputError as error:
    ...         print(str(error)[:14])
    holds words
    holds 2 tables
    """
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
    """Return a variable of a dataset, with others along it as coordinates, and what was read.

    >>> import xarray as xr
    >>> data = xr.Dataset({"tau": ("n", [3, 4.5]), "pos": ("n", [5, 0]), "t": ("n", [1, 2])})
    >>> data = data.assign(lateral=("m", [7]), tau=data.tau.assign_attrs(units="kPa"))
    >>> array, read = _of_dataset(data, "strength", ("x",), None, None)
    >>> array.name, [*array.coords], str(read)[:33]
    ('tau', ['pos', 't'], ": variable 'tau' in kPa, 2 values")
    >>> read.others
    ("'pos' (x)", "'t' (time, not read)", "'lateral' (travel, not read)")
    >>> array, read = _of_dataset(data, "strength", ("x",), "t", "pos")
    >>> array.name, [*array.coords], read.unit, read.others[1]
    ('pos', ['tau', 't'], 'Pa, which is assumed', "'t' (x)")

    On a plane, a profile has two dimensions, and both places have names:

    >>> strength = ("n", "m"), [[3], [4]]
    >>> plane = xr.Dataset({"y": ("m", [8]), "shear": strength, "x": ("n", [5, 0])})
    >>> plane["peak"] = ("n", [7, 9])
    >>> array, read = _of_dataset(plane, "strength", ("x", "y"), None, None)
    >>> array.name, [*array.coords], read.others[:2]
    ('shear', ['y', 'x', 'peak'], ("'y' (y)", "'x' (x)"))
    """
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
    """Return a DataArray whose only coordinates are its positions.

    >>> import xarray as xr
    >>> along = {"Pos": ("n", [5, 0]), "t": ("n", [1, 2]), "y": ("m", [7]), "lateral": 3}
    >>> array = xr.DataArray([[3], [4.5]], along, ("n", "m"))
    >>> for dims, x in ((("x",), None), (("x",), "t"), (("x", "y"), None)):
    ...     places = _with_places(array, dims, x).coords
    ...     print({name: at.values.tolist() for name, at in places.items()})
    {'x': [5, 0]}
    {'x': [1, 2]}
    {'y': [7]}
    >>> _with_places(array.assign_coords(distance=("n", [8, 9])), ("x",), None)
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: coordinates pos and distance could be x. Pass x='pos'
    """
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
    """Return the message about remarks that separate several tables in a file.

    >>> lines = 3, 8, 12, 20, 31, 44
    >>> for begins in (lines, lines[:5]):
    ...     print(several_tables(Table((), "", np.zeros(0), begins=begins))[:88])
    holds 6 tables, separated by remarks. They begin at lines 3, 8, 12, 20, 31, .... Pass sk
    holds 5 tables, separated by remarks. They begin at lines 3, 8, 12, 20, 31. Pass skip= w
    """
    lines = ", ".join(map(str, table.begins[:5])) + ", ..." * (len(table.begins) > 5)
    return (
        f"holds {len(table.begins)} tables, separated by remarks. They begin at lines {lines}. Pass"
        " skip= with the number of lines above the last table, or save the wanted table alone"
    )


def _chosen(
    columns: Sequence[Column], quantity: str, dims: tuple[str, ...], x: Wanted, value: Wanted
) -> tuple[Column, dict[str, Column]]:
    """Return the column of a quantity, and by direction the columns of its coordinates.

    >>> def choose(headings, dims=("x",), x=None, value=None, quantity="strength"):
    ...     columns = [
    ...         Column(name or str(number), "", np.zeros(2), number, name)
    ...         for number, name in enumerate(headings)
    ...     ]
    ...     try:
    ...         chosen, places = _chosen(columns, quantity, dims, x, value)
    ...     except InputError as error:
    ...         return str(error)[:52]
    ...     return chosen.number, {name: column.number for name, column in places.items()}
    >>> choose(["tau", "Weg"]), choose(["tau", "Weg", "x"]), choose(["tau", "t", "F"], x="t")
    ((0, {'x': 1}), (0, {'x': 2}), (0, {'x': 1}))

    A column without a heading is an index. Without any headings, the first
    column is x:

    >>> choose(["", "tau", "x"]), choose(["", "F"]), choose(["", ""]), choose(["", ""], value=0)
    ((1, {'x': 2}), (1, {}), (1, {'x': 0}), (0, {}))
    >>> choose(["", ""], value=1), choose(["x", "F"], value="x"), choose(["", ""], ("x", "y"))[:14]
    ((1, {'x': 0}), (0, {}), 'has no columns')

    Three columns without positions are refused unless the caller names the
    value. A map needs both places:

    >>> choose(["tau", "t", "F"]), choose(["tau", "t", "F"], value="F"), choose(["tau", "t"])
    ('no column is clearly the position x. A column is rea', (2, {}), (0, {}))
    >>> choose(["y", "tau", "x"], ("x", "y")), choose(["", "", ""], ("x", "y"))
    ((1, {'y': 0, 'x': 2}), (2, {'x': 0, 'y': 1}))
    >>> choose(["", "", ""], ("x", "y"), value=1), choose(["t", "tau", "x"], ("x", "y"))
    ((1, {'x': 0, 'y': 1}), "has no columns x and y: got 't', 'tau', 'x'. A map n")
    """
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

    >>> def choose(quantity, *names, unit=""):
    ...     try:
    ...         columns = [Column(name, unit, np.zeros(2), 0, name) for name in names]
    ...         return _by_rule(columns, quantity).name
    ...     except InputError as error:
    ...         return str(error)
    >>> choose("strength", "tau_r", "peak", "sigma"), choose("residual_strength", "tau_r", "tau")
    ('peak', 'tau_r')
    >>> choose("strength", "tau_r")[:58]
    "the heading 'tau_r' says residual_strength, not strength. "
    >>> choose("strength", "tau_r")[58:]
    "Pass quantity='residual_strength', or value='tau_r'"

    A coefficient without a unit is no stress:

    >>> choose("strength", "COF")[:57], choose("strength", "COF", unit="kPa")
    ("the heading 'COF' says friction_coefficient, not strength", 'COF')
    >>> choose("friction_coefficient", "COF"), choose("height", "x", "z"), choose("height")[:20]
    ('COF', 'z', 'no column is clearly')
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
    """Return whether a heading says that its column is a quantity: by its name, else its role.

    Roles count only if no heading is a name of the quantity:

    >>> columns = [Column(name, "", None, 0) for name in ("shear", "Clamp", "tau P", "x")]
    >>> [*map(_says(("strength", "tau_p"), "strength", columns), columns)]
    [False, False, True, False]
    >>> [*map(_says(("strength",), "strength", columns), columns)]
    [True, False, True, False]
    >>> [*map(_says(("pressure",), "normal_pressure", columns), columns)]
    [False, True, False, False]
    >>> [*map(_says(("height", "z"), "height", columns), columns)]
    [False, False, False, False]
    """
    named = any(_plain(column.name) in words for column in columns)
    if named or quantity not in SAID_BY_ROLE:
        return lambda column: _plain(column.name) in words
    return lambda column: role_of(column) == SAID_BY_ROLE[quantity]


def _place_of(columns: Sequence[Column], quantity: str) -> Column | None:
    """Return the column of positions: by its heading, or as the only one in a unit of length.

    >>> def place(*headings, quantity="strength"):
    ...     columns = [
    ...         Column(name, unit, np.zeros(2), number, name, "no number" * (unit == "?"))
    ...         for number, (name, unit) in enumerate(heading.split() for heading in headings)
    ...     ]
    ...     try:
    ...         return str(_place_of(columns, quantity))
    ...     except InputError as error:
    ...         return str(error)[:37]
    >>> place("Weg mm", "Pos um"), place("x ?", "Weg mm"), place("stroke %", "run mm")
    ("column 1 'Pos'", "column 1 'Weg'", "column 1 'run'")
    >>> place("Weg mm", "travel mm"), place("run mm", "gauge m"), place("t s", "run mm")
    ('2 columns could be the position x. A ', 'None', "column 1 'run'")

    A column in a unit of length may also hold the heights:

    >>> place("z mm", "run um", quantity="height"), place("run um", quantity="height")
    ('None', 'None')
    >>> place("z mm", "lateral um", quantity="height"), place("slip um", quantity="slip")
    ("column 1 'lateral'", 'None')
    """
    words = (quantity, *NAMES.get(quantity, ()))
    numeric = [c for c in columns if not c.text and _plain(c.name) not in words]
    called = [c for c in numeric if _plain(c.name) in PLACES]
    if not called:
        called = [c for c in numeric if role_of(c) == "travel"]
        called = [c for c in called if not c.unit or is_in(c.unit, "m")]
    if not called and QUANTITIES[quantity].units != "m":
        called = [c for c in numeric if is_in(c.unit, "m")]
        called = called if len(called) == 1 else []
    if len(called) > 1:
        raise InputError(unclear(columns, "position x", "x", called))
    return called[0] if called else None


def _plain(name: Any) -> str:
    """Return a name in small letters without blanks.

    >>> _plain("Shear Strength"), _plain(3)
    ('shear_strength', '3')
    """
    return str(name).casefold().replace(" ", "_")


def _directed(array: Any, dims: tuple[str, ...]) -> Any:
    """Return the array over 'x' (or 'x' and 'y', or 'row').

    A dimension of samples comes first.

    >>> import xarray as xr
    >>> def directed(shape, names, dims=("x",), **coords):
    ...     try:
    ...         array = _directed(xr.DataArray(np.zeros(shape), coords, names), dims)
    ...         return dict(array.sizes), [*array.coords]
    ...     except InputError as error:
    ...         return str(error)[:37]
    >>> directed(3, ["n"], x=("n", [1, 2, 4]), t=("n", [5, 6, 7])), directed(3, ["n"])
    (({'x': 3}, ['x']), ({'x': 3}, []))
    >>> directed((3, 2), ["n", "Sample"]), directed((3, 2), ["x", "k"]), directed(3, ["Samples"])
    (({'Sample': 2, 'x': 3}, []), ({'k': 2, 'x': 3}, []), ({'Samples': 3}, []))
    >>> plane = "x", "y"
    >>> directed((3, 2, 4), ["y", "x", "run"], plane), directed((3, 2), ["y", "x"], plane)
    (({'run': 4, 'x': 2, 'y': 3}, []), ({'x': 2, 'y': 3}, []))
    >>> directed(3, ["sample"], plane), directed((2, 3), ["sample", "row"], plane, sample=[7, 9])
    (({'sample': 3}, []), ({'sample': 2, 'row': 3}, []))

    Other dimensions leave the direction open:

    >>> arrays = (3, ["n"]), (3, ["x"]), ((3, 2), ["x", "sample"])
    >>> [directed(*given, plane)[:14] for given in arrays]
    ['the dimensions', 'the dimensions', 'the dimensions']
    >>> [directed((3, 2), names)[:14] for names in (["x", "y"], ["a", "b"], ["x", "row"])]
    ['the dimensions', 'the dimensions', 'the dimensions']
    >>> directed((3, 2, 4), ["x", "sample", "run"])[:14]
    'the dimensions'
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
