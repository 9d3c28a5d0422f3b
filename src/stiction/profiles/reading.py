"""Measured profiles: read from files and labelled arrays, and put on the nodes of an interface.

Units that are stated are converted, coordinates decide where a value belongs, and gaps stay gaps
unless they are filled on request. All of it is the same on a line and on a plane.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from stiction.errors import InputError, prefixed, unknown_name
from stiction.interface import Interface
from stiction.model import FilePath, Flag, check, checked, describe, real_array
from stiction.profiles.placing import MEASURED, OF_A_PLANE, Gaps, Points, close_gaps, place
from stiction.profiles.tables import load, read_npy
from stiction.profiles.units import factor_to, is_in, parse

if TYPE_CHECKING:
    import xarray as xr

UNITS = {
    "strength": "Pa",
    "residual_strength": "Pa",
    "residual_ratio": "1",
    "initial_stress": "Pa",
    "normal_pressure": "Pa",
    "weakening_rate": "Pa/m",
    "critical_slip": "m",
    "fracture_energy": "J/m2",
    "load_profile": "1",
    "slip": "m",
    "friction_coefficient": "1",
    "height": "m",
}
"""What can be a profile, and its SI unit."""
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
PLACES = ("x", "position", "pos", "distance", "coordinate")
SAMPLES = ("sample", "samples")

Column = str | int | None


@checked
def read_profile(
    source: Any,
    *,
    x: Column = None,
    value: Column = None,
    unit: str | None = None,
    x_unit: str | None = None,
    quantity: str = "strength",
    interface: Interface | None = None,
    interpolate: Flag = False,
    gaps: Gaps = "refuse",
) -> xr.DataArray:
    """Read a profile along the interface from a file or a labelled array, in SI units.

    Parameters
    ----------
    source : path, xarray.DataArray or xarray.Dataset
        ``.npy``: shape (nodes,). ``.csv``, ``.txt``, ``.dat``, ``.tsv``: columns separated by
        semicolons, tabs, commas or blanks, with or without a line of names, such as
        ``x (mm); strength (MPa)``. ``.nc``: variables with `units`, and x as a coordinate.
    x, value : str or int, optional
        Name, heading or number (from 0) of the column, coordinate or variable. By default the one
        with such a name (``x``, ``position``; ``strength``, ``tau_p``), the only one in a unit of
        length or of `quantity`, or the first and second of two columns; one column has no x.
    unit, x_unit : str, optional
        Units of the values and of x if the source states none; SI by default.
    quantity : str
        'strength', 'residual_strength', 'initial_stress', 'normal_pressure' (Pa), 'critical_slip',
        'height' (m), 'weakening_rate' (Pa/m), 'load_profile' or 'friction_coefficient' (1).
    interface : Interface, optional
        Map the profile to the nodes x_i = i L/n, modulo L, from points in any order. For a
        plane, pass ``.npy`` of shape (nx, ny), ``.nc`` or labelled arrays over 'x' and 'y',
        or text with the columns x, y and value.
    interpolate : bool
        Interpolate linearly if the points of a line do not coincide with the nodes.
    gaps : {"refuse", "fill", "skip"}
        Refuse missing values (NaN, empty cells, missing points), fill them with straight
        lines (on a plane with the smoothest surface over their rim), or leave NaN, for
        `stiction.fit_field`. Without an interface, they always stay.

    Returns
    -------
    xarray.DataArray
        Over 'x' (m), on a plane over 'x' and 'y', with `units`. With gaps it has the coordinate
        'measured', False in a gap, which `stiction.onset` and its figure take over.

    Raises
    ------
    InputError
        If the source cannot be read, is in an unknown or unsuitable unit, is ambiguous
        about the columns, or does not fit the interface.

    Warns
    -----
    AccuracyWarning
        If something is interpolated or filled in, or x lies between the nodes.

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

    if quantity not in UNITS:
        raise InputError(unknown_name("quantity", quantity, UNITS))
    dims = ("x",) if interface is None else interface.dims
    if interface is None and (interpolate or gaps == "fill"):
        raise InputError("interface: needed to interpolate, or to fill gaps")
    if len(dims) == 2 and (interpolate or x is not None or x_unit is not None):
        raise InputError("x, x_unit and interpolate: are options of profiles of a line")
    with prefixed(str(source) if isinstance(source, str | Path) else "source"):
        points = points_of(source, quantity, dims, x=x, value=value, unit=unit, x_unit=x_unit)
        values, places, measured = points
        if values.ndim != (1 if places else len(dims)):
            raise InputError(f"must hold one profile, got shape {values.shape}")
        if interface is not None:
            values, measured = place(points, interface, interpolate, gaps)
            places = interface.coordinates
        elif places and np.unique(places["x"]).size < values.size:
            raise InputError(f"x repeats: there are two values at one position{OF_A_PLANE}")
    coords: dict[str, Any] = {
        dim: (dim, at, {"units": "m", "long_name": f"position along {dim}"})
        for dim, at in places.items()
    }
    if not np.all(measured):
        coords[MEASURED] = (dims, measured, {"long_name": "measured, not filled in"})
    attributes = {"units": UNITS[quantity], "long_name": quantity.replace("_", " ")}
    array = xr.DataArray(values, coords, dims, name=quantity, attrs=attributes)
    return array.sortby("x") if interface is None and places else array


