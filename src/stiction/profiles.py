"""Measured profiles: read from files and labelled arrays, and put on the nodes of an interface.

Units that are stated are converted, coordinates decide where a value belongs, and gaps stay gaps
until somebody asks for them to be filled. All of it is the same on a line and on a plane, where x_i
= i L/n in each direction, periodically.
"""

from __future__ import annotations

import csv
import io
import os
import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.linalg import spsolve

from stiction.arrays import Array
from stiction.errors import InputError, UnitWarning, unknown_name, warn_accuracy, warn_user
from stiction.interface import Interface
from stiction.model import describe, real_array
from stiction.units import factor_to, is_in, parse

if TYPE_CHECKING:
    import xarray as xr

Gaps = Literal["refuse", "fill", "skip"]
Map = Callable[[Array], Array]
"""From a measured quantity in SI units, such as heights, to what is wanted of it."""

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
}
"""What can be a profile, and its SI unit."""
SIGNED = ("initial_stress", "load_profile", "slip")
"""What may be negative."""
NAMES = {
    "strength": ("tau_p", "taup", "tau", "peak_strength", "shear_strength"),
    "residual_strength": ("tau_r", "taur"),
    "initial_stress": ("tau_i", "taui"),
    "normal_pressure": ("pressure", "normal_stress", "sigma_n", "sigma"),
    "weakening_rate": ("w",),
    "critical_slip": ("d_c", "dc"),
    "fracture_energy": ("gamma",),
    "load_profile": ("profile", "load"),
    "slip": ("d", "delta"),
    "friction_coefficient": ("mu", "coefficient"),
}
HEIGHTS = ("height", "heights", "topography", "z")
PLACES = ("x", "position", "pos", "distance", "coordinate")
SAMPLES = ("sample", "samples", "kept_sample")
MEASURED = "measured"
"""Coordinate of a profile with gaps: False where there was no value."""
OF_A_PLANE = (
    "; a map over x and y is read with the plane it belongs to,"
    " interface=st.Interface(length=(Lx, Ly), nodes=(nx, ny))"
)

TEXT, NETCDF = (".csv", ".txt", ".dat", ".tsv"), (".nc", ".nc4")
LARGEST = 2**30
"""Bytes; a profile is one line of numbers, and what is larger than this is something else."""
TOLERANCE = 0.02
"""Of the spacing of nodes: what rounding in a file may move a point."""
WIDE = 4.0
"""Times the median distance of points: what is wider is no interval but a gap."""
SHOWN = 3


class Points(NamedTuple):
    """Values of one quantity in SI, and where they belong.

    Attributes
    ----------
    values : (..., points) array
        Or (..., *shape) in the order of the nodes.
    places : dict of (points,) arrays
        m, along each direction; empty if the values come in the order of the nodes.
    measured : array of bool or None
        Of the shape of `values`; False where a gap was filled earlier.
    """

    values: Array
    places: dict[str, Array]
    measured: NDArray[np.bool_] | None = None


class AtNodes(NamedTuple):
    """Values at the nodes.

    Attributes
    ----------
    values : (..., *shape) array
    measured : (..., *shape) array of bool or None
        False where there was no value, be it filled in or left out; None if nothing is missing.
    """

    values: Array
    measured: NDArray[np.bool_] | None


