"""A field that was measured in places: values with errors, and the field elsewhere.

A Gaussian field is a linear function of its draws, z(x) = phi(x)^T a with a standard
normal. So measured z_k = phi(x_k)^T a + e_k are a linear regression, whose posterior is

    a | z ~ N(mu, P),  P = (1 + Psi^T Psi)^-1,  mu = P Psi^T (z_k/error_k)

with Psi = phi(x_k)/error_k. So mu + P^(1/2) a with the symmetric root turns the usual
draws into conditioned ones, of the distribution that Matheron's rule gives (Journel and
Huijbregts, 1978; Doucet, 2010). With the singular values of Psi = U s V^T, P^(1/2) =
1 + V ((1 + s^2)^(-1/2) - 1) V^T is well conditioned however densely a smooth field was
measured.

Values are measured of the marginal and not of z. Their likelihood, a function of z at each
place, is replaced by the Gaussian of the same mean and variance, in turns with the
regression (expectation propagation; Minka, 2001). Where that is not enough, draws are
mapped before the regression (`stiction.random.transport`).
"""

from collections.abc import Sequence
from typing import Annotated, Any, NamedTuple

import numpy as np
import pydantic
from numpy.typing import NDArray
from pydantic import BeforeValidator, PlainSerializer
from scipy.linalg import eigh, svd
from scipy.special import ndtri

from stiction.base.arrays import Array
from stiction.base.errors import InputError, warn_accuracy
from stiction.base.model import Positive, model
from stiction.base.units import is_in
from stiction.base.variables import QUANTITIES
from stiction.problem.interface import Interface
from stiction.problem.profiles.placing import MEASURED
from stiction.problem.profiles.reading import in_si, unit_of
from stiction.random.mapping import from_normal
from stiction.random.synthesis import condition
from stiction.random.transport import (
    ErrorEstimate,
    LogRatio,
    Transport,
    make_transport,
    transport,
)

DOUBTFUL = 5.0  # standard deviations of chi-square beyond which values do not suit a field
UNCERTAIN = 0.1  # of a standard deviation of z, by which a posterior may be off
PROBES = 1024  # samples by which quantiles beyond the Gaussian are found
IMPOSSIBLE = 4.0  # errors beyond a bound of the marginal that no measured value has
FURTHEST = 37.0  # largest z whose tail of the normal distribution is a float
REACH, NODES = 8.0, 49  # half width of Gaussians, and nodes across them
CUT = 18.0  # fall of a log density from its peak to the ends that leaves nothing beyond
NARROWINGS = 6  # of a range that holds a peak, each to two of its intervals at least
TURNS, SETTLED = 8, 1e-3  # between likelihood and regression; change of z that ends them
NEGLIGIBLE = 1e-8  # singular value below which a direction of the draws stays as it is
FAINT, LEAST = 1e-10, -0.9  # precisions: of places, as scaled; of all, less that of the prior
SHARP = 1e-4  # error of a measured z that needs no turns
TINY, LOWEST = 1e-12, -1e9  # least variance, and least logarithm of a likelihood


class Kept(np.ndarray):
    """Places and values that were read before, unlike an array that a user gives."""


def _points(value: Any, info: pydantic.ValidationInfo) -> Array:
    """Places (rows x, and y on a plane) and values (last row) of a measurement."""
    if isinstance(value, Kept):
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
                "must be a DataArray over x (m), on a plane over x and y, with coordinates, as"
                " st.read_profile(path) returns it"
            )
        if MEASURED in value.coords:  # what was filled in was not measured
            value = value.where(value[MEASURED].astype(bool))
        each = (in_si(value[name], name, "m") for name in names)
        rows = [*np.meshgrid(*each, indexing="ij"), _values(value.transpose(*names))]
    points = np.array([np.ravel(row) for row in rows], dtype=np.float64)
    if np.isinf(points).any() or np.isnan(points[:-1]).any():
        raise ValueError("places must be known, and values finite, or NaN where not measured")
    points = points[:, ~np.isnan(points[-1])]
    if points.shape[1] == 0:
        raise ValueError("must hold at least one value")
    points.flags.writeable = False
    return points.view(Kept)


