"""The profiles of samples, and the steps from values in SI to a sample.

The nodes are x_i = i L/n in each direction. The interface
is periodic, so points may come in any order and begin
anywhere. On a specimen, the nodes are x_i = (i + 1/2)
L/n, and the profile stops at its ends. The steps are:

1. Put the values on the nodes (`on_nodes`). Find the common offset of
   the points from the nodes, as a fraction of the spacing, and warn
   about it. Number the node of each point. Refuse points that do not
   lie on nodes, and two different values at a node.
2. Check shape and values (`as_rows`): (samples, *shape), without gaps.
3. Check that each value is given once (`given_twice`).
4. Fill in what the problem gives, check that the profiles fit together,
   and return a `Sample` (`made`).

`own_sample` makes a sample from arrays that the package made itself.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from operator import attrgetter
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from stiction.base.arrays import Array
from stiction.base.errors import InputError, prefixed, warn_accuracy
from stiction.base.representation import Result, Row, Summary
from stiction.base.units import STRENGTHS
from stiction.base.variables import PROFILES, QUANTITIES
from stiction.problem.checks import FRICTION, contradictions_of, steepest_weakening_rate
from stiction.problem.friction import SCALES
from stiction.problem.interface import Interface
from stiction.problem.reading.labels import OF_A_PLANE
from stiction.problem.specimen import Slider

TOLERANCE = 0.02
"""Fraction of the spacing by which rounding in a file may move a point."""
LARGEST = 1e100
"""Largest value of a profile, in SI units.

