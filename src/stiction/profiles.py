"""Profiles of one's own, from files and from labelled arrays: one reader, wherever one enters.

Units that are stated are converted, coordinates decide where a value belongs, and gaps stay gaps
until somebody asks for them to be filled.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.arrays import Array
from stiction.errors import InputError, unknown_name
from stiction.interface import Interface
from stiction.labelled_arrays import MEASURED, is_labelled, labelled, simplified
from stiction.model import describe, real_array
from stiction.plane_gaps import close_gaps
from stiction.plane_profiles import on_plane, read_plane
from stiction.profile_files import ENDINGS, NETCDF, TEXT, decoded, read_netcdf, read_npy
from stiction.profile_nodes import AtNodes, Gaps, Points, check_gaps, in_order
from stiction.profile_text import Table, read_table
from stiction.quantities import (
    OF_A_PLANE,
    PLACES,
    UNITS,
    Map,
    choose,
    converted,
    factor_of,
    is_called,
    is_height,
)
from stiction.topographies import is_topography, mapped

if TYPE_CHECKING:
    import xarray as xr


def read_profile(
    source: Any,
    *,
    x: str | int | None = None,
    value: str | int | None = None,
    unit: str | None = None,
    x_unit: str | None = None,
    quantity: str = "strength",
    strength: Callable[[Array], Array] | None = None,
    interface: Interface | None = None,
    interpolate: bool = False,
    gaps: Gaps = "refuse",
) -> xr.DataArray:
    """A profile along the interface from a file or a labelled array, in SI units.

    Parameters
    ----------
    source : path, xarray.DataArray or xarray.Dataset
        ``.npy``: shape (nodes,), or columns. ``.csv``, ``.txt``, ``.dat``, ``.tsv``: columns
        separated by semicolons, tabs, commas or blanks, with or without a line of names, such as
        ``x (mm); strength (MPa)``. ``.nc``: variables with `units`, and x as a coordinate. Also a
        line scan or map of the SurfaceTopography library, with `strength`.
    x, value : str or int, optional
        Name or number (from 0) of the column, coordinate or variable. Without them: the columns
        that are called so (``x``, ``position``; ``strength``, ``tau_p``), the only variable whose
        unit is one of `quantity`, or the two columns of a table. A table of one column has no x.
    unit, x_unit : str, optional
        Units of the values and of x, where the source does not state them; SI if nobody does. One
        that contradicts the source is refused.
    quantity : str
        What it is: 'strength', 'residual_strength', 'initial_stress', 'normal_pressure' (Pa),
        'weakening_rate' (Pa/m), 'critical_slip' (m), 'load_profile' or 'friction_coefficient' (1).
    strength : callable, optional
        Map from another measured quantity, such as heights in SI units, to the strength in Pa;
        nothing is taken for a strength without one. It is applied to what is called ``height`` or
        ``z``, to the only variable in a unit of length, or to the only one that is no stress. On a
        plane it gets an array (nx, ny).
    interface : Interface, optional
        Put the profile on its nodes x_i = i L/n, modulo L; as it is if left out. Points may come
        in any order and begin anywhere. On a plane values at the nodes are taken, from ``.npy`` of
        shape (nx, ny), ``.nc`` or labelled arrays over 'x' and 'y', or text with the columns x, y
        and value in any order of lines.
    interpolate : bool
        Whether points may lie elsewhere than the nodes; then linearly between them.
    gaps : {"refuse", "fill", "skip"}
        Whether missing values (NaN, empty cells, missing points) are an error, are filled with
        straight lines between their ends, or stay NaN, for `stiction.fit_field` to leave out.
        Without an interface they stay in any case.

    Returns
    -------
    xarray.DataArray
        Over 'x' (m) with `units`. With gaps that were filled it has a coordinate 'measured', False
        there, from which `stiction.onset` and its figure know them.

    Raises
    ------
    InputError
        If the source cannot be read, is in an unknown or unsuitable unit, does not say which of
        several columns is meant, or does not fit the interface.

    Warns
    -----
    UnitWarning
        If `strength` is applied to a stress that is called neither hardness nor a pressure, or
        makes of heights without a unit what is no strength of a solid.
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

    check_gaps(gaps)
    name = str(source) if isinstance(source, str | Path) else "source"
    if quantity not in UNITS:
        raise InputError(unknown_name("quantity", str(quantity), UNITS))
    if interface is not None and not isinstance(interface, Interface):
        raise InputError(f"interface: must be an Interface, got {describe(interface)}")
    for what, text in {"unit": unit, "x_unit": x_unit}.items():
        if text is not None and not isinstance(text, str):
            raise InputError(f"{what}: must be a text such as 'um', got {describe(text)}")
    if strength is not None and not callable(strength):
        raise InputError(
            "strength: must be a function that makes strength (Pa) of an array of heights (m), such"
            f" as lambda h: 1e12 * h; got {describe(strength)}"
        )
    if interface is None and (interpolate or gaps == "fill"):
        raise InputError("interface: needed to interpolate, or to fill gaps")
    if is_topography(source):
        try:
            source, strength = mapped(source, strength, quantity, UNITS[quantity]), None
        except InputError as error:
            raise InputError([_prefixed(name, text) for text in error.problems]) from None
        if interface is None:
            return source
    if interface is not None and interface.is_plane:
        if x is not None or x_unit is not None:
            raise InputError("x and x_unit: are options of profiles of a line")
        if interpolate:
            raise InputError(
                "interpolate: is an option of profiles of a line; on a plane values are taken at"
                " the nodes"
            )
        return _of_plane(name, source, quantity, interface, value, unit, strength, gaps)
    try:
        points = points_of(source, quantity, x, value, unit, x_unit, strength)
        if points.values.ndim != 1:
            raise InputError(f"must hold one profile, got shape {points.values.shape}{OF_A_PLANE}")
        values, place, measured = points.values, points.x, points.measured
        if interface is not None:
            values, measured = points.on(interface, interpolate=interpolate, gaps=gaps)
            place = interface.x
        elif place is not None:
            order = np.argsort(place, kind="stable")
            values, place = values[order], place[order]
            again = np.flatnonzero(np.diff(place) == 0.0)
            if again.size:
                raise InputError(
                    f"x repeats: {place[again[0]]:.9g} m stands beside two values{OF_A_PLANE}"
                )
            measured = None if measured is None else measured[order]
    except InputError as error:
        raise InputError([_prefixed(name, text) for text in error.problems]) from None
    coords: dict[str, Any] = {}
    if place is not None:
        coords["x"] = ("x", place, {"units": "m", "long_name": "position along the interface"})
    if measured is not None:
        coords[MEASURED] = ("x", measured, {"long_name": "measured, not filled in"})
    attributes = {"units": UNITS[quantity], "long_name": quantity.replace("_", " ")}
    return xr.DataArray(values, dims="x", coords=coords, name=quantity, attrs=attributes)