# -- values in SI --------------------------------------------------------------------------------


def is_labelled(value: Any) -> bool:
    """Whether it is an xarray object, tested without importing xarray."""
    return hasattr(value, "dims") and hasattr(value, "coords")


def simplified(value: Any, quantity: str) -> Any:
    """Return `value` as labelled, a pandas Series over positions too, or as numbers in SI."""
    if is_labelled(value):
        plain = not value.dims and not hasattr(value, "data_vars")
        return _values(value, quantity, None, UNITS[quantity]) if plain else value
    kind = getattr(getattr(getattr(value, "index", None), "dtype", None), "kind", "")
    if kind == "f" and hasattr(value, "to_xarray"):
        return value.to_xarray()
    return _magnitude(value, UNITS[quantity])


def _magnitude(value: Any, si: str) -> Any:
    """The plain number of a pint or astropy quantity in an SI unit; anything else as it is."""
    try:
        if hasattr(value, "magnitude") and hasattr(value, "to"):
            return value.to(si).magnitude
        if hasattr(value, "to_value") and hasattr(value, "unit"):
            return value.to_value(si)
    except Exception as error:  # each library has its own for 'no such unit'
        raise InputError(f"cannot be converted to {si}: {error}") from None
    return value


def _values(array: Any, what: str, given: str | None, si: str) -> Any:
    """Values of a DataArray in SI, by the unit that the caller gives and the source states."""
    stated = _unit_of(array)
    with prefixed(what, " "):
        try:
            values = real_array(_magnitude(array.data, si))
        except TypeError as error:
            raise InputError(f"must be numbers; {error}") from None
        factor = factor_to(si, given or stated or si)
        known = given and stated and parse(stated)
        if known and not np.isclose(factor_to(si, str(stated)), factor, rtol=1e-12):
            raise InputError(f"is given in {given}, but the source states {stated}")
    return values * factor


def _unit_of(array: Any) -> str | None:
    stated = (str(array.attrs.get(key, "")).strip() for key in ("units", "unit"))
    return next(filter(None, stated), None)


# -- which variable, and which coordinates -------------------------------------------------------