Sums and products of larger values overflow.
"""
GIVE_PRESSURE = "Give load.normal_pressure (Pa) or load.pressing_force (N)"
REPLACED = {
    "residual_strength": ("friction.residual_strength", "friction.residual_ratio"),
    "initial_stress": ("load.initial_stress",),
    "normal_pressure": ("load.normal_pressure", "load.pressing_force"),
    **dict.fromkeys(SCALES, tuple(f"friction.{name}" for name in SCALES)),
}
"""Parameters that a profile, or a random property, of each name would
replace."""


class _Profiles(NamedTuple):
    """The profiles of a `Sample`."""

    strength: Array
    residual_strength: Array
    weakening_rate: Array
    initial_stress: Array
    load_profile: Array
    normal_pressure: Array
    problem: Any


class Sample(Result, _Profiles):
    """The profiles of one or more interfaces, from which every method starts.

    Attributes
    ----------
    strength, residual_strength, weakening_rate, initial_stress : (samples, *shape) arrays
        tau_p, tau_r (Pa), W at zero slip (Pa/m), tau_i (Pa). Do not
        write to these arrays. The strength is infinite beyond the
        extent of the interface. If a strength is not above the residual
        strength, both are set equal and W has no effect.
    load_profile : (*shape) array
        p, dimensionless, positive.
    normal_pressure : (samples, *shape) array
        In Pa, NaN if the problem has no pressure.
    problem : Problem
        The problem that made the sample. Other problems do not accept
        the sample.

    Examples
    --------
    >>> from types import SimpleNamespace
    >>> interface = SimpleNamespace(mean=lambda rows: rows[..., :2].mean(-1))
    >>> problem = SimpleNamespace(interface=interface, friction=SimpleNamespace(steepening=1.5))
    >>> strength = np.array([[5.0, 7.0, np.inf], [6.0, 9.0, np.inf]])
    >>> rates = np.array([[4.0, 4.0, 4.0], [8.0, 8.0, 8.0]])
    >>> initial = np.array([[1.0, 2.0, 9.0], [3.0, 5.0, 9.0]])
    >>> profile = np.array([0.5, 2.0, 0.5])
    >>> sample = Sample(strength, np.ones((2, 3)), rates, initial, profile, strength, problem)
    >>> sample.samples, sample.shape, sample.axes, sample.mean_strength
    (2, (3,), (-1,), 6.75)
    >>> sample.mean(strength).tolist(), sample.steepest_weakening_rate
    ([6.0, 7.5], 12.0)
    >>> sample.mean_stress(np.array([2.0, 4.0])).tolist()
    [4.0, 9.0]
    >>> part = sample.part(slice(1, 2))
    >>> part.strength.tolist(), part.load_profile.size, part.samples
    ([[6.0, 9.0, inf]], 3, 1)
    >>> sample.uniform_weakening, sample._replace(weakening_rate=rates.T[:2]).uniform_weakening
    (True, False)
    """

    def _summary(self) -> Summary:
        rows = []
        for name, values in self._asdict().items():
            if name in QUANTITIES and (known := values[np.isfinite(values)]).size:
                ends = float(np.min(known)), float(np.max(known))
                rows.append(Row(name, float(np.mean(known)), ends, QUANTITIES[name].units))
        nodes = " x ".join(map(str, self.shape))
        count = f"{self.samples} interface" + "s" * (self.samples != 1)
        return Summary(f"{count} of {nodes} nodes, means", rows, "range")

    @property
    def samples(self) -> int:
        """Number of samples."""
        return int(self.strength.shape[0])

    @property
    def shape(self) -> tuple[int, ...]:
        """Node count in each direction."""
        return self.load_profile.shape

    @property
    def axes(self) -> tuple[int, ...]:
        """Axes of the nodes, counted from the last."""
        return tuple(range(-self.load_profile.ndim, 0))

    def part(self, some: slice) -> Sample:
        """Return a selection of the samples."""
        profiles = {name: rows for name, rows in self._asdict().items() if name in PROFILES}
        return self._replace(**{name: rows[some] for name, rows in profiles.items()})

    @property
    def uniform_weakening(self) -> bool:
        """Whether W is the same at all nodes of each sample."""
        flat = self.weakening_rate.reshape(self.samples, -1)
        return bool(np.all(flat == flat[:, :1]))

    def mean(self, profiles: Array) -> Array:
        """Return the mean of each profile over the nodes that can break: (..., *shape) to (...)."""
        return np.asarray(self.problem.interface.mean(profiles))

    @property
    def mean_strength(self) -> float:
        """Mean of the finite strengths, Pa."""
        return float(self.strength.mean(where=np.isfinite(self.strength)))

    @property
    def steepest_weakening_rate(self) -> float:
        """Largest weakening rate at any slip, Pa/m, among nodes that may break."""
        first = steepest_weakening_rate(*self[:3])
        return first * float(self.problem.friction.steepening)

    def mean_stress(self, load: Array) -> Array:
        """Return <tau_i> + tau_0 <p>, Pa, at loads tau_0 with shape (samples,)."""
        return self.mean(self.initial_stress) + load * self.mean(self.load_profile)


class Placed(NamedTuple):
    """Values of a profile at the nodes. The quantity tells coefficients from stresses."""

    quantity: str
    values: Array


# -- 1. nodes --------------------------------------------------------------------------------------


def on_nodes(value: Any, quantity: str, interface: Interface) -> Placed:
    """Return a profile in SI at the nodes (..., *shape), with NaN at missing points.

    Values without coordinates keep their shape, and a value for each
    sample becomes a column.

    Points of a periodic line may have any order, and the end is its first
    node. Coefficients of friction are told from stresses:

    >>> import xarray as xr
    >>> line, x = Interface(4.0, 8), np.array([3.5, 0.499, 4.0, 1.001])
    >>> profile = xr.DataArray([1.0, 2.0, 3.0, 4.0], {"x": x}, ["x"], attrs={"units": "1"})
    >>> quantity, values = on_nodes(profile, "strength", line)
    >>> quantity, values.tolist(), on_nodes(profile, "height", line).quantity
    ('friction_coefficient', [3.0, 2.0, 4.0, nan, nan, nan, nan, 1.0], 'height')

    Nodes of a specimen lie in the middle of cells:

    >>> free = Interface(4.0, 8, ends="free")
    >>> on_nodes(profile.assign_coords(x=x - 0.25), "height", free).values.tolist()
    [2.0, 4.0, nan, nan, nan, nan, 1.0, 3.0]

    Places on a plane, two profiles, and a value for each sample:

    >>> plane = Interface((4.0, 16.0), (8, 8))
    >>> places = {"x": ("row", [0.0, 3.5, 0.5]), "y": ("row", [2.0, 14.0, 0.0])}
    >>> heights = xr.DataArray([5.0, 6.0, 7.0], places, ["row"])
    >>> values = on_nodes(heights, "height", plane).values
    >>> values.shape, float(values[0, 1]), float(values[7, 7]), float(values[1, 0])
    ((8, 8), 5.0, 6.0, 7.0)
    >>> two = xr.DataArray([[1.0, 2.0], [3.0, 4.0]], {"x": [0.5, 0.0]}, ["sample", "x"])
    >>> on_nodes(two, "strength", line).values[:, :3].tolist()
    [[2.0, 1.0, nan], [4.0, 3.0, nan]]
    >>> on_nodes(xr.DataArray([1.0, 2.0], dims="sample"), "strength", line).values.tolist()
    [[1.0], [2.0]]
    >>> on_nodes(xr.DataArray([1.0, 2.0], dims="x"), "strength", line).values.tolist()
    [1.0, 2.0]
    """
    if not hasattr(value, "dims"):
        return Placed(quantity, value)
    if quantity in STRENGTHS and value.attrs.get("units") == "1":
        quantity = "friction_coefficient"
    if value.ndim == 1 and not {*value.dims} <= {"x", "row"}:
        return Placed(quantity, value.values[:, np.newaxis])
    values, places = points_of(value)
    if not places:
        return Placed(quantity, values)
    if values.size == 0:
        raise InputError("has no values")
    offsets = [_offset(dim, places[dim], interface) for dim in interface.dims]
    steps = [
        np.round(places[dim] / h - interface.first - offset).astype(np.int64)
        for dim, h, offset in zip(interface.dims, interface.spacings, offsets, strict=True)
    ]
    if interface.is_free:
        flat, at = steps[0], places["x"]
        if not 0 <= flat.min() <= flat.max() < interface.size:
            raise InputError(
                f"x extends from {at.min():g} to {at.max():g} m, beyond a specimen of"
                f" {interface.measure:g} m. Crop the record or move its coordinates, as in"
                " profile.assign_coords(x=profile.x - profile.x.min())"
            )
    else:
        flat = np.ravel_multi_index(steps, interface.shape, mode="wrap")
        for dim, step, count in zip(interface.dims, steps, interface.shape, strict=True):
            if step.min() < 0 or step.max() > count:
                ends = f"{places[dim].min():g} to {places[dim].max():g} m"
                warn_accuracy(
                    f"{dim} extends from {ends}. It is taken modulo the length of the interface,"
                    " and results count from 0. Shift it to keep your positions"
                )
    node, first, twins = np.unique(flat, return_index=True, return_inverse=True)
    if node.size < flat.size:
        _check_repeats(values, places, first[twins], interface)
    full = np.full((*values.shape[:-1], interface.size), np.nan)
    full[..., node] = values[..., first]
    return Placed(quantity, full.reshape(*values.shape[:-1], *interface.shape))


def points_of(array: Any) -> tuple[Array, dict[str, Array]]:
    """Return values (..., points) and positions (m) by direction.

    Values without coordinates keep their shape, and their dictionary of
    positions is empty.

    >>> import xarray as xr
    >>> plane = xr.DataArray([[1, 2], [3, 4]], {"y": [5, 6], "x": [7, 8]}, ["y", "x"])
    >>> values, places = points_of(plane)
    >>> values.tolist(), {dim: x.tolist() for dim, x in places.items()}
    ([1, 3, 2, 4], {'x': [7, 7, 8, 8], 'y': [5, 6, 5, 6]})
    >>> points_of(xr.DataArray([[1], [2]], dims=["x", "y"]))
    (array([[1],
           [2]]), {})
    """
    dims = [dim for dim in ("x", "y") if dim in array.coords]
    if len(dims) == 2 and "row" not in array.dims:
        array = array.stack(row=dims, create_index=False)
    return array.values, {dim: array[dim].values for dim in dims}


def _offset(dim: str, x: Array, interface: Interface) -> float:
    """Return the offset of points from nodes over the spacing, within (-0.5, 0.5].

    >>> import warnings
    >>> def offset(x, **given):
    ...     with warnings.catch_warnings(record=True) as told:
    ...         warnings.simplefilter("always")
    ...         by = _offset("x", np.array(x), Interface(4.0, 8, **given))
    ...     return round(by, 9), [str(warning.message)[:25] for warning in told]
    >>> offset([0.0, 0.504, 1.0]), offset([2.005, 1.505, 2.505]), offset(np.linspace(0.0, 4.0, 9))
    ((0.002666667, []), (0.01, []), (0.0, []))
    >>> offset([0.1, 0.6]), offset([0.4, 0.9])
    ((0.2, ['x is offset by 0.2 of a s']), (-0.2, ['x is offset by -0.2 of a ']))
    >>> offset([0.25, 0.75])[0], offset([0.25, 0.75], ends="free")
    (0.5, (0.0, []))
    >>> offset([0.5, 1.0], ends="free")[0]
    -0.5

    The points may lie at neighbouring nodes, or at all nodes of a plane:

    >>> for x in ([0.0, 1.0, 2.0], [0.5], [0.0, 0.5, 1.02], [0.0, 0.5, 5.0]):
    ...     try:
    ...         offset(x)
    ...     except InputError as error:
    ...         print(str(error)[:33])
    the 3 points of x, from 0 to 2 m,
    the 1 points of x, from 0.5 to 0.
    the 3 points of x, from 0 to 1.02
    x extends from 0 to 5 m on an int
    >>> _offset("y", np.array([2.0, 6.0, 8.0]), Interface((4.0, 16.0), (8, 8)))
    0.0
    """
    axis = interface.dims.index(dim)
    spacing, length = interface.spacings[axis], interface.lengths[axis]
    formula, cells = f"{dim}_i = i L/n", ", as at the centres of cells"
    if interface.is_free:
        formula, cells = f"{dim}_i = (i + 1/2) L/n", ""
    at = np.unique(x) / spacing - interface.first
    if at[-1] - at[0] > interface.shape[axis] + TOLERANCE:
        period = np.ptp(x) + spacing * np.median(np.diff(at))  # both ends are not one place
        raise InputError(
            f"{dim} extends from {x.min():g} to {x.max():g} m on an interface of {length:g} m."
            f" Check the unit of {dim}, crop the record, or set interface.length to {period:.6g}"
        )
    first = at[0] - np.ceil(at[0] - 0.5 - TOLERANCE)
    if interface.is_free and first > 0.5 - 2.0 * TOLERANCE:
        first -= 1.0  # the node before would lie outside
    deviation = at - first - np.round(at - first)
    coarse = not interface.is_plane and (at.size < 2 or np.median(np.diff(at)) > 1.5)
    if coarse or np.abs(deviation).max() > TOLERANCE:
        advice = "" if interface.is_plane else ", as in profile.interp(x=problem.interface.x)"
        raise InputError(
            f"the {at.size} points of {dim}, from {x.min():.6g} to {x.max():.6g} m, do not coincide"
            f" with the {interface.shape[axis]} nodes {formula}, which are {spacing:.6g} m apart."
            f" Check the unit of {dim}, or give values at the nodes (interface.{dim}){advice}"
        )
    offset = float(first + deviation.mean())
    if abs(offset) > TOLERANCE:
        warn_accuracy(
            f"{dim} is offset by {offset:.2g} of a spacing from the nodes {formula}{cells}, where"
            f" values are used. Add {offset * spacing:+.4g} m to positions in the result"
        )
    return offset


def _check_repeats(
    values: Array, places: dict[str, Array], twins: NDArray[np.int64], interface: Interface
) -> None:
    """Refuse two different values at a place.

    `twins` are the first points at each place.

    >>> line, places = Interface(8.0, 8), {"x": np.array([0.0, 1.0, 8.0])}
    >>> twins = np.array([0, 1, 0])
    >>> _check_repeats(np.array([[2.0, 3.0, 2.0], [np.nan, 3.0, np.nan]]), places, twins, line)
    >>> for last in (4.0, np.nan):
    ...     try:
    ...         values = np.array([[2.0, 3.0, 2.0], [2.0, 3.0, last]])
    ...         _check_repeats(values, places, twins, line)
    ...     except InputError as error:
    ...         print(str(error)[:51])
    x = 0 and 8 m are the same position on an interface
    x = 0 and 8 m are the same position on an interface
    """
    rows = values.reshape(-1, twins.size)
    same = (rows == rows[:, twins]) | np.isnan(rows) & np.isnan(rows[:, twins])
    for i in np.flatnonzero(~same.all(axis=0))[:1]:
        where = ", ".join(
            f"{dim} = {x[twins[i]]:.9g} and {x[i]:.9g} m" for dim, x in places.items()
        )
        raise InputError(
            f"{where} are the same position on an interface of period {interface.length}"
            f" m. Keep either value{'' if interface.is_plane else OF_A_PLANE}"
        )


# -- 2. values -------------------------------------------------------------------------------------


def as_rows(placed: Placed, name: str, interface: Interface) -> Placed:
    """Return valid values of a profile as (1 or samples, *shape), (samples, 1) or a number.

    >>> line, plane = Interface(8.0, 8), Interface((8.0, 16.0), (8, 16))
    >>> def shape(name, *given, interface=line):
    ...     try:
    ...         return as_rows(Placed(name, np.ones(given)), name, interface).values.shape
    ...     except InputError as error:
    ...         return str(error).partition(", got")[0]
    >>> shape("strength", 8), shape("strength", 3, 8), shape("strength", 3, 8, 16, interface=plane)
    ((1, 8), (3, 8), (3, 8, 16))
    >>> shape("height", 3, 1), shape("height"), shape("height", 3, 1, interface=plane)
    ((3, 1), (), (3, 1, 1))
    >>> shape("strength", 3, 1), shape("friction_coefficient")
    ('must have shape (8,) or (samples, 8)', 'must have shape (8,) or (samples, 8)')
    >>> shape("height", 3, 7)
    'must have shape (8,), (samples, 8), (samples, 1) or a number'
    >>> shape("height", 7) == shape("height", 0, 8) == shape("height", 3, 7)
    True
    >>> gap = Placed("height", np.array([1.0] * 7 + [np.nan]))
    >>> as_rows(gap, "height", line)  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: ... at 1 of 8 nodes, the first at x = 7 m...
    """
    shape, values = interface.shape, placed.values
    first = name in ("strength", "friction_coefficient")
    column = values.ndim == 2 and values.shape[1] == 1
    if values.size and shape in (values.shape, values.shape[1:]):
        values = values.reshape(-1, *shape)
        if np.isnan(values).any():
            refuse_missing(values, interface)
    elif first or not values.size or not (column or values.ndim == 0):
        rows = f"(samples, {', '.join(map(str, shape))})"
        valid = f"{shape} or {rows}" if first else f"{shape}, {rows}, (samples, 1) or a number"
        hint = turned(values.shape[-2:], shape)
        if first and column:
            hint = ". If it runs along the interface, name its dimension 'x'"
        raise InputError(f"must have shape {valid}, got shape {values.shape}{hint}")
    elif column:
        values = values.reshape(-1, *(1 for _ in shape))
    check_values(placed.quantity, values, interface)
    return Placed(placed.quantity, values)


def turned(given: tuple[int, ...], shape: tuple[int, ...]) -> str:
    """Return a hint for the message about the shape of a plane, if its axes are swapped.

    >>> turned((16, 8), (8, 16))
    '. x and y are swapped: the first axis of a profile is x'
    >>> turned((8, 8), (8, 16)), turned((8,), (8,))
    ('', '')
    """
    if len(shape) == 2 and given == shape[::-1]:
        return ". x and y are swapped: the first axis of a profile is x"
    return ""


def refuse_missing(values: Array, interface: Interface) -> None:
    """Raise an `InputError` that names the first NaN among values (..., *shape).

    >>> values = np.zeros((3, 8))
    >>> values[1, [3, 6]] = np.nan
    >>> refuse_missing(values, Interface(8.0, 8))  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: ... at 2 of 8 nodes of sample 1, the first at x = 3 m...
    """
    rows = np.isnan(values).reshape(-1, *interface.shape)
    row = int(np.argmax(rows.any(axis=interface.axes)))
    raise InputError(
        f"values are missing (NaN) at {rows[row].sum()} of {interface.size} nodes"
        f"{f' of sample {row}' * (len(rows) > 1)}, the first at"
        f" {interface.describe_node(int(np.argmax(rows[row])))}. Set interface.length to"
        " the length of the record, or draw the missing values with RandomField.given(profile)"
    )


def check_values(name: str, array: Array, interface: Interface) -> None:
    """Raise an `InputError` if a value is impossible for the profile with this name.

    `array` is a number, a profile or rows of profiles.

    >>> def refusal(name, *values):
    ...     try:
    ...         return check_values(name, np.array(values), Interface(8.0, 8))
    ...     except InputError as error:
    ...         return str(error)[:41]
    >>> refusal("strength", -1e100, 1e100)
    >>> refusal("residual_strength", 0.0, 3.0)
    >>> refusal("strength", 1.0, -1.1e100), refusal("initial_stress", np.nan)
    ('must be finite. Entry (1,) is -1.1e+100 (', 'must be finite. Entry (0,) is nan (at mos')
    >>> refusal("critical_slip", 2.0, 0.0), refusal("residual_strength", 1.0, -0.5)
    ('must be positive, got 0 m', 'must not be negative, got -0.5 Pa')
    >>> refusal("friction_coefficient", 99.0, 100.0)
    >>> refusal("friction_coefficient", 99.0, 101.0)
    'its mean is 100. If it is a strength, use'
    >>> refusal("normal_pressure", [9.0] * 7 + [-62.0], [1.0] * 8)
    >>> refusal("normal_pressure", [1.0] * 8, [9.0] * 7 + [-63.0])
    'must be positive on average, but the mean'
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
            f"its mean is {array.mean():.3g}. If it is a strength, use .assign_attrs(units='Pa')"
        )
    if name == "residual_strength" and least < 0.0:
        raise InputError(f"must not be negative, got {given}")
    if name == "normal_pressure":
        means = np.atleast_1d(interface.mean(array) if array.ndim else array)
        if means.min() <= 0.0:
            worst = f"the mean of sample {int(np.argmin(means))} is {means.min():g} Pa"
            raise InputError(f"must be positive on average, but {worst}")


