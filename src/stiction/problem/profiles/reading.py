"""Read users' profiles in SI, and put them on the nodes of an interface.

A profile enters in three ways: through `read_profile`, as an argument
of a call or an object (`at_nodes`), or by its name in a study file
(`profile_in_file`). The profiles of samples enter together
(`placed_profiles`). `read_profile`, which study files also use, takes
these steps. `at_nodes` takes steps 1 and 3:

1. Find the quantity in the source, in SI (`labels.py`).
2. Turn heights into strengths, if the caller gives a map.
3. Put the values on the nodes (`placing.py`), or sort them if there is
   no interface.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple

import numpy as np

from stiction.base.arrays import Array
from stiction.base.errors import InputError, prefixed, unknown_name
from stiction.base.model import (
    FilePath,
    Number,
    as_numbers,
    check,
    checked,
    real_array,
)
from stiction.base.variables import PROFILES, QUANTITIES
from stiction.problem.friction import SCALES
from stiction.problem.interface import Interface
from stiction.problem.profiles.labels import (
    Column,
    check_positive,
    is_coefficient,
    is_labelled,
    labelled,
    simplified,
)
from stiction.problem.profiles.placing import (
    OF_A_PLANE,
    place,
    refuse_missing,
    turned,
)
from stiction.problem.profiles.tables import Options

if TYPE_CHECKING:
    import xarray as xr

FRICTION = (1e-3, 10.0), (1e-4, 100.0)
"""Usual and possible mean strengths over normal pressure, from superlubricity to adhesive gels."""
LARGEST = 1e100
"""Of a profile, in SI units; sums and products of larger numbers overflow."""

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
    interface: Interface | None = None,
) -> xr.DataArray:
    """Read a profile along the interface from a file or a labelled array, in SI units.

    Parameters
    ----------
    source : path, array, or table with labels
        Labels of xarray and pandas are used, and units of pint
        and astropy. An ``.npy`` file has the shape (nodes,) or
        (nx, ny). A ``.csv``, ``.txt``, ``.dat``, ``.tsv`` or
        ``.xlsx`` file has columns, with or without a line of
        names such as ``x (mm), strength (MPa)``. A ``.nc`` file
        has variables with `units`, and x as a coordinate. A map
        over 'x' and 'y' is a table with both as columns, a matrix
        below comments that state its width and height (Gwyddion), or
        a binary file or object that SurfaceTopography reads.
    x, value : str or int, optional
        Name, heading or number (from 0) of the column, coordinate or
        variable. By default, columns are recognised by a name such as
        ``x`` or ``position``, and ``strength`` or ``tau_p``, or else as
        the single column in a unit of length or of `quantity`. If two
        columns have no headings, the first is x.
    unit, x_unit : str, optional
        Units of the values and the positions, if the source does not
        state them. By default SI.
    quantity : str
        'strength', 'residual_strength', 'initial_stress',
        'normal_pressure' (Pa), 'critical_slip', 'height' (m),
        'weakening_rate' (Pa/m), 'load_profile' or
        'friction_coefficient' (1).
    strength : callable, optional
        Map from heights (m, an array) to strengths (Pa):
        ``strength=lambda h: 1e6 + 5e11 * h``. Heights are then read.
    missing : float, str or sequence of them, optional
        Numbers and words that stand for a missing value, such as
        ``-9999`` or ``"Bad"``. Empty cells, ``nan``, ``n/a``, ``-``,
        ``***`` and ``#N/A`` always do.
    decimal : {".", ","}, optional
        Decimal mark of a text file. It is needed if the mark could also
        separate thousands.
    skip : int
        Number of lines, or rows of a sheet, to pass over before the headings.
    sheet : int or str
        Number (from 0) or name of the sheet of a workbook.
    interface : Interface, optional
        Map the profile to the nodes x_i = i L/n, modulo L. Points may
        have any order, and no point may be missing. Without an
        interface, missing values (NaN, empty cells) stay, for
        `stiction.fit_field` or for `RandomField.given`, which draws
        equally likely values.

    Returns
    -------
    xarray.DataArray
        Profile over 'x' (m), or over 'x' and 'y' on a plane, with
        `units`.

    Raises
    ------
    InputError
        If the source cannot be read, a unit is
        unknown or unsuitable, columns are ambiguous,
        or the profile does not fit the interface.

    Warns
    -----
    AccuracyWarning
        If x lies between the nodes.
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
    if strength is not None and quantity != "strength":
        raise InputError("strength: maps heights to strengths. Leave quantity='strength'")
    options = Options(skip, sheet, missing, decimal)
    dims = None if interface is None else interface.dims
    with prefixed(str(source) if isinstance(source, str | Path) else "source"):
        # 1. Find the quantity.
        array = labelled(
            source, "height" if strength else quantity, dims, x=x, value=value, unit=unit,
            x_unit=x_unit, options=options,
        )  # fmt: skip
        # 2. Map heights.
        if strength is not None:
            array = array.copy(data=_mapped(strength, array.values))
        single = [dim for dim in {*array.dims} - {"x", "y", "row"} if array.sizes[dim] == 1]
        array = array.squeeze(single)
        if not {*array.dims} <= {"x", "y", "row"}:
            raise InputError(f"must hold a single profile, got shape {array.shape}")
        # 3. Place or sort the values.
        if interface is None:
            array = _in_order(array)
        else:
            values = refuse_missing(place(array, interface), interface)
            array = xr.DataArray(values, interface.coordinates, interface.dims)
    for dim in {"x", "y"} & {*array.coords}:
        array[dim].attrs.update(units="m", long_name=f"position along {dim}")
    array.attrs = {"units": QUANTITIES[quantity].units, "long_name": quantity.replace("_", " ")}
    return array.rename(quantity)