def read_profile(
    source: Any,
    *,
    x: str | int | None = None,
    value: str | int | None = None,
    unit: str | None = None,
    x_unit: str | None = None,
    quantity: str = "strength",
    strength: Map | None = None,
    interface: Interface | None = None,
    interpolate: bool = False,
    gaps: Gaps = "refuse",
) -> xr.DataArray:
    """Read a profile along the interface from a file or a labelled array, in SI units.

    Parameters
    ----------
    source : path, xarray.DataArray or xarray.Dataset
        ``.npy``: shape (nodes,), or columns. ``.csv``, ``.txt``, ``.dat``, ``.tsv``: columns
        separated by semicolons, tabs, commas or blanks, with or without a line of names, such as
        ``x (mm); strength (MPa)``. ``.nc``: variables with `units`, and x as a coordinate. Also a
        line scan or map of the SurfaceTopography library, with `strength`.
    x, value : str or int, optional
        Name, heading or number (from 0) of the column, coordinate or variable. Without them: the
        columns that are called so (``x``, ``position``; ``strength``, ``tau_p``), the only ones
        whose unit is one of length and of `quantity`, or the two columns of a table. A table of one
        column has no x.
    unit, x_unit : str, optional
        Units of the values and of x, where the source does not state them; SI if nobody does. One
        that contradicts the source is refused.
    quantity : str
        What it is: 'strength', 'residual_strength', 'initial_stress', 'normal_pressure' (Pa),
        'weakening_rate' (Pa/m), 'critical_slip' (m), 'load_profile' or 'friction_coefficient' (1).
    strength : callable, optional
        Map from another measured quantity, such as heights in SI units, to the strength in Pa;
        nothing is taken for a strength without one. It is applied to what is called ``height`` or
        ``z``, to the only variable in a unit of length, or to the only one that is no stress.
    interface : Interface, optional
        Put the profile on its nodes x_i = i L/n, modulo L; as it is if left out. Points may come
        in any order and begin anywhere. On a plane from ``.npy`` of shape (nx, ny), ``.nc`` or
        labelled arrays over 'x' and 'y', or text with the columns x, y and value.
    interpolate : bool
        Whether points of a line may lie elsewhere than the nodes; then linearly between them.
    gaps : {"refuse", "fill", "skip"}
        Whether missing values (NaN, empty cells, missing points) are an error, are filled with
        straight lines between their ends (on a plane with the smoothest surface over their rim), or
        stay NaN, for `stiction.fit_field` to leave out. Without an interface they stay in any case.

    Returns
    -------
    xarray.DataArray
        Over 'x' (m), on a plane over 'x' and 'y', with `units`. With gaps it has a coordinate
        'measured', False there, from which `stiction.onset` and its figure know them.

    Raises
    ------
    InputError
        If the source cannot be read, is in an unknown or unsuitable unit, does not say which of
        several columns is meant, or does not fit the interface.

    Warns
    -----
    UnitWarning
        If `strength` is applied to a stress that is called neither hardness nor a pressure, or
        makes of values without a unit what is no strength of a solid.
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

    _check_options(quantity, unit, x_unit, strength, interface, interpolate, gaps, x)
    name = str(source) if isinstance(source, str | Path) else "source"
    try:
        dims = ("x",) if interface is None else interface.dims
        points = points_of(source, quantity, dims, x, value, unit, x_unit, strength)
        if points.values.ndim != (1 if points.places else len(dims)):
            raise InputError(
                f"must hold one profile, got shape {points.values.shape}"
                + OF_A_PLANE * (len(dims) == 1)
            )
        if interface is None:
            found, places = _sorted(points)
        else:
            found = place(points, interface, interpolate=interpolate, gaps=gaps)
            places = interface.coordinates
    except InputError as error:
        raise InputError([f"{name}: {text}" for text in error.problems]) from None
    coords: dict[str, Any] = {
        dim: (dim, at, {"units": "m", "long_name": f"position along {dim}"})
        for dim, at in places.items()
    }
    if found.measured is not None:
        coords[MEASURED] = (dims, found.measured, {"long_name": "measured, not filled in"})
    attributes = {"units": UNITS[quantity], "long_name": quantity.replace("_", " ")}
    return xr.DataArray(found.values, coords, dims, name=quantity, attrs=attributes)


def _check_options(
    quantity: Any, unit: Any, x_unit: Any, strength: Any, interface: Any, interpolate: Any,
    gaps: Any, x: Any,
) -> None:  # fmt: skip
    problems = []
    if quantity not in UNITS:
        problems.append(unknown_name("quantity", str(quantity), UNITS))
    if interface is not None and not isinstance(interface, Interface):
        problems.append(f"interface: must be an Interface, got {describe(interface)}")
    for what, text in {"unit": unit, "x_unit": x_unit}.items():
        if text is not None and not isinstance(text, str):
            problems.append(f"{what}: must be a text such as 'um', got {describe(text)}")
    if strength is not None and not callable(strength):
        problems.append(
            "strength: must be a function that makes strength (Pa) of an array of heights (m), such"
            f" as lambda h: 1e12 * h; got {describe(strength)}"
        )
    if gaps not in get_args(Gaps):
        problems.append(f"gaps: must be 'refuse', 'fill' or 'skip', got {gaps!r}")
    if interface is None and (interpolate or gaps == "fill"):
        problems.append("interface: needed to interpolate, or to fill gaps")
    if isinstance(interface, Interface) and interface.is_plane:
        if interpolate:
            problems.append(
                "interpolate: is an option of profiles of a line; on a plane values are taken at"
                " the nodes"
            )
        if x is not None or x_unit is not None:
            problems.append("x and x_unit: are options of profiles of a line")
    if problems:
        raise InputError(problems)


def _sorted(points: Points) -> tuple[AtNodes, dict[str, Array]]:
    """Points of a line in the order of x, which need not be that of any nodes."""
    if not points.places:
        return AtNodes(points.values, points.measured), {}
    order = np.argsort(points.places["x"], kind="stable")
    x = points.places["x"][order]
    again = np.flatnonzero(np.diff(x) == 0.0)
    if again.size:
        raise InputError(f"x repeats: {x[again[0]]:.9g} m stands beside two values{OF_A_PLANE}")
    measured = None if points.measured is None else points.measured[order]
    return AtNodes(points.values[order], measured), {"x": x}


# ---- what a source holds ------------------------------------------------------------------------


def is_labelled(value: Any) -> bool:
    """Whether it is an xarray object, told without importing xarray."""
    return hasattr(value, "dims") and hasattr(value, "coords")


def simplified(value: Any, quantity: str) -> Any:
    """Return `value` as labelled, or as plain numbers in SI.

    A pandas Series over numbers that are no count is labelled; a quantity of pint or astropy and
    a labelled number are plain.
    """
    try:
        if is_labelled(value):
            if value.dims or hasattr(value, "data_vars"):
                return value
            return _magnitude(value.data, UNITS[quantity]) * _factor(None, value, quantity)
        kind = getattr(getattr(getattr(value, "index", None), "dtype", None), "kind", "")
        if hasattr(value, "to_xarray") and kind == "f":
            return value.to_xarray()
    except TypeError as error:
        raise InputError(f"must be numbers; {error}") from None
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


def points_of(
    source: Any,
    quantity: str,
    dims: tuple[str, ...] = ("x",),
    x: str | int | None = None,
    value: str | int | None = None,
    unit: str | None = None,
    x_unit: str | None = None,
    strength: Map | None = None,
) -> Points:
    """Return what `source` says of a quantity, in SI; see `read_profile`.

    Parameters
    ----------
    dims : tuple of str
        Directions of the interface: ("x",) or ("x", "y").
    """
    import xarray as xr

    if isinstance(source, str | Path):
        data = _load(Path(source), x, value, dims)
    elif is_labelled(source):
        data = source
    elif callable(getattr(source, "heights", None)) and hasattr(source, "physical_sizes"):
        data = _topography(source, quantity, strength)
    else:
        raise InputError(f"must be a path, a DataArray or a Dataset, got {describe(source)}")
    if isinstance(data, xr.DataArray):
        if value is not None and value != data.name:
            raise InputError(
                f"value: {describe(value)} is not the one variable here, {data.name!r}"
            )
        array = data
    else:
        data = _with_places(data, quantity, dims, x, value, strength)
        names = [str(name) for name in data.data_vars]
        if not names:
            raise InputError(f"holds no profile (a variable of numbers){OF_A_PLANE}")
        array = data[_column(data, names, value, quantity, strength)]
    return _points(array, quantity, dims, x, unit, x_unit, strength)


def _with_places(
    data: Any, quantity: str, dims: tuple[str, ...], x: Any, value: Any, strength: Any
) -> Any:
    """A table with its places as coordinates; other datasets have them already."""
    if "row" not in data.dims:
        return data.set_coords(x) if isinstance(x, str) and x in data.data_vars else data
    names = list(data.data_vars)
    if len(dims) == 2:
        missing = [dim for dim in dims if dim not in _plain(names)]
        if missing:
            raise InputError(
                f"holds {_listed(data)}; a map as text has a line for each place, with columns"
                " called 'x', 'y' and the value's; save a matrix (nx, ny) with np.save as .npy"
            )
        found = {names[_plain(names).index(dim)]: dim for dim in dims}
        return data.rename(found).set_coords(dims)
    if {"x", "y"} <= set(_plain(names)) and x is None and _is_map(data):
        raise InputError(f"holds values over x and y, not along a line{OF_A_PLANE}")
    chosen = None if value is None else _column(data, names, value, quantity, strength)
    at = _place_column(data, quantity, x, chosen, strength)
    return data if at is None else data.rename({at: "x"} if at != "x" else {}).set_coords("x")


def _place_column(data: Any, quantity: str, x: Any, value: str | None, strength: Any) -> str | None:
    """The column of a table that holds x; None if it has none."""
    names = list(data.data_vars)
    if x is not None:
        return _column(data, names, x, "x", None)
    if len(names) == 1:
        return None
    called = [name for name, plain in zip(names, _plain(names), strict=True) if plain in PLACES]
    if len(called) == 1:
        return str(called[0])
    rest = [name for name in names if name != value]
    lengths = [name for name in rest if is_in(data[name].attrs.get("units"), "m")]
    if len(names) > 2 and len(lengths) == 1 and strength is None and UNITS[quantity] != "m":
        return str(lengths[0])
    # Heights beside the strength are no coordinate.
    heights = strength is not None and _is_height(names[0]) and _is_called(names[1], quantity)
    if len(names) == 2 and value != names[0] and not heights:
        return str(names[0])
    if value is None and len(names) > 2:
        raise InputError(
            f"has {len(names)} columns ({_listed(data)}); say which are meant: x=..., value=..."
            + OF_A_PLANE * all(data[name].attrs.get("unnamed") for name in names)
        )
    return None


def _is_map(data: Any) -> bool:
    places = [data[name].values for name in data.data_vars if str(name).casefold() in ("x", "y")]
    return all(1 < np.unique(place).size < place.size for place in places)


def _plain(names: Sequence[Any]) -> list[str]:
    return [str(name).casefold().replace(" ", "_") for name in names]


def _is_height(name: Any) -> bool:
    return _plain([name])[0] in HEIGHTS


def _is_called(name: Any, quantity: str) -> bool:
    """Whether the name says that it is the quantity, as 'peak strength' and 'tau' do."""
    own = _plain([name])[0]
    known = (quantity, *NAMES.get(quantity, ()))
    return own in known or (quantity == "strength" and quantity in own)


def _column(data: Any, names: Sequence[str], wanted: Any, quantity: str, strength: Any) -> str:
    """The variable that was asked for by name, heading or number, or the one that is plainly it."""
    if wanted is None:
        return _meant(data, names, quantity, strength)
    for name in names:
        known = (name, data[name].attrs.get("heading"), data[name].attrs.get("number"))
        if not isinstance(wanted, bool) and wanted in known:
            return name
    what = "x" if quantity == "x" else "value"
    if isinstance(wanted, str) and names and not data[names[0]].attrs.get("unnamed"):
        raise InputError(unknown_name(what, wanted, names))
    raise InputError(
        f"{what}: must be a column, 0 to {len(data) - 1}, or its name; got {describe(wanted)}"
    )


def _meant(data: Any, names: Sequence[str], quantity: str, strength: Map | None) -> str:
    """Which variable is the quantity, or what a map is applied to, if that is beyond doubt."""
    unit = {name: _unit_of(data[name]) for name in names}
    if strength is not None:
        if len(names) == 1:
            return names[0]  # whether it can be mapped is seen where its unit is
        left = [
            name for name in names if not (_is_called(name, quantity) or is_in(unit[name], "Pa"))
        ]
        heights = [name for name in left if _is_height(name)]
        for found in (heights, [name for name in left if is_in(unit[name], "m")], left):
            if len(found) == 1:
                return found[0]
        raise InputError(
            f"does not say which variable strength= is applied to: got {_listed(data, names)}. Call"
            " it 'height', or name it with value=..."
        )
    if len(names) == 1 and data[names[0]].attrs.get("unnamed"):
        return names[0]
    alone = ("value", "values") if len(names) == 1 else ()
    for name in (quantity, *NAMES.get(quantity, ()), *alone):
        if name in _plain(names):
            return names[_plain(names).index(name)]
    # Any number is dimensionless: for such a quantity a unit says nothing.
    fitting = [
        name for name in names if UNITS[quantity] != "1" and is_in(unit[name], UNITS[quantity])
    ]
    if len(fitting) == 1:
        return fitting[0]
    raise InputError(
        f"holds no variable that is plainly the {quantity} ({UNITS[quantity]}): got"
        f" {_listed(data, names)}. Call it {quantity!r}, state its unit, or say which it is with"
        " value=... and unit=..."
    )


def _listed(data: Any, names: Sequence[str] | None = None) -> str:
    shown = []
    for name in data.data_vars if names is None else names:
        unit = _unit_of(data[name])
        if not data[name].attrs.get("unnamed"):
            shown.append(f"{str(name)!r} in {unit}" if unit else f"{str(name)!r}")
    return ", ".join(shown) or f"{len(data.data_vars)} columns without names, as of a matrix"


def _unit_of(array: Any) -> str | None:
    for key in ("units", "unit"):
        if str(array.attrs.get(key, "")).strip():
            return str(array.attrs[key]).strip()
    return None


def _points(
    array: Any, quantity: str, dims: tuple[str, ...], x: Any, unit: Any, x_unit: Any, strength: Any
) -> Points:
    """Values of a DataArray and their places; names decide what runs along what."""
    source = array
    array = _along(array, dims, x)
    along = [dim for dim in (*dims, "row") if dim in array.dims]
    samples = [dim for dim in array.dims if dim not in along]
    if len(samples) > 1 or len(along) > len(dims):
        sizes = ", ".join(f"{name}: {size}" for name, size in source.sizes.items())
        raise InputError(f"must have one dimension beside x, got ({sizes}); select one point")
    array = array.transpose(*samples, *along)
    try:
        values = real_array(_magnitude(array.data, UNITS[quantity] if strength is None else "m"))
    except TypeError as error:
        raise InputError(f"must be numbers; {error}") from None
    values = _converted(values, unit, array, quantity, strength)
    if not along:  # one value a sample
        return Points(values[:, np.newaxis], {})
    measured = None
    if MEASURED in array.coords:
        mask = array.coords[MEASURED].broadcast_like(array).transpose(*array.dims)
        measured = mask.values.astype(bool)
    known = [dim for dim in dims if dim in array.coords]
    places = {
        dim: real_array(_magnitude(array[dim].data, "m"))
        * _factor(x_unit if dim == "x" else None, array[dim], "x", "m")
        for dim in known
    }
    if not known:
        return Points(values, {}, measured)
    if len(along) == 2:  # a grid: each of its points on its own
        for dim in dims:
            places.setdefault(dim, np.arange(array.sizes[dim], dtype=float))
        grid = np.meshgrid(*(places[dim] for dim in dims), indexing="ij")
        places = {dim: at.ravel() for dim, at in zip(dims, grid, strict=True)}
        values = values.reshape(*values.shape[:-2], -1)
        measured = None if measured is None else measured.reshape(values.shape)
    return Points(values, places, measured)


def _along(array: Any, dims: tuple[str, ...], x: Any) -> Any:
    """The array with its dimensions along the interface called 'x' and 'y'."""
    names = [str(dim) for dim in array.dims]
    if len(dims) == 2 or "row" in names:
        rest = [name for name in names if name not in (*dims, "row", *SAMPLES)]
        if rest or len([name for name in names if name in dims]) == 1:
            if len(rest) == 1 and len(names) == 1:
                return array.rename({rest[0]: "sample"})
            raise InputError(
                f"which dimensions run along the plane is not clear from ({', '.join(names)});"
                " call them 'x', the direction of load and slip, and 'y', and a third one 'sample'"
            )
        return array
    if x is not None and x not in array.coords:
        raise InputError(unknown_name("x", str(x), [str(name) for name in array.coords]))
    called = [name for name, at in array.coords.items() if at.ndim == 1
              and (name == x if x is not None else str(name).casefold() in PLACES)]  # fmt: skip
    named = [name for name in names if x is None and name.casefold() in PLACES]
    rest = [name for name in names if name.casefold() not in SAMPLES]
    if named or called:
        dim = named[0] if named else str(array.coords[called[0]].dims[0])
    elif len(rest) == 1:
        dim = rest[0]
    elif not rest and len(names) == 1:
        return array
    elif names and all(name.startswith("dim_") for name in names):  # never named: order counts
        dim = names[-1]
    else:
        raise InputError(
            f"which dimension runs along the interface is not clear from ({', '.join(names)});"
            " call it 'x', and the other 'sample'"
        )
    others = [name for name in names if name != dim]
    if len(others) > 1:
        sizes = ", ".join(f"{name}: {size}" for name, size in array.sizes.items())
        raise InputError(f"must have one dimension beside x, got ({sizes}); select one point")
    at = x if x is not None else dim if dim in array.coords else (called or [None])[0]
    place = None if at is None else array.coords[at]
    array = array.drop_vars([name for name in array.coords if name != MEASURED])
    array = array.rename({dim: "x"} | ({others[0]: "sample"} if others else {}))
    if place is None:
        return array
    return array.assign_coords(x=("x", place.data, place.attrs))


# ---- units and maps -----------------------------------------------------------------------------


def _factor(given: str | None, array: Any, what: str, si: str | None = None) -> float:
    """To SI, from what the caller says and what the source states."""
    stated, si = _unit_of(array), si or UNITS[what]
    try:
        if given is None:
            return 1.0 if stated is None else factor_to(si, stated)
        factor = factor_to(si, given)
        known = stated is not None and parse(stated) is not None
        if known and not np.isclose(factor_to(si, str(stated)), factor, rtol=1e-12):
            raise InputError(f"is said to be in {given}, the source states {stated}")
    except InputError as error:
        raise InputError([f"{what} {text}" for text in error.problems]) from None
    return factor


def _converted(
    values: Array, given: str | None, array: Any, quantity: str, strength: Map | None
) -> Array:
    """Values in SI; with a map `strength` what it makes of them."""
    if strength is None:
        return values * _factor(given, array, quantity)
    name, unit = array.name, given or _unit_of(array)
    called = "the quantity to map" if name is None or array.attrs.get("unnamed") else repr(name)
    if _is_called(name, quantity):
        raise InputError(
            f"{called} is the {quantity} already, and strength= makes one of something else, such"
            " as heights; leave strength= out, or say what it is applied to with value=..."
        )
    if is_in(unit, "Pa") and not _is_height(name):
        if _plain([name])[0] not in ("hardness", "normal_pressure", *NAMES["normal_pressure"]):
            warn_user(
                f"{called} is in {unit}, a stress, and strength= is applied to it as to heights; if"
                " it is the strength, leave strength= out",
                UnitWarning,
            )
        values = values * _factor(given, array, called, "Pa")
    else:
        known = None if unit is None or _is_height(name) else parse(unit)
        values = values * (_factor(given, array, called, "m") if known is None else known.factor)
    found = _mapped(strength, values, quantity)
    if unit is None and quantity == "strength" and not np.isnan(found).all():
        mean = float(np.nanmean(found))
        if not 1e2 <= mean <= 1e10:
            warn_user(
                f"strength: makes {mean:.4g} Pa in the mean of values that state no unit, taken as"
                " m; check their unit, and give it with unit=...",
                UnitWarning,
            )
    return found


def _mapped(strength: Map, values: Array, quantity: str) -> Array:
    """What a user makes of measured values, such as heights: one value for each; gaps stay gaps."""
    try:
        found = real_array(np.ma.filled(strength(values.copy()), np.nan))
    except Exception as error:  # whatever a user's function raises
        raise InputError(
            f"strength: failed with {type(error).__name__}: {error}; it is called with one array of"
            f" shape {values.shape} and returns one of real numbers"
        ) from error
    if found.shape != values.shape:
        raise InputError(
            f"strength: must return one value a point, shape {values.shape}, got shape"
            f" {found.shape}"
        )
    found = np.where(np.isnan(values), np.nan, found)
    wrong = ~np.isnan(values) & ~np.isfinite(found)
    valid = "finite"
    if quantity not in SIGNED:
        wrong |= found < 0.0
        valid = "finite and not negative"
    if wrong.any():
        first = np.flatnonzero(wrong)[0]
        raise InputError(
            f"strength: must return {quantity} that is {valid}, got {found.flat[first]:g} for"
            f" {values.flat[first]:g} (SI units), and such at {int(wrong.sum())} of"
            f" {values.size} points"
        )
    return found


# ---- files --------------------------------------------------------------------------------------


def _load(path: Path, x: Any, value: Any, dims: tuple[str, ...]) -> xr.Dataset:
    """The variables of a file; those of a table are along 'row'."""
    import xarray as xr

    ending = path.suffix.lower()
    if ending in TEXT:
        return _dataset(read_table(path))
    if ending in NETCDF:
        _content(path, read=False)
        try:
            # Times are not decoded: a variable in seconds is refused by its unit, like any other.
            with xr.open_dataset(path, decode_times=False, decode_timedelta=False) as opened:
                kept = [
                    name for name, one in opened.data_vars.items()
                    if one.dtype.kind in "fiu" and one.nbytes <= LARGEST
                    and sum(size != 1 for size in one.shape) == len(dims)
                ]  # fmt: skip
                return opened[kept].squeeze(drop=True).load()
        except (OSError, ValueError, RuntimeError, KeyError, AttributeError, TypeError) as error:
            raise InputError(f"is no NetCDF file of numbers: {error}") from None
    if ending != ".npy":
        raise InputError(
            f"a profile must end in {', '.join(('.npy', *TEXT, *NETCDF))}, got {path.name!r}; files"
            " of instruments: give what SurfaceTopography.read_topography(path) returns"
        )
    array = _npy(path)
    if len(dims) == 2:
        if value is not None:
            raise InputError(
                "value: a .npy file of a plane holds one array, without names; got"
                f" {describe(value)}"
            )
        if array.ndim != 2:
            raise InputError(f"must have shape (nx, ny), got shape {array.shape}")
        return xr.Dataset({"0": (dims, array, {"unnamed": True})})
    if array.ndim == 1 and array.size:
        return _dataset(Table([None], [None], [None], array[np.newaxis]))
    if array.ndim == 2 and array.size and value is not None:
        blank: list[None] = [None] * array.shape[1]
        return _dataset(Table(blank, blank, blank, array.T))
    hint = f"; of an array of columns say which: x=0, value=1{OF_A_PLANE}" * (array.ndim == 2)
    raise InputError(f"must hold one profile, shape (nodes,), got shape {array.shape}{hint}")


def _dataset(table: Table) -> xr.Dataset:
    """The columns as variables along 'row'."""
    import xarray as xr

    variables: dict[str, Any] = {}
    for number, (name, unit, heading, column) in enumerate(zip(*table, strict=True)):
        attributes: dict[str, Any] = {"units": unit} if unit else {}
        attributes["number"] = number
        attributes |= {"unnamed": True} if name is None else {"heading": heading}
        key = str(number) if name is None else name
        if key in variables:
            key = str(heading) if heading not in variables else f"{key} {number}"
        variables[key] = ("row", column, attributes)
    return xr.Dataset(variables)


def _content(path: Path, *, read: bool = True) -> bytes:
    """All of a regular file of reasonable size."""
    try:
        size = os.stat(path).st_size
        if not path.is_file():
            raise InputError("is not a regular file")
        if size > LARGEST:
            raise InputError(f"has {size} bytes, more than the {LARGEST} of a profile")
        return path.read_bytes() if read else b""
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror or error}") from None


def _npy(path: Path) -> Array:
    try:
        array = np.load(io.BytesIO(_content(path)), allow_pickle=False)
    except InputError:
        raise
    except Exception as error:  # numpy lets through whatever Python's own parser raises
        text = str(error).splitlines()[0] if str(error) else "its header cannot be read"
        raise InputError(f"is not a .npy file of numbers: {text}") from None
    if not isinstance(array, np.ndarray) or array.dtype.kind not in "fiu":
        raise InputError(f"must hold numbers, got {getattr(array, 'dtype', 'an archive')}")
    return np.squeeze(array.astype(np.float64))


def _topography(source: Any, quantity: str, strength: Map | None) -> xr.DataArray:
    """Heights (m) of a line scan or map of the SurfaceTopography library; NaN where undefined."""
    import xarray as xr

    if strength is None:
        raise InputError(
            f"holds heights, which are no {quantity.replace('_', ' ')}; state what they mean with"
            " strength=lambda h: ..., h in m"
        )
    unit = getattr(source, "unit", None)
    if not unit:
        raise InputError("states no unit of its lengths; set it (topography.scale_height, unit=)")
    heights = np.ma.filled(np.ma.asarray(source.heights(), dtype=np.float64), np.nan)
    dims = ("x", "y")[: heights.ndim]
    uniform = bool(getattr(source, "is_uniform", True))
    coords = {
        dim: (dim, size / n * np.arange(n) if uniform else source.positions(), {"units": str(unit)})
        for dim, size, n in zip(dims, source.physical_sizes, heights.shape, strict=True)
    }
    return xr.DataArray(heights, coords, dims, name="height", attrs={"units": str(unit)})


_EMPTY = ("", "nan", "na", "n/a", "null", "none", "-", "--")
_WORDS = re.compile(r"[^\s(\[{]+(?:\s*[(\[{][^)\]}]*[)\]}])?|[(\[{][^)\]}]*[)\]}]")
_BRACKETS = re.compile(r"^(?P<name>.*?)\s*[(\[{]\s*(?P<unit>[^()\[\]{}]*?)\s*[)\]}]\s*$")


class Table(NamedTuple):
    """Columns of numbers.

    Attributes
    ----------
    names, units, headings : sequences of str or None
        One entry for each column; None where the file says nothing.
    columns : (columns, lines) array
        NaN where a cell is empty.
    """

    names: Sequence[str | None]
    units: Sequence[str | None]
    headings: Sequence[str | None]
    columns: Array


def read_table(path: Path) -> Table:
    """Read a table of numbers from a text file.

    Columns are separated by semicolons, tabs, commas or blanks, in this order of preference; the
    decimal sign may be a comma unless commas separate. Lines that begin with ``#`` are comments;
    the last one before the numbers names the columns if no other line does. Names may have a line
    of units below them, and lines of another number of cells above them.

    Raises
    ------
    InputError
        Naming the line that does not fit.
    """
    lines, comment = [], ""
    for number, line in enumerate(_decoded(path).splitlines(), 1):
        if line.lstrip().startswith("#"):
            comment = comment if lines else line.strip().lstrip("#").strip()
        elif line.strip():
            lines.append((number, line))
    separator = _separator([line for _, line in lines])
    rows = [(number, _split(line, separator)) for number, line in lines]
    header = []
    while rows and not any(_number(cell, separator) is not None for cell in rows[0][1]):
        header.append(rows.pop(0))
    if not rows:
        raise InputError("holds no numbers")
    if len(rows) == 1 and len(rows[0][1]) > 3:  # one line of values
        rows = [(rows[0][0], [cell]) for cell in rows[0][1]]
    width = len(rows[0][1])
    whole = re.compile(r"[+-]?\d+$")
    if separator == "," and not header and width == 2 and all(
        whole.match(cell) for _, cells in rows for cell in cells
    ):  # fmt: skip
        raise InputError(
            f"line {rows[0][0]}: {','.join(rows[0][1])!r} may be one number or two; separate"
            " columns with ';', or write decimal points"
        )
    columns = np.full((width, len(rows)), np.nan)
    for place, (number, cells) in enumerate(rows):
        if len(cells) != width:
            raise InputError(
                f"line {number} has {len(cells)} columns, line {rows[0][0]} has {width}"
            )
        for column, cell in enumerate(cells):
            value = _number(cell, separator)
            if value is None and cell.lower() not in _EMPTY:
                raise InputError(f"line {number}: {describe(cell)} is no number")
            columns[column, place] = np.nan if value is None else value
    if not header and comment:
        cells = _split(comment, separator)
        header = [(0, cells)] if len(cells) == width else [(0, [comment])] if width == 1 else []
    return Table(*_headings(header, width), columns)


def _decoded(path: Path) -> str:
    """The text of a file: UTF-8 or UTF-16 with a mark, or else Windows' western code page."""
    data = _content(path)
    wide = data.startswith((b"\xff\xfe", b"\xfe\xff"))
    for encoding in ("utf-16",) if wide else ("utf-8-sig", "cp1252"):
        try:
            text = data.decode(encoding)
        except UnicodeDecodeError:
            continue
        if "\0" not in text:
            return text
    raise InputError("is not a text file")


