"""A field that was measured in places: values with errors, and the field elsewhere.

A Gaussian field is a linear function of its draws, z(x) = phi(x)^T a with a standard normal.
So measured z_k = phi(x_k)^T a + e_k are a linear regression, whose posterior is

    a | z ~ N(mu, P),  P = (1 + Psi^T Psi)^-1,  mu = P Psi^T (z_k/error_k)

with Psi = phi(x_k)/error_k. So mu + P^(1/2) a with the symmetric root turns the usual
draws into conditioned ones, of the distribution that Matheron's rule gives (Journel and
Huijbregts, 1978; Doucet, 2010). With the singular values of Psi = U s V^T, P^(1/2) =
1 + V ((1 + s^2)^(-1/2) - 1) V^T is well conditioned however densely a smooth field was
measured.

Values are measured of the marginal and not of z. Their likelihood, a function of z at each
place, is replaced by the Gaussian of the same mean and variance, in turns with the
regression (expectation propagation; Minka, 2001), which holds near bounds of the marginal,
too.
"""

from collections.abc import Sequence
from typing import Annotated, Any, NamedTuple

import numpy as np
import pydantic
from pydantic import BeforeValidator, PlainSerializer, WithJsonSchema
from scipy.linalg import svd
from scipy.special import ndtri

from stiction.arrays import Array
from stiction.errors import InputError, warn_accuracy
from stiction.interface import Interface
from stiction.model import PROFILE_SCHEMA, Numbers, Positive, check, check_memory, model
from stiction.profiles.placing import MEASURED
from stiction.profiles.units import parse
from stiction.random.mapping import from_normal
from stiction.random.synthesis import condition

DOUBTFUL = 5.0  # standard deviations of chi-square beyond which values do not suit a field
IMPOSSIBLE = 4.0  # errors beyond a bound of the marginal that no measured value has
FURTHEST = 37.0  # largest z whose tail of the normal distribution is a float
REACH, NODES = 8.0, 49  # half width of Gaussians, and nodes across them
TURNS, SETTLED = 8, 1e-3  # between likelihood and regression; change of z that ends them
NEGLIGIBLE = 1e-8  # singular value below which a direction of the draws stays as it is
FLAT, SHARP = 1e-4, 1e-4  # least precision of a measured z; its error that needs no turns
TINY = 1e-12  # least variance


def _points(value: Any, info: pydantic.ValidationInfo) -> Array:
    """Places (rows x, and y on a plane) and values (last row) of a measurement."""
    if isinstance(value, np.ndarray) and value.ndim == 2 and len(value) in (2, 3):  # as kept
        return value
    context = info.context or {}
    if "read" in context and not hasattr(value, "dims"):
        value = context["read"](value, context.get("quantity", "strength"))
    if isinstance(value, dict) and "dims" in value:
        import xarray as xr

        value = xr.DataArray.from_dict(value)
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
        places = np.meshgrid(*(_in_si(value[name]) for name in names), indexing="ij")
        rows = [*places, _in_si(value.transpose(*names))]
    points = np.array([np.ravel(row) for row in rows], dtype=np.float64)
    points = points[:, np.isfinite(points).all(axis=0)]
    if points.shape[1] == 0:
        raise ValueError("must hold at least one value")
    points.flags.writeable = False
    return points


def _in_si(array: Any) -> Array:
    """Values of a labelled array, in SI if it states a unit."""
    stated = str(array.attrs.get("units") or array.attrs.get("unit") or "1")
    unit = parse(stated)
    if unit is None:
        raise ValueError(f"must be in SI or state a known unit, not {stated!r}")
    return np.asarray(check("values", array.values, Numbers)) * unit.factor


def _table(points: Array) -> dict[str, list[float]]:
    names = ("x", "values") if len(points) == 2 else ("x", "y", "values")
    return dict(zip(names, points.tolist(), strict=True))


Points = Annotated[
    Any,
    BeforeValidator(_points),
    PlainSerializer(_table),
    WithJsonSchema({"anyOf": PROFILE_SCHEMA}),
]