# -- 3. and 4. a sample ----------------------------------------------------------------------------


def given_twice(problem: Any, names: Collection[str], owner: str) -> list[str]:
    """Return messages about values that profiles or random properties would replace.

    There are also messages about values that are missing in both
    places. In the messages, `owner` precedes the names.

    >>> from types import SimpleNamespace
    >>> law = {"residual_strength": 0.0, "residual_ratio": None, **dict.fromkeys(SCALES)}
    >>> load = SimpleNamespace(initial_stress=np.array([0.0, 2.0]), normal_pressure=None)
    >>> load.pressing_force = 5.0
    >>> def messages(*names, pressure=None, scale=("critical_slip", 3.0), specimen=None):
    ...     friction = SimpleNamespace(**law, scale=scale)
    ...     problem = SimpleNamespace(friction=friction, load=load, given_pressure=pressure)
    ...     problem.specimen = specimen and SimpleNamespace(pressing=specimen)
    ...     return [text[:47].rsplit(" ", 1)[0] for text in given_twice(problem, names, "profiles")]
    >>> messages("strength", "residual_strength"), messages("initial_stress")
    ([], ['problem.load.initial_stress: has no effect'])
    >>> messages("normal_pressure", "strength")
    ['problem.load.pressing_force: has no effect']
    >>> messages("strength", scale=None), messages("fracture_energy", scale=None)
    (['problem.friction: give one of weakening_rate,'], [])
    >>> messages("friction_coefficient"), messages("friction_coefficient", pressure=3.0)
    (['friction_coefficient: needs a normal pressure.'], [])
    >>> messages(specimen="soft"), messages(specimen="glued", pressure=3.0)
    ([], [])
    >>> messages(specimen="glued")
    ["problem.specimen.pressing: 'glued' has no"]
    """
    twice = [
        f"problem.{key}: has no effect together with {owner}.{name}. Leave either out"
        for name in names
        for key in REPLACED.get(name, ())
        if (value := attrgetter(key)(problem)) is not None and np.any(value)
    ]
    if problem.friction.scale is None and not {*SCALES} & {*names}:
        twice.append(
            f"problem.friction: give one of {', '.join(SCALES)}, or {owner}.{SCALES[0]} and so"
            " on if it varies between samples"
        )
    pressed = problem.given_pressure is not None or "normal_pressure" in names
    if "friction_coefficient" in names and not pressed:
        twice.append(f"friction_coefficient: needs a normal pressure. {GIVE_PRESSURE}")
    if problem.specimen is not None and problem.specimen.pressing == "glued" and not pressed:
        text = "'glued' has no effect without a normal pressure"
        twice.append(f"problem.specimen.pressing: {text}. {GIVE_PRESSURE}")
    return twice