def _separator(lines: list[str]) -> str:
    for mark in (";", "\t"):
        if any(mark in line for line in lines):
            return mark
    if not any("," in line for line in lines):
        return " "
    # Blanks separate numbers with decimal commas: '0,1 1000,5'; but '0.1, 1000.5' has commas.
    last = lines[-1]
    return " " if re.search(r"\d\s+[+-]?\d", last) and not re.search(r",\s", last) else ","


def _split(line: str, separator: str) -> list[str]:
    if separator != " ":
        return [cell.strip() for cell in next(csv.reader([line], delimiter=separator))]
    cells = line.split()
    if all(_number(cell, " ") is not None or cell.lower() in _EMPTY for cell in cells):
        return cells
    return [cell.strip() for cell in _WORDS.findall(line)]


def _number(cell: str, separator: str) -> float | None:
    if separator != "," and cell.count(",") == 1 and "." not in cell:
        cell = cell.replace(",", ".")
    try:
        return None if "_" in cell else float(cell)  # Python reads 1_000, people do not
    except ValueError:
        return None


def _headings(
    header: list[tuple[int, list[str]]], width: int
) -> tuple[list[str | None], list[str | None], list[str | None]]:
    rows = [(number, cells) for number, cells in header if len(cells) == width]
    if header and not rows:
        number, cells = header[-1]
        raise InputError(
            f"line {number} names {len(cells)} columns, the numbers below it have {width}; begin"
            " lines that are no names with '#'"
        )
    if not rows:
        return [None] * width, [None] * width, [None] * width
    pairs = [name_and_unit(cell) for cell in rows[0][1]]
    names: list[str | None] = [name for name, _ in pairs]
    units = [unit for _, unit in pairs]
    for number, cells in rows[1:]:
        for column, cell in enumerate(cells):
            inner = _BRACKETS.match(cell)
            stated = inner["unit"] if inner and not inner["name"] else cell
            if not stated:
                continue
            if units[column] is not None or number != rows[1][0]:
                raise InputError(f"line {number}: {describe(cell)} is neither a number nor a unit")
            units[column] = stated
    return names, units, list(rows[0][1])


