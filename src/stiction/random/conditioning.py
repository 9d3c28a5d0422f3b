"""Condition the draws of a field on values measured at some places.

Problem
-------
A Gaussian field is a linear function of its draws, z(x) = phi(x)'a with
standard normal a. The property is v(x) = F^-1(Phi(z(x))) with the
marginal F. Values v_k were measured at places x_k, with normal errors
of standard deviation `noise`. With phi_k = phi(x_k), the posterior for
the draws has a density proportional to

    N(a) prod_k l_k(phi_k'a),   log l_k(z) = -(v_k - F^-1(Phi(z)))^2 / (2 noise^2).           (1)

If every l_k is replaced by a Gaussian exp(b_k z - p_k z^2/2), whose
precision p_k may be negative, this is a linear regression. The
posterior of the draws is then normal, with

    covariance P = (1 + sum_k p_k phi_k phi_k')^-1,   mean mu = P sum_k b_k phi_k.            (2)

With the symmetric root, mu + P^(1/2) a turns the usual draws into
conditioned draws. Their distribution is the same as with Matheron's
rule (A. G. Journel and C. J. Huijbregts, Mining Geostatistics, 1978).
The caller only replaces the draws.

Algorithm (`conditioned`)
-------------------------
The method is expectation propagation (T. P. Minka, Uncertainty in
Artificial Intelligence 17, 2001), followed by an estimate of the
skewness that Gaussians miss:

1. Begin with z ~ N(0, 1) at every place,
   as if no other value had been measured.
2. Replace each l_k by a Gaussian. Choose it so that the product with
   the normal distribution of z_k given all other values keeps its mean
   and variance (`Measured.gaussian`, by quadrature).
3. Find the regression (2) from a singular value decomposition
   (`_regression`). With the rows |p_k|^(1/2) phi_k' = U s V' and
   positive p_k, P^(1/2) = 1 + V ((1 + s^2)^(-1/2) - 1) V' is well
   conditioned even if a smooth field was measured densely. If some p_k
   are negative, V is turned so that P is diagonal in it, and s^2 are
   the eigenvalues of P^-1 - 1, which may be negative.
4. Remove the Gaussian of each place from the posterior. The result,
   called the cavity, is the mean and variance of z_k given all other
   values (`_from_others`).
5. Repeat from step 2 until these means no longer change, at most
   `MAX_UPDATES` times.
6. Estimate the error of the Gaussian approximation, for a warning
   (`_estimate_error`): weight samples of (2) by the density (1), and
   compare weighted and plain moments of z.
7. Compare the misfit of values and draws at the mean with chi-square,
   for a warning.

The algorithm departs from Minka in three points. All places are updated
at once. If the Gaussians have no posterior (P is not positive
definite), b and p are reduced by a common factor. In step 4 each place
keeps at least half the precision that it has without measurements.
"""

from collections.abc import Iterator
from functools import lru_cache
from typing import Annotated, Any, NamedTuple

import numpy as np
import pydantic
from numpy.typing import NDArray
from pydantic import BeforeValidator, PlainSerializer
from scipy.linalg import eigh, svd
from scipy.special import ndtri

from stiction.base.arrays import Array
from stiction.base.errors import InputError, warn_accuracy
from stiction.base.model import Positive, check_memory, model
from stiction.base.units import in_si, is_in, stated_unit
from stiction.base.variables import QUANTITIES
from stiction.problem.interface import Interface
from stiction.random.mapping import from_normal
from stiction.random.synthesis import layout

# Limits of errors and warnings
MAX_CHI_SQUARE = 5.0  # of suitable values, in standard deviations above its mean
MAX_POSTERIOR_ERROR = 0.1  # standard deviations of z by which a posterior may be off
MAX_ERRORS_OUTSIDE = 4.0  # errors by which a measured value may lie beyond a bound

# Quadrature of step 2
MAX_Z = 37.0  # largest z whose tail of the normal distribution is a float
HALF_WIDTH = 8.0  # half a range, in standard deviations
RANGE_NODES = 49  # across a range
MAX_NARROWINGS = 10  # of a range around a peak, each to two of its intervals at least
MIN_HALF_RANGE = 1e-12
LOG_OF_IMPOSSIBLE = -1e9  # lowest logarithm of a likelihood

# Regression and rounds, in units of z
MAX_UPDATES = 8
SETTLED_MEAN = 1e-3  # change of the means of step 4 that ends the updates
MIN_SINGULAR_VALUE = 1e-8  # directions with a smaller value keep their draws
MIN_SCALE = 1e-10  # smallest |p_k| that scales a row
MIN_PIVOT = 1e-12  # round-off of eigenvalues of a correlation matrix
MIN_EIGENVALUE = -0.9  # smallest s^2; the eigenvalues of P^-1 are 1 + s^2
MIN_VARIANCE = 1e-12
MIN_DEVIATION = 1e-4  # of a measured z; the map is linear across less, and needs no updates