def _values(array: Any) -> Array:
    """Values of a labelled array, in the SI unit of whichever property has the one it states."""
    stated = unit_of(array)
    for one in QUANTITIES.values():
        if is_in(stated or "1", one.units):
            return np.asarray(in_si(array, "values", one.units if stated else "1"))
    raise ValueError(
        f"must be in SI or state a known unit, not {stated!r}, which no property has"
    )


def _table(points: Array) -> dict[str, list[float]]:
    names = ("x", "values") if len(points) == 2 else ("x", "y", "values")
    return dict(zip(names, points.tolist(), strict=True))


Points = Annotated[
    Any,
    BeforeValidator(_points),
    PlainSerializer(_table),
]


@model
class Conditions:
    """Measured values of a field and their error, in its unit (`RandomField.given`)."""

    profile: Points
    noise: Positive

    @property
    def places(self) -> Array:
        """Where values were measured, m: (dimensions, points)."""
        return np.asarray(self.profile[:-1])

    @property
    def values(self) -> Array:
        """The measured values, (points,)."""
        return np.asarray(self.profile[-1])

    def check(self, marginal: Any, interface: Interface) -> None:
        """Raise an `InputError` if places or values are impossible for a field."""
        names, places = interface.dims, self.places
        if len(places) != len(names):
            raise InputError(
                f"given.profile: has {len(places)} coordinates, the interface {len(names)}:"
                f" {', '.join(names)}"
            )
        problems = [
            f"given.profile: {name} reaches from {row.min():g} to {row.max():g} m, the interface is"
            f" {length:g} m long"
            for name, row, length in zip(names, places, interface.lengths, strict=True)
            if row.min() < -1e-9 * length or row.max() > length * (1.0 + 1e-9)
        ]
        low, high = marginal.distribution.support()
        away = np.maximum(low - self.values, self.values - high)
        if away.max() > IMPOSSIBLE * self.noise:
            *place, value = self.profile[:, away.argmax()]
            at = ", ".join(f"{name} = {x:g} m" for name, x in zip(names, place, strict=True))
            problems.append(
                f"given.profile: {value:g} at {at} lies outside the marginal, from {low:g} to"
                f" {high:g}, by more than {IMPOSSIBLE:g} times its error of {self.noise:g}"
            )
        if problems:
            raise InputError(problems)


class Measured(NamedTuple):
    """Measured values of one property: z at its places is phi @ draws, (points, dimension)."""

    conditions: Conditions
    marginal: Any
    phi: Array

    def logarithm(self, at: NDArray[np.int64], z: Array) -> Array:
        """Return the log likelihood of places `at` at z (places, ...); -inf without a quantile."""
        value = self.conditions.values[at].reshape(-1, *(1 for _ in z.shape[1:]))
        miss = (value - from_normal(self.marginal, z)) * (1.0 / self.conditions.noise)
        # Far out in the tail scipy may have no quantile.
        return np.where(np.isnan(miss), -np.inf, -0.5 * miss**2)

    def gaussian(self, mean: Array, variance: Array) -> tuple[Array, Array]:
        """Replace the likelihood of z at each place by a Gaussian, given z from all else.

        Returned are p z, and precisions p, which may be negative, (points,).
        """
        law, noise = self.marginal.distribution, self.conditions.noise
        value = self.conditions.values
        # Where the likelihood and z from all else overlap.
        edges = value + REACH * noise * np.array([[-1.0], [1.0]])
        score = _normal_score(law.cdf(edges), law.sf(edges)).clip(-FURTHEST, FURTHEST)
        width = REACH * np.sqrt(variance)
        low, high = np.maximum(score[0], mean - width), np.minimum(score[1], mean + width)
        overlap = low < high
        low, high = np.where(overlap, (low, high), (mean - width, mean + width))

        def evaluate() -> tuple[Array, Array, Array]:
            half = np.maximum(0.5 * (high - low), TINY)[:, None]
            z = 0.5 * (low + high)[:, None] + half * np.linspace(-1.0, 1.0, NODES)
            off = (z - mean[:, None]) ** 2 / variance[:, None]
            return half, z, self.logarithm(np.arange(len(z)), z) - 0.5 * off

        half, z, density = evaluate()
        # Where a value contradicts the others, their product peaks outside or at an end.
        apart = ~overlap | (density[:, [0, -1]].max(axis=1) > density.max(axis=1) - CUT)
        if apart.any():
            low = np.where(apart, np.minimum(score[0], mean - width), low)
            high = np.where(apart, np.maximum(score[1], mean + width), high)
            rows = np.arange(len(z))
            half, z, density = evaluate()
            for _ in range(NARROWINGS):
                near = density > density.max(axis=1, keepdims=True) - 0.5 * REACH**2
                first, last = near.argmax(axis=1), NODES - 1 - near[:, ::-1].argmax(axis=1)
                first, last = np.maximum(first - 1, 0), np.minimum(last + 1, NODES - 1)
                if not (2 * (last - first) < NODES)[apart].any():  # fine enough
                    break
                low = np.where(apart, z[rows, first], low)
                high = np.where(apart, z[rows, last], high)
                half, z, density = evaluate()
        top = density.max(axis=1, keepdims=True)
        weight = np.exp(density - top)
        total = weight.sum(axis=1)
        centre = (weight * z).sum(axis=1) / total
        spread = (weight * (z - centre[:, None]) ** 2).sum(axis=1) / total
        spread = np.maximum(spread, (half[:, 0] / NODES) ** 2)
        precision = 1.0 / spread - 1.0 / variance
        return centre / spread - mean / variance, precision