def name_and_unit(text: str) -> tuple[str, str | None]:
    """Take a heading apart: 'strength (MPa)', 'tau / MPa', 'x_mm', 'x in mm', 'tau MPa'."""
    match = _BRACKETS.match(text)
    if match:
        return match["name"].strip(), match["unit"] or None
    if " / " in text:
        name, unit = text.split(" / ", 1)
        return name.strip(), unit.strip()
    parts = re.split(r"[\s,_:]+(?:in\s+)?", text.strip())
    if len(parts) > 1 and len(parts[-1]) > 1 and parse(parts[-1]) is not None:
        return text[: text.rindex(parts[-1])].rstrip(" ,_:").removesuffix(" in"), parts[-1]
    if parse(text) is not None and len(text) > 1:
        return "", text
    return text.strip(), None


# ---- on the nodes -------------------------------------------------------------------------------


def place(
    points: Points, interface: Interface, *, interpolate: bool = False, gaps: Gaps = "refuse"
) -> AtNodes:
    """Put values on the nodes of an interface.

    Parameters
    ----------
    points : Points
        NaN where there is no value.
    interface : Interface
    interpolate : bool
        Whether points of a line may lie elsewhere than the nodes; then linearly and periodically.
    gaps : {"refuse", "fill", "skip"}

    Raises
    ------
    InputError
        If points repeat, reach beyond a period or lie elsewhere than the nodes, or values are
        missing and may not be filled in.
    """
    values, measured = points.values, points.measured
    if not points.places:
        shape = values.shape[-len(interface.shape) :]
        if shape != interface.shape:
            raise InputError(_other_shape(shape, interface))
        return _close(values, measured, interface, gaps)
    if values.size == 0:
        raise InputError("has no values")
    problems: list[str] = []
    put = _put(points.places, values, interface, interpolate, problems)
    if problems and np.isnan(values).any() and gaps == "refuse":
        problems.append(
            f"{int(np.isnan(values).sum())} of {values.size} points have no value (NaN); fill such"
            " gaps with gaps='fill'"
        )
    if problems:
        raise InputError(problems)
    if measured is not None:
        measured = put(measured * 1.0) > 0.999
    return _close(put(values), measured, interface, gaps)