N_CHECK_SAMPLES = 1024  # of step 6


class ReadPoints(np.ndarray):
    """Places and values that are checked already, unlike an array from a user."""


def _points(value: Any, info: pydantic.ValidationInfo) -> Array:
    """Return an array from a measurement: rows with x (and y on a plane), and a row with values.

    Rows hold x (and y), then the values. A node without a value is left
    out.

    >>> from types import SimpleNamespace
    >>> info = SimpleNamespace(context=None)
    >>> points = _points({"values": [4.0, np.nan, 6.0], "x": [1.0, 2.0, 3.0]}, info)
    >>> points.tolist(), points.flags.writeable, _points(points, info) is points
    ([[1.0, 3.0], [4.0, 6.0]], False, True)
    >>> import xarray as xr
    >>> plane = xr.DataArray(
    ...     [[4.0, 5.0], [6.0, 7.0]], {"y": [8.0, 9.0], "x": [1.0, 2.0]}, ("y", "x")
    ... )
    >>> _points(plane, info).tolist()
    [[1.0, 1.0, 2.0, 2.0], [8.0, 9.0, 8.0, 9.0], [4.0, 6.0, 5.0, 7.0]]

    The reader of a study file gets the path and the property:

    >>> def read(path, quantity):
    ...     return {"x": [3.0], "values": [{"strength": 4.0, "critical_slip": 5.0}[quantity]]}
    >>> _points("a.csv", SimpleNamespace(context={"read": read})).tolist()
    [[3.0], [4.0]]
    >>> context = {"read": read, "quantity": "critical_slip"}
    >>> _points("a.csv", SimpleNamespace(context=context)).tolist()
    [[3.0], [5.0]]
    >>> _points({"x": [1.0, np.nan], "values": [2.0, 3.0]}, info)
    Traceback (most recent call last):
    ...
    ValueError: coordinates must be finite. Values must be finite, or NaN if not measured
    """
    if isinstance(value, ReadPoints):
        return value
    context = info.context or {}
    if "read" in context and not hasattr(value, "dims"):
        value = context["read"](value, context.get("quantity", "strength"))
        value = value.to_xarray() if hasattr(value, "to_xarray") else value
    if isinstance(value, dict) and "values" in value:
        rows = [value[name] for name in ("x", "y", "values") if name in value]
    else:
        names = sorted(getattr(value, "dims", ()))
        if names not in (["x"], ["x", "y"]) or not set(names) <= set(value.coords):
            raise ValueError(
                "must be a DataArray with coordinates x (m), or x and y on a plane, such as"
                " st.read_profile(path) returns"
            )
        axes = (in_si(value[name], ("m",))[0] for name in names)
        rows = [*np.meshgrid(*axes, indexing="ij"), _values(value.transpose(*names))]
    points = np.array([np.ravel(row) for row in rows], dtype=np.float64)
    if np.isinf(points).any() or np.isnan(points[:-1]).any():
        raise ValueError(
            "coordinates must be finite. Values must be finite, or NaN if not measured"
        )
    points = points[:, ~np.isnan(points[-1])]
    if points.shape[1] == 0:
        raise ValueError("must hold at least one value")
    points.flags.writeable = False
    return points.view(ReadPoints)


def _values(array: Any) -> Array:
    """Return the values of a labelled array in SI. The stated unit determines the property.

    >>> import xarray as xr
    >>> def in_unit(units):
    ...     return _values(xr.DataArray([1.5, 0.25], attrs={"units": units})).tolist()
    >>> in_unit("MPa"), in_unit(""), in_unit("N/mm")
    ([1500000.0, 250000.0], [1.5, 0.25], [1500.0, 250.0])
    >>> in_unit("K")
    Traceback (most recent call last):
    ...
    ValueError: must be in SI or state the unit of a property, got 'K'
    """
    stated = stated_unit(array) or "1"
    known = [
        quantity.units for quantity in QUANTITIES.values() if is_in(stated, quantity.units)
    ]
    if not known:
        raise ValueError(f"must be in SI or state the unit of a property, got {stated!r}")
    return in_si(array, (known[0] if stated_unit(array) else "1",))[0]


def _table(points: Array) -> dict[str, list[float]]:
    """Return the rows by name, as a study file shows them.

    >>> _table(np.array([[1.0, 2.0], [7.0, 9.0]]))
    {'x': [1.0, 2.0], 'values': [7.0, 9.0]}
    >>> _table(np.array([[1.0], [3.0], [7.0]]))
    {'x': [1.0], 'y': [3.0], 'values': [7.0]}
    """
    names = ("x", "values") if len(points) == 2 else ("x", "y", "values")
    return dict(zip(names, points.tolist(), strict=True))


