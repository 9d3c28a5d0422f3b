"""Measured profiles: read from files and labelled arrays, and put on the nodes of an interface.

Units that are stated are converted, coordinates decide where a value belongs, and gaps stay gaps
until somebody asks for them to be filled. All of it is the same on a line and on a plane, where x_i
= i L/n in each direction, periodically.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.arrays import Array
from stiction.errors import InputError, UnitWarning, unknown_name, warn_user
from stiction.interface import FEWEST, Interface
from stiction.model import FilePath, Flag, check, checked, describe, real_array
from stiction.placing import AtNodes, Gaps, Points, close_gaps, place
from stiction.tables import OF_A_PLANE, load, read_npy
from stiction.units import factor_to, is_in, parse

if TYPE_CHECKING:
    import xarray as xr

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


@checked
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
    interpolate: Flag = False,
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

    if quantity not in UNITS:
        raise InputError(unknown_name("quantity", quantity, UNITS))
    if interface is None and (interpolate or gaps == "fill"):
        raise InputError("interface: needed to interpolate, or to fill gaps")
    if interface is not None and interface.is_plane:
        if interpolate:
            raise InputError(
                "interpolate: is an option of profiles of a line; on a plane values are taken at"
                " the nodes"
            )
        if x is not None or x_unit is not None:
            raise InputError("x and x_unit: are options of profiles of a line")
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

    data: Any
    if isinstance(source, str | Path):
        data = load(Path(source), value, dims)
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
        if len(known) == 1:
            raise InputError(f"has the coordinate {known[0]!r} only; a map has x and y, or none")
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
                return close_gaps(array, None, interface, gaps)
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
    check("file", table["file"], FilePath)
    read = ("x", "value", "unit", "x_unit")
    options = _checked_options(table, ("file", *read))
    path = Path(folder) / table["file"]
    try:
        if path.suffix.lower() == ".npy" and len(table) == 1:
            array = read_npy(path)
            if array.ndim == 2 and min(array.shape) >= FEWEST:  # a plane, and no columns
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