def _other_shape(shape: tuple[int, ...], interface: Interface) -> str:
    if interface.is_plane:
        turned = shape == interface.shape[::-1] != interface.shape
        hint = "; x and y have changed places: the first axis of a profile is x" * turned
        return f"must have shape {interface.shape}, got shape {shape}{hint}"
    return (
        f"has {shape[-1] if shape else 1} values, the interface has {interface.size} nodes"
        " (interface.size); give a value for each node, or x beside the values (x=... names its"
        " column), with interpolate=True where points lie elsewhere than the nodes"
    )


def _put(
    places: dict[str, Array], values: Array, interface: Interface, interpolate: bool,
    problems: list[str],
) -> Callable[[Array], Array]:  # fmt: skip
    """A function that puts values (..., points) on the nodes, NaN where there are none."""
    kept: Any = slice(None)
    at = []
    for axis, dim in enumerate(interface.dims):
        n, spacing, length = (
            interface.shape[axis],
            interface.spacings[axis],
            interface.lengths[axis],
        )
        x, which = np.unique(places[dim], return_inverse=True)
        if not np.all(np.isfinite(x)):
            entry = int(np.argmin(np.isfinite(places[dim])))
            raise InputError(f"{dim} must be finite; entry {entry} is not")
        if x[-1] - x[0] > length + TOLERANCE * spacing:
            raise InputError(_too_long(dim, x, length))
        if abs(x[-1] - x[0] - length) <= TOLERANCE * spacing:
            kept = _without_closing_points(dim, which, x, values, interface)
        again = np.flatnonzero(np.diff(x) <= 1e-6 * spacing)
        if again.size or (len(places) == 1 and x.size < which.size):
            first = int(again[0]) if again.size else int(np.argmax(np.bincount(which) > 1))
            last = min(first + 1, x.size - 1) if again.size else first
            raise InputError(f"{dim} repeats: {x[first]:.9g} and {x[last]:.9g} m are one place")
        offset = _offset(x, n, spacing, length, coarse=interface.is_plane)
        if offset is None and not interpolate:
            problems.append(_elsewhere(dim, x, n, spacing))
            continue
        if offset is None:
            return lambda rows: _interpolated(places[dim][kept], rows[..., kept], interface)
        if abs(offset) > TOLERANCE:
            warn_accuracy(
                f"{dim} lies {offset:.2g} of a spacing beside the nodes {dim}_i = i L/n, as at the"
                f" centres of cells: node i stands for {dim}_i {offset * spacing:+.4g} m, to be"
                " added to positions in the result"
            )
        at.append(np.round(x / spacing - offset).astype(np.int64)[which] % n)
    if problems:
        return lambda rows: rows
    flat = np.ravel_multi_index([index[kept] for index in at], interface.shape)
    if np.unique(flat).size < flat.size:
        raise InputError(f"{' and '.join(interface.dims)} repeat: two points lie at one node")

    def put(rows: Array) -> Array:
        full = np.full((*rows.shape[:-1], interface.size), np.nan)
        full[..., flat] = rows[..., kept]
        return full.reshape(*rows.shape[:-1], *interface.shape)

    return put