Points = Annotated[Any, BeforeValidator(_points), PlainSerializer(_table)]


@model
class Conditions:
    """Measured values and their standard error, in the field's unit."""

    profile: Points
    noise: Positive

    @property
    def places(self) -> Array:
        """Places of the measured values, m, with shape (dimensions, points).

        >>> Conditions(
        ...     {"x": [1.0, 2.0], "y": [3.0, 4.0], "values": [5.0, 6.0]}, 0.1
        ... ).places.tolist()
        [[1.0, 2.0], [3.0, 4.0]]
        """
        return np.asarray(self.profile[:-1])

    @property
    def values(self) -> Array:
        """Measured values with shape (points,).

        >>> Conditions(
        ...     {"x": [1.0, 2.0], "y": [3.0, 4.0], "values": [5.0, 6.0]}, 0.1
        ... ).values.tolist()
        [5.0, 6.0]
        """
        return np.asarray(self.profile[-1])

    def check(self, marginal: Any, interface: Interface) -> None:
        """Raise an `InputError` if places or values are impossible for a field.

        The ends belong to the interface, and a value may lie four errors
        outside the marginal, here from 1 to 3.

        >>> import scipy.stats
        >>> from types import SimpleNamespace
        >>> law, line = (
        ...     SimpleNamespace(distribution=scipy.stats.uniform(1.0, 2.0)),
        ...     Interface(0.1, 8),
        ... )
        >>> Conditions({"x": [0.0, 0.1], "values": [0.0, 4.0]}, 0.25).check(law, line)
        >>> def mistakes(interface, **profile):
        ...     try:
        ...         Conditions(profile, 0.25).check(law, interface)
        ...     except InputError as error:
        ...         return [
        ...             text.removeprefix("conditions.profile: ")[:75]
        ...             for text in error.problems
        ...         ]
        >>> for text in mistakes(line, x=[0.02, 0.11], values=[4.5, -0.25]):
        ...     print(text)
        x reaches from 0.02 to 0.11 m, but the interface is 0.1 m long
        4.5 at [0.02] m lies outside the marginal, 1 to 3, by more than 4 times its
        >>> plane = Interface((0.1, 0.3), (8, 8))
        >>> mistakes(plane, x=[0.0, 0.1], y=[-0.02, 0.3], values=[2.0, 2.0])
        ['y reaches from -0.02 to 0.3 m, but the interface is 0.3 m long']
        >>> mistakes(plane, x=[0.0], y=[0.2], values=[-0.25])
        ['-0.25 at [0.0, 0.2] m lies outside the marginal, 1 to 3, by more than 4 tim']
        """
        names, places = interface.dims, self.places
        if len(places) != len(names):
            raise InputError(
                "conditions.profile: must have a coordinate for each dimension of the interface"
                f" ({', '.join(names)}), got {len(places)}"
            )
        problems = [
            f"conditions.profile: {name} reaches from {row.min():g} to {row.max():g} m, but"
            f" the interface is {length:g} m long"
            for name, row, length in zip(names, places, interface.lengths, strict=True)
            if row.min() < -1e-9 * length or row.max() > length * (1.0 + 1e-9)
        ]
        low, high = marginal.distribution.support()
        outside = np.maximum(low - self.values, self.values - high)
        if outside.max() > MAX_ERRORS_OUTSIDE * self.noise:
            *place, value = self.profile[:, outside.argmax()].tolist()
            problems.append(
                f"conditions.profile: {value:g} at {place} m lies outside the marginal, {low:g} to"
                f" {high:g}, by more than {MAX_ERRORS_OUTSIDE:g} times its error of {self.noise:g}"
            )
        if problems:
            raise InputError(problems)