@model
class Conditions:
    """Measured values of a field and their error, in its unit (`RandomField.given`)."""

    profile: Points
    noise: Positive

    @property
    def places(self) -> Array:
        """Where values were measured, m: (dimensions, points)."""
        return self.profile[:-1]

    @property
    def values(self) -> Array:
        """The measured values, (points,)."""
        return self.profile[-1]

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

    def gaussian(self, mean: Array, variance: Array) -> tuple[Array, Array]:
        """Replace the likelihood of z at each place by a Gaussian, given z from all else.

        Returned are values of z and their precisions, (points,).
        """
        noise, value = self.conditions.noise, self.conditions.values
        law = self.marginal.distribution
        # Where the likelihood and z from all else overlap.
        edges = value + REACH * noise * np.array([[-1.0], [1.0]])
        below, above = law.cdf(edges), law.sf(edges)
        score = np.where(below < 0.5, ndtri(below), -ndtri(above)).clip(-FURTHEST, FURTHEST)
        width = REACH * np.sqrt(variance)
        low, high = np.maximum(score[0], mean - width), np.minimum(score[1], mean + width)
        low, high = np.where(low < high, (low, high), (mean - width, mean + width))
        half = np.maximum(0.5 * (high - low), TINY)[:, None]
        z = 0.5 * (low + high)[:, None] + half * np.linspace(-1.0, 1.0, NODES)
        off = (z - mean[:, None]) ** 2 / variance[:, None]
        density = -0.5 * (off + ((value[:, None] - from_normal(self.marginal, z)) / noise) ** 2)
        weight = np.exp(density - density.max(axis=1, keepdims=True))
        total = weight.sum(axis=1)
        centre = (weight * z).sum(axis=1) / total
        spread = (weight * (z - centre[:, None]) ** 2).sum(axis=1) / total
        spread = np.maximum(spread, (half[:, 0] / NODES) ** 2)
        precision = np.maximum(1.0 / spread - 1.0 / variance, FLAT)
        return mean + (centre - mean) * (1.0 + 1.0 / (precision * variance)), precision


class Conditioning:
    """Standard normal draws, given what was measured of one or several properties."""

    def __init__(self, measured: Sequence[Measured]) -> None:
        self.phi = np.concatenate([one.phi for one in measured])
        check_memory("given.profile", 24.0 * self.phi.size, "give fewer places")
        ends = np.cumsum([len(one.phi) for one in measured])[:-1]
        mean, variance = np.zeros(len(self.phi)), np.ones(len(self.phi))
        for _ in range(TURNS):
            others = zip(np.split(mean, ends), np.split(variance, ends), strict=True)
            each = [one.gaussian(*rest) for one, rest in zip(measured, others, strict=True)]
            z, precision = map(np.concatenate, zip(*each, strict=True))
            self._regress(z, precision)
            before, (mean, variance) = mean, self._others(z, precision)
            if np.abs(mean - before).max() < SETTLED:
                break

    def _regress(self, z: Array, precision: Array) -> None:
        root = np.sqrt(precision)
        left, values, right = svd(self.phi * root[:, None], full_matrices=False)
        kept = values > NEGLIGIBLE
        self.values = values[kept]
        self.right = np.ascontiguousarray(right[kept].T)
        self.data = z @ (root[:, None] * left[:, kept])
        power = self.values**2
        # z^T (C + S)^-1 z
        self.chi_square = float(precision @ z**2 - power / (1.0 + power) @ self.data**2)

    def _others(self, z: Array, precision: Array) -> tuple[Array, Array]:
        """Mean and variance of z at each place from what was measured at all others."""
        mean, deviation = self.moments(self.phi)
        least = 1.0 / (self.phi**2).sum(axis=1)
        rest = np.maximum(deviation**-2 - precision, least)
        # Over so small an error the map is linear, and the difference would be round-off.
        sharp = deviation < SHARP
        found = (mean / deviation**2 - precision * z) / rest
        return np.where(sharp, 0.0, found), np.where(sharp, 1.0, 1.0 / rest)

    def draws(self, draws: Array) -> Array:
        """Return conditioned draws, (samples, dimension)."""
        out, share = np.array(draws), 1.0 + self.values**2
        transposed = np.ascontiguousarray(self.right.T)
        offsets = self.data * (self.values / share)
        condition(self.right, transposed, offsets, share**-0.5 - 1.0, out)
        return out

    def moments(self, phi: Array) -> tuple[Array, Array]:
        """Return mean and standard deviation of z = phi @ draws, (points,) each."""
        along = phi @ self.right
        share = self.values**2 / (1.0 + self.values**2)
        free = (phi**2).sum(axis=1) - (along**2).sum(axis=1)
        variance = along**2 @ (1.0 - share) + np.where(free > TINY, free, 0.0)
        return along @ (share / self.values * self.data), np.sqrt(variance)

    def warn(self) -> None:
        """Warn of measured values that do not suit the field."""
        points = len(self.phi)
        if self.chi_square > points + DOUBTFUL * np.sqrt(2.0 * points):
            warn_accuracy(
                f"given: the measured values are unlikely for this field (chi-square"
                f" {self.chi_square:.4g} for {points} values): check its marginal, its correlation"
                " length and the noise"
            )