def _normal_score(below: Array, above: Array) -> Array:
    """z of which these are the probabilities below and above, from the smaller one."""
    return np.where(below < 0.5, ndtri(below), -ndtri(above))


class Regression(NamedTuple):
    """Posterior of the draws given Gaussians for the measured values.

    With the singular values of Psi = U s V^T, turned where precisions have two signs.
    """

    left: Array  # U s over the errors, (points, directions)
    power: Array  # s^2
    right: Array  # V, (dimension, directions)
    data: Array  # s U^T times the values, (1, directions)

    def moments(self, phi: Array) -> tuple[Array, Array]:
        """Return mean and standard deviation of z = phi @ draws, (points,)."""
        along, share = phi @ self.right, 1.0 + self.power
        free = (phi**2).sum(axis=1) - (along**2).sum(axis=1)
        variance = along**2 @ (1.0 / share) + np.where(free > TINY, free, 0.0)
        return along @ (self.data[0] / share), np.sqrt(variance)

    def apply(self, out: Array) -> Array:
        """Turn standard normal draws into those of the posterior, in place."""
        share, transposed = 1.0 + self.power, np.ascontiguousarray(self.right.T)
        condition(self.right, transposed, self.data / share, share**-0.5 - 1.0, out)
        return out


class Conditioning(NamedTuple):
    """Standard normal draws, given what was measured of properties: see `conditioned`."""

    regression: Regression
    mapped: Transport  # of the draws, before the regression
    left_over: ErrorEstimate
    misfit: float  # squared, of values and of draws at the middle of the posterior
    points: int

    def draws(self, draws: Array) -> Array:
        """Return conditioned draws (samples, dimension)."""
        out = np.array(draws)
        if len(self.mapped.basis):
            transport(*self.mapped, out, np.zeros(len(out)))
        return self.regression.apply(out)

    def quantile_at(self, phi: Array, probability: float) -> Array:
        """Return the quantile of z = phi @ draws, (points,); beyond the regression, by samples."""
        mean, deviation = self.regression.moments(phi)
        found = mean + float(ndtri(probability)) * deviation
        if len(self.mapped.basis):
            draws = np.random.default_rng(0).standard_normal((PROBES, phi.shape[1]))
            pair = [self.draws(draws), self.regression.apply(draws.copy())]
            for i, row in enumerate(phi):  # the difference scatters less than either
                ends = [np.quantile(one @ row, probability) for one in pair]
                found[i] += ends[0] - ends[1]
        return found

    def warn(self) -> None:
        """Warn of measured values that do not suit the field."""
        if self.misfit > self.points + DOUBTFUL * np.sqrt(2.0 * self.points):
            warn_accuracy(
                f"given: the measured values are unlikely for this field (chi-square"
                f" {self.misfit:.4g} for {self.points} values): check its marginal, its correlation"
                " length and the noise"
            )
        if max(self.left_over) > UNCERTAIN:
            mean, deviation = self.left_over
            warn_accuracy(
                f"given: the field is approximate where it was measured: its mean is off by up to"
                f" about {mean:.2g} of its standard deviation, and that by up to about"
                f" {100.0 * deviation:.2g} %; average values at neighbouring places, with their"
                " smaller noise"
            )