class Measured(NamedTuple):
    """Values of one or several properties, measured at places where z is phi @ draws."""

    properties: list[tuple[Any, int]]  # marginals, and numbers of their places in a row
    values: Array  # (places,)
    noise: Array  # standard deviations, (places,)
    phi: Array  # (places, dimension)

    def by_marginal(self, of_places: Array) -> Iterator[tuple[Any, Array]]:
        """Yield each property's marginal, with its part of an array (places, ...).

        >>> measured = Measured(
        ...     [("first", 2), ("second", 1)], np.zeros(3), np.ones(3), np.eye(3)
        ... )
        >>> [
        ...     (law, part.tolist())
        ...     for law, part in measured.by_marginal(np.array([7.0, 8.0, 9.0]))
        ... ]
        [('first', [7.0, 8.0]), ('second', [9.0])]
        """
        marginals, counts = zip(*self.properties, strict=True)
        return zip(marginals, np.split(of_places, np.cumsum(counts)[:-1]), strict=True)

    def log_likelihood(self, z: Array) -> Array:
        """Return log l_k at every place and z (places, ...), also without a quantile.

        The maps 5 + 2 z and 10 z, where the second has no quantile below 0.

        >>> from types import SimpleNamespace
        >>> first = SimpleNamespace(of_normal=lambda z: 5.0 + 2.0 * z)
        >>> second = SimpleNamespace(of_normal=lambda z: np.where(z < 0.0, np.nan, 10.0 * z))
        >>> values, noise = np.array([6.0, 3.0]), np.array([0.5, 2.0])
        >>> measured = Measured([(first, 1), (second, 1)], values, noise, np.eye(2))
        >>> measured.log_likelihood(np.array([1.0, 0.0])).tolist()
        [-2.0, -1.125]
        >>> measured.log_likelihood(np.array([[0.75, 1.5], [0.5, -1.0]])).tolist()
        [[-0.5, -8.0], [-0.5, -1000000000.0]]
        """
        shape = (-1, *(1 for _ in z.shape[1:]))
        mapped = np.concatenate([from_normal(*part) for part in self.by_marginal(z)])
        misfit = (self.values.reshape(shape) - mapped) * (1.0 / self.noise).reshape(shape)
        # Far out in the tail scipy may have no quantile.
        likely = np.where(np.isnan(misfit), -np.inf, -0.5 * misfit**2)
        return np.maximum(likely, LOG_OF_IMPOSSIBLE)

    def gaussian(self, mean: Array, variance: Array) -> tuple[Array, Array]:
        """Step 2: return b and p (places,) from mean and variance of z given all other values.

        If v = m + s z, then p = (s / noise)^2 and b = s (v - m) / noise^2,
        whatever the mean and the variance are. They contradict the values here.

        >>> from types import SimpleNamespace
        >>> import scipy.stats
        >>> first = SimpleNamespace(
        ...     distribution=scipy.stats.norm(5.0, 2.0), of_normal=lambda z: 5.0 + 2.0 * z
        ... )
        >>> second = SimpleNamespace(
        ...     distribution=scipy.stats.norm(0.0, 10.0), of_normal=lambda z: 10.0 * z
        ... )
        >>> values, noise = np.array([6.0, 6.0, 120.0, -120.0]), np.array([0.5, 0.5, 2.0, 2.0])
        >>> measured = Measured([(first, 2), (second, 2)], values, noise, np.eye(4))
        >>> mean, variance = (
        ...     np.array([20.0, -20.0, 0.2, -0.2]),
        ...     np.array([0.01, 0.01, 1.5, 1.5]),
        ... )
        >>> b, p = measured.gaussian(mean, variance)
        >>> b.round(6).tolist(), p.round(6).tolist()
        ([8.0, 8.0, 300.0, -300.0], [16.0, 16.0, 25.0, 25.0])
        """
        # The range of z in which likelihood and normal distribution
        # both matter. Of the probabilities below and above, the smaller
        # gives z.
        edges = self.values[:, None] + HALF_WIDTH * self.noise[:, None] * np.array([-1.0, 1.0])
        parts = [(law.distribution, part) for law, part in self.by_marginal(edges)]
        below = np.concatenate([law.cdf(part) for law, part in parts])
        above = np.concatenate([law.sf(part) for law, part in parts])
        likely = np.where(below < 0.5, ndtri(below), -ndtri(above)).clip(-MAX_Z, MAX_Z).T
        width = HALF_WIDTH * np.sqrt(variance)
        # If a value contradicts the others, the product peaks between both
        # ranges. Search both, and narrow the search around the peak.
        low, high = np.minimum(likely[0], mean - width), np.maximum(likely[1], mean + width)
        rows, last_node = np.arange(len(mean)), RANGE_NODES - 1
        for _ in range(MAX_NARROWINGS):
            half_range = np.maximum(0.5 * (high - low), MIN_HALF_RANGE)[:, None]
            z = 0.5 * (low + high)[:, None] + half_range * np.linspace(-1.0, 1.0, RANGE_NODES)
            square = (z - mean[:, None]) ** 2 / variance[:, None]
            log_density = self.log_likelihood(z) - 0.5 * square
            near = log_density > log_density.max(axis=1, keepdims=True) - 0.5 * HALF_WIDTH**2
            first, last = near.argmax(axis=1), last_node - near[:, ::-1].argmax(axis=1)
            first, last = np.maximum(first - 1, 0), np.minimum(last + 1, last_node)
            if not (2 * (last - first) < RANGE_NODES).any():  # fine enough
                break
            low, high = z[rows, first], z[rows, last]
        # Mean and variance of the product, and
        # the Gaussian that gives the same.
        weight = np.exp(log_density - log_density.max(axis=1, keepdims=True))
        total = weight.sum(axis=1)
        centre = (weight * z).sum(axis=1) / total
        spread = (weight * (z - centre[:, None]) ** 2).sum(axis=1) / total
        spread = np.maximum(spread, (half_range[:, 0] / RANGE_NODES) ** 2)
        precision = 1.0 / spread - 1.0 / variance
        return centre / spread - mean / variance, precision