def _too_long(dim: str, x: Array, length: float) -> str:
    hint = (
        f"crop the record, as profile.sel({dim}=slice(0, ...)) does, or make interface.length"
        f" {float(x[-1] - x[0]):.6g} m"
    )
    for unit, factor in (("mm", 1e-3), ("um", 1e-6)):
        if 0.3 * length < factor * (x[-1] - x[0]) <= 1.001 * length:
            hint = f"if x is in {unit}, say so: units of x in the file, or x_unit={unit!r}"
    return (
        f"{dim} reaches from {x[0]:g} to {x[-1]:g} m, the interface is {length:g} m long"
        f" (interface.extent); {hint}"
    )


def _without_closing_points(
    dim: str, which: NDArray[np.int64], x: Array, values: Array, interface: Interface
) -> NDArray[np.bool_]:
    """All points but the last, which are the first ones again, a period later."""
    first, last = which == 0, which == x.size - 1
    if not np.array_equal(values[..., first], values[..., last], equal_nan=True):
        raise InputError(
            f"{dim} = {x[0]:g} and {x[-1]:g} m are one place of an interface with the period"
            f" {interface.length} m (interface.extent), with two values; leave out one end, as"
            " np.linspace(0, L, n, endpoint=False) does"
        )
    return ~last


def _offset(x: Array, n: int, spacing: float, length: float, *, coarse: bool) -> float | None:
    """By how many spacings, in (-0.5, 0.5], all points lie beside nodes; None if by no one number.

    On a line, a grid that is coarser than the nodes does not count, even if its points are nodes.
    """
    if abs(x[-1] - x[0] - length) <= TOLERANCE * spacing:
        x = x[:-1]
    at = x / spacing
    if at.size < 2 or (not coarse and np.median(np.diff(at)) > 1.5):
        return 0.0 if coarse and abs(at[0] - round(at[0])) <= TOLERANCE else None
    first = at[0] - np.ceil(at[0] - 0.5 - TOLERANCE)
    deviation = at - first - np.round(at - first)
    return float(first + deviation.mean()) if np.abs(deviation).max() <= TOLERANCE else None


