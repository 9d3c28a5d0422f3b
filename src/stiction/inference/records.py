"""Records: measured values with gaps, at equal distances on a line or a plane.

Problem. Profiles come as arrays, labelled data or lists
of points. Some have gaps, rounded coordinates, outliers
or dropouts. Return values on a regular grid, and refuse
records from which no spectrum can be estimated.

Source. The test for white noise follows Box and Pierce (1970), Journal
of the American Statistical Association 65, 1509, with a sum in place of
a sum of squares.

Steps:

1. Find the spacing of the points: a common divisor of the distances
   between neighbours, which the printed digits may have rounded.
2. Place the values on a regular grid. Missing points are NaN.
3. Refuse short, constant and infinite records. Warn about lengths that
   are probably in another unit. Warn about outliers,
   which are far from the median, and about dropouts, which are far from
   both neighbours.
4. Refuse records of white noise (`refuse_uncorrelated`).
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from stiction.base.arrays import Array
from stiction.base.errors import InputError, prefixed, warn_accuracy
from stiction.base.units import Doubt, check_measured, doubt_units, profile_in_si
from stiction.base.variables import QUANTITIES
from stiction.inference.window import RecordWindow
from stiction.problem.interface import Interface
from stiction.problem.reading.labels import named
from stiction.problem.sample import points_of

MIN_RECORD_POINTS = 64
"""Fewest measured points from which a spectrum can be estimated."""
NARROWEST = 8
"""Fewest points in each direction."""
UNEVEN = 0.02
"""Fraction of a spacing by which rounding in a file may move a point."""
OUTLYING = 8.0
"""Distance of an outlier from the median, in robust standard deviations."""
CORRELATED = 2.5
"""Standard deviations by which neighbours must be more correlated than
white noise."""
USUAL_LENGTH = (1e-5, 1e3)
"""Range of the length of a record, m, outside which its unit is doubted."""
JUMPING = 10.0
"""Difference of a dropout from its neighbours, in robust standard
deviations of differences."""


class Record(NamedTuple):
    """Values (SI) with shape (n,) or (nx, ny), at points `spacings` (m) apart.

    Gaps are NaN.
    """

    values: Array
    spacings: tuple[float, ...]


def records_of(profiles: Any, interface: Interface | None, quantity: str) -> list[Record]:
    """Return all profiles as records.

    See `stiction.fit_field`. Errors name the profile.

    A list holds profiles, unless its members are numbers:

    >>> from stiction import Interface
    >>> interface = Interface(0.064, 64)
    >>> rng = np.random.default_rng(0)
    >>> first, second = 1e6 + 1e5 * rng.standard_normal((2, 64))
    >>> records = records_of((first, second), interface, "strength")
    >>> [record.values.tolist() == row.tolist() for record, row in zip(records, (first, second))]
    [True, True]
    >>> len(records_of(first.tolist(), interface, "strength"))
    1
    >>> records_of([first, first[:32]], interface, "strength")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: profiles[1]: must have shape (64,) or (samples, 64), ...
    >>> records_of([], interface, "strength")
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: profiles: must not be empty

    A repeated profile causes a warning:

    >>> import warnings
    >>> with warnings.catch_warnings(record=True) as caught:
    ...     warnings.simplefilter("always")
    ...     _ = records_of(np.stack([first, second, first]), interface, "strength")
    >>> str(caught[0].message)[:54]
    '1 of 3 profiles repeat another profile, value by value'
    """
    several = isinstance(profiles, list | tuple)
    several = several and not (profiles and all(map(_is_scalar, profiles)))
    records: list[Record] = []
    problems: list[str] = []
    for number, profile in enumerate(profiles if several else [profiles]):
        try:
            with prefixed(f"profiles[{number}]" if several else "profiles"):
                made = _records(profile, interface, quantity)
                records += [_checked(record, quantity) for record in made]
        except InputError as error:
            problems += error.problems
    if not records and not problems:
        problems.append("profiles: must not be empty")
    if len({record.values.ndim for record in records}) > 1:
        problems.append("profiles: lines and planes are mixed. Fit them in separate calls")
    if problems:
        raise InputError(problems)
    _doubt_lengths(records)
    if (again := len(records) - len({one.values.tobytes() for one in records})) > 0:
        warn_accuracy(
            f"{again} of {len(records)} profiles repeat another profile, value by value, which"
            " makes intervals too narrow. Leave out the repeated profiles"
        )
    return records


def _doubt_lengths(records: Sequence[Record]) -> None:
    """Warn about the first record whose length is probably in another unit than m.

    The longest side counts. Only the first doubtful record is named:

    >>> import warnings
    >>> with warnings.catch_warnings(record=True) as caught:
    ...     warnings.simplefilter("always")
    ...     _doubt_lengths([Record(np.zeros((10, 20)), (5.0, 60.0)),
    ...                     Record(np.zeros(500), (3.0,)), Record(np.zeros(600), (3.0,))])
    >>> [str(warning.message)[:33] for warning in caught]
    ['profiles: a record is 1.2e+03 m l']
    """
    for record in records:
        length = max(n * h for n, h in zip(record.values.shape, record.spacings, strict=True))
        text = f"profiles: a record is {length:.3g} m long. Check the unit of x and y (m)"
        if doubt_units([Doubt(text, length, USUAL_LENGTH)]):
            return


def _is_scalar(value: Any) -> bool:
    """Return whether a value is a number, None, or a quantity with a single number.

    >>> [_is_scalar(value) for value in (3, 2.5, None, np.float64(3.0), np.array(3.0))]
    [True, True, True, True, True]
    >>> [_is_scalar(value) for value in ("3", [3], (3,), np.array([3.0]))]
    [False, False, False, False]
    """
    return not isinstance(value, list | tuple | str) and getattr(value, "shape", ()) == ()


def _records(source: Any, interface: Interface | None, quantity: str) -> list[Record]:
    """Points come in any order, and a missing point is NaN. Samples are rows:

    >>> import xarray as xr
    >>> at = xr.DataArray([3.0, 5.0, 1.0, 7.0], {"x": [0.03, 0.01, 0.02, 0.05]}, "x")
    >>> (record,) = _records(at, None, "slip")
    >>> record.values.tolist(), np.round(record.spacings, 9).tolist()
    ([5.0, 1.0, 3.0, nan, 7.0], [0.01])
    >>> both = xr.concat([at, 2.0 * at], "sample")
    >>> [record.values.tolist() for record in _records(both, None, "slip")]
    [[5.0, 1.0, 3.0, nan, 7.0], [10.0, 2.0, 6.0, nan, 14.0]]

    Points on a plane, in steps of 2 mm along x and of 5 mm along y:

    >>> import pandas
    >>> points = pandas.DataFrame({
    ...     "x (mm)": [0, 4, 2, 0], "y (mm)": [5, 0, 5, 0], "slip (m)": [3.0, 5.0, 1.0, 2.0]})
    >>> (record,) = _records(points, None, "slip")
    >>> record.values.tolist(), np.round(record.spacings, 9).tolist()
    ([[2.0, 3.0], [nan, 1.0], [5.0, nan]], [0.002, 0.005])
    >>> _records(pandas.concat([points, points[1:2]]), None, "slip")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: x and y repeat: a place of the map has two values. ...
    """
    units = (QUANTITIES[quantity].units,)
    values: Any = profile_in_si(named(source, quantity), quantity, units)
    places: dict[str, Array] = {}
    if hasattr(values, "dims"):
        values, places = points_of(values)
    if not places:
        return _of_array(values, interface)
    # 1. and 2. Points in any order, and missing points, find their
    # places on a grid.
    index, spacings = [], []
    for dim, at in places.items():
        spacing = _spacing(np.sort(at) if len(places) == 1 else np.unique(at), dim)
        index.append(np.round((at - at.min()) / spacing).astype(np.int64))
        spacings.append(spacing)
    shape = [number.max() + 1 for number in index]
    if np.unique(np.ravel_multi_index(index, shape)).size < index[0].size:
        raise InputError("x and y repeat: a place of the map has two values. Keep only one")
    rows = values.reshape(-1, values.shape[-1])
    full = np.full((rows.shape[0], *shape), np.nan)
    full[(slice(None), *index)] = rows
    return [Record(one, tuple(spacings)) for one in full]


def _of_array(array: Array, interface: Interface | None) -> list[Record]:
    """Return records from values (*shape) or (samples, *shape) at the nodes of an interface.

    >>> plane = Interface((0.3, 0.2), (10, 8))
    >>> values = np.arange(160.0).reshape(2, 10, 8)
    >>> second = _of_array(values, plane)[1]
    >>> float(second.values[3, 2]), np.round(second.spacings, 9).tolist()
    (106.0, [0.03, 0.025])
    >>> len(_of_array(values[0], plane)), _of_array(np.arange(8.0), Interface(0.4, 8))[0].spacings
    (1, (0.05,))
    >>> _of_array(values[:, :2], plane)
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: must have shape (10, 8) or (samples, 10, 8), got (2, 2, 8)
    >>> _of_array(values, None)  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: an array has no spacing. Give interface=, or ...
    """
    if interface is None:
        raise InputError("an array has no spacing. Give interface=, or a DataArray over x (m)")
    shape = interface.shape
    if shape not in (array.shape, array.shape[1:]):
        samples = f"(samples, {', '.join(map(str, shape))})"
        raise InputError(f"must have shape {shape} or {samples}, got {array.shape}")
    return [Record(row, interface.spacings) for row in array.reshape(-1, *shape)]


def _spacing(x: Array, name: str) -> float:
    """Return the distance (m) between equidistant points in order, or raise an error (step 1).

    A missing point and rounded digits do no harm. Thirds, printed with two
    digits, are a spacing of 1/3:

    >>> _spacing(np.array([0.5, 0.7, 0.9, 1.3]), "x").__round__(9)
    0.2
    >>> _spacing(np.array([0.0, 0.33, 0.67, 1.0, 1.33, 2.0]), "x").__round__(9)
    0.333333333
    >>> _spacing(np.array([0.0, 1.0, 2.0, 3.1, 4.0, 5.0]), "x")  # a single point is a little off
    1.0
    >>> for x in ([0.0, 1.0, 1.0, 2.0], [0.0, 1.0, 2.0, 3.3, 4.0], [0.0, 1.04, 2.05, 3.04, 4.0],
    ...           [2.0], [0.0, np.inf]):
    ...     try:
    ...         _spacing(np.array(x), "y")
    ...     except InputError as error:
    ...         print(str(error).split(". ")[0])
    y repeats: there are two values at 1 m
    y is not equally spaced at 3.3 m
    y is not equally spaced at 2.05 m
    y: must be finite and have more than one point
    y: must be finite and have more than one point
    """
    if not np.all(np.isfinite(x)) or x.size < 2:
        raise InputError(f"{name}: must be finite and have more than one point")
    steps = np.diff(x)
    spacing = float(np.median(steps))
    if not steps.min() > 1e-6 * spacing:
        raise InputError(f"{name} repeats: there are two values at {x[steps.argmin()]:.9g} m")
    # Each step is a whole number of spacings, although few printed
    # digits make it uneven.
    spacing = float((x[-1] - x[0]) / np.maximum(np.round(steps / spacing), 1.0).sum())
    place = (x - x[0]) / spacing
    off = np.abs(place - np.round(place))
    uneven = off.max() > 10.0 * UNEVEN or np.median(off) > UNEVEN
    if uneven or np.diff(np.round(place)).min() < 1:
        raise InputError(
            f"{name} is not equally spaced at {x[off.argmax()]:.6g} m. First interpolate, as in"
            " profile.interp(x=np.linspace(...))"
        )
    return spacing


def _checked(record: Record, quantity: str) -> Record:
    """Refuse a record that cannot be fitted, and warn about outliers (step 3).

    >>> def check(values, shape=-1):
    ...     import warnings
    ...     with warnings.catch_warnings(record=True) as caught:
    ...         warnings.simplefilter("always")
    ...         try:
    ...             _checked(Record(np.reshape(values, shape), (1.0, 1.0)), "slip")
    ...         except InputError as error:
    ...             return str(error)[:38]
    ...     return [str(warning.message)[:38] for warning in caught]
    >>> check([*range(63), 63]), check([*range(63), np.nan]), check([*range(63), np.inf])
    ([], 'holds 63 measured points, too few for ', 'must be finite, but entry 63 is not')
    >>> check(range(64), (8, 8)), check(range(70), (10, 7)), check([7.0] * 70)
    ([], 'holds 70 measured points, too few for ', 'is constant (7). A fit needs values th')

    Values 1, 2 and 3 have the median 2 and the median deviation 1. An outlier
    is farther than 8 x 1.4826 = 11.9 from the median:

    >>> even = np.arange(99.0) % 3 + 1
    >>> check([*even, 13.8]), check([*even, 13.9, 14.5])
    ([], ['2 of 101 values are outliers, such as '])
    >>> check([*np.cumsum(even[:80]), 7.0, *(np.cumsum(even[:80]) + 160.0)])  # a dropout
    ['1 of 161 values differ from their neig']
    >>> check([*even, 0.0, *[2.0] * 150])  # the median deviation is zero
    []
    """
    values = record.values[~np.isnan(record.values)]
    if np.isinf(values).any():
        first = int(np.argmax(np.isinf(record.values.ravel())))
        raise InputError(f"must be finite, but entry {first} is not")
    if values.size < MIN_RECORD_POINTS or min(record.values.shape) < NARROWEST:
        raise InputError(
            f"holds {values.size} measured points, too few for a spectrum. A fit needs"
            f" {MIN_RECORD_POINTS} points, {NARROWEST} along each axis, and ten correlation lengths"
        )
    if np.ptp(values) <= 1e-12 * np.abs(values).max():
        raise InputError(f"is constant ({values[0]:g}). A fit needs values that vary")
    check_measured(record.values, quantity, doubted=False)
    # The median absolute deviation of a normal sample is its deviation
    # over 1.4826.
    aside = np.abs(values - np.median(values))
    far = aside > OUTLYING * 1.4826 * np.median(aside)
    if np.median(aside) > 0.0 and far.any():
        warn_accuracy(
            f"{int(far.sum())} of {values.size} values are outliers, such as"
            f" {values[aside.argmax()]:.4g}. Set errors of measurement to NaN to leave them out"
        )
    else:
        _doubt_jumps(record)
    return record


def refuse_uncorrelated(windows: Sequence[RecordWindow], rows: Sequence[Array]) -> None:
    """Refuse records of white noise, whose correlation length is shorter than the spacing.

    Take the sum of products v_i v_(i+j) over all lags j up to k,
    divided by the variance. For white noise it has mean 0, and a
    variance equal to the number of products. The test takes k = 1, 2,
    4, ..., and pools records and directions (step 4).

    A sawtooth with a period of 16 points is correlated, and white noise is
    not. Records are pooled:

    >>> window = RecordWindow((1.0,), np.ones(64, dtype=bool))
    >>> row, white = np.arange(64.0) % 16, np.random.default_rng(1).standard_normal((9, 64))
    >>> refuse_uncorrelated([window], [row])
    >>> refuse_uncorrelated([window] * 9, 9.0 + white)  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: profiles: neighbouring points are not correlated: ...

    At lag 1, three records have 3 x 63 pairs, whose products sum to 3 (63 v²)
    if the values alternate between v and -v:

    >>> refuse_uncorrelated([window] * 3, [(-1.0) ** np.arange(64)] * 3)  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: profiles: ... are not correlated: -1 +- 0.073. ...

    On a plane, a correlation along the second direction alone is enough:

    >>> plane = RecordWindow((1.0, 1.0), np.ones((24, 24), dtype=bool))
    >>> signs = np.random.default_rng(1).choice([-1.0, 1.0], 24)
    >>> refuse_uncorrelated([plane], [np.repeat(signs, 24)])
    """
    lags = 2 ** np.arange(max(int(np.log2(max(windows[0].measured.shape) / 4)), 1))
    # A short correlation length shows at few lags, and a long length at
    # many.
    sums, counts = np.zeros(lags[-1]), np.zeros(lags[-1])
    for window, row in zip(windows, rows, strict=True):
        products = window.products((row - row.mean()) / row.std())
        for axis, size in enumerate(window.shape):
            last = min(lags[-1], size // 4)
            along = tuple(slice(1, last + 1) if axis == k else 0 for k in range(products.ndim))
            sums[:last] += products[along]
            counts[:last] += window.pairs[along]
    scores = np.cumsum(sums) / np.sqrt(np.maximum(np.cumsum(counts), 1.0))
    if scores[lags - 1].max() < CORRELATED:
        raise InputError(
            f"profiles: neighbouring points are not correlated: {sums[0] / counts[0]:.2g} +-"
            f" {counts[0] ** -0.5:.2g}. Measure at a smaller spacing or with less noise"
        )


def _doubt_jumps(record: Record) -> None:
    """Warn about values that differ from both neighbours much more than usual (step 3).

    A dropout in a smooth record is far from its neighbours, but may be
    near the median.

    In a parabola all differences from the mean of both neighbours are equal.
    A value that is too low by 11 differences counts once, and not its
    neighbours:

    >>> import warnings
    >>> def doubt(*changes, shape=(30,)):
    ...     values = 3.0 * np.arange(30.0) ** 2
    ...     for entry, change in changes:
    ...         values[entry] += change
    ...     with warnings.catch_warnings(record=True) as caught:
    ...         warnings.simplefilter("always")
    ...         _doubt_jumps(Record(values.reshape(shape), (1.0,) * len(shape)))
    ...     return [str(warning.message).partition(". Set")[0] for warning in caught]
    >>> doubt(), doubt((12, 47.0))  # 47 - 3 < 10 x 1.4826 x 3
    ([], [])
    >>> doubt((12, 48.0), (20, 700.0))
    ['2 of 30 values differ from their neighbours far more than usual, such as 1900']
    >>> doubt((12, np.nan), (20, 48.0), shape=(30, 1))
    ['1 of 30 values differ from their neighbours far more than usual, such as 1248']
    """
    middle = record.values[1:-1]
    jumps = middle - 0.5 * (record.values[:-2] + record.values[2:])
    known = jumps[np.isfinite(jumps)]
    scale = 1.4826 * np.median(np.abs(known)) if known.size else 0.0
    size = np.pad(np.nan_to_num(np.abs(jumps)), [(1, 1)] + [(0, 0)] * (jumps.ndim - 1))
    # A dropout makes its neighbours jump half as far.
    far = (size[1:-1] > JUMPING * scale) & (size[1:-1] >= np.maximum(size[:-2], size[2:]))
    size = size[1:-1]
    if scale > 0.0 and far.any():
        entry = int(np.argmax(size))
        warn_accuracy(
            f"{int(far.sum())} of {record.values.size} values differ from their neighbours far more"
            f" than usual, such as {middle.flat[entry]:.4g}. Set dropouts to NaN to leave them out"
        )