def points_of(
    source: Any,
    quantity: str,
    dims: tuple[str, ...] = ("x",),
    *,
    x: Column = None,
    value: Column = None,
    unit: str | None = None,
    x_unit: str | None = None,
) -> Points:
    """Return the values of a quantity in `source`, in SI, along the directions `dims`."""
    data: Any = load(Path(source), dims) if isinstance(source, str | Path) else source
    if not is_labelled(data):
        raise InputError(f"must be a path, a DataArray or a Dataset, got {describe(source)}")
    if hasattr(data, "data_vars"):
        data, x = _variable(data, quantity, dims, x, value)
    elif value is not None and value != data.name:
        raise InputError(
            f"value: {value!r} is not the name of the only variable, {data.name!r}"
        )
    array = _along(data, dims, x)
    values = _values(array, quantity, unit, UNITS[quantity])
    if not {*dims, "row"} & set(array.dims):  # one value a sample
        return Points(values[:, np.newaxis], {})
    measured: Any = True
    if MEASURED in array.coords:
        mask = array.coords[MEASURED].broadcast_like(array).transpose(*array.dims)
        measured = mask.values.astype(bool)
    places = {
        dim: _values(array[dim], dim, x_unit if dim == "x" else None, "m")
        for dim in dims
        if dim in array.coords
    }
    if places and "row" not in array.dims and len(dims) == 2:  # each point of a grid on its own
        if len(places) == 1:
            raise InputError(
                f"has the coordinate {min(places)!r} only; a map has x and y, or none"
            )
        grid = np.meshgrid(*places.values(), indexing="ij")
        places = {dim: at.ravel() for dim, at in zip(dims, grid, strict=True)}
        values = values.reshape(*values.shape[:-2], -1)
        measured = np.broadcast_to(measured, array.shape).reshape(values.shape)
    return Points(values, places, measured)


def _variable(
    data: Any, quantity: str, dims: tuple[str, ...], x: Column, value: Column
) -> tuple[Any, Column]:
    """The variable that holds a quantity, with its places as coordinates, and what x is called."""
    names = list(data.data_vars)
    if value is not None:
        value = _column(data, names, "value", value)
    if "row" not in data.dims:
        places = [name for name in names if _plain(name) in PLACES or name == x]
    elif len(dims) == 2:
        places = [name for name in names if name.casefold() in dims]
        if len(places) < 2:
            raise InputError(
                f"holds {_listed(data, names)}; a map as text has a line for each place, with"
                " columns called 'x', 'y' and the value's; save a matrix (nx, ny) with np.save as"
                " .npy"
            )
    else:
        if x is None:
            x = _place_column(data, names, quantity, value)
        else:
            x = _column(data, names, "x", x)
        places = [] if x is None else [x]
        if not places and value is None and len(names) > 2:
            raise InputError(_unclear(data, names, quantity))
    left = [name for name in names if name not in places or name == value]
    array = data[_named(data, left, quantity, value)]
    called = {name if len(dims) == 1 else name.casefold(): data[name] for name in places}
    return array.assign_coords(
        {name: (at.dims, at.data, at.attrs) for name, at in called.items()}
    ), x


def _place_column(data: Any, names: list[str], quantity: str, value: Column) -> str | None:
    """The column of a table that holds x; None if it has none."""
    called = [name for name in names if _plain(name) in PLACES]
    lengths = [name for name in names if name != value and is_in(_unit_of(data[name]), "m")]
    for found in (called, lengths if UNITS[quantity] != "m" else []):
        if len(found) == 1 and len(names) > 1:
            return found[0]
    known = value == names[0] or _plain(names[0]) in (quantity, *NAMES.get(quantity, ()))
    return names[0] if len(names) == 2 and not known else None


def _named(data: Any, names: list[str], quantity: str, value: Column) -> str:
    """Return the requested variable, or the one that is clearly the quantity."""
    if value is not None:
        return _column(data, names, "value", value)
    if len(names) == 1 and _is_unnamed(data[names[0]]):
        return names[0]
    alone = ("value", "values") if len(names) == 1 else ()
    for called in (quantity, *NAMES.get(quantity, ()), *alone):
        if found := [name for name in names if _plain(name) == called]:
            return found[0]
    # Any number is dimensionless: such a quantity cannot be recognised by its unit.
    si = UNITS[quantity]
    fitting = [name for name in names if si != "1" and is_in(_unit_of(data[name]), si)]
    if len(fitting) != 1:
        raise InputError(_unclear(data, names, quantity))
    return fitting[0]