def pressing_of(problem: Any) -> Any:
    """Return the pressure at the nodes over the given pressure: 1, or (nodes,) if glued.

    >>> from types import SimpleNamespace
    >>> blocks = SimpleNamespace(pressure="profile")
    >>> for specimen in None, *[SimpleNamespace(pressing=how) for how in ("soft", "glued")]:
    ...     print(pressing_of(SimpleNamespace(specimen=specimen, blocks=blocks)))
    1.0
    1.0
    profile
    """
    glued = problem.specimen is not None and problem.specimen.pressing == "glued"
    return problem.blocks.pressure if glued else 1.0


def constants_of(problem: Any, strength: Any) -> dict[str, Any]:
    """Return, by name, values for profiles that are not given, or None without a value.

    >>> from types import SimpleNamespace
    >>> friction = SimpleNamespace(residual=lambda peak: 0.5 * peak, scale=("critical_slip", 3.0))
    >>> load = SimpleNamespace(initial_stress=2.0)
    >>> problem = SimpleNamespace(friction=friction, load=load, normal_pressure=7.0)
    >>> [*constants_of(problem, 8.0).values()]
    [4.0, 2.0, 3.0, 7.0]
    >>> friction.scale = None
    >>> [*constants_of(problem, 8.0)]
    ['residual_strength', 'initial_stress', 'normal_pressure']
    """
    return {
        "residual_strength": problem.friction.residual(strength),
        "initial_stress": problem.load.initial_stress,
        **dict([problem.friction.scale] if problem.friction.scale else []),
        "normal_pressure": problem.normal_pressure,
    }