class Regression(NamedTuple):
    """Step 3: posterior (2) of the draws, given the Gaussian measured values."""

    power: Array  # s^2, (directions,)
    right: Array  # V, (dimension, directions)
    data: Array  # V' sum_k b_k phi_k, (directions,)

    def moments(self, phi: Array) -> tuple[Array, Array]:
        """Return the mean and standard deviation of z = phi @ draws, with shape (points,).

        The second direction is the third draw. The first row has a part in no
        direction, with the variance 0.16, and the second row has none.

        >>> right = np.array([[0.6, 0.0], [0.8, 0.0], [0.0, 1.0]])
        >>> regression = Regression(np.array([3.0, 0.25]), right, np.array([2.0, 0.5]))
        >>> mean, deviation = regression.moments(np.array([[1.0, 2.0, 2.0], [0.6, 0.8, 0.0]]))
        >>> mean.round(6).tolist()  # 2.2 * 2 / 4 + 2 * 0.5 / 1.25, and 2 / 4
        [1.9, 0.5]
        >>> (deviation**2).round(6).tolist()  # 2.2^2 / 4 + 2^2 / 1.25 + 0.16, and 1 / 4
        [4.57, 0.25]
        """
        along, gain = phi @ self.right, 1.0 + self.power
        # Variance in directions that no measurement changes.
        free = (phi**2).sum(axis=1) - (along**2).sum(axis=1)
        variance = along**2 @ (1.0 / gain) + np.where(free > MIN_VARIANCE, free, 0.0)
        return along @ (self.data / gain), np.sqrt(variance)


class Conditioning(NamedTuple):
    """Map from standard normal draws to draws given measured values. See `conditioned`."""

    regression: Regression
    # Largest errors over all places: of the mean of z in standard
    # deviations, and of the standard deviation, as a fraction.
    error: tuple[float, float]
    misfit: float  # squared, of values and of draws at the mean of the posterior
    points: int

    def draws(self, draws: Array) -> Array:
        """Return mu + P^(1/2) a for each row a of standard normal draws (samples, dimension).

        >>> right = np.array([[0.6, 0.0], [0.8, 0.0], [0.0, 1.0]])
        >>> regression = Regression(np.array([3.0, 8.0]), right, np.array([2.0, 1.8]))
        >>> conditioning, draws = Conditioning(regression, (0.0, 0.0), 0.0, 2), np.zeros((2, 3))
        >>> draws[1] = 1.0, 2.0, 3.0
        >>> conditioning.draws(draws).round(6).tolist()  # a = 0 gives the mean
        [[0.3, 0.4, 0.2], [0.64, 1.52, 1.2]]
        >>> draws.tolist()
        [[0.0, 0.0, 0.0], [1.0, 2.0, 3.0]]
        """
        right, gain = self.regression.right, 1.0 + self.regression.power
        mean, factors = self.regression.data / gain, gain**-0.5 - 1.0
        # Sample by sample and without BLAS, so that a sample does not
        # depend on its batch and on the number of threads.
        conditioned, across = np.array(draws), np.ascontiguousarray(right.T)
        for row in conditioned:
            weights = mean + factors * np.einsum("j,jk->k", row, right)
            row += np.einsum("k,kj->j", weights, across)
        return conditioned

    def warn(self) -> None:
        """Warn about measured values that do not suit the field.

        For two values, 12 is the largest misfit without a warning.

        >>> def texts(error, misfit):
        ...     with collect_warnings() as warned:
        ...         Conditioning(None, error, misfit, 2).warn()
        ...     return [str(warning) for warning in warned]
        >>> from stiction.base.errors import collect_warnings
        >>> texts((0.1, 0.1), 12.0)
        []
        >>> texts((0.0, 0.0), 12.5)[0][:79]
        'conditions: the measured values are unlikely for this field (chi-square 12.5 fo'
        >>> texts((0.05, 0.12), 0.0)[0][60:131]
        'with errors up to about 0.05 standard deviations in the mean, and 12 % '
        >>> len(texts((0.12, 0.0), 99.0))
        2
        """
        if self.misfit > self.points + MAX_CHI_SQUARE * np.sqrt(2.0 * self.points):
            warn_accuracy(
                "conditions: the measured values are unlikely for this field (chi-square"
                f" {self.misfit:.4g} for {self.points} values). Check marginal, length and noise"
            )
        if max(self.error) > MAX_POSTERIOR_ERROR:
            mean, deviation = self.error
            warn_accuracy(
                "conditions: the field is approximate where it was measured, with errors up to"
                f" about {mean:.2g} standard deviations in the mean, and {100.0 * deviation:.3g} %"
                " in the standard deviation. Average neighbouring values, and give their noise"
            )