def _column(data: Any, names: list[str], what: str, wanted: Column) -> str:
    """The variable of this name, heading or number."""
    for name in names:
        if wanted in (name, *(data[name].attrs.get(key) for key in ("heading", "number"))):
            return name
    raise InputError(unknown_name(what, str(wanted), names))


def _unclear(data: Any, names: list[str], quantity: str) -> str:
    if not names:
        return f"holds no profile (a variable of numbers){OF_A_PLANE}"
    matrix = all(_is_unnamed(data[name]) for name in names)
    hint = OF_A_PLANE * (matrix or {"x", "y"} <= {_plain(name) for name in data.data_vars})
    hint += "; heights are read with quantity='height'" * (quantity == "strength")
    return (
        f"holds no variable that is clearly the {quantity} ({UNITS[quantity]}): got"
        f" {_listed(data, names)}. Call it {quantity!r}, state its unit, or give x=...,"
        f" value=... and unit=...{hint}"
    )


def _listed(data: Any, names: list[str]) -> str:
    units = {name: _unit_of(data[name]) for name in names if not _is_unnamed(data[name])}
    shown = [f"{name!r} in {unit}" if unit else repr(name) for name, unit in units.items()]
    return ", ".join(shown) or f"{len(names)} columns without names, as of a matrix"


def _is_unnamed(array: Any) -> bool:
    return "number" in array.attrs and "heading" not in array.attrs


def _plain(name: Any) -> str:
    return str(name).casefold().replace(" ", "_")


def _along(array: Any, dims: tuple[str, ...], x: Column) -> Any:
    """The array over the sample, if there are several, and then 'x' ('x' and 'y'; 'row')."""
    if len(dims) == 1:
        array = _with_x(array, x)
    names = [str(dim) for dim in array.dims]
    along = [dim for dim in (*dims, "row") if dim in names]
    if len(dims) == 2 and along not in (["x", "y"], ["row"]) and names != ["sample"]:
        raise InputError(
            f"which dimensions run along the plane is not clear from ({', '.join(names)}); call"
            " them 'x', the direction of load and slip, and 'y', and a third one 'sample'"
        )
    samples = [name for name in names if name not in along]
    if len(samples) > 1:
        sizes = ", ".join(f"{name}: {size}" for name, size in array.sizes.items())
        raise InputError(f"must have one dimension beside x, got ({sizes}); select one point")
    return array.transpose(*samples, *along)


def _with_x(array: Any, x: Column) -> Any:
    """An array with its dimension along a line called 'x', and the coordinate there, if any."""
    names = [str(dim) for dim in array.dims]
    if {"x", "y"} <= set(names):
        raise InputError(f"holds values over x and y, not along a line{OF_A_PLANE}")
    along = [str(name) for name in array.coords if array[name].ndim == 1]
    along.sort(key=lambda name: name not in names)  # those of dimensions first
    at = [name for name in along if (_plain(name) in PLACES if x is None else name == x)]
    if x is not None and not at:
        raise InputError(unknown_name("x", str(x), [str(name) for name in array.coords]))
    called = [name for name in names if _plain(name) in PLACES]
    called = called or [name for name in names if _plain(name) not in SAMPLES]
    if at:
        dim = str(array[at[0]].dims[0])
    elif len(called) == 1 or (names and all(name.startswith("dim_") for name in names)):
        dim = called[-1]  # of dimensions that were never named the order counts
    elif len(names) == 1:  # one value a sample
        return array
    else:
        raise InputError(
            f"which dimension runs along the interface is not clear from ({', '.join(names)});"
            " call it 'x', and the other 'sample'"
        )
    at = at or [dim] * (dim in array.coords)
    place = array.coords[at[0]] if at else None
    array = array.drop_vars([name for name in array.coords if name != MEASURED])
    array = array.rename({dim: "x"})
    return array if place is None else array.assign_coords(x=("x", place.data, place.attrs))