def _of_plane(
    name: str,
    source: Any,
    quantity: str,
    interface: Interface,
    value: Any,
    unit: str | None,
    strength: Map | None,
    gaps: Gaps,
) -> xr.DataArray:
    """`read_profile` of a plane, which takes values at the nodes only."""
    import xarray as xr

    read = read_plane if isinstance(source, str | Path) else on_plane
    given = Path(source) if isinstance(source, str | Path) else source
    if read is on_plane and not is_labelled(source):
        raise InputError(
            f"source: must be a path, a DataArray or a Dataset, got {describe(source)}"
        )
    try:
        values = read(given, quantity, interface, value, unit, strength)
        if values.shape != interface.shape:
            raise InputError(f"must hold one profile, got shape {values.shape}")
        values, measured = close_gaps(values, interface, gaps)
    except InputError as error:
        raise InputError([_prefixed(name, text) for text in error.problems]) from None
    coords: dict[str, Any] = {
        dim: (dim, place, {"units": "m", "long_name": f"position along {dim}"})
        for dim, place in interface.coordinates.items()
    }
    if measured is not None:
        coords[MEASURED] = (interface.dims, measured, {"long_name": "measured, not filled in"})
    attributes = {"units": UNITS[quantity], "long_name": quantity.replace("_", " ")}
    return xr.DataArray(values, dims=interface.dims, coords=coords, name=quantity, attrs=attributes)


def _prefixed(name: str, text: str) -> str:
    return text if text.startswith(f"{name}:") else f"{name}: {text}"


def points_of(
    source: Any,
    quantity: str,
    x: str | int | None = None,
    value: str | int | None = None,
    unit: str | None = None,
    x_unit: str | None = None,
    strength: Map | None = None,
) -> Points:
    """What `source` says of a quantity, in SI; see `read_profile`."""
    if isinstance(source, str | Path):
        path = Path(source)
        if path.suffix.lower() not in ENDINGS:
            raise InputError(
                f"a profile must end in {', '.join(ENDINGS)}, got {path.name!r}; files of"
                " instruments: give what SurfaceTopography.read_topography(path) returns"
            )
        if path.suffix.lower() in NETCDF:
            source = read_netcdf(path)
        elif path.suffix.lower() in TEXT:
            source = read_table(decoded(path))
        else:
            source = _table_of(read_npy(path), x, value)
    if isinstance(source, Table):
        column, place = _choose_columns(source, quantity, x, value, strength)
        at = None
        if place is not None:
            at = source.columns[place] * factor_of(x_unit, source.units[place], "x")
        name, stated = source.names[column], source.units[column]
        values = converted(source.columns[column], unit, stated, quantity, strength, name)
        return Points(values, at)
    if is_labelled(source):
        return labelled(source, quantity, x, value, unit, x_unit, strength)
    raise InputError(f"must be a path, a DataArray or a Dataset, got {describe(source)}")