def _elsewhere(dim: str, x: Array, n: int, spacing: float) -> str:
    step = float(np.median(np.diff(x))) if x.size > 1 else 0.0
    fit = f", or interface.length = {x.size * step:.6g}" if x.size == n else ""
    hint = ""
    for unit, factor in (("mm", 1e-3), ("um", 1e-6), ("km", 1e3)):
        if abs(factor * step / spacing - 1.0) < 1e-3:
            hint = f"; if x is in {unit}, say so: units of x in the file, or x_unit={unit!r}"
    return (
        f"{dim} lies elsewhere than the {n} nodes {dim}_i = i L/n: {x.size} points from"
        f" {x[0]:.6g} to {x[-1]:.6g} m, {step:.6g} m apart, the nodes {spacing:.6g} m"
        f" (interface.extent / interface.size); give values at the nodes{fit}, or ask for linear"
        f" interpolation with interpolate=True{hint}"
    )


def _interpolated(x: Array, values: Array, interface: Interface) -> Array:
    """Linear between points, and NaN in intervals that are gaps."""
    length, nodes = interface.extent, interface.x
    order = np.argsort(x, kind="stable")
    x, rows = x[order], values.reshape(-1, x.size)[:, order]
    found = np.empty((rows.shape[0], nodes.size))
    typical = float(np.median(np.diff(x))) if x.size > 1 else length
    widest = 0.0
    for row, target in zip(rows, found, strict=True):
        known = np.flatnonzero(~np.isnan(row))
        if known.size == 0:
            raise InputError("has no value at all")
        begin = x[known]
        target[:] = np.interp(nodes, begin, row[known], period=length)
        end = np.append(begin[1:], begin[0] + length)
        left_out = np.append(np.diff(known) > 1, known[-1] - known[0] < x.size - 1)
        wide = (end - begin > WIDE * max(typical, interface.spacing)) | left_out
        widest = max(widest, float(np.max((end - begin)[~wide], initial=0.0)))
        margin = TOLERANCE * interface.spacing
        for a, b in zip(begin[wide], end[wide], strict=True):
            into = np.mod(nodes - a, length)
            target[(into > margin) & (into < b - a - margin)] = np.nan
    warn_accuracy(
        f"{x.size} points are interpolated linearly to {nodes.size} nodes; the widest distance"
        f" between them is {widest:.3g} m, {widest / interface.spacing:.3g} times the spacing of"
        " nodes"
    )
    return found.reshape(*values.shape[:-1], nodes.size)


# ---- gaps ---------------------------------------------------------------------------------------


def _close(
    values: Array, measured: NDArray[np.bool_] | None, interface: Interface, gaps: Gaps
) -> AtNodes:
    """Values (..., *shape) with NaN where nothing was measured, refused, left or filled."""
    missing = np.isnan(values)
    if not missing.any():
        return AtNodes(values, measured)
    text = describe_gaps(missing, interface)
    how = "smoothly from around them" if interface.is_plane else "with straight lines"
    if gaps == "refuse":
        raise InputError(
            f"must be finite: there {text}; give what was measured, or fill gaps {how}, which the"
            f" result then remembers: gaps='fill'{_much_missing(missing, interface)}"
        )
    whole = ~missing if measured is None else ~missing & measured
    if gaps == "skip":
        return AtNodes(values, whole)
    filled = values.reshape(-1, *interface.shape).copy()
    for one, hole in zip(filled, missing.reshape(filled.shape), strict=True):
        if hole.all():
            raise InputError("has no value at all")
        if hole.any():
            _fill(one, hole, interface.spacings)
    warn_accuracy(f"there {text}; filled {how}")
    return AtNodes(filled.reshape(values.shape), whole)


def _much_missing(missing: NDArray[np.bool_], interface: Interface) -> str:
    """What to do where a record is much shorter than the interface."""
    if interface.is_plane or missing.ndim > 1:
        return ""
    gap = max((b - a) % interface.extent for a, b in gaps_of(missing, interface))
    if gap < 0.25 * interface.extent:
        return ""
    length = interface.extent - gap - interface.spacing
    return (
        f". The record covers {length:.4g} m of the interface; if it holds no more, make"
        f" interface.length {length:.6g}"
    )


def _fill(values: Array, hole: NDArray[np.bool_], spacings: tuple[float, ...]) -> None:
    """Solve Laplace's equation of the nodes in the hole, periodically.

    The measured nodes around it are its rim: on a line that is the straight line between the ends,
    and nothing in it is higher or lower than its rim.
    """
    number = np.full(hole.shape, -1)
    number[hole] = np.arange(hole.sum())
    places = np.nonzero(hole)
    own = number[places]
    rows, columns, entries = [own], [own], [np.zeros(own.size)]
    right = np.zeros(own.size)
    for axis, spacing in enumerate(spacings):
        weight = (min(spacings) / spacing) ** 2
        for step in (-1, 1):
            beside = list(places)
            beside[axis] = (places[axis] + step) % hole.shape[axis]
            there = number[tuple(beside)]
            known = there < 0
            entries[0] += weight
            right[known] += weight * values[tuple(beside)][known]
            rows.append(own[~known])
            columns.append(there[~known])
            entries.append(np.full(int((~known).sum()), -weight))
    index = (np.concatenate(rows), np.concatenate(columns))
    matrix = csr_array((np.concatenate(entries), index), shape=(own.size, own.size))
    values[hole] = spsolve(matrix.tocsc(), right)


