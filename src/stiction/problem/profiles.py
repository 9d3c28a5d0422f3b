"""Users' profiles: from an argument to a sample, and from a file to a labelled array.

`placed_sample` takes labelled or plain arrays through five steps. Each
returns a new value:

1. Find the names of the profiles (`named_profiles`), and of their
   variables and dimensions (`named` in `reading/labels.py`).
2. Convert the profiles to SI units (`profile_in_si` in
   `base/units.py`).
3. Assign values to nodes (`on_nodes` in `sample.py`).
4. Check the values (`as_rows`), and that each property is given once
   (`given_twice`).
5. Make the sample with the constants of the problem (`made`).

`at_nodes` takes steps 1 to 3 for a profile of a load, a law or a
picture. `read_profile` reads a file, and `profile_in_file` a profile
that a study file names.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np

from stiction.base.arrays import Array
from stiction.base.errors import InputError, prefixed, unknown_name, warn_accuracy
from stiction.base.model import FilePath, Number, check, checked
from stiction.base.units import as_numbers, check_measured, profile_in_si
from stiction.base.variables import PROFILES, QUANTITIES
from stiction.problem.checks import check_resolution
from stiction.problem.interface import Interface
from stiction.problem.reading.columns import Reading, Wanted
from stiction.problem.reading.files import load
from stiction.problem.reading.labels import (
    OF_A_PLANE,
    Missing,
    named,
    of_array,
    without_missing,
)
from stiction.problem.reading.tables import Options
from stiction.problem.sample import (
    Sample,
    accepted_again,
    as_rows,
    given_twice,
    made,
    on_nodes,
    pressing_of,
    refuse_missing,
)
from stiction.problem.specimen import UNFIT_FOR_SLIDER, Slider

if TYPE_CHECKING:
    import xarray as xr


def named_profiles(given: Any) -> dict[str, Any]:
    """Return profiles by name, from a mapping, a dataset or the strength alone.

    >>> named_profiles([3.0]), named_profiles({"strength": 1, "initial_stress": 2})
    ({'strength': [3.0]}, {'strength': 1, 'initial_stress': 2})
    >>> both = {"friction_coefficient": 1, "strength": 2}
    >>> for given in (both, {"initial_stress": 1}, {"tau": 1}):
    ...     try:
    ...         named_profiles(given)
    ...     except InputError as error:
    ...         print(str(error)[:53])
    profiles: give either strength (Pa) or friction_coeff
    strength: is missing from the profiles
    profiles: unknown 'tau' (valid: strength, residual_st
    """
    if hasattr(given, "marginal") or hasattr(given, "members"):
        raise InputError(
            f"profiles: must be numbers, got a {type(given).__name__}. Pass its sample(interface),"
            " or call st.monte_carlo"
        )
    if not isinstance(given, Mapping):  # a Dataset is one too
        return {"strength": given}
    known = (*PROFILES, "friction_coefficient")
    unknown = [unknown_name("profiles", str(key), known) for key in given if key not in known]
    if "strength" in given and "friction_coefficient" in given:
        unknown.append("profiles: give either strength (Pa) or friction_coefficient (1)")
    if unknown and not hasattr(given, "data_vars"):
        raise InputError(unknown)
    profiles = {name: given[name] for name in given if name in known}
    if not {"strength", "friction_coefficient"} & {*profiles}:
        raise InputError("strength: is missing from the profiles")
    return profiles


def placed_sample(problem: Any, profiles: Any, accept: Collection[str] = ()) -> Sample:
    """Return a sample made from users' data. See `Problem.sample` for the arguments.

    Coefficients become stresses by the pressure of the problem or of the
    profiles:

    >>> import stiction as st
    >>> def sample(profiles, pressure=None):
    ...     problem = st.Problem(
    ...         st.Solid(1e9, 0.25, 1200.0), st.Interface(9.0, 64),
    ...         st.LinearWeakening(weakening_rate=1e9), st.Load(normal_pressure=pressure),
    ...     )
    ...     return placed_sample(problem, profiles)
    >>> coefficients = np.array([[0.4], [0.6]]) * np.ones(64)
    >>> sample({"friction_coefficient": coefficients}, 5e7).strength[:, 3].round(3).tolist()
    [20000000.0, 30000000.0]
    >>> pressed = {"friction_coefficient": coefficients, "normal_pressure": [[5e7], [4e7]]}
    >>> result = sample(pressed | {"residual_strength": np.full((1, 64), 3.0)})
    >>> result.residual_strength[:, 3].tolist()
    [3.0, 3.0]
    >>> result.strength[:, 3].round(3).tolist(), result.normal_pressure[:, 3].tolist()
    ([20000000.0, 24000000.0], [50000000.0, 40000000.0])
    >>> for wrong in ({"residual_strength": np.ones((3, 1))}, {"weakening_rate": "a"}):
    ...     try:
    ...         sample(pressed | wrong)
    ...     except InputError as error:
    ...         print(error.problems[-1])
    residual_strength: must have 1 sample or the 2 of the strength, got 3
    weakening_rate: must be numbers, got str
    """
    if isinstance(profiles, Sample):
        return accepted_again(problem, profiles, accept)
    interface = problem.interface
    given, mistakes = named_profiles(profiles), {}
    placed: dict[str, Any] = {
        name: value.to_xarray(interface) if isinstance(value, ProfileFile) else value
        for name, value in given.items()
    }
    # 1. to 4. The steps for each profile.
    steps: tuple[tuple[Any, Any], ...] = (
        (named, interface.dims), (profile_in_si, ()), (on_nodes, interface), (as_rows, interface)
    )  # fmt: skip
    for step, known in steps:
        for name, value in [*placed.items()]:
            try:
                placed[name] = step(value, name, known)
            except InputError as error:
                mistakes[name] = [f"{name}: {text}" for text in error.problems]
                del placed[name]
    rows = {name: profile.values for name, profile in placed.items()}
    quantities = {name: profile.quantity for name, profile in placed.items()}
    strength = rows.get("strength", rows.get("friction_coefficient"))
    problems = given_twice(problem, {*given, *quantities.values()}, "profiles")
    problems += [text for name in given for text in mistakes.get(name, ())]
    problems += [
        f"{name}: must have 1 sample or the {len(strength)} of the strength, got {len(values)}"
        for name, values in rows.items()
        if strength is not None and values.ndim and len(values) not in (1, len(strength))
    ]
    if isinstance(problem.specimen, Slider):
        unfit = {name: UNFIT_FOR_SLIDER.get(what) for name, what in quantities.items()}
        problems += [f"{name}: {text}" for name, text in unfit.items() if text]
    if problems:
        raise InputError(problems)
    # 5. Coefficients become stresses, and profiles a sample.
    if "normal_pressure" in rows and {*rows["normal_pressure"].shape[1:]} <= {1}:
        rows["normal_pressure"] = rows["normal_pressure"] * pressing_of(problem)
    pressure = rows.get("normal_pressure", problem.normal_pressure)
    rows |= {
        name: rows[name] * pressure
        for name, what in quantities.items()
        if what == "friction_coefficient"
    }
    if "friction_coefficient" in rows:
        rows["strength"] = rows.pop("friction_coefficient")
    sample = made(problem, rows, accept)
    if (constant := sample.strength <= sample.residual_strength).any():
        warn_accuracy(
            f"strength is not above residual_strength at {100.0 * constant.mean():.3g} % of"
            " the nodes. These do not weaken: their strength is constant"
        )
    check_resolution(problem, sample.steepest_weakening_rate)
    return sample


def at_nodes(key: str, value: Any, interface: Interface, *, missing: bool = False) -> Any:
    """Return a profile in SI at the nodes (steps 1 to 3).

    With `missing`, some may be NaN.

    `key` may be dotted. Arrays with a different shape are returned
    unchanged, because the caller checks them.

    >>> import xarray as xr
    >>> line = Interface(4.0, 8)
    >>> gaps = xr.DataArray([3.0, 4.0], {"x": [0.5, 0.0]}, ["x"], attrs={"units": "mm"})
    >>> at_nodes("friction.critical_slip", gaps, line, missing=True)[:3].tolist()
    [0.004, 0.003, nan]
    >>> at_nodes("load.profile", [1.0, np.nan], line)
    array([ 1., nan])
    >>> at_nodes("friction.critical_slip", gaps, line)  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: friction.critical_slip: ... (NaN) at 6 of 8 nodes, ...
    """
    quantity = quantity_of(key)
    with prefixed(key):
        if isinstance(value, ProfileFile):
            value = value.to_xarray(interface)
        named_value = named(value, quantity, interface.dims)
        values = on_nodes(profile_in_si(named_value, quantity), quantity, interface).values
        at_all = values.shape[-len(interface.shape) :] == interface.shape
        if at_all and not missing and np.isnan(values).any():
            refuse_missing(values, interface)
        return values


def quantity_of(key: str) -> str:
    """Return the quantity that the parameter with this name or dotted key holds.

    >>> quantity_of("load.profile"), quantity_of("friction.critical_slip"), quantity_of("strength")
    ('load_profile', 'critical_slip', 'strength')
    """
    field = key.rsplit(".", 1)[-1]
    return "load_profile" if field == "profile" else field


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

    A column is read if its heading, or the caller, says that it is the wanted
    quantity. If several columns could be the quantity, an error lists them.

    Parameters
    ----------
    source : path, array, or table with labels
        Labels of xarray and headings of pandas are used, and units of pint and astropy. A
        ``.csv``, ``.txt``, ``.dat``, ``.tsv`` or ``.xlsx`` file has columns, with
        or without a line of names such as ``x (mm), strength (MPa)``. An ``.npy``
        file has the shape (nodes,) or (nx, ny), a ``.nc`` file variables with
        `units`, and x as a coordinate. A map over 'x' and 'y' is a table with both
        as columns.
    x, value : str or int, optional
        Heading, name or number (from 0) of the column, coordinate or variable. By
        default `value` is the column named after the quantity, tau_p, shear strength,
        COF, Reibzahl, ... or the only column with numbers besides x, specimens and
        times, and `x` is the column called x, position, travel, Weg, ... or the only
        column in a unit of length. If two columns have no headings, the first is x.
    unit, x_unit : str, optional
        Units of values and positions that the source does not state. By default SI.
    quantity : str
        'strength', 'residual_strength', 'initial_stress',
        'normal_pressure' (Pa), 'critical_slip', 'height' (m),
        'weakening_rate' (Pa/m), 'load_profile' or
        'friction_coefficient' (1).
    strength : callable, optional
        Map from heights (m) to strengths (Pa): ``lambda h: 1e6 + 5e11 * h``.
    missing : float, str or sequence of them, optional
        Numbers and words that mark a missing value, such as ``-9999`` or ``"Bad"``.
        Empty cells, ``nan``, ``n/a``, ``-``, ``***`` and ``#N/A`` always mark it.
    decimal : {".", ","}, optional
        Decimal mark of a text file, needed if it could also separate thousands.
    skip : int
        Number of lines or rows to pass over before the headings.
    sheet : int or str
        Number (from 0) or name of a sheet in the workbook.
    interface : Interface, optional
        Map the profile to the nodes x_i = i L/n, modulo L. Points may have any
        order, and no point may be missing. Without an interface, missing values stay
        (NaN), for `fit_field` or `RandomField.given`, which draws them.

    Returns
    -------
    xarray.DataArray
        Profile over 'x' (m), or over 'x' and 'y' on a plane, with
        `units`. Attributes state what was read: file, column, unit,
        number of values, other columns, and rows that were left out.

    Raises
    ------
    InputError
        If the source cannot be read, a unit is unknown or unsuitable, columns
        are ambiguous, or the profile does not fit the interface.

    Warns
    -----
    AccuracyWarning
        If x lies between the nodes.
    UnitWarning
        If a table states no unit, so that SI is assumed, or heights without a unit range
        over more than 1 mm.

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
        raise InputError("quantity: must be 'strength' if strength= maps heights to strengths")
    options = Options(skip, sheet, missing, decimal)
    dims = None if interface is None else interface.dims
    of_source, is_file = "height" if strength else quantity, isinstance(source, str | Path)
    with prefixed(str(source) if is_file else "source"):
        data: Any = load(Path(source), options) if is_file else source
        array = named(data, of_source, dims, x=x, value=value)
        if not getattr(array, "dims", ()):
            array = named(of_array(array, of_source), of_source, dims, x=x, value=value)
        array = array.copy(data=without_missing(array.data, options))
        read: Reading | None = array.attrs["read"]
        array = profile_in_si(
            array, of_source, (QUANTITIES[of_source].units,), unit=unit, x_unit=x_unit,
            doubted=missing is None,
        )  # fmt: skip
        if strength is not None:
            array = array.copy(data=_mapped(strength, array.values))
        single = [dim for dim in {*array.dims} - {"x", "y", "row"} if array.sizes[dim] == 1]
        array = array.squeeze(single)
        if not {*array.dims} <= {"x", "y", "row"}:
            raise InputError(f"must hold a single profile, got shape {array.shape}")
        if interface is None:
            array = _in_order(array)
        else:
            placed = on_nodes(array, quantity, interface)
            (values,) = as_rows(placed, "strength", interface).values
            array = xr.DataArray(values, interface.coordinates, interface.dims)
    for dim in {"x", "y"} & {*array.coords}:
        array[dim].attrs.update(units="m", long_name=f"position along {dim}")
    array.attrs = {"units": QUANTITIES[quantity].units, "long_name": quantity.replace("_", " ")}
    if read is not None:
        name = Path(source).name if is_file else type(source).__name__
        about = read._replace(source=name, unit=unit or read.unit).attributes
        array.attrs |= {key: entry for key, entry in about.items() if entry}
    return array.rename(quantity)


def _mapped(strength: Callable[[Any], Any], heights: Array) -> Array:
    """Return strengths, Pa, from heights, m. Missing heights give NaN.

    >>> def strength(heights):
    ...     heights[:] = 1e6 + 5e11 * np.nan_to_num(heights)
    ...     return heights
    >>> heights = np.array([2e-6, np.nan])
    >>> _mapped(strength, heights).tolist(), heights.tolist()
    ([2000000.0, nan], [2e-06, nan])
    >>> _mapped(lambda heights: 3.0, heights)  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: ... got an array of shape () for heights of shape (2,)
    """
    values = as_numbers(strength(heights.copy()))
    if values.shape != heights.shape:
        shapes = f"got an array of shape {values.shape} for heights of shape {heights.shape}"
        raise InputError(f"strength: must return a strength for each height, {shapes}")
    values = np.where(np.isnan(heights), np.nan, values)
    check_measured(values, "strength", doubted=False)
    return values


def _in_order(array: Any) -> Any:
    """Return a profile with rising coordinates, and points on a plane as a map.

    >>> import xarray as xr
    >>> def ordered(values, dims, **coords):
    ...     array = _in_order(xr.DataArray(values, coords, dims))
    ...     return array.values.tolist(), *[at.values.tolist() for at in array.coords.values()]
    >>> ordered([1, 2, 3], ["x"], x=[7, 5, 6])
    ([2, 3, 1], [5, 6, 7])
    >>> ordered([1, 2, 3], ["row"], x=("row", [7, 5, 7]), y=("row", [9, 9, 8]))
    ([[nan, 2.0], [3.0, 1.0]], [5, 7], [8, 9])
    >>> ordered([1, 2, 3], ["x"], x=[7, 5, 7])  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: x repeats: there are two values at 7 m (1 in all). ...
    """
    if "row" in array.dims:
        array = array.set_index(row=["x", "y"])
    for index in array.indexes.values():
        if index.has_duplicates:
            twin = index[index.duplicated()]
            raise InputError(
                f"x repeats: there are two values at {twin[0]} m ({twin.size} in all). Keep"
                f" either, or pass skip= with the lines above the last record{OF_A_PLANE}"
            )
    array = array.unstack()
    return array.sortby([dim for dim in array.dims if dim in array.coords])


# -- profiles in study files -----------------------------------------------------------------------


class ProfileFile(NamedTuple):
    """A profile file named in a study file, which is read when the interface is known."""

    path: Path
    options: dict[str, Any]

    def to_xarray(self, interface: Interface | None = None) -> xr.DataArray:
        """Read the file, and place its values on an interface."""
        return read_profile(self.path, interface=interface, **self.options)


def profile_in_file(given: Any, field: str, folder: Path) -> Any:
    """Return the profile named in a study file by its path, or by `file` and reader options.

    >>> file = profile_in_file("a.csv", "load.profile", Path("study"))
    >>> file.path.parts, file.options
    (('study', 'a.csv'), {'quantity': 'load_profile'})
    >>> file = profile_in_file({"file": "a.csv", "unit": "MPa"}, "strength", Path("study"))
    >>> file.options, profile_in_file({"type": "uniform"}, "strength", Path("study"))
    ({'unit': 'MPa', 'quantity': 'strength'}, {'type': 'uniform'})
    """
    table = dict(given) if isinstance(given, Mapping) else {"file": given}
    if "file" not in table:
        return given
    path = folder / check("file", table.pop("file"), FilePath)
    reserved = sorted(table.keys() & {"source", "quantity", "interface"})
    if reserved:
        raise InputError(f"{reserved[0]}: is not an option in a study file")
    return ProfileFile(path, table | {"quantity": quantity_of(field)})