def conditioned(measured: Measured) -> Conditioning:
    """Condition draws on measured values of properties, with the algorithm in this file.

    If the maps are straight, formula (2) holds exactly with p = (s /
    noise)^2 and b = s (v - m) / noise^2.

    >>> from types import SimpleNamespace
    >>> import scipy.stats
    >>> first = SimpleNamespace(
    ...     distribution=scipy.stats.norm(5.0, 2.0), of_normal=lambda z: 5.0 + 2.0 * z
    ... )
    >>> second = SimpleNamespace(
    ...     distribution=scipy.stats.norm(0.0, 10.0), of_normal=lambda z: 10.0 * z
    ... )
    >>> phi, p, b = (
    ...     np.array([[0.6, 0.8], [0.0, 1.0]]),
    ...     np.array([16.0, 25.0]),
    ...     np.array([8.0, 7.5]),
    ... )
    >>> values, noise = np.array([6.0, 3.0]), np.array([0.5, 2.0])
    >>> known = conditioned(Measured([(first, 1), (second, 1)], values, noise, phi))
    >>> covariance = np.linalg.inv(np.eye(2) + phi.T @ (p[:, None] * phi))
    >>> mean, deviation = known.regression.moments(np.eye(2))
    >>> (
    ...     np.allclose(mean, covariance @ phi.T @ b),
    ...     np.allclose(deviation**2, np.diag(covariance)),
    ... )
    (True, True)
    >>> misfits = values - [5.0, 0.0] - [2.0, 10.0] * (phi @ mean)
    >>> np.isclose(known.misfit, np.sum((misfits / noise) ** 2) + mean @ mean).item()
    True
    >>> max(known.error) < 1e-9, known.points
    (True, 2)

    Two values at one place, with the map exp(z / 2), give almost the same
    as integrals over z:

    >>> law = SimpleNamespace(
    ...     distribution=scipy.stats.lognorm(0.5), of_normal=lambda z: np.exp(0.5 * z)
    ... )
    >>> values, noise = np.array([2.9, 2.1]), np.array([0.4, 0.5])
    >>> known = conditioned(Measured([(law, 2)], values, noise, np.ones((2, 1))))
    >>> z = np.linspace(-8.0, 8.0, 4001)
    >>> misfits = (values[:, None] - np.exp(0.5 * z)) / noise[:, None]
    >>> density = np.exp(-0.5 * z**2 - 0.5 * (misfits**2).sum(axis=0))
    >>> mean = density @ z / density.sum()
    >>> deviation = np.sqrt(density @ (z - mean) ** 2 / density.sum())
    >>> found = known.regression.moments(np.eye(1))
    >>> bool(abs(found[0] - mean) < 0.003), bool(abs(found[1] - deviation) < 0.006)
    (True, True)
    """
    phi = measured.phi
    # 1. and 2. Gaussians as if each value were the only one.
    cavity = np.zeros(len(phi)), np.ones(len(phi))
    shift, precision = measured.gaussian(*cavity)
    for update in range(1, MAX_UPDATES + 1):
        # 3. and 4. All values together, and z at each place given all
        # other values.
        regression, shift, precision = _regression(phi, shift, precision)
        previous_mean, cavity = cavity[0], _from_others(phi, regression, shift, precision)
        # 5. End before new Gaussians: step 6 divides by the Gaussians
        # of the regression.
        if np.abs(cavity[0] - previous_mean).max() < SETTLED_MEAN or update == MAX_UPDATES:
            break
        shift, precision = measured.gaussian(*cavity)
    # 6. The regression gives z = mean + (along / gain) w with standard normal w.
    along, gain = phi @ regression.right, np.sqrt(1.0 + regression.power)
    draws = regression.data / gain**2
    mean = along @ draws
    error = _estimate_error(measured, shift, precision, mean, along / gain)
    # 7. Squared misfits of the values and of the draws.
    misfit = -2.0 * float(measured.log_likelihood(mean).sum()) + float(draws @ draws)
    return Conditioning(regression, error, misfit, len(phi))