def _mapped(strength: Callable[[Any], Any], heights: Array) -> Array:
    """Return strengths, Pa, from heights, m. Missing heights give NaN (step 2)."""
    values = as_numbers(strength(heights.copy()))
    if values.shape != heights.shape:
        shapes = f"got shape {values.shape} for {heights.shape}"
        raise InputError(f"strength: must return a strength for each height, {shapes}")
    values = np.where(np.isnan(heights), np.nan, values)
    check_positive(values, "strength")
    return values


def _in_order(array: Any) -> Any:
    """Return a profile with rising coordinates, and points on a plane as a map (step 3)."""
    if "row" in array.dims:
        array = array.set_index(row=["x", "y"])
    for index in array.indexes.values():
        if index.has_duplicates:
            twin = index[index.duplicated()]
            raise InputError(
                f"x repeats: there are two values at {twin[0]} m ({twin.size} such places). Keep"
                f" either, or pass skip= with the lines above the last record{OF_A_PLANE}"
            )
    array = array.unstack()
    return array.sortby([dim for dim in array.dims if dim in array.coords])


# -- profiles as arguments and in study files ----------------------------------------------------


def at_nodes(name: str, value: Any, interface: Interface, *, missing: bool = False) -> Any:
    """Return the values of a quantity at the nodes. With `missing`, some may be NaN.

    `name` may be a dotted key. Numbers, and arrays with a different
    shape, are returned unchanged, because the caller checks them.
    """
    quantity = quantity_of(name)
    with prefixed(name):
        if isinstance(value, ProfileFile):
            value = value.to_xarray(interface)
        value = simplified(value, quantity)
        if is_labelled(value):
            array = labelled(value, quantity, interface.dims)
            if array.ndim == 1 and not {*array.dims} <= {"x", "row"}:  # a value for each sample
                if quantity == "strength":
                    raise InputError(
                        "has no dimension along the interface. Name this dimension 'x'"
                    )
                return array.values[:, np.newaxis]
            array = place(array, interface)
            return array if missing else refuse_missing(array, interface)
        with suppress(TypeError):  # values that are no numbers are refused with other mistakes
            array = real_array(value)
            if array.shape[-len(interface.shape) :] == interface.shape:
                return array if missing else refuse_missing(array, interface)
    return value


class ProfileFile(NamedTuple):
    """A profile file named in a study file. It is read when the interface is known."""

    path: Path
    options: dict[str, Any]

    def to_xarray(self, interface: Interface | None = None) -> xr.DataArray:
        """Read the file, and place its values on an interface."""
        return read_profile(self.path, interface=interface, **self.options)


def profile_in_file(given: Any, field: str, folder: Path) -> Any:
    """Return the profile named in a study file by its path, or by `file` and reader options."""
    table = dict(given) if isinstance(given, Mapping) else {"file": given}
    if "file" not in table:
        return given
    path = folder / check("file", table.pop("file"), FilePath)
    reserved = sorted(table.keys() & {"source", "quantity", "interface"})
    if reserved:
        raise InputError(f"{reserved[0]}: is not an option in a study file")
    return ProfileFile(path, table | {"quantity": quantity_of(field)})


def quantity_of(key: str) -> str:
    """Return the quantity that the parameter with this name or dotted key holds."""
    field = key.rsplit(".", 1)[-1]
    return "load_profile" if field == "profile" else field


# -- profiles of samples -------------------------------------------------------------------------