def conditioned(measured: Sequence[Measured]) -> Conditioning:
    """Condition draws on measured values of properties.

    Likelihood and regression take turns until z from all other places stays; what the
    Gaussians miss is mapped before the regression (`transport`).
    """
    phi = np.concatenate([one.phi for one in measured])
    others = np.zeros(len(phi)), np.ones(len(phi))
    weighted, precision = _gaussians(measured, others)
    for _ in range(TURNS):
        found, weighted, precision = _regressed(phi, weighted, precision)
        before, others = others, _from_others(phi, found, weighted, precision)
        if np.abs(others[0] - before[0]).max() < SETTLED:
            break
        weighted, precision = _gaussians(measured, others)
    along, share = phi @ found.right, np.sqrt(1.0 + found.power)
    middle = along @ (found.data[0] / share**2)
    ratio = _ratio(measured, weighted, precision, middle)
    mapped, left_over = make_transport(ratio, middle, along / share)
    mapped = mapped._replace(basis=np.ascontiguousarray(mapped.basis @ found.right.T))
    none = np.zeros_like(middle)
    likelihood = _ratio(measured, none, none, middle)(np.arange(middle.size), middle)
    draws = found.data[0] / (1.0 + found.power)
    misfit = -2.0 * float(likelihood.sum()) + float(draws @ draws)
    found = found._replace(data=weighted[None, :] @ found.left)
    return Conditioning(found, mapped, left_over, misfit, len(phi))


def _gaussians(
    measured: Sequence[Measured], others: tuple[Array, Array]
) -> tuple[Array, Array]:
    """Gaussians that stand for the measured values, given z from all others."""
    ends = np.cumsum([len(one.phi) for one in measured])[:-1]
    each = zip(measured, *(np.split(part, ends) for part in others), strict=True)
    found = (one.gaussian(*given) for one, *given in each)
    weighted, precision = map(np.concatenate, zip(*found, strict=True))
    return weighted, precision


def _ratio(
    measured: Sequence[Measured], weighted: Array, precision: Array, middle: Array
) -> LogRatio:
    """Logarithm of the likelihood over the Gaussian that stands for it, by place and z."""

    def found(at: NDArray[np.int64], z: Array) -> Array:
        out, shape, begin = np.empty(z.shape), (-1, *(1 for _ in z.shape[1:])), 0
        for one in measured:
            here = (at >= begin) & (at < begin + len(one.phi))
            out[here] = one.logarithm(at[here] - begin, z[here])
            begin += len(one.phi)
        off = z - middle[at].reshape(shape)
        slope = (weighted - precision * middle)[at].reshape(shape)
        gaussian: Array = off * (slope - 0.5 * precision[at].reshape(shape) * off)
        return np.maximum(out, LOWEST) - gaussian

    return found


def _regressed(
    phi: Array, weighted: Array, precision: Array
) -> tuple[Regression, Array, Array]:
    """Find the posterior of the draws, and its Gaussians: as given, or tempered to have one."""
    root = np.sqrt(np.maximum(np.abs(precision), FAINT))
    left, values, right = svd(phi * root[:, None], full_matrices=False)
    kept = values > NEGLIGIBLE
    left, values, right = left[:, kept] * values[kept], values[kept], right[kept].T
    power, sign = values**2, precision / root**2
    if (sign < 1.0).any():
        power, turn = eigh(left.T * sign @ left)
        left, right = left @ turn, right @ turn
        if power.size and power[0] < LEAST:
            share = 0.5 * LEAST / power[0]
            return _regressed(phi, share * weighted, share * precision)
    left = left / root[:, None]
    found = Regression(left, power, np.ascontiguousarray(right), (weighted @ left)[None, :])
    return found, weighted, precision


def _from_others(
    phi: Array, found: Regression, weighted: Array, precision: Array
) -> tuple[Array, Array]:
    """Mean and variance of z at each place from what was measured at all others."""
    mean, deviation = found.moments(phi)
    least = 0.5 / (phi**2).sum(axis=1)
    rest = np.maximum(deviation**-2 - precision, least)
    # Over so small an error the map is linear, and the difference would be round-off.
    sharp = deviation < SHARP
    moved = (mean / deviation**2 - weighted) / rest
    return np.where(sharp, 0.0, moved), np.where(sharp, 1.0, 1.0 / rest)