def _estimate_error(
    measured: Measured, shift: Array, precision: Array, mean: Array, slopes: Array
) -> tuple[float, float]:
    """Step 6: compare samples of z = mean + slopes w with the same samples, weighted by (1).

    Without a Gaussian, b = p = 0, samples with the variance 1/4 get the
    weight of a value with p = 4. Their mean moves from 0.3 to 0.4, and their
    variance falls to 1/8.

    >>> from types import SimpleNamespace
    >>> law = SimpleNamespace(of_normal=lambda z: 5.0 + 2.0 * z)
    >>> measured = Measured([(law, 1)], np.array([6.0]), np.array([1.0]), np.eye(1))
    >>> mean, slopes = np.array([0.3]), np.array([[0.5]])
    >>> errors = _estimate_error(measured, np.zeros(1), np.zeros(1), mean, slopes)
    >>> [round(error, 1) for error in errors]  # 0.1 / 0.5 and 1 - 0.5^0.5
    [0.2, 0.3]
    >>> max(_estimate_error(measured, np.array([2.0]), np.array([4.0]), mean, slopes)) < 1e-9
    True
    """
    draws = np.random.default_rng(0).standard_normal((N_CHECK_SAMPLES, slopes.shape[1]))
    z = draws @ slopes.T  # less its mean
    # The Gaussians are scaled to 1 at the mean, because a constant
    # factor at a place does not matter.
    gaussian = z * (shift - precision * mean - 0.5 * precision * z)
    log_weight = (measured.log_likelihood(mean[:, None] + z.T) - gaussian.T).sum(axis=0)
    weight = np.exp(log_weight - log_weight.max())
    # Truncated weights, so that a few samples do not dominate.
    weight = np.minimum(weight / weight.mean(), np.sqrt(N_CHECK_SAMPLES))
    weight /= weight.sum()
    plain_mean, plain_deviation = z.mean(axis=0), z.std(axis=0)
    weighted_mean = weight @ z
    weighted_deviation = np.sqrt(weight @ (z - weighted_mean) ** 2)
    return (
        float(np.abs((weighted_mean - plain_mean) / plain_deviation).max()),
        float(np.abs(weighted_deviation / plain_deviation - 1.0).max()),
    )


def _regression(phi: Array, shift: Array, precision: Array) -> tuple[Regression, Array, Array]:
    """Step 3: return the regression, with b and p, which are reduced if they have no posterior.

    The rows may have any precision, also a negative one.

    >>> phi, b, p = (
    ...     np.array([[0.6, 0.8], [1.0, 0.0]]),
    ...     np.array([2.0, 0.7]),
    ...     np.array([3.0, -0.5]),
    ... )
    >>> def is_right(b, p):
    ...     covariance = np.linalg.inv(np.eye(2) + phi.T @ (p[:, None] * phi))
    ...     mean, deviation = _regression(phi, b, p)[0].moments(np.eye(2))
    ...     close = np.allclose(mean, covariance @ phi.T @ b)
    ...     return close and np.allclose(deviation**2, np.diag(covariance))
    >>> is_right(b, p), is_right(b, np.array([3.0, 5.0])), is_right(b, np.array([3.0, 0.0]))
    (True, True, True)

    p = -2 has no posterior. It is reduced until P^-1 - 1 is -0.45, and b by
    the same factor.

    >>> regression, b, p = _regression(np.eye(1), np.array([3.0]), np.array([-2.0]))
    >>> regression.power.round(6).tolist(), b.round(6).tolist(), p.round(6).tolist()
    ([-0.45], [0.675], [-0.45])
    >>> _regression(phi[[0, 0]], np.ones(2), np.array([3.0, 2.0]))[0].power.round(6).tolist()
    [5.0]
    """
    scale = np.sqrt(np.maximum(np.abs(precision), MIN_SCALE))
    left, singular, right = svd(phi * scale[:, None], full_matrices=False)
    kept = singular > MIN_SINGULAR_VALUE
    left, singular, right = left[:, kept] * singular[kept], singular[kept], right[kept].T
    power, sign = singular**2, precision / scale**2
    if (sign < 1.0).any():
        # (U s)' sign (U s) = Q diag(power) Q', so that P is diagonal in V Q.
        power, turn = eigh(left.T * sign @ left)
        left, right = left @ turn, right @ turn
        if power.size and power[0] < MIN_EIGENVALUE:
            share = 0.5 * MIN_EIGENVALUE / power[0]
            return _regression(phi, share * shift, share * precision)
    data = shift @ (left / scale[:, None])
    return Regression(power, np.ascontiguousarray(right), data), shift, precision


def _from_others(
    phi: Array, regression: Regression, shift: Array, precision: Array
) -> tuple[Array, Array]:
    """Step 4: return the mean and variance of z at each place, given the values at other places.

    Given the other value only, z of the first row has the mean 0.6 (-1/3)
    and the variance 0.6^2 / 3 + 0.8^2.

    >>> phi, b, p = (
    ...     np.array([[1.0, 0.0], [0.6, 0.8]]),
    ...     np.array([1.5, -1.0]),
    ...     np.array([3.0, 2.0]),
    ... )
    >>> mean, variance = _from_others(phi, _regression(phi, b, p)[0], b, p)
    >>> mean.round(6).tolist(), variance.round(6).tolist()
    ([-0.2, 0.225], [0.76, 0.73])

    At least half the precision without measurements remains, and a sharp
    value needs no others:

    >>> row, b, p = np.array([[2.0]]), np.array([1.5]), np.array([3.0])
    >>> mean, variance = _from_others(row, _regression(row, b, p)[0], b - 0.25, p + 0.2)
    >>> mean.round(6).tolist(), variance.round(6).tolist()
    ([2.0], [8.0])
    >>> row, p = np.array([[1.0]]), np.array([1e9])
    >>> [part.tolist() for part in _from_others(row, _regression(row, b, p)[0], b, p)]
    [[0.0], [1.0]]
    """
    mean, deviation = regression.moments(phi)
    least = 0.5 / (phi**2).sum(axis=1)
    remaining = np.maximum(deviation**-2 - precision, least)
    # Across a small deviation the map is linear, and the difference
    # would be round-off.
    sharp = deviation < MIN_DEVIATION
    cavity_mean = (mean / deviation**2 - shift) / remaining
    return np.where(sharp, 0.0, cavity_mean), np.where(sharp, 1.0, 1.0 / remaining)