def _table_of(array: Array, x: Any, value: Any) -> Table:
    if array.ndim == 1 and array.size:
        return Table((None,), (None,), array[np.newaxis])
    if array.ndim == 2 and array.size and value is not None:
        width = array.shape[1]
        return Table((None,) * width, (None,) * width, array.T)
    columns = "; of an array of columns say which: x=0, value=1"
    hint = columns + OF_A_PLANE if array.ndim == 2 else ""
    raise InputError(f"must hold one profile, shape (nodes,), got shape {array.shape}{hint}")


def _choose_columns(
    table: Table, quantity: str, x: Any, value: Any, strength: Map | None
) -> tuple[int, int | None]:
    """The columns of the values and of x."""
    names, width = table.names, len(table.names)
    if _is_map(table) and x is None:
        raise InputError(f"holds values over x and y, not along a line{OF_A_PLANE}")
    value = _column("value", value, names)
    place = _column("x", x, names)
    if place is None and width > 1:
        # Heights beside the strength are no coordinate.
        beside_strength = (
            strength is not None and is_height(names[0]) and is_called(names[1], quantity)
        )
        called = [i for i, name in enumerate(names) if str(name).casefold() in PLACES]
        if len(called) == 1:
            place = called[0]
        elif width == 2 and value != 0 and not beside_strength:
            place = 0
        elif value is None and width > 2:
            raise InputError(
                f"has {width} columns ({_listed(names)}); say which are meant: x=..., value=..."
                + ("" if any(names) else OF_A_PLANE)
            )
    others = [i for i in range(width) if i != place]
    if value is None:
        known = [(names[i], table.units[i]) for i in others]
        value = others[choose(known, quantity, strength)]
    return value, place


def _is_map(table: Table) -> bool:
    """Whether there are columns x and y, and a place on either axis has several lines."""
    names = [str(name).casefold() for name in table.names]
    if "x" not in names or "y" not in names:
        return False
    places = [table.columns[names.index(dim)] for dim in ("x", "y")]
    return all(1 < np.unique(place).size < place.size for place in places)


def _column(what: str, wanted: Any, names: Sequence[str | None]) -> int | None:
    if wanted is None:
        return None
    if isinstance(wanted, str) and wanted in names:
        return list(names).index(wanted)
    if isinstance(wanted, int) and not isinstance(wanted, bool) and 0 <= wanted < len(names):
        return wanted
    if isinstance(wanted, str) and any(names):
        raise InputError(unknown_name(what, wanted, [name for name in names if name]))
    raise InputError(
        f"{what}: must be a column, 0 to {len(names) - 1}, or its name; got {describe(wanted)}"
    )


def _listed(names: Sequence[str | None]) -> str:
    return ", ".join(repr(name) for name in names if name) or "without names"


def _and_own_gaps(measured: Any, source: Any) -> Any:
    """Where a map was measured, those that were filled earlier taken into account."""
    if MEASURED not in getattr(source, "coords", {}):
        return measured
    own = source.coords[MEASURED].transpose("x", "y")
    own = own.sortby([dim for dim in own.dims if dim in own.coords]).values.astype(bool)
    return own if measured is None else measured & own


def at_nodes(
    name: str, value: Any, quantity: str, interface: Interface, gaps: Gaps = "refuse"
) -> AtNodes:
    """What a caller gave for a quantity, with one value a node; errors name the argument.

    Numbers and plain arrays without gaps pass as they are, for whoever checks their shape.
    """
    try:
        value = simplified(value, quantity)
        if is_labelled(value) and interface.is_plane:
            found = on_plane(value, quantity, interface)
            if found.shape[-2:] != interface.shape:
                return AtNodes(found, None)
            filled = close_gaps(found, interface, gaps)
            return AtNodes(filled.values, _and_own_gaps(filled.measured, value))
        if is_labelled(value):
            points = labelled(value, quantity)
            if points.x is None and points.values.shape[1:] == (1,):  # one value a sample
                if quantity == "strength":
                    raise InputError("has no dimension along the interface; call it 'x'")
                return AtNodes(points.values, None)
            return points.on(interface, interpolate=False, gaps=gaps)
        if gaps != "refuse":
            array = real_array(value)
            if interface.is_plane and array.shape[-2:] == interface.shape:
                return close_gaps(array, interface, gaps)
            if array.shape[-1:] == (interface.size,) and np.isnan(array).any():
                return in_order(array, interface, gaps)
    except TypeError:
        pass  # no numbers: refused with everything else that is wrong
    except InputError as error:
        raise InputError([f"{name}: {text}" for text in error.problems]) from None
    return AtNodes(value, None)