# -- what takes profiles -------------------------------------------------------------------------


def at_nodes(
    name: str,
    value: Any,
    quantity: str,
    interface: Interface,
    gaps: Gaps = "refuse",
    interpolate: bool = False,
) -> tuple[Any, Any]:
    """Return what a caller gave for a quantity, with one value a node, and where it was measured.

    Numbers and plain arrays without gaps pass as they are, for whoever checks their shape; the mask
    is True if nothing is missing.
    """
    with prefixed(name):
        value = simplified(value, quantity)
        if is_labelled(value):
            points = points_of(value, quantity, interface.dims)
            if not points.places and points.values.shape[1:] == (1,):  # one value a sample
                if quantity == "strength":
                    raise InputError("has no dimension along the interface; call it 'x'")
                return points.values, True
            return place(points, interface, interpolate, gaps)
        if gaps != "refuse":
            with suppress(TypeError):  # no numbers: refused with everything else that is wrong
                array = real_array(value)
                if array.shape[-len(interface.shape) :] == interface.shape:
                    return close_gaps(array, True, interface, gaps)
    return value, True


def gather(
    problem: Any, given: Mapping[str, Any], gaps: Gaps = "refuse"
) -> tuple[dict[str, Any], Any]:
    """Put what a caller gave on the nodes, and find where all of it was measured.

    The mask has the shape (samples, *shape) or (1, *shape); it is True if nothing is missing.
    """
    problems: list[str] = []
    values = dict(given)
    measured: Any = True
    for name, value in given.items():
        if value is not None:
            try:
                values[name], whole = at_nodes(name, value, name, problem.interface, gaps)
                if not np.all(whole):
                    measured = measured & whole.reshape(-1, *problem.interface.shape)
            except InputError as error:
                problems += error.problems
    if problems:
        raise InputError(problems)
    return values, measured


def on_nodes(name: str, given: Any, interface: Interface) -> Any:
    """Return what `is_unplaced`, or what `profile_in_file` made of it, at the nodes."""
    options: dict[str, Any] = {}
    if isinstance(given, Mapping):
        import xarray as xr

        try:
            given = xr.DataArray.from_dict(dict(given))
            options = {key: given.attrs[key] for key in ("interpolate", "gaps")}
        except (ValueError, TypeError, KeyError, AttributeError):
            raise InputError(f"{name}: a profile table belongs in a study file") from None
    return np.asarray(at_nodes(name, given, quantity_of(name), interface, **options)[0])


def profile_in_file(given: Any, field: str, folder: str | Path) -> Any:
    """Return the profile that a study file names for a parameter, its path relative to `folder`.

    A dict has `file` and options of `read_profile`. What is returned is a DataArray in plain form,
    with options of `place` among its attributes, or the array of an .npy.
    """
    table = dict(given) if isinstance(given, Mapping) else {"file": given}
    if "file" not in table:  # what this function returned
        return table
    path = Path(folder) / check("file", table.pop("file"), FilePath)
    if path.suffix.lower() == ".npy" and not table:
        with prefixed(str(path)):
            return read_npy(path)
    options = {
        "interpolate": check("interpolate", table.pop("interpolate", False), Flag),
        "gaps": check("gaps", table.pop("gaps", "refuse"), Literal["refuse", "fill"]),
    }
    found = read_profile(**table | {"source": path, "quantity": quantity_of(field)})
    return json.loads(json.dumps(found.assign_attrs(options).to_dict()))  # lists, no tuples


def quantity_of(key: str) -> str:
    """Return what the parameter of this name, or of this dotted key, holds."""
    field = key.rsplit(".", 1)[-1]
    return "load_profile" if field == "profile" else field


def is_profile(key: str) -> bool:
    """Whether a dotted key of a study takes a profile."""
    return quantity_of(key) in UNITS