def gaps_of(missing: NDArray[np.bool_], interface: Interface) -> list[tuple[float, float]]:
    """Return where nodes of a line lack a value: first and last, m; first > last across x = 0."""
    if missing.all():
        return [(0.0, float(interface.x[-1]))]
    starts = np.flatnonzero(missing & ~np.roll(missing, 1))
    ends = np.flatnonzero(missing & ~np.roll(missing, -1))
    if ends.size and ends[0] < starts[0]:  # one begins before x = 0 and ends behind it
        ends = np.roll(ends, -1)
    x = interface.x
    return [(float(x[a]), float(x[b])) for a, b in zip(starts, ends, strict=True)]


def describe_gaps(missing: NDArray[np.bool_], interface: Interface) -> str:
    """Say 'are no values (NaN) at x = 0.0112 to 0.0141 m (29 of 1024 nodes)'."""
    maps = missing.reshape(-1, *interface.shape)
    with_gaps = maps.reshape(len(maps), -1).any(axis=1)
    row = int(np.argmax(with_gaps))
    count = f"{int(maps[row].sum())} of {interface.size} nodes"
    which = f" in sample {row}" if len(maps) > 1 else ""
    others = int(with_gaps.sum()) - 1
    which += f", and in {others} more samples" if others else ""
    if interface.is_plane:
        first = interface.describe_node(int(np.argmax(maps[row])))
        return f"are no values (NaN) at {count}, the first at {first}{which}"
    spans = gaps_of(maps[row], interface)
    at = ", ".join(f"{a:.6g} m" if a == b else f"{a:.6g} to {b:.6g} m" for a, b in spans[:SHOWN])
    more = f" and {len(spans) - SHOWN} more gaps" if len(spans) > SHOWN else ""
    return f"are no values (NaN) at x = {at}{more} ({count}{which})"


# ---- profiles of samples and of problems --------------------------------------------------------


def at_nodes(
    name: str, value: Any, quantity: str, interface: Interface, gaps: Gaps = "refuse"
) -> AtNodes:
    """Return what a caller gave for a quantity, with one value a node; errors name the argument.

    Numbers and plain arrays without gaps pass as they are, for whoever checks their shape.
    """
    shape = interface.shape
    try:
        value = simplified(value, quantity)
        if is_labelled(value):
            points = points_of(value, quantity, interface.dims)
            if not points.places and points.values.shape[-len(shape) :] != shape:
                one_each = points.values.ndim == 2 and points.values.shape[1] == 1
                if one_each and quantity == "strength":
                    raise InputError("has no dimension along the interface; call it 'x'")
                if one_each or interface.is_plane:
                    return AtNodes(points.values, None)
            return place(points, interface, gaps=gaps)
        if gaps != "refuse":
            array = real_array(value)
            if array.shape[-len(shape) :] == shape:
                return _close(array, None, interface, gaps)
    except TypeError:
        pass  # no numbers: refused with everything else that is wrong
    except InputError as error:
        raise InputError([f"{name}: {text}" for text in error.problems]) from None
    return AtNodes(value, None)


def on_nodes(name: str, given: Any, interface: Interface) -> Any:
    """Return a profile with coordinates or units of its own as a number or an array at the nodes.

    Parameters
    ----------
    given : DataArray, quantity with a unit, or dict
        A dict holds `values`, `x`, and options of `place`, as a study file may.

    Raises
    ------
    InputError
        Naming `name`.
    """
    quantity = quantity_of(name)
    try:
        if isinstance(given, Mapping):
            options = _checked_options(given, ("values", "x"))
            if "values" not in given:
                raise InputError("a profile as a table needs either file or values")
            x = {} if given.get("x") is None else {"x": _row(given["x"])}
            points = Points(_row(given["values"]), x)
            if x and x["x"].shape != points.values.shape:
                raise InputError("values and x must have the same length")
            return place(points, interface, **options).values
    except InputError as error:
        raise InputError([f"{name}: {text}" for text in error.problems]) from None
    return np.asarray(at_nodes(name, given, quantity, interface).values)


def profile_in_file(given: Any, field: str, folder: str | Path) -> Any:
    """Return the profile that a study file names: an array in the order of nodes, or a table.

    Parameters
    ----------
    given : path or dict
        A dict has `file` and options of `read_profile`, or `values` and `x`.
    field : str
        Name of the parameter.
    folder : path
        What paths are relative to.
    """
    table: dict[str, Any] = dict(given) if isinstance(given, Mapping) else {"file": given}
    if ("file" in table) == ("values" in table):
        raise InputError("a profile as a table needs either file or values")
    if "file" not in table:
        return table
    if not isinstance(table["file"], str | Path):
        raise InputError("file: must be a path")
    read = ("x", "value", "unit", "x_unit")
    options = _checked_options(table, ("file", *read))
    path = Path(folder) / table["file"]
    try:
        if path.suffix.lower() == ".npy" and len(table) == 1:
            array = _npy(path)
            if array.ndim == 2 and min(array.shape) >= 8:  # a plane, and no columns
                return array
        columns = {name: table[name] for name in read if name in table}
        points = points_of(path, quantity_of(field), **columns)
    except InputError as error:
        raise InputError([f"{table['file']}: {text}" for text in error.problems]) from None
    if points.values.ndim != 1:
        raise InputError(f"must have shape (nodes,), got shape {points.values.shape}")
    if not points.places and not np.isnan(points.values).any():
        return points.values
    x = {name: at.tolist() for name, at in points.places.items()}
    return {**x, "values": points.values.tolist(), **options}


def _checked_options(table: Mapping[str, Any], others: tuple[str, ...]) -> dict[str, Any]:
    """The options of `place` in a table of a study file."""
    valid = (*others, "interpolate", "gaps")
    wrong = [unknown_name("profile", str(key), valid) for key in table if key not in valid]
    if table.get("gaps", "refuse") not in ("refuse", "fill"):
        wrong.append(f"gaps: must be 'refuse' or 'fill', got {table['gaps']!r}")
    if not isinstance(table.get("interpolate", False), bool):
        wrong.append("interpolate: must be true or false")
    if wrong:
        raise InputError(wrong)
    return {name: table[name] for name in ("interpolate", "gaps") if name in table}


def _row(given: Any) -> Array:
    try:
        return np.array(given, dtype=np.float64).reshape(-1)
    except (TypeError, ValueError):
        raise InputError("x and values must be lists of numbers") from None


def quantity_of(key: str) -> str:
    """Return what the parameter of this name, or of this dotted key, holds."""
    field = key.rsplit(".", 1)[-1]
    return "load_profile" if field == "profile" else field


def is_profile(key: str) -> bool:
    """Whether a dotted key of a study takes a profile."""
    return quantity_of(key) in UNITS