def own_sample(
    problem: Any, profiles: Mapping[str, Array], accept: Collection[str] = ()
) -> Sample:
    """Return a sample from arrays in SI units, by name, that the package made.

    Only values are checked here, because some samples may not fit
    the problem. The caller checks the resolution, and the nodes
    that do not weaken, for all samples together.

    >>> import stiction as st
    >>> law = st.LinearWeakening(critical_slip=2.0)
    >>> problem = st.Problem(st.Solid(1e9, 0.25, 1200.0), st.Interface(8.0, 8), law)
    >>> own_sample(problem, {"strength": np.full((2, 8), 3.0)}).weakening_rate[:, 0].tolist()
    [1.5, 1.5]
    >>> own_sample(problem, {"strength": np.full((2, 8), np.inf)})  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: strength: must be finite. Entry (0, 0) is inf ...
    """
    for name, rows in profiles.items():
        with prefixed(name):
            check_values(name, rows, problem.interface)
    return made(problem, profiles, accept)


def made(problem: Any, profiles: Mapping[str, Array], accept: Collection[str]) -> Sample:
    """Return a sample from arrays with valid values, if they fit together.

    Profiles that are not given come from the problem.

    The critical slip of the problem gives W = (tau_p - tau_r)/d_c. A node
    that does not weaken takes the slowest rate, and its residual strength
    is its strength:

    >>> import stiction as st
    >>> def sample(extent=None, accept=(), initial=0.0, **profiles):
    ...     problem = st.Problem(
    ...         st.Solid(1e9, 0.25, 1200.0), st.Interface(8.0, 8, extent=extent),
    ...         st.LinearWeakening(critical_slip=2.0, residual_strength=3.0),
    ...         st.Load(initial_stress=initial),
    ...     )
    ...     return made(problem, profiles, accept)
    >>> strength = np.array([[9.0, 2.0, 7.0, 5.0, 4.0, 9.0, 9.0, 9.0]])
    >>> result = sample(strength=strength)
    >>> result.weakening_rate.tolist()
    [[3.0, 0.5, 2.0, 1.0, 0.5, 3.0, 3.0, 3.0]]
    >>> result.residual_strength[0, :3].tolist(), result.strength[0, :3].tolist()
    ([3.0, 2.0, 3.0], [9.0, 2.0, 7.0])
    >>> result.normal_pressure[0, :2].tolist(), result.initial_stress.shape
    ([nan, nan], (1, 8))

    A profile precedes the problem. Nodes beyond the extent have an infinite
    strength and the fastest rate:

    >>> given = {"weakening_rate": np.array([[7.0]]), "residual_strength": np.array([[1.0]])}
    >>> result = sample(strength=strength, **given)
    >>> result.weakening_rate[0, ::3].tolist(), result.residual_strength[0, :2].tolist()
    ([7.0, 7.0, 7.0], [1.0, 1.0])
    >>> result = sample((2.0, 4.0), strength=strength)
    >>> result.strength.tolist(), result.weakening_rate[0].tolist()
    ([[inf, inf, 7.0, 5.0, 4.0, inf, inf, inf]], [2.0, 2.0, 2.0, 1.0, 0.5, 2.0, 2.0, 2.0])
    >>> result = sample(strength=strength, accept={"overstress"}, initial=8.0)
    >>> result.initial_stress[0, 6:].tolist()
    [8.0, 8.0]
    """
    interface, strength = problem.interface, profiles["strength"]
    constants = constants_of(problem, strength)
    # A given profile replaces the value in the problem, so its
    # scale comes first.
    scale = next(name for name in (*profiles, *constants) if name in SCALES)
    known = constants | dict(profiles)
    if known["normal_pressure"] is None:
        known["normal_pressure"] = np.nan
    residual, initial, value, pressure = (
        np.broadcast_to(known[name], strength.shape)
        for name in ("residual_strength", "initial_stress", scale, "normal_pressure")
    )
    # Nodes beyond the extent never break.
    if interface.is_held:
        strength = np.where(interface.breakable, strength, np.inf)
    drop = strength - residual
    if isinstance(problem.specimen, Slider):
        drop = drop * problem.specimen.checked_pressing(
            problem.rig, interface.measure, strength / pressure, residual / pressure
        )
    W = problem.friction.weakening_rate_of(drop, scale, value)
    if interface.is_held and scale != "weakening_rate":
        # Barriers never weaken. Any finite rate will do, and here
        # it is the fastest.
        can_break = interface.breakable
        fastest = np.where(can_break, W, 0.0).max(interface.axes, keepdims=True)
        W = np.where(can_break, W, fastest)
    overstress = "overstress" in accept
    if problems := contradictions_of(interface, strength, residual, initial, overstress):
        raise InputError(problems)
    constant = strength <= residual
    if constant.any():
        # Residual from the start, tau_r = tau_p: then d_c = 0, and
        # W is of no consequence.
        residual = np.minimum(residual, strength)
        slowest = np.min(W, axis=interface.axes, where=~constant, initial=np.inf, keepdims=True)
        W = np.where(constant, slowest, W)
    if initial.min() < 0.0 and (reversed_at := initial < -strength).any():
        warn_accuracy(
            f"initial_stress is below minus the strength at {100.0 * reversed_at.mean():.3g} %"
            " of the nodes. Reverse slip is not modelled, so these nodes are held"
        )
    load_profile = np.array(np.broadcast_to(problem.load_profile, interface.shape), dtype=float)
    return Sample(strength, residual, W, initial, load_profile, pressure, problem)


def accepted_again(problem: Any, sample: Sample, accept: Collection[str]) -> Sample:
    """Return a given `Sample`, or refuse a sample that another problem made.

    >>> from types import SimpleNamespace
    >>> problem = SimpleNamespace(interface=Interface(8.0, 8))
    >>> sample = SimpleNamespace(problem=problem, initial_stress=np.full((1, 8), 5.0))
    >>> sample.strength, sample.residual_strength = np.full((1, 8), 5.0), np.full((1, 8), 2.0)
    >>> accepted_again(problem, sample, {"overstress"}) is sample
    True
    >>> for owner in (problem, SimpleNamespace()):
    ...     try:
    ...         accepted_again(owner, sample, ())
    ...     except InputError as error:
    ...         print(str(error)[:48])
    strength: must be above initial_stress. At x = 0
    profiles: the sample belongs to another problem.
    """
    if sample.problem != problem:
        raise InputError("profiles: the sample belongs to another problem. Call problem.sample")
    profiles = sample.strength, sample.residual_strength, sample.initial_stress
    if problems := contradictions_of(problem.interface, *profiles, "overstress" in accept):
        raise InputError(problems)
    return sample