def named_profiles(given: Any) -> dict[str, Any]:
    """Return profiles by name, from a mapping, a dataset or the strength alone.

    The strength may consist of friction coefficients. Their name or
    their unit shows this.
    """
    if hasattr(given, "marginal") or hasattr(given, "members"):
        raise InputError(
            f"profiles: must be numbers, got a {type(given).__name__}. Pass its sample(interface),"
            " or call st.monte_carlo"
        )
    if not isinstance(given, Mapping):  # a Dataset is one too
        return {"friction_coefficient" if is_coefficient(given) else "strength": given}
    known = (*PROFILES, "friction_coefficient")
    unknown = [
        unknown_name("profiles", str(name), known) for name in given if name not in known
    ]
    if "strength" in given and "friction_coefficient" in given:
        unknown.append("profiles: give either strength (Pa) or friction_coefficient (1)")
    if unknown and not hasattr(given, "data_vars"):
        raise InputError(unknown)
    profiles = {name: given[name] for name in given if name in known}
    if is_coefficient(profiles.get("strength")):
        profiles["friction_coefficient"] = profiles.pop("strength")
    return profiles


def placed_profiles(
    given: Mapping[str, Any], interface: Interface, pressing: Any
) -> tuple[dict[str, Array], list[str]]:
    """Return users' profiles by name as (samples, *shape), and the mistakes in them.

    A profile with a mistake is missing in the result. A pressure
    without values along the interface is a mean, which is multiplied by
    `pressing`.
    """
    first = "strength" if "strength" in given else "friction_coefficient"
    if first not in given:
        raise InputError("strength: missing among the profiles")
    rows: dict[str, Array] = {}
    scales = [name for name in SCALES if name in given]
    problems = [f"give one of {', '.join(SCALES)}, got {' and '.join(scales)}"] * (
        len(scales) > 1
    )
    samples = None
    for name in (first, *(name for name in given if name != first)):
        try:
            of_friction = name == "residual_strength" and is_coefficient(given[name])
            quantity = "friction_coefficient" if of_friction else name
            value = at_nodes(quantity, given[name], interface)
            with prefixed(name):
                rows[name] = rows_of(quantity, value, interface, samples)
            if name == "normal_pressure" and np.shape(value) in ((), (samples, 1)):
                rows[name] = rows[name] * pressing
        except InputError as error:
            problems += error.problems
        if name == first:
            samples = len(rows[first]) if first in rows else 1
    return rows, problems


def rows_of(name: str, value: Any, interface: Interface, samples: int | None) -> Array:
    """Return `value` as a (samples, *shape) float64 array, or raise an `InputError`.

    A single profile (*shape) counts as one sample. If `samples` is
    given, a number, a profile, or one number per sample with shape
    (samples, 1) is broadcast to (samples, *shape).
    """
    shape, array = interface.shape, as_numbers(value)
    valid = f"{shape} or ({samples or 'samples'}, {', '.join(map(str, shape))})"
    if samples is None:
        fits = array.size > 0 and shape in (array.shape, array.shape[1:])
    else:
        valid += f", ({samples}, 1) or a number"
        column = (samples, *(1 for _ in shape))
        array = array.reshape(column) if array.shape == (samples, 1) else array
        fits = array.shape in ((), shape, column, (samples, *shape))
    if not fits:
        hint = turned(array.shape[-2:], shape)
        raise InputError(f"must have shape {valid}, got shape {array.shape}{hint}")
    check_values(name, array, interface)
    if samples is None:
        return array.reshape(-1, *shape)
    return np.broadcast_to(array, (samples, *shape))


def check_values(name: str, array: Array, interface: Interface) -> None:
    """Raise an `InputError` if a value is impossible for the profile with this name.

    `array` is a number, a profile or rows of profiles.
    """
    least, greatest = array.min(), array.max()
    if not (least >= -LARGEST and greatest <= LARGEST):  # also NaN
        entry = tuple(np.argwhere(~(np.abs(array) <= LARGEST))[0].tolist())
        given = f"{array[entry]:g} (at most {LARGEST:g})"
        if name == "strength" and array[entry] == np.inf:
            given += ". Give interface.extent, beyond which nothing breaks, instead"
        raise InputError(f"must be finite. Entry {entry} is {given}")
    given = f"{least:g} {QUANTITIES[name].units}"
    if name in SCALES and least <= 0.0:
        raise InputError(f"must be positive, got {given}")
    if name == "friction_coefficient" and array.mean() >= FRICTION[1][1]:
        raise InputError(
            f"its mean is {array.mean():.3g}; if that is a strength, state its unit, as"
            " .assign_attrs(units='Pa') does"
        )
    if name == "residual_strength" and least < 0.0:
        raise InputError(f"must not be negative, got {given}")
    if name == "normal_pressure":
        means = np.atleast_1d(interface.mean(array) if array.ndim else array)
        if means.min() <= 0.0:
            worst = f"the mean of sample {int(np.argmin(means))} is {means.min():g} Pa"
            raise InputError(f"must be positive on average, but {worst}")