def lower_factor(matrix: Array) -> Array:
    """Return the lower triangular L with L L^T = matrix, which may be singular.

    The first two properties determine the third one below.

    >>> lower_factor(np.array([[1.0, 0.6, 0.96], [0.6, 1.0, 0.8], [0.96, 0.8, 1.0]])).round(
    ...     6
    ... ).tolist()
    [[1.0, 0.0, 0.0], [0.6, 0.8, 0.0], [0.96, 0.28, 0.0]]
    >>> lower_factor(np.array([[4.0, 4.0, 2.0], [4.0, 4.0, 2.0], [2.0, 2.0, 10.0]])).tolist()
    [[2.0, 0.0, 0.0], [2.0, 0.0, 0.0], [1.0, 0.0, 3.0]]
    """
    size = matrix.shape[0]
    factor = np.zeros_like(matrix)
    for j in range(size):
        pivot = matrix[j, j] - float(factor[j, :j] @ factor[j, :j])
        if pivot <= MIN_PIVOT:
            continue  # the properties before it determine property j
        root = factor[j, j] = np.sqrt(pivot)
        factor[j + 1 :, j] = (matrix[j + 1 :, j] - factor[j + 1 :, :j] @ factor[j, :j]) / root
    return factor


@lru_cache(maxsize=64)
def conditioning_of(
    random: Any, interface: Interface
) -> tuple[NDArray[np.int64], Conditioning] | None:
    """Return the columns of the conditioned draws and their conditioning, or None.

    `random` is a `stiction.random.fields.RandomInterface`.

    The residual strength was measured at one place, and has the correlation
    0.6 with the strength. Its z at this place has the mean (2 / 0.5) (6 -
    5) / 0.5 / (1 + (2 / 0.5)^2).

    >>> import scipy.stats
    >>> import stiction as st
    >>> field = st.RandomField(scipy.stats.norm(5.0, 2.0), st.SquaredExponentialSpectrum(0.05))
    >>> line, value = Interface(0.1, 16), {"x": [0.03], "values": [6.0]}
    >>> random = st.RandomInterface(
    ...     strength=field,
    ...     residual_strength=field.given(value, noise=0.5),
    ...     normal_pressure=field,
    ...     correlation={("strength", "residual_strength"): 0.6},
    ... )
    >>> columns, known = conditioning_of(random, line)
    >>> basis = field.modes(line).basis(np.array([[0.03]]))
    >>> columns.tolist() == list(range(2 * basis.size))
    True
    >>> mean = known.draws(np.zeros((1, columns.size)))
    >>> (np.hstack([0.6 * basis, 0.8 * basis]) @ mean.T).round(6).tolist(), round(8.0 / 17.0, 6)
    ([[0.470588]], 0.470588)
    >>> conditioning_of(st.RandomInterface(strength=field), line) is None
    True
    """
    if all(field.conditions is None for field in random.properties.values()):
        return None
    streams = layout(random, interface)
    columns, factor = [np.r_[stream.columns] for stream in streams], lower_factor(random.matrix)
    marginals, noises, values, rows = [], [], [], []
    for i, (name, field) in enumerate(random.properties.items()):
        if (conditions := field.conditions) is None:
            continue
        conditions.check(field.marginal, interface)
        shape = conditions.values.size, random.dimension(interface)
        check_memory(f"{name}.conditions.profile", 24.0 * np.prod(shape), "Give fewer places")
        # z combines the property's own draws with the draws of
        # earlier properties.
        basis, phi = field.modes(interface).basis(conditions.places), np.zeros(shape)
        for j in np.flatnonzero(factor[i]):
            phi[:, columns[j][streams[i].of_property]] = factor[i, j] * basis
        marginals.append((field.marginal, shape[0]))
        noises.append(np.full(shape[0], conditions.noise))
        values.append(conditions.values)
        rows.append(phi)
    whole = np.concatenate(rows)
    used = np.flatnonzero(whole.any(axis=0))
    measured, errors = np.concatenate(values), np.concatenate(noises)
    return used, conditioned(Measured(marginals, measured, errors, whole[:, used]))
